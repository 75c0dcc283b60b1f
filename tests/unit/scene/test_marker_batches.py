"""Markers of one namespace that are drawn together."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rosglass.scene.displays.marker_batches import _MAX_POINTS as MAX_POINTS
from rosglass.scene.displays.marker_batches import LineBatch, TextBatch, TriangleBatch
from rosglass.scene.render.drawing import Labels, Lines
from rosglass.scene.render.matrices import instance_matrix
from rosglass.scene.render.mesh_shapes import Shape

RED, GREEN = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 0.5)
ZIGZAG = np.array([[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 3]], np.float32)
TURNED = instance_matrix((5, 0, 1), (0.0, 0.0, math.sin(0.4), math.cos(0.4)))


def placed(lines: Lines) -> Any:
    """Return the points of the rows in the group."""
    names = ("start", "end", "before", "after")
    at = np.stack([lines.rows[name] for name in names], axis=1).astype(np.float64)
    return at @ lines.pose[:3, :3].T + lines.pose[:3, 3]


def colors_of(lines: Lines) -> Any:
    return np.stack([lines.rows["first"], lines.rows["last"]], axis=1)


def test_lines_are_what_each_marker_alone_would_be() -> None:
    colors = np.array([RED, GREEN, RED, GREEN], np.float32)
    batch, expected, tints = LineBatch(0.1, (0.0, 0.0, 0.0), None), [], []
    markers = [
        (np.eye(4), ZIGZAG, colors, True),
        (TURNED, ZIGZAG, GREEN, False),
        (TURNED, ZIGZAG[:2], RED, True),
        (np.eye(4), ZIGZAG[::-1], colors, False),
    ]
    for number, (pose, points, color, is_strip) in enumerate(markers):
        batch.put(("a", number), pose, points, color, is_strip)
        alone = Lines(0.1)
        alone.pose = pose
        if is_strip:
            alone.set_strip(points, color)
        else:
            pairs = color if isinstance(color, tuple) else color.reshape(-1, 2, 4)
            alone.set_segments(points.reshape(-1, 2, 3), pairs)
        expected.append(placed(alone))
        tints.append(colors_of(alone))
    batch.flush()
    assert np.allclose(placed(batch.drawable), np.concatenate(expected), atol=1e-6)
    assert np.array_equal(colors_of(batch.drawable), np.concatenate(tints))
    assert not batch.drawable.opaque
    for number in range(3):
        batch.discard(("a", number))
    batch.flush()
    assert np.allclose(placed(batch.drawable), expected[3], atol=1e-6)
    batch.discard(("a", 3))
    batch.flush()
    assert (len(batch), batch.drawable.count) == (0, 0)


def test_triangles_are_what_each_marker_alone_would_be() -> None:
    batch = TriangleBatch(True, (0.0, 0.0, 0.0), None)
    colors = [RED, GREEN, (0.0, 0.0, 1.0, 1.0)]
    shapes = [Shape(ZIGZAG[:3]), Shape(ZIGZAG, colors=[RED] * 4, indices=[0, 1, 2, 1, 2, 3])]
    batch.put(("a", 0), np.eye(4), shapes[0], GREEN)
    batch.put(("a", 1), TURNED, shapes[1], colors[2])
    batch.put(("a", 2), TURNED, shapes[0], RED)
    batch.put(("a", 1), TURNED, shapes[1], (0.5, 1.0, 1.0, 1.0))
    batch.discard(("a", 2))
    batch.flush()
    mesh = batch.drawable
    found = mesh.shape.rows[mesh.shape.faces.reshape(-1)]
    positions = found["position"] @ mesh.pose[:3, :3].T + mesh.pose[:3, 3]
    faces = [shapes[0].rows, shapes[1].rows[shapes[1].faces.reshape(-1)]]
    turned = faces[1]["position"] @ TURNED[:3, :3].T + TURNED[:3, 3]
    assert np.allclose(positions, np.concatenate([faces[0]["position"], turned]), atol=1e-6)
    normals = faces[1]["normal"] @ TURNED[:3, :3].T
    assert np.allclose(found["normal"], np.concatenate([faces[0]["normal"], normals]), atol=1e-6)
    assert found["rgba"].tolist() == [[0, 255, 0, 128]] * 3 + [[128, 0, 0, 255]] * 6
    assert (mesh.count, mesh.lit, mesh.opaque) == (1, True, False)
    assert not batch.has_room(("a", 2), Shape(np.zeros((MAX_POINTS, 3))))
    batch.discard(("a", 0))
    batch.discard(("a", 1))
    batch.flush()
    assert (len(batch), mesh.count) == (0, 0)


def test_batches_have_room_for_a_bounded_number_of_points_and_letters() -> None:
    lines = LineBatch(0.1, (0.0, 0.0, 0.0), None)
    many = np.zeros((MAX_POINTS - 10, 3), np.float32)
    lines.put(("a", 0), np.eye(4), many, RED, True)
    assert lines.has_room(("a", 1), np.zeros((10, 3), np.float32))
    assert not lines.has_room(("a", 1), np.zeros((11, 3), np.float32))
    assert lines.has_room(("a", 0), np.zeros((MAX_POINTS, 3), np.float32))

    texts = TextBatch((0.0, 0.0, 0.0), None)
    long = "word\n" * Labels.MAX_LENGTH
    assert texts.has_room(("a", 0), long)
    texts.put(("a", 0), long, np.zeros(3), 1.0, RED)
    assert not texts.has_room(("a", 1), long)
    assert texts.has_room(("a", 0), long)
    texts.put(("a", 0), "short", np.zeros(3), 1.0, RED)
    assert texts.has_room(("a", 1), "short")
    for number in range(Labels.MAX_COUNT):
        texts.put(("a", number), "", np.zeros(3), 1.0, RED)
    assert not texts.has_room(("a", -1), "")
    texts.flush()
    assert texts.drawable.count == Labels.MAX_COUNT


def test_positions_far_from_the_origin_are_not_rounded() -> None:
    utm = np.array([476_000.123, 5_429_000.456, 0.0])
    origin = np.round(utm, -3).tolist()
    texts, lines = TextBatch(origin, None), LineBatch(0.1, origin, None)
    for number in range(3):
        at = utm + np.array([0.01 * number, 0, 0])
        texts.put(("a", number), f"{number}", at, 1.0, RED)
        lines.put(("a", number), instance_matrix(at), ZIGZAG[:2], RED, True)
    texts.flush()
    lines.flush()
    labels = texts.drawable
    assert labels.texts == ("0", "1", "2")
    found = labels.positions + labels.pose[:3, 3]
    assert np.allclose(found - utm, [[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0]], rtol=0, atol=1e-6)
    found = placed(lines.drawable)[:, 0]
    assert np.allclose(found - utm, [[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0]], rtol=0, atol=1e-6)

"""Markers of one namespace that are drawn together."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rosglass.scene.displays.marker_batches import LineBatch, TextBatch
from rosglass.scene.drawing import Labels, Lines, instance_matrix

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
    batch, expected, tints = LineBatch(0.1, None), [], []
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


def test_batches_have_room_for_a_bounded_number_of_points_and_letters() -> None:
    lines = LineBatch(0.1, None)
    many = np.zeros((LineBatch.MAX_POINTS - 10, 3), np.float32)
    lines.put(("a", 0), np.eye(4), many, RED, True)
    assert lines.has_room(("a", 1), np.zeros((10, 3), np.float32))
    assert not lines.has_room(("a", 1), np.zeros((11, 3), np.float32))
    assert lines.has_room(("a", 0), np.zeros((LineBatch.MAX_POINTS, 3), np.float32))

    texts = TextBatch(None)
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


def test_what_is_far_from_the_origin_is_not_rounded() -> None:
    utm = np.array([476_000.123, 5_429_000.456, 0.0])
    texts, lines = TextBatch(None), LineBatch(0.1, None)
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

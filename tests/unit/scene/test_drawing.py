"""Drawables, as far as comparisons with RViz do not cover them (test_against_rviz.py)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rosglass.errors import Error
from rosglass.scene.render.drawing import Labels, Lines, MapImage, Mesh, Points
from rosglass.scene.render.matrices import instance_matrix
from rosglass.scene.render.mesh_shapes import BOX, CYLINDER, SPHERE, Shape
from rosglass.scene.render.scene_tree import Group

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (2, 1, 0)]


def test_lines_of_a_strip_bend_to_their_neighbours() -> None:
    lines = Lines(0.1, in_metres=True)
    lines.set_strip(POINTS)
    assert lines.rows["before"].tolist() == [[0, 0, 0], [0, 0, 0], [1, 0, 0]]
    assert lines.rows["after"].tolist() == [[1, 1, 0], [2, 1, 0], [2, 1, 0]]


def test_lines_beside_a_gap_end_there() -> None:
    lines = Lines(0.1, in_metres=True)
    lines.set_strip([*POINTS[:2], (np.nan, 0, 0), *POINTS[2:]])
    assert lines.rows["start"].tolist() == [[0, 0, 0], [1, 1, 0]]
    assert (lines.rows["before"] == lines.rows["start"]).all()
    assert (lines.rows["after"] == lines.rows["end"]).all()


@pytest.mark.parametrize("count", [0, 1])
def test_strip_of_less_than_two_points_has_no_lines(count: int) -> None:
    lines = Lines()
    lines.set_strip(POINTS[:count])
    assert lines.count == 0


@pytest.mark.parametrize("shape", [BOX, SPHERE, CYLINDER])
def test_shapes_are_seen_from_outside(shape: Shape) -> None:
    a, b, c = (shape.rows["position"][shape.faces[:, corner]] for corner in range(3))
    outward = (np.cross(b - a, c - a) * (a + b + c)).sum(axis=1)
    assert (outward > -1e-6).all()
    assert shape.one_sided
    assert len(np.unique(shape.rows["uv"], axis=0)) > 3


def test_mirrored_shape_is_seen_from_the_other_side() -> None:
    shape = Shape([(0, 0, 0), (1, 0, 0), (0, 1, 0)], one_sided=True)
    assert shape.mirrored().faces.tolist() == [[2, 1, 0]]
    assert shape.faces.tolist() == [[0, 1, 2]]
    assert shape.mirrored().one_sided


def test_box_around_a_mesh_is_found_once_for_all_frames() -> None:
    mesh = Mesh(BOX)
    box = mesh.bounds()
    assert box is not None
    mesh.set_look(color=(1.0, 0.0, 0.0, 0.5))
    assert mesh.bounds() is box
    mesh.set_instances([instance_matrix((3.0, 0.0, 0.0)), instance_matrix((-1.0, 0.0, 2.0))])
    moved = mesh.bounds()
    assert moved is not None
    assert [side.tolist() for side in moved] == [[-1.5, -0.5, -0.5], [3.5, 0.5, 2.5]]


def _add_to_itself() -> None:
    inner = Group()
    outer = Group(Group(inner))
    inner.add(outer)


@pytest.mark.parametrize(
    ("call", "error"),
    [
        (lambda: Points().set_points("abc"), "points: expected numbers, got 'abc'"),
        (lambda: Points().set_points([[1, 2, 3]], "red"), "colors: expected numbers"),
        (lambda: Points().set_data(5, 1, 12), "data: expected bytes"),
        (lambda: Points().set_look(size="x"), "size: expected a finite number, got 'x'"),
        (lambda: Lines("wide"), "width: expected a finite number, got 'wide'"),
        (lambda: Lines().set_look(alpha=np.nan), "alpha: expected a finite number, got nan"),
        (
            lambda: Mesh(None),
            "shape: expected a Shape, such as rosglass.scene.drawing.BOX",
        ),
        (lambda: Mesh(BOX).set_instances([np.eye(4)], (1, 2)), "colors: .* fit the shape"),
        (lambda: Mesh(BOX).set_texture([1, 2]), "texture: expected up to 16384"),
        (lambda: MapImage().set_cells([1, 2], 1.0), "expected up to 16384 x 16384 cells"),
        (lambda: MapImage().set_palette([1]), "palette: expected 256 x 4 bytes"),
        (lambda: Labels().set_texts([5], [[0, 0, 0]]), "texts: expected a text, got 5"),
        (lambda: Labels().set_texts(["a"], [[0, 0, 0]], "x"), "heights: expected numbers"),
        (lambda: setattr(Group(), "alpha", "x"), "alpha: expected a finite number"),
        (lambda: setattr(Group(), "pose", "x"), "a pose must be a finite matrix"),
        (lambda: Group().add(5), "Group.add.*: expected a drawable, or a group"),
        (_add_to_itself, "Group.add.*: expected a drawable, or a group"),
    ],
)
def test_invalid_drawable_is_refused_by_name(call: Any, error: str) -> None:
    with pytest.raises(Error, match=error):
        call()

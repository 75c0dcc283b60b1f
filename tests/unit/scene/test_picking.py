"""Picking by rays, without Qt and a GPU."""

from __future__ import annotations

import pytest

from rosglass.scene.render.drawing import Labels, Mesh
from rosglass.scene.render.mesh_shapes import BOX
from rosglass.scene.render.picking import pick
from rosglass.scene.render.scene_tree import Group
from rosglass.scene.view_controllers.views import OrbitView


def test_ray_does_not_pass_between_two_triangles() -> None:
    box = Mesh(BOX)
    box.owner = "box"
    camera = OrbitView().camera(400, 300)
    # The camera looks along the diagonal of the upper side, in the middle of the frame.
    near, far = camera.project((0.5, 0.5, 0.5)), camera.project((-0.5, -0.5, 0.5))
    rows = range(round(far.y) + 2, round(near.y) - 1)
    missed = [y for y in rows if pick(Group(box).drawables(), camera, 200, y) is None]
    assert len(rows) > 20
    assert missed == []


@pytest.mark.parametrize(
    ("align", "found"),
    [
        ("centre", {"left", "right", "above", "below"}),
        ("left", {"right", "above", "below"}),
        ("below", {"left", "right", "below"}),
    ],
)
def test_text_is_picked_where_it_is_drawn(align: str, found: set[str]) -> None:
    labels = Labels(in_pixels=True, align=align)
    labels.owner = "text"
    labels.set_texts(["a long text"], [(0, 0, 0)], 40.0)
    camera = OrbitView().camera(400, 300)
    # A little beside its position, in the middle of the frame.
    around = {"left": (-20, 1), "right": (20, 1), "above": (1, -15), "below": (1, 15)}
    hits = {
        name: pick(Group(labels).drawables(), camera, 200 + x, 150 + y)
        for name, (x, y) in around.items()
    }
    assert {name for name, hit in hits.items() if hit is not None} == found
    assert pick(Group(labels).drawables(), camera, 200, 205) is None

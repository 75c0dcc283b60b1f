"""Picking by rays, without Qt and a GPU."""

from __future__ import annotations

from rosglass.scene.drawing import BOX, Group, Mesh
from rosglass.scene.picking import pick
from rosglass.scene.views import OrbitView


def test_a_ray_does_not_pass_between_two_triangles() -> None:
    box = Mesh(BOX)
    box.owner = "box"
    camera = OrbitView().camera(400, 300)
    # The camera looks along the diagonal of the upper side, in the middle of the picture.
    near, far = camera.project((0.5, 0.5, 0.5)), camera.project((-0.5, -0.5, 0.5))
    rows = range(round(far.y) + 2, round(near.y) - 1)
    missed = [y for y in rows if pick(Group(box).drawables(), camera, 200, y) is None]
    assert len(rows) > 20
    assert missed == []

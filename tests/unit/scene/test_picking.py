"""Picking by rays, without Qt and a GPU."""

from __future__ import annotations

import numpy as np
import pytest

from rosglass.scene.drawing import BOX, Group, Mesh
from rosglass.scene.picking import pick
from rosglass.scene.views import OrbitView


@pytest.mark.parametrize("share", np.linspace(-0.45, 0.45, 19).tolist())
def test_a_ray_does_not_pass_between_two_triangles(share: float) -> None:
    box = Mesh(BOX)
    box.owner = "box"
    camera = OrbitView().camera(400, 300)
    for x, y in ((share, share), (share, -share)):
        seen = camera.project((x, y, 0.5))
        hit = pick(Group(box).drawables(), camera, seen.x, seen.y)
        assert hit is not None
        assert hit.point == pytest.approx((x, y, 0.5))

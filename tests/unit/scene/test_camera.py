"""The camera of a scene: projection, rays, and the way from one camera to another."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rosglass.errors import Error
from rosglass.scene.render.camera import Camera, PinholeCamera, interpolate
from rosglass.scene.view_controllers.views import OrbitView, TopDownOrthoView


def looking(eye: tuple[float, float, float], focus: tuple[float, float, float]) -> Camera:
    view = OrbitView()
    view.focal_point = focus
    x, y, z = np.subtract(eye, focus)
    view.distance = math.dist(eye, focus)
    view.yaw, view.pitch = math.atan2(y, x), math.atan2(z, math.hypot(x, y))
    return view.camera(800, 600)


def from_above(scale: float = 20.0, angle: float = 0.0) -> Camera:
    view = TopDownOrthoView()
    view.scale, view.angle, view.x, view.y = scale, angle, 1.0, 2.0
    return view.camera(800, 600)


CAMERAS = [looking((4, -3, 5), (1, 1, 0)), from_above(20, 0.4)]


def test_focus_is_seen_in_the_middle() -> None:
    x, y, depth = looking((4, -3, 5), (1, 1, 0)).project((1, 1, 0))
    assert (x, y) == pytest.approx((400, 300))
    assert depth == pytest.approx(math.sqrt(9 + 16 + 25))
    assert from_above().project((1, 2, 0)) == pytest.approx((400, 300, 500))


def test_right_and_up_are_right_and_up() -> None:
    camera = looking((-5, 0, 0), (0, 0, 0))
    assert camera.project((0, -1, 0)).x > 400
    assert camera.project((0, 0, 1)).y < 300
    # 45 degrees upright: half the height is tan(22.5 degrees) at 1 m.
    edge = camera.project((0, 0, 5 * math.tan(math.pi / 8)))
    assert edge.y == pytest.approx(0, abs=1e-9)


def test_scale_is_units_of_the_item_per_metre() -> None:
    x, y, _ = from_above(20).project((2, 4, 0))
    assert (x, y) == pytest.approx((420, 260))


@pytest.mark.parametrize("camera", CAMERAS)
def test_ray_of_a_place_leads_back_to_the_point(camera: Camera) -> None:
    for point in ((0.0, 0.0, 0.0), (2.0, 1.0, 1.5), (1.0, -1.0, -1.0)):
        clip = camera.projection @ camera.view @ (*point, 1)
        assert 0 < (clip[2] / clip[3] + 1) / 2 < 1
        seen = camera.project(point)
        origin, direction = camera.ray(seen.x, seen.y)
        along = np.subtract(point, origin)
        assert np.cross(along, direction) == pytest.approx((0, 0, 0), abs=1e-9)
        assert np.dot(along, direction) > 0
        assert np.linalg.norm(direction) == pytest.approx(1)


def test_near_plane_is_at_depth_minus_1_and_far_away_is_1() -> None:
    camera = looking((-5, 0, 0), (0, 0, 0))
    near = camera.projection @ camera.view @ (-5 + camera.near, 0, 0, 1)
    assert near[2] / near[3] == pytest.approx(-1)
    far = camera.projection @ camera.view @ (1e12, 0, 0, 1)
    assert far[2] / far[3] == pytest.approx(1)


def test_nothing_is_seen_behind_the_camera_or_at_infinity() -> None:
    camera = looking((-5, 0, 0), (0, 0, 0))
    for point in ((-6, 0, 0), (-5, 0, 0), (math.inf, 0, 0), (math.nan, 0, 0)):
        assert all(math.isnan(number) for number in camera.project(point))
    assert all(math.isnan(number) for number in from_above().project((0, 0, 501)))


def test_bad_cameras_and_points_are_errors_that_name_them() -> None:
    good = np.eye(4)
    for options, name in (
        ({"pose": np.eye(3)}, "pose"),
        ({"pose": np.full((4, 4), math.nan)}, "pose"),
        ({"pose": "x"}, "pose"),
        ({"size": (0, 600)}, "width"),
        ({"size": (800, math.inf)}, "height"),
        ({"fov": 0.0}, "field of view"),
        ({"fov": math.nan}, "field of view"),
        ({"near": -1.0}, "near plane"),
        ({"scale": 0.0}, "scale"),
        ({"focus_distance": math.nan}, "focus distance"),
    ):
        with pytest.raises(Error, match=name):
            Camera(**{"pose": good, "size": (800, 600), **options})  # type: ignore[arg-type]
    for point in ((1, 2), "abc", None, (1, 2, "x")):
        with pytest.raises(Error, match="a point must be three numbers"):
            CAMERAS[0].project(point)  # type: ignore[arg-type]


def test_equal_cameras_are_equal() -> None:
    assert looking((4, 0, 3), (0, 0, 0)) == looking((4, 0, 3), (0, 0, 0))
    assert looking((4, 0, 3), (0, 0, 0)) != looking((4, 0, 3.1), (0, 0, 0))
    assert CAMERAS[0] != "camera"


# From one camera to another


def test_animation_begins_and_ends_at_its_cameras() -> None:
    a, b = CAMERAS[0], looking((-4, 2, 8), (0, 1, 1))
    assert interpolate(a, b, 0) == a
    assert interpolate(a, b, 1) == b
    assert interpolate(a, b, math.nan) == a
    late = interpolate(a, b, 1 - 1e-9)
    assert late.pose == pytest.approx(b.pose, abs=1e-6)


def test_animation_turns_about_the_focus_and_never_passes_through_it() -> None:
    a, b = looking((5, 0.1, 1), (0, 0, 0)), looking((-10, 0, 1), (0, 0, 0))
    for share in np.linspace(0.05, 0.95, 10):
        camera = interpolate(a, b, share)
        x, y, _ = camera.project((0, 0, 0))
        assert (x, y) == pytest.approx((400, 300), abs=1e-6)
        assert 5 <= math.dist(camera.eye, (0, 0, 0)) <= 10.1
        assert np.linalg.det(camera.pose[:3, :3]) == pytest.approx(1)
    middle = interpolate(a, b, 0.5)
    assert math.dist(middle.eye, (0, 0, 0)) == pytest.approx(
        math.sqrt(math.dist(a.eye, (0, 0, 0)) * math.dist(b.eye, (0, 0, 0)))
    )


def test_animation_to_a_map_ends_with_what_the_map_shows() -> None:
    a, b = looking((4, -3, 5), (1, 1, 0)), from_above(20, 0.3)
    for start, goal in ((a, b), (b, a)):
        half = interpolate(start, goal, 0.5)
        assert not half.is_orthographic
    almost = interpolate(a, b, 1 - 1e-9)
    for point in ((1, 2, 0), (4, 5, 0), (-3, 1, 0)):
        assert almost.project(point)[:2] == pytest.approx(b.project(point)[:2], abs=1e-3)


def test_animation_between_maps_stays_a_map() -> None:
    a, b = from_above(10, 0.0), from_above(40, 1.0)
    half = interpolate(a, b, 0.5)
    assert half.is_orthographic
    assert half.scale == pytest.approx(20)
    right = half.pose[:3, 0]
    assert math.atan2(right[1], right[0]) == pytest.approx(0.5)


def test_pinhole_camera_sees_points_where_its_matrix_projects_them() -> None:
    camera = PinholeCamera(np.eye(4), (400, 300), focal=(200, 220), centre=(190, 140))
    seen = camera.project((0.5, -0.3, -2))
    assert (seen.x, seen.y) == pytest.approx((200 * 0.25 + 190, 220 * 0.15 + 140))
    origin, direction = camera.ray(seen.x, seen.y)
    assert origin == (0, 0, 0)
    assert np.array(direction) / -direction[2] * 2 == pytest.approx([0.5, -0.3, -2])


def test_pinhole_cameras_differ_by_their_lens() -> None:
    camera = PinholeCamera(np.eye(4), (400, 300), focal=(200, 220), centre=(190, 140))
    assert camera == PinholeCamera(np.eye(4), (400, 300), focal=(200, 220), centre=(190, 140))
    assert camera != PinholeCamera(np.eye(4), (400, 300), focal=(200, 221), centre=(190, 140))
    assert camera != Camera(np.eye(4), (400, 300))
    with pytest.raises(Error, match="focal lengths above 0 and a finite centre"):
        PinholeCamera(np.eye(4), (400, 300), focal=(200, 0), centre=(190, 140))

"""RViz's views: mouse, wheel, touch and keys, target frames, files, and taking over."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rosglass.errors import ArgumentError, Error
from rosglass.scene.configs.rviz_formats import FIXED_FRAME
from rosglass.scene.view_controllers.events import Action, Button, Drag, Modifier, Touch, Wheel
from rosglass.scene.view_controllers.views import (
    VIEWS,
    FPSView,
    FrameAlignedView,
    OrbitView,
    ThirdPersonFollowerView,
    TopDownOrthoView,
    XYOrbitView,
    create_view,
)

if TYPE_CHECKING:
    from rosglass.scene.view_controllers.view_controller import ViewController

SIZE = (800.0, 600.0)
LEFT, RIGHT, MIDDLE = Button.LEFT, Button.RIGHT, Button.MIDDLE
SHIFT = Modifier.SHIFT
STEEP = math.pi / 2 - 0.001
ALL = sorted(VIEWS)


def drag(
    view: ViewController,
    button: Button,
    dx: float,
    dy: float,
    modifiers: Modifier = Modifier.NONE,
    at: tuple[float, float] = (400.0, 400.0),
) -> None:
    view.on_drag(Drag(at[0] + dx, at[1] + dy, dx, dy, button, modifiers, SIZE))


def eye(view: ViewController) -> tuple[float, float, float]:
    return view.camera(*SIZE).eye


def matrix_of(view: ViewController) -> Any:
    camera = view.camera(*SIZE)
    return camera.projection @ camera.view


def place(x: float, y: float, z: float = 0.0, yaw: float = 0.0, pitch: float = 0.0) -> Any:
    pose = np.eye(4)
    (sy, cy), (sp, cp) = ((math.sin(a), math.cos(a)) for a in (yaw, pitch))
    pose[:3, :3] = [[cy * cp, -sy, cy * sp], [sy * cp, cy, sy * sp], [-sp, 0, cp]]
    pose[:3, 3] = x, y, z
    return pose


def near(found: Any, wanted: Any, within: float = 1e-9) -> bool:
    return bool(np.allclose(found, wanted, rtol=0, atol=within))


# Types


def test_views_are_created_by_the_names_of_both_rviz() -> None:
    assert ALL == ["FPS", "FrameAligned", "Orbit", "ThirdPersonFollower", "TopDownOrtho", "XYOrbit"]
    for name in ALL:
        for package in ("rviz", "rviz_default_plugins"):
            view = create_view(f"{package}/{name}")
            assert type(view) is VIEWS[name]
            assert view.class_id == f"{package}/{name}"
        assert create_view(name).class_id == f"rviz_default_plugins/{name}"
    for bad in ("Orbti", "rviz/", "hector/Orbit", "rviz::Orbit", None, "x" * 10_000):
        with pytest.raises(Error, match="there is no view"):
            create_view(bad)  # type: ignore[arg-type]
    with pytest.raises(Error, match="did you mean Orbit"):
        create_view("rviz/Orbti")


def test_defaults_are_rviz_s() -> None:
    view = OrbitView()
    assert (view.distance, view.yaw, view.pitch) == (10, math.pi / 4, math.pi / 4)
    assert near(eye(view), (5, 5, 10 / math.sqrt(2)))
    camera = view.camera(*SIZE)
    assert (camera.fov, camera.near) == (math.pi / 4, 0.01)
    flat = TopDownOrthoView().camera(*SIZE)
    assert flat.is_orthographic
    assert flat.scale == 10
    assert near(flat.eye, (0, 0, 500))
    assert view.target_frame == FIXED_FRAME


# Orbit


def test_left_button_turns_by_5_mrad_for_each_unit_and_stops_at_the_pole() -> None:
    view = OrbitView()
    drag(view, LEFT, 40, 20)
    assert (view.yaw, view.pitch) == pytest.approx((math.pi / 4 - 0.2, math.pi / 4 + 0.1))
    drag(view, LEFT, 400, 4000)
    assert 0 <= view.yaw < math.tau
    assert view.pitch == STEEP
    assert near(eye(view)[2], 10, 1e-4)
    drag(view, LEFT, 0, -8000)
    assert view.pitch == -STEEP


def test_middle_button_and_shift_keep_what_is_seen_under_the_mouse() -> None:
    for button, held in ((MIDDLE, Modifier.NONE), (MIDDLE, SHIFT), (LEFT, SHIFT)):
        view = OrbitView()
        view.focal_point = (1, 2, 3)
        before = view.camera(*SIZE).project(view.focal_point)
        moved = view.focal_point
        drag(view, button, 30, -50, held)
        after = view.camera(*SIZE).project(moved)
        assert (after.x, after.y) == pytest.approx((before.x + 30, before.y - 50))
        assert view.distance == 10


def test_right_button_and_the_wheel_zoom() -> None:
    view = OrbitView()
    drag(view, RIGHT, 0, 10)
    assert view.distance == pytest.approx(11)
    view.on_wheel(Wheel(1))
    assert view.distance == pytest.approx(11 * 0.88)
    view.on_wheel(Wheel(-1))
    assert view.distance == pytest.approx(11 * 0.88 * 1.12)
    view.distance = 10
    view.on_wheel(Wheel(0.25))
    assert view.distance == pytest.approx(9.7)
    # Many steps in one event count as many events: the camera does not jump to its focus.
    view.distance = 10
    view.on_wheel(Wheel(20))
    assert view.distance == pytest.approx(10 * 0.88**20)
    drag(view, RIGHT, 0, -4000)
    assert view.distance == 0.001
    view.on_wheel(Wheel(-1e9))
    assert math.isfinite(view.distance)


def test_shift_with_the_right_button_or_the_wheel_moves_along_the_line_of_sight() -> None:
    view = OrbitView()
    view.yaw = view.pitch = 0.0
    drag(view, RIGHT, 0, 10, SHIFT)
    assert near(view.focal_point, (1, 0, 0))
    view.on_wheel(Wheel(1, SHIFT))
    assert near(view.focal_point, (-0.2, 0, 0))
    assert view.distance == 10


def test_moving_without_a_button_changes_nothing() -> None:
    for name in ALL:
        view = create_view(name)
        state = view.state()
        drag(view, Button.NONE, 30, 30)
        assert view.state() == state


def test_inverted_z_axis_turns_the_frame_over() -> None:
    view = OrbitView()
    view.invert_z = True
    x, y, z = eye(view)
    assert near((x, y, z), (5, -5, -10 / math.sqrt(2)))
    camera = view.camera(*SIZE)
    assert camera.project((0, 0, 1)).y > camera.project((0, 0, 0)).y
    before = eye(view)
    view.look_at((1, 1, 1))
    assert near(eye(view), before)
    assert near(view.camera(*SIZE).project((1, 1, 1))[:2], (400, 300), 1e-6)


def test_focal_shape_is_a_flat_ball_at_the_focus() -> None:
    view = OrbitView()
    view.focal_point = (1, 2, 3)
    view.update_target(place(10, 0))
    shape = view.focal_shape()
    assert near(shape.pose[:3, 3], (11, 2, 3))
    assert near(shape.size, (0.05, 0.05, 0.01))
    view.focal_shape_fixed_size = False
    assert near(view.focal_shape().size, (0.5, 0.5, 0.1))
    assert TopDownOrthoView().focal_shape() is None


# The others


def test_map_turns_moves_and_zooms() -> None:
    view = TopDownOrthoView()
    drag(view, LEFT, 40, 7)
    assert view.angle == pytest.approx(0.2)
    before = view.camera(*SIZE).project((3, 4, 0))
    drag(view, MIDDLE, 25, -35)
    after = view.camera(*SIZE).project((3, 4, 0))
    assert (after.x, after.y) == pytest.approx((before.x + 25, before.y - 35))
    drag(view, LEFT, -25, 35, SHIFT)
    assert near((view.x, view.y), (0, 0))
    drag(view, RIGHT, 0, -10)
    assert view.scale == pytest.approx(11)
    view.on_wheel(Wheel(1))
    assert view.scale == pytest.approx(11 * 1.12)
    view.on_wheel(Wheel(-3))
    assert view.scale == pytest.approx(11 * 1.12 * 0.88**3)
    drag(view, RIGHT, 0, 500)
    assert view.scale > 0


def test_negative_scale_is_a_map_turned_by_half_a_turn() -> None:
    view, turned = TopDownOrthoView(), TopDownOrthoView()
    view.scale, turned.angle = -10, math.pi
    assert near(matrix_of(view), matrix_of(turned))
    drag(view, MIDDLE, 20, 30)
    drag(turned, MIDDLE, 20, 30)
    assert near((view.x, view.y), (turned.x, turned.y))
    assert view.state()["Scale"] == -10


def test_views_on_the_ground_look_from_a_fifth_of_the_distance_above_the_orbit() -> None:
    view, orbit = XYOrbitView(), OrbitView()
    up = orbit.camera(*SIZE).pose[:3, 1]
    assert near(eye(view), np.add(eye(orbit), 0.2 * 10 * up))


def test_views_on_the_ground_move_along_the_ground() -> None:
    for made in (XYOrbitView, ThirdPersonFollowerView):
        view = made()
        view.update_target(place(3, 2, 1, yaw=0.7))
        # What is looked at appears in the lower half.
        focus = view.focal_shape().pose[:3, 3]
        assert view.camera(*SIZE).project(focus).y > 400
        origin, direction = view.camera(*SIZE).ray(420, 330)
        ground = np.add(origin, np.multiply(direction, (1 - origin[2]) / direction[2]))
        drag(view, MIDDLE, 20, 30, at=(400, 300))
        assert view.focal_point.z == 0
        drag(view, MIDDLE, -20, -30, at=(420, 330))
        seen = view.camera(*SIZE).project(ground)
        assert (seen.x, seen.y) == pytest.approx((420, 330), abs=1e-6)
        drag(view, RIGHT, 0, 10, SHIFT)
        assert view.distance == pytest.approx(11)
        view.on_wheel(Wheel(1, SHIFT))
        assert view.distance == pytest.approx(11 * 0.88)


def test_sky_cannot_be_dragged_and_the_horizon_not_far() -> None:
    view = XYOrbitView()
    view.pitch = 0.1
    drag(view, MIDDLE, 0, 20, at=(400, 10))
    assert view.focal_point == (0, 0, 0)
    horizon = next(y for y in range(600) if view.camera(*SIZE).ray(400, y)[1][2] < 0)
    drag(view, MIDDLE, 0, 100, at=(400, horizon))
    assert math.dist(view.focal_point, (0, 0, 0)) == pytest.approx(1)


def test_first_person_looks_and_walks() -> None:
    view = FPSView()
    view.position = (0, 0, 1)
    drag(view, LEFT, -40, 20)
    assert (view.yaw, view.pitch, view.roll) == pytest.approx((0.2, 0.1, 0))
    view.yaw = view.pitch = 0
    assert near(view.camera(*SIZE).ray(400, 300)[1], (1, 0, 0))
    drag(view, MIDDLE, 10, 20)
    assert near(view.position, (0, -0.1, 0.8))
    drag(view, RIGHT, 0, -10)
    assert near(view.position, (1, -0.1, 0.8))
    view.on_wheel(Wheel(1))
    assert near(view.position, (2.2, -0.1, 0.8))
    drag(view, LEFT, 0, 10_000)
    assert view.pitch == STEEP


def test_shift_rolls_in_rviz_1_and_moves_in_rviz_2() -> None:
    old, new = create_view("rviz/FPS"), create_view("rviz_default_plugins/FPS")
    for view in (old, new):
        view.set("Position", (0, 0, 0))
        drag(view, LEFT, 0, 10, SHIFT, at=(500, 300))
    assert old.get("Roll") == pytest.approx(-math.atan2(10, 100))
    assert old.get("Position") == (0, 0, 0)
    assert near(new.get("Position"), (0, 0, -0.1))
    assert old.action(LEFT, SHIFT) is Action.ROTATE_2D
    assert new.action(LEFT, SHIFT) is Action.MOVE_XY


def test_camera_that_rviz_1_saved_turned_over_still_looks_the_same_way() -> None:
    view = FPSView()
    # RViz 1.14 writes this for a camera at yaw -135 degrees and pitch 54.7 degrees.
    view.yaw, view.pitch, view.roll = math.pi / 4, math.pi - 0.955, math.pi
    direction = view.camera(*SIZE).ray(400, 300)[1]
    assert view.camera(*SIZE).pose[2, 1] > 0
    drag(view, LEFT, 0.001, 0)
    assert near(view.camera(*SIZE).ray(400, 300)[1], direction, 1e-4)
    assert abs(view.pitch) <= STEEP


def test_aligned_camera_points_along_an_axis_of_its_frame() -> None:
    view = FrameAlignedView()
    assert view.point_towards == "-z axis"
    view.update_target(place(1, 2, 3, yaw=0.5, pitch=0.3))
    frame = place(1, 2, 3, yaw=0.5, pitch=0.3)
    for axis, sign, column in (
        ("+x", 1, 0),
        ("-x", -1, 0),
        ("+y", 1, 1),
        ("-y", -1, 1),
        ("+z", 1, 2),
        ("-z", -1, 2),
    ):
        view.point_towards = f"{axis} axis"
        origin, direction = view.camera(*SIZE).ray(400, 300)
        assert near(origin, (1, 2, 3))
        assert near(direction, sign * frame[:3, column])
        assert view.point_towards == f"{axis} axis"
    drag(view, LEFT, 0, -40)
    assert view.point_towards == "arbitrary"
    view.reset()
    assert view.point_towards == "-z axis"
    view.lock_camera = True
    state = view.state()
    drag(view, LEFT, 40, 40)
    view.on_wheel(Wheel(1))
    view.on_touch(Touch(2, 400, 300, 5, 5, 1.5, 0.3, SIZE))
    assert view.state() == state
    assert "Unlock" in view.help(Modifier.NONE)
    assert view.action(LEFT, Modifier.NONE) is Action.NONE


def test_cursors_and_help_are_rviz_s() -> None:
    none = Modifier.NONE
    view: ViewController = OrbitView()
    assert view.action(Button.NONE, none) is Action.ROTATE_3D
    assert view.action(Button.NONE, SHIFT) is Action.MOVE_XY
    assert view.action(RIGHT, none) is Action.ZOOM
    assert view.action(RIGHT, SHIFT) is Action.MOVE_Z
    assert view.action(LEFT | MIDDLE, none) is Action.ROTATE_3D
    assert XYOrbitView().action(RIGHT, SHIFT) is Action.ZOOM
    assert TopDownOrthoView().action(LEFT, none) is Action.ROTATE_2D
    for name in ALL:
        view = create_view(name)
        assert view.help(none).startswith("Left-Click: Rotate.")
        assert view.help(SHIFT).startswith("Left-Click: Move X/Y.")
        assert view.DESCRIPTION.endswith(".")


# Touch and keys


def test_touch_is_the_movement_of_its_fingers() -> None:
    touch = Touch.between([(0, 0), (10, 0)], [(5, -5), (5, 15)], SIZE)
    # On a screen y points down: this is a quarter turn clockwise.
    assert touch[:-1] == pytest.approx((2, 5, 5, 0, 5, 2, math.pi / 2), abs=1e-9)
    one = Touch.between([(1, 1)], [(4, 5)], SIZE)
    assert one == (1, 4, 5, 3, 4, 1, 0, SIZE)
    assert Touch.between([(3, 3), (3, 3)], [(0, 3), (900, 3)], SIZE).pinch == 10


def test_one_finger_turns_as_the_left_button_does() -> None:
    for name in ALL:
        touched, dragged = create_view(name), create_view(name)
        touched.on_touch(Touch.between([(400, 300)], [(410, 320)], SIZE))
        drag(dragged, LEFT, 10, 20, at=(400, 300))
        assert touched.state() == dragged.state()


def test_two_fingers_keep_what_is_under_them_on_a_map() -> None:
    view = TopDownOrthoView()
    view.on_touch(Touch.between([(350, 300), (450, 300)], [(400, 200), (400, 400)], SIZE))
    assert view.scale == pytest.approx(20)
    assert view.angle == pytest.approx(math.pi / 2)
    # The finger that was right of the middle is below it now.
    seen = view.camera(*SIZE).project((5, 0, 0))
    assert (seen.x, seen.y) == pytest.approx((400, 400))


def test_two_fingers_zoom_and_turn_an_orbit() -> None:
    view = OrbitView()
    view.pitch = 1.5
    before = view.camera(*SIZE)
    view.on_touch(Touch(2, 400, 300, 0, 0, 2.0, 0.3, SIZE))
    assert view.distance == pytest.approx(5)
    point = np.add(view.focal_point, before.pose[:3, 0])
    seen = view.camera(*SIZE).project(point)
    # What was right of the middle has turned clockwise: downwards.
    assert seen.y > 300
    view = FPSView()
    start = eye(view)
    view.on_touch(Touch(2, 400, 300, 0, 0, 2.0, 0.3, SIZE))
    assert eye(view)[0] > start[0]


def test_keys_focus_and_reset() -> None:
    view = OrbitView()
    assert view.on_key("F", (1, 0, 0))
    assert near(view.focal_point, (1, 0, 0))
    assert not view.on_key("f")
    assert view.on_key("z")
    assert view.focal_point == (0, 0, 0)
    assert not view.on_key("x", (1, 0, 0))


# Commands


@pytest.mark.parametrize("name", ALL)
def test_focus_appears_in_the_middle(name: str) -> None:
    view = create_view(name)
    view.update_target(place(1, 2, 0.5, yaw=0.3))
    point = (2, 3, 0.5)
    view.look_at(point)
    seen = view.camera(*SIZE).project(point)
    if name in ("XYOrbit", "ThirdPersonFollower"):
        assert seen.x == pytest.approx(400)
        assert 400 < seen.y < 600
    else:
        assert (seen.x, seen.y) == pytest.approx((400, 300), abs=1e-6)
    for bad in ((1, 2), (1, 2, math.nan), (1, 2, math.inf), "abc", None):
        with pytest.raises(Error, match="a point to look at must be three finite numbers"):
            view.look_at(bad)  # type: ignore[arg-type]


def test_looking_at_where_the_camera_is_or_straight_down_is_harmless() -> None:
    for name in ALL:
        view = create_view(name)
        view.look_at(eye(view))
        x, y, _ = eye(view)
        view.look_at((x, y, -5))
        assert np.isfinite(matrix_of(view)).all()


@pytest.mark.parametrize("name", ALL)
def test_reset_returns_to_the_start(name: str) -> None:
    view = create_view(name)
    view.reset()
    start = view.state()
    assert near(view.camera(*SIZE).project((0, 0, 0))[:1], 400, 1e-6) or name == "FrameAligned"
    for button in (LEFT, MIDDLE, RIGHT):
        drag(view, button, 30, 40)
    view.set("Target Frame", "base_link")
    view.set("Near Clip Distance", 0.5)
    assert view.state() != start
    view.reset()
    kept = {"Target Frame": "base_link", "Near Clip Distance": 0.5}
    assert view.state() == {**start, **kept}


# Target frame


@pytest.mark.parametrize("name", ALL)
def test_camera_follows_its_target_frame(name: str) -> None:
    view = create_view(name)
    view.set("Target Frame", "base_link")
    view.update_target(place(1, 2, 3))
    before = view.camera(*SIZE)
    assert view.update_target(place(2, 4, 6, yaw=1.0, pitch=0.2))
    after = view.camera(*SIZE)
    if name == "FrameAligned":
        turn = place(0, 0, 0, yaw=1.0, pitch=0.2)
    elif name == "ThirdPersonFollower":
        turn = place(0, 0, 0, yaw=1.0)
    else:
        turn = np.eye(4)
    wanted = place(2, 4, 6) @ turn @ place(-1, -2, -3) @ before.pose
    assert near(after.pose, wanted)
    assert not view.update_target(place(2, 4, 6, yaw=1.0, pitch=0.2))


def test_without_a_transform_the_camera_stays_and_the_problem_is_reported() -> None:
    view = OrbitView()
    view.target_frame = "base_link"
    view.update_target(place(1, 2, 3))
    before = eye(view)
    bad: Any
    for bad in (None, np.full((4, 4), math.nan), np.eye(3), "x"):
        assert not view.update_target(bad)
        assert eye(view) == before
        assert view.problem.startswith("Target Frame: ")
    view.update_target(None)
    assert "base_link" in view.problem
    view.update_target(None, "base_link is 4 s old")
    assert view.problem == "Target Frame: base_link is 4 s old"
    view.update_target(place(1, 2, 3))
    assert view.problem == ""


@pytest.mark.parametrize("name", [name for name in ALL if name != "FrameAligned"])
def test_another_target_frame_does_not_move_a_view_that_is_shown(name: str) -> None:
    view = create_view(name)
    if name == "TopDownOrtho":
        view.set("Angle", 0.5)
    before = eye(view)
    view.set("Target Frame", "base_link")
    view.update_target(None)
    assert eye(view) == before
    view.update_target(place(7, 8, 0))
    assert near(eye(view), before)
    view.update_target(place(8, 8, 0))
    assert near(eye(view), np.add(before, (1, 0, 0)))
    view.set("Target Frame", FIXED_FRAME)
    assert near(eye(view), np.add(before, (1, 0, 0)))


def test_settings_are_in_the_target_frame() -> None:
    view = OrbitView()
    eye(view)
    view.target_frame = "base_link"
    view.update_target(place(7, 8, 0))
    assert near(view.focal_point, (-7, -8, 0))
    view.target_frame = FIXED_FRAME
    assert near(view.focal_point, (0, 0, 0))


def test_view_from_a_file_is_placed_at_its_frame() -> None:
    view = OrbitView()
    before = eye(view)
    view.restore({"Target Frame": "base_link"})
    view.update_target(place(7, 8, 0))
    assert near(eye(view), np.add(before, (7, 8, 0)))


# Taking over


@pytest.mark.parametrize("old", ALL)
@pytest.mark.parametrize("new", ALL)
def test_any_view_takes_over_from_any_other(old: str, new: str) -> None:
    source, view = create_view(old), create_view(new)
    source.update_target(place(1, 2, 0.5, yaw=0.4))
    source.set("Target Frame", "base_link")
    source.look_at((2, 3, 0.5))
    before = source.camera(*SIZE)
    view.mimic(source)
    after = view.camera(*SIZE)
    assert view.get("Target Frame") == "base_link"
    assert np.isfinite(after.projection @ after.view).all()
    on_ground = ("XYOrbit", "ThirdPersonFollower")
    if "TopDownOrtho" in (old, new):
        if {old, new} <= {"TopDownOrtho", "Orbit"}:
            assert near(after.project((2, 3, 0.5))[:2], (400, 300), 0.1)
    # Where the camera looks straight down, the ground below the frame's middle is not visible.
    elif old != "FrameAligned" or new not in on_ground:
        assert near(after.eye, before.eye, 0.02)
        assert near(after.pose[:3, :3], before.pose[:3, :3], 0.02)


def test_orbit_takes_over_from_a_map_from_100_m() -> None:
    source, view = TopDownOrthoView(), OrbitView()
    source.x, source.y = 3, 4
    view.mimic(source)
    assert near(view.focal_point, (3, 4, 0), 0.11)
    assert view.distance == 100
    assert view.pitch == STEEP
    # North stays up, as in RViz 2.
    assert view.yaw == pytest.approx(1.5 * math.pi)


def test_first_person_takes_over_the_direction_of_a_map() -> None:
    source, view = TopDownOrthoView(), FPSView()
    source.angle = 0.5
    view.mimic(source)
    assert near(view.camera(*SIZE).pose, source.camera(*SIZE).pose)


def test_view_of_the_ground_begins_anew_where_no_ground_is_seen() -> None:
    source, view = FPSView(), XYOrbitView()
    source.pitch = -0.5
    view.mimic(source)
    assert (view.distance, view.focal_point) == (10, (0, 0, 0))


# Files and panels

ROS_1 = {
    "Class": "rviz/Orbit",
    "Distance": 6.5,
    "Enable Stereo Rendering": {
        "Stereo Eye Separation": 0.06,
        "Stereo Focal Distance": 1,
        "Swap Stereo Eyes": False,
        "Value": False,
    },
    "Field of View": 0.5,
    "Focal Point": {"X": 1, "Y": 2.5, "Z": -3},
    "Focal Shape Fixed Size": False,
    "Focal Shape Size": 0.1,
    "Invert Z Axis": False,
    "Name": "Behind the robot",
    "Near Clip Distance": 0.02,
    "Pitch": "1e-05",  # what PyYAML reads of a number without a point
    "Target Frame": "base_link",
    "Value": "Orbit (rviz)",
    "Yaw": 3,
}


def test_view_is_read_and_written_as_rviz_does_it() -> None:
    view = create_view("rviz/Orbit")
    assert view.restore(ROS_1) == []
    assert isinstance(view, OrbitView)
    assert (view.distance, view.pitch, view.yaw) == (6.5, 1e-5, 3)
    assert view.focal_point == (1, 2.5, -3)
    assert view.state() == {**ROS_1, "Pitch": 1e-5}
    assert list(view.state()) == sorted(ROS_1)
    again = create_view("rviz/Orbit")
    again.restore(view.state())
    assert again.camera(*SIZE) == view.camera(*SIZE)


@pytest.mark.parametrize("name", ALL)
def test_unknown_keys_are_kept_and_belong_to_the_view(name: str) -> None:
    view = create_view(f"rviz_default_plugins/{name}")
    mine = {"Own": {"a": [1, 2]}, "Enable Stereo Rendering": {"Value": True}}
    view.restore(mine)
    mine["Own"]["a"].append(3)
    state = view.state()
    assert state["Own"] == {"a": [1, 2]}
    assert state["Enable Stereo Rendering"] == {"Value": True}
    assert state["Class"] == f"rviz_default_plugins/{name}"
    assert state["Value"] == f"{name} (rviz_default_plugins)"
    assert "Value" not in create_view(f"rviz/{name}").state()
    state["Own"]["a"].clear()
    assert view.state()["Own"] == {"a": [1, 2]}


def test_aligned_view_keeps_its_angles_in_files() -> None:
    view = FrameAlignedView()
    drag(view, LEFT, 30, -40)
    again = FrameAlignedView()
    again.restore(view.state())
    assert near(again.camera(*SIZE).pose, view.camera(*SIZE).pose)
    assert again.point_towards == "arbitrary"
    # Along an axis, but rolled and elsewhere: what the angles say counts.
    again.restore({"Point towards": "+x axis", "Roll": 0.5, "Position": {"X": 1, "Y": 2, "Z": 3}})
    assert (again.roll, again.position) == (0.5, (1, 2, 3))
    again.restore({"Point towards": "+x axis"})
    assert near(again.camera(*SIZE).ray(400, 300)[1], (1, 0, 0))


def test_bad_values_in_a_file_are_named_and_the_others_taken() -> None:
    view = OrbitView()
    warnings = view.restore(
        {
            "Distance": math.nan,
            "Yaw": "north",
            "Pitch": True,
            "Focal Point": {"X": 1, "Y": math.inf},
            "Focal Shape Size": [1],
            "Invert Z Axis": "maybe",
            "Target Frame": "",
            "Name": ["x"],
            "Field of View": 10**400,
            "Near Clip Distance": 0.5,
            7: 8,
        }
    )
    names = (
        "Distance",
        "Yaw",
        "Pitch",
        "Focal Point.Y",
        "Focal Shape Size",
        "Invert Z Axis",
        "Target Frame",
        "Name",
        "Field of View",
    )
    assert {warning.partition(":")[0] for warning in warnings} == set(names)
    assert view.near_clip == 0.5
    assert near(eye(view), eye(OrbitView()))
    with pytest.raises(Error, match="mapping of settings"):
        view.restore([1])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "given", "kept"),
    [
        ("Distance", -3, 0.001),
        ("Distance", 1e300, 1e9),
        ("Pitch", 7, STEEP),
        ("Pitch", -7, -STEEP),
        ("Near Clip Distance", -1, 0.001),
        ("Near Clip Distance", 1e9, 10_000),
        ("Field of View", 3, math.pi / 2),
        ("Focal Point", (1e300, -1e300, 0), (1e9, -1e9, 0)),
    ],
)
def test_values_outside_are_clamped_as_in_rviz(name: str, given: Any, kept: Any) -> None:
    view = OrbitView()
    view.set(name, given)
    assert view.get(name) == kept
    assert np.isfinite(matrix_of(view)).all()


def test_scale_of_0_shows_the_largest_area() -> None:
    view = TopDownOrthoView()
    view.scale = 0
    assert view.scale == 1e-4
    assert np.isfinite(matrix_of(view)).all()


def test_bad_values_by_program_are_errors_that_name_the_setting() -> None:
    view = FrameAlignedView()
    for name, value in (
        ("Yaw", math.nan),
        ("Position", (1, 2)),
        ("Position", 5),
        ("Point towards", "up"),
        ("Point towards", []),
        ("Lock Camera", 2),
        ("Target Frame", 7),
        ("Target Frame", "x" * 1001),
    ):
        with pytest.raises(ArgumentError, match=f"^{name}"):
            view.set(name, value)
    with pytest.raises(Error, match="did you mean Point towards"):
        view.set("Point Towards", "+x axis")
    with pytest.raises(Error, match="the view FrameAligned has no setting"):
        view.get("Distance")
    with pytest.raises(ArgumentError, match="steps of the wheel"):
        OrbitView().on_wheel(Wheel(math.nan))


def test_panel_reads_all_settings() -> None:
    found = {row["path"]: row for row in FrameAlignedView().describe()}
    assert found["Point towards"]["choices"][0] == "arbitrary"
    assert found["Position"]["value"] == {"X": 0, "Y": 0, "Z": 0}
    assert found["Near Clip Distance"]["min"] == 0.001
    kinds = {row["kind"] for name in ALL for row in create_view(name).describe()}
    assert kinds == {"float", "bool", "frame", "enum", "vector"}


def test_changes_are_announced_once_each() -> None:
    view, changes = OrbitView(), []
    view.on_change = lambda: changes.append(view.distance)
    view.distance = 5
    view.distance = 5.0
    view.on_wheel(Wheel(1))
    assert changes == [5, 4.4]

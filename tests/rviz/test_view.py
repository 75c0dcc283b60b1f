"""RViz's camera: moved by Python and by keys."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def near(found: Any, wanted: Any, within: float = 0.01) -> bool:
    return all(abs(a - b) < within for a, b in zip(found, wanted, strict=True))


@pytest.fixture
def view(steered: Any) -> Any:
    return steered


# By Python


def test_places_and_modes(view: Any, eye: Any, wait: Callable[..., None]) -> None:
    view.move_eye_and_focus((1, 2, 3), (0, 0, 1))
    wait(lambda: not view.is_moving)
    wait(lambda: near(eye(), (1, 2, 3)))
    assert near(view.focus, (0, 0, 1))
    view.move_eye((3, 2, 3))
    wait(lambda: near(eye(), (3, 2, 3)))
    assert near(view.focus, (2, 0, 1))
    modes: list[int] = []
    view.mode_changed.connect(lambda: modes.append(int(view.mode)))
    view.set_mode(1)
    wait(lambda: not view.is_moving)
    wait(lambda: near(eye(), (2, 0, 500)))
    view.set_mode(0)
    wait(lambda: near(eye(), (3, 2, 3)))
    assert near(view.focus, (2, 0, 1))
    assert modes == [1, 0]


def test_2d_shows_as_much_as_3d_did(app: Any, view: Any, wait: Callable[..., None]) -> None:
    from rosglass.rviz.camera import RvizCamera

    steep = 1e-3
    view.move_eye_and_focus((2 - 10 * steep, 1, 10), (2, 1, 0), animate=False)
    wait.frames(6)
    camera, point = RvizCamera(app.window), (3.0, 2.0, 0.0)
    camera.update()
    before = camera.project(point)
    view.set_mode(1, animate=False)
    wait.frames(6)
    camera.update()
    assert near(camera.project(point)[:2], before[:2], 3.0)


def test_other_views_make_place_and_nothing_crashes_rviz(
    app: Any, view: Any, eye: Any, wait: Callable[..., None]
) -> None:
    manager = app.window.manager.getViewManager()
    # Two views in one event had RViz's panel touch the first one, which was gone.
    for kind in ("rviz/TopDownOrtho", "rviz/FPS", "rviz/ThirdPersonFollower", "rviz/FPS"):
        manager.setCurrentViewControllerType(kind)
    wait.frames(6)
    assert near(view.eye, eye())
    view.move_eye((5, 6, 7))
    wait(lambda: near(eye(), (5, 6, 7)))
    assert manager.getCurrent().getClassId() == "rviz/Orbit"
    view.set_mode(1)
    manager.setCurrentViewControllerType("rviz/FPS")
    assert not view.is_moving
    wait.frames(3)
    assert manager.getCurrent().getClassId() == "rviz/FPS"


def test_impossible_movements_are_errors(view: Any) -> None:
    from rosglass.errors import Error

    before = view.eye
    for call in (
        lambda: view.move_eye((1, 2)),
        lambda: view.move_eye((1, 2, math.nan)),
        lambda: view.move_eye((1, 2, 1e9)),
        lambda: view.move_eye((1, 2, 3), "nowhere"),
        lambda: view.move_eye((1, 2, 3), 7),
        lambda: view.move_eye_and_focus((1, 2, 3), (1, 2, 3)),
        lambda: view.set_mode(2),
        lambda: view.set_mode(True),
        lambda: view.track("nowhere"),
        lambda: setattr(view.settings, "animation_duration", -1),
        lambda: setattr(view.settings, "tracking_gain", math.nan),
    ):
        with pytest.raises(Error):
            call()
    assert near(view.eye, before)
    assert view.tracked_frame == ""


def test_moving_the_camera_otherwise_ends_a_movement(
    app: Any, view: Any, wait: Callable[..., None]
) -> None:
    view.settings.animation_duration = 60.0
    view.move_eye((50, 50, 50))
    wait.frames(3)
    app.window.manager.getViewManager().getCurrent().subProp("Yaw").setValue(1.0)
    wait(lambda: not view.is_moving)
    app.window.manager.setFixedFrame("map")
    view.move_eye((50, 50, 50))
    app.window.manager.setFixedFrame("odom")
    wait(lambda: not view.is_moving)


def test_a_config_that_is_loaded_ends_movement_and_tracking(
    app: Any, view: Any, wait: Callable[..., None], tmp_path: Path
) -> None:
    file = tmp_path / "kept.rviz"
    app.save_config(file)
    view.track("map")
    view.set_mode(1, animate=False)
    view.settings.animation_duration = 60.0
    view.move_eye((50, 50, 50))
    app.load_config(file)
    assert not view.is_moving
    wait.frames(3)
    assert view.tracked_frame == ""
    assert view.mode == 0
    assert near(view.eye, (4, 0, 3))


# Keys


def test_arrow_keys_shift_the_view_and_ctrl_d_changes_the_mode(
    app: Any, view: Any, wait: Callable[..., None]
) -> None:
    from PySide2.QtCore import Qt
    from PySide2.QtTest import QTest

    panel = app.window.panel
    app.window.widget.activateWindow()
    panel.setFocus()
    wait(panel.hasFocus)
    start = view.focus
    QTest.keyPress(panel, Qt.Key_Up)
    wait(lambda: view.focus.x < start.x - 0.5)
    QTest.keyRelease(panel, Qt.Key_Up)
    wait.frames(2)
    stopped = view.focus
    wait.frames(6)
    assert near(view.focus, stopped, 1e-6)
    assert near(stopped[1:], start[1:])
    QTest.keyPress(panel, Qt.Key_Left)
    wait(lambda: view.focus.y < stopped.y - 0.5)
    # Who goes elsewhere with a key down does not leave the camera running.
    panel.clearFocus()
    wait.frames(2)
    stopped = view.focus
    wait.frames(6)
    assert near(view.focus, stopped, 1e-6)
    QTest.keyClick(panel, Qt.Key_D, Qt.ControlModifier)
    assert view.mode == 1
    QTest.keyClick(panel, Qt.Key_D, Qt.ControlModifier)
    assert view.mode == 0
    view.settings.keys = False
    QTest.keyClick(panel, Qt.Key_D, Qt.ControlModifier)
    view.settings.keys = True
    assert view.mode == 0

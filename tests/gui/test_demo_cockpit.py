"""The cockpit on a robot in another process: what the operator sees, and what the robot obeys."""

from __future__ import annotations

import os
import signal
import threading
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from ports import free_port

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

pytest.importorskip("PySide6.QtMultimedia", reason="the cockpit needs the extra `camera`")
zenoh = pytest.importorskip("zenoh", reason="the cockpit needs the extra `zenoh`")

from demo_driver import SIZE, CockpitProcess  # noqa: E402
from waiting import eventually, nothing_happens  # noqa: E402

from rosglass.demo import framecode  # noqa: E402
from rosglass.demo.camera import CODE_POSITION, HEIGHT, WIDTH  # noqa: E402
from rosglass.demo.processes import Child, VirtualScreen, start_robot  # noqa: E402

pytestmark = pytest.mark.xvfb


class RobotSide:
    """The robot's process, and what an independent node hears of it."""

    def __init__(self, url: str) -> None:
        import rosglass

        self.url = url
        self.process: Child = start_robot(url)
        self.node = rosglass.connect(url, name="observer")
        self.commands: list[tuple[float, float, float]] = []
        self.speed = self.x = self.y = 0.0
        self.stopped: bool | None = None
        self._changed = threading.Condition()
        self.node.create_subscription("/cmd_vel", "geometry_msgs/msg/Twist", self._on_command)
        self.node.create_subscription("/odom", "nav_msgs/msg/Odometry", self._on_odometry)
        self.node.create_subscription("/emergency_stop/state", "std_msgs/msg/Bool", self._on_stop)

    def kill(self) -> None:
        os.kill(self.process.pid, signal.SIGKILL)

    def restart(self) -> None:
        self.process.close()
        self.process = start_robot(self.url)

    def until(self, condition: Callable[[], Any], timeout: float = 30.0) -> None:
        with self._changed:
            assert self._changed.wait_for(condition, timeout), "did not happen in time"

    def close(self) -> None:
        self.process.close()
        self.node.close()

    def _on_command(self, message: Any) -> None:
        with self._changed:
            self.commands.append((time.monotonic(), message.linear.x, message.angular.z))
            self._changed.notify_all()

    def _on_odometry(self, message: Any) -> None:
        with self._changed:
            self.speed = message.twist.twist.linear.x
            self.x, self.y = message.pose.pose.position.x, message.pose.pose.position.y
            self._changed.notify_all()

    def _on_stop(self, message: Any) -> None:
        with self._changed:
            self.stopped = message.data
            self._changed.notify_all()


@pytest.fixture(scope="module")
def robot() -> Iterator[RobotSide]:
    from rosglass.wires.zenoh.router import Router

    with Router(f"tcp/127.0.0.1:{free_port()}") as router:
        side = RobotSide(router.url)
        yield side
        side.close()


@pytest.fixture(scope="module")
def window(robot: RobotSide) -> Iterator[CockpitProcess]:
    with VirtualScreen(1024, 700) as screen:
        process = CockpitProcess(robot.url, screen.display)
        yield process
        assert process.close() == 0
        assert process.complaints() == []


@pytest.fixture
def cockpit(window: CockpitProcess, robot: RobotSide) -> Iterator[CockpitProcess]:
    """The cockpit, connected, with everything let go and nothing stopped."""
    if robot.process.poll() is not None:
        robot.restart()
    window.until("camera", "live", timeout=30)
    window.until("link", "alive")
    window.until("cockpit", "inFront")
    window.until("stop", "known")
    window.until("drive", "obstacle", "")
    robot.commands.clear()
    yield window
    for key in ("Key_W", "Key_A", "Key_S", "Key_D"):
        window.key("release", key)
    time.sleep(0.1)  # pressed again sooner, they would count as repeating
    window.cover(False)
    if robot.process.poll() is None and window.get("stop", "blocks"):
        window.call("stop", "release")
        window.until("stop", "blocks", False)


def grab(cockpit: CockpitProcess, path: Path, part: str) -> np.ndarray:
    """Return the window's view of the camera, or only the image in it, as rows of RGB."""
    from PySide6.QtGui import QImage

    cockpit.grab(path)
    image = QImage(str(path)).convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    pixels = rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3)
    x, y, width, height = (round(cockpit.get("camera", n)) for n in ("x", "y", "width", "height"))
    if part == "picture":
        left, top, width, height = (round(v) for v in cockpit.get("camera", "imageRect"))
        x, y = x + left, y + top
    return pixels[y : y + height, x : x + width].copy()


def picture_of(cockpit: CockpitProcess, path: Path) -> np.ndarray:
    return grab(cockpit, path, "picture")


def code_in(picture: np.ndarray) -> framecode.FrameCode:
    scale = picture.shape[1] / WIDTH
    row = round((CODE_POSITION[1] + framecode.SQUARE / 2) * scale)
    left = round(CODE_POSITION[0] * scale)
    right = round((CODE_POSITION[0] + framecode.BITS * framecode.SQUARE) * scale)
    return framecode.read(picture[row, left:right, 1])


def test_the_window_shows_an_image_that_is_not_older_than_it_claims(
    cockpit: CockpitProcess, tmp_path: Path
) -> None:
    picture = picture_of(cockpit, tmp_path / "live.png")
    assert picture.shape[0] / picture.shape[1] == pytest.approx(HEIGHT / WIDTH, abs=0.02)
    # Grabbing the screen takes its share; the cockpit calls an image stale after 3 s.
    new = tmp_path / "new.png"
    eventually(lambda: code_in(picture_of(cockpit, new)).age(time.time_ns()) < 2.0)
    later = picture_of(cockpit, tmp_path / "later.png")
    assert code_in(later).number != code_in(picture).number
    colours = picture[:100].astype(int)
    assert (colours[..., 2] - colours[..., 0]).mean() > 10, "the sky is blue"


def test_everything_else_arrives(cockpit: CockpitProcess) -> None:
    for panel in ("map", "attitude", "battery", "flippers", "diagnostics"):
        cockpit.until(panel, "stale", False)
    assert 0.5 < cockpit.get("battery", "percentage") <= 1.0
    cockpit.until("diagnostics", "total", 5)
    assert cockpit.get("map", "scene.robotX") == pytest.approx(-5.4, abs=2.5)


def test_a_key_drives_and_letting_go_stops(cockpit: CockpitProcess, robot: RobotSide) -> None:
    start = robot.x
    cockpit.key("press", "Key_W")
    robot.until(lambda: robot.x > start + 0.1 and sum(c[1] > 0 for c in robot.commands) > 5)
    cockpit.key("release", "Key_W")
    released = time.monotonic()
    robot.until(lambda: robot.speed == 0.0)
    assert robot.x > start + 0.1
    nothing_happens(1.0)
    moving = [c for c in robot.commands if c[1] > 0]
    zeros = [c for c in robot.commands if c[1] == c[2] == 0]
    assert len(moving) > 5, robot.commands
    gaps = np.diff([c[0] for c in moving])
    # 20 commands a second, fewer on a busy machine; the robot stops after half a second without.
    assert 0.01 < np.median(gaps) < 0.4
    assert len(zeros) >= 3, "one lost message must not keep the robot going"
    assert zeros[0][0] - released < 1
    eventually(lambda: time.monotonic() - robot.commands[-1][0] > 0.15, "then others may drive")


def test_opposite_keys_and_a_lost_release(cockpit: CockpitProcess, robot: RobotSide) -> None:
    cockpit.key("press", "Key_Left")
    robot.until(lambda: robot.commands and robot.commands[-1][2] > 0)
    cockpit.key("press", "Key_Right")
    robot.until(lambda: robot.commands[-1][1:] == (0.0, 0.0))
    cockpit.key("release", "Key_Left")
    robot.until(lambda: robot.commands[-1][2] < 0)
    cockpit.key("release", "Key_Right")
    robot.until(lambda: robot.commands[-1][1:] == (0.0, 0.0))


def test_a_key_held_down_neither_stutters_nor_drives_again_after_a_stop(
    cockpit: CockpitProcess, robot: RobotSide
) -> None:
    cockpit.key("press", "Key_W")
    robot.until(lambda: robot.commands and robot.commands[-1][1] > 0)
    robot.commands.clear()
    cockpit.repeat("Key_W", 12)
    assert robot.commands
    assert all(c[1] > 0 for c in robot.commands), robot.commands
    cockpit.key("press", "Key_Space")
    cockpit.until("stop", "stopped")
    cockpit.call("stop", "release")
    robot.until(lambda: robot.stopped is False)
    cockpit.until("drive", "obstacle", "")
    cockpit.repeat("Key_W", 12)
    assert cockpit.get("keys", "held")
    assert not cockpit.get("drive", "active"), "the key was never let go"
    cockpit.key("release", "Key_W")
    cockpit.until("keys", "held", False)
    cockpit.key("press", "Key_W")
    cockpit.until("drive", "active")


def test_a_key_held_down_while_the_window_comes_back_does_not_count(
    cockpit: CockpitProcess,
) -> None:
    cockpit.key("press", "Key_W")
    cockpit.until("drive", "active")
    cockpit.cover(True)
    cockpit.until("cockpit", "inFront", False)
    cockpit.cover(False)
    cockpit.until("cockpit", "inFront")
    cockpit.repeat("Key_W", 8)
    assert not cockpit.get("keys", "held")


def test_the_mouse_pulls_the_stick(cockpit: CockpitProcess, robot: RobotSide) -> None:
    cockpit.mouse("press", "stick", 0.5, 0.5)
    cockpit.mouse("move", "stick", 0.5, 0.85)
    robot.until(lambda: robot.commands and robot.commands[-1][1] < -0.3)
    assert robot.commands[-1][2] == 0.0
    cockpit.mouse("release", "stick", 0.5, 0.85)
    robot.until(lambda: robot.commands[-1][1:] == (0.0, 0.0))
    assert not cockpit.get("stick", "held")


def test_another_window_in_front_stops_the_robot(cockpit: CockpitProcess, robot: RobotSide) -> None:
    cockpit.key("press", "Key_W")
    robot.until(lambda: robot.speed > 0.2)
    cockpit.cover(True)
    robot.until(lambda: robot.commands[-1][1:] == (0.0, 0.0))
    robot.until(lambda: robot.speed == 0.0)
    cockpit.cover(False)
    cockpit.until("cockpit", "inFront")
    nothing_happens(0.3)
    assert robot.commands[-1][1:] == (0.0, 0.0), "a key pressed before does not count any more"


@pytest.mark.parametrize("key", ["Key_Space", "Key_Escape"])
def test_the_emergency_stop_stops_and_stays(
    cockpit: CockpitProcess, robot: RobotSide, key: str
) -> None:
    cockpit.key("press", "Key_W")
    robot.until(lambda: robot.speed > 0.3)
    cockpit.key("press", key)
    robot.until(lambda: robot.stopped is True)
    robot.until(lambda: robot.speed == 0.0)
    cockpit.until("stop", "stopped")
    assert cockpit.get("confirmation", "text") == "confirmed"
    cockpit.key("release", key)
    # Pressing harder does not help.
    cockpit.key("release", "Key_W")
    cockpit.key("press", "Key_W")
    nothing_happens(0.4)
    assert robot.speed == 0.0
    assert cockpit.get("speed", "refusal")
    cockpit.key("release", "Key_W")
    cockpit.mouse("press", "unlock", 0.5, 0.5)
    time.sleep(0.2)
    cockpit.mouse("release", "unlock", 0.5, 0.5)
    nothing_happens(0.3)
    assert robot.stopped, "a short click does not release"
    cockpit.mouse("press", "unlock", 0.5, 0.5)
    robot.until(lambda: robot.stopped is False)
    cockpit.mouse("release", "unlock", 0.5, 0.5)
    assert robot.speed == 0.0


@pytest.mark.parametrize("key", ["Key_Return", "Key_Enter"])
def test_the_emergency_stop_is_released_by_a_key_that_is_held(
    cockpit: CockpitProcess, robot: RobotSide, key: str
) -> None:
    cockpit.key("press", "Key_Space")
    cockpit.key("release", "Key_Space")
    cockpit.until("stop", "stopped")
    cockpit.key("press", key)
    time.sleep(0.2)
    cockpit.key("release", key)
    nothing_happens(0.8)
    assert robot.stopped, "a short press does not release"
    # As X11 repeats a key that is held down.
    cockpit.key("press", key)
    cockpit.repeat(key, 10)
    cockpit.key("press", "Key_Space")
    cockpit.repeat(key, 20)
    cockpit.key("release", "Key_Space")
    assert robot.stopped, "stopping goes before releasing"
    cockpit.key("release", key)
    time.sleep(0.1)
    cockpit.key("press", key)
    cockpit.repeat(key, 10)
    robot.until(lambda: robot.stopped is False)
    cockpit.key("release", key)
    assert robot.speed == 0.0


def test_the_focus_is_seen_and_keys_count_wherever_it_is(
    cockpit: CockpitProcess, robot: RobotSide, tmp_path: Path
) -> None:
    def ring() -> np.ndarray:
        pixels = grab(cockpit, tmp_path / "focus.png", "cockpit").astype(int)
        x, y, *_ = cockpit.place("camera")
        left, top, right, bottom = (
            round(at - corner)
            for at, corner in zip(cockpit.place("stop"), (x, y, x, y), strict=True)
        )
        around = pixels[top - 8 : bottom + 8, left - 8 : right + 8]
        # The accent of the theme, which nothing else here has.
        accent = np.abs(around - np.array([0x3F, 0xD2, 0xE8])).sum(axis=2) < 60
        return int(np.count_nonzero(accent))

    assert ring() < 50
    tabs = 0
    while not cockpit.get("stop", "activeFocus"):
        cockpit.key("press", "Key_Tab")
        cockpit.key("release", "Key_Tab")
        tabs += 1
        assert tabs < 10
    assert ring() > 500
    cockpit.key("press", "Key_Space")
    cockpit.key("release", "Key_Space")
    cockpit.until("stop", "stopped")
    cockpit.key("press", "Key_Return")
    robot.until(lambda: robot.stopped is False)
    cockpit.key("release", "Key_Return")
    cockpit.call("cockpit", "forceActiveFocus")


def test_diagnostics_are_merged_worst_first_and_counted(
    cockpit: CockpitProcess, robot: RobotSide
) -> None:
    kind = "diagnostic_msgs/msg/DiagnosticArray"
    arm, base = (robot.node.create_publisher("/diagnostics", kind) for _ in range(2))
    parts = [{"level": [0], "name": f"joint {n:02}", "message": "fine"} for n in range(20)]
    for part in parts:
        part["level"] = 0
    worn = {"level": 1, "name": "track", "message": "worn"}
    broken = {"level": 2, "name": "zoom", "message": "stuck", "hardware_id": "camera"}

    def is_shown() -> bool:
        # One right after the other: none may take the other's place.
        arm.publish({"status": [*parts, broken]})
        base.publish({"status": [worn]})
        return cockpit.get("diagnostics", "total") == 27

    eventually(is_shown)
    cockpit.until("diagnostics", "note", "1 error, 1 warning")
    for publisher in (arm, base):
        publisher.close()
    # The statuses of a node that has left become stale.
    cockpit.until("diagnostics", "note", "22 stale")


@pytest.mark.parametrize(
    ("width", "height"), [(640, 480), (800, 480), (640, 600), (480, 800), (320, 240), (900, 300)]
)
def test_nothing_hides_the_stop_in_a_small_window(
    cockpit: CockpitProcess, width: int, height: int
) -> None:
    parts = ["stick", "lamp", "map", "attitude", "battery", "flippers", "diagnostics"]
    try:
        cockpit.resize(width, height)
        cockpit.until("cockpit", "height", height)
        left, top, right, bottom = cockpit.place("stop")
        assert 0 <= left < right <= width
        assert 0 <= top < bottom <= height
        assert right - left >= 80
        places = [cockpit.place(part) for part in parts if cockpit.get(part, "visible")]
        places.append((left, top, right, bottom))
        assert cockpit.get("map", "visible") == (min(width, height) >= 480)
        for one in range(len(places)):
            assert places[one][2] <= width
            assert places[one][3] <= height
            for other in range(one):
                across = min(places[one][2], places[other][2]) - max(
                    places[one][0], places[other][0]
                )
                down = min(places[one][3], places[other][3]) - max(places[one][1], places[other][1])
                assert min(across, down) <= 0, "one part hides another"
        cockpit.mouse("press", "mushroom", 0.5, 0.5)
        cockpit.mouse("release", "mushroom", 0.5, 0.5)
        assert cockpit.get("stop", "blocks")
    finally:
        cockpit.resize(*SIZE)
        cockpit.until("cockpit", "height", SIZE[1])


def test_a_second_finger_stops_while_the_first_one_drives(
    cockpit: CockpitProcess, robot: RobotSide
) -> None:
    cockpit.touch(("press", 1, "stick", 0.5, 0.5))
    cockpit.touch(("move", 1, "stick", 0.5, 0.15))
    robot.until(lambda: robot.speed > 0.2)
    cockpit.touch(("move", 1, "stick", 0.5, 0.14), ("press", 2, "mushroom", 0.5, 0.5))
    robot.until(lambda: robot.stopped is True)
    robot.until(lambda: robot.speed == 0.0)
    cockpit.touch(("release", 1, "stick", 0.5, 0.15), ("release", 2, "mushroom", 0.5, 0.5))


def test_stop_by_another_operator_is_shown_and_not_undone(
    cockpit: CockpitProcess, robot: RobotSide
) -> None:
    other = robot.node.create_publisher("/emergency_stop", "std_msgs/msg/Bool")
    eventually(other.subscription_count)
    time.sleep(1.0)  # sooner after a release of ours, it would be said to be held
    other.publish(data=True)
    cockpit.until("stop", "stopped")
    assert cockpit.get("confirmation", "text") == "by someone else"
    nothing_happens(0.5)
    assert robot.stopped
    cockpit.call("stop", "release")
    cockpit.until("stop", "stopped", False)
    other.publish(data=True)
    cockpit.until("stop", "stopped")
    assert cockpit.get("confirmation", "text") == "held by someone else"


def test_a_killed_robot_is_seen_within_a_second_and_recovers_by_itself(
    cockpit: CockpitProcess, robot: RobotSide, tmp_path: Path
) -> None:
    alive = picture_of(cockpit, tmp_path / "alive.png")
    robot.kill()
    begin = time.monotonic()
    cockpit.until("camera", "live", False)
    cockpit.until("link", "alive", False)
    for panel in ("map", "attitude", "flippers"):
        cockpit.until(panel, "stale")
    assert time.monotonic() - begin < 5, "a second where nothing else runs"
    assert cockpit.get("noSignal", "visible")
    assert cockpit.get("cameraRate", "value") == "\u2013", "no figures of a picture that is gone"
    assert "ROBOT LOST" in cockpit.get("linkText", "text")

    dead = picture_of(cockpit, tmp_path / "dead.png").astype(int)
    spread = dead.max(axis=2) - dead.min(axis=2)
    was = alive.astype(int).max(axis=2) - alive.astype(int).min(axis=2)
    top = slice(10, 90)
    assert spread[top].mean() < 0.6 * was[top].mean(), "the old picture has lost its colours"
    edge = grab(cockpit, tmp_path / "edge.png", "frame")[1:5, 50:-50].astype(int)
    assert edge[..., 0].mean() > edge[..., 2].mean() + 80, "a red frame"
    eventually(
        lambda: float(cockpit.get("noSignalText", "text").split()[2]) > 1.0, "its age is shown"
    )

    robot.restart()
    cockpit.until("camera", "live", timeout=30)
    cockpit.until("link", "alive", timeout=30)
    assert not cockpit.get("noSignal", "visible")
    eventually(lambda: cockpit.get("camera", "framerate") > 0)
    back = tmp_path / "back.png"
    eventually(lambda: code_in(picture_of(cockpit, back)).age(time.time_ns()) < 2.0)


def test_a_robot_that_comes_back_does_not_drive_by_itself(
    cockpit: CockpitProcess, robot: RobotSide
) -> None:
    cockpit.key("press", "Key_W")
    robot.until(lambda: robot.speed > 0.2)
    robot.kill()
    cockpit.until("drive", "active", False)
    robot.restart()
    cockpit.until("camera", "live", timeout=30)
    cockpit.until("drive", "obstacle", "")
    nothing_happens(0.3)
    assert cockpit.get("keys", "held")
    assert not cockpit.get("drive", "active")
    assert robot.speed == 0.0


def test_stop_that_the_robot_does_not_receive_is_shown_and_kept(
    cockpit: CockpitProcess, robot: RobotSide
) -> None:
    robot.kill()
    cockpit.until("camera", "live", False)
    cockpit.key("press", "Key_Space")
    cockpit.key("release", "Key_Space")
    cockpit.until("stop", "overdue")
    assert cockpit.get("confirmation", "text").startswith("NOT CONFIRMED")
    robot.stopped = None
    robot.restart()
    robot.until(lambda: robot.stopped is True)
    cockpit.until("stop", "stopped", timeout=30)
    assert not cockpit.get("stop", "overdue")

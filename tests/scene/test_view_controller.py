"""The display View Controller: keys, files, status, and robots of ROS 2."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from scene_mouse import Hand

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from conftest import SceneBench

HERE = Path(__file__).parent
PACKAGE = "hector_rviz_plugins_msgs"
#: The entry as ``rosglass rviz`` saves it.
ENTRY = """
Visualization Manager:
  Displays:
    - Class: rosglass/ViewController
      Name: View Controller
      Enabled: true
      Animation Duration: 0.25
      Tracking Gain: 7
      Keyboard Navigation: false
      Movement Speed: 2
      Enable Topics: true
      Enable Services: true
      Namespace: /robot/camera
  Global Options: {Fixed Frame: map}
"""


def near(found: Any, wanted: Any, within: float = 0.01) -> bool:
    return all(abs(a - b) < within for a, b in zip(found, wanted, strict=True))


def control(bench: SceneBench) -> Any:
    from rosglass.scene.overlays.view_control import control_of

    return control_of(bench.view)


def show(bench: SceneBench, settings: str = "") -> Any:
    """Show a View Controller, and return it once robots can use it."""
    view = bench.load(f"ViewControllerDisplay {{ {settings} }}")
    bench.wait(lambda: view.scene.displays and control(bench).services)
    bench.wait(lambda: control(bench).services.is_open or control(bench).services.problem)
    control(bench).view.reset()
    return view.scene.displays[0]


def services_of(bench: SceneBench) -> set[str]:
    return {name for name in bench.session.node.services() if "move_eye" in name}


# -- robots of ROS 2 -------------------------------------------------------------------------------


@pytest.fixture
def dds_bench(make_bench: Callable[[str], SceneBench], ros_domains: list[int]) -> Iterator[Any]:
    """A bench in a ROS domain of its own, and that domain."""
    pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
    domain = ros_domains[0]
    bench = make_bench(f"dds://?domain={domain}")
    yield bench, domain
    bench.close()


class Program:
    """Another program, and the JSON lines that it prints."""

    def __init__(self, bench: SceneBench, *command: str, domain: int) -> None:
        self._bench, self._lines = bench, []  # type: tuple[SceneBench, list[str]]
        self._process = subprocess.Popen(
            command,
            env=os.environ | {"ROS_DOMAIN_ID": str(domain)},
            stdout=subprocess.PIPE,
            text=True,
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        self._lines.extend(self._process.stdout or ())

    def __enter__(self) -> Program:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()

    def next(self) -> Any:
        self._bench.wait(lambda: self._lines or self._process.poll() is not None, timeout=60)
        assert self._lines, "the program has ended"
        return json.loads(self._lines.pop(0))


@pytest.fixture
def definitions(tmp_path: Path) -> Path:
    """A prefix such as ROS installs, with the definitions of the services."""
    from rosglass.interfaces import Library

    prefix, library = tmp_path / "interfaces", Library()
    for name in (
        f"{PACKAGE}/msg/ViewMode",
        *(f"{PACKAGE}/srv/{kind}" for kind in ("MoveEye", "SetViewMode", "TrackFrame")),
        "std_msgs/msg/Header",
        "builtin_interfaces/msg/Time",
        "geometry_msgs/msg/Point",
    ):
        package, kind, base = name.split("/")
        for folder in ("msg", "srv", "action"):
            (prefix / "share" / package / folder).mkdir(parents=True, exist_ok=True)
        text = library.definition(name).text.partition("\n====")[0]
        (prefix / "share" / package / kind / f"{base}.{kind}").write_text(text)
        (prefix / "share" / package / "package.xml").write_text(
            f'<package format="3"><name>{package}</name><version>1.0.0</version><description/>'
            '<maintainer email="a@example.org">a</maintainer><license>MIT</license></package>'
        )
    return prefix


def test_robots_of_ros2_move_the_camera(dds_bench: Any, definitions: Path, caplog: Any) -> None:
    if find_spec("dora") is None:
        pytest.skip('dora is not installed: pip install "rosglass[peers]"')
    bench, domain = dds_bench
    show(bench, "animationDuration: 0")
    view, above = control(bench).view, "/hector_view_controller"
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    move = {
        "header": header,
        "eye": {"x": 1.0, "y": 2.0, "z": 3.0},
        "disable_animation": False,
        "stop_tracking": False,
        "switch_to_3d_mode": False,
    }
    calls = [
        (f"{above}/move_eye", f"{PACKAGE}/MoveEye", move),
        (f"{above}/set_tracked_frame", f"{PACKAGE}/TrackFrame", {"frame": "nowhere"}),
        (
            f"{above}/set_view_mode",
            f"{PACKAGE}/SetViewMode",
            {"mode": {"mode": 1}, "disable_animation": True},
        ),
    ]
    script = str(HERE / "dora_view.py")
    command = (sys.executable, script, str(definitions), json.dumps(calls))
    with Program(bench, *command, domain=domain) as robot:
        assert robot.next() == "done"
        assert near(bench.view.camera().eye, (1, 2, 3))
        # ROS 2 has no errors of services: the robot gets a response, the operator the reason.
        assert robot.next() == "done"
        assert f"{above}/set_tracked_frame: not done: there is no frame 'nowhere'" in caplog.text
        assert robot.next() == "done"
        assert view.mode == 1


def test_rclpy_knows_types_and_latched_topics(dds_bench: Any, rclpy_python: Path) -> None:
    bench, domain = dds_bench
    show(bench)
    control(bench).view.track("map")
    names = ("/hector_view_controller/move_eye", "/hector_view_controller/tracked_frame")
    command = (str(rclpy_python), "-u", str(HERE / "rclpy_view.py"), *names)
    with Program(bench, *command, domain=domain) as robot:
        assert robot.next() == [f"{PACKAGE}/srv/MoveEye"]
        assert robot.next() == "map"
        control(bench).view.track("")
        assert robot.next() == ""


# -- the display -----------------------------------------------------------------------------------


def test_settings_of_a_file_of_rviz_count(bench: SceneBench, tmp_path: Path) -> None:
    ours, saved = tmp_path / "ours.rviz", tmp_path / "saved.rviz"
    ours.write_text(ENTRY)
    view = bench.load()
    assert view.load_config(ours) == []
    names = {"/robot/camera/move_eye", "/robot/camera/move_eye_and_focus"}
    bench.wait(lambda: services_of(bench) == names)
    settings = control(bench).view.settings
    assert (settings.animation_duration, settings.tracking_gain, settings.speed) == (0.25, 7, 2)
    assert not settings.keys
    control(bench).view.set_mode(1, animate=False)
    control(bench).view.track("map")
    (display,) = view.scene.displays
    assert (display.mode2D, display.trackedFrame) == (True, "map")
    # What a program sets, the panel shows and the file keeps; what the camera does is not kept.
    settings.tracking_gain = 5.0
    assert display.trackingGain == 5.0
    view.save_config(saved)
    text = saved.read_text()
    assert "Tracking Gain: 5" in text
    assert "Tracked Frame" not in text
    assert "2D Mode" not in text
    # Without the entry, things are as at first, but for what the program wants.
    view.scene.remove(display)
    bench.wait(lambda: not services_of(bench))
    assert (settings.animation_duration, settings.tracking_gain, settings.keys) == (1.0, 5.0, True)


HECTOR = """
Visualization Manager:
  Displays: []
  Global Options: {Fixed Frame: map}
  Views:
    Current:
      2D Mode: false
      Angle: 0
      Animation Duration: 0.25
      Class: hector_rviz_plugins/HectorViewController
      Distance: 5
      Enable Services: true
      Enable Topics: true
      Eye: {X: 1, Y: 2, Z: 8}
      Focus: {X: 1, Y: 2, Z: 0}
      Keyboard Navigation: true
      Movement speed (m/s): 2.5
      Name: Current View
      Tracked Frame: map
      Tracked Frame P-Gain: 7
      Up: {X: 0, Y: 0, Z: 1}
"""


def test_a_view_of_hector_rviz_plugins_becomes_an_orbit(bench: SceneBench, tmp_path: Path) -> None:
    ours, saved = tmp_path / "hector.rviz", tmp_path / "saved.rviz"
    ours.write_text(HECTOR)
    view = bench.load()
    (note,) = view.load_config(ours)
    assert "HectorViewController: shown as an Orbit with the display View Controller" in note
    assert view.view == "Orbit"
    assert near(view.camera().eye, (1, 2, 8), 0.1)
    (display,) = view.scene.displays
    assert (display.animationDuration, display.movementSpeed, display.trackingGain) == (
        0.25,
        2.5,
        7,
    )
    bench.wait(lambda: services_of(bench))
    assert control(bench).view.tracked_frame == "map"
    view.save_config(saved)
    assert "Up:" not in saved.read_text().partition("Views:")[0]
    assert view.load_config(saved) == []
    assert [one.name for one in view.scene.displays] == ["View Controller"]
    ours.write_text(HECTOR.replace("2D Mode: false", "2D Mode: true"))
    view.load_config(ours)
    bench.wait(lambda: view.view == "TopDownOrtho")
    # What does not fit is left out, and named.
    ours.write_text(HECTOR.replace("Eye: {X: 1, Y: 2, Z: 8}", "Eye: high"))
    notes = view.load_config(ours)
    assert any("Eye: expected a mapping" in note for note in notes), notes
    assert near(view.camera().focus, (1, 2, 0), 0.1)


def test_saved_views_of_hector_rviz_plugins_are_named_and_kept(
    bench: SceneBench, tmp_path: Path
) -> None:
    from rosglass.scene.configs.rviz_config import RvizConfig

    file = tmp_path / "saved.rviz"
    current = HECTOR.partition("    Current:\n")[2]
    saved = "".join(f"  {line}\n" for line in current.splitlines()).replace("Current View", "dock")
    start = HECTOR.partition("    Current:")[0]
    other = "      - {Class: a/B, Name: b}\n"
    file.write_text(f"{start}    Saved:\n      - {saved.strip()}\n{other}")
    kind = "hector_rviz_plugins/HectorViewController"
    view = bench.load()
    assert view.load_config(file) == [
        f"saved view 'dock': rosglass has no {kind}; it is kept as it is and shown as an Orbit",
        "saved view 'b': rosglass has no a/B; it is kept as it is",
    ]
    assert view.savedViewTypes == ["HectorViewController", "B"]
    assert view.showSavedView(1) == "rosglass has no a/B, the type of the saved view 'b'"
    assert "shown as an Orbit with the display View Controller" in view.showSavedView(0)
    assert near(view.camera().eye, (1, 2, 8), 0.1)
    bench.wait(lambda: control(bench).view.tracked_frame == "map")
    view.save_config(file)
    kept = RvizConfig.load(file).saved_views
    assert [one.class_id for one in kept] == [kind, "a/B"]
    assert kept[0].settings["Movement speed (m/s)"] == 2.5


def test_displays_of_a_view_show_the_same(bench: SceneBench) -> None:
    first = show(bench, 'namespace: "/first"')
    second = bench.view.scene.add("rosglass/ViewController")
    bench.wait(lambda: second.namespace == "/first")
    second.movementSpeed = 9.0
    assert first.movementSpeed == control(bench).view.settings.speed == 9.0
    bench.view.scene.remove(first)
    bench.wait.settled(bench.session)
    assert "/first/move_eye" in services_of(bench)
    second.enabled = False
    bench.wait(lambda: not services_of(bench))
    second.enabled = True
    bench.wait(lambda: "/first/move_eye" in services_of(bench))


def test_status_says_where_robots_reach_the_camera(bench: SceneBench) -> None:
    display = show(bench)
    bench.wait(lambda: "Robots: /hector_view_controller" in display.statusText)
    display.namespace = "no name"
    bench.wait(lambda: "Robots: name 'no name': ' ' at position 2" in display.statusText)
    assert display.statusLevel == "warn"
    display.namespace = "~camera"
    bench.wait(lambda: "/view/camera/move_eye" in services_of(bench))
    display.enableServices = False
    bench.wait(lambda: not services_of(bench))


def test_a_frame_is_followed_once_it_exists(bench: SceneBench) -> None:
    display = show(bench, 'trackedFrame: "rover"; trackingGain: 1000; animationDuration: 0')
    view = control(bench).view
    bench.wait(lambda: "Tracked Frame: there is no frame 'rover'" in display.statusText)
    assert view.tracked_frame == ""
    bench.place("rover", at=(2.0, 1.0, 0.0))
    bench.wait(lambda: near(bench.view.camera().eye, (6, 1, 3)))
    assert view.tracked_frame == "rover"
    bench.wait(lambda: "Tracked Frame: rover" in display.statusText)
    view.nudge(1.0, 0.0)
    assert display.trackedFrame == ""


def test_robots_reach_a_view_that_is_declared_anew(bench: SceneBench) -> None:
    show(bench)
    old = bench.view
    show(bench, "animationDuration: 0")
    assert bench.view is not old
    client = bench.robot.create_service_client(
        "/hector_view_controller/move_eye", f"{PACKAGE}/srv/MoveEye"
    )
    call = client.call_async({"eye": {"x": 3.0, "y": 2.0, "z": 1.0}})
    bench.wait(call.done)
    assert near(bench.view.camera().eye, (3, 2, 1))


# -- keys ------------------------------------------------------------------------------------------


@pytest.fixture
def hand(bench: SceneBench) -> Hand:
    show(bench, "animationDuration: 0")
    made = Hand(bench)
    made.click((200, 150))
    bench.wait(bench.view.hasActiveFocus)
    return made


def hold(bench: SceneBench, key: Any, keys: Any, until: Callable[[], bool]) -> None:
    """Hold a key until something is so."""
    from PySide6.QtTest import QTest

    QTest.keyPress(bench.window, key, keys)
    bench.wait(until)
    QTest.keyRelease(bench.window, key, keys)


def test_arrow_keys_shift_the_view(bench: SceneBench, hand: Hand) -> None:
    view = control(bench).view
    hold(bench, hand.keys.Key_Up, hand.NONE, lambda: view.focus.x < -1)
    assert abs(view.focus.y) < 1e-6
    shifted = view.focus.x
    hold(bench, hand.keys.Key_Left, hand.SHIFT, lambda: view.focus.y < -1)
    assert abs(view.focus.x - shifted) < 1e-6
    # Nothing is drawn any more.
    bench.wait.nothing_happens(0.3)
    drawn = bench.view.pictures_drawn()
    bench.wait.nothing_happens(0.3)
    assert bench.view.pictures_drawn() == drawn


def test_ctrl_d_switches_between_2d_and_3d(bench: SceneBench, hand: Hand) -> None:
    view = control(bench).view
    hand.key(hand.keys.Key_D, hand.CTRL)
    bench.wait(lambda: view.mode == 1)
    hand.key(hand.keys.Key_D, hand.CTRL)
    bench.wait(lambda: view.mode == 0)


def test_without_keyboard_navigation_keys_do_nothing(bench: SceneBench, hand: Hand) -> None:
    display, view = bench.view.scene.displays[0], control(bench).view
    display.keyboardNavigation = False
    before = view.focus
    hand.key(hand.keys.Key_D, hand.CTRL)
    hand.key(hand.keys.Key_Up)
    bench.wait.settled(bench.session)
    assert (view.mode, view.focus) == (0, before)

"""Parts of the demo's cockpit: what they show stays where it is read, and knows its age."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import rosglass.demo
from rosglass.qt import QT6, QtCore, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

COCKPIT = Path(rosglass.demo.__file__).with_name("cockpit")
pytestmark = pytest.mark.skipif(not QT6, reason="the demo's cockpit is for Qt 6")

PANEL = """Item {
    Diagnostics { id: panel; width: 300; height: 120 }
    function list(item) {
        for (const child of item.children) {
            const found = child.objectName === "list" ? child : list(child)
            if (found)
                return found
        }
    }
    function values() { return panel.states.map((state) => state.value).join() }
    function levels() { return panel.states.map((state) => state.level).join() }
    function scroll(y) { list(panel).contentY = y }
    function place() { return list(panel).contentY }
    function end() { return list(panel).contentHeight - list(panel).height }
    function sort() { panel.sort() }
}"""


class Parts:
    """The panel, and a robot whose parts say a number each."""

    def __init__(self, running: Any, wait: Callable[..., None]) -> None:
        self.root = running.load(PANEL, f'import QtQuick 2.15\nimport "{COCKPIT.as_uri()}"')
        self._wait = wait
        self._publisher = running.robot.create_publisher(
            "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"
        )

    def say(self, *values: int) -> None:
        """Send the parts' numbers, until they are shown."""
        status = [
            {"name": f"part {n:02}", "values": [{"key": "n", "value": str(value)}]}
            for n, value in enumerate(values)
        ]
        shown = ",".join(map(str, values))

        def arrived() -> bool:
            self._publisher.publish({"status": status})
            return bool(self.root.values() == shown)

        self._wait(arrived)


def test_the_list_stays_where_it_is_read(running: Any, wait: Callable[..., None]) -> None:
    parts = Parts(running, wait)
    parts.say(*range(12))
    end = parts.root.end()
    assert end > 60
    for place in (0, 60, end):
        parts.root.scroll(place)
        for changed in (100, 101):
            parts.say(changed + place, *range(1, 12))
            assert parts.root.place() == place


class Clock(QtCore.QObject):
    """Stands for JavaScript's Date."""

    milliseconds = 1e12

    @Slot(result=float)
    def now(self) -> float:
        return self.milliseconds


def test_setting_the_clock_silences_no_part(running: Any, wait: Callable[..., None]) -> None:
    clock = Clock(running.engine)
    running.engine.rootContext().setContextProperty("Date", clock)
    parts = Parts(running, wait)
    parts.say(1, 2)
    clock.milliseconds += 3_600_000
    parts.root.sort()
    assert parts.root.levels() == "0,0"
    # A part that says no more is silent all the same.
    clock.milliseconds -= 7_200_000
    wait(lambda: parts.root.levels() == "3,3")


def test_image_that_stands_still_ages_when_the_clock_is_set_back(
    running: Any, wait: Callable[..., None]
) -> None:
    pytest.importorskip("PySide6.QtMultimedia", reason="the cockpit needs the extra `camera`")
    clock = Clock(running.engine)
    running.engine.rootContext().setContextProperty("Date", clock)
    root = running.load(
        """CameraView {
            stamp: 1e12
            age: 0
            received: true
            function isOld() { return age > limit }
        }""",
        f'import QtQuick 2.15\nimport "{COCKPIT.as_uri()}"',
    )
    assert not root.isOld()
    clock.milliseconds -= 3_600_000
    wait(root.isOld)


def test_a_title_is_shown_whole_beside_and_above_the_age(running: Any) -> None:
    root = running.load(
        """Item {
            Panel { id: panel; title: "Attitude"; width: 160; height: 120; fresh: false; age: -1 }
            function title() { return panel.children[0] }
            function age() { return panel.children[1] }
            function isCut() { return title().truncated }
            function overlaps() {
                return age().y < title().y + title().height
                    && age().x < title().x + title().contentWidth
            }
            function widen() { panel.width = 320 }
            function lines() { return age().y > title().y ? 2 : 1 }
        }""",
        f'import QtQuick 2.15\nimport "{COCKPIT.as_uri()}"',
    )
    assert not root.isCut()
    assert not root.overlaps()
    assert root.lines() == 2
    root.widen()
    assert root.lines() == 1
    assert not root.overlaps()


def test_the_knob_stays_in_its_ring_when_the_stick_is_laid_out(running: Any) -> None:
    root = running.load(
        """Item {
            DriveStick {
                id: stick
                width: 20
                height: 20
                drive: QtObject {
                    property real left: 0
                    property real forward: 0
                    property bool held: false
                    property bool active: false
                    function release() {}
                }
            }
            function resize() { stick.width = stick.height = 170 }
            function offset() {
                const knob = stick.children.find((item) => item.gradient !== undefined
                                                           && item.gradient)
                return Math.max(Math.abs(knob.x + knob.width / 2 - stick.width / 2),
                                Math.abs(knob.y + knob.height / 2 - stick.height / 2))
            }
        }""",
        f'import QtQuick 2.15\nimport "{COCKPIT.as_uri()}"',
    )
    assert root.offset() < 1
    root.resize()
    assert root.offset() < 1


@pytest.mark.parametrize(("width", "height", "zoom"), [(1340, 752, 1), (3840, 2160, 2)])
def test_the_cockpit_grows_with_screens_that_report_no_resolution(
    running: Any, wait: Callable[..., None], width: int, height: int, zoom: float
) -> None:
    pytest.importorskip("PySide6.QtMultimedia", reason="the cockpit needs the extra `camera`")
    from rosglass.demo.app import register

    register()
    window = running.load(
        (COCKPIT / "main.qml").read_text().partition("\nWindow {")[2].join(["Window {", ""]),
        f'import QtQuick\nimport Ros2 1.0\nimport "{COCKPIT.as_uri()}"',
    )
    window.setProperty("width", width)
    window.setProperty("height", height)
    wait(lambda: window.property("zoom") == zoom)
    cockpit = window.findChild(QtCore.QObject, "cockpit")
    wait(lambda: (cockpit.width(), cockpit.height()) == (width / zoom, height / zoom))


def test_a_release_in_an_outage_does_not_undo_a_stop_of_that_time(
    running: Any, wait: Callable[..., None]
) -> None:
    root = running.load(
        """Item {
            EmergencyStop { id: button }
            property bool fresh: button.counter.fresh && button.known
            property string wanted: String(button.wanted)
            property string problem: button.problem
            function release() { button.release() }
        }""",
        f'import QtQuick 2.15\nimport "{COCKPIT.as_uri()}"',
    )
    robot, released = running.robot, list[int]()
    state = robot.create_publisher("/emergency_stop/state", "std_msgs/msg/Bool")
    counter = robot.create_publisher("/emergency_stop/counter", "std_msgs/msg/UInt32")
    robot.create_subscription(
        "/emergency_stop/release", "std_msgs/msg/UInt32", lambda m: released.append(m.data)
    )

    def say(number: int) -> bool:
        counter.publish(data=number)
        state.publish(data=True)
        return bool(root.property("fresh"))

    wait(lambda: say(1))
    wait(lambda: not root.property("fresh"))
    root.release()
    wait(lambda: say(2))  # after another operator's stop
    wait(lambda: say(3) and root.property("wanted") == "null")
    assert released == []
    assert "unknown" in root.property("problem")
    root.release()
    wait(lambda: released)
    assert set(released) == {3}

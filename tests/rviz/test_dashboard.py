"""The example's dashboard: old values are not shown as live, and refusals are reported."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

FOLDER = Path(__file__).parents[2] / "examples/rviz"
PANELS = {
    *("View", "Posture", "Mode", "Battery", "Front camera", "Rear camera"),
    *("Mission", "Behaviours", "Settings"),
}


class Dashboard:
    """The texts that the operator sees, and actions, by names."""

    def __init__(self, root: Any) -> None:
        self.root = root

    def items(self) -> list[Any]:
        found = [self.root]
        for item in found:
            found.extend(item.childItems())
        return found

    def seen(self) -> list[str]:
        """Return all texts that are shown."""
        texts = [item for item in self.items() if item.inherits("QQuickText")]
        return [item.property("text") for item in texts if item.isVisible() and item.opacity() > 0]

    def find(self, name: str) -> Any:
        (item,) = [item for item in self.items() if item.objectName() == name]
        return item

    def click(self, name: str) -> None:
        self.find(name).clicked.emit()

    def point(self, name: str) -> tuple[float, float]:
        """Return the middle of an item."""
        from rosglass.rviz.qt5 import QtCore

        item = self.find(name)
        middle = item.mapToScene(QtCore.QPointF(item.width() / 2, item.height() / 2))
        return middle.x(), middle.y()

    @property
    def stale(self) -> dict[str, bool]:
        """Return by title whether each panel says that it is old."""
        panels = [item for item in self.items() if item.property("title")]
        panels = [item for item in panels if item.property("framed") is not False]
        return {item.property("title"): is_wrong(item) for item in panels}


def is_wrong(panel: Any) -> bool:
    """Return whether a panel, or the view of a camera, says that it is old."""
    live = panel.property("live")
    wrong = panel.property("wrong")
    return bool(not live if wrong is None else wrong)


@pytest.fixture
def robot(master: str) -> Iterator[subprocess.Popen[bytes]]:
    command = [sys.executable, "-m", "rosglass.cli", "robot", "--equipped", "--fps", "10"]
    url = master.replace("http:", "ros1:")
    program = subprocess.Popen(
        [*command, "--leash", "--url", url],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "ROS_IP": "127.0.0.1"},
    )
    yield program
    program.send_signal(signal.SIGCONT)
    program.kill()
    program.wait(30)


@pytest.fixture
def dashboard(app: Any, wait: Any, robot: subprocess.Popen[bytes]) -> Dashboard:
    app.load_config(FOLDER / "figure1.rviz")
    dashboard = Dashboard(app.add_qml(FOLDER / "Dashboard.qml").root)
    wait(lambda: live(dashboard), timeout=60.0)
    return dashboard


def live(dashboard: Dashboard) -> bool:
    known = dashboard.find("emergency stop").property("known")
    quiet = not any("NO " in text or "SILENT" in text for text in dashboard.seen())
    return bool(
        known and quiet and dashboard.stale.keys() == PANELS and not any(dashboard.stale.values())
    )


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP])
def test_all_elements_show_that_the_robot_is_silent(
    dashboard: Dashboard, robot: subprocess.Popen[bytes], wait: Any, end: signal.Signals
) -> None:
    wait(dashboard.find("pause").isEnabled)
    robot.send_signal(end)
    wait(lambda: all(dashboard.stale.values()))
    wait(lambda: not dashboard.find("emergency stop").property("known"))
    wait(lambda: any(text.startswith("ROBOT SILENT") for text in dashboard.seen()))
    wait(lambda: "STATE UNKNOWN" in dashboard.seen())
    wait(lambda: not dashboard.find("pause").isEnabled())
    wait(lambda: "following" not in dashboard.seen())
    wait(lambda: dashboard.seen().count("NO SIGNAL") == 2)
    dashboard.click("tab Behaviours")
    wait(lambda: "ROBOT SILENT" in dashboard.seen())
    assert not dashboard.find("goal0").isEnabled()
    dashboard.click("tab Settings")
    wait(lambda: "Flashlight: unknown" in dashboard.seen())
    speed = dashboard.find("row_max_speed")
    assert speed.property("ranged"), "ROS 1 has no ranges: they are the example's"
    assert not speed.property("usable")
    # A request that is made all the same shows that there is no answer.
    dashboard.find("flashlight").call()
    refusals = ("FAILED: ", "NOT AVAILABLE: ")
    wait(lambda: any(text.startswith(refusals) for text in dashboard.seen()))
    if end is signal.SIGSTOP:
        robot.send_signal(signal.SIGCONT)
        dashboard.click("tab Mission")
        wait(lambda: live(dashboard))


def test_beside_panels_there_is_one_camera(dashboard: Dashboard, wait: Any) -> None:
    def titles() -> set[str]:
        names = {"POSTURE", "BATTERY", "FRONT CAMERA", "REAR CAMERA"}
        shown = [i for i in dashboard.items() if i.property("title") and i.isVisible()]
        return names & {item.property("title").upper() for item in shown}

    assert len(titles()) == 4
    dashboard.root.setWidth(900)
    wait(lambda: titles() == {"POSTURE", "BATTERY", "FRONT CAMERA"})
    dashboard.root.setWidth(700)
    wait(lambda: titles() == {"FRONT CAMERA"})


def test_the_stop_is_operated_by_keyboard_and_shows_the_focus(
    dashboard: Dashboard, hand: Any, wait: Any
) -> None:
    stop = dashboard.find("emergency stop")
    rings = [item for item in dashboard.items() if item.metaObject().className()[:9] == "FocusRing"]
    (ring,) = [item for item in rings if item.parentItem() is stop]
    # RViz has the keyboard.
    hand.key("space")
    wait(lambda: stop.property("stopped"))
    wait(lambda: "hold, or Enter, to release" in dashboard.seen())
    hand.click(*dashboard.point("mushroom"))
    assert not ring.isVisible()
    for _ in range(60):
        if ring.isVisible():
            break
        hand.key("Tab")
    assert ring.isVisible(), "it is reached by Tab"
    hand.key("Return")
    wait.nothing_happens(1)
    assert stop.property("stopped"), "a short press does not release"
    hand.do("keydown", "Return")
    wait(lambda: not stop.property("stopped"))
    hand.do("keyup", "Return")
    hand.key("space")
    wait(lambda: stop.property("stopped"))
    hand.key("Tab")
    wait(lambda: not ring.isVisible())
    # A button has it now, and leaves the stop to the space bar.
    hand.do("keydown", "Return")
    wait.nothing_happens(1)
    hand.do("keyup", "Return")
    assert stop.property("stopped"), "Enter is the button's"
    hand.key("ISO_Left_Tab")
    wait(ring.isVisible)
    hand.do("keydown", "Return")
    wait(lambda: not stop.property("stopped"))
    hand.do("keyup", "Return")


def test_the_stop_is_operated_by_mouse(dashboard: Dashboard, hand: Any, wait: Any) -> None:
    stop = dashboard.find("emergency stop")
    hand.click(*dashboard.point("mushroom"))
    wait(lambda: stop.property("stopped"))
    hand.click(*dashboard.point("unlock"))
    wait.nothing_happens(1)
    assert stop.property("stopped"), "a click does not release"
    hand.press()
    wait(lambda: not stop.property("stopped"))
    hand.release()


def test_requests_refused_by_the_robot_are_reported(
    dashboard: Dashboard, master: str, wait: Any
) -> None:
    import rosglass

    url = master.replace("http:", "ros1:")
    with closing(rosglass.connect(url, name="goals")) as node:
        goals = node.create_publisher("/move_base_simple/goal", "geometry_msgs/msg/PoseStamped")
        wait(lambda: goals.subscription_count() > 0)

        def send() -> None:
            place = {"position": {"x": 1.0, "y": 1.0}, "orientation": {"w": 1.0}}
            goals.publish(header={"frame_id": "map"}, pose=place)

        send()
        wait(lambda: "Goal: on the way to the goal" in dashboard.seen())
        dashboard.find("mode").request("autonomous")
        wait(lambda: "Goal: the mode is autonomous now" in dashboard.seen())
        send()
        refusal = "GOAL REFUSED: no goals in mode autonomous; choose supervised"
        wait(lambda: refusal in dashboard.seen())
    dashboard.click("tab Behaviours")
    dashboard.find("mode").request("safe")
    wait(lambda: dashboard.find("mode").property("confirmed") == "safe")
    wait(lambda: dashboard.find("goal0").isEnabled())
    dashboard.click("goal0")
    wait(lambda: "Look around: FAILED" in dashboard.seen())
    text = "no behaviours in mode safe; choose another mode"
    wait(lambda: any(text in one for one in dashboard.seen()))

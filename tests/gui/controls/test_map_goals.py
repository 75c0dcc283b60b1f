"""Goals, waypoints and the robot's pose, set on a MapView, for servers of Nav2 and move_base."""

from __future__ import annotations

import json
import math
import subprocess
import threading
import time
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import pytest
from map_messages import grid, transform

from rosglass.comm import QoS
from rosglass.qt import QtCore, optional

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

pytestmark = pytest.mark.both_qt
zenoh = pytest.mark.parametrize("url", ["zenoh"], indirect=True)
ros1 = pytest.mark.parametrize("url", ["ros1"], indirect=True)
ACTIONS = {
    "NavigateToPose": (
        "geometry_msgs/PoseStamped pose\nstring behavior_tree\n---\n"
        "uint16 error_code\nstring error_msg\n---\n"
        "geometry_msgs/PoseStamped current_pose\nint16 number_of_recoveries\n"
        "float32 distance_remaining\n"
    ),
    "FollowWaypoints": (
        "geometry_msgs/PoseStamped[] poses\n---\nint32[] missed_waypoints\n---\n"
        "uint32 current_waypoint\n"
    ),
}
MOVE_BASE = """
import json, sys, rospy, actionlib
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseResult
rospy.init_node("move_base", disable_signals=True)
def report(**what):
    print(json.dumps(what), flush=True)
def execute(goal):
    pose = goal.target_pose
    report(x=pose.pose.position.x, frame=pose.header.frame_id, z=pose.pose.orientation.z)
    feedback = MoveBaseFeedback()
    feedback.base_position.pose.position.x = pose.pose.position.x - 1.5
    feedback.base_position.pose.position.y = pose.pose.position.y
    while not server.is_preempt_requested():
        server.publish_feedback(feedback)
        rospy.sleep(0.05)
        if pose.pose.position.y > 2.5:
            server.set_aborted(MoveBaseResult(), "no way there")
            return
    report(preempted=True)
    server.set_preempted()
server = actionlib.SimpleActionServer("move_base", MoveBaseAction, execute, auto_start=False)
server.start()
report(ready=True)
sys.stdin.read()
"""


class Hand:
    """Drags on the map by the mouse, in metres."""

    def __init__(self, controls: Any, view: Any) -> None:
        self._controls, self._view = controls, view
        self._test: Any = optional("QtTest").QTest

    def at(self, x: float, y: float) -> Any:
        """Return the pixel of a point."""
        plane = self._controls.find("plane")
        point = plane.mapToScene(self._view.property("camera").toScreen(x, y))
        return QtCore.QPoint(round(point.x()), round(point.y()))

    def press(self, x: float, y: float) -> None:
        left, none = QtCore.Qt.MouseButton.LeftButton, QtCore.Qt.KeyboardModifier.NoModifier
        self._test.mousePress(self._controls.window, left, none, self.at(x, y))

    def move(self, x: float, y: float) -> None:
        self._test.mouseMove(self._controls.window, self.at(x, y))

    def release(self, x: float, y: float) -> None:
        left, none = QtCore.Qt.MouseButton.LeftButton, QtCore.Qt.KeyboardModifier.NoModifier
        self._test.mouseRelease(self._controls.window, left, none, self.at(x, y))

    def drag(self, x: float, y: float, to_x: float, to_y: float) -> None:
        """Press at a point, and release at another one."""
        self.press(x, y)
        self.move((x + to_x) / 2, (y + to_y) / 2)
        self.move(to_x, to_y)
        self.release(to_x, to_y)

    def key(self, name: str) -> None:
        self._test.keyClick(self._controls.window, getattr(QtCore.Qt.Key, f"Key_{name}"))


def show(controls: Any, wait: Callable[..., None]) -> tuple[Any, Hand]:
    """Publish a map of 6 m x 4 m with the robot at 2, 0; show it, and wait until it is there."""
    import numpy as np

    node = controls.robot
    node.create_publisher("/tf_static", "tf2_msgs/msg/TFMessage", QoS.latched()).publish(
        transforms=[transform("map", "base_link", 2.0)]
    )
    node.create_publisher("/map", "nav_msgs/msg/OccupancyGrid", QoS.latched()).publish(
        grid(np.zeros((40, 60)))
    )
    view = controls.show("MapView { anchors.fill: parent }", 640, 480)
    wait(lambda: view.property("scene").property("hasMap"))
    wait(lambda: view.property("fitted_"))
    return view, Hand(controls, view)


class Navigation:
    """Nav2's servers: they drive until they are cancelled, or what a test sets.

    Attributes:
        goals: Those received.
        end: Returns the result of a goal; None while it goes on.
    """

    def __init__(self, node: Any) -> None:
        self.goals: list[Any] = []
        self.end: Callable[[Any], Any] = lambda goal: {} if goal.is_cancel_requested else None
        self.accepts = self.cancels = True
        self.feedback: dict[str, Any] = {"distance_remaining": 3.5}
        self.node = node

    def offer(self, name: str, kind: str) -> Any:
        return self.node.create_action_server(
            name, f"nav2_msgs/action/{kind}", self._execute,
            accept=lambda _: self.accepts, cancel=lambda _: self.cancels,
        )  # fmt: skip

    def _execute(self, goal: Any) -> Any:
        self.goals.append(goal)
        while (result := self.end(goal)) is None:
            goal.publish_feedback(self.feedback)
            time.sleep(0.02)  # as Nav2 does
        return result


@pytest.fixture
def nav2(url: str, tmp_path: Path) -> Iterator[Navigation]:
    """A node with the servers of Nav2."""
    import rosglass
    from rosglass.interfaces import Library

    folder = tmp_path / "types" / "nav2_msgs" / "action"
    folder.mkdir(parents=True)
    for name, text in ACTIONS.items():
        (folder / f"{name}.action").write_text(text)
    library = Library()
    library.add_path(tmp_path / "types")
    node = rosglass.connect(url, "nav2", library=library)
    yield Navigation(node)
    node.close()


def message(controls: Any) -> str:
    return str(controls.find("message").property("text"))


@zenoh
def test_goal_is_driven_to_and_cancelled(
    live_controls: Any, nav2: Navigation, wait: Callable[..., None]
) -> None:
    nav2.offer("/navigate_to_pose", "NavigateToPose")
    view, hand = show(live_controls, wait)
    goals = view.property("goals")
    wait(lambda: view.property("scene").property("goalAction") == "/navigate_to_pose")
    view.setProperty("tool", "goal")
    hand.drag(3.0, 1.0, 3.0, 2.0)
    assert view.property("tool") == "", "one drag, one goal"
    wait(lambda: nav2.goals)
    pose = nav2.goals[0].goal.pose
    assert pose.header.frame_id == "map"
    assert (pose.pose.position.x, pose.pose.position.y) == pytest.approx((3.0, 1.0), abs=0.02)
    assert math.atan2(pose.pose.orientation.z, pose.pose.orientation.w) * 2 == pytest.approx(
        math.pi / 2, abs=0.02
    )
    wait(lambda: "3.5 m left" in message(live_controls))
    assert goals.property("distance") == pytest.approx(3.5)
    assert live_controls.find("cancel").isVisible()
    nav2.cancels = False
    goals.cancel()
    wait(lambda: "not cancelled: " in message(live_controls))
    before = goals.property("distance")
    nav2.feedback = {"distance_remaining": 3.25}
    wait(lambda: goals.property("distance") != before)
    assert "not cancelled: " in message(live_controls), "to be read, although it drives on"
    assert goals.property("active") == "goal", "it goes on"
    nav2.cancels = True
    goals.cancel()
    wait(lambda: message(live_controls) == "Goal: cancelled")
    assert goals.property("active") == ""
    assert not live_controls.find("cancel").isVisible()


@zenoh
def test_refused_and_failed_goals_say_why(
    live_controls: Any, nav2: Navigation, wait: Callable[..., None]
) -> None:
    nav2.offer("/navigate_to_pose", "NavigateToPose")
    nav2.accepts = False
    view, hand = show(live_controls, wait)
    goals = view.property("goals")
    wait(lambda: view.property("scene").property("goalAction"))
    view.setProperty("tool", "goal")
    hand.drag(3.0, 1.0, 3.5, 1.0)
    wait(lambda: goals.property("failed"))
    assert "Goal: refused: the server of /navigate_to_pose does not accept" in message(
        live_controls
    )
    assert goals.property("active") == ""
    nav2.accepts = True

    def fail(_: Any) -> Any:
        raise RuntimeError("the path is blocked")

    nav2.end = fail
    view.setProperty("tool", "goal")
    hand.drag(3.0, 1.0, 3.5, 1.0)
    wait(lambda: "not reached" in message(live_controls))
    assert goals.property("failed")
    nav2.end = lambda _: {}
    view.setProperty("tool", "goal")
    hand.drag(3.0, 1.0, 3.5, 1.0)
    wait(lambda: message(live_controls) == "Goal: reached")
    assert not goals.property("failed")


@zenoh
def test_goal_whose_server_disappears_has_an_unknown_outcome(
    live_controls: Any, nav2: Navigation, wait: Callable[..., None]
) -> None:
    nav2.offer("/navigate_to_pose", "NavigateToPose")
    view, hand = show(live_controls, wait)
    wait(lambda: view.property("scene").property("goalAction"))
    view.setProperty("tool", "goal")
    hand.drag(3.0, 1.0, 3.5, 1.0)
    wait(lambda: "m left" in message(live_controls))
    nav2.end = lambda _: {}
    nav2.node.close()
    wait(lambda: view.property("goals").property("active") == "")
    assert view.property("goals").property("status")


@zenoh
def test_waypoints_are_driven_in_order(
    live_controls: Any, nav2: Navigation, wait: Callable[..., None]
) -> None:
    nav2.offer("/follow_waypoints", "FollowWaypoints")
    nav2.feedback = {"current_waypoint": 1}
    view, hand = show(live_controls, wait)
    wait(lambda: view.property("scene").property("waypointsAction") == "/follow_waypoints")
    view.setProperty("tool", "waypoints")
    for x in (1.0, 2.0, 3.0):
        hand.drag(x, 1.0, x + 0.5, 1.0)
    assert live_controls.find("sendWaypoints").property("text") == "Drive 3"
    view.sendWaypoints()
    wait(lambda: nav2.goals)
    xs = [one.pose.position.x for one in nav2.goals[0].goal.poses]
    assert xs == pytest.approx([1.0, 2.0, 3.0], abs=0.02)
    wait(lambda: "waypoint 2 of 3" in message(live_controls), lambda: message(live_controls))
    nav2.end = lambda _: {"missed_waypoints": [2]}
    wait(lambda: "without 1 of the waypoints" in message(live_controls))


@zenoh
def test_goal_of_one_server_ends_that_of_another(
    live_controls: Any, nav2: Navigation, wait: Callable[..., None]
) -> None:
    nav2.offer("/follow_waypoints", "FollowWaypoints")
    nav2.feedback = {}
    view, _ = show(live_controls, wait)
    goals = view.property("goals")
    wait(lambda: view.property("scene").property("waypointsAction"))
    goals.sendWaypoints([{"x": 1.0, "y": 1.0, "yaw": 0.0}])
    wait(lambda: nav2.goals)
    nav2.offer("/navigate_to_pose", "NavigateToPose")
    wait(lambda: view.property("scene").property("goalAction"))
    goals.send(3.0, 1.0, 0.0)
    wait(lambda: len(nav2.goals) == 2)
    wait(lambda: nav2.goals[0].is_cancel_requested)
    assert goals.property("active") == "goal"
    assert not nav2.goals[1].is_cancel_requested
    view.setProperty("ns", "/robot2")
    assert goals.property("active") == ""
    assert message(live_controls) == "Goal: the goal of the other robot goes on"


def test_goal_without_navigation_is_refused_and_published_with_a_subscriber(
    controls: Any, wait: Callable[..., None]
) -> None:
    view, hand = show(controls, wait)
    view.setProperty("tool", "goal")
    hand.drag(3.0, 1.0, 3.0, 0.5)
    assert "no navigation action, and /goal_pose has no subscriber" in message(controls)
    assert view.property("goals").property("failed")
    got: list[Any] = []
    controls.robot.create_subscription("/goal_pose", "geometry_msgs/msg/PoseStamped", got.append)
    view.setProperty("tool", "goal")
    wait(lambda: view.property("scene").subscribers("/goal_pose"))
    hand.drag(3.0, 1.0, 3.0, 0.5)
    wait(lambda: got)
    assert got[0].pose.position.x == pytest.approx(3.0, abs=0.02)
    assert "which reports nothing back" in message(controls)


def test_pose_is_set_by_the_keyboard_and_given_up_by_escape(
    controls: Any, wait: Callable[..., None]
) -> None:
    got: list[Any] = []
    kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
    controls.robot.create_subscription("/initialpose", kind, got.append)
    view, hand = show(controls, wait)
    plane = controls.find("plane")
    plane.forceActiveFocus()
    view.setProperty("tool", "pose")
    view.property("camera").lookAt(1.5, 2.5)
    hand.key("Return")
    hand.key("Comma")
    hand.key("Escape")
    hand.key("Return")  # begins again
    for _ in range(6):
        hand.key("Comma")
    assert not got
    hand.key("Return")
    wait(lambda: got)
    pose = got[0].pose
    assert (pose.pose.position.x, pose.pose.position.y) == pytest.approx((1.5, 2.5))
    assert pose.pose.orientation.z == pytest.approx(math.sin(math.pi / 4))
    assert pose.covariance[0] == pytest.approx(0.25)
    assert got[0].header.frame_id == "map"
    wait.settled(controls.engine_session)
    assert len(got) == 1


def test_drag_that_the_system_takes_away_sends_nothing(
    controls: Any, wait: Callable[..., None]
) -> None:
    got: list[Any] = []
    controls.robot.create_subscription("/goal_pose", "geometry_msgs/msg/PoseStamped", got.append)
    view, hand = show(controls, wait)
    view.setProperty("tool", "goal")
    hand.press(3.0, 1.0)
    hand.move(3.5, 1.0)
    assert controls.find("plane").property("draft") is not None
    controls.find("pointer").ungrabMouse()
    hand.release(3.5, 1.0)
    wait.settled(controls.engine_session)
    assert not got
    assert view.property("tool") == "goal"


@ros1
def test_goal_for_move_base_of_rospy(
    live_controls: Any, url: str, wait: Callable[..., None]
) -> None:
    env = {"PATH": "/usr/bin:/bin", "HOME": "/tmp", "PYTHONUNBUFFERED": "1", "ROS_IP": "127.0.0.1"}
    env["ROS_MASTER_URI"] = f"http://127.0.0.1:{urlsplit(url).port}"
    server = subprocess.Popen(
        ["/usr/bin/python3", "-c", MOVE_BASE],
        env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    lines: list[Any] = []

    def read() -> None:
        assert server.stdout is not None
        lines.extend(json.loads(line) for line in server.stdout)

    try:
        threading.Thread(target=read, daemon=True).start()
        view, hand = show(live_controls, wait)
        wait(lambda: view.property("scene").property("goalAction") == "/move_base")
        view.setProperty("tool", "goal")
        hand.drag(3.0, 1.0, 3.5, 1.0)
        wait(lambda: len(lines) > 1)
        assert lines[1]["frame"] == "map"
        assert lines[1]["x"] == pytest.approx(3.0, abs=0.02)
        wait(lambda: "1.5 m left" in message(live_controls), lambda: message(live_controls))
        view.property("goals").cancel()
        wait(lambda: message(live_controls) == "Goal: cancelled")
        view.setProperty("tool", "goal")
        hand.drag(3.0, 3.0, 3.5, 3.0)
        wait(lambda: message(live_controls) == "Goal: not reached: no way there")
    finally:
        server.kill()
        server.wait(10)

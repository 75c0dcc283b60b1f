"""The tools that send something to the robot: a goal, an estimate of its pose, a point."""
# ruff: noqa: N802, N815 - the names of slots, properties and signals are QML's

from __future__ import annotations

import logging
import math
import time
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rosglass.comm.names import similar
from rosglass.comm.qos import QoS
from rosglass.errors import Error
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QtCore, Signal, Slot, is_alive
from rosglass.scene.configs.rviz_formats import (
    TopicSetting,
    read_deviations,
    read_topic,
    ros_of,
    write_deviations,
    write_topic,
)
from rosglass.scene.configs.settings import Setting
from rosglass.scene.displays.shapes import ArrowShapes
from rosglass.scene.render.matrices import instance_matrix
from rosglass.scene.tools.pointer_event import PointerEvent, point_text
from rosglass.scene.tools.tool import MAP, Tool
from rosglass.scene.view_controllers.events import Button

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm.action_client import CancelAnswer, ClientGoal, GoalStatus
    from rosglass.comm.promise import Promise
    from rosglass.overlay.orbit import Point
    from rosglass.qml.engine.runtime import Runtime

__all__ = [
    "Nav2GoalTool",
    "PoseTool",
    "PublishPointTool",
    "PublishingTool",
    "SetGoalTool",
    "SetInitialPoseTool",
]

_log = logging.getLogger("rosglass.scene")
#: RViz's, for what a file does not say.
_QOS = QoS(depth=5)
#: Seconds that a new publisher waits for the first subscriber.
_MATCH_TIMEOUT_S = 2.0
#: Seconds for the server of an action to answer.
_GOAL_TIMEOUT_S = 10.0
#: Metres from which a drag turns the arrow: shorter ones leave it as it is.
_SHORTEST_M = 1e-6
#: RViz's arrow: length and diameter of shaft and head, metres.
_SHAFT, _HEAD = (2.0, 0.2), (0.5, 0.35)


class PublishingTool(Tool):
    """A tool that publishes a message; it advertises when it is selected for the first time.

    Attributes:
        MESSAGE: The type of the message.
        TOPICS: The topics by default, in ROS 1 and ROS 2.
    """

    MESSAGE: ClassVar[str] = ""
    TOPICS: ClassVar[tuple[str, str]] = ("", "")

    topic = Setting(
        "Topic", "topic", "", "Topic to publish on; empty for RViz's default.", then="_schedule"
    )

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        #: A message that waits for the publisher and its first subscriber, and its monotonic
        #: deadline.
        self._waiting: tuple[dict[str, Any], str, float] | None = None
        self._created_at = 0.0
        self._qos = _QOS
        super().__init__(parent, runtime)
        self.destroyed.connect(partial(_warn_of_goals, self.__dict__))

    # -- files -----------------------------------------------------------------------------------

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a file of either RViz."""
        refused = super().load_settings({k: v for k, v in saved.items() if k != "Topic"})
        try:
            found = read_topic(saved)
            # The robot may be of the other ROS, which has another default.
            default = self.TOPICS[(ros_of(self.class_id) or 2) - 1]
            self.set("Topic", "" if found.name == default else found.name)
            self._qos = found.qos(_QOS)
        except Error as error:
            refused.append(str(error))
        return refused

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file of one RViz."""
        kept = super().save_settings({k: v for k, v in (older or {}).items() if k != "Topic"})
        kept.pop("Topic", None)
        if older is not None and "Topic" in older:
            kept["Topic"] = older["Topic"]
        write_topic(kept, TopicSetting(self.topic or self.TOPICS[ros - 1]), ros)
        return kept

    # -- the publisher ---------------------------------------------------------------------------

    @property
    def target(self) -> str:
        """The topic on which it publishes, as it was set; RViz's default otherwise."""
        node = self.node
        ros1 = node.wire == "ros1" if node is not None else self.class_id.startswith("rviz/")
        return self.topic or self.TOPICS[0 if ros1 else 1]

    def _placeholder(self, path: str) -> str:
        return self.target if path == "Topic" else ""

    def activate(self) -> None:
        """Advertise the topic."""
        self._uses_node = True
        self._schedule()

    def _wanted(self) -> tuple[Any, ...] | None:
        return None if self.node is None else (self.node, self.target, self._qos)

    def _factory(self, *wanted: Any) -> Callable[[], Any]:
        node, topic, qos = wanted
        return lambda: node.create_publisher(topic, self.MESSAGE, qos)

    def _on_created(self, endpoint: Any) -> None:  # noqa: ARG002 - the base class's signature
        self._created_at = time.monotonic()
        self._set_problem("")
        self._send_waiting()

    def _on_closed(self, endpoint: Any) -> None:  # noqa: ARG002 - the base class's signature
        self._drop("the node was shut down" if self.node is None else "the topic was changed")

    def _on_create_failed(self, error: Error) -> None:
        super()._on_create_failed(error)
        self._drop(str(error))

    @Slot()
    def _on_tick(self) -> None:
        if self._waiting is not None:
            self._send_waiting()

    # -- sending ---------------------------------------------------------------------------------

    def send(self, fields: dict[str, Any], text: str) -> None:
        """Send a message; the status bar says what became of it.

        A new publisher waits up to two seconds for its first subscriber.

        Args:
            fields: Fields of the message.
            text: Description for the status bar, e.g. ``Goal at [1, 2]``.
        """
        self._drop("another one followed")
        self._run_update()  # the topic may just have been set
        sender, why = self._endpoint, self._disconnected()
        # In ROS 1, subscribers stay connected without the master.
        if why and (sender is None or not self._subscribers()):
            self._complain(f"{text}: not sent: {why}")
            return
        self._waiting = (fields, text, time.monotonic() + _MATCH_TIMEOUT_S)
        self._send_waiting()

    def _send_waiting(self) -> None:
        sender, waiting = self._endpoint, self._waiting
        if waiting is None:
            return
        fields, text, deadline = waiting
        now = time.monotonic()
        if sender is None:
            if now > deadline:
                self._drop(self.problem or "the topic could not be advertised in time")
            return
        try:
            count = self._subscribers()
            if not count and now < self._created_at + _MATCH_TIMEOUT_S:
                return
            self._waiting = None
            sender.publish(fields)
        except Error as error:
            self._waiting = None
            self._complain(f"{text}: not sent: {error}")
            return
        why = self._disconnected()
        if why:
            self._complain(f"{text}: sent on {sender.topic}, but {why}")
        elif count:
            self._set_problem("")
            self.announce(f"{text}: sent on {sender.topic}")
        else:
            self._complain(f"{text}: sent on {sender.topic}, which has no subscriber{self._hint()}")

    def _subscribers(self) -> int:
        try:
            return int(self._endpoint.subscription_count())
        except Error:
            return 0

    def _hint(self) -> str:
        node, sender = self.node, self._endpoint
        try:
            if node is None or sender is None:
                return ""
            names = [name for name in node.topics() if node.subscriptions(name)]
        except Error:
            return ""
        return similar(sender.topic, names)

    def drop_waiting(self) -> bool:
        """Drop a message that waits for a subscriber or a server; return whether there was one."""
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            self.announce(f"{waiting[1]}: not sent: it was dropped")
        return waiting is not None

    def leave(self) -> None:
        """Belong to no view any more; what waits for a subscriber or a server is not sent."""
        self._drop("the tool was removed")
        super().leave()

    def _drop(self, why: str) -> None:
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            self._complain(f"{waiting[1]}: not sent: {why}")

    def _complain(self, text: str) -> None:
        """Show and log that something was not sent, or reached no one."""
        self._set_problem("")
        self._set_problem(f"{self.label}: {text}")
        self.announce(text)

    def header(self) -> dict[str, Any]:
        """Return the header of a message: the fixed frame, and the robot's time."""
        node, view = self.node, self.view
        found: dict[str, Any] = {"frame_id": "" if view is None else view.scene.fixed_frame}
        if node is not None:
            found["stamp"] = node.now()
        return found


def _warn_of_goals(state: dict[str, Any], *_: Any) -> None:
    """Log unsent messages and goals of a destroyed tool; only its attributes are left."""
    waiting = state.get("_waiting")
    if waiting is not None:
        _log.warning("%s: not sent: the tool was destroyed", waiting[1])
    if state.get("_goalActive"):
        text = "goal of %s: the tool was destroyed: its goal continues without further reports"
        _log.warning(text, state.get("_action"))


class PoseTool(PublishingTool):
    """A pose on the ground: a press sets its position, a drag its direction.

    The ground is the plane z = 0 of the fixed frame.
    """

    _HELP = "Click and drag mouse to set position/orientation."
    #: Colour of the arrow.
    _COLOR: ClassVar[tuple[float, ...]] = (0.0, 1.0, 0.0, 1.0)

    #: A pose was set: x and y in metres, yaw in radians, in the fixed frame.
    poseSet = Signal(float, float, float)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._arrow = ArrowShapes()
        self._position: Point | None = None
        self._yaw = 0.0
        super().__init__(parent, runtime)
        self._arrow.set_arrows(np.eye(4)[np.newaxis], _SHAFT, _HEAD, self._COLOR)
        self._arrow.visible = False
        self.root.add(self._arrow)

    def activate(self) -> None:
        """Show the instructions."""
        super().activate()
        self.set_status(self._HELP, hit=True)

    def deactivate(self) -> None:
        """Hide the arrow."""
        self.on_cancel()

    def on_press(self, event: PointerEvent) -> bool:
        """Set the position."""
        if event.button is not Button.LEFT:
            return False
        self._position, self._yaw = event.ground, 0.0
        if self._position is None:
            self.set_status("There is no ground (z = 0 of the fixed frame) here.", hit=False)
        else:
            self._show_arrow()
        return True

    def on_move(self, event: PointerEvent) -> None:
        """Turn the arrow."""
        if not event.buttons:
            self.set_status(self._HELP, hit=event.ground is not None)
            return
        start, now = self._position, event.ground
        if start is not None and now is not None:
            x, y = now.x - start.x, now.y - start.y
            if math.hypot(x, y) > _SHORTEST_M:
                self._yaw = math.atan2(y, x)
            self._show_arrow()

    def on_release(self, event: PointerEvent) -> None:
        """Send the pose."""
        start = self._position
        if start is None:
            self.set_status(self._HELP, hit=event.ground is not None)
            return
        yaw = self._yaw
        self.on_cancel()
        self.send_pose(start.x, start.y, yaw)
        if is_alive(self):
            self.poseSet.emit(start.x, start.y, yaw)
        self.finish()

    def on_cancel(self) -> None:
        """Drop the pose."""
        self._position = None
        self._arrow.visible = False

    def _show_arrow(self) -> None:
        start, turn = self._position, self._yaw / 2
        assert start is not None
        self._arrow.pose = instance_matrix(start, (0.0, 0.0, math.sin(turn), math.cos(turn)))
        self._arrow.visible = True
        degrees = math.degrees(self._yaw)
        self.set_status(f"{point_text(start[:2])} m, {degrees:.1f} degrees", hit=True)

    def send_pose(self, x: float, y: float, yaw: float) -> None:
        """Send a pose of the fixed frame.

        Args:
            x: Metres.
            y: Metres.
            yaw: Radians about z.
        """
        raise NotImplementedError

    @staticmethod
    def pose(x: float, y: float, yaw: float) -> dict[str, Any]:
        """Return a pose on the ground."""
        turn = {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
        return {"position": {"x": x, "y": y, "z": 0.0}, "orientation": turn}

    def _text(self, what: str, x: float, y: float, yaw: float) -> str:
        return f"{what} at {point_text((x, y))} m, {math.degrees(yaw):.1f} degrees"


class SetInitialPoseTool(PoseTool):
    """RViz's 2D Pose Estimate: sets the robot's pose for localization."""

    TYPE, NAME, KEY = "SetInitialPose", "2D Pose Estimate", "p"
    DESCRIPTION = "Sends where the robot is: press at its position, drag to its direction."
    MESSAGE = "geometry_msgs/PoseWithCovarianceStamped"
    TOPICS = ("/initialpose", "/initialpose")

    xDeviation = Setting(
        "X std deviation", "float", 0.5, "Standard deviation in x, metres.", min=0.0, max=1e6
    )
    yDeviation = Setting(
        "Y std deviation", "float", 0.5, "Standard deviation in y, metres.", min=0.0, max=1e6
    )
    yawDeviation = Setting(
        "Theta std deviation", "float", math.pi / 12, "Standard deviation of the yaw, radians.",
        min=0.0, max=1e6,
    )  # fmt: skip

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a file of either RViz."""
        refused = super().load_settings({k: v for k, v in saved.items() if "deviation" not in k})
        try:
            names = ("X std deviation", "Y std deviation", "Theta std deviation")
            for name, number in zip(names, read_deviations(saved), strict=True):
                self.set(name, number)
        except Error as error:
            refused.append(str(error))
        return refused

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file of one RViz."""
        kept = super().save_settings(older, ros)
        # RViz 2 has covariances.
        for name in [name for name in kept if name.endswith("std deviation")]:
            del kept[name]
        write_deviations(kept, (self.xDeviation, self.yDeviation, self.yawDeviation), ros)
        return kept

    def send_pose(self, x: float, y: float, yaw: float) -> None:
        """Publish where the robot is."""
        covariance = [0.0] * 36
        covariance[0] = self.xDeviation**2
        covariance[7] = self.yDeviation**2
        covariance[35] = self.yawDeviation**2
        pose = {"pose": self.pose(x, y, yaw), "covariance": covariance}
        message = {"header": self.header(), "pose": pose}
        self.send(message, self._text("Pose estimate", x, y, yaw))


class SetGoalTool(PoseTool):
    """RViz's 2D Goal Pose (2D Nav Goal in RViz 1): a goal on a topic, or by Nav2's action."""

    TYPE, NAME, KEY = "SetGoal", "2D Goal Pose", "g"
    DESCRIPTION = "Sends the robot somewhere: press at the goal, drag to the direction there."
    MESSAGE = "geometry_msgs/PoseStamped"
    TOPICS = ("/move_base_simple/goal", "/goal_pose")

    topic = Setting(
        "Topic", "topic", "", "Topic to publish on; empty for RViz's default.", then="_schedule",
        shown_if={"action": ""},
    )  # fmt: skip
    action = Setting(
        "Action", "topic", "",
        "An action of Nav2, e.g. navigate_to_pose, that gets the goal instead of the topic.",
        then="_schedule",
    )  # fmt: skip

    #: The status of the last goal, with an action: ``accepted``, ``executing``, ``succeeded`` ...
    goalStatusChanged = Signal(str)
    #: Whether the action has not ended the last goal yet.
    goalActive = ReadOnly(bool, False)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._goal: ClientGoal | None = None
        super().__init__(parent, runtime)

    @property
    def goal(self) -> ClientGoal | None:
        """The last goal of the action; None before the first one."""
        return self._goal

    @Slot()
    def cancelGoal(self) -> None:
        """Request the action's server to cancel the last goal; the status bar says what came of it.

        A goal that still waits for its server is not sent; the one before it is cancelled as well.
        """
        goal, session = self._goal, self._session
        was_waiting = self.drop_waiting()
        if goal is None or session is None or not self.goalActive:
            if not was_waiting:
                self.announce("There is no goal to cancel.")
            return
        self.announce("Goal: requested to cancel it")
        on_answer = weak_callback(self._on_cancel_answer)
        goal.cancel(_GOAL_TIMEOUT_S).on_done(lambda got: on_answer(goal, got), session.executor)

    def _on_cancel_answer(self, goal: ClientGoal, answer: Promise[CancelAnswer]) -> None:
        if not is_alive(self) or goal is not self._goal or not self.goalActive:
            return
        why = answer.exception() or answer.result().reason
        if why:
            self._complain(f"goal of {self.action}: not canceled: {why}")

    def leave(self) -> None:
        """Belong to no view any more; the robot keeps its goal, without further reports."""
        if self.goalActive:
            text = "the tool was removed: its goal continues without further reports"
            self._complain(f"goal of {self.action}: {text}")
            report(self, goalActive=False)
        super().leave()

    def _wanted(self) -> tuple[Any, ...] | None:
        wanted = super()._wanted()
        return wanted if wanted is None or not self.action else (wanted[0], self.action)

    def _factory(self, *wanted: Any) -> Callable[[], Any]:
        if len(wanted) == 3:
            return super()._factory(*wanted)
        node, action = wanted
        return lambda: node.create_action_client(action)

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file of one RViz."""
        kept = super().save_settings(older, ros)
        if not self.action:
            kept.pop("Action", None)  # RViz does not know it
        return kept

    def send_pose(self, x: float, y: float, yaw: float) -> None:
        """Send the goal."""
        message = {"header": self.header(), "pose": self.pose(x, y, yaw)}
        self.send(message, self._text("Goal", x, y, yaw))

    def _subscribers(self) -> int:
        return 0 if self.action else super()._subscribers()

    def _send_waiting(self) -> None:
        client, waiting = self._endpoint, self._waiting
        if client is not None and hasattr(client, "send_goal") != bool(self.action):
            return  # the topic or action was just set: it is about to be replaced
        if not self.action or client is None or waiting is None or self._session is None:
            super()._send_waiting()
            return
        fields, text, deadline = waiting
        if not client.ready and time.monotonic() < deadline:
            self.announce(f"{text}: looking for a server of {client.name}")
            return
        self._waiting = None
        if not client.ready:
            self._complain(f"{text}: not sent: {client.problem}")
            return
        on_status = weak_callback(self._on_goal_status)
        try:
            # Reports come through the event loop, after this goal has become the current one.
            goal: ClientGoal = client.send_goal(
                {"pose": fields},
                on_status_change=lambda status: on_status(goal, status),
                on_done=weak_callback(self._on_goal_done),
                executor=self._session.executor,
                timeout=_GOAL_TIMEOUT_S,
            )
            self._goal = goal
            report(self, goalActive=True)
        except Error as error:
            self._complain(f"{text}: not sent: {error}")
        else:
            self._set_problem("")
            self.announce(f"{text}: sent to {client.name}")

    def _on_goal_status(self, goal: ClientGoal, status: GoalStatus) -> None:
        # A new goal preempts the one before, whose end is not its own.
        if is_alive(self) and goal is self._goal:
            self.announce(f"Goal: {status.value}")
            self.goalStatusChanged.emit(status.value)

    def _on_goal_done(self, goal: ClientGoal) -> None:
        if not is_alive(self) or goal is not self._goal or not report(self, goalActive=False):
            return
        failure = goal.done.exception()
        if failure is not None:
            self._complain(f"goal of {self.action}: {failure}")
        elif goal.status.name in ("REJECTED", "ABORTED", "LOST"):
            self._complain(f"goal of {self.action}: {goal.status.value}")


class Nav2GoalTool(SetGoalTool):
    """Nav2's own goal tool: the goal is sent to its action ``navigate_to_pose``."""

    TYPE, NAME, KEY = "GoalTool", "Nav2 Goal", "g"

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self.action = "navigate_to_pose"


class PublishPointTool(PublishingTool):
    """Publishes the point that is clicked."""

    TYPE, NAME, KEY = "PublishPoint", "Publish Point", "c"
    DESCRIPTION = "A click publishes the point of the scene that is under the mouse."
    MESSAGE = "geometry_msgs/PointStamped"
    TOPICS = ("/clicked_point", "/clicked_point")

    singleClick = Setting(
        "Single click", "bool", True, "Switch away from this tool after one click."
    )

    #: A point was published: its x, y and z in metres, in the fixed frame.
    pointSet = Signal(MAP)

    def activate(self) -> None:
        """Show the instructions."""
        super().activate()
        self._show_help(None)

    def on_move(self, event: PointerEvent) -> None:
        """Show the point."""
        self._show_help(event.point)

    def on_release(self, event: PointerEvent) -> None:
        """Publish the point."""
        point = event.point
        self._show_help(point)
        if point is None:
            return
        fields = dict(zip("xyz", point, strict=True))
        self.send({"header": self.header(), "point": fields}, f"Point {point_text(point)}")
        if is_alive(self):
            self.pointSet.emit(fields)
        if self.singleClick:
            self.finish()

    def _show_help(self, point: Point | None) -> None:
        if point is None:
            self.set_status("Move over an object to select the target point.", hit=False)
        else:
            text = f"Left-Click: Select this point. {point_text(point)}"
            self.set_status(text, hit=True)

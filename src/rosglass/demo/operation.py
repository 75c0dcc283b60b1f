"""The robot's modes, mission and behaviours, and the goal of RViz's tool 2D Nav Goal."""

from __future__ import annotations

import logging
import math
import threading
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import QoS, Time
from rosglass.demo.telemetry import header
from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import Node, ServerGoal
    from rosglass.demo.simulation import RobotState
    from rosglass.messages import Message

__all__ = [
    "ABORTED",
    "ACTIVE",
    "BEHAVIOR_EXECUTION",
    "BEHAVIOURS",
    "MODES",
    "PREEMPTED",
    "REJECTED",
    "SUCCEEDED",
    "WAYPOINTS",
    "DriveGoal",
    "Operation",
]


#: FlexBE's action in ROS 2, which no distribution brings: others fetch it from the robot.
BEHAVIOR_EXECUTION = """\
string behavior_name
string[] arg_keys
string[] arg_values
string[] input_keys
string[] input_values
---
string outcome
---
int32 current_state
"""
#: Codes of ``actionlib_msgs/msg/GoalStatus``.
ACTIVE, PREEMPTED, SUCCEEDED, ABORTED, REJECTED = 1, 2, 3, 4, 5
#: Frames in which a goal is accepted: the robot's localization does not drift.
_FRAMES = ("map", "odom", "")
#: Seconds after which an unchanged state is published again.
_REPEAT_PERIOD_S = 0.5


class DriveGoal:
    """A goal from RViz's tool, and its state in ``/move_base/status``.

    RViz 1 publishes on ``/move_base_simple/goal``, RViz 2 on ``/goal_pose``.

    Args:
        node: Node with the topics.
        refusal: Returns why goals are refused at present; empty if they are accepted.
    """

    def __init__(self, node: Node, refusal: Callable[[], str]) -> None:
        self._refusal = refusal
        self._lock = threading.Lock()
        self._position: tuple[float, float] | None = None
        self._count, self._published_at = 0, -math.inf
        self._status: list[dict[str, Any]] = []
        kind = "actionlib_msgs/msg/GoalStatusArray"
        self._publisher = node.create_publisher("/move_base/status", kind, QoS.latched())
        topics = ("/move_base_simple/goal", "/goal_pose")
        kind = "geometry_msgs/msg/PoseStamped"
        self._subscriptions = [
            node.create_subscription(topic, kind, self._on_goal, 1) for topic in topics
        ]

    @property
    def position(self) -> tuple[float, float] | None:
        """Position of the goal in metres in the frame map; None without a goal."""
        return self._position

    def end(self, status: int, text: str) -> None:
        """End the current goal; does nothing without one.

        Args:
            status: One of the constants above.
            text: The reason.
        """
        with self._lock:
            active, self._position = self._position is not None, None
            if active:
                self._status[-1].update(status=status, text=text)
        if active:
            self._publish_status()

    def confirm(self) -> None:
        """Publish its state again from time to time."""
        if time.monotonic() - self._published_at >= _REPEAT_PERIOD_S:
            self._publish_status()

    def close(self) -> None:
        """Accept no more goals; safe to call twice."""
        for subscription in self._subscriptions:
            subscription.close()

    def _on_goal(self, message: Message) -> None:
        target, frame = message.pose.position, message.header.frame_id
        if frame.lstrip("/") not in _FRAMES:
            refusal = f"goals are expected in the frame map, not in {frame}"
        elif not (math.isfinite(target.x) and math.isfinite(target.y)):
            refusal = f"{target.x}, {target.y} is not a position on the map"
        else:
            refusal = self._refusal()
        self.end(PREEMPTED, "another goal came")
        with self._lock:
            now = Time.now()
            self._count += 1
            self._status = [
                {
                    "goal_id": {"stamp": now, "id": f"goal-{self._count}"},
                    "status": REJECTED if refusal else ACTIVE,
                    "text": refusal or "on the way to the goal",
                }
            ]
            self._position = None if refusal else (target.x, target.y)
        self._publish_status()

    def _publish_status(self) -> None:
        self._published_at = time.monotonic()
        with self._lock:
            status = [dict(entry) for entry in self._status]
        self._publisher.publish({"header": header(Time.now(), ""), "status_list": status})


MODES = ("autonomous", "supervised", "safe")
#: The mission: a round through the yard, over the rubble. Map frame, metres.
WAYPOINTS = ((-3.6, -1.8), (-2.2, -0.3), (-2.4, 2.6), (-4.4, 1.8), (-5.0, -1.0))
BEHAVIOURS = ("Look around", "Turn around", "Flippers up", "Flippers flat", "Return to dock")
_log = logging.getLogger("rosglass.demo.robot")
_PERIOD_S = 0.1
#: Metres and radians from a target that count as reached.
_POSITION_TOLERANCE, _ANGLE_TOLERANCE = 0.25, 0.05
#: Speeds of autonomous driving in metres and radians per second, and of mode safe in m/s.
_SPEED, _TURN_RATE, _SAFE_SPEED = 0.55, 0.9, 0.3
_FLIPPER_TIMEOUT_S = 2.0


class Operation:
    """Modes, mission, goals and behaviours.

    ``/mode`` is one of :data:`MODES`; the services ``/mode/autonomous`` and so on select it. The
    mission is driven in mode autonomous, and published on ``/mission/state``, ``/mission/path`` and
    ``/mission/waypoint``; ``/mission/pause`` pauses it. A :class:`DriveGoal` is driven to in mode
    supervised. Behaviours, ``/flexbe/execute_behavior``, are executed one at a time, in all modes
    but safe.

    Args:
        node: Node that offers all this.
        state: Returns the robot's current state.
        drive: Takes metres and radians per second.
        flippers: Takes four angles.
        dock: Position of the charging dock.
        mode: The initial mode.

    Attributes:
        mode: The current mode.
        goal: The goal to drive to in mode supervised.
        next_waypoint: Index of the mission's next waypoint.

    Raises:
        Error: There is no such mode.
    """

    def __init__(
        self,
        node: Node,
        state: Callable[[], RobotState],
        drive: Callable[[float, float], None],
        flippers: Callable[[Sequence[float]], None],
        dock: tuple[float, float],
        mode: str = "supervised",
    ) -> None:
        if mode not in MODES:
            raise Error(f"there is no mode {mode!r}; there are {', '.join(MODES)}")
        self.mode = mode
        self._state, self._drive, self._flippers, self._dock = state, drive, flippers, dock
        self._ending = threading.Event()
        self._paused, self.next_waypoint = False, 0
        self.goal = DriveGoal(node, self._refusal)
        self._behaviour, self._lock = "", threading.Lock()
        #: The reason to end a behaviour.
        self._interruption = ""
        self._published: dict[str, tuple[Any, float]] = {}
        latched = QoS.latched()
        self._send = {
            topic: node.create_publisher(topic, kind, latched)
            for topic, kind in (
                ("/mode", "std_msgs/msg/String"),
                ("/mission/state", "std_msgs/msg/String"),
                ("/mission/waypoint", "std_msgs/msg/Int32"),
                ("/mission/path", "nav_msgs/msg/Path"),
            )
        }
        self._send["/mission/path"].publish(_path())
        trigger = "std_srvs/srv/Trigger"
        self._parts: list[Any] = [
            node.create_service_server(f"/mode/{name}", trigger, self._mode_handler(name))
            for name in MODES
        ]
        self._parts += [
            node.create_service_server("/mission/pause", "std_srvs/srv/SetBool", self._on_pause),
            node.create_service_server("/mission/restart", trigger, self._on_restart),
            self.goal,
        ]
        self._is_ros1 = node.wire == "ros1"
        kind = "flexbe_msgs/action/BehaviorExecution"
        self._parts.append(
            node.create_action_server("/flexbe/execute_behavior", kind, self._on_behaviour)
        )

    @property
    def max_speed(self) -> float:
        """Highest speed in the current mode, in metres per second."""
        return _SAFE_SPEED if self.mode == "safe" else math.inf

    def work(self) -> None:
        """Drive and publish the state, until :meth:`close`."""
        while not self._ending.wait(_PERIOD_S):
            state = self._state()
            self._publish("/mode", self.mode)
            self._publish("/mission/waypoint", self.next_waypoint)
            self._publish("/mission/state", self.proceed(state))
            self.goal.confirm()

    def take_over(self) -> None:
        """Leave the driving to the operator after a command."""
        if self.mode == "autonomous":
            self.mode = "supervised"
        self._interruption = "the operator drives"
        self.goal.end(PREEMPTED, self._interruption)

    def close(self) -> None:
        """Withdraw all; safe to call twice."""
        self._ending.set()
        for part in self._parts:
            part.close()

    def proceed(self, state: RobotState) -> str:
        """Drive for a moment; return a description of the robot's activity."""
        if state.emergency_stop:
            self.goal.end(ABORTED, "the emergency stop was pressed")
            return "emergency stop"
        if self._behaviour:
            return self._behaviour.lower()
        if (target := self.goal.position) is not None:
            if self._steer(state, target):
                self.goal.end(SUCCEEDED, "the goal is reached")
            return "driving to the goal"
        if self.mode != "autonomous":
            return "waiting for mode autonomous"
        if self._paused:
            return "paused"
        if self._steer(state, WAYPOINTS[self.next_waypoint]):
            self.next_waypoint = (self.next_waypoint + 1) % len(WAYPOINTS)
        return "on patrol"

    def _steer(self, state: RobotState, target: tuple[float, float]) -> bool:
        """Drive towards a position; return whether it is reached."""
        x, y = target[0] - state.x, target[1] - state.y
        distance = math.hypot(x, y)
        if distance < _POSITION_TOLERANCE:
            self._drive(0.0, 0.0)
            return True
        remaining = math.remainder(math.atan2(y, x) - state.yaw, math.tau)
        speed = min(_SPEED, 0.9 * distance) * max(0.0, 1 - abs(remaining) / 0.6)
        self._drive(speed, max(-_TURN_RATE, min(_TURN_RATE, 2 * remaining)))
        return False

    def _publish(self, topic: str, data: Any) -> None:
        value, published_at = self._published.get(topic, (None, -math.inf))
        now = time.monotonic()
        if data != value or now - published_at >= _REPEAT_PERIOD_S:
            self._published[topic] = (data, now)
            self._send[topic].publish(data=data)

    def _mode_handler(self, name: str) -> Callable[[Message], dict[str, Any]]:
        def on_request(_: Message) -> dict[str, Any]:
            self.mode = name
            if name == "safe":
                self._interruption = "the mode is safe now"
            if name != "supervised":
                self.goal.end(PREEMPTED, f"the mode is {name} now")
            self._drive(0.0, 0.0)
            self._publish("/mode", name)
            return {"success": True, "message": name}

        return on_request

    def _on_pause(self, request: Message) -> dict[str, Any]:
        self._paused = bool(request.data)
        self._drive(0.0, 0.0)
        return {"success": True, "message": "paused" if self._paused else "going on"}

    def _on_restart(self, _: Message) -> dict[str, Any]:
        self.next_waypoint, self._paused = 0, False
        return {"success": True, "message": "from the first waypoint"}

    def _refusal(self) -> str:
        """Return why goals are refused at present; empty if they are accepted."""
        if self._state().emergency_stop:
            return "the emergency stop is latched; release it first"
        if self._behaviour:
            return f"busy with {self._behaviour!r}; cancel it first"
        if self.mode != "supervised":
            return f"no goals in mode {self.mode}; choose supervised"
        return ""

    def _on_behaviour(self, goal: Any) -> dict[str, str] | None:
        """Execute a behaviour; the status text says why it failed; in ROS 2, the outcome does."""
        try:
            return self._execute(goal)
        except Error as error:
            _log.info("%s: %s", goal.goal.behavior_name, error)
            if self._is_ros1:
                goal.abort(text=str(error))
            else:
                goal.abort({"outcome": str(error)})
            return None

    def _execute(self, goal: ServerGoal) -> dict[str, str]:
        name = goal.goal.behavior_name
        if name not in BEHAVIOURS:
            raise Error(f"there is no behaviour {name!r}; there are {', '.join(BEHAVIOURS)}")
        if self.mode == "safe":
            raise Error("no behaviours in mode safe; choose another mode")
        with self._lock:
            if self._behaviour:
                raise Error(f"busy with {self._behaviour!r}; cancel it first")
            self._behaviour, self._interruption = name, ""
        try:
            self.goal.end(PREEMPTED, f"the behaviour {name!r} was started")
            start = self._state()
            {
                "Look around": lambda: self._turn(goal, math.tau),
                "Turn around": lambda: self._turn(goal, math.pi),
                "Flippers up": lambda: self._move_flippers(goal, 1.2),
                "Flippers flat": lambda: self._move_flippers(goal, 0.0),
                "Return to dock": lambda: self._drive_to(goal, self._dock),
            }[name]()
            moved = math.dist((start.x, start.y), (self._state().x, self._state().y))
            return {"outcome": "cancelled" if goal.is_cancel_requested else f"{moved:.1f} m driven"}
        finally:
            self._drive(0.0, 0.0)
            self._behaviour = ""

    def _steps(self, goal: ServerGoal) -> Any:
        """Yield the robot's state periodically, until the behaviour has to end."""
        while not goal.is_cancel_requested:
            if self._ending.wait(_PERIOD_S):
                raise Error("the robot ends")
            state = self._state()
            if state.emergency_stop:
                raise Error("the emergency stop is latched; release it first")
            if self._interruption:
                raise Error(self._interruption)
            yield state

    def _publish_feedback(self, goal: ServerGoal, text: str) -> None:
        # FlexBE of ROS 2 has numbers instead of texts; a behaviour here has one state.
        goal.publish_feedback({"current_state": text if self._is_ros1 else 0})

    def _turn(self, goal: ServerGoal, angle: float) -> None:
        last, remaining = self._state().yaw, angle
        for state in self._steps(goal):
            remaining -= math.remainder(state.yaw - last, math.tau)
            last = state.yaw
            if remaining < _ANGLE_TOLERANCE:
                return
            self._publish_feedback(goal, f"{math.degrees(remaining):.0f}° to go")
            self._drive(0.0, max(0.15, min(_TURN_RATE, 2 * remaining)))

    def _move_flippers(self, goal: ServerGoal, angle: float) -> None:
        self._flippers([angle] * 4)
        until = time.monotonic() + _FLIPPER_TIMEOUT_S
        for state in self._steps(goal):
            remaining = max(abs(angle - now) for now in state.flippers)
            if remaining < _ANGLE_TOLERANCE or time.monotonic() > until:
                return
            self._publish_feedback(goal, f"{math.degrees(remaining):.0f}° to go")

    def _drive_to(self, goal: ServerGoal, target: tuple[float, float]) -> None:
        for state in self._steps(goal):
            remaining = math.dist(target, (state.x, state.y))
            self._publish_feedback(goal, f"{remaining:.1f} m to go")
            if self._steer(state, target):
                return


def _path() -> dict[str, Any]:
    now = Time.now()
    round_trip = [*WAYPOINTS, WAYPOINTS[0]]
    upright = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    poses = [
        {
            "header": header(now, "map"),
            "pose": {"position": {"x": x, "y": y, "z": 0.1}, "orientation": upright},
        }
        for x, y in round_trip
    ]
    return {"header": header(now, "map"), "poses": poses}

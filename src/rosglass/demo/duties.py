"""The simulated robot's service, action and parameter."""

from __future__ import annotations

import logging
import math
import threading
from typing import TYPE_CHECKING, Any

from rosglass.comm.parameters import ParameterDescriptor, Range
from rosglass.errors import Error, TypeNotFoundError, UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Node, ParameterEvent, ServerGoal
    from rosglass.demo.simulation import RobotState
    from rosglass.messages import Message

__all__ = ["Duties"]

_log = logging.getLogger("rosglass.demo.robot")
_NAME = "max_speed"
_PERIOD = 0.1
#: Rate of a turn in radians per second, and its tolerance in radians.
_TURN, _NEAR = 0.8, 0.03
#: Metres per second.
_SLOWEST, _FASTEST = 0.1, 1.2


class Duties:
    """The robot's service ``/flashlight/set``, action ``/turn`` and parameter ``max_speed``.

    Args:
        node: Node that offers them.
        state: Returns the robot's current state.
        switch: Switches its flashlight.
        drive: Takes metres and radians per second.
    """

    def __init__(
        self,
        node: Node,
        state: Callable[[], RobotState],
        switch: Callable[[bool], None],
        drive: Callable[[float, float], None],
    ) -> None:
        self._state, self._switch, self._drive = state, switch, drive
        self._ending = threading.Event()
        what, limits = "Highest speed in metres per second", Range(_SLOWEST, _FASTEST)
        try:
            speed = node.parameters.declare(
                _NAME, _FASTEST, ParameterDescriptor(description=what, range=limits)
            )
        except UnsupportedError:
            # ROS 1 has no ranges.
            speed = node.parameters.declare(_NAME, _FASTEST, ParameterDescriptor(description=what))
        # Cached: ROS 1 reads it from the master, without which the robot must still drive.
        self._max_speed = speed
        self._parts: list[Any] = [
            node.parameters.on_change(self._on_parameters),
            node.create_service_server("/flashlight/set", "std_srvs/srv/SetBool", self._on_switch),
        ]
        try:
            kind = "turtlesim/action/RotateAbsolute"
            self._parts.append(node.create_action_server("/turn", kind, self._turn))
        except TypeNotFoundError:
            _log.info("/turn is not offered: ROS 1 has no turtlesim/RotateAbsolute")

    @property
    def max_speed(self) -> float:
        """Highest speed in metres per second; the slowest while its value is invalid."""
        value = self._max_speed
        if isinstance(value, (int, float)) and _SLOWEST <= value <= _FASTEST:
            return float(value)
        return _SLOWEST

    def close(self) -> None:
        """Withdraw them; safe to call twice."""
        self._ending.set()
        for part in self._parts:
            part.close()

    def _on_parameters(self, event: ParameterEvent) -> None:
        self._max_speed = {**event.new, **event.changed}.get(_NAME, self._max_speed)
        if _NAME in event.deleted:
            self._max_speed = None

    def _on_switch(self, request: Message) -> dict[str, Any]:
        self._switch(request.data)
        on = self._state().flashlight
        return {"success": on == request.data, "message": "on" if on else "off"}

    def _turn(self, goal: ServerGoal) -> dict[str, float]:
        """Turn on the spot to a heading; ends where it is if cancelled or stopped."""
        wanted, start = float(goal.goal.theta), self._state().yaw
        if not math.isfinite(wanted):
            raise Error(f"the heading {wanted} is no angle")
        while not self._ending.wait(_PERIOD):
            state = self._state()
            rest = math.remainder(wanted - state.yaw, math.tau)
            goal.publish_feedback({"remaining": rest})
            done = abs(rest) < _NEAR or goal.is_cancel_requested or state.emergency_stop
            self._drive(0.0, 0.0 if done else max(-_TURN, min(_TURN, 2 * rest)))
            if state.emergency_stop:
                raise Error("the emergency stop is latched; release it first")
            if done:
                return {"delta": math.remainder(state.yaw - start, math.tau)}
        raise Error("the robot ends")

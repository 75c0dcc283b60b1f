"""Simulated time: the parameter ``use_sim_time`` and the topic ``/clock`` drive a node's clock.

Behaviour: design article "Clock and Time", and rclcpp's ``TimeSource``.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm import IMMEDIATE, Time
from rosglass.comm.sim_time import ClockFollower
from rosglass.ros2.parameters import USE_SIM_TIME

if TYPE_CHECKING:
    from rosglass.comm import Clock, Node
    from rosglass.ros2.parameters import Change, Ros2Parameters

__all__ = ["SimTime"]

_log = logging.getLogger("rosglass.ros2")


class SimTime(ClockFollower):
    """Lets a node's clock follow ``/clock`` while ``use_sim_time`` is set.

    Args:
        node: The node.
        clock: Its clock.
        parameters: Its parameters.
    """

    def __init__(self, node: Node, clock: Clock, parameters: Ros2Parameters) -> None:
        super().__init__(node, clock, "rosgraph_msgs/msg/Clock", _log)
        self._parameters = parameters
        self._listener = parameters.changes.add(self._changed, IMMEDIATE)
        self._obey()

    def close(self) -> None:
        """Follow no longer; the clock keeps its time. Safe to call twice."""
        self._listener.close()
        super().close()

    def _changed(self, change: Change) -> None:
        if any(USE_SIM_TIME in names for names in change):
            self._obey()

    def _obey(self) -> None:
        """Do as the parameter says."""
        self.follow(self._parameters.typed_value(USE_SIM_TIME).value is True)

    def _time_of(self, stamp: Any) -> Time:
        return Time.from_parts(stamp.sec, stamp.nanosec)

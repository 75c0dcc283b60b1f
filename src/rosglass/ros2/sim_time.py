"""Simulated time: the parameter ``use_sim_time`` and the topic ``/clock`` drive a node's clock.

Behaviour: design article "Clock and Time", and rclcpp's ``TimeSource``.
"""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING

from rosglass.comm import IMMEDIATE, Handle, QoS, Time
from rosglass.errors import Error
from rosglass.ros2.parameters import USE_SIM_TIME

if TYPE_CHECKING:
    from rosglass.comm import Clock, Node, Sample, Subscription
    from rosglass.ros2.parameters import Change, Ros2Parameters

__all__ = ["SimTime"]

_log = logging.getLogger("rosglass.ros2")


class SimTime(Handle):
    """Lets a node's clock follow ``/clock`` while ``use_sim_time`` is set.

    Args:
        node: The node.
        clock: Its clock.
        parameters: Its parameters.
    """

    def __init__(self, node: Node, clock: Clock, parameters: Ros2Parameters) -> None:
        self._node, self._clock = node, clock
        self._parameters = parameters
        self._lock = threading.Lock()
        self._subscription: Subscription | None = None
        self._closed = False
        self._listener = parameters.changes.add(self._changed, IMMEDIATE)
        self._follow()

    def close(self) -> None:
        """Follow no longer; the clock keeps its time. Safe to call twice."""
        self._listener.close()
        with self._lock:
            self._closed = True
            subscription, self._subscription = self._subscription, None
        if subscription is not None:
            subscription.close()

    def _changed(self, change: Change) -> None:
        if any(USE_SIM_TIME in names for names in change):
            self._follow()

    def _follow(self) -> None:
        """Do as the parameter says."""
        wanted = self._parameters.typed_value(USE_SIM_TIME).value is True
        made = None
        with self._lock:
            if self._closed or wanted == (self._subscription is not None):
                return
            if wanted:
                try:
                    made = self._node.create_subscription(
                        "/clock",
                        "rosgraph_msgs/msg/Clock",
                        qos=QoS.clock(),
                        raw_callback=self._tick,
                        executor=IMMEDIATE,
                    )
                except Error:
                    _log.exception("%s: the time of the simulation cannot be followed", self._node)
                    return
            old, self._subscription = self._subscription, made
        if old is not None:
            old.close()
        # As it is now: another thread may have changed it since.
        self._clock.simulate(self._subscription is not None)

    def _tick(self, sample: Sample) -> None:
        stamp = sample.message().clock
        self._clock.advance(Time.from_parts(stamp.sec, stamp.nanosec))

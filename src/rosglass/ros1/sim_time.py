"""Simulated time: the parameter ``/use_sim_time`` and the topic ``/clock`` drive a node's clock.

Behaviour: ROS wiki, "Clock". ROS 1's own nodes look at the parameter once, as they start; we follow
it, so that a screen which was there before the simulation keeps its time all the same.
"""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Any

from rosglass.comm import IMMEDIATE, Handle, QoS, Time
from rosglass.errors import Error

if TYPE_CHECKING:
    from rosglass.comm import Clock, Node, Sample, Subscription, Timers
    from rosglass.ros1.parameter_server import ParameterServer

__all__ = ["USE_SIM_TIME", "SimTime"]

_log = logging.getLogger("rosglass.ros1")
USE_SIM_TIME = "/use_sim_time"
#: Seconds that a simulation may take to tell its time before people are told that it does not.
_PATIENCE = 5.0


class SimTime(Handle):
    """Lets a node's clock follow ``/clock`` while ``/use_sim_time`` is set.

    Until the master has told the parameter, which takes some milliseconds after connecting, the
    clock shows the system's time.

    Args:
        node: The node.
        clock: Its clock.
        server: The parameter server.
        timers: Run a look whether there is a simulation at all.
    """

    def __init__(self, node: Node, clock: Clock, server: ParameterServer, timers: Timers) -> None:
        self._node, self._clock, self._timers = node, clock, timers
        self._lock = threading.Lock()
        self._subscription: Subscription | None = None
        self._closed = False
        self._parameter = server.subscribe(USE_SIM_TIME, self._follow, IMMEDIATE)

    def close(self) -> None:
        """Follow no longer; the clock keeps its time. Safe to call twice."""
        self._parameter.close()
        with self._lock:
            self._closed = True
            subscription, self._subscription = self._subscription, None
        if subscription is not None:
            subscription.close()

    def _follow(self, value: Any) -> None:
        """Do as the parameter says."""
        # As rospy has it: 1 counts, too.
        wanted = bool(value)
        made = None
        with self._lock:
            if self._closed or wanted == (self._subscription is not None):
                return
            if wanted:
                try:
                    made = self._node.create_subscription(
                        "/clock",
                        "rosgraph_msgs/Clock",
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
        if made is not None:
            self._timers.after(_PATIENCE, self._look)

    def _look(self) -> None:
        """Tell people why nothing moves, if nothing does."""
        if self._subscription is not None and not self._clock.now().nanoseconds:
            _log.warning(
                "%s: %s is set, but nothing came on /clock: time stands still at zero until a "
                "simulation publishes it, or the parameter is deleted",
                self._node,
                USE_SIM_TIME,
            )

    def _tick(self, sample: Sample) -> None:
        stamp = sample.message().clock
        self._clock.advance(Time.from_parts(stamp.secs, stamp.nsecs))

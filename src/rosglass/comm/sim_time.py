"""Simulated time: the topic ``/clock`` drives a node's clock while ``use_sim_time`` is set.

Behaviour: ROS wiki, "Clock"; design article "Clock and Time"; rclcpp's ``TimeSource``. In ROS 1 the
parameter is one for all nodes, on the parameter server; in ROS 2 each node has its own.
"""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING

from rosglass.comm.executor import IMMEDIATE
from rosglass.comm.handle import Handle
from rosglass.comm.qos import QoS
from rosglass.comm.time import Time
from rosglass.errors import Error

if TYPE_CHECKING:
    from rosglass.comm.core import NodeCore
    from rosglass.comm.node import Node
    from rosglass.comm.sample import Sample
    from rosglass.comm.subscription import Subscription

__all__ = ["USE_SIM_TIME", "SimTime"]

_log = logging.getLogger("rosglass.comm")
#: The parameter's name.
USE_SIM_TIME = "use_sim_time"
#: How long a simulation may take to publish its first time until a warning says that none came.
_FIRST_TIME_TIMEOUT_S = 5.0


class SimTime(Handle):
    """Lets a node's clock follow ``/clock``, or the system's time.

    Args:
        node: Subscribes to ``/clock``.
        core: What the node consists of, its clock and timers among it.
    """

    def __init__(self, node: Node, core: NodeCore) -> None:
        self._node, self._clock, self._timers = node, core.clock, core.timers
        self._lock = threading.Lock()
        self._subscription: Subscription | None = None
        self._closed = False

    def close(self) -> None:
        """Follow no longer; the clock keeps its time. Safe to call twice."""
        with self._lock:
            self._closed = True
            subscription, self._subscription = self._subscription, None
        if subscription is not None:
            subscription.close()

    @property
    def following(self) -> bool:
        """Whether the clock follows ``/clock``."""
        return self._subscription is not None

    def follow(self, wanted: bool) -> None:
        """Follow ``/clock`` from now on, or no longer."""
        made = None
        with self._lock:
            if self._closed or wanted == self.following:
                return
            if wanted:
                try:
                    made = self._node.create_subscription(
                        "/clock",
                        "rosgraph_msgs/msg/Clock",
                        qos=QoS.clock(),
                        raw_callback=self._on_time,
                        executor=IMMEDIATE,
                    )
                except Error:
                    _log.exception("%s: the time of the simulation cannot be followed", self._node)
                    return
            old, self._subscription = self._subscription, made
        if old is not None:
            old.close()
        # As it is now: another thread may have changed it since.
        self._clock.simulate(self.following)
        if wanted:
            self._timers.after(_FIRST_TIME_TIMEOUT_S, self._warn_no_time)

    def _on_time(self, sample: Sample) -> None:
        self._clock.advance(Time(sample.message().clock.nanoseconds))

    def _warn_no_time(self) -> None:
        """Log why time stands still, if it does."""
        if self.following and not self._clock.now().nanoseconds:
            _log.warning(
                "%s: %s is set, but nothing came on /clock: time stands still at zero until a "
                "simulation publishes it, or the parameter is false",
                self._node,
                USE_SIM_TIME,
            )

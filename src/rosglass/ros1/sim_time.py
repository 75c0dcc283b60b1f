"""Simulated time: the parameter ``/use_sim_time`` and the topic ``/clock`` drive a node's clock.

Behaviour: ROS wiki, "Clock". ROS 1's own nodes look at the parameter once, as they start; we follow
it, so that a screen which was there before the simulation keeps its time all the same.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm import IMMEDIATE, Time
from rosglass.comm.sim_time import ClockFollower

if TYPE_CHECKING:
    from rosglass.comm import Clock, Node, Timers
    from rosglass.ros1.parameter_server import ParameterServer

__all__ = ["USE_SIM_TIME", "SimTime"]

_log = logging.getLogger("rosglass.ros1")
USE_SIM_TIME = "/use_sim_time"
#: Seconds that a simulation may take to tell its time before people are told that it does not.
_PATIENCE = 5.0


class SimTime(ClockFollower):
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
        super().__init__(node, clock, "rosgraph_msgs/Clock", _log)
        self._timers = timers
        self._parameter = server.subscribe(USE_SIM_TIME, self._changed, IMMEDIATE)

    def close(self) -> None:
        """Follow no longer; the clock keeps its time. Safe to call twice."""
        self._parameter.close()
        super().close()

    def _changed(self, value: Any) -> None:
        """Do as the parameter says."""
        # As rospy has it: 1 counts, too.
        if self.follow(bool(value)):
            self._timers.after(_PATIENCE, self._look)

    def _look(self) -> None:
        """Tell people why nothing moves, if nothing does."""
        if self.following and not self._clock.now().nanoseconds:
            _log.warning(
                "%s: %s is set, but nothing came on /clock: time stands still at zero until a "
                "simulation publishes it, or the parameter is deleted",
                self._node,
                USE_SIM_TIME,
            )

    def _time_of(self, stamp: Any) -> Time:
        return Time.from_parts(stamp.secs, stamp.nsecs)

"""What every ROS 1 node has besides what it is made for: parameters, logging, simulated time.

The clock follows ``/use_sim_time`` from the start; the rest is made when it is asked for, or
offered shortly after connecting, so that it costs neither the connection nor a screen's first
picture time.
"""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING

from rosglass.errors import Error, NodeClosedError
from rosglass.ros1.core import Member
from rosglass.ros1.parameter_server import ParameterServer, StartParameters
from rosglass.ros1.sim_time import SimTime

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any

    from rosglass.comm import Handle
    from rosglass.comm.logger import NodeLogger
    from rosglass.ros1.core import Core
    from rosglass.ros1.node import Ros1Node
    from rosglass.ros1.parameters import Ros1Parameters
    from rosglass.ros1.rosout import Rosout

__all__ = ["Furniture"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds from connecting until the log and the loggers' services are offered.
_DELAY = 0.2


class Furniture(Member):
    """A node's parameters, logger and the like.

    Args:
        node: The node.
        core: What it consists of.
        topics: Returns the topics that the node publishes or subscribes to.
        start: Private parameters that the program was started with, by their names.

    Attributes:
        server: The master's parameter server.
    """

    def __init__(
        self,
        node: Ros1Node,
        core: Core,
        topics: Callable[[], list[str]],
        start: Mapping[str, Any],
    ) -> None:
        self._node, self._core, self._topics = node, core, topics
        self._lock = threading.RLock()
        self._parameters: Ros1Parameters | None = None
        self._rosout: Rosout | None = None
        self._made: list[Handle] = []
        self._closed = False
        self.server = ParameterServer(core, start)
        self._has_start = bool(start)

    def open(self, offered: bool) -> None:
        """Begin to follow the simulation's time; and, if `offered`, to show what others expect.

        Args:
            offered: Whether other nodes find its log and its loggers.
        """
        self._core.add(self)
        if self._has_start:
            self._core.add(StartParameters(self.server))
        core = self._core
        self._made.append(SimTime(self._node, core.clock, self.server, core.timers))
        if offered:
            self._core.timers.after(_DELAY, self._offer)

    @property
    def parameters(self) -> Ros1Parameters:
        """The node's own parameters."""
        with self._lock:
            if self._parameters is None:
                from rosglass.ros1.parameters import Ros1Parameters  # noqa: PLC0415

                self._parameters = Ros1Parameters(self._core, self.server)
            return self._parameters

    @property
    def logger(self) -> NodeLogger:
        """The node's logger; after closing it logs for Python's handlers only."""
        return self._logging().logger

    def close(self) -> None:
        """Withdraw all of it; safe to call twice."""
        with self._lock:
            self._closed = True
            made, self._made = self._made, []
            rosout = self._rosout
        for handle in reversed(made):
            handle.close()
        if rosout is not None:
            rosout.close()
        self.server.close()
        self._core.remove(self)

    def _logging(self) -> Rosout:
        with self._lock:
            if self._rosout is None:
                from rosglass.ros1.rosout import Rosout  # noqa: PLC0415

                self._rosout = Rosout(self._node, self._core, self._topics)
                if self._closed or self._core.closed:
                    self._rosout.close()
            return self._rosout

    def _offer(self) -> None:
        """Offer what other nodes expect to find."""
        from rosglass.ros1.loggers import LoggerServices  # noqa: PLC0415

        try:
            rosout = self._logging()
            rosout.open()
            loggers = LoggerServices(self._node, rosout.logger, self._core.own_dispatcher)
            with self._lock:
                if self._closed:
                    return
                self._made.append(loggers)
            loggers.open()
        except NodeClosedError:
            return
        except Error as error:
            _log.warning("%s: its log is not offered: %s", self._core.name, error)

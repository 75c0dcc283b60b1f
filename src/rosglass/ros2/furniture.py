"""What every ROS 2 node has besides what it is made for: parameters, logging, simulated time.

Made when it is asked for; what other nodes expect to find is offered shortly after connecting, in
small pieces, so that it costs neither the connection nor a user interface's first picture time.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from typing import TYPE_CHECKING

from rosglass.errors import Error, NodeClosedError, UnsupportedError
from rosglass.ros2.core import Member

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Handle, Node
    from rosglass.comm.logger import NodeLogger
    from rosglass.ros2.core import Core
    from rosglass.ros2.parameters import Ros2Parameters
    from rosglass.ros2.rosout import Rosout

__all__ = ["Furniture"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds from connecting until the node's own services are offered, and between two of them.
_DELAY, _PAUSE = 0.2, 0.01


class Furniture(Member):
    """A node's parameters, logger and the like.

    Args:
        node: The node.
        core: What it consists of.
        offered: Whether other nodes find its parameters and its log.
    """

    def __init__(self, node: Node, core: Core, offered: bool) -> None:
        self._node, self._core = node, core
        self._lock = threading.RLock()
        self._parameters: Ros2Parameters | None = None
        self._rosout: Rosout | None = None
        self._made: list[Handle] = []
        self._steps: deque[Callable[[], None]] = deque()
        self._joined = self._closed = False
        for name, level in core.arguments.logger_levels.items():
            if name.partition(".")[0] == "rosglass":
                logging.getLogger(name).setLevel(level)
        if "use_sim_time" in core.arguments.parameters(core.name.full):
            _ = self.parameters
        if offered:
            core.timers.after(_DELAY, self._plan)

    @property
    def parameters(self) -> Ros2Parameters:
        """The node's own parameters; raises NodeClosedError."""
        with self._lock:
            if self._parameters is None:
                from rosglass.ros2.parameters import Ros2Parameters  # noqa: PLC0415
                from rosglass.ros2.sim_time import SimTime  # noqa: PLC0415

                self._check_open()
                core, full = self._core, self._core.name.full
                overrides = core.arguments.parameters(full)
                self._join()
                self._parameters = Ros2Parameters(full, core.dispatcher, overrides)
                self._made.append(SimTime(self._node, core.clock, self._parameters))
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
            parameters, rosout = self._parameters, self._rosout
        for handle in reversed(made):
            handle.close()
        if rosout is not None:
            rosout.close()
        if parameters is not None:
            parameters.close()
        self._core.remove(self)

    def _logging(self) -> Rosout:
        with self._lock:
            if self._rosout is None:
                from rosglass.ros2.rosout import Rosout  # noqa: PLC0415

                self._rosout = Rosout(self._node, self._core)
                if self._closed or self._core.closed:
                    self._rosout.close()
                else:
                    self._join()
            return self._rosout

    def _join(self) -> None:
        """End with the node, now that there is something to end."""
        if not self._joined:
            self._joined = True
            self._core.add(self)

    def _check_open(self) -> None:
        self._core.check_open()
        if self._closed:
            raise NodeClosedError(f"node {self._core.name} is closed; connect again")

    def _plan(self) -> None:
        """Begin to offer what other nodes expect to find."""
        from rosglass.ros2.parameter_services import ParameterServices  # noqa: PLC0415
        from rosglass.ros2.parameters import DESCRIBE_TYPES  # noqa: PLC0415
        from rosglass.ros2.type_descriptions import TypeDescriptionServer  # noqa: PLC0415

        try:
            parameters = self.parameters
            services = ParameterServices(self._node, parameters, self._core.own_dispatcher)
            rosout = self._logging()
            descriptions = TypeDescriptionServer(self._core)
            describes = parameters.get(DESCRIBE_TYPES)
        except NodeClosedError:
            return
        with self._lock:
            if self._closed:
                return
            self._made += [services, descriptions]
        self._steps += [rosout.open, *services.steps()]
        if describes:
            self._steps.insert(1, descriptions.open)
        self._step()

    def _step(self) -> None:
        if self._closed or not self._steps:
            return
        try:
            self._steps.popleft()()
        except NodeClosedError:
            return
        except UnsupportedError as error:
            _log.info("%s: its parameters are not offered: %s", self._core.name, error)
            return
        except Error as error:
            _log.warning("%s: its parameters are not offered: %s", self._core.name, error)
            return
        self._core.timers.after(_PAUSE, self._step)

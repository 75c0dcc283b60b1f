"""What every ROS node has by itself: parameters, a log, simulated time, and services for them.

Each is made at its first use; what other nodes expect to find is offered shortly after connecting,
in small pieces, so that it costs neither the connection nor a user interface's first picture time.
What these are in ROS 1, and what in ROS 2, says a :class:`BuiltinProtocol`.
"""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Generic, TypeVar

from rosglass.comm.core import NodeMember
from rosglass.errors import Error, NodeClosedError, UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosglass.comm.core import NodeCore
    from rosglass.comm.handle import Handle
    from rosglass.comm.log import NodeLog
    from rosglass.comm.parameters import Parameters

__all__ = ["BuiltinProtocol", "BuiltinServices"]

_log = logging.getLogger("rosglass.comm")
#: From connecting until the services are offered, and between two of them.
_OFFER_DELAY_S, _OFFER_PAUSE_S = 0.2, 0.01
_Parameters = TypeVar("_Parameters", bound="Parameters")


class BuiltinProtocol(ABC, Generic[_Parameters]):
    """What a node has by itself in ROS 1, or in ROS 2."""

    @abstractmethod
    def open(self, services: BuiltinServices[_Parameters]) -> None:
        """Begin what does not wait for its first use."""

    @abstractmethod
    def create_parameters(self, services: BuiltinServices[_Parameters]) -> _Parameters:
        """Return the node's own parameters."""

    @abstractmethod
    def create_log(self, services: BuiltinServices[_Parameters]) -> NodeLog:
        """Return the node's log."""

    @abstractmethod
    def offer(self, services: BuiltinServices[_Parameters]) -> Iterator[None]:
        """Offer what other nodes expect to find, in pieces of a millisecond or so.

        Raises:
            NodeClosedError: The node was closed.
            UnsupportedError: The wire cannot carry a service.
        """


class BuiltinServices(NodeMember, Generic[_Parameters]):
    """A node's parameters, log and simulated time, and the services by which others reach them.

    Args:
        core: What the node consists of.
        protocol: What these are in ROS 1 or in ROS 2.
    """

    def __init__(self, core: NodeCore, protocol: BuiltinProtocol[_Parameters]) -> None:
        self._core, self._protocol = core, protocol
        self._lock = threading.RLock()
        self._parameters: _Parameters | None = None
        self._node_log: NodeLog | None = None
        self._handles: list[Handle] = []
        self._offers: Iterator[None] = iter(())
        self._closed = False

    def open(self, offered: bool) -> None:
        """Begin; other nodes find the services only if they are `offered`."""
        self._core.add(self)
        self._protocol.open(self)
        if offered:
            self._offers = self._protocol.offer(self)
            self._core.timers.after(_OFFER_DELAY_S, self._offer)

    @property
    def parameters(self) -> _Parameters:
        """The node's own parameters; raises NodeClosedError at a first use after closing."""
        with self._lock:
            if self._parameters is None:
                self._core.check_open()
                self._parameters = self._protocol.create_parameters(self)
                self.own(self._parameters)
            return self._parameters

    @property
    def log(self) -> NodeLog:
        """The node's log; after closing, its logger logs for Python's handlers only."""
        with self._lock:
            if self._node_log is None:
                self._node_log = self._protocol.create_log(self)
                if self._closed or self._core.closed:
                    self._node_log.close()
            return self._node_log

    def own(self, handle: Handle) -> None:
        """Close a handle with the node, the last one first."""
        with self._lock:
            self._handles.append(handle)
            closed = self._closed
        if closed:
            handle.close()

    def close(self) -> None:
        """Withdraw all of it; safe to call twice."""
        with self._lock:
            self._closed = True
            handles, self._handles = self._handles, []
            log = self._node_log
        for handle in reversed(handles):
            handle.close()
        if log is not None:
            log.close()
        self._core.remove(self)

    def _offer(self) -> None:
        """Offer the next piece."""
        if self._closed:
            return
        try:
            next(self._offers)
        except (StopIteration, NodeClosedError):
            return
        except UnsupportedError as error:
            _log.info("%s: its own services are not offered: %s", self._core.name, error)
        except Error as error:
            _log.warning("%s: its own services are not offered: %s", self._core.name, error)
        else:
            self._core.timers.after(_OFFER_PAUSE_S, self._offer)

"""The built-in parts of every ROS node: parameters, log, simulated time, and their services.

Each is created at its first use. The services that other nodes expect are offered shortly after
connecting, one at a time, so that they delay neither the connection nor a user interface's first
frame. A :class:`BuiltinProtocol` implements them for ROS 1 or ROS 2.

Simulated time: ROS wiki, "Clock"; design article "Clock and Time"; rclcpp's ``TimeSource``. In
ROS 1 all nodes share one parameter ``use_sim_time``, on the parameter server; in ROS 2 each node
has its own.
"""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Generic, TypeVar

from rosglass.comm.core import NodeMember
from rosglass.comm.executor import IMMEDIATE
from rosglass.comm.handle import Handle
from rosglass.comm.qos import QoS
from rosglass.comm.time import Time
from rosglass.errors import Error, NodeClosedError, UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.comm.core import NodeCore
    from rosglass.comm.inbox import Sample
    from rosglass.comm.log import NodeLog
    from rosglass.comm.parameters import Parameters
    from rosglass.comm.subscription import Subscription

__all__ = ["USE_SIM_TIME", "BuiltinProtocol", "BuiltinServices", "SimTime"]

_log = logging.getLogger("rosglass.comm")
#: Delay from connecting until the services are offered, and pause between two of them.
_OFFER_DELAY_S, _OFFER_PAUSE_S = 0.2, 0.01
#: The name of the parameter.
USE_SIM_TIME = "use_sim_time"
#: How long a simulation may take to publish its first time before a warning is logged.
_FIRST_TIME_TIMEOUT_S = 5.0
_Parameters = TypeVar("_Parameters", bound="Parameters")


class BuiltinProtocol(ABC, Generic[_Parameters]):
    """The built-in parts of a node in ROS 1 or ROS 2."""

    @abstractmethod
    def open(self, services: BuiltinServices[_Parameters]) -> None:
        """Start the parts that do not wait for their first use."""

    @abstractmethod
    def create_parameters(self, services: BuiltinServices[_Parameters]) -> _Parameters:
        """Return the node's own parameters."""

    @abstractmethod
    def create_log(self, services: BuiltinServices[_Parameters]) -> NodeLog:
        """Return the node's log."""

    @abstractmethod
    def offer(self, services: BuiltinServices[_Parameters]) -> Iterator[None]:
        """Offer the services that other nodes expect, yielding after each.

        Raises:
            NodeClosedError: The node was closed.
            UnsupportedError: The wire cannot carry a service.
        """


class BuiltinServices(NodeMember, Generic[_Parameters]):
    """A node's parameters, log and simulated time, and the services that expose them.

    Args:
        core: The core of the node.
        protocol: Implements them for ROS 1 or ROS 2.
    """

    def __init__(self, core: NodeCore, protocol: BuiltinProtocol[_Parameters]) -> None:
        self._core, self._protocol = core, protocol
        #: Held at each first use, which may use another of them, and while closing.
        self._lock = threading.RLock()
        self._parameters: _Parameters | None = None
        self._node_log: NodeLog | None = None
        self._handles: list[Handle] = []
        self._offers: Iterator[None] = iter(())
        self._closed = False

    def open(self, offered: bool) -> None:
        """Start the services; other nodes find them only if they are `offered`."""
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
        """The node's log; after closing, its logger logs only to Python's handlers."""
        with self._lock:
            if self._node_log is None:
                self._node_log = self._protocol.create_log(self)
                if self._closed or self._core.closed:
                    self._node_log.close()
            return self._node_log

    def own(self, handle: Handle) -> None:
        """Close a handle with the node, in reverse order of these calls."""
        with self._lock:
            self._handles.append(handle)
            closed = self._closed
        if closed:
            handle.close()

    def close(self) -> None:
        """Withdraw all services; safe to call twice."""
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
        """Offer the next service."""
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


class SimTime(Handle):
    """Makes a node's clock follow ``/clock``, or the system time.

    Args:
        core: The core of the node.
        create_subscription: :meth:`Node.create_subscription`.
    """

    def __init__(self, core: NodeCore, create_subscription: Callable[..., Subscription]) -> None:
        self._core, self._create_subscription = core, create_subscription
        #: Makes following and closing exclude each other.
        self._lock = threading.Lock()
        self._subscription: Subscription | None = None
        self._closed = False

    def close(self) -> None:
        """Stop following; the clock keeps its time. Safe to call twice."""
        with self._lock:
            self._closed = True
            subscription, self._subscription = self._subscription, None
        if subscription is not None:
            subscription.close()

    @property
    def following(self) -> bool:
        """True while the clock follows ``/clock``."""
        return self._subscription is not None

    def follow(self, wanted: bool) -> None:
        """Start or stop following ``/clock``."""
        made = None
        with self._lock:
            if self._closed or wanted == self.following:
                return
            if wanted:
                try:
                    made = self._create_subscription(
                        "/clock",
                        "rosgraph_msgs/msg/Clock",
                        qos=QoS.clock(),
                        raw_callback=self._on_time,
                        executor=IMMEDIATE,
                    )
                except Error:
                    _log.exception("%s: cannot follow simulated time", self._core.name)
                    return
            old, self._subscription = self._subscription, made
        if old is not None:
            old.close()
        # Not `wanted`: another thread may have changed it since.
        self._core.clock.simulate(self.following)
        if wanted:
            self._core.timers.after(_FIRST_TIME_TIMEOUT_S, self._warn_no_time)

    def _on_time(self, sample: Sample) -> None:
        self._core.clock.advance(Time(sample.message().clock.nanoseconds))

    def _warn_no_time(self) -> None:
        """Log the reason if time stands still."""
        if self.following and not self._core.clock.now().nanoseconds:
            _log.warning(
                "%s: %s is set, but nothing was received on /clock: time stands still at zero "
                "until a simulation publishes it, or the parameter is false",
                self._core.name,
                USE_SIM_TIME,
            )

"""The small seam that ROS 2's middlewares share: writers, readers, and news of the graph.

A :class:`Middleware` moves bytes and tells who is there. What ROS 2 means by it (names, types,
profiles that match or not, callbacks) is :mod:`rosglass.ros2.node`'s business, once for all.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Protocol

from rosglass.comm import Handle

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo, NodeName, QoS, Status
    from rosglass.ros2.graph import Graph

__all__ = ["Middleware", "OnSample", "Writer"]


class OnSample(Protocol):
    """Takes a received sample; called on the middleware's thread, must return at once."""

    def __call__(
        self, data: bytes, received: int, sent: int | None, gid: bytes, sequence: int, hash: str
    ) -> None:
        """Take a sample.

        Args:
            data: The payload, with its encapsulation header.
            received: System time of reception, nanoseconds since the Unix epoch.
            sent: The publisher's time stamp in the same unit, None when there is none.
            gid: Identity of the publisher, empty when unknown.
            sequence: The publisher's running number, -1 when unknown.
            hash: The publisher's RIHS01 type hash, empty when it has none.
        """


class Writer(Handle):
    """Sends the samples of one publisher."""

    @abstractmethod
    def write(self, data: bytes | bytearray) -> None:
        """Send a payload, which begins with its encapsulation header."""

    def match(self, subscriptions: Sequence[EndpointInfo]) -> None:
        """Take note of the subscriptions in the graph that want these samples.

        For middlewares that must address them one way or the other; called on every change of
        the graph, never on a thread of the middleware.
        """


class Middleware(ABC):
    """A connection to a ROS 2 domain.

    Attributes:
        matches_qos: Whether a writer and a reader with incompatible profiles exchange nothing.
    """

    matches_qos: bool

    @abstractmethod
    def open(self, graph: Graph, changed: Callable[[], None]) -> None:
        """Start: put what appears into `graph`, call `changed` when :meth:`status` changes.

        Returns without waiting for anyone to answer; both are told from the middleware's threads.

        Raises:
            ConnectionLostError: This machine cannot do it, e.g. the address to listen on is taken.
        """

    @abstractmethod
    def status(self) -> Status:
        """Return the state of the connection."""

    @abstractmethod
    def announce(self, node: NodeName) -> Handle:
        """Show a node in the graph until the handle is closed."""

    @abstractmethod
    def create_writer(
        self, node: NodeName, topic: str, type_name: str, type_hash: str, qos: QoS
    ) -> Writer:
        """Announce a publisher and return its sending end."""

    @abstractmethod
    def create_reader(
        self,
        node: NodeName,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: QoS,
        on_sample: OnSample,
    ) -> Handle:
        """Announce a subscription and hand what arrives to `on_sample`.

        Samples whose type has the same name but another hash are handed over too: whether they
        can be understood is for the caller to say.
        """

    @abstractmethod
    def poll(self) -> None:
        """Do what has to be done now and then; called about once a second on a thread of ours."""

    @abstractmethod
    def close(self) -> None:
        """Leave the domain; safe to call twice. Nothing is called back afterwards."""

"""One publisher of a topic that the node subscribes to, as long as the master names it."""

from __future__ import annotations

import logging
import socket
import time
from typing import TYPE_CHECKING

from rosglass.comm.silence import Silence
from rosglass.errors import ConnectionLostError, ConversionError, MasterError
from rosglass.ros1.connection import Connection
from rosglass.ros1.master import reason_of
from rosglass.ros1.topic_probe import publisher_addresses, subscriber_header

if TYPE_CHECKING:
    from rosglass.ros1.topic_subscription import TopicSubscription

    Received = bytes | memoryview

__all__ = ["PublisherLink"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds between attempts to reach a publisher, the first and the longest.
_RETRY, _LONGEST_RETRY = 0.5, 5.0
#: Bytes per second up to which what nobody waits for may lie in the socket for a tenth of a second.
_LITTLE = 256 * 1024
#: Shortest time in seconds over which that is measured.
_WINDOW = 0.5
#: Messages that are handed on at once: their memory stays in the processor's cache, and so few
#: objects come into being before others go that Python does not look for garbage among them.
_BATCH = 128
#: Messages of a flood that wait for callbacks when reading makes way for those, and for how many
#: seconds. Python's threads take turns: without that, what is read piles up.
_BEHIND, _BREATH = 4096, 0.001
_UNKNOWN_HOST = (
    "set ROS_IP or ROS_HOSTNAME for that node to what this machine knows, or add the name to "
    "/etc/hosts"
)


class PublisherLink:
    """A publisher of the topic, as long as the master names it; all in the loop's thread.

    Args:
        subscription: The node's subscription of the topic.
        uri: The publisher's API.
        epoch: Which master named it.

    Attributes:
        topic: Which it is.
        header: What the publisher said of itself; empty before it is connected.
        name: The publishing node's full name, or its URI as long as that is not known.
        problem: Why it is not connected; empty when it is, or about to be.
        lost: Whether the problem is only that the connection has ended, as when a publisher leaves,
            of which the master tells in a moment.
        latched: The last message of a publisher that latches.
        epoch: Which master, of those that were started one after the other, named it last.
        ended: Whether it is forgotten.
    """

    def __init__(self, subscription: TopicSubscription, uri: str, epoch: int) -> None:
        self.subscription, self.topic, self.epoch = subscription, subscription.topic, epoch
        self.uri = self.name = uri
        self.header: dict[str, str] = {}
        self.problem, self.lost = "", False
        self.latched: Received | None = None
        self.ended = False
        self._core = subscription.core
        self._connection: Connection | None = None
        self._addresses: list[tuple[str, int]] = []
        self._latches = False
        self._silence, self._count = Silence(), 0
        self._delay = _RETRY
        self._measured_at, self._measured, self._rate = time.monotonic(), 0, 0.0
        self._begin()

    @property
    def connected(self) -> bool:
        """Whether messages can come."""
        return bool(self.header)

    @property
    def silence(self) -> str:
        """What is strange about nothing coming from it; empty when nothing is."""
        return self._silence.problem

    def listen(self) -> None:
        """Look whether it has fallen silent; on the node's own thread."""
        # Latched messages come once; and what this node sends is missed by nobody.
        if self.connected and not self._latches and self.uri not in self._core.uris:
            self._silence.follow(self.name, self._count, time.monotonic())

    @property
    def info(self) -> str:
        """The connection as ``rosnode info`` shows it; empty when there is none."""
        connection = self._connection
        return "" if connection is None else connection.info

    @property
    def received(self) -> int:
        """How many bytes have come on this connection."""
        connection = self._connection
        return 0 if connection is None else connection.received

    def end(self) -> None:
        """Forget the publisher."""
        self.ended = True
        if self._connection is not None:
            self._connection.end("")

    def resume(self) -> None:
        """Hand on messages: it is decided who understands them."""
        if self._connection is not None:
            self._connection.pause(reading=True)

    def attend(self, eager: bool) -> None:
        """Read at once what comes, or leave it in the socket for a while if that is not much."""
        connection, now = self._connection, time.monotonic()
        if connection is None:
            return
        if now - self._measured_at >= _WINDOW:
            came = connection.received - self._measured
            self._rate = came / (now - self._measured_at)
            self._measured_at, self._measured = now, connection.received
        connection.hurry(eager or not self.header or self._rate > _LITTLE)

    def drain(self) -> None:
        """Hand on what waits in the socket; from any thread."""
        connection = self._connection
        if connection is not None:
            connection.drain()

    # -- connecting ------------------------------------------------------------------------------

    def _begin(self) -> None:
        if not self.ended and not self._core.closed:
            self._core.errands.run(self._ask)

    def _ask(self) -> None:
        """Ask the publisher where to connect; on a thread that may wait."""
        topic = self.topic
        reason, found = "", list[tuple[str, int]]()
        try:
            found = publisher_addresses(self._core.name.full, self.uri, topic)
        except (ConnectionLostError, MasterError, ConversionError) as error:
            unknown = isinstance(error.__cause__, socket.gaierror)
            reason = f"{error}: {_UNKNOWN_HOST}" if unknown else str(error)
        self._core.loop.call(lambda: self._connect(found, reason))

    def _connect(self, addresses: list[tuple[str, int]], reason: str = "") -> None:
        """Try the first of the addresses, the others when that fails."""
        if self.ended:
            return
        if not addresses:
            self._fail(reason)
            return
        self._addresses = addresses[1:]
        header = subscriber_header(self._core.name.full, self.topic)
        try:
            self._connection = Connection.dial(
                self._core.loop, addresses[0], header, self._on_header, _ignore, self._fail
            )
        except OSError as error:
            self._fail(reason_of(error))

    def _on_header(self, header: dict[str, str]) -> None:
        connection = self._connection
        assert connection is not None
        connection.take_together(self._on_frames)
        connection.pause(reading=False)  # until it is decided who understands it
        self.header, self.problem, self._delay, self._addresses = header, "", _RETRY, []
        self.name = header.get("callerid", "") or self.uri
        self._latches = header.get("latching") == "1"
        self._silence, self._count = Silence(), 0
        self._measured_at, self._measured, self._rate = time.monotonic(), 0, 0.0
        self._core.unreachable.greet(self)
        self.subscription.on_publisher_connected(self)

    def _on_frames(self, frames: list[Received], _: int) -> None:
        received = time.time_ns()
        self._count += len(frames)
        if self._silence.problem:
            self.subscription.inform()  # it is none any more
        if self._latches:
            self.latched = frames[-1]
        try:
            for start in range(0, len(frames), _BATCH):
                part = frames[start : start + _BATCH]
                for reader in self.subscription.readers:
                    reader.take(self, part, received)
            if len(frames) >= _BATCH and self._core.loop.is_current:
                self._apply_backpressure()
        except Exception:  # an executor of somebody's
            _log.exception("%s: messages could not be handed on", self.topic)

    def _apply_backpressure(self) -> None:
        """Read nothing for a moment if callbacks are behind: reading takes time from them."""
        behind = max((reader.feed.waiting for reader in self.subscription.readers), default=0)
        connection = self._connection
        if behind > _BEHIND and connection is not None:
            connection.pause(reading=False)
            self._core.loop.after(_BREATH, lambda: connection.pause(reading=True))

    def _fail(self, reason: str) -> None:
        """Try again later: the master names it still."""
        addresses, was_connected = self._addresses, self.connected
        self._connection, self.header, self.latched = None, {}, None
        self._addresses = []
        if self.ended or self._core.closed:
            return
        if addresses and not was_connected:
            self._connect(addresses)
            return
        what = "was lost" if was_connected else "cannot be received from"
        self.problem, self.lost = f"{self.name} {what}: {reason}; trying again", was_connected
        if not was_connected:
            self._core.unreachable.fail(self)
        self.subscription.on_publisher_disconnected(self)
        if not self.ended:
            self._core.loop.after(self._delay, self._begin)
            self._delay = min(_LONGEST_RETRY, 2 * self._delay)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}>"


def _ignore(_data: Received, _first: int) -> None:
    """Take a message by itself: nobody is asked to, they are taken together."""

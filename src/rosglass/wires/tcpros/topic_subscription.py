"""A topic that a node subscribes to: one registration, and the connections with its publishers.

ROS 1 negotiates the type on each connection: a publisher's header has its type, md5 sum, definition
and whether it latches. The publisher's API returns the address to connect to.

Protocol: ROS wiki, "ROS/Slave_API" (requestTopic) and "ROS/TCPROS".
"""

from __future__ import annotations

import logging
import socket
import time
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from functools import partial
from itertools import repeat
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, NodeName, Sample
from rosglass.comm.subscription import Problem, TopicMatching
from rosglass.comm.wire import Reader
from rosglass.errors import (
    ConnectionLostError,
    ConversionError,
    DefinitionError,
    InvalidNameError,
    MasterError,
    TypeNotFoundError,
)
from rosglass.interfaces import join_name, ros1_name
from rosglass.interfaces.counterparts import RENAMED
from rosglass.messages import OpaqueType
from rosglass.wires.tcpros.arrivals import BacklogMonitor, SilenceMonitor
from rosglass.wires.tcpros.connection import ANY, Connection
from rosglass.wires.tcpros.graph import split
from rosglass.wires.tcpros.master import call_node, reason_of
from rosglass.wires.tcpros.publication import definition_text
from rosglass.wires.tcpros.registrations import Member

__all__ = [
    "PublisherLink",
    "TopicReader",
    "TopicSubscription",
    "TypeNegotiation",
    "UnreachableLog",
    "ask_publisher",
    "publisher_addresses",
    "subscriber_header",
]

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from rosglass.comm.subscription import SubscriptionFeed
    from rosglass.messages import MessageType
    from rosglass.wires.tcpros.core import BlockingPool, TcprosCore
    from rosglass.wires.tcpros.io_loop import IoLoop
    from rosglass.wires.tcpros.master import Master

    Received = bytes | memoryview


_log = logging.getLogger("rosglass.ros1")
#: How long a connection is kept open whose publisher the master does not list any more.
_LAST_MESSAGES_S = 1.0


class TopicSubscription(Member):
    """The node's registration of a topic, shared by its subscriptions of that topic.

    Args:
        core: The node.
        topic: Absolute topic name.
        type_name: The registered type, ``pkg/Type``; ``*`` for any.
        unreachable: Logs publishers that cannot be reached.
        current: Returns the topic's registration as of now, None if it is not subscribed to.
        latched: Returns the last message of each latched publisher of the node itself.

    Attributes:
        unreachable: As given.
        negotiations: One for each subscription; replaced, never changed: the loop's thread iterates
            over them for each message. :meth:`join` and :meth:`leave` are called under the topics'
            lock.
        eager: Whether messages are handed on as they are received.
    """

    lists_node = True

    def __init__(
        self,
        core: TcprosCore,
        topic: str,
        type_name: str,
        unreachable: UnreachableLog,
        current: Callable[[], TopicSubscription | None],
        latched: Callable[[], list[memoryview]],
    ) -> None:
        self.core, self.topic, self.unreachable = core, topic, unreachable
        self.endpoint = (EndpointKind.SUBSCRIPTION, topic)
        self.type_name = type_name
        self.negotiations: tuple[TypeNegotiation, ...] = ()
        self.eager = True
        self._current, self._latched = current, latched
        #: By URI; changed in the loop's thread only.
        self._links: dict[str, PublisherLink] = {}
        self._closed = False
        #: The number of the master that lists it, from 0, and of its lists of publishers.
        self._epoch, self._updates = -1, 0
        #: The publishers of the last update.
        self._listed: list[str] = []

    def links(self) -> list[PublisherLink]:
        """Return the connections with publishers; from any thread."""
        return list(self._links.values())

    # -- subscriptions ---------------------------------------------------------------------------

    def join(self, negotiation: TypeNegotiation) -> None:
        """Add a subscription, which receives latched messages first; from any thread."""
        self.negotiations = (*self.negotiations, negotiation)
        self.core.loop.call(lambda: self._join(negotiation))

    def _join(self, negotiation: TypeNegotiation) -> None:
        for link in self.links():
            # One that connected since the subscription joined negotiates with it already.
            if link.connected and negotiation not in link.negotiations:
                link.negotiations = (*link.negotiations, negotiation)
                negotiation.negotiate_type(link, partial(self._catch_up, negotiation, link))
        self.update_eager()

    def _catch_up(self, negotiation: TypeNegotiation, link: PublisherLink) -> None:
        """Hand on the latched messages that a connection of its own would have received."""
        if link.is_local:
            for data in self._latched():
                negotiation.reader.on_messages(link, [data], time.time_ns())
        elif link.latched is not None:
            negotiation.reader.on_messages(link, [link.latched], time.time_ns())
        negotiation.feed.request_update()

    def leave(self, negotiation: TypeNegotiation) -> bool:
        """Remove a subscription; return whether it was the last one."""
        self.negotiations = tuple(each for each in self.negotiations if each is not negotiation)
        return not self.negotiations

    def update_eager(self) -> None:
        """Be eager while one of the subscriptions is; from any thread."""
        eager = any(each.reader.eager for each in self.negotiations)
        if eager != self.eager:
            self.eager = eager
            self.core.loop.call(self._update_links)

    def _update_links(self) -> None:
        for link in self.links():
            link.set_eager(self.eager)

    def drain(self) -> None:
        """Hand on the sockets' data; from any thread."""
        for link in self.links():
            link.drain()

    # -- publishers, in the loop's thread --------------------------------------------------------

    def notify_feeds(self) -> None:
        """Notify the subscriptions' feeds of a change; from any thread."""
        for each in self.negotiations:
            each.feed.request_update()

    def on_publisher_connected(self, link: PublisherLink) -> None:
        """Negotiate the type with every subscription, then resume reading."""
        link.negotiations = negotiations = self.negotiations
        left = len(negotiations) + 1

        def decided() -> None:
            nonlocal left
            left -= 1
            if not left:
                link.resume()
                link.set_eager(self.eager)
                self.notify_feeds()

        for each in negotiations:
            each.negotiate_type(link, decided)
        decided()

    def on_publisher_disconnected(self, link: PublisherLink) -> None:
        """Remove a publisher from the subscriptions; it is dialled again while it is listed."""
        _log.debug("%s: %s", self.topic, link.problem)
        for each in self.negotiations:
            each.on_publisher_disconnected(link)
        if link.epoch != self._epoch:
            # The master does not list it: it was kept for its last messages.
            self._remove(link)
        self.notify_feeds()

    def on_publishers_changed(self, uris: list[str]) -> None:
        """Connect to new publishers, and drop those that have left; from any thread."""
        self._listed = uris
        self._updates += 1
        self.core.loop.call(lambda: self._set_publishers(uris))

    def _set_publishers(self, uris: list[str]) -> None:
        if self._closed:
            return
        for uri in self._links.keys() - set(uris):
            link = self._links[uri]
            if not link.connected:
                self._remove(link)
            elif link.epoch == self._epoch:
                self._remove_later(link)
            # A restarted master lists only registered publishers: others go on publishing.
        for uri in uris:
            known = self._links.get(uri)
            if known is None:
                self._links[uri] = PublisherLink(self, uri, self._epoch)
            else:
                known.epoch = self._epoch
        self.notify_feeds()

    def _remove_later(self, link: PublisherLink) -> None:
        """Remove a publisher after its last messages, unless the master lists it again."""
        link.epoch = left = -2 - self._updates  # until the master lists it again

        def remove() -> None:
            if link.epoch == left and not link.ended:
                self._remove(link)

        self.core.loop.after(_LAST_MESSAGES_S, remove)

    def _remove(self, link: PublisherLink) -> None:
        self._links.pop(link.uri, None)
        link.end()
        for each in self.negotiations:
            each.on_publisher_disconnected(link)

    # -- as a member -----------------------------------------------------------------------------

    def misses_publishers(self, count: int) -> bool:
        """Return whether fewer publishers are connected."""
        return sum(link.connected for link in self.links()) < count

    def register(self, master: Master) -> None:
        """Register the subscription, and connect to the publishers that the master lists."""
        self._epoch += 1
        updates = self._updates
        uris = list(master.call("registerSubscriber", self.topic, self.type_name, self.core.uri))

        def set_publishers() -> None:
            for link in self.links():
                if link.uri in uris:
                    link.epoch = self._epoch
            # An update that the master has sent since then is newer than this answer: what it does
            # not list any more has left.
            self._set_publishers(uris if updates == self._updates else self._listed)

        self.core.loop.call(set_publishers)

    def unregister(self, master: Master) -> None:
        """Unregister the subscription."""
        master.call("unregisterSubscriber", self.topic, self.core.uri)

    def successor(self) -> Member | None:
        """Return the topic's new registration, if it is subscribed to again."""
        return self._current()

    def follow(self, moved: bool, idle: bool) -> None:
        """Check for silent publishers, and let the subscriptions' feeds follow the graph."""
        for link in self.links():
            link.check_silence()
        for each in self.negotiations:
            each.feed.follow(moved, idle)
        if idle:
            # The rate may have changed.
            self.core.loop.call(self._update_links)

    def close(self) -> None:
        """End the subscriptions and the connections; safe to call twice, also at once."""
        if self._closed:
            return
        self._closed = True
        for each in self.negotiations:
            each.feed.close()
        self.core.loop.call(self._end)
        self.core.remove(self)

    def _end(self) -> None:
        for link in self.links():
            link.end()
        self._links.clear()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.topic}>"


_PUBLISHER = EndpointKind.PUBLISHER


class TopicReader(Reader):
    """Hands the messages of accepted publishers to a subscription's inbox.

    Args:
        topic: The node's registration of the topic.
        feed: The subscription's feed.

    Attributes:
        accepted: The type and name of each accepted publisher; written by the type negotiation.
        eager: Whether messages are handed on as they are received.
    """

    def __init__(self, topic: TopicSubscription, feed: SubscriptionFeed) -> None:
        self._topic, self._feed, self.eager = topic, feed, True
        self.accepted: dict[PublisherLink, tuple[MessageType, bytes]] = {}

    def on_messages(
        self, link: PublisherLink, frames: Sequence[bytes | memoryview], received: int
    ) -> None:
        """Hand on messages; in the loop's thread, or one that drains the sockets."""
        known = self.accepted.get(link)
        if known is not None:
            message_type, gid = known
            # Three times as fast as Sample(...).
            make = tuple.__new__
            if len(frames) == 1:
                sample = make(Sample, (frames[0], "ros1", message_type, received, None, gid, -1))
                self._feed.deliver(sample)
                return
            given = zip(
                frames,
                repeat("ros1"),
                repeat(message_type),
                repeat(received),
                repeat(None),
                repeat(gid),
                repeat(-1),
                strict=False,
            )
            self._feed.deliver_many(list(map(make, repeat(Sample), given)))

    def set_eager(self, eager: bool) -> None:
        """Set whether messages are handed on as they are received; from any thread."""
        self.eager = eager
        self._topic.update_eager()

    def flush(self) -> None:
        """Hand on the sockets' data; from any thread."""
        if not self._topic.eager and not self._topic.core.forked:
            self._topic.drain()

    def lateness(self, publisher: bytes) -> int:
        """Return how late a publisher's last message was, by when its messages arrive."""
        known = self.accepted.copy().items()
        late = (link.late for link, (_, name) in known if name == publisher)
        return round(max(late, default=0.0) * 1e9)

    def close(self) -> None:
        """Hand on no further messages."""
        self.accepted.clear()


class TypeNegotiation(TopicMatching):
    """Matches a subscription with a topic's publishers by their types.

    Messages do not pass through here, but through its reader.

    Args:
        core: The node it belongs to.
        topic: The node's registration of the topic.
        type_name: The requested type if its definition is unknown here, else empty.
        ignore_local: Whether to ignore this node's own publishers.
        on_close: Called once when the subscription is closed.

    Attributes:
        feed: The subscription's feed.
        topic: As given.
        reader: Receives the messages.
    """

    #: Connections need no master.
    outlives_discovery = True
    feed: SubscriptionFeed
    reader: TopicReader

    def __init__(
        self,
        core: TcprosCore,
        topic: TopicSubscription,
        type_name: str,
        ignore_local: bool,
        on_close: Callable[[TypeNegotiation], None],
    ) -> None:
        self.topic = topic
        self._core, self._on_close = core, on_close
        self._ignore_local = ignore_local
        #: Why publishers are refused.
        self._refused: dict[PublisherLink, str] = {}
        self._remarks: dict[PublisherLink, str] = {}
        self._fixed: MessageType | None = None
        self._name = join_name(type_name) if type_name else ""
        self._closed = False

    # -- in the loop's thread --------------------------------------------------------------------

    def negotiate_type(self, link: PublisherLink, decided: Callable[[], None]) -> None:
        """Accept or refuse a publisher by its type, then call `decided`."""
        if self._ignore_local and link.is_local:
            decided()
            return
        header = link.header
        md5, full = header.get("md5sum", ""), _full_name(header.get("type", ""))
        wanted = self._fixed
        if wanted is not None and self._agrees(wanted, full, md5) and wanted.md5:
            self.reader.accepted[link] = (wanted, link.name.encode())
            decided()
            return
        missing = [name for name in ("type", "md5sum") if header.get(name, ANY) == ANY]
        if missing:
            self._refused[link] = (
                f"{link.name} does not say what it publishes on {self.topic.topic}: "
                f"{' and '.join(missing)} missing in its connection header; give the type when "
                "subscribing"
            )
            decided()
        elif wanted is not None and not self._agrees(wanted, full, md5):
            self._refused[link] = self._mismatch(link, wanted)
            decided()
        elif self._name and full != self._name:
            self._refused[link] = (
                f"{link.name} publishes {self.topic.topic} as {full}, requested was "
                f"{self._name}: nothing is received from it"
            )
            decided()
        else:
            # Definitions may be long, and have to be searched in files.
            self._core.pool.run(lambda: self._learn(link, header, decided))

    def _agrees(self, wanted: MessageType, full: str, md5: str) -> bool:
        # tf's old message is tf2's under another name; roscpp, too, compares only the sum.
        same = full in ("", wanted.name) or (
            RENAMED.get(full) == wanted.name and md5 == wanted.md5 != ""
        )
        return same and (md5 in (ANY, wanted.md5) or not wanted.md5)

    def _learn(
        self, link: PublisherLink, header: dict[str, str], decided: Callable[[], None]
    ) -> None:
        """Find the type that a publisher announces; on a thread that may wait."""
        name, md5 = header["type"], header["md5sum"]
        text = header.get("message_definition", "")
        message_type: MessageType | None = None
        reason = ""
        try:
            message_type = self._core.types.learn(name, md5, text)
        except (TypeNotFoundError, DefinitionError, InvalidNameError) as error:
            reason = str(error)
            if not self.feed.decodes:
                message_type = _opaque(name, md5, text, reason)

        def decide() -> None:
            if link.header is header:  # still the same connection
                self._decide(link, message_type, reason)
            decided()

        self._core.loop.call(decide)

    def _decide(self, link: PublisherLink, message_type: MessageType | None, reason: str) -> None:
        current = self.feed.type
        if message_type is None:
            self._refused[link] = reason
            return
        if self._fixed is None and (current is None or not self.reader.accepted):
            self.feed.set_type(message_type)
        elif self._fixed is None and current is not None and message_type.name != current.name:
            self._refused[link] = (
                f"{link.name} publishes {self.topic.topic} as {message_type.name}, others as "
                f"{current.name}: nothing is received from it; choose one, e.g. "
                f"create_subscription({self.topic.topic!r}, {ros1_name(message_type.name)!r})"
            )
            return
        if reason:
            self._remarks[link] = f"{reason}: its messages are received as bytes"
        self.reader.accepted[link] = (message_type, link.name.encode())

    def on_publisher_disconnected(self, link: PublisherLink) -> None:
        """Remove a publisher."""
        accepted = self.reader.accepted.pop(link, None)
        for known in (self._refused, self._remarks):
            known.pop(link, None)
        if accepted is not None:
            self.feed.on_publisher_left(self._endpoint(link, *accepted))

    # -- as the matching of the subscription's feed ----------------------------------------------

    def open(
        self,
        feed: SubscriptionFeed,
        publishers: Sequence[EndpointInfo],  # noqa: ARG002 - ROS 1 has no QoS
    ) -> None:
        """Set the profile, and receive from the connected publishers."""
        self.feed, self.reader, self._fixed = feed, TopicReader(self.topic, feed), feed.type
        feed.set_qos(feed.qos.for_subscription([]))
        self.topic.join(self)

    def update(
        self,
        publishers: Sequence[EndpointInfo],  # noqa: ARG002 - connections count
        idle: bool,  # noqa: ARG002 - links change by themselves
    ) -> list[Problem]:
        """Return the problems of connections and types."""
        links = self.topic.links()
        # Those that cannot be reached are logged once for all that they publish.
        lost = [Problem(link.problem, logging.INFO, link.lost) for link in links if link.problem]
        faults = [*self._refused.copy().values(), *self._remarks.copy().values()]
        silence = [link.silence for link in links if link.silence and link in self.reader.accepted]
        return [
            *lost,
            *(Problem(fault) for fault in faults),
            *(Problem(text, logging.INFO) for text in silence),
        ]

    def find_matching(
        self,
        publishers: Sequence[EndpointInfo],  # noqa: ARG002 - the master may not know them yet
    ) -> list[EndpointInfo]:
        """Return the connected publishers whose types are accepted."""
        return [
            self._endpoint(link, *accepted)
            for link, accepted in self.reader.accepted.copy().items()
        ]

    def close(self) -> None:
        """Stop receiving; safe to call twice."""
        if not self._closed:
            self._closed = True
            self.reader.close()
            self._on_close(self)

    def _endpoint(self, link: PublisherLink, message_type: MessageType, gid: bytes) -> EndpointInfo:
        return EndpointInfo(
            _PUBLISHER,
            self.topic.topic,
            message_type.name,
            NodeName(*split(link.name)),
            type_hash=link.header.get("md5sum", message_type.md5),
            gid=gid,
        )

    def _mismatch(self, link: PublisherLink, wanted: MessageType) -> str:
        header = link.header
        theirs = header.get("message_definition", "").strip() or "(it sends no definition)"
        return (
            f"{link.name} publishes {self.topic.topic} as {header.get('type')} with md5 "
            f"{header.get('md5sum')}, requested was {ros1_name(wanted.name)} with md5 "
            f"{wanted.md5}: nothing is received from it; subscribe without a type to take what it "
            f"sends, or add its definition to the library. Theirs:\n{theirs}\nOurs:\n"
            f"{definition_text(self._core.types, wanted).strip()}"
        )


def _opaque(name: str, md5: str, text: str, reason: str) -> OpaqueType | None:
    """Return a type without definition; None if the name or sum is not valid."""
    try:
        return OpaqueType(name, md5, reason, text=text, ros=1)
    except InvalidNameError:
        return None


def _full_name(name: str) -> str:
    """Return a type's full name; empty when the header has none."""
    if name in ("", ANY):
        return ""
    try:
        return join_name(name)
    except InvalidNameError:
        return name


#: Seconds between attempts to reach a publisher, the first and the longest.
_RETRY_S, _MAX_RETRY_S = 0.5, 5.0
#: Bytes per second up to which messages may wait in the socket if the subscriptions are not eager.
_IDLE_BYTES_PER_S = 256 * 1024
#: Shortest time over which that rate is measured.
_RATE_WINDOW_S = 0.5
#: Messages that are handed on at once: their memory stays in the processor's cache, and so few
#: objects are alive that Python's garbage collector does not run.
_BATCH = 128
#: Messages that wait for callbacks when reading pauses, and for how many seconds: threads share
#: Python's lock, and the queue would grow without that.
_MAX_BEHIND, _PAUSE_S = 4096, 0.001
_UNKNOWN_HOST = (
    "set ROS_IP or ROS_HOSTNAME for that node to what this machine knows, or add the name to "
    "/etc/hosts"
)


class PublisherLink:
    """A publisher of the topic, as long as the master lists it; used in the loop's thread.

    Args:
        subscription: The node's subscription of the topic.
        uri: URI of the publisher's API.
        epoch: The number of the master that listed it.

    Attributes:
        topic: Absolute topic name.
        uri: As given.
        header: The publisher's header; empty while it is not connected.
        name: The publishing node's full name, or its URI while that is unknown.
        problem: Why it is not connected; empty when it is, or about to be.
        lost: Whether the problem is only that the connection has ended, as when a publisher leaves
            and the master has not listed the others yet.
        latched: The last message of a publisher that latches.
        epoch: The number of the master that listed it last; counted up by restarts.
        ended: Whether it is removed.
        negotiations: The negotiations of the type on this connection.
        backlog: How late its messages are.
    """

    def __init__(self, subscription: TopicSubscription, uri: str, epoch: int) -> None:
        self.subscription, self.topic, self.epoch = subscription, subscription.topic, epoch
        self.uri = self.name = uri
        self.header: dict[str, str] = {}
        self.problem, self.lost = "", False
        self.latched: Received | None = None
        self.ended = False
        self.negotiations: tuple[TypeNegotiation, ...] = ()
        self._core = subscription.core
        self._connection: Connection | None = None
        self._addresses: list[tuple[str, int]] = []
        self._latches = False
        self._silence, self.backlog, self._count = SilenceMonitor(), BacklogMonitor(), 0
        self._delay = _RETRY_S
        self._measured_at, self._measured, self._rate = time.monotonic(), 0, 0.0
        self._begin()

    @property
    def connected(self) -> bool:
        """True once its header was received."""
        return bool(self.header)

    @property
    def is_local(self) -> bool:
        """True if the publisher is the node itself, at its current address or an earlier one."""
        return self.uri in self._core.uris

    @property
    def silence(self) -> str:
        """Why its silence is suspicious; empty when it is not."""
        return self._silence.problem

    @property
    def late(self) -> float:
        """Seconds by which its last message was late, if it sends regularly; 0 if it does not."""
        return self.backlog.late

    def check_silence(self) -> None:
        """Check whether it has stopped sending; on the node's own thread."""
        # Latched messages are sent once; and this node knows what it sends itself.
        if self.connected and not self._latches and not self.is_local:
            now = time.monotonic()
            self._silence.update(self.name, self._count, now)
            self.backlog.set_period(self._silence.period, now)

    @property
    def info(self) -> str:
        """The connection as ``rosnode info`` shows it; empty when there is none."""
        connection = self._connection
        return "" if connection is None else connection.info

    @property
    def received(self) -> int:
        """Number of bytes received on this connection."""
        connection = self._connection
        return 0 if connection is None else connection.received

    def end(self) -> None:
        """End the connection, and do not dial it again."""
        self.ended = True
        if self._connection is not None:
            self._connection.end("")

    def resume(self) -> None:
        """Hand on messages, once every subscription has accepted or refused the type."""
        if self._connection is not None:
            self._connection.pause(reading=True)

    def set_eager(self, eager: bool) -> None:
        """Set whether data is read as it arrives; fast connections always are."""
        connection, now = self._connection, time.monotonic()
        if connection is None:
            return
        if now - self._measured_at >= _RATE_WINDOW_S:
            count = connection.received - self._measured
            self._rate = count / (now - self._measured_at)
            self._measured_at, self._measured = now, connection.received
        connection.set_urgent(eager or not self.header or self._rate > _IDLE_BYTES_PER_S)

    def drain(self) -> None:
        """Hand on the socket's data; from any thread."""
        connection = self._connection
        if connection is not None:
            connection.drain()

    # -- connecting ------------------------------------------------------------------------------

    def _begin(self) -> None:
        if not self.ended and not self._core.closed:
            self._core.pool.run(self._ask)

    def _ask(self) -> None:
        """Request the address from the publisher; on a thread that may wait."""
        topic = self.topic
        reason, found = "", list[tuple[str, int]]()
        try:
            found = publisher_addresses(self._core.name.full, self.uri, topic)
        except (ConnectionLostError, MasterError, ConversionError) as error:
            unknown = isinstance(error.__cause__, socket.gaierror)
            reason = f"{error}: {_UNKNOWN_HOST}" if unknown else str(error)
        self._core.loop.call(lambda: self._connect(found, reason))

    def _connect(self, addresses: list[tuple[str, int]], reason: str = "") -> None:
        """Dial the first address, and the others if that fails."""
        if self.ended:
            return
        if not addresses:
            self._fail(reason)
            return
        self._addresses = addresses[1:]
        header = subscriber_header(self._core.name.full, self.topic)
        try:
            self._connection = Connection.dial(
                self._core.loop,
                addresses[0],
                header,
                self._on_header,
                lambda _data, _lead: None,
                self._fail,
            )
        except OSError as error:
            self._fail(reason_of(error))

    def _on_header(self, header: dict[str, str]) -> None:
        connection = self._connection
        assert connection is not None
        connection.set_batch_handler(self._on_frames)
        connection.pause(reading=False)  # until the type is negotiated
        self.header, self.problem, self._delay, self._addresses = header, "", _RETRY_S, []
        self.name = header.get("callerid", "") or self.uri
        self._latches = header.get("latching") == "1"
        self._silence, self.backlog, self._count = SilenceMonitor(), BacklogMonitor(), 0
        self._measured_at, self._measured, self._rate = time.monotonic(), 0, 0.0
        self.subscription.unreachable.on_publisher_connected(self)
        self.subscription.on_publisher_connected(self)

    def _on_frames(self, frames: list[Received], _: int) -> None:
        received = time.time_ns()
        self._count += len(frames)
        self.backlog.add(len(frames), time.monotonic())
        if self._silence.problem:
            self.subscription.notify_feeds()  # it has ended
        if self._latches:
            self.latched = frames[-1]
        try:
            for start in range(0, len(frames), _BATCH):
                part = frames[start : start + _BATCH]
                for each in self.subscription.negotiations:
                    each.reader.on_messages(self, part, received)
            if len(frames) >= _BATCH and self._core.loop.is_current:
                self._apply_backpressure()
        except Exception:  # noqa: BLE001 - a user's executor
            _log.exception("%s: handing on messages failed", self.topic)

    def _apply_backpressure(self) -> None:
        """Pause reading for a moment if callbacks are behind: reading takes time from them."""
        behind = max((each.feed.waiting for each in self.subscription.negotiations), default=0)
        connection = self._connection
        if behind > _MAX_BEHIND and connection is not None:
            connection.pause(reading=False)
            self._core.loop.after(_PAUSE_S, lambda: connection.pause(reading=True))

    def _fail(self, reason: str) -> None:
        """Dial again later, while the master lists it."""
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
            self.subscription.unreachable.on_publisher_failed(self)
        self.subscription.on_publisher_disconnected(self)
        if not self.ended:
            self._core.loop.after(self._delay, self._begin)
            self._delay = min(_MAX_RETRY_S, 2 * self._delay)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}>"


#: Seconds in which the topics of a publisher are collected for one log line.
_GATHER_S = 1.0
#: Topics named in a line, and publishers' topics that are remembered as logged.
_MAX_NAMED, _MAX_REMEMBERED = 12, 1000


class UnreachableLog:
    """Logs each unreachable publisher once, for all its topics, and when it is back.

    Used in the loop's thread.

    Args:
        loop: The node's I/O loop.
        pool: Writes the log, whose handlers may block.
    """

    def __init__(self, loop: IoLoop, pool: BlockingPool) -> None:
        self._loop, self._pool = loop, pool
        self._failed: set[PublisherLink] = set()
        self._back: set[PublisherLink] = set()
        #: Publisher and topic -> the logged problem.
        self._logged: dict[tuple[str, str], str] = {}
        self._gathering = False

    def on_publisher_failed(self, link: PublisherLink) -> None:
        """Log a publisher soon, unless it is connected by then."""
        self._failed.add(link)
        self._gather()

    def on_publisher_connected(self, link: PublisherLink) -> None:
        """Log soon that an unreachable publisher is back."""
        if any((name, link.topic) in self._logged for name in (link.name, link.uri)):
            self._back.add(link)
            self._gather()

    def _gather(self) -> None:
        if not self._gathering:
            self._gathering = True
            self._loop.after(_GATHER_S, self._log_links)

    def _log_links(self) -> None:
        self._gathering = False
        lines: dict[str, set[str]] = {}
        for link in self._back:
            known = [self._logged.pop((name, link.topic), "") for name in (link.name, link.uri)]
            if any(known) and not link.ended:
                lines.setdefault(f"{link.name} is back", set()).add(link.topic)
        for link in self._failed:
            key = (link.name, link.topic)
            wanted = link.problem and not link.lost and not link.ended
            if wanted and self._logged.get(key) != link.problem:
                self._logged[key] = link.problem
                lines.setdefault(link.problem, set()).add(link.topic)
        self._failed.clear()
        self._back.clear()
        while len(self._logged) > _MAX_REMEMBERED:
            self._logged.pop(next(iter(self._logged)))
        if lines:
            self._pool.run(lambda: _write(lines))


def _write(lines: dict[str, set[str]]) -> None:
    for line, topics in lines.items():
        # A warning, too: the log level that shows the problem must show its end.
        _log.warning("%s: %s", _listed(topics), line)


def _listed(topics: Iterable[str]) -> str:
    names = sorted(topics)
    more = len(names) - _MAX_NAMED
    return ", ".join(names[:_MAX_NAMED]) + (f" and {more} more topics" if more > 0 else "")


def subscriber_header(caller: str, topic: str) -> dict[str, str]:
    """Return the connection header of a subscriber that accepts any type."""
    return {
        "callerid": caller,
        "md5sum": ANY,
        "message_definition": "",
        "tcp_nodelay": "1",
        "topic": topic,
        "type": ANY,
    }


def publisher_addresses(
    caller: str, uri: str, topic: str, timeout: float = 5.0
) -> list[tuple[str, int]]:
    """Request the addresses of a publisher from its API; waits for it and for name servers.

    Args:
        caller: The asking node's full name.
        uri: The publisher's API.
        topic: Absolute topic name.
        timeout: Seconds that the publisher may take.

    Returns:
        Resolved addresses and ports.

    Raises:
        MasterError: It does not publish the topic, or does not offer TCPROS.
        ConnectionLostError: It does not answer, or its host is unknown here.
    """
    answer = call_node(uri, "requestTopic", caller, topic, [["TCPROS"]], timeout=timeout)
    place = f"{uri} for {topic}"
    if not (isinstance(answer, (list, tuple)) and len(answer) >= 3 and answer[0] == "TCPROS"):
        raise MasterError(f"{place} does not offer TCPROS, but {answer!r:.80}")
    host, port = str(answer[1]), answer[2]
    if type(port) is not int or not 0 < port < 65536:
        raise ConnectionLostError(f"{place} answers with the invalid port {port!r:.80}")
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise ConnectionLostError(
            f"{place} answers with {host}:{port}, but {reason_of(error)}"
        ) from error
    return list(dict.fromkeys((str(one[4][0]), int(one[4][1])) for one in found))


def ask_publisher(core: TcprosCore, topic: str, node: str, timeout: float) -> dict[str, str]:
    """Return the connection header with which a node publishes a topic; waits for it.

    Args:
        core: The asking node.
        topic: Absolute topic name.
        node: The publishing node's full name.
        timeout: Seconds that each of its answers may take.

    Raises:
        MasterError: The node is unknown, or does not publish the topic.
        ConnectionLostError: It does not answer, or refuses.
    """
    uri = str(core.master.call("lookupNode", node, timeout=timeout))
    failures = []
    for address in publisher_addresses(core.name.full, uri, topic, timeout):
        header, failure = _request_header(core, topic, address, timeout)
        if header.get("md5sum", ANY) != ANY:
            return header
        failures.append(failure or "its connection header has no md5sum")
    reason = "; ".join(failures) or "it has no address"
    raise ConnectionLostError(f"{node} does not say what it publishes on {topic}: {reason}")


def _request_header(
    core: TcprosCore, topic: str, address: tuple[str, int], timeout: float
) -> tuple[dict[str, str], str]:
    """Connect to a publisher for its header only; return it, or an empty one and the reason."""
    answer: Future[tuple[dict[str, str], str]] = Future()
    links: list[Connection] = []

    def finish(header: dict[str, str], reason: str) -> None:
        if not answer.done():
            answer.set_result((header, reason and f"{address[0]}:{address[1]}: {reason}"))
        for link in links:
            link.end("")

    def dial() -> None:
        try:
            links.append(
                Connection.dial(
                    core.loop,
                    address,
                    subscriber_header(core.name.full, topic),
                    lambda header: finish(header, ""),
                    lambda _data, _lead: None,
                    lambda reason: finish({}, reason),
                )
            )
        except OSError as error:  # no more sockets
            finish({}, reason_of(error))

    core.loop.call(dial)
    try:
        return answer.result(timeout)
    except FutureTimeoutError:
        core.loop.call(lambda: finish({}, ""))
        return {}, f"{address[0]}:{address[1]}: no answer in time"

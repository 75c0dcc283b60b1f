"""A topic that a node subscribes to: one registration, and the publishers' connections.

ROS 1 negotiates types for each connection: a publisher tells type, md5 sum, definition and whether
it latches in the header with which it answers a subscriber's. Where it is reached, its API tells.

Protocol: ROS wiki, "ROS/Slave_API" (requestTopic) and "ROS/TCPROS".
"""

from __future__ import annotations

import logging
import socket
import struct
import time
from itertools import repeat
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, NodeName, Sample
from rosglass.comm.subscription import Problem, TopicMatching
from rosglass.errors import (
    ConnectionLostError,
    ConversionError,
    DecodeError,
    DefinitionError,
    InvalidNameError,
    MasterError,
    TypeNotFoundError,
)
from rosglass.interfaces import join_name, ros1_name
from rosglass.interfaces.counterparts import RENAMED
from rosglass.wires.base import Reader
from rosglass.wires.tcpros.connection import (
    ANY,
    MAX_HEADER,
    Connection,
    encode_header,
    parse_header,
)
from rosglass.wires.tcpros.graph import split
from rosglass.wires.tcpros.master import call_node, reason_of
from rosglass.wires.tcpros.publication import definition_text
from rosglass.wires.tcpros.registrations import Member

__all__ = [
    "PublisherLink",
    "Silence",
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
    from rosglass.messages import MessageType, OpaqueType
    from rosglass.wires.tcpros.core import BlockingPool, TcprosCore
    from rosglass.wires.tcpros.io_loop import IoLoop
    from rosglass.wires.tcpros.master import Master
    from rosglass.wires.tcpros.topics import Topics

    Received = bytes | memoryview


_log = logging.getLogger("rosglass.ros1")
#: How long a connection lasts that does not end although the master names its publisher no more.
_LAST_MESSAGES_S = 1.0


class TopicSubscription(Member):
    """A topic that the node subscribes to, shared by its subscriptions of that topic.

    Args:
        core: The node.
        topics: The node's topics.
        topic: Absolute topic name.
        type_name: For the master, ``pkg/Type``; ``*`` for any.

    Attributes:
        readers: One for each subscription; replaced, never changed: the loop's thread goes through
            them for each message. :meth:`join` and :meth:`leave` are called under the topics' lock.
        eager: Whether messages are waited for.
    """

    def __init__(self, core: TcprosCore, topics: Topics, topic: str, type_name: str) -> None:
        self.core, self.topic = core, topic
        self.type_name = type_name
        self.readers: tuple[TypeNegotiation, ...] = ()
        self.eager = True
        self._topics = topics
        #: By URI; changed in the loop's thread only.
        self._links: dict[str, PublisherLink] = {}
        self._closed = False
        #: Which master knows it, counted from 0, and how often one has named publishers.
        self._epoch, self._updates = -1, 0

    def links(self) -> list[PublisherLink]:
        """Return the publishers, from any thread."""
        return list(self._links.values())

    # -- subscriptions ---------------------------------------------------------------------------

    def join(self, reader: TypeNegotiation) -> None:
        """Hand on messages to a subscription, latched ones first; from any thread."""
        self.readers = (*self.readers, reader)
        self.core.loop.call(lambda: self._join(reader))

    def _join(self, reader: TypeNegotiation) -> None:
        for link in self.links():
            # One that connected since the reader joined negotiates with it already.
            if link.connected and reader not in link.readers:
                link.readers = (*link.readers, reader)
                reader.negotiate_type(link, lambda link=link: self._catch_up(reader, link))  # type: ignore[misc]
        self.attend()

    def _catch_up(self, reader: TypeNegotiation, link: PublisherLink) -> None:
        """Hand on what a connection of the subscription's own would have brought."""
        if link.is_local:
            for data in self._topics.latched(self.topic):
                reader.take(link, [data], time.time_ns())
        elif link.latched is not None:
            reader.take(link, [link.latched], time.time_ns())
        reader.feed.request_update()

    def leave(self, reader: TypeNegotiation) -> bool:
        """Hand on nothing more to a subscription; return whether it was the last one."""
        self.readers = tuple(one for one in self.readers if one is not reader)
        return not self.readers

    def attend(self) -> None:
        """Hand on messages as they come only while they are waited for; from any thread."""
        eager = any(reader.eager for reader in self.readers)
        if eager != self.eager:
            self.eager = eager
            self.core.loop.call(self._attend)

    def _attend(self) -> None:
        for link in self.links():
            link.attend(self.eager)

    def drain(self) -> None:
        """Hand on what waits in the sockets; from any thread."""
        for link in self.links():
            link.drain()

    # -- publishers, in the loop's thread --------------------------------------------------------

    def inform(self) -> None:
        """Let the subscriptions' feeds look soon; from any thread."""
        for reader in self.readers:
            reader.feed.request_update()

    def on_publisher_connected(self, link: PublisherLink) -> None:
        """Negotiate the type with every subscription, then resume reading."""
        link.readers = readers = self.readers
        left = len(readers) + 1

        def decided() -> None:
            nonlocal left
            left -= 1
            if not left:
                link.resume()
                link.attend(self.eager)
                self.inform()

        for reader in readers:
            reader.negotiate_type(link, decided)
        decided()

    def on_publisher_disconnected(self, link: PublisherLink) -> None:
        """Let the subscriptions forget a publisher."""
        _log.debug("%s: %s", self.topic, link.problem)
        for reader in self.readers:
            reader.on_publisher_disconnected(link)
        if link.epoch != self._epoch:
            # No master knows it any more: it was kept as long as it sent something.
            self._forget(link)
        self.inform()

    def on_publishers_changed(self, uris: list[str]) -> None:
        """Connect with new publishers, and forget those that have gone; from any thread."""
        self._updates += 1
        self.core.loop.call(lambda: self._take_publishers(uris))

    def _take_answer(self, uris: list[str], updates: int) -> None:
        # What the master told meanwhile, because it knows us now, is newer than its answer.
        if updates == self._updates:
            self._take_publishers(uris)

    def _take_publishers(self, uris: list[str]) -> None:
        if self._closed:
            return
        for uri in self._links.keys() - set(uris):
            link = self._links[uri]
            if not link.connected:
                self._forget(link)
            elif link.epoch == self._epoch:
                self._await_end(link)
            # A master that was restarted knows but those who told it: others go on publishing.
        for uri in uris:
            known = self._links.get(uri)
            if known is None:
                self._links[uri] = PublisherLink(self, uri, self._epoch)
            else:
                known.epoch = self._epoch
        self.inform()

    def _await_end(self, link: PublisherLink) -> None:
        """Let a publisher's last messages come, and the master's newer word of it."""
        link.epoch = left = -2 - self._updates  # until the master names it again

        def forget() -> None:
            if link.epoch == left and not link.ended:
                self._forget(link)

        self.core.loop.after(_LAST_MESSAGES_S, forget)

    def _forget(self, link: PublisherLink) -> None:
        self._links.pop(link.uri, None)
        link.end()
        for reader in self.readers:
            reader.on_publisher_disconnected(link)

    # -- as a member -----------------------------------------------------------------------------

    @property
    def place(self) -> tuple[EndpointKind, str]:  # type: ignore[override]
        """As what the master shows it."""
        return EndpointKind.SUBSCRIPTION, self.topic

    def lacks(self, publishers: int) -> bool:
        """Return whether fewer publishers are connected."""
        return sum(link.connected for link in self.links()) < publishers

    def register(self, master: Master) -> None:
        """Tell the master, and connect with the publishers it names."""
        self._epoch += 1
        updates = self._updates
        uris = list(master.call("registerSubscriber", self.topic, self.type_name, self.core.uri))
        self.core.loop.call(lambda: self._take_answer(uris, updates))

    def unregister(self, master: Master) -> Member | None:
        """Tell the master that it is subscribed here no more, unless it is again."""
        heir = self._topics.subscribed().get(self.topic)
        if self.core.closed or heir is None:
            master.call("unregisterSubscriber", self.topic, self.core.uri)
            return None
        return heir

    def follow(self, moved: bool, idle: bool) -> None:
        """Let the subscriptions tell what has changed."""
        for link in self.links():
            link.listen()
        for reader in self.readers:
            reader.feed.follow(moved, idle)
        if idle:
            # The rate of what comes may be another one now.
            self.core.loop.call(self._attend)

    def close(self) -> None:
        """End the subscriptions and the connections; safe to call twice, also at once."""
        if self._closed:
            return
        self._closed = True
        for reader in self.readers:
            reader.feed.close()
        self.core.loop.call(self._end)
        self.core.remove(self)

    def _end(self) -> None:
        for link in self.links():
            link.end()
        self._links.clear()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.topic}>"


_PUBLISHER = EndpointKind.PUBLISHER


class TypeNegotiation(TopicMatching, Reader):
    """Finds out which publishers of a topic a subscription understands, and hands on theirs.

    Args:
        core: The node it belongs to.
        topic: The node's connections for the topic.
        type_name: The type that is asked for when there is no definition of it here.
        ignore_local: Whether to leave out what this node publishes itself.
        on_close: Called once when the subscription is closed.

    Attributes:
        feed: The subscription's feed.
        topic: As given.
        eager: Whether messages are handed on as they come.
    """

    #: What comes needs no master.
    outlives_discovery = True
    feed: SubscriptionFeed

    def __init__(
        self,
        core: TcprosCore,
        topic: TopicSubscription,
        type_name: str,
        ignore_local: bool,
        on_close: Callable[[TypeNegotiation], None],
    ) -> None:
        self.topic, self.eager = topic, True
        self._core, self._on_close = core, on_close
        self._ignore_local = ignore_local
        #: The type of each publisher that is understood, and what is wrong with the others.
        self._accepted: dict[PublisherLink, tuple[MessageType, bytes]] = {}
        self._refused: dict[PublisherLink, str] = {}
        self._remarks: dict[PublisherLink, str] = {}
        self._fixed: MessageType | None = None
        self._name = join_name(type_name) if type_name else ""
        self._closed = False

    # -- in the loop's thread --------------------------------------------------------------------

    def negotiate_type(self, link: PublisherLink, decided: Callable[[], None]) -> None:
        """Find out whether a publisher's messages are understood, then call `decided`."""
        if self._ignore_local and link.is_local:
            decided()
            return
        header = link.header
        md5, full = header.get("md5sum", ""), _full_name(header.get("type", ""))
        wanted = self._fixed
        if wanted is not None and self._agrees(wanted, full, md5) and wanted.md5:
            self._accepted[link] = (wanted, link.name.encode())
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
                f"{link.name} publishes {self.topic.topic} as {full}, asked for was "
                f"{self._name}: nothing is received from it"
            )
            decided()
        else:
            # Definitions may be long, and files may have to be looked through for them.
            self._core.pool.run(lambda: self._learn(link, header, decided))

    def _agrees(self, wanted: MessageType, full: str, md5: str) -> bool:
        # tf's old message is tf2's under another name; roscpp, too, asks for nothing but the sum.
        same = full in ("", wanted.name) or (
            RENAMED.get(full) == wanted.name and md5 == wanted.md5 != ""
        )
        return same and (md5 in (ANY, wanted.md5) or not wanted.md5)

    def _learn(
        self, link: PublisherLink, header: dict[str, str], decided: Callable[[], None]
    ) -> None:
        """Find the type that a publisher describes; on a thread that may wait."""
        name, md5 = header["type"], header["md5sum"]
        text = header.get("message_definition", "")
        kind: MessageType | None = None
        reason = ""
        try:
            kind = self._core.types.learn(name, md5, text)
        except (TypeNotFoundError, DefinitionError, InvalidNameError) as error:
            reason = str(error)
            if not self.feed.decodes:
                kind = _opaque(name, md5, text, reason)

        def take() -> None:
            if link.header is header:  # still the same connection
                self._take_type(link, kind, reason)
            decided()

        self._core.loop.call(take)

    def _take_type(self, link: PublisherLink, kind: MessageType | None, reason: str) -> None:
        current = self.feed.type
        if kind is None:
            self._refused[link] = reason
            return
        if self._fixed is None and (current is None or not self._accepted):
            self.feed.set_type(kind)
        elif self._fixed is None and current is not None and kind.name != current.name:
            self._refused[link] = (
                f"{link.name} publishes {self.topic.topic} as {kind.name}, others as "
                f"{current.name}: nothing is received from it; choose one, e.g. "
                f"create_subscription({self.topic.topic!r}, {ros1_name(kind.name)!r})"
            )
            return
        if reason:
            self._remarks[link] = f"{reason}: its messages are received as bytes"
        self._accepted[link] = (kind, link.name.encode())

    def on_publisher_disconnected(self, link: PublisherLink) -> None:
        """Forget a publisher, which is not connected any more."""
        accepted = self._accepted.pop(link, None)
        for known in (self._refused, self._remarks):
            known.pop(link, None)
        if accepted is not None:
            self.feed.on_publisher_left(self._endpoint(link, *accepted))

    def take(
        self, link: PublisherLink, frames: Sequence[bytes | memoryview], received: int
    ) -> None:
        """Hand on messages; from the loop's thread, or one that asks for messages."""
        known = self._accepted.get(link)
        if known is not None:
            kind, who = known
            # As Sample(...) does, in a third of the time.
            make = tuple.__new__
            if len(frames) == 1:
                sample = make(Sample, (frames[0], "ros1", kind, received, None, who, -1))
                self.feed.deliver(sample)
                return
            given = zip(
                frames,
                repeat("ros1"),
                repeat(kind),
                repeat(received),
                repeat(None),
                repeat(who),
                repeat(-1),
                strict=False,
            )
            self.feed.deliver_many(list(map(make, repeat(Sample), given)))

    # -- as a reader -----------------------------------------------------------------------------

    def set_eager(self, eager: bool) -> None:
        """Say whether messages are handed on as they come; from any thread."""
        self.eager = eager
        self.topic.attend()

    def flush(self) -> None:
        """Hand on what waits in the sockets; from any thread."""
        if not self.topic.eager and not self._core.forked:
            self.topic.drain()

    def close(self) -> None:
        """Stop receiving; safe to call twice."""
        if not self._closed:
            self._closed = True
            self._on_close(self)

    # -- as the subscription's feed asks ---------------------------------------------------------

    def open(
        self,
        feed: SubscriptionFeed,
        publishers: Sequence[EndpointInfo],  # noqa: ARG002 - they offer no profile
    ) -> None:
        """Decide on the profile, and receive from those that are connected already."""
        self.feed, self.reader, self._fixed = feed, self, feed.type
        feed.set_qos(feed.qos.for_subscription([]))
        self.topic.join(self)

    def update(
        self,
        publishers: Sequence[EndpointInfo],  # noqa: ARG002 - connections tell
        idle: bool,  # noqa: ARG002 - links change by themselves
    ) -> list[Problem]:
        """Return what is wrong with the connections, and with what comes over them."""
        links = self.topic.links()
        # Those that cannot be reached are logged once for all that they publish.
        lost = [Problem(link.problem, logging.INFO, link.lost) for link in links if link.problem]
        faults = [*self._refused.copy().values(), *self._remarks.copy().values()]
        silence = [link.silence for link in links if link.silence and link in self._accepted]
        return [
            *lost,
            *(Problem(fault) for fault in faults),
            *(Problem(text, logging.INFO) for text in silence),
        ]

    def find_matching(
        self,
        publishers: Sequence[EndpointInfo],  # noqa: ARG002 - the master may not know them yet
    ) -> list[EndpointInfo]:
        """Return the publishers that are connected and understood."""
        return [self._endpoint(link, *accepted) for link, accepted in self._accepted.copy().items()]

    def _endpoint(self, link: PublisherLink, kind: MessageType, gid: bytes) -> EndpointInfo:
        return EndpointInfo(
            _PUBLISHER,
            self.topic.topic,
            kind.name,
            NodeName(*split(link.name)),
            type_hash=link.header.get("md5sum", kind.md5),
            gid=gid,
        )

    def _mismatch(self, link: PublisherLink, wanted: MessageType) -> str:
        header = link.header
        theirs = header.get("message_definition", "").strip() or "(it sends no definition)"
        return (
            f"{link.name} publishes {self.topic.topic} as {header.get('type')} with md5 "
            f"{header.get('md5sum')}, asked for was {ros1_name(wanted.name)} with md5 "
            f"{wanted.md5}: nothing is received from it; subscribe without a type to take what it "
            f"sends, or add its definition to the library. Theirs:\n{theirs}\nOurs:\n"
            f"{definition_text(self._core.types, wanted).strip()}"
        )


def _opaque(name: str, md5: str, text: str, reason: str) -> OpaqueType | None:
    """Return a type that is only passed on; None when that is no name or no sum of a type."""
    from rosglass.messages import OpaqueType  # noqa: PLC0415 - numpy

    try:
        return OpaqueType(name, md5, reason, text=text, ros=1)
    except InvalidNameError:
        return None


def _full_name(name: str) -> str:
    """Return a type's full name; empty when the header does not tell it."""
    if name in ("", ANY):
        return ""
    try:
        return join_name(name)
    except InvalidNameError:
        return name


#: Seconds between attempts to reach a publisher, the first and the longest.
_RETRY_S, _MAX_RETRY_S = 0.5, 5.0
#: Bytes per second up to which what nobody waits for may lie in the socket for a tenth of a second.
_IDLE_BYTES_PER_S = 256 * 1024
#: Shortest time in seconds over which that is measured.
_RATE_WINDOW_S = 0.5
#: Messages that are handed on at once: their memory stays in the processor's cache, and so few
#: objects come into being before others go that Python does not look for garbage among them.
_BATCH = 128
#: Messages of a flood that wait for callbacks when reading makes way for those, and for how many
#: seconds. Python's threads take turns: without that, what is read piles up.
_MAX_BEHIND, _PAUSE_S = 4096, 0.001
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
        readers: The readers with which the type is negotiated on this connection.
    """

    def __init__(self, subscription: TopicSubscription, uri: str, epoch: int) -> None:
        self.subscription, self.topic, self.epoch = subscription, subscription.topic, epoch
        self.uri = self.name = uri
        self.header: dict[str, str] = {}
        self.problem, self.lost = "", False
        self.latched: Received | None = None
        self.ended = False
        self.readers: tuple[TypeNegotiation, ...] = ()
        self._core = subscription.core
        self._connection: Connection | None = None
        self._addresses: list[tuple[str, int]] = []
        self._latches = False
        self._silence, self._count = Silence(), 0
        self._delay = _RETRY_S
        self._measured_at, self._measured, self._rate = time.monotonic(), 0, 0.0
        self._begin()

    @property
    def connected(self) -> bool:
        """Whether messages can come."""
        return bool(self.header)

    @property
    def is_local(self) -> bool:
        """Whether the publisher is the node itself, at its address or one that it had before."""
        return self.uri in self._core.uris

    @property
    def silence(self) -> str:
        """What is strange about nothing coming from it; empty when nothing is."""
        return self._silence.problem

    def listen(self) -> None:
        """Look whether it has fallen silent; on the node's own thread."""
        # Latched messages come once; and what this node sends is missed by nobody.
        if self.connected and not self._latches and not self.is_local:
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
        if now - self._measured_at >= _RATE_WINDOW_S:
            came = connection.received - self._measured
            self._rate = came / (now - self._measured_at)
            self._measured_at, self._measured = now, connection.received
        connection.hurry(eager or not self.header or self._rate > _IDLE_BYTES_PER_S)

    def drain(self) -> None:
        """Hand on what waits in the socket; from any thread."""
        connection = self._connection
        if connection is not None:
            connection.drain()

    # -- connecting ------------------------------------------------------------------------------

    def _begin(self) -> None:
        if not self.ended and not self._core.closed:
            self._core.pool.run(self._ask)

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
        self.header, self.problem, self._delay, self._addresses = header, "", _RETRY_S, []
        self.name = header.get("callerid", "") or self.uri
        self._latches = header.get("latching") == "1"
        self._silence, self._count = Silence(), 0
        self._measured_at, self._measured, self._rate = time.monotonic(), 0, 0.0
        self._core.unreachable.on_publisher_connected(self)
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
        if behind > _MAX_BEHIND and connection is not None:
            connection.pause(reading=False)
            self._core.loop.after(_PAUSE_S, lambda: connection.pause(reading=True))

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
            self._core.unreachable.on_publisher_failed(self)
        self.subscription.on_publisher_disconnected(self)
        if not self.ended:
            self._core.loop.after(self._delay, self._begin)
            self._delay = min(_MAX_RETRY_S, 2 * self._delay)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}>"


def _ignore(_data: Received, _first: int) -> None:
    """Take a message by itself: nobody is asked to, they are taken together."""


#: Seconds in which the topics of a publisher are gathered: each has a connection of its own.
_GATHER_S = 1.0
#: Topics that a line names, and publishers' topics that are remembered as told of.
_MAX_NAMED, _MAX_REMEMBERED = 12, 1000


class UnreachableLog:
    """Writes to the log which publishers cannot be reached, and when they are back.

    All but the writing happens in the loop's thread.

    Args:
        loop: Runs what happens later.
        pool: Where the log is written: its handlers may take their time.
    """

    def __init__(self, loop: IoLoop, pool: BlockingPool) -> None:
        self._loop, self._pool = loop, pool
        self._failed: set[PublisherLink] = set()
        self._back: set[PublisherLink] = set()
        #: Publisher and topic -> the problem that was told.
        self._logged: dict[tuple[str, str], str] = {}
        self._gathering = False

    def on_publisher_failed(self, link: PublisherLink) -> None:
        """Tell soon of a publisher that cannot be reached, unless it can be by then."""
        self._failed.add(link)
        self._gather()

    def on_publisher_connected(self, link: PublisherLink) -> None:
        """Tell soon of a publisher that was out of reach, and is connected now."""
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
        # Being back is no mistake of anybody's, but who has seen the warning must see its end.
        _log.warning("%s: %s", _listed(topics), line)


def _listed(topics: Iterable[str]) -> str:
    names = sorted(topics)
    more = len(names) - _MAX_NAMED
    return ", ".join(names[:_MAX_NAMED]) + (f" and {more} more topics" if more > 0 else "")


_CHUNK_BYTES = 64 * 1024
_length = struct.Struct("<I")


def subscriber_header(caller: str, topic: str) -> dict[str, str]:
    """Return the connection header of somebody who takes whatever type a topic has."""
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
    """Ask a publisher's API where to connect; waits for the answer and for the name service.

    Args:
        caller: The asking node's full name.
        uri: The publisher's API.
        topic: Absolute topic name.
        timeout: Seconds that the publisher may take.

    Returns:
        Resolved addresses and ports.

    Raises:
        MasterError: It does not publish the topic, or offers no TCPROS.
        ConnectionLostError: It does not answer, or names a host that is not known here.
    """
    answer = call_node(uri, "requestTopic", caller, topic, [["TCPROS"]], timeout=timeout)
    place = f"{uri} for {topic}"
    if not (isinstance(answer, (list, tuple)) and len(answer) >= 3 and answer[0] == "TCPROS"):
        raise MasterError(f"{place} offers no TCPROS, but {answer!r:.80}")
    host, port = str(answer[1]), answer[2]
    if type(port) is not int or not 0 < port < 65536:
        raise ConnectionLostError(f"{place} says to connect to port {port!r:.80}")
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise ConnectionLostError(
            f"{place} says to connect to {host}:{port}, but {reason_of(error)}"
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
        MasterError: It is not known, or does not publish the topic.
        ConnectionLostError: It does not answer, or refuses.
    """
    caller = core.name.full
    uri = str(core.master.call("lookupNode", node, timeout=timeout))
    failures = []
    for address in publisher_addresses(caller, uri, topic, timeout):
        header, failure = _try_address(address, subscriber_header(caller, topic), timeout)
        if "error" in header:
            raise ConnectionLostError(f"{node} refuses {topic}: {header['error']:.200}")
        if header.get("md5sum", ANY) != ANY:
            return header
        failures.append(failure or "its connection header has no md5sum")
    told = "; ".join(failures) or "it has no address"
    raise ConnectionLostError(f"{node} does not tell what it publishes on {topic}: {told}")


def _try_address(
    address: tuple[str, int], header: dict[str, str], timeout: float
) -> tuple[dict[str, str], str]:
    """Return the other end's header, or none and why."""
    try:
        return _exchange(address, header, timeout), ""
    except OSError as error:
        return {}, f"{address[0]}:{address[1]}: {reason_of(error)}"
    except DecodeError as error:
        return {}, str(error)


def _exchange(address: tuple[str, int], header: dict[str, str], timeout: float) -> dict[str, str]:
    """Connect, send a header, and return the other end's; raises OSError and DecodeError."""
    deadline = time.monotonic() + timeout
    with socket.create_connection(address, timeout) as sock:
        sock.sendall(encode_header(header))
        (size,) = _length.unpack(_receive(sock, _length.size, deadline))
        if size > MAX_HEADER:
            raise DecodeError("connection header", f"{size} bytes are more than any has")
        return parse_header(_receive(sock, size, deadline))


def _receive(sock: socket.socket, size: int, deadline: float) -> bytes:
    data = bytearray()
    while len(data) < size:
        sock.settimeout(max(0.001, deadline - time.monotonic()))
        part = sock.recv(min(size - len(data), _CHUNK_BYTES))
        if not part:
            raise ConnectionResetError("the other end closed the connection")
        data += part
    return bytes(data)


#: Seconds between two looks that count.
_LOOK = 0.9
#: So many looks in a row at which about as much had come make somebody regular.
_LOOKS = 10
#: Silence is strange after so many of the usual intervals, and after so many seconds.
_INTERVALS, _SECONDS = 5, 1.0


class Silence:
    """Follows how regularly somebody sends, about once a second; costs what is sent nothing.

    Who sends less than once a second, or now more and now less, is never missed.

    Attributes:
        problem: What is strange about the silence, in words; empty as long as nothing is.
    """

    def __init__(self) -> None:
        self.problem = ""
        self._looked = self._came = 0.0
        self._count = self._regular = 0
        self._rate = 0.0
        #: What had come at the last look, and in how many seconds: judged only when more comes, as
        #: the last messages before a silence fill but a part of the time.
        self._newest = (0, 0.0)

    def follow(self, name: str, count: int, now: float) -> None:
        """Take note of how much has come.

        Args:
            name: Who sends it.
            count: How many messages have come in all.
            now: The time, by :func:`time.monotonic`.
        """
        passed = now - self._looked
        if count > self._count and self.problem:
            self.problem, self._regular, self._newest = "", 0, (0, 0.0)
        elif passed < _LOOK:
            return
        elif count > self._count:
            self._judge(*self._newest)
            self._newest = (count - self._count, passed)
        elif self._regular < _LOOKS:
            self._regular, self._newest = 0, (0, 0.0)
        elif not self.problem and now - self._came >= max(_SECONDS, _INTERVALS / self._rate):
            # No age: the text would be another one, and told again, every second.
            since = time.strftime("%H:%M:%S", time.localtime(time.time() - (now - self._came)))
            self.problem = (
                f"nothing has come from {name} since {since} (it sent {self._rate:.0f} per second "
                "before); is it frozen, or cut off?"
            )
        if count > self._count:
            self._came = now
        self._looked, self._count = now, count

    def _judge(self, came: int, passed: float) -> None:
        """Take note of what came between two looks."""
        if not came:
            return
        usual = self._rate * passed
        if self._regular and not usual / 2 - 1 <= came <= 2 * usual + 1:
            self._regular = 0
        rate = came / passed
        self._rate = rate if not self._regular else 0.7 * self._rate + 0.3 * rate
        self._regular += 1

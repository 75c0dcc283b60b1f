"""Type negotiation of ROS 1: each connection's header says what its publisher sends."""

from __future__ import annotations

import logging
from itertools import repeat
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, NodeName, Sample
from rosglass.comm.subscription_feed import Problem, TopicMatching
from rosglass.errors import DefinitionError, InvalidNameError, TypeNotFoundError
from rosglass.interfaces import join_name, ros1_name
from rosglass.interfaces.counterparts import RENAMED
from rosglass.ros1.definitions import definition_text, opaque
from rosglass.ros1.names import split
from rosglass.ros1.types import ANY
from rosglass.wires.base import Reader

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.subscription_feed import SubscriptionFeed
    from rosglass.messages import MessageType
    from rosglass.ros1.core import Core
    from rosglass.ros1.publisher_link import PublisherLink
    from rosglass.ros1.topic_subscription import TopicSubscription

__all__ = ["TypeNegotiation"]

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
        core: Core,
        topic: TopicSubscription,
        type_name: str,
        ignore_local: bool,
        on_close: Callable[[TypeNegotiation], None],
    ) -> None:
        self.topic, self.eager = topic, True
        self._core, self._on_close = core, on_close
        self._ignored = core.uri if ignore_local else ""
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
        if self._ignored and link.uri == self._ignored:
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
            self._core.errands.run(lambda: self._learn(link, header, decided))

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
                kind = opaque(name, md5, text, reason)

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


def _full_name(name: str) -> str:
    """Return a type's full name; empty when the header does not tell it."""
    if name in ("", ANY):
        return ""
    try:
        return join_name(name)
    except InvalidNameError:
        return name

"""Keeping one subscription fed: its type, and what stands in the way of its messages."""

from __future__ import annotations

import logging
from itertools import repeat
from typing import TYPE_CHECKING

from rosglass.comm import (
    DeadlineMissed,
    EndpointInfo,
    EndpointKind,
    Matched,
    NodeName,
    Sample,
    Source,
)
from rosglass.comm.absence import Absence
from rosglass.comm.similar import similar
from rosglass.comm.watchdog import Watchdog
from rosglass.errors import DefinitionError, InvalidNameError, TypeNotFoundError
from rosglass.interfaces import join_name, ros1_name
from rosglass.interfaces.counterparts import RENAMED
from rosglass.ros1.definitions import definition_text, opaque
from rosglass.ros1.names import split
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import Subscription
    from rosglass.messages import MessageType
    from rosglass.ros1.core import Core
    from rosglass.ros1.intake import Intake
    from rosglass.ros1.publisher_link import PublisherLink

__all__ = ["Reading", "type_if_known"]

_PUBLISHER = EndpointKind.PUBLISHER


def type_if_known(core: Core, topic: str, wanted: MessageType | str | None) -> MessageType | None:
    """Return the type that a subscription was asked for; None when publishers have to tell it.

    Raises:
        TypeNotFoundError: Nobody has a definition, and nobody is seen to publish that type.
        UnsupportedError: It is ROS 2's.
    """
    if wanted is None:
        return None
    try:
        return core.types.message(wanted)
    except TypeNotFoundError:
        if isinstance(wanted, str) and core.graph.type_of(topic) == join_name(wanted):
            return None
        raise


class Reading(Source):
    """Serves a subscription from its creation to its end.

    Args:
        core: The node it belongs to.
        intake: The node's connections for the topic.
        subscription: Whom to serve.
        type_name: The type that is asked for when nobody here has its definition.
        ignore_local: Whether to leave out what this node publishes itself.
        on_close: Called once when the subscription is closed.

    Attributes:
        subscription: As given.
        intake: As given.
    """

    def __init__(
        self,
        core: Core,
        intake: Intake,
        subscription: Subscription,
        type_name: str,
        ignore_local: bool,
        on_close: Callable[[Reading], None],
    ) -> None:
        self.subscription = subscription
        self.intake = intake
        self._core, self._on_close = core, on_close
        self._ignored = core.uri if ignore_local else ""
        #: The type of each publisher that is understood, and what is wrong with the others.
        self._accepted: dict[PublisherLink, tuple[MessageType, bytes]] = {}
        self._refused: dict[PublisherLink, str] = {}
        self._remarks: dict[PublisherLink, str] = {}
        self._fixed = subscription.type
        self._name = join_name(type_name) if type_name else ""
        self._absence = Absence(core.name, core.status)
        self._deadline: Watchdog | None = None
        self._missed = 0
        self._closed = False
        subscription.source, subscription.on_close = self, self.close
        subscription.set_qos(subscription.qos.for_subscription([]))

    # -- in the loop's thread --------------------------------------------------------------------

    def meet(self, link: PublisherLink, decided: Callable[[], None]) -> None:
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
                f"{link.name} does not say what it publishes on {self.intake.topic}: "
                f"{' and '.join(missing)} missing in its connection header; give the type when "
                "subscribing"
            )
            decided()
        elif wanted is not None and not self._agrees(wanted, full, md5):
            self._refused[link] = self._mismatch(link, wanted)
            decided()
        elif self._name and full != self._name:
            self._refused[link] = (
                f"{link.name} publishes {self.intake.topic} as {full}, asked for was "
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
            if not self.subscription.decodes:
                kind = opaque(name, md5, text, reason)

        def take() -> None:
            if link.header is header:  # still the same connection
                self._take_type(link, kind, reason)
            decided()

        self._core.loop.call(take)

    def _take_type(self, link: PublisherLink, kind: MessageType | None, reason: str) -> None:
        current = self.subscription.type
        if kind is None:
            self._refused[link] = reason
            return
        if self._fixed is None and (current is None or not self._accepted):
            self.subscription.set_type(kind)
        elif self._fixed is None and current is not None and kind.name != current.name:
            self._refused[link] = (
                f"{link.name} publishes {self.intake.topic} as {kind.name}, others as "
                f"{current.name}: nothing is received from it; choose one, e.g. "
                f"create_subscription({self.intake.topic!r}, {ros1_name(kind.name)!r})"
            )
            return
        if reason:
            self._remarks[link] = f"{reason}: its messages are received as bytes"
        self._accepted[link] = (kind, link.name.encode())

    def part(self, link: PublisherLink) -> None:
        """Forget a publisher, which is not connected any more."""
        for known in (self._accepted, self._refused, self._remarks):
            known.pop(link, None)

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
                self.subscription.deliver(sample)
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
            self.subscription.deliver_many(list(map(make, repeat(Sample), given)))

    # -- what the subscription asks --------------------------------------------------------------

    def publisher_count(self) -> int:
        """Return how many publishers are connected and understood."""
        return len(self._accepted)

    def hint(self) -> str:
        """Say what may be wrong when nobody publishes the topic; empty when somebody does."""
        topic, graph = self.intake.topic, self._core.graph
        if self._accepted or graph.endpoints(_PUBLISHER, topic):
            return ""
        published = [name for name in graph.topics() if graph.endpoints(_PUBLISHER, name)]
        return f"nobody publishes {topic}{similar(topic, published)}"

    def attend(self) -> None:
        """Have messages handed on as they come while somebody waits for them."""
        self.intake.attend()

    def refresh(self) -> None:
        """Have handed on what waits in the sockets."""
        if not self.intake.eager and not self._core.forked:
            self.intake.drain()

    def inform(self) -> None:
        """Look at the subscription soon."""
        self._core.wake()

    # -- on the node's own thread ----------------------------------------------------------------

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - links change by themselves
        """Tell what has changed."""
        if self._closed:
            return
        links = self.intake.links()
        matching = self._matching()
        faults = [*self._refused.copy().values(), *self._remarks.copy().values()]
        silence = [link.silence for link in links if link.silence and link in self._accepted]
        problems = [link.problem for link in links if link.problem] + faults + silence
        # Those that cannot be reached are logged once for all that they publish.
        logged = [link.problem for link in links if link.problem and link.lost] + faults + silence
        there = matching or self._core.graph.endpoints(_PUBLISHER, self.intake.topic)
        absence = self._absence.follow(there)
        # What comes needs no master, and who leaves is no mistake of anybody's.
        absence = [] if matching else absence
        self.subscription.set_problem(
            "; ".join(dict.fromkeys(problems + absence)),
            logging.WARNING if faults else logging.INFO,
            "; ".join(dict.fromkeys(logged + absence)),
        )
        self.subscription.events.matched.update(matching, Matched)
        self._watch_deadline(bool(matching))
        self.intake.attend()
        if self._closed:  # meanwhile, by another thread
            self._watch_deadline(published=False)

    def close(self) -> None:
        """Stop receiving; safe to call twice, as the subscription ends with it and it with that."""
        self.subscription.close()
        if self._closed:
            return
        self._closed = True
        self._watch_deadline(published=False)
        self._on_close(self)

    def _matching(self) -> list[EndpointInfo]:
        return [
            EndpointInfo(
                _PUBLISHER,
                self.intake.topic,
                kind.name,
                NodeName(*split(link.name)),
                type_hash=link.header.get("md5sum", ""),
                gid=gid,
            )
            for link, (kind, gid) in self._accepted.copy().items()
        ]

    def _watch_deadline(self, published: bool) -> None:
        limit = self.subscription.qos.deadline
        listened = published and bool(self.subscription.events.deadline)
        wanted = limit is not None and listened and not self._closed
        if self._deadline is not None and not (wanted and self._deadline.limit == limit):
            self._deadline.close()
            self._deadline = None
        if wanted and self._deadline is None and limit is not None:
            self._deadline = Watchdog(self._core.timers, limit, self._last_arrival, self._miss)

    def _last_arrival(self) -> float:
        self.refresh()
        return self.subscription.last_arrival

    def _miss(self, count: int) -> None:
        self._missed += count
        self.subscription.events.deadline.notify(DeadlineMissed(count, self._missed))

    def _mismatch(self, link: PublisherLink, wanted: MessageType) -> str:
        header = link.header
        theirs = header.get("message_definition", "").strip() or "(it sends no definition)"
        return (
            f"{link.name} publishes {self.intake.topic} as {header.get('type')} with md5 "
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

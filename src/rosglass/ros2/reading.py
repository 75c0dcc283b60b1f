"""Keeping one subscription fed: its type, its reader, and what stands in the way of its samples."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING

from rosglass.comm import (
    DeadlineMissed,
    EndpointInfo,
    EndpointKind,
    LivelinessChanged,
    Matched,
    Sample,
    SamplesLost,
    Source,
)
from rosglass.comm.absence import Absence
from rosglass.comm.matching import conflict_events, conflicts, words
from rosglass.comm.similar import similar
from rosglass.comm.watchdog import Watchdog
from rosglass.errors import Error, NodeClosedError, TypeNotFoundError
from rosglass.ros2.core import Member
from rosglass.ros2.liveliness import Liveness
from rosglass.ros2.repeats import Repeats
from rosglass.ros2.topic_types import TopicTypes

if TYPE_CHECKING:
    from collections.abc import Sequence
    from collections.abc import Set as AbstractSet

    from rosglass.comm import QoS, Subscription
    from rosglass.messages import MessageType
    from rosglass.ros2.core import Core
    from rosglass.wires.base import OnSample, Reader

__all__ = ["Reading", "type_if_known"]

_PUBLISHER = EndpointKind.PUBLISHER


def type_if_known(core: Core, topic: str, wanted: MessageType | str | None) -> MessageType | None:
    """Return the type that a subscription was asked for; None when publishers have to tell it.

    Raises:
        TypeNotFoundError: Nobody has a definition, and nobody is seen to publish that type.
    """
    if wanted is None:
        return None
    try:
        return core.types.message(wanted)
    except TypeNotFoundError:
        publishers = core.graph.endpoints(EndpointKind.PUBLISHER, topic)
        if isinstance(wanted, str) and any(p.type == wanted for p in publishers):
            return None
        raise


class Reading(Member, Source):
    """Serves a subscription from its creation to its end.

    Args:
        core: The node it belongs to.
        subscription: Whom to serve.
        wanted: Type or type name it was created with; None to take what is published.
        ignore_local: Whether to leave out what this node publishes itself.
    """

    def __init__(
        self,
        core: Core,
        subscription: Subscription,
        wanted: MessageType | str | None,
        ignore_local: bool = False,
    ) -> None:
        self.subscription = subscription
        self._core = core
        self._topic, self._wanted = subscription.topic, subscription.qos
        self._ignored: AbstractSet[bytes] = core.local_gids if ignore_local else frozenset()
        self._types = TopicTypes(
            subscription.topic,
            core.types,
            wanted,
            subscription.type,
            not subscription.decodes,
            self.inform,
        )
        self._absence = Absence(core.name, core.status)
        self._repeats = Repeats()
        self._lock = threading.Lock()
        self._attention = threading.Lock()
        self._unattended = False
        self._reader: Reader | None = None
        #: The reader, while nobody waits for its samples.
        self._lazy: Reader | None = None
        self._closed = False
        self._known: list[EndpointInfo] | None = None
        self._alone = True
        self._lost_before = self._told_lost = self._missed = 0
        self._deadline: Watchdog | None = None
        self._liveness = Liveness(core.timers, self._repeats, self.inform)
        subscription.source, subscription.on_close = self, self.close
        subscription.set_qos(self._wanted.for_subscription(self._offers(self._publishers())))
        if self._types.type is not None:
            self._read(self._types.type)
        core.add(self)
        self.inform()

    # -- what the subscription asks --------------------------------------------------------------

    def publisher_count(self) -> int:
        """Return how many publishers match now."""
        return len(self._matching(self._publishers()))

    def hint(self) -> str:
        """Say what may be wrong when nobody publishes the topic; empty when somebody does."""
        if self._publishers():
            return ""
        graph = self._core.graph
        published = [name for name in graph.topics() if graph.endpoints(_PUBLISHER, name)]
        return f"nobody publishes {self._topic}{similar(self._topic, published)}"

    def attend(self) -> None:
        """Let the middleware hand on samples as they come only while somebody waits for them."""
        self._unattended = True
        # Never waits for its turn: handing on may end up in here again. Whoever has it looks again.
        while self._unattended and self._attention.acquire(False):
            try:
                self._unattended = False
                reader, eager = self._reader, self.subscription.watched
                if reader is None or eager == (reader is not self._lazy):
                    continue
                self._lazy = None if eager else reader
                reader.set_eager(eager)
                if eager:
                    reader.flush()
            finally:
                self._attention.release()

    def refresh(self) -> None:
        """Have handed on what the middleware holds back."""
        reader = self._lazy
        if reader is not None:
            reader.flush()

    def inform(self) -> None:
        """Look at the subscription soon."""
        self._known = None
        self._core.wake()

    def lost(self) -> int:
        """Return how many samples were sent and have not arrived."""
        reader = self._reader
        by_reader = 0 if reader is None else reader.lost()
        return self._repeats.lost + self._lost_before + by_reader

    # -- following the graph ---------------------------------------------------------------------

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - types may be added, too
        """Follow the graph; now and then look again for a definition that was not found."""
        if self._closed:
            return
        publishers = self._publishers()
        if publishers == self._known and not idle:
            return  # what changed in the graph is elsewhere
        self._known = publishers
        try:
            self._update(publishers, idle)
        except NodeClosedError:
            raise
        except Error as error:
            self.subscription.set_problem(str(error))
        self._tell(publishers)
        self.attend()
        if idle:
            self._tell_losses()
        if self._closed:  # meanwhile, by another thread
            self._stop_watching()

    def close(self) -> None:
        """Stop receiving."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            reader, self._reader, self._lazy = self._reader, None, None
        self.subscription.close()
        if reader is not None:
            reader.close()
        self._stop_watching()
        self._core.remove(self)

    def _publishers(self) -> list[EndpointInfo]:
        found = self._core.graph.endpoints(_PUBLISHER, self._topic)
        if self._ignored:
            found = [one for one in found if one.gid not in self._ignored]
        return found

    def _update(self, publishers: Sequence[EndpointInfo], idle: bool) -> None:
        absence = self._absence.follow(publishers)
        changed = self._types.follow(publishers, idle)
        ours = self._types.type
        problems = self._types.problems
        if ours is not None:
            profile = self._profile(publishers)
            if changed or profile != self.subscription.qos or self._reader is None:
                self.subscription.set_qos(profile)
                self._read(ours)
            elif idle:
                self._repeats.guarded = False
            problems = problems + self._misfits(publishers)
        # Who leaves is no mistake of anybody's.
        level = logging.WARNING if problems else logging.INFO
        self.subscription.set_problem("; ".join(problems + absence), level)

    def _profile(self, publishers: Sequence[EndpointInfo]) -> QoS:
        """Return the profile to ask for: the one in use, unless it leaves somebody out."""
        current = self.subscription.qos
        if self._wanted.is_decided:
            return current
        offers = self._offers(publishers)
        first, self._alone = self._alone and bool(offers), not offers
        # Once nobody is there any more, whoever comes next may be met with something stronger.
        if offers and (first or any(current.conflicts(offered) for offered in offers)):
            return self._wanted.for_subscription(offers)
        return current

    def _offers(self, publishers: Sequence[EndpointInfo]) -> list[QoS]:
        ours = self._types.type
        return [p.qos for p in publishers if ours is None or p.type == ours.name]

    def _misfits(self, publishers: Sequence[EndpointInfo]) -> list[str]:
        effect = (
            "nothing is received from it"
            if self._core.middleware.matches_qos
            else "it is received without that guarantee"
        )
        qos = self.subscription.qos
        problems = []
        for publisher, found in self._conflicts(publishers).items():
            remedy = "; ask for no more than it offers" if qos.conflicts(publisher.qos) else ""
            problems.append(
                f"quality of service offered by {publisher.node} does not match ({words(found)}): "
                f"{effect}{remedy}"
            )
        return problems

    def _conflicts(self, publishers: Sequence[EndpointInfo]) -> dict[EndpointInfo, dict[str, str]]:
        """Return what those offer too little of that are understood."""
        qos, middleware = self.subscription.qos, self._core.middleware
        found = {
            p: conflicts(middleware, p, qos, p.qos) for p in publishers if self._types.accepts(p)
        }
        return {publisher: told for publisher, told in found.items() if told}

    def _matching(self, publishers: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        understood = [p for p in publishers if self._types.accepts(p)]
        qos, middleware = self.subscription.qos, self._core.middleware
        if not middleware.matches_qos:
            return understood
        return [p for p in understood if not conflicts(middleware, p, qos, p.qos)]

    # -- reading ---------------------------------------------------------------------------------

    def _read(self, message_type: MessageType) -> None:
        """Receive samples of `message_type` from now on, instead of any before."""
        self.subscription.set_type(message_type)
        self._repeats.guarded = self._reader is not None
        endpoint = EndpointInfo(
            EndpointKind.SUBSCRIPTION,
            self._topic,
            message_type.name,
            self._core.name,
            self.subscription.qos,
            message_type.rihs01,
        )
        reader = self._core.middleware.create_reader(endpoint, self._receiver())
        with self._lock:
            old, self._reader = self._reader, reader
            if self._closed:
                self._reader = None
        if old is not None:
            self._lost_before += old.lost()
            old.close()
        if self._reader is None:
            reader.close()
        else:
            self.attend()

    def _receiver(self) -> OnSample:
        """Return what takes the samples; every line of it is paid for by each sample."""
        accepted, meet, ignored = self._types.accepted, self._types.meet, self._ignored
        seen, deliver = self._repeats.seen, self.subscription.deliver
        # As Sample(...) does, in half the time.
        make = tuple.__new__

        def receive(
            data: bytes | memoryview,
            received: int,
            sent: int | None,
            gid: bytes,
            sequence: int,
            hash: str,
        ) -> None:
            kind = accepted.get(hash) or meet(hash)
            if kind is None or seen(gid, sequence, sent) or gid in ignored:
                return
            deliver(make(Sample, (data, "cdr", kind, received, sent, gid, sequence)))

        return receive

    # -- events ----------------------------------------------------------------------------------

    def _tell(self, publishers: Sequence[EndpointInfo]) -> None:
        events = self.subscription.events
        matching = self._matching(publishers)
        events.matched.update(matching, Matched)
        if events.incompatible:
            found = self._conflicts(publishers)
            events.incompatible.update(found, conflict_events(found))
        if events.liveliness:
            alive = self._liveness.follow(matching, self._reader)

            def changed(
                endpoint: EndpointInfo, change: int, count: int, _total: int
            ) -> LivelinessChanged:
                return LivelinessChanged(endpoint, change, count, len(matching) - count)

            events.liveliness.update(alive, changed)
        self._watch_deadline(bool(matching))

    def _watch_deadline(self, published: bool) -> None:
        limit = self.subscription.qos.deadline
        listened = published and bool(self.subscription.events.deadline)
        wanted = limit is not None and listened and not self._closed
        if self._deadline is not None and not (wanted and self._deadline.limit == limit):
            self._deadline.close()
            self._deadline = None
        if wanted and self._deadline is None and limit is not None:
            self._deadline = Watchdog(self._core.timers, limit, self._last_arrival, self._miss)

    def _stop_watching(self) -> None:
        self._watch_deadline(published=False)
        self._liveness.close()

    def _last_arrival(self) -> float:
        self.refresh()
        return self.subscription.last_arrival

    def _miss(self, count: int) -> None:
        self._missed += count
        self.subscription.events.deadline.notify(DeadlineMissed(count, self._missed))

    def _tell_losses(self) -> None:
        events = self.subscription.events
        if not events.lost:
            return
        total = self.lost()
        change, self._told_lost = total - self._told_lost, total
        if change > 0:
            events.lost.notify(SamplesLost(change, total))

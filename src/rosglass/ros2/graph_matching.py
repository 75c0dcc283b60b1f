"""Matching of ROS 2 subscriptions: types and profiles as the graph announces them.

Beside the matching itself: which publishers are alive, and which samples came twice or never.
"""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, Liveliness, Sample
from rosglass.comm.events import conflicts, words
from rosglass.comm.subscription_feed import Problem, TopicMatching
from rosglass.ros2.topic_types import TopicTypes

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from collections.abc import Set as AbstractSet

    from rosglass.comm import Handle, QoS, Timers
    from rosglass.comm.subscription_feed import SubscriptionFeed
    from rosglass.messages import MessageType
    from rosglass.ros2.core import Core
    from rosglass.wires.base import OnSample, Reader

__all__ = ["GraphMatching", "Repeats"]

_PUBLISHER = EndpointKind.PUBLISHER
#: Publishers remembered; more come only from a robot that restarts for days.
_MAX_PUBLISHERS = 1024
#: Gaps in the numbering that are remembered per publisher, in samples.
_MAX_MISSING = 64
_NOBODY = (-3, 0)


class GraphMatching(TopicMatching):
    """Finds the type and the profile that match a topic's publishers, and reads with them.

    Args:
        core: The node it belongs to.
        wanted: Type or type name it was created with; None to take what is published.
        ignored: Identities of publishers that are left out.
    """

    def __init__(
        self,
        core: Core,
        wanted: MessageType | str | None,
        ignored: AbstractSet[bytes],
    ) -> None:
        self._core, self._type, self._ignored = core, wanted, ignored
        self._repeats = Repeats()
        self._lock = threading.Lock()
        self._closed = False
        self._alone = True
        self._lost_before = 0
        self._feed: SubscriptionFeed
        self._types: TopicTypes

    def open(self, feed: SubscriptionFeed, publishers: Sequence[EndpointInfo]) -> None:
        """Decide on the profile, and read as soon as the type is known."""
        self._feed, self._topic, self._wanted = feed, feed.topic, feed.qos
        self._liveness = Liveness(self._core.timers, self._repeats, feed.inform)
        self._types = TopicTypes(
            feed.topic, self._core.types, self._type, feed.type, not feed.decodes, feed.inform
        )
        feed.set_qos(self._wanted.for_subscription(self._offers(publishers)))
        self._core.graph.watch(self._topic, self._on_endpoint_removed)
        if self._types.type is not None:
            self._read(self._types.type)

    def update(self, publishers: Sequence[EndpointInfo], idle: bool) -> list[Problem]:
        """Follow what the publishers announce; return what keeps their samples away."""
        changed = self._types.follow(publishers, idle)
        ours = self._types.type
        problems = self._types.problems
        if ours is not None:
            profile = self._profile(publishers)
            if changed or profile != self._feed.qos or self.reader is None:
                self._feed.set_qos(profile)
                self._read(ours)
            elif idle:
                self._repeats.guarded = False
            problems = problems + self._misfits(publishers)
        return [Problem(text) for text in problems]

    def find_matching(self, publishers: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        """Return the publishers whose type is understood, and whose profile matches."""
        understood = [p for p in publishers if self._types.accepts(p)]
        qos, middleware = self._feed.qos, self._core.middleware
        if not middleware.matches_qos:
            return understood
        return [p for p in understood if not conflicts(middleware, p, qos, p.qos)]

    def find_conflicts(
        self, publishers: Sequence[EndpointInfo]
    ) -> dict[EndpointInfo, dict[str, str]]:
        """Return what those publishers offer too little of whose type is understood."""
        qos, middleware = self._feed.qos, self._core.middleware
        found = {
            p: conflicts(middleware, p, qos, p.qos) for p in publishers if self._types.accepts(p)
        }
        return {publisher: policies for publisher, policies in found.items() if policies}

    def find_alive(self, matching: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        """Return those of the matching publishers that show their liveliness in time."""
        return self._liveness.follow(matching, self.reader)

    def lost(self) -> int:
        """Return how many samples were sent and have not arrived."""
        reader = self.reader
        by_reader = 0 if reader is None else reader.lost()
        return self._repeats.lost + self._lost_before + by_reader

    def close(self) -> None:
        """Stop reading; safe to call twice."""
        with self._lock:
            self._closed = True
            reader, self.reader = self.reader, None
        if reader is not None:
            reader.close()
        self._liveness.close()
        self._core.graph.unwatch(self._topic, self._on_endpoint_removed)

    def _on_endpoint_removed(self, endpoint: EndpointInfo) -> None:
        if endpoint.kind is not _PUBLISHER or endpoint.gid in self._ignored:
            return
        if self.find_matching([endpoint]):
            self._feed.on_publisher_left(endpoint)

    # -- quality of service ----------------------------------------------------------------------

    def _profile(self, publishers: Sequence[EndpointInfo]) -> QoS:
        """Return the profile to ask for: the one in use, unless a publisher does not match it."""
        current = self._feed.qos
        if self._wanted.is_decided:
            return current
        offers = self._offers(publishers)
        first, self._alone = self._alone and bool(offers), not offers
        # Without any publisher left, the next one may be met with a stronger profile.
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
        qos = self._feed.qos
        problems = []
        for publisher, found in self.find_conflicts(publishers).items():
            remedy = "; ask for no more than it offers" if qos.conflicts(publisher.qos) else ""
            problems.append(
                f"quality of service offered by {publisher.node} does not match ({words(found)}): "
                f"{effect}{remedy}"
            )
        return problems

    # -- reading ---------------------------------------------------------------------------------

    def _read(self, message_type: MessageType) -> None:
        """Receive samples of `message_type` from now on, instead of any before."""
        self._feed.set_type(message_type)
        self._repeats.guarded = self.reader is not None
        endpoint = EndpointInfo(
            EndpointKind.SUBSCRIPTION,
            self._topic,
            message_type.name,
            self._core.name,
            self._feed.qos,
            message_type.type_hash,
        )
        reader = self._core.middleware.create_reader(endpoint, self._receiver())
        with self._lock:
            old: Reader | None = self.reader
            self.reader = None if self._closed else reader
        if old is not None:
            self._lost_before += old.lost()
            old.close()
        if self.reader is None:
            reader.close()
        else:
            self._feed.attend()

    def _receiver(self) -> OnSample:
        """Return what takes the samples; every line of it is paid for by each sample."""
        accepted, find_type = self._types.accepted, self._types.find_type
        ignored = self._ignored
        seen, deliver = self._repeats.seen, self._feed.deliver
        wire = self._core.wire
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
            kind = accepted.get(hash) or find_type(hash)
            if kind is None or seen(gid, sequence, sent) or gid in ignored:
                return
            deliver(make(Sample, (data, wire, kind, received, sent, gid, sequence)))

        return receive


class Liveness:
    """Tells the publishers that are alive from those that are only there.

    A publisher with automatic liveliness is alive while it is seen. One that promised to show its
    liveliness itself (manual by topic) is alive while it does so within its lease duration: by
    sending something, or by a word of its own, which only DDS carries and only as a count.

    Args:
        timers: Run the next look.
        repeats: Knows the last sample of each publisher.
        look: Called when it is time to :meth:`follow` again.
    """

    def __init__(self, timers: Timers, repeats: Repeats, look: Callable[[], None]) -> None:
        self._timers, self._repeats, self._look = timers, repeats, look
        self._signs: dict[bytes, tuple[tuple[int, int], float]] = {}
        self._timer: Handle | None = None

    def follow(self, there: Sequence[EndpointInfo], reader: Reader | None) -> list[EndpointInfo]:
        """Return those of the publishers that are `there` who are alive now."""
        manual = [
            (endpoint, endpoint.qos.lease_duration.seconds)
            for endpoint in there
            if endpoint.qos.liveliness is Liveliness.MANUAL_BY_TOPIC
            and endpoint.qos.lease_duration is not None
        ]
        if not manual:
            self.close()
            return list(there)
        now = time.monotonic()
        signs = {endpoint.gid: self._sign(endpoint.gid, now) for endpoint, _ in manual}
        self._signs = {gid: (self._repeats.latest(gid), at) for gid, at in signs.items()}
        silent = [endpoint for endpoint, lease in manual if now - signs[endpoint.gid] > lease]
        alive = None if reader is None else reader.alive()
        if alive is not None:
            # The middleware knows better how many, but not which: those who sent last.
            manual.sort(key=lambda one: signs[one[0].gid])
            silent = [endpoint for endpoint, _ in manual[: max(0, len(there) - alive)]]
        self.close()
        pause = min(lease for _, lease in manual) / 2
        self._timer = self._timers.after(pause, self._look)
        return [endpoint for endpoint in there if endpoint not in silent]

    def close(self) -> None:
        """Look no more; safe to call twice."""
        timer, self._timer = self._timer, None
        if timer is not None:
            timer.close()

    def _sign(self, gid: bytes, now: float) -> float:
        """Return when a publisher showed last that it is alive; when it was seen first, that."""
        known = self._signs.get(gid)
        if known is None or known[0] != self._repeats.latest(gid):
            return now
        return known[1]


class Repeats:
    """Tells whether a sample was seen before, by its publisher's identity, number and time stamp.

    A sample can come twice: over an old and a new route while links change, from a publisher's
    memory after a reconnection, or under two keys when a publisher serves two distributions. Late
    samples that were not seen are not repeats. Safe from several threads: the worst that a race
    does is let a repeat pass.

    Attributes:
        lost: Numbers that were left out, so far.
        guarded: Whether samples without number are told apart by their time stamps: while one
            reader takes the place of another, whose last samples may come again. Not longer, as a
            publisher's clock may be set back.
    """

    def __init__(self) -> None:
        self.lost = 0
        self.guarded = False
        self._last: dict[bytes, tuple[int, int]] = {}
        self._missing: dict[bytes, set[int]] = {}

    def seen(self, gid: bytes, sequence: int, sent: int | None) -> bool:
        """Return whether the sample is a repeat, and remember it.

        Samples without identity, number or time stamp are never repeats.
        """
        if sent is None or not gid:
            return False
        last = self._last.get(gid, _NOBODY)
        if sequence == last[0] + 1:
            self._last[gid] = (sequence, sent)
            return False
        return self._judge(gid, sequence, sent, last)

    def latest(self, gid: bytes) -> tuple[int, int]:
        """Return number and time stamp of a publisher's last sample, to see whether more came."""
        return self._last.get(gid, _NOBODY)

    def _judge(self, gid: bytes, sequence: int, sent: int, last: tuple[int, int]) -> bool:
        """Decide on a sample that is not simply the next one."""
        if sequence < 0:
            repeated = self.guarded and sent <= last[1]
            if not repeated:
                self._remember(gid, -1, sent)
            return repeated
        if last[0] < 0:
            self._remember(gid, sequence, sent)
            return False
        if sequence > last[0]:
            self._leave_out(gid, last[0] + 1, sequence)
        elif sent <= last[1]:
            missing = self._missing.get(gid, set())
            if sequence not in missing:
                return True
            missing.discard(sequence)
            self.lost -= 1
            return False
        self._last[gid] = (sequence, sent)
        return False

    def _remember(self, gid: bytes, sequence: int, sent: int) -> None:
        if gid not in self._last and len(self._last) >= _MAX_PUBLISHERS:
            self._last.clear()
            self._missing.clear()
        self._last[gid] = (sequence, sent)

    def _leave_out(self, gid: bytes, first: int, end: int) -> None:
        self.lost += end - first
        missing = self._missing.setdefault(gid, set())
        missing.update(range(max(first, end - _MAX_MISSING), end))
        if len(missing) > 2 * _MAX_MISSING:
            self._missing[gid] = set(sorted(missing)[-_MAX_MISSING:])

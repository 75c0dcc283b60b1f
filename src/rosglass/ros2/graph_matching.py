"""Matching of ROS 2 subscriptions: types and profiles as the graph announces them."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, Sample
from rosglass.comm.events import conflicts, words
from rosglass.comm.subscription_feed import Problem, TopicMatching
from rosglass.ros2.liveliness import Liveness
from rosglass.ros2.repeats import Repeats
from rosglass.ros2.topic_types import TopicTypes

if TYPE_CHECKING:
    from collections.abc import Sequence
    from collections.abc import Set as AbstractSet

    from rosglass.comm import QoS
    from rosglass.comm.subscription_feed import SubscriptionFeed
    from rosglass.messages import MessageType
    from rosglass.ros2.core import Core
    from rosglass.wires.base import OnSample, Reader

__all__ = ["GraphMatching"]

_PUBLISHER = EndpointKind.PUBLISHER


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
        if endpoint.kind is not _PUBLISHER or not self.find_matching([endpoint]):
            return
        # The node's own publishers that are closed are no longer among its identities.
        ignores_own = self._ignored is self._core.local_gids
        if not (ignores_own and endpoint.node == self._core.name):
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

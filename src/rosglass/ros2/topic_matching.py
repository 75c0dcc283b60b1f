"""Matches ROS 2 subscriptions with publishers by the types and profiles in the graph.

Also monitors the liveliness of publishers. Samples do not pass through here: a reader hands them to
the subscription's inbox.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rosglass.comm import Durability, EndpointInfo, EndpointKind, Liveliness
from rosglass.comm.events import describe_conflicts, describe_mismatch, qos_conflicts
from rosglass.comm.inbox import DuplicateFilter
from rosglass.comm.subscription import Problem, TopicMatching
from rosglass.errors import Error
from rosglass.interfaces import join_name
from rosglass.messages import OpaqueType
from rosglass.ros2.announced import nodes_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from collections.abc import Set as AbstractSet

    from rosglass.comm import Handle, QoS, Timers
    from rosglass.comm.subscription import SubscriptionFeed
    from rosglass.comm.types import Types
    from rosglass.comm.wire import Reader
    from rosglass.messages import MessageType
    from rosglass.ros2.core import Core

__all__ = ["GraphMatching", "TopicTypes"]

_PUBLISHER = EndpointKind.PUBLISHER


class GraphMatching(TopicMatching):
    """Matches a subscription with publishers by type and profile, and reads from them.

    Args:
        core: The node it belongs to.
        wanted: The given type or type name; None to accept the published type.
        ignored: GIDs of publishers to ignore.
    """

    def __init__(
        self,
        core: Core,
        wanted: MessageType | str | None,
        ignored: AbstractSet[bytes],
    ) -> None:
        self._core, self._type, self._ignored = core, wanted, ignored
        self._duplicates = DuplicateFilter()
        self._closed = False
        self._without_publisher = True
        self._lost_before = 0
        self._feed: SubscriptionFeed
        self._types: TopicTypes

    def open(self, feed: SubscriptionFeed, publishers: Sequence[EndpointInfo]) -> None:
        """Choose the profile, and start reading as soon as the type is known."""
        self._feed, self._topic, self._wanted = feed, feed.topic, feed.qos
        self._liveness = Liveness(self._core.timers, self._duplicates, feed.request_update)
        self._types = TopicTypes(
            feed.topic,
            self._core.types,
            self._type,
            feed.type,
            not feed.decodes,
            feed.request_update,
        )
        feed.set_qos(self._wanted.for_subscription(self._offers(publishers)))
        self._core.graph.watch(self._topic, self._on_endpoint_removed)
        if self._types.type is not None:
            self._read(self._types.type)

    def update(self, publishers: Sequence[EndpointInfo], idle: bool) -> list[Problem]:
        """Follow the publishers; return the problems that keep samples from being received."""
        changed = self._types.follow(publishers, idle)
        ours = self._types.type
        problems = self._types.problems
        if ours is not None:
            profile = self._profile(publishers)
            if changed or profile != self._feed.qos or self.reader is None:
                self._feed.set_qos(profile)
                self._read(ours)
            elif idle:
                self._duplicates.guarded = False
            problems = problems + self._describe_qos_conflicts(publishers)
        found = [Problem(text) for text in problems]
        if self.reader is not None and self.reader.problem:
            found.append(Problem(self.reader.problem, logged=False))
        return found

    def find_matching(self, publishers: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        """Return the publishers of a known type with a compatible profile."""
        understood = [p for p in publishers if self._types.accepts(p)]
        qos, middleware = self._feed.qos, self._core.middleware
        if not middleware.matches_qos:
            return understood
        return [p for p in understood if not qos_conflicts(middleware, p, qos, p.qos)]

    def find_conflicts(
        self, publishers: Sequence[EndpointInfo]
    ) -> dict[EndpointInfo, dict[str, str]]:
        """Return the incompatible policies of publishers of a known type."""
        qos, middleware = self._feed.qos, self._core.middleware
        found = {
            p: qos_conflicts(middleware, p, qos, p.qos)
            for p in publishers
            if self._types.accepts(p)
        }
        return {publisher: policies for publisher, policies in found.items() if policies}

    def find_unrequested_history(self, publishers: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        """Return the transient local publishers of a volatile subscription."""
        if self._feed.qos.durability is Durability.TRANSIENT_LOCAL:
            return []
        matching = self.find_matching(publishers)
        return [p for p in matching if p.qos.durability is Durability.TRANSIENT_LOCAL]

    def find_alive(self, matching: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        """Return the matching publishers that assert their liveliness in time."""
        return self._liveness.follow(matching, self.reader)

    def lost(self) -> int:
        """Return how many samples were sent but not received."""
        reader = self.reader
        by_reader = 0 if reader is None else reader.lost()
        return self._duplicates.lost + self._lost_before + by_reader

    def close(self) -> None:
        """Stop reading; safe to call twice."""
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
        """Return the profile to request: the current one, unless a publisher conflicts with it."""
        current = self._feed.qos
        if self._wanted.is_decided:
            return current
        offers = self._offers(publishers)
        first = self._without_publisher and bool(offers)
        self._without_publisher = not offers
        # The first publisher, also after a time without any, may offer a stronger profile.
        if offers and (first or any(current.conflicts(offered) for offered in offers)):
            return self._wanted.for_subscription(offers)
        return current

    def _offers(self, publishers: Sequence[EndpointInfo]) -> list[QoS]:
        ours = self._types.type
        return [p.qos for p in publishers if ours is None or p.type == ours.name]

    def _describe_qos_conflicts(self, publishers: Sequence[EndpointInfo]) -> list[str]:
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
                f"quality of service offered by {publisher.node} does not match "
                f"({describe_conflicts(found)}): {effect}{remedy}"
            )
        return problems

    # -- reading ---------------------------------------------------------------------------------

    def _read(self, message_type: MessageType) -> None:
        """Create a reader for `message_type` in place of the previous one."""
        self._feed.set_type(message_type)
        self._duplicates.guarded = self.reader is not None
        endpoint = EndpointInfo(
            EndpointKind.SUBSCRIPTION,
            self._topic,
            message_type.name,
            self._core.name,
            self._feed.qos,
            message_type.type_hash,
        )
        receive = self._feed.receiver(
            self._types.accepted, self._types.find_type, self._duplicates, self._core.wire
        )
        reader = self._core.middleware.create_reader(endpoint, receive)
        old: Reader | None
        old, self.reader = self.reader, reader
        if old is not None:
            self._lost_before += old.lost()
            old.close()
        if self._closed:  # by another thread, which may have missed the new reader
            self.reader = None
            reader.close()
        else:
            self._feed.update_eagerness()


class Liveness:
    """Monitors the liveliness of publishers.

    A publisher with automatic liveliness is alive while it is in the graph. One with manual
    liveliness is alive while it asserts it within its lease duration: by publishing, or
    explicitly, which only DDS carries, and only as a count.

    Args:
        timers: Schedule the next check.
        repeats: Provides the last sample of each publisher.
        look: Called when :meth:`follow` is due.
    """

    def __init__(self, timers: Timers, repeats: DuplicateFilter, look: Callable[[], None]) -> None:
        self._timers, self._duplicates, self._look = timers, repeats, look
        self._signs: dict[bytes, tuple[tuple[int, int], float]] = {}
        self._timer: Handle | None = None

    def follow(self, there: Sequence[EndpointInfo], reader: Reader | None) -> list[EndpointInfo]:
        """Return the publishers in the graph that are alive."""
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
        signs = {endpoint.gid: self._last_sign(endpoint.gid, now) for endpoint, _ in manual}
        self._signs = {gid: (self._duplicates.latest(gid), at) for gid, at in signs.items()}
        silent = [endpoint for endpoint, lease in manual if now - signs[endpoint.gid] > lease]
        alive = None if reader is None else reader.alive()
        if alive is not None:
            # The middleware only reports how many: assume the most recent senders.
            manual.sort(key=lambda one: signs[one[0].gid])
            silent = [endpoint for endpoint, _ in manual[: max(0, len(there) - alive)]]
        self.close()
        pause = min(lease for _, lease in manual) / 2
        self._timer = self._timers.after(pause, self._look)
        return [endpoint for endpoint in there if endpoint not in silent]

    def close(self) -> None:
        """Stop monitoring; safe to call twice."""
        timer, self._timer = self._timer, None
        if timer is not None:
            timer.close()

    def _last_sign(self, gid: bytes, now: float) -> float:
        """Return the monotonic time of a publisher's last sample, or of its discovery."""
        known = self._signs.get(gid)
        if known is None or known[0] != self._duplicates.latest(gid):
            return now
        return known[1]


#: Maximum number of unannounced hashes to remember and report.
_MAX_UNANNOUNCED = 16


class TopicTypes:
    """The type of a topic, as the user gave it and as publishers announce it.

    If only a name or nothing is given, every version is accepted that the library has or the
    publishers' nodes send. Without a definition, the type becomes opaque if the subscription
    accepts bytes.

    Args:
        topic: The topic, for messages.
        types: Finds definitions.
        wanted: A type, which is fixed; a type's name; or None to accept the published type.
        known: The type of that name, if the library has it; may be opaque.
        opaque: Whether the subscription accepts bytes that cannot be decoded.
        changed: Called, from any thread, when :meth:`follow` should be called again.

    Attributes:
        type: The type to receive; None while it is unknown.
        accepted: The type for each hash that samples may have; the empty hash stands for publishers
            that announce none.
        problems: The problems that :meth:`follow` found, in words.
    """

    def __init__(
        self,
        topic: str,
        types: Types,
        wanted: MessageType | str | None,
        known: MessageType | None,
        opaque: bool,
        changed: Callable[[], None],
    ) -> None:
        self._topic, self._types, self._changed = topic, types, changed
        self._opaque = opaque
        self._fixed = wanted is not None and not isinstance(wanted, str)
        self._given = _full_name(wanted) if isinstance(wanted, str) else ""
        self._hash = ""
        #: Whether the type is opaque because a definition is missing.
        self._provisional = False
        self._failures: dict[tuple[str, str], _Failure] = {}
        #: Hashes of received samples that no publisher announced.
        self._unannounced: set[str] = set()
        #: Hashes that are accepted as opaque because their definition is missing.
        self._undefined: set[str] = set()
        self.type: MessageType | None = None
        self.accepted: dict[str, MessageType] = {}
        self.problems: list[str] = []
        if known is not None:
            self._take(known)
            self._provisional = not self._fixed and isinstance(known, OpaqueType)

    def accepts(self, endpoint: EndpointInfo) -> bool:
        """Return whether a publisher's samples are accepted, as far as it announces its type."""
        ours = self.type
        if ours is None or endpoint.type != ours.name:
            return False
        return not self._hash or endpoint.type_hash in self.accepted

    def find_type(self, type_hash: str) -> MessageType | None:
        """Return the type for samples with an unknown hash; thread-safe, does not block."""
        ours = self.type
        if ours is not None and not self._hash:
            # Opaque without hash: any hash is accepted, and kept to republish the samples.
            if len(self.accepted) <= _MAX_UNANNOUNCED:
                self.accepted[type_hash] = self._types.opaque(
                    ours.name, type_hash, getattr(ours, "reason", "")
                )
            return self.accepted.get(type_hash, ours)
        if type_hash not in self._unannounced and len(self._unannounced) < _MAX_UNANNOUNCED:
            self._unannounced.add(type_hash)
            self._changed()
        return None

    def follow(self, publishers: Sequence[EndpointInfo], retry: bool) -> bool:
        """Follow a change of the publishers.

        Args:
            publishers: The topic's publishers.
            retry: Whether to search again for definitions that were not found before.

        Returns:
            Whether :attr:`type` has changed.
        """
        self.problems = []
        before = self.type
        name = self._name(publishers)
        if name and not self._fixed:
            of_name = [p for p in publishers if p.type == name]
            self._choose(name, of_name, retry)
            self._add_versions(name, of_name, retry)
        self._compare(publishers)
        return self.type is not before

    def _name(self, publishers: Sequence[EndpointInfo]) -> str:
        """Return the name of the type to receive, empty while it is unknown."""
        if self._given:
            return self._given
        ours = "" if self.type is None else self.type.name
        types = sorted({publisher.type for publisher in publishers})
        if self._fixed or ours in types or not types:
            return ours
        if len(types) == 1:
            return types[0]
        text = ", ".join(f"{t} by {nodes_of(p for p in publishers if p.type == t)}" for t in types)
        example = f"create_subscription({self._topic!r}, {types[0]!r})"
        self.problems.append(f"published with several types ({text}); choose one, e.g. {example}")
        return ours

    def _choose(self, name: str, publishers: Sequence[EndpointInfo], retry: bool) -> None:
        """Choose the published version; the library's own if there are several."""
        hashes = sorted({p.type_hash for p in publishers if p.type_hash})
        ours = self.type if self.type is not None and self.type.name == name else None
        if (
            ours is not None
            and not self._provisional
            and (len(hashes) != 1 or self._hash in hashes)
        ):
            return
        if ours is None and not publishers:
            return
        versions = hashes if len(hashes) == 1 else ["", *hashes]
        for version in versions:
            found = self._load(name, version, publishers, retry)
            if found is not None:
                self._take(found)
                return
        failure = self._failures[name, versions[0]]
        if ours is not None and not self._provisional:
            return  # _compare() reports what is missing
        as_bytes = self._opaque and not failure.pending
        self.problems.append(failure.describe(nodes_of(publishers), name, as_bytes))
        if as_bytes:
            self._take_opaque(name, versions[0] if len(versions) == 1 else "", failure.reason)

    def _add_versions(self, name: str, publishers: Sequence[EndpointInfo], retry: bool) -> None:
        """Accept every other version whose definition is available."""
        if self.type is None or self.type.name != name or self._provisional:
            return
        announced = {p.type_hash for p in publishers if p.type_hash}
        for version in sorted(announced | self._unannounced):
            if version in self.accepted and version not in self._undefined:
                continue
            found = self._load(name, version, publishers, retry)
            if found is not None:
                self.accepted[version] = found
                self._unannounced.discard(version)
                self._undefined.discard(version)
            elif self._opaque and not self._given:
                failure = self._failures[name, version]
                if not failure.pending and version not in self._undefined:
                    self._undefined.add(version)
                    self.accepted[version] = self._types.opaque(name, version, failure.reason)

    def _load(
        self, name: str, version: str, publishers: Sequence[EndpointInfo], retry: bool
    ) -> MessageType | None:
        failed = self._failures.get((name, version))
        if failed is not None and not failed.pending and not retry:
            return None
        try:
            found = self._types.message(name, version)
        except Error as error:
            reason = self._types.request(name, version, publishers, self._changed)
            self._failures[name, version] = _Failure(str(error), reason)
            return None
        self._failures.pop((name, version), None)
        return found

    def _take(self, found: MessageType) -> None:
        self._provisional = False
        self._unannounced.clear()
        self._undefined.clear()
        self.type, self._hash = found, found.type_hash
        self.accepted = {"": found, self._hash: found}

    def _take_opaque(self, name: str, type_hash: str, reason: str) -> None:
        made = self._types.opaque(name, type_hash, reason)
        if self.type != made:
            self._take(made)
        self._provisional = True

    def _compare(self, publishers: Sequence[EndpointInfo]) -> None:
        """Report the publishers whose samples are not accepted."""
        ours = self.type
        if ours is None:
            return
        known = ours.name, self._hash
        others = [p for p in publishers if p.type != ours.name]
        if others:
            types = ", ".join(sorted({p.type for p in others}))
            self.problems.append(
                describe_mismatch(nodes_of(others), "publishes", (types, ""), known)
            )
        if not self._hash:
            return
        unknown_hashes = dict.fromkeys(self._unannounced - self.accepted.keys(), "")
        for publisher in publishers:
            unknown = publisher.type_hash not in self.accepted or (
                publisher.type_hash in self._undefined
            )
            if publisher.type == ours.name and unknown:
                unknown_hashes[publisher.type_hash] = f" of {publisher.node}"
        for version, who in sorted(unknown_hashes.items()):
            failure = self._failures.get((ours.name, version))
            if version in self._undefined:
                effect = "its samples are handed on as bytes"
            elif failure is not None and failure.pending:
                effect = "its samples are refused until that is fetched from the robot"
            else:
                effect = "its samples are refused; add the robot's definition to the library"
            theirs = ours.name, version
            wrong = describe_mismatch(f"the publisher{who}", "publishes", theirs, known)
            self.problems.append(f"{wrong}: {effect}")


class _Failure:
    """Why a definition is missing."""

    def __init__(self, error: str, reason: str) -> None:
        self.pending = not reason
        self.reason = f"{error}; {reason}"

    def describe(self, nodes: str, name: str, as_bytes: bool) -> str:
        if self.pending:
            return f"{nodes} publishes {name}, whose definition is being fetched from the robot"
        effect = "it is handed on as bytes, and " if as_bytes else ""
        return (
            f"{nodes} publishes {name}, which cannot be decoded: {self.reason}; {effect}this is "
            "tried again until a definition is found"
        )


def _full_name(name: str) -> str:
    return join_name(name)

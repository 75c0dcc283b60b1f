"""The feed of a subscription: its publishers, its reader, its problem and its events."""

from __future__ import annotations

import logging
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm.core import NodeMember
from rosglass.comm.events import (
    DeadlineMissed,
    LivelinessChanged,
    Matched,
    SamplesLost,
    conflict_events,
)
from rosglass.comm.graph import ConnectionState, EndpointKind
from rosglass.comm.names import similar
from rosglass.comm.subscription import Source
from rosglass.comm.timers import Watchdog
from rosglass.errors import Error, NodeClosedError, TypeNotFoundError
from rosglass.interfaces.names import join_name

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from collections.abc import Set as AbstractSet

    from rosglass.comm.core import NodeCore
    from rosglass.comm.graph import EndpointInfo, NodeName, Status
    from rosglass.comm.qos import QoS
    from rosglass.comm.subscription import Subscription
    from rosglass.messages import MessageType
    from rosglass.wires.base import Reader

__all__ = ["Problem", "SubscriptionFeed", "TopicMatching", "find_subscribed_type"]

_PUBLISHER = EndpointKind.PUBLISHER
#: Publishers that left since the last look, and are reported at the next one.
_MAX_LEFT = 1000


def find_subscribed_type(
    core: NodeCore, topic: str, wanted: MessageType | str | None
) -> MessageType | None:
    """Return the type that a subscription was asked for; None when publishers have to say it.

    Raises:
        TypeNotFoundError: There is no definition, and the topic is not seen with that type.
        UnsupportedError: It is the other ROS's.
    """
    if wanted is None:
        return None
    try:
        found: MessageType = core.types.message(wanted)
    except TypeNotFoundError:
        seen = core.graph.topics().get(topic, ())
        if isinstance(wanted, str) and join_name(wanted) in seen:
            return None
        raise
    return found


class Problem(NamedTuple):
    """What keeps samples of a topic away.

    Attributes:
        text: In words.
        level: Of what is logged.
        logged: Whether the subscription logs it; not what is logged for all topics at once.
    """

    text: str
    level: int = logging.WARNING
    logged: bool = True


class TopicMatching(ABC):
    """How the protocol of a wire matches a subscription with publishers, and reads from them.

    Attributes:
        reader: Receives the samples; None while their type is open.
        outlives_discovery: Whether samples go on coming when the node's connection is lost: over
            connections of their own.
    """

    reader: Reader | None = None
    outlives_discovery = False

    @abstractmethod
    def open(self, feed: SubscriptionFeed, publishers: Sequence[EndpointInfo]) -> None:
        """Decide on the profile, and read as soon as the type is known.

        Args:
            feed: The feed it belongs to.
            publishers: The topic's publishers in the graph.
        """

    @abstractmethod
    def update(self, publishers: Sequence[EndpointInfo], idle: bool) -> list[Problem]:
        """Follow the publishers; on the node's own thread.

        Args:
            publishers: The topic's publishers in the graph.
            idle: Whether this is the regular look, about once a second.

        Returns:
            What keeps samples away.
        """

    @abstractmethod
    def find_matching(self, publishers: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        """Return the publishers that are received from; from any thread."""

    def find_conflicts(
        self,
        publishers: Sequence[EndpointInfo],  # noqa: ARG002 - ROS 1 has none
    ) -> dict[EndpointInfo, dict[str, str]]:
        """Return what publishers offer too little of, in words for each policy."""
        return {}

    def find_alive(self, matching: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        """Return those of the matching publishers that show their liveliness in time."""
        return list(matching)

    def lost(self) -> int:
        """Return how many samples were sent and have not arrived."""
        return 0

    @abstractmethod
    def close(self) -> None:
        """Stop reading; safe to call twice."""


class SubscriptionFeed(NodeMember, Source):
    """Feeds a subscription from its creation to its end.

    Args:
        core: The node it belongs to.
        subscription: The subscription.
        matching: What the wire's protocol adds.
        ignored: Identities of publishers that are left out.

    Attributes:
        subscription: As given.
        topic: Absolute topic name.
        decodes: Whether its callback wants messages: bytes without definition are of no use to it.
        deliver: Takes a received sample, from any thread.
        deliver_many: Takes samples that came together, at least one.
    """

    def __init__(
        self,
        core: NodeCore,
        subscription: Subscription,
        matching: TopicMatching,
        ignored: AbstractSet[bytes] = frozenset(),
    ) -> None:
        self.subscription, self.topic = subscription, subscription.topic
        self.decodes = subscription._decodes
        self._inbox, self._events = subscription._inbox, subscription._events
        self.deliver, self.deliver_many = self._inbox.put, self._inbox.put_many
        self._core, self._matching, self._ignored = core, matching, ignored
        self._loss = PublisherLossMonitor(core.name, core.status)
        self._attention = threading.Lock()
        self._unattended = False
        #: The reader, while no sample is waited for.
        self._lazy: Reader | None = None
        self._closed = False
        self._known: list[EndpointInfo] | None = None
        self._left: deque[EndpointInfo] = deque(maxlen=_MAX_LEFT)
        self._reported_lost = self._missed = 0
        self._deadline: Watchdog | None = None
        subscription._source, subscription._on_close = self, self._end
        matching.open(self, self._publishers())
        self.attend()
        self.inform()

    # -- what the wire's protocol decides --------------------------------------------------------

    @property
    def type(self) -> MessageType | None:
        """The type to receive; None while it is open."""
        return self.subscription.type

    @property
    def qos(self) -> QoS:
        """The profile to ask for."""
        return self.subscription.qos

    @property
    def waiting(self) -> int:
        """How many samples wait to be taken, or for their callback."""
        return self._inbox.waiting

    def set_type(self, message_type: MessageType) -> None:
        """Take the type that was discovered."""
        self.subscription._type = message_type

    def set_qos(self, qos: QoS) -> None:
        """Take the profile that was decided on."""
        self.subscription._qos = qos

    # -- what the subscription asks --------------------------------------------------------------

    def publisher_count(self) -> int:
        """Return how many publishers match now."""
        return len(self._matching.find_matching(self._publishers()))

    def hint(self) -> str:
        """Say what may be wrong when the topic has no publisher; empty when it has one."""
        if self._publishers() or self.publisher_count():
            return ""
        topic, graph = self.topic, self._core.graph
        published = [name for name in graph.topics() if graph.endpoints(_PUBLISHER, name)]
        return f"nobody publishes {topic}{similar(topic, published)}"

    def attend(self) -> None:
        """Let the wire hand on samples as they come only while they are waited for."""
        self._unattended = True
        # Never waits for its turn: handing on may end up in here again. The thread that has the
        # turn looks again.
        while self._unattended and self._attention.acquire(False):
            try:
                self._unattended = False
                reader, eager = self._matching.reader, self.subscription._watched
                if reader is None or eager == (reader is not self._lazy):
                    continue
                self._lazy = None if eager else reader
                reader.set_eager(eager)
                if eager:
                    reader.flush()
            finally:
                self._attention.release()

    def refresh(self) -> None:
        """Hand on what the wire holds back, in the calling thread."""
        reader = self._lazy
        if reader is not None:
            reader.flush()

    def inform(self) -> None:
        """Look at the subscription soon; from any thread."""
        self._known = None
        self._core.wake()

    def lost(self) -> int:
        """Return how many samples were sent and have not arrived."""
        return self._matching.lost()

    # -- following the graph ---------------------------------------------------------------------

    def on_publisher_left(self, endpoint: EndpointInfo) -> None:
        """Report a matching publisher that left, even if no look has found it; from any thread."""
        self._left.append(endpoint)
        self.inform()

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - types may be added, too
        """Follow the publishers; now and then look again for a definition that was not found."""
        if self._closed:
            return
        publishers = self._publishers()
        if publishers == self._known and not idle:
            return  # what changed in the graph is elsewhere
        self._known = publishers
        try:
            problems = self._matching.update(publishers, idle)
        except NodeClosedError:
            raise
        except Error as error:
            problems = [Problem(str(error))]
        matching = self._matching.find_matching(publishers)
        left = [self._left.popleft() for _ in range(len(self._left))]
        if left:
            self._loss.follow(left)
        self._report_problems(problems, matching or publishers, bool(matching))
        self._report_events(publishers, matching, left)
        self.attend()
        if idle:
            self._report_losses()
        if self._closed:  # meanwhile, by another thread
            self._end()

    def close(self) -> None:
        """Stop receiving, and end the subscription; safe to call twice."""
        self.subscription.close()

    def _end(self) -> None:
        self._closed, self._lazy = True, None
        self._matching.close()
        self._watch_deadline(published=False)
        self._core.remove(self)

    def _publishers(self) -> list[EndpointInfo]:
        found: list[EndpointInfo] = self._core.graph.endpoints(_PUBLISHER, self.topic)
        if self._ignored:
            found = [one for one in found if one.gid not in self._ignored]
        return found

    def _report_problems(
        self, problems: list[Problem], there: Sequence[EndpointInfo], received: bool
    ) -> None:
        losses = self._loss.follow(there)
        if not (received and self._matching.outlives_discovery):
            # A publisher that leaves is no mistake of anybody's.
            problems = problems + [Problem(text, logging.INFO) for text in losses]
        self.subscription._set_problem(
            _joined(problems),
            max((problem.level for problem in problems), default=logging.INFO),
            _joined([problem for problem in problems if problem.logged]),
        )

    # -- events ----------------------------------------------------------------------------------

    def _report_events(
        self,
        publishers: Sequence[EndpointInfo],
        matching: list[EndpointInfo],
        left: Sequence[EndpointInfo],
    ) -> None:
        events = self._events
        events.matched.update(matching, Matched, left)
        if events.incompatible:
            found = self._matching.find_conflicts(publishers)
            events.incompatible.update(found, conflict_events(found))
        if events.liveliness:

            def changed(
                endpoint: EndpointInfo, change: int, count: int, _total: int
            ) -> LivelinessChanged:
                return LivelinessChanged(endpoint, change, count, len(matching) - count)

            events.liveliness.update(self._matching.find_alive(matching), changed)
        self._watch_deadline(bool(matching))

    def _watch_deadline(self, published: bool) -> None:
        limit = self.qos.deadline
        listened = published and bool(self._events.deadline)
        wanted = limit is not None and listened and not self._closed
        if self._deadline is not None and not (wanted and self._deadline.limit == limit):
            self._deadline.close()
            self._deadline = None
        if wanted and self._deadline is None and limit is not None:
            self._deadline = Watchdog(
                self._core.timers, limit, self._last_arrival, self._on_deadline_missed
            )

    def _last_arrival(self) -> float:
        self.refresh()
        return self._inbox.last

    def _on_deadline_missed(self, count: int) -> None:
        self._missed += count
        self._events.deadline.notify(DeadlineMissed(count, self._missed))

    def _report_losses(self) -> None:
        events = self._events
        if not events.lost:
            return
        total = self.lost()
        change, self._reported_lost = total - self._reported_lost, total
        if change > 0:
            events.lost.notify(SamplesLost(change, total))


class PublisherLossMonitor:
    """Notices that a topic has lost its publishers; the node's own ones are never missed.

    Args:
        own: The node's name.
        status: Returns the state of the node's connection.
    """

    def __init__(self, own: NodeName, status: Callable[[], Status]) -> None:
        self._own, self._status = own, status
        self._last = self._since = ""

    def follow(self, publishers: Sequence[EndpointInfo]) -> list[str]:
        """Take note of the publishers; return why others are missing, in words."""
        others = {one.node.full for one in publishers if one.node != self._own}
        if publishers:
            self._last, self._since = ", ".join(sorted(others)), ""
        elif self._last and not self._since:
            # No age: the text would change, and be reported again, every second.
            self._since = time.strftime("%H:%M:%S")
        problems = []
        if self._since:
            problems.append(f"nobody has published it since {self._since}, when {self._last} left")
        status = self._status()
        if self._last and status.state is ConnectionState.LOST:
            problems.append(status.detail)
        return problems


def _joined(problems: Sequence[Problem]) -> str:
    return "; ".join(dict.fromkeys(problem.text for problem in problems))

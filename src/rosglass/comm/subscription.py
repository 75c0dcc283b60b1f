"""Subscriptions of topics, and the feeds that connect them to a wire."""

from __future__ import annotations

import logging
import math
import threading
import time
import warnings
from abc import ABC, abstractmethod
from collections import deque
from contextlib import suppress
from functools import wraps
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm.core import NodeMember
from rosglass.comm.events import (
    DeadlineMissed,
    EndpointListeners,
    LivelinessChanged,
    Matched,
    SamplesLost,
    TopicEndpoint,
    conflict_events,
)
from rosglass.comm.executor import IMMEDIATE, check_plain, load_asyncio
from rosglass.comm.graph import ConnectionState, EndpointKind
from rosglass.comm.handle import Executor, Handle, check_flag, check_may_wait
from rosglass.comm.inbox import ImmediateInbox, Inbox, Sample, sample_receiver
from rosglass.comm.listeners import Listeners
from rosglass.comm.names import similar
from rosglass.comm.promise import check_timeout
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.comm.time import Duration
from rosglass.comm.timers import Watchdog
from rosglass.errors import ArgumentError, Error, NodeClosedError, TypeNotFoundError
from rosglass.interfaces.names import join_name

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence
    from collections.abc import Set as AbstractSet

    from rosglass.comm.core import NodeCore
    from rosglass.comm.graph import EndpointInfo, NodeName, Status
    from rosglass.comm.inbox import DuplicateFilter
    from rosglass.comm.qos import QoS
    from rosglass.comm.statistics import Statistics
    from rosglass.comm.wire import OnSample, Reader
    from rosglass.messages import Message, MessageType

__all__ = [
    "Problem",
    "Subscription",
    "SubscriptionFeed",
    "TopicMatching",
    "find_subscribed_type",
]

_log = logging.getLogger("rosglass.comm")
_PUBLISHER = EndpointKind.PUBLISHER
#: How long samples count as awaited after the last wait for one.
_AWAITED_S = 1.0
#: Longest uninterrupted wait: on Windows, Ctrl-C does not interrupt one for a lock.
_MAX_BLOCK_S = 0.2
#: Publishers that left and are reported with the next update; more are forgotten.
_MAX_LEFT = 1000


@hint_at_members
class Subscription(TopicEndpoint):
    """Receives the messages of one topic; created by :meth:`Node.create_subscription`.

    ``for sample in subscription`` and ``async for sample in subscription`` wait for each sample and
    end when the subscription is closed. A closed subscription has no samples; a polling loop should
    end when :attr:`closed` is true.

    Attributes:
        topic: Absolute topic name.
    """

    def __init__(
        self,
        topic: str,
        message_type: MessageType | None,
        qos: QoS,
        executor: Executor,
        callback: Callable[[Message], None] | None = None,
        raw_callback: Callable[[Sample], None] | None = None,
    ) -> None:
        for name, given in (("callback", callback), ("raw_callback", raw_callback)):
            if given is not None:
                check_plain(given, topic, name)
        if callback is not None and raw_callback is not None:
            expected = "None beside a callback: one of the two is called, not both"
            raise ArgumentError("raw_callback", raw_callback, expected, topic)
        if not isinstance(executor, Executor):
            raise ArgumentError("executor", executor, "a rosglass.comm.Executor", topic)
        super().__init__(topic, executor, _log)
        self._liveliness_listeners: EndpointListeners[LivelinessChanged] = EndpointListeners(topic)
        self._lost_listeners: Listeners[SamplesLost] = Listeners(where=topic)
        self._qos, self._type = qos, message_type
        self._decodes = callback is not None
        #: Set by the feed, which also fills the inbox and reads the members below.
        self._feed: SubscriptionFeed | None = None
        #: One item per thread or task that waits for a sample.
        self._waits: list[None] = []
        self._last_wait = -math.inf
        self._batching = False
        call = raw_callback if callback is None else _decoding(callback)
        #: Whether a callback or a waiter is called for each sample.
        self._calls = call is not None
        if call is not None and executor is IMMEDIATE:
            self._inbox: Inbox = ImmediateInbox(topic, qos, call, callback)
        else:
            self._inbox = Inbox(topic, qos, executor, call, callback)

    def __repr__(self) -> str:
        kind = self._type.name if self._type is not None else "type not known yet"
        return f"<{type(self).__name__} {self.topic} [{kind}]{' closed' * self.closed}>"

    @property
    def type(self) -> MessageType | None:
        """The message type; None while it is not discovered yet."""
        return self._type

    @property
    def qos(self) -> QoS:
        """The requested quality of service; open policies are filled in once they are decided."""
        return self._qos

    @property
    def problem(self) -> str:
        """Why messages cannot be received, in words; empty if there is no problem.

        This includes publishers that left, and a lost connection. Until the first publisher
        appears, see :attr:`hint`.
        """
        return self._problem

    @property
    def hint(self) -> str:
        """A hint why nothing has been received: empty if something was, or no reason is known.

        The topic has no publisher, and perhaps a similar name; or a publisher keeps its messages
        for late subscriptions, which this one does not request.
        """
        return "" if self.closed or self._feed is None else self._feed.hint()

    @property
    def closed(self) -> bool:
        """True once :meth:`close` was called."""
        return self._inbox.closed

    def publisher_count(self) -> int:
        """Return the number of matching publishers; 0 after closing."""
        return 0 if self.closed or self._feed is None else self._feed.publisher_count()

    # -- taking samples --------------------------------------------------------------------------

    def take(self) -> Sample | None:
        """Return the oldest waiting sample, or None."""
        self._flush()
        return self._inbox.pop()

    def take_all(self) -> list[Sample]:
        """Return all waiting samples, the oldest first.

        For consumers that look at a fast topic a few times a second: with neither callback nor
        :meth:`wait`, receiving in batches costs a fraction of the time.
        """
        self._flush()
        return self._inbox.pop_all()

    def take_latest(self) -> Sample | None:
        """Return the newest waiting sample, or None; the older ones are dropped and counted."""
        self._flush()
        return self._inbox.pop_latest()

    def wait(self, timeout: float | None = None) -> Sample | None:
        """Return the oldest sample, waiting for one if there is none.

        Args:
            timeout: Seconds to wait; None waits forever.

        Returns:
            None if none arrived in time, or if the subscription was closed.

        Raises:
            ArgumentError: The timeout is not a number of seconds.
            UnsupportedError: Called in a thread that receives samples, which would block itself.
        """
        left = check_timeout(timeout, f"{self.topic}: wait()")
        deadline = math.inf if left is None else time.monotonic() + left
        self._begin_wait()
        try:
            while True:
                sample = self.take()
                remaining = deadline - time.monotonic()
                if sample is not None or self.closed or remaining <= 0:
                    return sample
                check_may_wait(self.topic, following=True)
                # A one-shot event of this wait: released once a sample is ready.
                ready = threading.Lock()
                ready.acquire()
                if self._inbox.add_waiter(ready.release):
                    ready.acquire(timeout=min(remaining, _MAX_BLOCK_S))
                    self._inbox.remove_waiter(ready.release)
        finally:
            self._end_wait()

    def add_waiter(self, wake: Callable[[], object]) -> bool:
        """Register a one-shot wake-up; return False if a sample is ready, or after closing.

        For event loops: `wake` runs at once in the thread that receives, or that closes, and has
        the loop call :meth:`take`.

        Raises:
            ArgumentError: `wake` cannot be called.
        """
        if not callable(wake):
            raise ArgumentError("wake", wake, "something that can be called", self.topic)
        if not self._calls:
            self._calls = True
            if self._feed is not None:
                self._feed.update_eagerness()
        return self._inbox.add_waiter(wake)

    def __iter__(self) -> Iterator[Sample]:
        while (sample := self.wait()) is not None:
            yield sample

    async def __aiter__(self) -> AsyncIterator[Sample]:
        asyncio = load_asyncio()
        loop = asyncio.get_running_loop()
        arrived = asyncio.Event()

        def wake() -> None:
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(arrived.set)

        self._begin_wait()
        try:
            while True:
                sample = self.take()
                if sample is not None:
                    yield sample
                elif self.closed:
                    return
                elif self._inbox.add_waiter(wake):
                    await arrived.wait()
                    arrived.clear()
        finally:
            self._inbox.remove_waiter(wake)
            self._end_wait()

    @property
    def batching(self) -> bool:
        """True if callbacks may be delayed to receive in batches; see :meth:`set_batching`."""
        return self._batching

    def set_batching(self, batching: bool) -> None:
        """Allow callbacks to run a tenth of a second late, for several samples at a time.

        For callbacks that need a fast topic's data only occasionally: receiving costs a fraction of
        the time if the middleware need not deliver each sample at once.

        Raises:
            ArgumentError: The value is neither True nor False.
        """
        check_flag(batching, "batching", self.topic)
        if batching != self._batching:
            self._batching = batching
            self._request_update()

    @property
    def patient(self) -> bool:
        """Deprecated name of :attr:`batching`."""
        warnings.warn("Subscription.patient is now batching", DeprecationWarning, stacklevel=2)
        return self.batching

    def set_patient(self, patient: bool) -> None:
        """Do the same as :meth:`set_batching`; the name is deprecated."""
        text = "Subscription.set_patient() is now set_batching()"
        warnings.warn(text, DeprecationWarning, stacklevel=2)
        self.set_batching(patient)

    def set_inbox_limit(self, limit: int) -> None:
        """Limit the memory of an inbox that keeps all samples; the default is 256 MiB.

        Above it, the oldest samples are dropped and counted, and the log names the slow consumer.
        No effect with keep-last history, which is limited by its depth.

        Args:
            limit: Bytes; each sample counts as its data plus about 500 bytes.

        Raises:
            ArgumentError: The limit is not a positive number of bytes.
        """
        self._inbox.set_limit(limit)

    @property
    def last_arrival(self) -> float:
        """Monotonic time at which the last sample arrived; minus infinity before the first."""
        return self._inbox.last_time

    def statistics(self) -> Statistics:
        """Return the current counts and rates."""
        self._flush()
        return self._inbox.statistics(0 if self._feed is None else self._feed.lost())

    def lateness(self, sample: Sample) -> Duration:
        """Return how much longer a sample took than the fastest one of its publisher.

        By the time at which it was sent, and by the stamp of its header, unless time is simulated;
        in ROS 1, for messages without a header, by when the publisher's messages arrive. Zero if
        that is unknown. See :attr:`Statistics.lateness`.

        Raises:
            ArgumentError: The argument is not a sample.
        """
        if not isinstance(sample, Sample):
            raise ArgumentError("sample", sample, "a rosglass.comm.Sample", self.topic)
        return Duration(self.lateness_ns(sample))

    def lateness_ns(self, sample: Sample) -> int:
        """Return :meth:`lateness` in nanoseconds, for callers that ask for every sample."""
        feed = self._feed
        late, by_header = self._inbox.lateness_ns(sample)
        # Asked only when it decides: it searches the graph for a publisher of simulated time.
        decides = by_header is not None and (late is None or by_header > late)
        if by_header is not None and decides and not (feed and feed.has_simulated_stamps):
            return by_header
        if late is None:
            return 0 if feed is None else feed.lateness(sample.publisher)
        return late

    # -- events ----------------------------------------------------------------------------------

    def on_liveliness_change(
        self, callback: Callable[[LivelinessChanged], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when a publisher becomes alive, or is no longer alive.

        A publisher is alive while it is in the graph; one with manual liveliness (by topic), while
        it asserts its liveliness in time. Arguments as for :meth:`on_matched`.
        """
        return self._listen(self._liveliness_listeners, callback, executor)

    def on_samples_lost(
        self, callback: Callable[[SamplesLost], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when samples were lost in transit; arguments as for :meth:`on_matched`.

        Samples that a full inbox drops are not lost in this sense; :meth:`statistics` counts them.
        """
        return self._listen(self._lost_listeners, callback, executor)

    # -- the end ---------------------------------------------------------------------------------

    def close(self) -> None:
        """Stop receiving, and discard waiting samples.

        Safe to call twice, and from any thread.
        """
        if not self._inbox.close():
            return
        self._remove_listeners()
        self._liveliness_listeners.clear()
        self._lost_listeners.clear()
        if self._feed is not None:
            self._feed.end()

    # -- internals -------------------------------------------------------------------------------

    @property
    def _awaited(self) -> bool:
        """True while a callback, or a wait within the last second, needs samples at once."""
        recent = time.monotonic() - self._last_wait < _AWAITED_S
        return (self._calls and not self._batching) or bool(self._waits) or recent

    def _flush(self) -> None:
        if self._feed is not None:
            self._feed.flush()

    def _request_update(self) -> None:
        if self._feed is not None:
            self._feed.request_update()

    def _begin_wait(self) -> None:
        self._waits.append(None)
        self._last_wait = time.monotonic()
        if self._feed is not None:
            self._feed.update_eagerness()

    def _end_wait(self) -> None:
        self._last_wait = time.monotonic()
        self._waits.pop()


def _decoding(callback: Callable[[Message], None]) -> Callable[[Sample], None]:
    @wraps(callback)
    def call(sample: Sample) -> None:
        callback(sample[2].decode(sample[0], sample[1]))  # as message() does, a step sooner

    return call


# -- the feed ------------------------------------------------------------------------------------


def find_subscribed_type(
    core: NodeCore, topic: str, wanted: MessageType | str | None
) -> MessageType | None:
    """Return the type that a subscription was created with; None if publishers define it.

    Raises:
        TypeNotFoundError: No definition is known, and no endpoint of the topic has that type.
        UnsupportedError: It is a type of the other ROS version.
    """
    if wanted is None:
        return None
    try:
        found: MessageType = core.types.message(wanted)
    except TypeNotFoundError:
        announced = core.graph.topics().get(topic, ())
        if isinstance(wanted, str) and join_name(wanted) in announced:
            return None
        raise
    return found


class Problem(NamedTuple):
    """A reason why samples of a topic do not arrive.

    Attributes:
        text: The reason in words.
        level: Level of its log line.
        logged: Whether the subscription logs it; False if it is logged once for all topics.
    """

    text: str
    level: int = logging.WARNING
    logged: bool = True


class TopicMatching(ABC):
    """Matches a subscription with publishers, and reads from them, by a wire's protocol.

    Attributes:
        reader: Receives the samples; None while their type is unknown.
        outlives_discovery: Whether samples use separate connections, and so continue to arrive
            while the node's connection is lost.
    """

    reader: Reader | None = None
    outlives_discovery = False

    @abstractmethod
    def open(self, feed: SubscriptionFeed, publishers: Sequence[EndpointInfo]) -> None:
        """Decide on the profile, and create the reader as soon as the type is known.

        Args:
            feed: The feed to deliver samples to.
            publishers: The topic's publishers in the graph.
        """

    @abstractmethod
    def update(self, publishers: Sequence[EndpointInfo], idle: bool) -> list[Problem]:
        """Follow the publishers; called on the node's graph thread.

        Args:
            publishers: The topic's publishers in the graph.
            idle: Whether this is the periodic update, about once a second.

        Returns:
            The reasons why samples do not arrive.
        """

    @abstractmethod
    def find_matching(self, publishers: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        """Return the publishers whose samples are received; called from any thread."""

    def find_conflicts(
        self,
        publishers: Sequence[EndpointInfo],  # noqa: ARG002 - ROS 1 has none
    ) -> dict[EndpointInfo, dict[str, str]]:
        """Return the publishers with incompatible profiles: the conflict in words by policy."""
        return {}

    def find_unrequested_history(
        self,
        publishers: Sequence[EndpointInfo],  # noqa: ARG002 - in ROS 1, every subscription gets it
    ) -> list[EndpointInfo]:
        """Return the publishers that keep messages for late subscriptions, if not requested."""
        return []

    def find_alive(self, matching: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        """Return the matching publishers that assert their liveliness in time."""
        return list(matching)

    def lost(self) -> int:
        """Return how many samples were sent and did not arrive."""
        return 0

    @abstractmethod
    def close(self) -> None:
        """Stop reading; safe to call twice."""


class SubscriptionFeed(NodeMember):
    """The wire's side of a subscription: its publishers, its reader, its problem and its events.

    Args:
        core: The node it belongs to.
        subscription: The subscription to feed, until it is closed.
        matching: The matching of the wire's protocol.
        ignored: Identities of publishers to ignore.

    Attributes:
        subscription: As given.
        topic: Absolute topic name.
        decodes: Whether the callback takes messages, and so needs the type's definition.
        deliver: Takes a received sample, from any thread.
        deliver_many: Takes samples that arrived together, at least one.
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
        self._inbox = subscription._inbox
        self.deliver, self.deliver_many = self._inbox.put, self._inbox.put_many
        self._core, self._matching, self._ignored = core, matching, ignored
        self._loss_monitor = PublisherLossMonitor(core.name, core.status)
        #: Held while the reader is switched between eager and lazy; never waited for.
        self._eagerness_lock = threading.Lock()
        self._eagerness_changed = False
        #: The reader while no sample is awaited.
        self._lazy_reader: Reader | None = None
        self._closed = False
        #: The publishers at the last update; None requests another one.
        self._known: list[EndpointInfo] | None = None
        self._left: deque[EndpointInfo] = deque(maxlen=_MAX_LEFT)
        self._reported_losses = self._missed = 0
        self._deadline: Watchdog | None = None
        subscription._feed = self
        matching.open(self, self._publishers())
        self.update_eagerness()
        self.request_update()

    # -- for the wire's protocol -----------------------------------------------------------------

    @property
    def type(self) -> MessageType | None:
        """The type to receive; None while it is unknown."""
        return self.subscription.type

    def set_type(self, message_type: MessageType) -> None:
        """Set the type that was discovered."""
        self.subscription._type = message_type

    @property
    def qos(self) -> QoS:
        """The profile to request."""
        return self.subscription.qos

    def set_qos(self, qos: QoS) -> None:
        """Set the profile that was decided on."""
        self.subscription._qos = qos

    @property
    def waiting(self) -> int:
        """The number of samples that wait to be taken, or for their callback."""
        return self._inbox.waiting

    def receiver(
        self,
        types: Mapping[str, MessageType],
        find_type: Callable[[str], MessageType | None],
        duplicates: DuplicateFilter,
        wire: str,
    ) -> OnSample:
        """Return the function that a reader calls with each sample: it leads to the inbox.

        Arguments as for :func:`rosglass.comm.inbox.sample_receiver`.
        """
        return sample_receiver(self.deliver, types, find_type, duplicates, wire, self._ignored)

    def on_publisher_left(self, endpoint: EndpointInfo) -> None:
        """Report a matching publisher that left, even if it was never seen in an update.

        Called from any thread.
        """
        self._left.append(endpoint)
        self.request_update()

    def update_eagerness(self) -> None:
        """Switch the reader to eager delivery while samples are awaited; from any thread."""
        self._eagerness_changed = True
        # Never blocks: flush() may call this again. The thread that holds the lock checks again.
        while self._eagerness_changed and self._eagerness_lock.acquire(False):
            try:
                self._eagerness_changed = False
                reader, eager = self._matching.reader, self.subscription._awaited
                if reader is None or eager == (reader is not self._lazy_reader):
                    continue
                self._lazy_reader = None if eager else reader
                reader.set_eager(eager)
                if eager:
                    reader.flush()
            finally:
                self._eagerness_lock.release()

    def request_update(self) -> None:
        """Request an update soon, on the node's graph thread; from any thread."""
        self._known = None
        self._core.wake()

    # -- for the subscription --------------------------------------------------------------------

    def publisher_count(self) -> int:
        """Return the number of matching publishers."""
        return len(self._matching.find_matching(self._publishers()))

    def hint(self) -> str:
        """Return a hint why nothing has been received; empty without one."""
        publishers = self._publishers()
        if publishers or self.publisher_count():
            kept = self._matching.find_unrequested_history(publishers)
            if not kept or self.subscription.statistics().received:
                return ""
            nodes = ", ".join(sorted({one.node.full for one in kept}))
            return (
                f"earlier messages of {nodes} are kept for late subscriptions, which this one does "
                "not ask for, and there has been none since: request transient local durability"
            )
        topic, graph = self.topic, self._core.graph
        published = [name for name in graph.topics() if graph.endpoints(_PUBLISHER, name)]
        return f"{topic} has no publisher{similar(topic, published)}"

    def flush(self) -> None:
        """Deliver the samples that a lazy reader holds back, in the calling thread."""
        reader = self._lazy_reader
        if reader is not None:
            reader.flush()

    @property
    def has_simulated_stamps(self) -> bool:
        """True if headers may be stamped with simulated time."""
        return self._core.has_simulated_stamps

    def lateness(self, publisher: bytes) -> int:
        """Return the lateness of a publisher's last sample by its arrival, in nanoseconds."""
        reader = self._matching.reader
        return 0 if reader is None else reader.lateness(publisher)

    def lost(self) -> int:
        """Return how many samples were sent and did not arrive."""
        return self._matching.lost()

    def end(self) -> None:
        """Stop reading after the subscription was closed; safe to call twice."""
        self._closed, self._lazy_reader = True, None
        self._matching.close()
        self._watch_deadline(published=False)
        self._core.remove(self)

    # -- following the graph ---------------------------------------------------------------------

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - definitions may be added
        """Follow the publishers; retry missing definitions with each periodic update."""
        if self._closed:
            return
        publishers = self._publishers()
        if publishers == self._known and not idle:
            return
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
            self._loss_monitor.follow(left)
        self._report_problems(problems, matching or publishers, bool(matching))
        self._report_events(publishers, matching, left)
        self.update_eagerness()
        if idle:
            self._report_losses()
        if self._closed:  # another thread has closed it
            self.end()

    def close(self) -> None:
        """Close the subscription; safe to call twice."""
        self.subscription.close()

    def _publishers(self) -> list[EndpointInfo]:
        found: list[EndpointInfo] = self._core.graph.endpoints(_PUBLISHER, self.topic)
        if self._ignored:
            found = [one for one in found if one.gid not in self._ignored]
        return found

    def _report_problems(
        self, problems: list[Problem], publishers: Sequence[EndpointInfo], received: bool
    ) -> None:
        losses = self._loss_monitor.follow(publishers)
        if not (received and self._matching.outlives_discovery):
            # INFO: a publisher that leaves is not an error.
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
        endpoint = self.subscription
        endpoint._matched_listeners.update(matching, Matched, left)
        if endpoint._incompatible_listeners:
            found = self._matching.find_conflicts(publishers)
            endpoint._incompatible_listeners.update(found, conflict_events(found))
        if endpoint._liveliness_listeners:

            def changed(
                publisher: EndpointInfo, change: int, count: int, _total: int
            ) -> LivelinessChanged:
                return LivelinessChanged(publisher, change, count, len(matching) - count)

            alive = self._matching.find_alive(matching)
            endpoint._liveliness_listeners.update(alive, changed)
        self._watch_deadline(bool(matching))

    def _watch_deadline(self, published: bool) -> None:
        limit = self.qos.deadline
        listened = published and bool(self.subscription._deadline_listeners)
        wanted = limit is not None and listened and not self._closed
        if self._deadline is not None and not (wanted and self._deadline.limit == limit):
            self._deadline.close()
            self._deadline = None
        if wanted and self._deadline is None and limit is not None:
            self._deadline = Watchdog(
                self._core.timers, limit, self._last_arrival, self._on_deadline_missed
            )

    def _last_arrival(self) -> float:
        self.flush()
        return self._inbox.last_time

    def _on_deadline_missed(self, count: int) -> None:
        self._missed += count
        self.subscription._deadline_listeners.notify(DeadlineMissed(count, self._missed))

    def _report_losses(self) -> None:
        listeners = self.subscription._lost_listeners
        if not listeners:
            return
        total = self.lost()
        change, self._reported_losses = total - self._reported_losses, total
        if change > 0:
            listeners.notify(SamplesLost(change, total))


class PublisherLossMonitor:
    """Detects that a topic has lost its publishers; the node's own publishers do not count.

    Args:
        own: The node's name.
        status: Returns the status of the node's connection.
    """

    def __init__(self, own: NodeName, status: Callable[[], Status]) -> None:
        self._own, self._status = own, status
        #: Names of the last publishers, and the time of day when the last one left.
        self._last = self._since = ""

    def follow(self, publishers: Sequence[EndpointInfo]) -> list[str]:
        """Update the monitor; return in words why publishers are missing."""
        others = {one.node.full for one in publishers if one.node != self._own}
        if publishers:
            self._last, self._since = ", ".join(sorted(others)), ""
        elif self._last and not self._since:
            # Not an age, which would change the text, and so repeat the report, every second.
            self._since = time.strftime("%H:%M:%S")
        problems = []
        if self._since:
            problems.append(f"it has had no publisher since {self._since}, when {self._last} left")
        status = self._status()
        if self._last and status.state is ConnectionState.LOST:
            problems.append(status.detail)
        return problems


def _joined(problems: Sequence[Problem]) -> str:
    return "; ".join(dict.fromkeys(problem.text for problem in problems))

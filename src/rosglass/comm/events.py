"""Events of publishers and subscriptions: matches, incompatible QoS, deadlines, losses.

The kinds of events are those of rmw (``rmw/events_statuses``) and of DDS (OMG DDS 1.4, section
2.2.4.1).
"""

from __future__ import annotations

import logging
from abc import abstractmethod
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from rosglass.comm.handle import Handle
from rosglass.comm.listeners import Listener, Listeners

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence

    from rosglass.comm.graph import EndpointInfo
    from rosglass.comm.handle import Executor
    from rosglass.comm.qos import QoS
    from rosglass.comm.wire import Middleware

__all__ = [
    "DeadlineMissed",
    "EndpointListeners",
    "IncompatibleQoS",
    "LivelinessChanged",
    "LivelinessLost",
    "Matched",
    "SamplesLost",
    "TopicEndpoint",
    "conflict_events",
    "describe_conflicts",
    "qos_conflicts",
]

_E = TypeVar("_E")


@dataclass(frozen=True, slots=True)
class Matched:
    """A publisher and a subscription matched, or no longer match.

    Attributes:
        endpoint: The other side. The name of its node may become known only later.
        change: 1 for a new match, -1 for a lost one.
        count: Current number of matches.
        total: Number of matches since the callback was registered.
    """

    endpoint: EndpointInfo
    change: int
    count: int
    total: int


@dataclass(frozen=True, slots=True)
class IncompatibleQoS:
    """An endpoint with an incompatible QoS profile appeared on the topic.

    Attributes:
        endpoint: The endpoint.
        policies: The policies in conflict, e.g. ``("reliability",)``.
        problem: The conflict in words.
        total: Number of such endpoints since the callback was registered.
    """

    endpoint: EndpointInfo
    policies: tuple[str, ...]
    problem: str
    total: int


@dataclass(frozen=True, slots=True)
class DeadlineMissed:
    """Nothing was received, or published, within the deadline.

    Attributes:
        change: Number of deadlines missed since the last event.
        total: Total number of missed deadlines.
    """

    change: int
    total: int


@dataclass(frozen=True, slots=True)
class LivelinessChanged:
    """A publisher became alive, or is no longer alive.

    Attributes:
        endpoint: The publisher.
        change: 1 if it is alive now, -1 if not.
        alive: Current number of alive publishers.
        not_alive: Current number of publishers that did not assert their liveliness in time.
    """

    endpoint: EndpointInfo
    change: int
    alive: int
    not_alive: int


@dataclass(frozen=True, slots=True)
class LivelinessLost:
    """A publisher did not assert its liveliness within its own lease duration.

    Attributes:
        total: Number of such events.
    """

    total: int


@dataclass(frozen=True, slots=True)
class SamplesLost:
    """Samples were sent but not received.

    Attributes:
        change: Number lost since the last event.
        total: Total number lost.
    """

    change: int
    total: int


class _NotifiedEndpoints:
    """The endpoints that one listener was notified of."""

    def __init__(self) -> None:
        self.there: Counter[Hashable] = Counter()
        self.endpoints: dict[Hashable, EndpointInfo] = {}
        self.total = 0


class EndpointListeners(Generic[_E]):
    """Notifies each listener of endpoints that appear and leave, starting with the present ones.

    Args:
        where: The topic, for errors.
    """

    def __init__(self, where: str = "") -> None:
        self._listeners: Listeners[_E] = Listeners(where=where)
        #: Any thread adds; every use is atomic.
        self._known: dict[Listener[_E], _NotifiedEndpoints] = {}

    def __bool__(self) -> bool:
        return bool(self._listeners)

    def add(self, callback: Callable[[_E], None], executor: Executor) -> Handle:
        """Notify `callback` from the next :meth:`update` on, until the handle is closed."""
        listener = self._listeners.add(callback, executor)
        self._known[listener] = _NotifiedEndpoints()
        return listener

    def update(
        self,
        endpoints: Iterable[EndpointInfo],
        event: Callable[[EndpointInfo, int, int, int], _E | None],
        left: Sequence[EndpointInfo] = (),
    ) -> None:
        """Notify the listeners of changes; always called by the same thread.

        Args:
            endpoints: The present endpoints. One with the same GID is the same, even if its node's
                name has become known since.
            event: Called with an endpoint, the change (1 or -1), the current number and the total
                number; returns the event, None for none.
            left: Endpoints that left since the last call, in that order; those that had also
                appeared since then are reported once, too.
        """
        there = list(endpoints)
        now = {endpoint.gid or endpoint for endpoint in there}
        gone = {key: one for one in left if (key := one.gid or one) not in now}
        while gone:
            self._update([*there, *gone.values()], event)
            del gone[next(iter(gone))]
        self._update(there, event)

    def _update(
        self,
        endpoints: Iterable[EndpointInfo],
        event: Callable[[EndpointInfo, int, int, int], _E | None],
    ) -> None:
        listeners = self._known.copy()
        for listener in [one for one in listeners if one.closed]:
            del listeners[listener]
            self._known.pop(listener, None)
        if not listeners:
            return
        found = [(endpoint.gid or endpoint, endpoint) for endpoint in endpoints]
        now: Counter[Hashable] = Counter(key for key, _ in found)
        for listener, known in listeners.items():
            known.endpoints.update(found)
            for change, key in (
                *((-1, gone) for gone in (known.there - now).elements()),
                *((1, come) for come in (now - known.there).elements()),
            ):
                known.there[key] += change
                known.total += change > 0
                made = event(known.endpoints[key], change, known.there.total(), known.total)
                if made is not None:
                    listener.notify(made)
            known.there = now.copy()
            known.endpoints = dict(found)

    def clear(self) -> None:
        """Remove all listeners."""
        self._listeners.clear()
        self._known.clear()


class TopicEndpoint(Handle):
    """A publisher or a subscription: its problem, and the listeners of its events.

    Args:
        topic: Absolute topic name.
        executor: Runs event callbacks that have no executor of their own.
        log: Where problems are logged.

    Attributes:
        topic: Absolute topic name.
    """

    topic: str

    def __init__(self, topic: str, executor: Executor, log: logging.Logger) -> None:
        self.topic = topic
        self._event_executor, self._log = executor, log
        self._problem = self._logged_problem = ""
        self._matched_listeners: EndpointListeners[Matched] = EndpointListeners(topic)
        self._incompatible_listeners: EndpointListeners[IncompatibleQoS] = EndpointListeners(topic)
        self._deadline_listeners: Listeners[DeadlineMissed] = Listeners(where=topic)
        self._problem_listeners: Listeners[str] = Listeners(where=topic)

    @property
    def problem(self) -> str:
        """Why messages are not exchanged, in words; empty if there is no problem."""
        return self._problem

    def on_matched(
        self, callback: Callable[[Matched], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when a matching endpoint of the topic appears or leaves.

        Those are publishers for a subscription, and subscriptions for a publisher. The ones that
        exist already are reported first.

        Args:
            callback: Called with the endpoint and the current number of matches.
            executor: Runs `callback`; None for the executor of the subscription's own callbacks, or
                the dispatcher thread of the publisher's node.

        Raises:
            ArgumentError: The callback is not callable, or the executor is not an Executor.
        """
        return self._listen(self._matched_listeners, callback, executor)

    def on_incompatible_qos(
        self, callback: Callable[[IncompatibleQoS], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when an endpoint appears that requests more than the other side offers.

        The ones that exist already are reported first; arguments as for :meth:`on_matched`.
        """
        return self._listen(self._incompatible_listeners, callback, executor)

    def on_deadline_missed(
        self, callback: Callable[[DeadlineMissed], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` each time that no message was received, or sent, within the deadline.

        A subscription's deadline counts while a publisher matches, a publisher's from its first
        message. Arguments as for :meth:`on_matched`.
        """
        return self._listen(self._deadline_listeners, callback, executor)

    def on_problem_change(
        self, callback: Callable[[str], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with :attr:`problem` whenever that changes.

        Arguments as for :meth:`on_matched`.
        """
        return self._listen(self._problem_listeners, callback, executor)

    @abstractmethod
    def _request_update(self) -> None:
        """Request an update soon, which notifies new listeners of existing endpoints."""

    def _listen(
        self,
        listeners: EndpointListeners[_E] | Listeners[_E],
        callback: Callable[[_E], None],
        executor: Executor | None,
    ) -> Handle:
        listener = listeners.add(callback, executor or self._event_executor)
        self._request_update()
        return listener

    def _set_problem(
        self, problem: str, level: int = logging.WARNING, logged: str | None = None
    ) -> None:
        """Set :attr:`problem`, and log it once.

        Args:
            problem: The problem in words; empty if there is none.
            level: Level of the log line.
            logged: The part of it to log, if the rest is logged elsewhere; None for all.
        """
        logged = problem if logged is None else logged
        if logged != self._logged_problem:
            self._logged_problem = logged
            if logged:
                self._log.log(level, "%s: %s", self.topic, logged)
        if problem != self._problem:
            self._problem = problem
            self._problem_listeners.notify(problem)

    def _remove_listeners(self) -> None:
        self._matched_listeners.clear()
        self._incompatible_listeners.clear()
        self._deadline_listeners.clear()
        self._problem_listeners.clear()


def qos_conflicts(
    middleware: Middleware, endpoint: EndpointInfo, requested: QoS, offered: QoS
) -> dict[str, str]:
    """Return the conflicts between a publisher and a subscription, in words for each QoS policy.

    Args:
        middleware: The middleware that connects them.
        endpoint: The remote endpoint of the two.
        requested: The subscription's profile.
        offered: The publisher's profile.
    """
    return {**requested.conflicts(offered), **middleware.endpoint_conflicts(endpoint)}


def describe_conflicts(found: Mapping[str, str]) -> str:
    """Return conflicts as one line."""
    return "; ".join(f"{policy}: {reason}" for policy, reason in found.items())


def describe_mismatch(
    peer: object, verb: str, theirs: tuple[str, str], ours: tuple[str, str]
) -> str:
    """Return in words that a peer uses another type, or another definition of it.

    Args:
        peer: The peer's name.
        verb: The use, e.g. ``publishes``.
        theirs: The peer's type and hash.
        ours: Our type and hash.
    """
    if theirs[0] != ours[0]:
        return f"{peer} {verb} {theirs[0]} here, not {ours[0]}"
    return f"{peer} has another definition of {ours[0]} ({theirs[1]}, ours is {ours[1]})"


def conflict_events(
    found: Mapping[EndpointInfo, Mapping[str, str]],
) -> Callable[[EndpointInfo, int, int, int], IncompatibleQoS | None]:
    """Return the `event` argument of :meth:`EndpointListeners.update` for endpoints in conflict."""

    def event(
        endpoint: EndpointInfo, change: int, _count: int, total: int
    ) -> IncompatibleQoS | None:
        if change < 0:
            return None
        policies = found[endpoint]
        return IncompatibleQoS(endpoint, tuple(policies), describe_conflicts(policies), total)

    return event

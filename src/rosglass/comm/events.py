"""What publishers and subscriptions tell besides messages: who came and went, what went wrong.

The kinds of events are rmw's (``rmw/events_statuses``), and DDS's behind them (OMG DDS 1.4, section
2.2.4.1).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from rosglass.comm.listeners import Listener, Listeners

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence

    from rosglass.comm.graph import EndpointInfo
    from rosglass.comm.handle import Executor, Handle
    from rosglass.comm.qos import QoS
    from rosglass.wires.base import Middleware

__all__ = [
    "Appearances",
    "DeadlineMissed",
    "IncompatibleQoS",
    "LivelinessChanged",
    "LivelinessLost",
    "Matched",
    "PublisherEvents",
    "SamplesLost",
    "SubscriptionEvents",
    "conflict_events",
    "conflicts",
    "words",
]

_E = TypeVar("_E")


@dataclass(frozen=True, slots=True)
class Matched:
    """A publisher and a subscription found each other, or one of them went.

    Attributes:
        endpoint: The other side. The name of its node may become known later only.
        change: 1 when it came, -1 when it went.
        count: How many match now.
        total: How many have matched since the callback was registered.
    """

    endpoint: EndpointInfo
    change: int
    count: int
    total: int


@dataclass(frozen=True, slots=True)
class IncompatibleQoS:
    """Somebody appeared on the topic whose quality of service does not match.

    Attributes:
        endpoint: Who.
        policies: Which policies are in conflict, e.g. ``("reliability",)``.
        problem: The conflict in words.
        total: How many such endpoints have appeared since the callback was registered.
    """

    endpoint: EndpointInfo
    policies: tuple[str, ...]
    problem: str
    total: int


@dataclass(frozen=True, slots=True)
class DeadlineMissed:
    """Nothing was received, or published, within the deadline.

    Attributes:
        change: Deadlines missed since the last event.
        total: Deadlines missed in all.
    """

    change: int
    total: int


@dataclass(frozen=True, slots=True)
class LivelinessChanged:
    """A publisher became alive, or is not alive any more.

    Attributes:
        endpoint: Which publisher.
        change: 1 when it is alive now, -1 when not.
        alive: How many are alive now.
        not_alive: How many are still there but have not shown their liveliness in time.
    """

    endpoint: EndpointInfo
    change: int
    alive: int
    not_alive: int


@dataclass(frozen=True, slots=True)
class LivelinessLost:
    """A publisher did not show its liveliness within its own lease duration.

    Attributes:
        total: How often that has happened.
    """

    total: int


@dataclass(frozen=True, slots=True)
class SamplesLost:
    """Samples were sent and have not arrived.

    Attributes:
        change: How many since the last event.
        total: How many in all.
    """

    change: int
    total: int


class _Known:
    """What a listener was told: how often each endpoint is there, and how many ever came."""

    def __init__(self) -> None:
        self.there: Counter[Hashable] = Counter()
        self.endpoints: dict[Hashable, EndpointInfo] = {}
        self.total = 0


class Appearances(Generic[_E]):
    """Tells each listener about who appears and who goes, those who are there already first.

    Args:
        where: The topic, for errors.
    """

    def __init__(self, where: str = "") -> None:
        self._listeners: Listeners[_E] = Listeners(where=where)
        #: Any thread adds; every use is atomic.
        self._known: dict[Listener[_E], _Known] = {}

    def __bool__(self) -> bool:
        return bool(self._listeners)

    def add(self, callback: Callable[[_E], None], executor: Executor) -> Handle:
        """Tell `callback` from the next :meth:`update` on, until the handle is closed."""
        listener = self._listeners.add(callback, executor)
        self._known[listener] = _Known()
        return listener

    def update(
        self,
        endpoints: Iterable[EndpointInfo],
        event: Callable[[EndpointInfo, int, int, int], _E | None],
        left: Sequence[EndpointInfo] = (),
    ) -> None:
        """Tell everyone the difference to what they were told; always from the same thread.

        Args:
            endpoints: Who is there now. Who keeps an identity is the same, whatever becomes known
                later, such as the node's name.
            event: Called with an endpoint, the change (1 or -1), how many are there now, and how
                many have appeared in all; returns what to tell, None for nothing.
            left: Those that left since the last call, in that order. Listeners learn of each that
                had come since then as well, once.
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
                    listener.tell(made)
            known.there = now.copy()
            known.endpoints = dict(found)

    def clear(self) -> None:
        """Forget everyone."""
        self._listeners.clear()
        self._known.clear()


class SubscriptionEvents:
    """Who wants to know what about a subscription of a topic; worlds tell them."""

    def __init__(self, topic: str) -> None:
        self.matched: Appearances[Matched] = Appearances(topic)
        self.incompatible: Appearances[IncompatibleQoS] = Appearances(topic)
        self.liveliness: Appearances[LivelinessChanged] = Appearances(topic)
        self.deadline: Listeners[DeadlineMissed] = Listeners(where=topic)
        self.lost: Listeners[SamplesLost] = Listeners(where=topic)
        self.problem: Listeners[str] = Listeners(where=topic)

    def clear(self) -> None:
        """Forget everyone."""
        self.matched.clear()
        self.incompatible.clear()
        self.liveliness.clear()
        self.deadline.clear()
        self.lost.clear()
        self.problem.clear()


class PublisherEvents:
    """Who wants to know what about a publisher; worlds tell them.

    Args:
        executor: Where callbacks run that bring no executor of their own.
        added: Called when there is a new listener, which is to be told soon.
        topic: The publisher's topic, for errors.
    """

    def __init__(self, executor: Executor, added: Callable[[], None], topic: str = "") -> None:
        self.executor, self._added = executor, added
        self.matched: Appearances[Matched] = Appearances(topic)
        self.incompatible: Appearances[IncompatibleQoS] = Appearances(topic)
        self.deadline: Listeners[DeadlineMissed] = Listeners(where=topic)
        self.liveliness: Listeners[LivelinessLost] = Listeners(where=topic)
        self.problem: Listeners[str] = Listeners(where=topic)

    def added(self, handle: Handle) -> Handle:
        """Have a new listener told soon; returns its handle."""
        self._added()
        return handle

    def clear(self) -> None:
        """Forget everyone."""
        self.matched.clear()
        self.incompatible.clear()
        self.deadline.clear()
        self.liveliness.clear()
        self.problem.clear()


def conflicts(
    middleware: Middleware, endpoint: EndpointInfo, requested: QoS, offered: QoS
) -> dict[str, str]:
    """Say, policy by policy, what keeps a publisher and a subscription apart.

    Args:
        middleware: What connects them.
        endpoint: The one of the two that is not ours.
        requested: The subscription's profile.
        offered: The publisher's profile.
    """
    return {**requested.conflicts(offered), **middleware.conflicts(endpoint)}


def words(found: Mapping[str, str]) -> str:
    """Return the conflicts of policies as one line."""
    return "; ".join(f"{policy}: {reason}" for policy, reason in found.items())


def conflict_events(
    found: Mapping[EndpointInfo, Mapping[str, str]],
) -> Callable[[EndpointInfo, int, int, int], IncompatibleQoS | None]:
    """Return what makes events of the endpoints in conflict, for :class:`comm.Appearances`."""

    def event(
        endpoint: EndpointInfo, change: int, _count: int, total: int
    ) -> IncompatibleQoS | None:
        if change < 0:
            return None
        policies = found[endpoint]
        return IncompatibleQoS(endpoint, tuple(policies), words(policies), total)

    return event

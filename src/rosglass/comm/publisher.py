"""A topic's publisher, the same above every wire."""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from typing import TYPE_CHECKING, Any, overload

from rosglass.comm.events import (
    DeadlineMissed,
    LivelinessLost,
    Matched,
    PublisherEvents,
    conflict_events,
    conflicts,
    words,
)
from rosglass.comm.graph import EndpointInfo, EndpointKind, Graph
from rosglass.comm.handle import Handle
from rosglass.comm.names import similar
from rosglass.comm.qos import Liveliness
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.comm.sample import Sample
from rosglass.comm.timers import Watchdog
from rosglass.errors import ConversionError, NodeClosedError, TypeNotFoundError, UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.core import NodeCore
    from rosglass.comm.events import IncompatibleQoS
    from rosglass.comm.handle import Executor
    from rosglass.comm.qos import QoS
    from rosglass.messages import Message, MessageType

__all__ = ["Publisher"]

_SUBSCRIPTION = EndpointKind.SUBSCRIPTION
#: Subscriptions that left since the last look, and are reported at the next one.
_MAX_LEFT = 1000
#: Payloads above this size are handed on in parts, so that arrays in them are not copied.
_BIG_BYTES = 64 * 1024
#: Tells `publish()` from `publish(None)`.
_NO_MESSAGE: Any = object()


@hint_at_members
class Publisher(Handle):
    """Sends messages of one type on one topic; made by :meth:`Node.create_publisher`.

    Args:
        core: The node.
        topic: Absolute topic name.
        type: The message type.
        qos: The quality of service offered, which may leave policies open.

    Attributes:
        topic: As given.
        type: As given.
        qos: The quality of service offered; what was left open is decided.
    """

    def __init__(self, core: NodeCore, topic: str, type: MessageType, qos: QoS) -> None:
        self.topic, self.type = topic, type
        self._core, self._wire = core, core.wire
        self._hash = type.type_hash
        self._closed = False
        self._process = os.getpid()
        self._problem = ""
        #: The subscriptions in the graph at the last look; None asks for another one.
        self._known: list[EndpointInfo] | None = None
        self._left: deque[EndpointInfo] = deque(maxlen=_MAX_LEFT)
        self._big = False
        self._events = PublisherEvents(core.dispatcher, self._look, topic)
        self._lock = threading.Lock()
        self._watchdogs: dict[str, Watchdog] = {}
        self._missed = self._lost = 0
        self._sent_at = self._shown_at = self._lost_since = 0.0
        self.qos = qos.for_publisher([s.qos for s in self._subscriptions() if s.type == type.name])
        # Read the clock per message only if a deadline or lease is set.
        self._timed = self.qos.deadline is not None or self.qos.lease_duration is not None
        kind, node = EndpointKind.PUBLISHER, core.name
        endpoint = EndpointInfo(kind, topic, type.name, node, self.qos, self._hash)
        self._writer = core.create_writer(endpoint, type)
        if self._writer.gid:
            core.local_gids.add(self._writer.gid)
        core.add(self, self._follow)
        # A wire that does not know its subscribers has a graph that tells who leaves.
        graph = core.graph if self._writer.subscribers() is None else None
        if isinstance(graph, Graph):
            graph.watch(topic, self._on_endpoint_removed)
            self._writer.match(self._matching(self._subscriptions()))

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.topic} [{self.type.name}]>"

    # -- sending ---------------------------------------------------------------------------------

    @overload
    def publish(self, message: Message | dict[str, Any], /) -> None: ...
    @overload
    def publish(self, /, **fields: Any) -> None: ...
    def publish(self, message: Message | dict[str, Any] = _NO_MESSAGE, /, **fields: Any) -> None:
        """Send a message.

        In ROS 1, as with rospy and roscpp, ``header.seq`` of what is sent is the running number of
        the node's messages on the topic, from 1 on, if the message begins with a header.

        Args:
            message: A :class:`Message`, or a dict of fields; missing fields get their defaults.
                None is refused: it is what a function that forgot its return gives.
            fields: The fields as keyword arguments, instead of `message`.

        Raises:
            ConversionError: A value does not fit its field; nothing is sent.
            TypeNotFoundError: The type is opaque: only bytes can be sent.
            NodeClosedError: The publisher is closed.
        """
        if message is not _NO_MESSAGE and fields:
            raise ConversionError(
                "", fields, "either a message or keyword fields, not both", self.type.name
            )
        if self._closed or self._process != os.getpid():
            raise self._gone()
        if message is None:
            # Most likely a function that forgot its return: it must not become a zero command.
            raise ConversionError("", None, "a message, a dict or keyword fields", self.type.name)
        value = fields if message is _NO_MESSAGE else message
        number = self._writer.number
        parts: Sequence[bytes | bytearray | memoryview] | None = None
        if self._big:
            parts = self.type.encode_parts(value, wire=self._wire)
        else:
            payload = self.type.encode(value, wire=self._wire)
            self._big = len(payload) > _BIG_BYTES
            if number is not None:
                parts = (payload,)
        if parts is None:
            self._writer.write(payload)
        else:
            self._writer.write_parts(parts if number is None else number(parts))
        if self._timed:
            self._note_sending()

    def publish_serialized(self, data: bytes | bytearray | memoryview | Sample) -> None:
        """Send what is encoded already in the node's wire format, unchanged.

        Args:
            data: The bytes, in ROS 2 with their 4-byte encapsulation header, or a received sample
                to pass on.

        Raises:
            ConversionError: These are no such bytes, or the sample is of another type.
            UnsupportedError: The wire cannot carry big-endian bytes, and without a definition they
                cannot be turned round.
            NodeClosedError: The publisher is closed.
        """
        if self._closed or self._process != os.getpid():
            raise self._gone()
        if isinstance(data, Sample):
            data = self._content(data)
        elif not isinstance(data, (bytes, bytearray, memoryview)):
            raise ConversionError(
                "", data, "bytes, a bytearray, a memoryview or a Sample", self.type.name
            )
        payload = data if type(data) is bytes else _octets(data)
        if self._wire == "cdr":
            payload = self._sendable(payload)
        if type(payload) is bytes:
            self._writer.write(payload)
        else:
            # Copied by the wire: the caller may reuse its buffer at once.
            self._writer.write_parts((payload,))
        if self._timed:
            self._note_sending()

    def assert_liveliness(self) -> None:
        """Show that the publisher is alive, without sending anything.

        For publishers with manual liveliness; sending shows it as well. Zenoh cannot carry it.

        Raises:
            NodeClosedError: The publisher is closed.
            UnsupportedError: ROS 1 cannot carry it.
        """
        if self._closed or self._process != os.getpid():
            raise self._gone()
        self._writer.assert_liveliness()
        self._shown_at = time.monotonic()
        self._watch()

    def _content(self, sample: Sample) -> bytes | memoryview:
        """Return the bytes of a sample that can be passed on here."""
        given, ours = sample.type, self.type
        if sample.wire != self._wire:
            raise ConversionError("wire", sample.wire, f"a sample as {self._wire}", self.topic)
        if given.name != ours.name:
            raise ConversionError("type", given.name, f"a sample of {ours.name}", self.topic)
        if self._wire == "ros1":
            name, version, expected = "md5 sum", given.md5, f"md5 {self._hash}"
        else:
            name, version, expected = "type hash", given.rihs01, self._hash
        if version and self._hash and version != self._hash:
            expected = f"a sample of {ours.name} with our definition, {expected}"
            raise ConversionError(name, version, expected, self.topic)
        return sample.data

    def _sendable(self, payload: bytes | memoryview) -> bytes | memoryview:
        """Return CDR bytes in an order that the wire can carry."""
        if len(payload) < 4 or payload[0] != 0:
            expected = "CDR bytes with their 4-byte encapsulation header"
            raise ConversionError("", bytes(payload), expected, self.type.name)
        if payload[1] & 1 or self._core.middleware.keeps_byte_order:
            return payload
        try:
            return self.type.encode(self.type.decode(payload, wire="cdr").copy(), wire="cdr")
        except TypeNotFoundError as error:
            raise UnsupportedError(
                f"{self.topic}: big-endian bytes cannot be passed on over DDS, and turning them "
                f"round needs the type's definition: {error}"
            ) from error

    def _note_sending(self) -> None:
        first = not self._sent_at
        self._sent_at = self._shown_at = time.monotonic()
        if first:
            self._watch()

    def _gone(self) -> NodeClosedError:
        """Return the reason why nothing can be sent any more."""
        if self._process != os.getpid():
            return NodeClosedError(
                f"the publisher of {self.topic} belongs to the process that made it, and does not "
                "work after a fork; connect again in this process"
            )
        return NodeClosedError(f"the publisher of {self.topic} is closed; create another one")

    def close(self) -> None:
        """Withdraw the publisher; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            watchdogs = list(self._watchdogs.values())
        for watchdog in watchdogs:
            watchdog.close()
        self._events.clear()
        if self._process != os.getpid():
            return
        graph = self._core.graph if self._writer.subscribers() is None else None
        if isinstance(graph, Graph):
            graph.unwatch(self.topic, self._on_endpoint_removed)
        self._writer.close()
        self._core.retire_gid(self._writer.gid)
        self._core.remove(self)

    # -- subscriptions ---------------------------------------------------------------------------

    def subscription_count(self) -> int:
        """Return how many subscriptions match this publisher now; 0 after closing.

        In ROS 1, those are the subscribers that are connected.
        """
        if self._closed:
            return 0
        connected = self._writer.subscribers()
        return len(self._matching(self._subscriptions()) if connected is None else connected)

    @property
    def dropped(self) -> int:
        """How many messages on the topic made room for newer ones because a subscriber is slow.

        Always 0 on wires that do not count them: DDS, Zenoh.
        """
        return self._writer.lost()

    @property
    def problem(self) -> str:
        """Why some subscriptions get nothing, or not all, in words; empty when all is well."""
        return self._problem

    @property
    def hint(self) -> str:
        """What may be wrong when nobody subscribes to the topic, e.g. a name much like it."""
        if self._closed or self._writer.subscribers() or self._subscriptions():
            return ""
        graph = self._core.graph
        wanted = [name for name in graph.topics() if graph.endpoints(_SUBSCRIPTION, name)]
        return f"nobody subscribes to {self.topic}{similar(self.topic, wanted)}"

    def _look(self) -> None:
        """Look at the subscriptions soon, whether or not they change."""
        self._known = None
        self._core.wake()

    def _on_endpoint_removed(self, endpoint: EndpointInfo) -> None:
        """Report a matching subscription that left, even if no look has found it."""
        if endpoint.kind is _SUBSCRIPTION and self._matching([endpoint]):
            self._left.append(endpoint)
            self._look()

    def _follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - both look alike here
        """Follow the subscriptions, on the node's own thread."""
        if self._closed:
            return
        if self._writer.subscribers() is not None:
            for connected in self._writer.changes():
                self._events.matched.update(connected, Matched)
            self._set_problem(self._writer.problem)
        elif moved:
            self._follow_graph()
        if self._timed:
            self._watch()

    def _follow_graph(self) -> None:
        subscriptions = self._subscriptions()
        if subscriptions == self._known:
            return  # what changed in the graph is elsewhere
        self._known = subscriptions
        matching, conflicting = self._matching(subscriptions), self._conflicts(subscriptions)
        self._writer.match(matching)
        self._set_problem("; ".join(self._problems(subscriptions, conflicting)))
        left = [self._left.popleft() for _ in range(len(self._left))]
        self._events.matched.update(matching, Matched, left)
        self._events.incompatible.update(conflicting, conflict_events(conflicting))

    def _subscriptions(self) -> list[EndpointInfo]:
        found: list[EndpointInfo] = self._core.graph.endpoints(_SUBSCRIPTION, self.topic)
        return found

    def _agrees(self, endpoint: EndpointInfo) -> bool:
        """Return whether a subscription's type is our version of it, as far as it says."""
        return not self._hash or endpoint.type_hash in ("", self._hash)

    def _receives(self, endpoint: EndpointInfo) -> bool:
        """Return whether a subscription's type lets it receive what we send."""
        same = endpoint.type == self.type.name
        return same and (self._agrees(endpoint) or not self._core.middleware.matches_hashes)

    def _matching(self, subscriptions: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        found = [one for one in subscriptions if self._receives(one)]
        middleware = self._core.middleware
        if not middleware.matches_qos:
            return found
        return [one for one in found if not conflicts(middleware, one, one.qos, self.qos)]

    def _conflicts(
        self, subscriptions: Sequence[EndpointInfo]
    ) -> dict[EndpointInfo, dict[str, str]]:
        """Return the policies in conflict of the subscriptions whose type would receive us."""
        middleware = self._core.middleware
        found = {
            one: conflicts(middleware, one, one.qos, self.qos)
            for one in subscriptions
            if self._receives(one)
        }
        return {one: policies for one, policies in found.items() if policies}

    def _problems(
        self,
        subscriptions: Sequence[EndpointInfo],
        conflicting: dict[EndpointInfo, dict[str, str]],
    ) -> list[str]:
        problems: dict[str, None] = {}
        name = self.type.name
        for one in subscriptions:
            if one.type != name:
                wrong = f"{one.node} subscribes to {one.type} here, not {name}"
                problems[f"{wrong}: it receives nothing from us"] = None
            elif not self._agrees(one):
                effect = (
                    "it receives our messages all the same, and may take them for something else"
                    if self._receives(one)
                    else "it receives nothing from us"
                )
                problems[
                    f"{one.node} has another definition of {name} ({one.type_hash}; ours is "
                    f"{self._hash}): {effect}"
                ] = None
        effect = (
            "it receives nothing from us"
            if self._core.middleware.matches_qos
            else "it is served without that guarantee"
        )
        for one, policies in conflicting.items():
            remedy = "; offer what it asks for" if one.qos.conflicts(self.qos) else ""
            problems[
                f"quality of service requested by {one.node} does not match ({words(policies)}): "
                f"{effect}{remedy}"
            ] = None
        return list(problems)

    def _set_problem(self, problem: str) -> None:
        if problem == self._problem:
            return
        self._problem = problem
        if problem:
            self._core.log.warning("%s: %s", self.topic, problem)
        self._events.problem.notify(problem)

    # -- events ----------------------------------------------------------------------------------

    def on_matched(
        self, callback: Callable[[Matched], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when a subscription comes that matches, and when it goes.

        Those that are there already are told first.

        Args:
            callback: Told who, and how many there are now.
            executor: Where it runs; None for the node's own dispatcher thread.

        Raises:
            ConversionError: One of the arguments is not what it should be.
        """
        events = self._events
        return events.added(events.matched.add(callback, executor or events.executor))

    def on_incompatible_qos(
        self, callback: Callable[[IncompatibleQoS], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when a subscription comes that asks for more than is offered.

        Those that are there already are told first; arguments as for :meth:`on_matched`.
        """
        events = self._events
        return events.added(events.incompatible.add(callback, executor or events.executor))

    def on_deadline_missed(
        self, callback: Callable[[DeadlineMissed], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` each time that nothing was sent within the profile's deadline.

        Time runs from the first message. Arguments as for :meth:`on_matched`.
        """
        events = self._events
        return events.added(events.deadline.add(callback, executor or events.executor))

    def on_liveliness_lost(
        self, callback: Callable[[LivelinessLost], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when manual liveliness was not shown within the lease duration.

        Arguments as for :meth:`on_matched`.
        """
        events = self._events
        return events.added(events.liveliness.add(callback, executor or events.executor))

    def on_problem_change(
        self, callback: Callable[[str], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with :attr:`problem` whenever it changes; empty when all is well again.

        Arguments as for :meth:`on_matched`.
        """
        events = self._events
        return events.added(events.problem.add(callback, executor or events.executor))

    def _watch(self) -> None:
        """Watch the limits that have a listener, from the first sending on."""
        limit, lease = self.qos.deadline, self.qos.lease_duration
        manual = self.qos.liveliness is Liveliness.MANUAL_BY_TOPIC
        timers, known = self._core.timers, self._watchdogs
        with self._lock:
            if self._closed:
                return
            sent = self._sent_at and self._events.deadline
            if limit is not None and sent and "deadline" not in known:
                known["deadline"] = Watchdog(timers, limit, lambda: self._sent_at, self._miss)
            shown = manual and self._shown_at and self._events.liveliness
            if lease is not None and shown and "lease" not in known:
                known["lease"] = Watchdog(timers, lease, lambda: self._shown_at, self._lose)

    def _miss(self, count: int) -> None:
        self._missed += count
        self._events.deadline.notify(DeadlineMissed(count, self._missed))

    def _lose(self, count: int) -> None:  # noqa: ARG002 - lost once, however long it lasts
        if self._shown_at != self._lost_since:
            self._lost_since = self._shown_at
            self._lost += 1
            self._events.liveliness.notify(LivelinessLost(self._lost))


def _octets(data: bytes | bytearray | memoryview) -> bytes | memoryview:
    """Return a buffer as a view of its bytes, or as bytes when that cannot be had."""
    view = memoryview(data)
    try:
        return view.cast("B")
    except (TypeError, ValueError):  # not contiguous, or of a foreign format
        return view.tobytes()

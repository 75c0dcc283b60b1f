"""Publishers of topics."""

from __future__ import annotations

import threading
import time
from collections import deque
from typing import TYPE_CHECKING, Any, overload

from rosglass.comm.events import (
    DeadlineMissed,
    LivelinessLost,
    Matched,
    TopicEndpoint,
    conflict_events,
    describe_conflicts,
    describe_mismatch,
    qos_conflicts,
)
from rosglass.comm.graph import EndpointInfo, EndpointKind, Graph
from rosglass.comm.inbox import Sample
from rosglass.comm.listeners import Listeners
from rosglass.comm.names import similar
from rosglass.comm.qos import Liveliness
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.comm.timers import Watchdog
from rosglass.errors import (
    ArgumentError,
    ConversionError,
    NodeClosedError,
    TypeNotFoundError,
    UnsupportedError,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.core import NodeCore
    from rosglass.comm.handle import Executor, Handle
    from rosglass.comm.qos import QoS
    from rosglass.messages import Message, MessageType

__all__ = ["Publisher"]

_SUBSCRIPTION = EndpointKind.SUBSCRIPTION
#: Subscriptions that left and are reported with the next update; more are forgotten.
_MAX_LEFT = 1000
#: Payloads above this size are written in parts, so that arrays in them are not copied.
_BIG_BYTES = 64 * 1024
#: Distinguishes `publish()` from `publish(None)`.
_NO_MESSAGE: Any = object()


@hint_at_members
class Publisher(TopicEndpoint):
    """Sends messages of one type on one topic; created by :meth:`Node.create_publisher`.

    Args:
        core: The node.
        topic: Absolute topic name.
        type: The message type.
        qos: The quality of service to offer; policies may be left open.

    Attributes:
        topic: As given.
        type: As given.
        qos: The quality of service offered, with no policy left open.
    """

    def __init__(self, core: NodeCore, topic: str, type: MessageType, qos: QoS) -> None:
        super().__init__(topic, core.dispatcher, core.log)
        self.type = type
        self._core, self._wire = core, core.wire
        self._hash = type.type_hash
        self._closed = False
        #: The subscriptions in the graph at the last update; None requests another one.
        self._known: list[EndpointInfo] | None = None
        self._left: deque[EndpointInfo] = deque(maxlen=_MAX_LEFT)
        #: The problem with subscriptions in the graph; None before the first update.
        self._graph_problem: str | None = None
        self._big = False
        self._liveliness_listeners: Listeners[LivelinessLost] = Listeners(where=topic)
        #: Guards the watchdogs, and ensures that only one thread closes the writer.
        self._lock = threading.Lock()
        self._watchdogs: dict[str, Watchdog] = {}
        self._missed = self._lost = 0
        self._sent_at = self._asserted_at = self._lost_since = 0.0
        self.qos = qos.for_publisher([s.qos for s in self._subscriptions() if s.type == type.name])
        # Read the clock per message only if a deadline or lease is set.
        self._timed = self.qos.deadline is not None or self.qos.lease_duration is not None
        kind, node = EndpointKind.PUBLISHER, core.name
        endpoint = EndpointInfo(kind, topic, type.name, node, self.qos, self._hash)
        self._writer = core.create_writer(endpoint, type)
        if self._writer.gid:
            core.add_gid(self._writer.gid)
        # If the wire does not count its subscribers, the graph does.
        self._graph = core.graph if self._writer.subscribers() is None else None
        core.add(self, self._follow)  # closes this publisher if the node is closed
        if isinstance(self._graph, Graph):
            self._graph.watch(topic, self._on_endpoint_removed)
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

        In ROS 1, as in rospy and roscpp, ``header.seq`` of the sent message is set to a sequence
        number of the node's messages on the topic, starting at 1, if the message begins with a
        header.

        Args:
            message: A :class:`Message`, or a dict of fields; missing fields get their defaults.
                None is refused: it is the result of a function without return statement.
            fields: The fields as keyword arguments, instead of `message`.

        Raises:
            ConversionError: A value does not fit its field; nothing is sent.
            ArgumentError: Both a message and keyword fields are given.
            TypeNotFoundError: The type is opaque: only bytes can be sent.
            NodeClosedError: The publisher is closed.
        """
        if message is not _NO_MESSAGE and fields:
            raise ArgumentError(
                "", fields, "either a message or keyword fields, not both", self.type.name
            )
        if self._closed or self._core.forked:
            raise self._closed_error()
        if message is None:
            # Most likely a missing return statement: it must not become an all-zero command.
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
            self._on_sent()

    def publish_serialized(self, data: bytes | bytearray | memoryview | Sample) -> None:
        """Send a message that is already encoded in the node's wire format, unchanged.

        Args:
            data: The bytes, in ROS 2 with their 4-byte encapsulation header, or a received sample
                to forward.

        Raises:
            ArgumentError: The argument is neither bytes nor a sample.
            ConversionError: The bytes are not valid, or the sample is of another type.
            UnsupportedError: The wire cannot carry big-endian bytes, and converting them needs a
                definition of the type.
            NodeClosedError: The publisher is closed.
        """
        if self._closed or self._core.forked:
            raise self._closed_error()
        if isinstance(data, Sample):
            data = self._check_sample(data)
        elif not isinstance(data, (bytes, bytearray, memoryview)):
            expected = "bytes, a bytearray, a memoryview or a Sample"
            raise ArgumentError("", data, expected, self.type.name)
        payload = data if type(data) is bytes else _byte_view(data)
        if self._wire == "cdr":
            payload = self._in_wire_order(payload)
        if type(payload) is bytes:
            self._writer.write(payload)
        else:
            # Copied by the wire: the caller may reuse its buffer at once.
            self._writer.write_parts((payload,))
        if self._timed:
            self._on_sent()

    def assert_liveliness(self) -> None:
        """Assert that the publisher is alive, without sending a message.

        For publishers with manual liveliness, which sending asserts as well. Zenoh cannot carry it.

        Raises:
            NodeClosedError: The publisher is closed.
            UnsupportedError: ROS 1 cannot carry it.
        """
        if self._closed or self._core.forked:
            raise self._closed_error()
        self._writer.assert_liveliness()
        self._asserted_at = time.monotonic()
        self._start_watchdogs()

    def _check_sample(self, sample: Sample) -> bytes | memoryview:
        """Return the bytes of a sample of this publisher's type; raises ConversionError."""
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

    def _in_wire_order(self, payload: bytes | memoryview) -> bytes | memoryview:
        """Return CDR bytes in a byte order that the wire can carry."""
        if len(payload) < 4 or payload[0] != 0:
            expected = "CDR bytes with their 4-byte encapsulation header"
            raise ConversionError("", bytes(payload), expected, self.type.name)
        if payload[1] & 1 or self._core.middleware.keeps_byte_order:
            return payload
        try:
            return self.type.encode(self.type.decode(payload, wire="cdr").copy(), wire="cdr")
        except TypeNotFoundError as error:
            raise UnsupportedError(
                f"{self.topic}: big-endian bytes cannot be sent over DDS, and converting them "
                f"needs the type's definition: {error}"
            ) from error

    def _on_sent(self) -> None:
        first = not self._sent_at
        self._sent_at = self._asserted_at = time.monotonic()
        if first:
            self._start_watchdogs()

    def _closed_error(self) -> NodeClosedError:
        if self._core.forked:
            return NodeClosedError(
                f"the publisher of {self.topic} belongs to the process that created it, and does "
                "not work after a fork; connect again in this process"
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
        self._remove_listeners()
        self._liveliness_listeners.clear()
        if self._core.forked:
            return
        if isinstance(self._graph, Graph):
            self._graph.unwatch(self.topic, self._on_endpoint_removed)
        self._writer.close()
        self._core.retire_gid(self._writer.gid)
        self._core.remove(self)

    # -- subscriptions ---------------------------------------------------------------------------

    def subscription_count(self) -> int:
        """Return the number of matching subscriptions; 0 after closing.

        In ROS 1, these are the connected subscribers.
        """
        if self._closed:
            return 0
        connected = self._writer.subscribers()
        return len(self._matching(self._subscriptions()) if connected is None else connected)

    @property
    def dropped(self) -> int:
        """The number of messages that were dropped on this machine.

        In ROS 1, those on the topic that a subscriber was too slow for; over Zenoh, those that
        could not be sent within the profile's ``send_timeout``; over DDS, large ones that
        subscribers on Fast DDS were too slow for. :attr:`problem` gives the reason for 10 s.
        """
        return self._writer.lost()

    @property
    def hint(self) -> str:
        """A hint why the topic has no subscriber, e.g. a similar topic name."""
        if self._closed or self._writer.subscribers() or self._subscriptions():
            return ""
        graph = self._core.graph
        subscribed = [name for name in graph.topics() if graph.endpoints(_SUBSCRIPTION, name)]
        return f"{self.topic} has no subscriber{similar(self.topic, subscribed)}"

    def _request_update(self) -> None:
        """Request an update soon, even if the subscriptions do not change."""
        self._known = None
        self._core.wake()

    def _on_endpoint_removed(self, endpoint: EndpointInfo) -> None:
        """Report a matching subscription that left, even if it was never seen in an update."""
        if endpoint.kind is _SUBSCRIPTION and self._matching([endpoint]):
            self._left.append(endpoint)
            self._request_update()

    def _follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - nothing is periodic here
        """Follow the subscriptions, on the node's graph thread."""
        if self._closed:
            return
        if self._writer.subscribers() is not None:
            for connected in self._writer.changes():
                self._matched_listeners.update(connected, Matched)
            self._set_problem(self._writer.problem)
        elif moved:
            self._follow_graph()
        elif self._graph_problem is not None:
            self._update_problem()
        if self._timed:
            self._start_watchdogs()

    def _follow_graph(self) -> None:
        subscriptions = self._subscriptions()
        if subscriptions == self._known:
            return
        self._known = subscriptions
        matching, conflicting = self._matching(subscriptions), self._qos_conflicts(subscriptions)
        self._writer.match(matching)
        self._graph_problem = "; ".join(self._problems(subscriptions, conflicting))
        self._update_problem()
        left = [self._left.popleft() for _ in range(len(self._left))]
        self._matched_listeners.update(matching, Matched, left)
        self._incompatible_listeners.update(conflicting, conflict_events(conflicting))

    def _update_problem(self) -> None:
        self._set_problem("; ".join(filter(None, (self._graph_problem, self._writer.problem))))

    def _subscriptions(self) -> list[EndpointInfo]:
        found: list[EndpointInfo] = self._core.graph.endpoints(_SUBSCRIPTION, self.topic)
        return found

    def _has_same_hash(self, endpoint: EndpointInfo) -> bool:
        """Return whether a subscription's type hash equals ours, or one of them is unknown."""
        return not self._hash or endpoint.type_hash in ("", self._hash)

    def _receives(self, endpoint: EndpointInfo) -> bool:
        """Return whether the wire delivers our messages to a subscription of its type."""
        same = endpoint.type == self.type.name
        return same and (self._has_same_hash(endpoint) or not self._core.middleware.matches_hashes)

    def _matching(self, subscriptions: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        found = [one for one in subscriptions if self._receives(one)]
        middleware = self._core.middleware
        if not middleware.matches_qos:
            return found
        return [one for one in found if not qos_conflicts(middleware, one, one.qos, self.qos)]

    def _qos_conflicts(
        self, subscriptions: Sequence[EndpointInfo]
    ) -> dict[EndpointInfo, dict[str, str]]:
        """Return the conflicting policies of subscriptions whose type matches ours."""
        middleware = self._core.middleware
        found = {
            one: qos_conflicts(middleware, one, one.qos, self.qos)
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
            if one.type == name and self._has_same_hash(one):
                continue
            theirs, ours = (one.type, one.type_hash), (name, self._hash)
            effect = (
                "it receives our messages all the same, and may misinterpret them"
                if one.type == name and self._receives(one)
                else "it receives nothing from us"
            )
            wrong = describe_mismatch(one.node, "subscribes to", theirs, ours)
            problems[f"{wrong}: {effect}"] = None
        effect = (
            "it receives nothing from us"
            if self._core.middleware.matches_qos
            else "it is served without that guarantee"
        )
        for one, policies in conflicting.items():
            remedy = "; offer what it requests" if one.qos.conflicts(self.qos) else ""
            problems[
                f"quality of service requested by {one.node} does not match "
                f"({describe_conflicts(policies)}): {effect}{remedy}"
            ] = None
        return list(problems)

    # -- events ----------------------------------------------------------------------------------

    def on_liveliness_lost(
        self, callback: Callable[[LivelinessLost], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when manual liveliness was not asserted within the lease duration.

        Arguments as for :meth:`on_matched`.
        """
        return self._listen(self._liveliness_listeners, callback, executor)

    def _start_watchdogs(self) -> None:
        """Monitor the limits that have a listener, from the first message on."""
        limit, lease = self.qos.deadline, self.qos.lease_duration
        manual = self.qos.liveliness is Liveliness.MANUAL_BY_TOPIC
        timers, known = self._core.timers, self._watchdogs
        with self._lock:
            if self._closed:
                return
            sent = self._sent_at and self._deadline_listeners
            if limit is not None and sent and "deadline" not in known:
                known["deadline"] = Watchdog(timers, limit, lambda: self._sent_at, self._on_missed)
            asserted = manual and self._asserted_at and self._liveliness_listeners
            if lease is not None and asserted and "lease" not in known:
                known["lease"] = Watchdog(
                    timers, lease, lambda: self._asserted_at, self._on_liveliness_lost
                )

    def _on_missed(self, count: int) -> None:
        self._missed += count
        self._deadline_listeners.notify(DeadlineMissed(count, self._missed))

    def _on_liveliness_lost(self, count: int) -> None:  # noqa: ARG002 - lost once, not per period
        if self._asserted_at != self._lost_since:
            self._lost_since = self._asserted_at
            self._lost += 1
            self._liveliness_listeners.notify(LivelinessLost(self._lost))


def _byte_view(data: bytes | bytearray | memoryview) -> bytes | memoryview:
    """Return a buffer as a view of its bytes, or a copy of them if it is not contiguous."""
    view = memoryview(data)
    try:
        return view.cast("B")
    except (TypeError, ValueError):
        return view.tobytes()

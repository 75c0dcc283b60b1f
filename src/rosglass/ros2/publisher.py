"""Publishing on a ROS 2 topic."""

from __future__ import annotations

import logging
import os
import threading
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import (
    DeadlineMissed,
    EndpointInfo,
    EndpointKind,
    Liveliness,
    LivelinessLost,
    Matched,
    Publisher,
    PublisherEvents,
    Sample,
)
from rosglass.comm.similar import similar
from rosglass.comm.watchdog import Watchdog
from rosglass.errors import (
    ConversionError,
    NodeClosedError,
    TypeNotFoundError,
    UnsupportedError,
)
from rosglass.ros2.core import Member
from rosglass.ros2.matching import conflict_events, conflicts, words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.comm import QoS
    from rosglass.messages import Message, MessageType
    from rosglass.ros2.core import Core

__all__ = ["Ros2Publisher"]

_log = logging.getLogger("rosglass.ros2")
_SUBSCRIPTION = EndpointKind.SUBSCRIPTION
#: Payloads above this size in bytes are handed on in parts, so that arrays in them are not copied.
_BIG = 64 * 1024
#: Tells `publish()` from `publish(None)`.
_NO_MESSAGE: Any = object()


class Ros2Publisher(Publisher, Member):
    """A publisher; made by :meth:`Node.create_publisher`."""

    def __init__(self, core: Core, topic: str, type: MessageType, qos: QoS) -> None:
        self.topic, self.type = topic, type
        self._core = core
        self._hash = type.rihs01
        self._closed = False
        self._process = os.getpid()
        self._problem = ""
        self._known: list[EndpointInfo] | None = None
        self._big = False
        self.events: PublisherEvents = PublisherEvents(core.dispatcher, self._look, topic)
        self._lock = threading.Lock()
        self._watchdogs: dict[str, Watchdog] = {}
        self._missed = self._lost = 0
        self._sent_at = self._shown_at = self._lost_since = 0.0
        self.qos = qos.for_publisher([s.qos for s in self._subscriptions() if s.type == type.name])
        self._writer = core.middleware.create_writer(
            EndpointInfo(EndpointKind.PUBLISHER, topic, type.name, core.name, self.qos, self._hash)
        )
        # Only then sending costs a look at the clock.
        self._timed = self.qos.deadline is not None or self.qos.lease_duration is not None
        if self._writer.gid:
            core.local_gids.add(self._writer.gid)
        core.add(self)
        core.wake()
        self._writer.match(self._matching(self._subscriptions()))

    # -- sending ---------------------------------------------------------------------------------

    def publish(self, message: Message | dict[str, Any] = _NO_MESSAGE, /, **fields: Any) -> None:
        """Encode and send a message; see :meth:`rosglass.comm.Publisher.publish`."""
        if message is not _NO_MESSAGE and fields:
            raise ConversionError(
                "", fields, "either a message or keyword fields, not both", self.type.name
            )
        self._check_open()
        if message is None:
            # Most likely a function that forgot its return: it must not become a zero command.
            raise ConversionError("", None, "a message, a dict or keyword fields", self.type.name)
        value = fields if message is _NO_MESSAGE else message
        if self._big:
            self._write_parts(self.type.encode_parts(value, wire="cdr"))
        else:
            payload = self.type.encode(value, wire="cdr")
            self._big = len(payload) > _BIG
            self._write(payload)

    def publish_serialized(self, data: bytes | bytearray | memoryview | Sample) -> None:
        """Send `data`, which starts with its 4-byte encapsulation header, unchanged."""
        self._check_open()
        if isinstance(data, Sample):
            data = self._content(data)
        elif not isinstance(data, (bytes, bytearray, memoryview)):
            raise ConversionError(
                "", data, "bytes, a bytearray, a memoryview or a Sample", self.type.name
            )
        payload = data if type(data) is bytes else _octets(data)
        if len(payload) < 4 or payload[0] != 0:
            raise ConversionError(
                "", bytes(data), "CDR bytes with their 4-byte encapsulation header", self.type.name
            )
        if not payload[1] & 1 and not self._core.middleware.keeps_byte_order:
            self._write(self._as_little_endian(payload))
        elif type(payload) is bytes:
            self._write(payload)
        else:
            # Copied by the middleware: the caller may reuse its buffer at once.
            self._write_parts((payload,))

    def _as_little_endian(self, payload: bytes | memoryview) -> bytes:
        try:
            return self.type.encode(self.type.decode(payload, wire="cdr").copy(), wire="cdr")
        except TypeNotFoundError as error:
            raise UnsupportedError(
                f"{self.topic}: big-endian bytes cannot be passed on over DDS, and turning them "
                f"round needs the type's definition: {error}"
            ) from error

    def assert_liveliness(self) -> None:
        """Show that the publisher is alive; see :meth:`rosglass.comm.Publisher`."""
        self._check_open()
        self._writer.assert_liveliness()
        self._shown_at = time.monotonic()
        self._watch()

    def _write(self, payload: bytes | bytearray) -> None:
        self._writer.write(payload)
        if self._timed:
            self._note_sending()

    def _write_parts(self, parts: Sequence[bytes | bytearray | memoryview]) -> None:
        self._writer.write_parts(parts)
        if self._timed:
            self._note_sending()

    def _note_sending(self) -> None:
        first = not self._sent_at
        self._sent_at = self._shown_at = time.monotonic()
        if first:
            self._watch()

    def _content(self, sample: Sample) -> bytes | memoryview:
        """Return the bytes of a sample that can be passed on here."""
        kind, ours = sample.type, self.type
        if sample.wire != "cdr":
            raise ConversionError("wire", sample.wire, "a sample as cdr", self.topic)
        if kind.name != ours.name:
            raise ConversionError("type", kind.name, f"a sample of {ours.name}", self.topic)
        if kind.rihs01 and self._hash and kind.rihs01 != self._hash:
            expected = f"a sample of {ours.name} with our definition, {self._hash}"
            raise ConversionError("type hash", kind.rihs01, expected, self.topic)
        return sample.data

    # -- who is there ----------------------------------------------------------------------------

    def subscription_count(self) -> int:
        """Return how many subscriptions in the graph match now; 0 after closing."""
        return 0 if self._closed else len(self._matching(self._subscriptions()))

    @property
    def problem(self) -> str:
        """Why some subscriptions on the topic get nothing, in words; empty when all is well."""
        return self._problem

    @property
    def hint(self) -> str:
        """What may be wrong when nobody subscribes to the topic; empty when somebody does."""
        if self._closed or self._subscriptions():
            return ""
        graph = self._core.graph
        wanted = [name for name in graph.topics() if graph.endpoints(_SUBSCRIPTION, name)]
        return f"nobody subscribes to {self.topic}{similar(self.topic, wanted)}"

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - the graph alone matters
        """Follow a change of the graph."""
        if not moved or self._closed:
            return
        subscriptions = self._subscriptions()
        if subscriptions == self._known:
            return  # what changed in the graph is elsewhere
        self._known = subscriptions
        matching = self._matching(subscriptions)
        self._writer.match(matching)
        self._say(self._problems(subscriptions))
        self._tell(subscriptions, matching)
        self._watch()

    def close(self) -> None:
        """Withdraw the publisher; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            watchdogs = list(self._watchdogs.values())
        for watchdog in watchdogs:
            watchdog.close()
        self.events.clear()
        if self._process != os.getpid():
            return
        self._writer.close()
        self._core.local_gids.discard(self._writer.gid)
        self._core.remove(self)

    def _look(self) -> None:
        self._known = None
        self._core.wake()

    def _subscriptions(self) -> list[EndpointInfo]:
        return self._core.graph.endpoints(_SUBSCRIPTION, self.topic)

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
        """Return what those ask for too much of that would receive us."""
        middleware = self._core.middleware
        found = {
            one: conflicts(middleware, one, one.qos, self.qos)
            for one in subscriptions
            if self._receives(one)
        }
        return {one: told for one, told in found.items() if told}

    def _problems(self, subscriptions: Sequence[EndpointInfo]) -> list[str]:
        problems: dict[str, None] = {}
        name = self.type.name
        for one in subscriptions:
            if one.type != name:
                told = f"{one.node} subscribes to {one.type} here, not {name}"
                problems[f"{told}: it receives nothing from us"] = None
            elif not self._agrees(one):
                told = (
                    "it receives our messages all the same, and may take them for something else"
                    if self._receives(one)
                    else "it receives nothing from us"
                )
                problems[
                    f"{one.node} has another definition of {name} ({one.type_hash}; ours is "
                    f"{self._hash}): {told}"
                ] = None
        effect = (
            "it receives nothing from us"
            if self._core.middleware.matches_qos
            else "it is served without that guarantee"
        )
        for one, found in self._conflicts(subscriptions).items():
            remedy = "; offer what it asks for" if one.qos.conflicts(self.qos) else ""
            problems[
                f"quality of service requested by {one.node} does not match ({words(found)}): "
                f"{effect}{remedy}"
            ] = None
        return list(problems)

    def _say(self, problems: Sequence[str]) -> None:
        problem = "; ".join(problems)
        if problem == self._problem:
            return
        self._problem = problem
        if problem:
            _log.warning("%s: %s", self.topic, problem)
        self.events.problem.notify(problem)

    # -- events ----------------------------------------------------------------------------------

    def _tell(
        self, subscriptions: Sequence[EndpointInfo], matching: Sequence[EndpointInfo]
    ) -> None:
        self.events.matched.update(matching, Matched)
        if not self.events.incompatible:
            return
        found = self._conflicts(subscriptions)
        self.events.incompatible.update(found, conflict_events(found))

    def _watch(self) -> None:
        """Watch the limits that somebody wants to be told about, from the first sending on."""
        limit, lease = self.qos.deadline, self.qos.lease_duration
        manual = self.qos.liveliness is Liveliness.MANUAL_BY_TOPIC
        timers, known = self._core.timers, self._watchdogs
        with self._lock:
            if self._closed:
                return
            sent = self._sent_at and self.events.deadline
            if limit is not None and sent and "deadline" not in known:
                known["deadline"] = Watchdog(timers, limit, lambda: self._sent_at, self._miss)
            shown = manual and self._shown_at and self.events.liveliness
            if lease is not None and shown and "lease" not in known:
                known["lease"] = Watchdog(timers, lease, lambda: self._shown_at, self._lose)

    def _miss(self, count: int) -> None:
        self._missed += count
        self.events.deadline.notify(DeadlineMissed(count, self._missed))

    def _lose(self, count: int) -> None:  # noqa: ARG002 - lost once, however long it lasts
        if self._shown_at != self._lost_since:
            self._lost_since = self._shown_at
            self._lost += 1
            self.events.liveliness.notify(LivelinessLost(self._lost))

    def _check_open(self) -> None:
        if self._process != os.getpid():
            raise NodeClosedError(
                f"the publisher of {self.topic} belongs to the process that made it, and does not "
                "work after a fork; connect again in this process"
            )
        if self._closed:
            raise NodeClosedError(f"the publisher of {self.topic} is closed; create another one")


def _octets(data: bytes | bytearray | memoryview) -> bytes | memoryview:
    """Return a buffer as a view of its bytes, or as bytes when that cannot be had."""
    view = memoryview(data)
    try:
        return view.cast("B")
    except (TypeError, ValueError):  # not contiguous, or of a foreign format
        return view.tobytes()

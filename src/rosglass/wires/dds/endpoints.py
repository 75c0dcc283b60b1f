"""Writers and readers of a DDS participant: the sending and receiving ends of ROS 2's topics."""

from __future__ import annotations

import math
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.comm import History, Reliability
from rosglass.comm.names import mangle_type
from rosglass.errors import NodeClosedError, TimeoutError  # noqa: A004 - the field's own word
from rosglass.wires.base import Reader, Writer
from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone import (
    Event,
    alive_writers,
    lost_samples,
    qos_of,
    set_events,
    subscription_matched,
)
from rosglass.wires.dds.cyclone_samples import Batch, Taken, discard, sample, send
from rosglass.wires.dds.graph import format_user_data, hash_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo, QoS
    from rosglass.wires.base import OnSample
    from rosglass.wires.dds.participant import Participant

__all__ = ["DdsReader", "DdsWriter", "SampleReader", "SampleWriter", "Taken", "topic_name"]

#: Samples that a reader holds at least until they are handed on, so that it is the subscription's
#: inbox that drops what is too much, where it is counted.
_MIN_DEPTH = 128
#: Samples per second above which a reader would lose some if it were looked at as rarely as others.
_FAST = 2000
#: Batches that are taken in a row.
_MOST = 64
#: Seconds that a write waits in the library before it comes back to see what has happened.
_SLICE = 0.1
#: Seconds that the pump waits for a thread that is handing samples on.
_SOON = 0.001
#: Seconds that the first samples of a reader wait for it to be made.
_PATIENCE = 5.0
#: Writers that a reader remembers; more come only from a robot that restarts for days.
_MAX_WRITERS = 1024


def topic_name(name: str) -> str:
    """Return the DDS topic that carries a ROS 2 topic (absolute name)."""
    return f"rt{name}"


class SampleWriter:
    """A DDS writer of payloads.

    Args:
        participant: Who it belongs to.
        topic: Its DDS topic.
        dds_type: Its DDS type.
        qos: Its profile.
        user_data: What everyone sees who discovers it.
        place: What it is for, in errors.
        make_topic: Creates the topic, instead of :func:`cyclone.create_topic`.
        patience: Seconds that a write may wait for reliable readers, None for ever.

    Attributes:
        entity: Cyclone's number for it.
        guid: Its 16 bytes of identity.

    Raises:
        UnsupportedError: The profile is not possible.
    """

    def __init__(
        self,
        participant: Participant,
        topic: str,
        dds_type: str,
        qos: QoS,
        user_data: bytes,
        place: str,
        make_topic: Callable[[int, str, str], int] = cyclone.create_topic,
        patience: float | None = None,
    ) -> None:
        self._participant, self._place = participant, place
        self._patience = math.inf if patience is None else patience
        self._slice = min(self._patience, _SLICE)
        self._lock = threading.Lock()
        self._closed = False
        with participant.in_use():
            self._topic = make_topic(participant.entity, topic, dds_type)
            try:
                policies = qos_of(qos, writer=True, user_data=user_data)
                if qos.reliability is Reliability.RELIABLE:
                    policies.wait_at_most(self._slice)
                self.entity = cyclone.create_writer(
                    participant.entity, self._topic, policies, place
                )
                self.guid = cyclone.guid(self.entity)
                self._type = cyclone.sertype(self.entity)
            except BaseException:
                cyclone.delete(self._topic)
                raise
            participant.before_leaving(self.entity, self._stop)

    def write(self, parts: Sequence[bytes | bytearray | memoryview]) -> None:
        """Send a payload that comes in one part or several.

        Raises:
            NodeClosedError: The writer was closed.
            TimeoutError: A reliable reader took nothing for too long.
        """
        with self._lock:
            if self._closed:
                raise NodeClosedError(f"{self._place}: the publisher is closed")
            serdata = sample(self._type, parts, self._place)
            try:
                if not send(self.entity, serdata, self._place):
                    self._insist(serdata)
            finally:
                discard(serdata)

    def _insist(self, serdata: int) -> None:
        """Try again and again; in between, signals are handled, such as Ctrl-C."""
        deadline = time.monotonic() + self._patience - self._slice
        while time.monotonic() < deadline:
            if self._closed:
                raise NodeClosedError(f"{self._place}: the publisher is closed")
            if send(self.entity, serdata, self._place):
                return
        raise TimeoutError(f"{self._place}: the readers took nothing for too long")

    def close(self) -> None:
        """End it; a write that waits in another thread ends with an error.

        It is deleted once its readers have what was sent, or do not take it for too long.
        """
        if self._closed:
            return
        self._closed = True
        if cyclone.acknowledged(self.entity):
            self._delete()
        else:
            self._participant.lingering.add(self.entity, self._delete)

    def _stop(self) -> None:
        """Let nobody write any more, nor be about to: all goes with the participant."""
        self._closed = True
        # Not for ever: it may be this very thread that was interrupted by a signal.
        if self._lock.acquire(timeout=_PATIENCE):
            self._lock.release()

    def _delete(self) -> None:
        self._participant.before_leaving(self.entity, None)
        cyclone.delete(self.entity)
        # The topic keeps the type alive that a write in another thread may be using.
        with self._lock:
            cyclone.delete(self._topic)


class SampleReader:
    """A DDS reader of payloads, which hands them on from the participant's pump.

    Args:
        participant: Who it belongs to.
        topic: Its DDS topic.
        dds_type: Its DDS type.
        qos: Its profile; it holds more samples than that says, until they are handed on.
        user_data: What everyone sees who discovers it.
        place: What it is for, in errors.
        on_taken: Takes the samples, some at a time and in order, and must return at once.
        make_topic: Creates the topic, instead of :func:`cyclone.create_topic`.
        describe: Returns what to tell besides of the sample in a serdata (its address).
        on_matched: Called, on the pump's thread, when writers came or went.

    Attributes:
        entity: Cyclone's number for it.
        guid: Its 16 bytes of identity.

    Raises:
        UnsupportedError: The profile is not possible.
    """

    def __init__(
        self,
        participant: Participant,
        topic: str,
        dds_type: str,
        qos: QoS,
        user_data: bytes,
        place: str,
        on_taken: Callable[[list[Taken]], None],
        make_topic: Callable[[int, str, str], int] = cyclone.create_topic,
        describe: Callable[[int], Any] | None = None,
        on_matched: Callable[[], None] | None = None,
    ) -> None:
        self._participant, self._place, self._on_taken = participant, place, on_taken
        self._on_matched = on_matched
        self._closed = False
        self._eager = True
        self._lost = self._count = 0
        self._visited = 0.0
        self._busy, self._changing = threading.Lock(), threading.RLock()
        self._batch = Batch(describe)
        policies = qos_of(qos, writer=False, user_data=user_data)
        if qos.history is History.KEEP_LAST:
            policies.set_history(max(qos.depth, _MIN_DEPTH))
        self._events = Event.NONE if on_matched is None else Event.SUBSCRIPTION_MATCHED
        with participant.in_use():
            self._topic = make_topic(participant.entity, topic, dds_type)
            try:
                self.entity = cyclone.create_reader(
                    participant.entity, self._topic, policies, place
                )
                self.guid = cyclone.guid(self.entity)
                events = self._events | Event.DATA_AVAILABLE
                participant.pump.watch(self.entity, events, self._serve)
            except BaseException:
                cyclone.delete(self._topic)
                raise

    def set_eager(self, eager: bool) -> None:
        """Say whether samples are handed on as they come, or some thirty times a second."""
        with self._changing, suppress(NodeClosedError):
            if eager == self._eager or self._closed:
                return
            self._eager = eager
            set_events(self.entity, self._events | (Event.DATA_AVAILABLE if eager else Event.NONE))
            self._participant.pump.visit(self.entity, None if eager else self._visit)

    def flush(self) -> None:
        """Hand on what waits, unless another thread is about to."""
        if self._busy.acquire(blocking=False):
            more = True
            try:
                more = self._hand_on(_MOST)
            finally:
                self._busy.release()
                if more and self._eager:
                    self._participant.pump.visit(self.entity, None)

    def _visit(self) -> bool:
        """Hand on what waits; return whether so much comes that it should not wait so long."""
        before, count = self._visited, self._count
        self.flush()
        self._visited = time.monotonic()
        return self._count - count > _FAST * (self._visited - before)

    def lost(self) -> int:
        """Return how many samples were announced but never came."""
        with suppress(NodeClosedError):
            self._lost = lost_samples(self.entity)
        return self._lost

    def alive(self) -> int:
        """Return how many of the writers it is matched with are alive."""
        with suppress(NodeClosedError):
            return alive_writers(self.entity)
        return 0

    def close(self) -> None:
        """Delete it; nothing more is taken."""
        with self._changing:
            if self._closed:
                return
            self._closed = True
        cyclone.delete(self.entity)
        self._participant.pump.forget(self.entity)
        cyclone.delete(self._topic)

    def _serve(self) -> bool:
        busy, count = self._busy, self._count
        if not (busy.acquire(False) or busy.acquire(True, _SOON)):
            return True
        try:
            more = self._hand_on(1)
        finally:
            busy.release()
        # The status calls until it is read, and costs as much as taking a sample.
        if self._on_matched is not None and self._count == count:
            with suppress(NodeClosedError):
                if subscription_matched(self.entity):
                    self._on_matched()
        return more

    def _hand_on(self, batches: int) -> bool:
        """Hand on so many batches at most; return whether there may be more."""
        for _ in range(batches):
            if self._closed:
                return False
            try:
                taken = self._batch.take(self.entity, self._place)
            except NodeClosedError:
                return False
            if taken:
                self._count += len(taken)
                self._on_taken(taken)
            if not self._batch.full:
                return False
        return True


class DdsWriter(Writer):
    """The sending end of a publisher."""

    def __init__(self, participant: Participant, endpoint: EndpointInfo) -> None:
        self._participant = participant
        self._place = f"topic {endpoint.name}"
        self._writer = SampleWriter(
            participant,
            topic_name(endpoint.name),
            mangle_type(endpoint.type),
            endpoint.qos,
            format_user_data({"typehash": endpoint.type_hash}),
            self._place,
        )
        self.gid = self._writer.guid
        participant.add_endpoint(endpoint.node, self.gid, writer=True)
        participant.add_writer(cyclone.handle(self._writer.entity), self.gid, endpoint.type_hash)

    def write(self, data: bytes | bytearray) -> None:
        """Send a payload; a reliable writer that keeps all waits for slow readers."""
        self._writer.write((data,))

    def write_parts(self, parts: Sequence[bytes | bytearray | memoryview]) -> None:
        """Send a payload that comes in parts; they are copied once, by Cyclone DDS."""
        self._writer.write(parts)

    def assert_liveliness(self) -> None:
        """Show that the publisher is alive."""
        cyclone.assert_liveliness(self._writer.entity, self._place)

    def close(self) -> None:
        """Take it out of the graph and delete it."""
        self._participant.remove_endpoint(self.gid)
        self._writer.close()


class DdsReader(Reader):
    """The receiving end of a subscription."""

    def __init__(
        self, participant: Participant, endpoint: EndpointInfo, on_sample: OnSample
    ) -> None:
        self._participant, self._on_sample = participant, on_sample
        self._writers: dict[int, tuple[bytes, str]] = {}
        self._made = threading.Event()
        self._reader = SampleReader(
            participant,
            topic_name(endpoint.name),
            mangle_type(endpoint.type),
            endpoint.qos,
            format_user_data({"typehash": endpoint.type_hash}),
            f"topic {endpoint.name}",
            self._hand_on,
        )
        self._made.set()
        self.gid = self._reader.guid
        participant.add_endpoint(endpoint.node, self.gid, writer=False)

    def set_eager(self, eager: bool) -> None:
        """Hand samples on as they come, or now and then."""
        self._reader.set_eager(eager)

    def flush(self) -> None:
        """Hand on what waits."""
        self._reader.flush()

    def lost(self) -> int:
        """Return how many samples were announced but never came."""
        return self._reader.lost()

    def alive(self) -> int:
        """Return how many publishers asserted their liveliness in time."""
        return self._reader.alive()

    def close(self) -> None:
        """Take it out of the graph and delete it."""
        self._participant.remove_endpoint(self.gid)
        self._reader.close()

    def _hand_on(self, taken: list[Taken]) -> None:
        received, on_sample, writers = time.time_ns(), self._on_sample, self._writers
        for data, sent, handle, _ in taken:
            writer = writers.get(handle)
            if writer is None:
                writer = self._identify(handle)
            on_sample(data, received, sent, writer[0], -1, writer[1])

    def _identify(self, handle: int) -> tuple[bytes, str]:
        """Return a writer's identity and type hash; both empty when it is gone already."""
        writer = self._participant.writers.get(handle)
        if writer is None:
            # What is latched comes before the constructor has returned.
            self._made.wait(_PATIENCE)
            found = cyclone.matched_publication(self._reader.entity, handle)
            if found is None:
                return b"", ""
            writer = found.guid, hash_of(found.user_data)
        if len(self._writers) >= _MAX_WRITERS:
            self._writers.clear()
        self._writers[handle] = writer
        return writer

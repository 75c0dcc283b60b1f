"""Writers and readers of a DDS participant, and those of ROS 2 topics."""

from __future__ import annotations

import math
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.comm import Durability, History, Reliability
from rosglass.comm.handle import undo_on_error
from rosglass.comm.names import mangle_type
from rosglass.comm.wire import Reader, Writer
from rosglass.errors import NodeClosedError, TimeoutError  # noqa: A004 - the field's own word
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
from rosglass.wires.dds.flow_control import FlowControl
from rosglass.wires.dds.graph import format_user_data, hash_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo, QoS
    from rosglass.comm.wire import OnSample
    from rosglass.wires.dds.participant import Participant

__all__ = ["DdsReader", "DdsWriter", "SampleReader", "SampleWriter", "Taken", "topic_name"]

#: Minimum number of undelivered samples that a reader holds: surplus samples are dropped in the
#: subscription's inbox instead, where they are counted.
_MIN_DEPTH = 128
#: Samples per second above which a reader is polled more often, to avoid losses.
_FAST_HZ = 2000
#: Maximum number of batches that :meth:`SampleReader.flush` takes in a row.
_MAX_BATCHES = 64
#: Seconds that a write blocks in the library, between checks for signals and closing.
_WRITE_SLICE_S = 0.1
#: Seconds that the pump waits for a thread that is delivering samples.
_DELIVERY_TIMEOUT_S = 0.001
#: Seconds that leaving the domain waits for a write in another thread.
_STOP_TIMEOUT_S = 5.0
#: How long :attr:`DdsWriter.problem` names dropped samples.
_REPORT_S = 10.0
#: Writers that a reader remembers; only a robot that restarts for days has more.
_MAX_WRITERS = 1024


def topic_name(name: str) -> str:
    """Return the DDS topic that carries a ROS 2 topic (absolute name)."""
    return f"rt{name}"


class SampleWriter:
    """A DDS writer of payloads.

    Args:
        participant: The participant it belongs to.
        topic: Its DDS topic.
        dds_type: Its DDS type.
        qos: Its profile.
        user_data: User data that it announces in discovery.
        place: Its topic or service, for errors.
        make_topic: Creates the topic, instead of :func:`cyclone.create_topic`.
        timeout_s: Seconds that a write may wait for reliable readers; None waits forever.

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
        timeout_s: float | None = None,
    ) -> None:
        self._participant, self._place = participant, place
        self._timeout_s = math.inf if timeout_s is None else timeout_s
        self._slice_s = min(self._timeout_s, _WRITE_SLICE_S)
        #: Held by a write: the topic must not be deleted before the write ends.
        self._lock = threading.Lock()
        self._closed = False
        #: Flow control of a topic's writer, for readers that fall behind; None without it.
        self._flow: FlowControl | None = None
        with participant.in_use():
            self._topic = make_topic(participant.entity, topic, dds_type)
            with undo_on_error(lambda: cyclone.delete(self._topic)):
                policies = qos_of(qos, writer=True, user_data=user_data)
                if qos.reliability is Reliability.RELIABLE:
                    policies.wait_at_most(self._slice_s)
                self.entity = cyclone.create_writer(
                    participant.entity, self._topic, policies, place
                )
                self.guid = cyclone.guid(self.entity)
                self._type = cyclone.sertype(self.entity)
            participant.call_before_close(self.entity, self._stop)

    def write_parts(self, parts: Sequence[bytes | bytearray | memoryview]) -> None:
        """Send a payload in one or several parts; Cyclone DDS copies them once.

        Raises:
            NodeClosedError: The writer was closed.
            TimeoutError: A reliable reader did not take it in time.
        """
        with self._lock:
            if self._closed:
                raise NodeClosedError(f"{self._place}: the publisher is closed")
            serdata = sample(self._type, parts, self._place)
            held = False
            try:
                if self._flow is not None:
                    held = self._flow.hold(serdata, sum(map(len, parts)))
                if not held and not send(self.entity, serdata, self._place):
                    self._retry(serdata)
            finally:
                if not held:
                    discard(serdata)

    def _retry(self, serdata: int) -> None:
        """Repeat a write until its timeout; signals such as Ctrl-C are handled in between."""
        deadline = time.monotonic() + self._timeout_s - self._slice_s
        while time.monotonic() < deadline:
            if self._closed:
                raise NodeClosedError(f"{self._place}: the publisher is closed")
            if send(self.entity, serdata, self._place):
                return
        raise TimeoutError(f"{self._place}: the readers took nothing for too long")

    def close(self) -> None:
        """Close the writer; a write that waits in another thread ends with an error.

        It is deleted once its readers have acknowledged everything, or after a second.
        """
        if self._closed:
            return
        self._closed = True
        if self._is_done():
            self._delete()
        else:
            self._participant.lingering.add(self.entity, self._is_done, self._delete)

    def _is_done(self) -> bool:
        """Return whether the readers have acknowledged everything."""
        if self._flow is not None:
            with self._lock:
                self._flow.advance()
                if not self._flow.idle:
                    return False
        return cyclone.acknowledged(self.entity)

    def _poll_flow(self) -> bool:
        assert self._flow is not None
        with self._lock, suppress(NodeClosedError):  # it was deleted
            return self._flow.advance()
        return False

    def _stop(self) -> None:
        """Wait for writes in other threads: the writer will be deleted with the participant."""
        lingers, self._closed = self._closed, True
        # With a timeout: a signal may have interrupted this thread while it holds the lock.
        if self._lock.acquire(timeout=_STOP_TIMEOUT_S):
            if self._flow is not None and not lingers:
                self._flow.close()
            self._lock.release()

    def _delete(self) -> None:
        self._participant.call_before_close(self.entity, None)
        cyclone.delete(self.entity)
        # A write in another thread may be using the topic's type.
        with self._lock:
            if self._flow is not None:
                self._flow.close()
            cyclone.delete(self._topic)


class SampleReader:
    """A DDS reader of payloads, which delivers them on the participant's pump.

    Args:
        participant: The participant it belongs to.
        topic: Its DDS topic.
        dds_type: Its DDS type.
        qos: Its profile; samples beyond its depth are held until they are delivered.
        user_data: User data that it announces in discovery.
        place: Its topic or service, for errors.
        on_taken: Called with the samples, in batches and in order; must return at once.
        make_topic: Creates the topic, instead of :func:`cyclone.create_topic`.
        describe: Returns extra data of a sample for `on_taken`, by the address of its serdata.
        on_matched: Called on the pump's thread when writers have appeared or left.

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
        self._polled = 0.0
        #: Held while samples are taken and delivered, one thread at a time.
        self._delivering = threading.Lock()
        self._batch = Batch(describe)
        policies = qos_of(qos, writer=False, user_data=user_data)
        if qos.history is History.KEEP_LAST:
            policies.set_history(max(qos.depth, _MIN_DEPTH))
        self._events = Event.NONE if on_matched is None else Event.SUBSCRIPTION_MATCHED
        with participant.in_use():
            self._topic = make_topic(participant.entity, topic, dds_type)
            with undo_on_error(lambda: cyclone.delete(self._topic)):
                self.entity = cyclone.create_reader(
                    participant.entity, self._topic, policies, place
                )
                self.guid = cyclone.guid(self.entity)

    def start(self) -> None:
        """Start delivering samples."""
        events = self._events | Event.DATA_AVAILABLE
        self._participant.pump.watch(self.entity, events, self._serve)

    def set_eager(self, eager: bool) -> None:
        """Set whether samples are delivered at once or about thirty times a second."""
        if eager == self._eager or self._closed:
            return
        self._eager = eager
        with suppress(NodeClosedError):  # it was deleted
            set_events(self.entity, self._events | (Event.DATA_AVAILABLE if eager else Event.NONE))
            self._participant.pump.poll(self.entity, None if eager else self._poll)

    def flush(self) -> None:
        """Deliver the waiting samples, unless another thread is delivering."""
        if self._delivering.acquire(blocking=False):
            more = True
            try:
                more = self._deliver(_MAX_BATCHES)
            finally:
                self._delivering.release()
                if more and self._eager:
                    self._participant.pump.poll(self.entity, None)

    def _poll(self) -> bool:
        """Deliver the waiting samples; return whether the rate requires faster polling."""
        if self._closed:
            self._participant.pump.forget(self.entity)
        before, count = self._polled, self._count
        self.flush()
        self._polled = time.monotonic()
        return self._count - count > _FAST_HZ * (self._polled - before)

    def lost(self) -> int:
        """Return how many samples were announced but never received."""
        with suppress(NodeClosedError):  # it was deleted
            self._lost = lost_samples(self.entity)
        return self._lost

    def alive(self) -> int:
        """Return how many of the matched writers assert their liveliness."""
        with suppress(NodeClosedError):  # it was deleted
            return alive_writers(self.entity)
        return 0

    def close(self) -> None:
        """Delete the reader; no sample is delivered afterwards. Safe to call twice."""
        if self._closed:
            return
        self._closed = True
        cyclone.delete(self.entity)
        self._participant.pump.forget(self.entity)
        cyclone.delete(self._topic)

    def _serve(self) -> bool:
        delivering, count = self._delivering, self._count
        if not (delivering.acquire(False) or delivering.acquire(True, _DELIVERY_TIMEOUT_S)):
            return True
        try:
            more = self._deliver(1)
        finally:
            delivering.release()
        # An unread status keeps waking the pump; reading it costs as much as taking a sample.
        if self._on_matched is not None and self._count == count:
            with suppress(NodeClosedError):  # it was deleted
                if subscription_matched(self.entity):
                    self._on_matched()
        return more

    def _deliver(self, batches: int) -> bool:
        """Deliver at most `batches` batches; return whether there may be more."""
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


class DdsWriter(SampleWriter, Writer):
    """The DDS writer of a publisher."""

    def __init__(self, participant: Participant, endpoint: EndpointInfo) -> None:
        super().__init__(
            participant,
            topic_name(endpoint.name),
            mangle_type(endpoint.type),
            endpoint.qos,
            format_user_data({"typehash": endpoint.type_hash}),
            f"topic {endpoint.name}",
        )
        self.gid = self.guid
        participant.add_endpoint(endpoint.node, self.gid, writer=True)
        participant.add_writer(cyclone.handle(self.entity), self.gid, endpoint.type_hash)
        qos = endpoint.qos
        if qos.reliability is Reliability.RELIABLE and qos.history is not History.KEEP_ALL:
            self._flow = FlowControl(
                self.entity,
                max(qos.depth, 1),
                qos.durability is Durability.TRANSIENT_LOCAL,
                participant.fragment_size,
                participant.pump,
                self._place,
                self._poll_flow,
            )

    def lost(self) -> int:
        """Return how many large samples were displaced while others were not acknowledged."""
        return 0 if self._flow is None else self._flow.displaced

    @property
    def problem(self) -> str:  # type: ignore[override]
        """That large samples were displaced in the last 10 s, in words; empty if none was."""
        if self._flow is None or time.monotonic() - self._flow.displaced_at > _REPORT_S:
            return ""
        speed = "are too slow for them"
        advice = self._participant.large_sample_advice
        if advice:
            speed = "take at most about 40 MB/s in datagrams of one packet"
        return (
            f"large messages are dropped here, as subscribers on Fast DDS {speed}: "
            f"{advice or 'publish smaller ones, or fewer'}"
        )

    def write(self, data: bytes | bytearray) -> None:
        """Send a payload; a reliable KEEP_ALL writer waits for slow readers."""
        self.write_parts((data,))

    def assert_liveliness(self) -> None:
        """Assert the liveliness of the publisher."""
        cyclone.assert_liveliness(self.entity, self._place)

    def close(self) -> None:
        """Remove the writer from the graph and close it."""
        self._participant.remove_endpoint(self.gid)
        super().close()


class DdsReader(SampleReader, Reader):
    """The DDS reader of a subscription."""

    def __init__(
        self, participant: Participant, endpoint: EndpointInfo, on_sample: OnSample
    ) -> None:
        self._on_sample = on_sample
        self._writers: dict[int, tuple[bytes, str]] = {}
        super().__init__(
            participant,
            topic_name(endpoint.name),
            mangle_type(endpoint.type),
            endpoint.qos,
            format_user_data({"typehash": endpoint.type_hash}),
            f"topic {endpoint.name}",
            self._on_samples,
        )
        self.gid = self.guid
        participant.add_endpoint(endpoint.node, self.gid, writer=False)
        self.start()

    def close(self) -> None:
        """Remove the reader from the graph and delete it."""
        self._participant.remove_endpoint(self.gid)
        super().close()

    def _on_samples(self, taken: list[Taken]) -> None:
        received, on_sample, writers = time.time_ns(), self._on_sample, self._writers
        for data, sent, handle, _ in taken:
            writer = writers.get(handle)
            if writer is None:
                writer = self._identify(handle)
            on_sample(data, received, sent, writer[0], -1, writer[1])

    def _identify(self, handle: int) -> tuple[bytes, str]:
        """Return a writer's GUID and type hash; both empty if it is already deleted."""
        writer = self._participant.writers.get(handle)
        if writer is None:
            found = cyclone.matched_publication(self.entity, handle)
            if found is None:
                return b"", ""
            writer = found.guid, hash_of(found.user_data)
        if len(self._writers) >= _MAX_WRITERS:
            self._writers.clear()
        self._writers[handle] = writer
        return writer

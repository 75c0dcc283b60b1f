"""The two topics of a DDS service, and the matched peers on them.

Names and user data follow rmw_cyclonedds. Every rmw implementation uses the same, except for the
ids by which rmw_cyclonedds pairs readers and writers.
"""

from __future__ import annotations

import itertools
import logging
import math
import threading
import time
from collections import Counter, deque
from contextlib import suppress
from dataclasses import replace
from enum import Enum
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm import EndpointKind
from rosglass.comm.handle import undo_on_error
from rosglass.comm.names import mangle_type
from rosglass.errors import Error, NodeClosedError
from rosglass.wires.dds import cyclone, cyclone_identity
from rosglass.wires.dds.cyclone import (
    Discovered,
    Event,
    library_with_gil,
    publication_matched,
    qos_of,
)
from rosglass.wires.dds.cyclone_identity import Origins
from rosglass.wires.dds.endpoints import SampleReader, SampleWriter, Taken
from rosglass.wires.dds.graph import format_user_data

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.comm import EndpointInfo
    from rosglass.comm.graph import Graph
    from rosglass.wires.dds.cyclone_identity import Origin
    from rosglass.wires.dds.participant import Participant

__all__ = [
    "PREFIX",
    "REMEDY",
    "MatchedEndpoints",
    "Outbox",
    "Scheme",
    "ServiceEndpoints",
    "in_main_thread",
    "in_this_process",
    "names_of",
    "scheme_of",
]

_log = logging.getLogger("rosglass.ros2")

#: First two bytes of a GUID (RTPS 2.5, section 9.3.1.5).
_CYCLONE = b"\x01\x10"
#: GUID that stands for an unknown peer on Cyclone DDS.
_DEPARTED = _CYCLONE.ljust(16, b"\0")
_VENDORS = {
    b"\x01\x01": "RTI Connext",
    b"\x01\x03": "OpenDDS",
    b"\x01\x0f": "Fast DDS",
    _CYCLONE: "Cyclone DDS",
    b"\x01\x12": "RustDDS",
}
#: A participant's readers and writers share the beginning of its GUID.
PREFIX = 12
#: Remedy for a peer that cannot be served.
REMEDY = "start it with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp, or use zenoh:// with rmw_zenoh_cpp"
#: Number of requests and replies kept until they are acknowledged or delivered.
_DEPTH = 1000
#: Seconds that sending blocks the caller's thread for slow readers.
_SEND_TIMEOUT_S = 0.01
#: Seconds after matching another vendor's writer until its first sample is sure to arrive; see
#: :meth:`ServiceEndpoints._start_probe`. Cyclone DDS's own writers need none.
_SETTLING_S = 0.2
#: Seconds after joining the domain until all peers on a usual network have answered, and until
#: those of other vendors have begun to announce endpoints: some wait for their next heartbeat, sent
#: each second. RustDDS then announces ten a second: discovery is complete after a quiet time, or
#: after a timeout. A client that discovers a server before the server discovers it loses its first
#: request.
_ANSWERED_S, _HEARTBEAT_S, _QUIET_S, _SYNC_TIMEOUT_S = 0.1, 1.2, 0.3, 4.0
#: Peers whose malformed samples are logged, once each.
_MAX_NAMED = 100
#: Number of departed peers to remember: their samples may be delivered later.
_MAX_DEPARTED = 256

_numbers = itertools.count(1)
#: GUID prefixes of this process's participants with services, and how often each is in use.
_here: Counter[bytes] = Counter()


class Scheme(Enum):
    """The way in which a reply identifies its request.

    Measured with, or read in the source of, rmw_cyclonedds, rmw_fastrtps and RustDDS.
    """

    #: rmw_cyclonedds: payloads have 16 bytes after the encapsulation header, the client's number
    #: and the request's, which servers return unchanged.
    HEADER = "header"
    #: All others: plain payloads; a reply's inline QoS carries the identity of its request
    #: (OMG DDS-RPC 1.0), see :mod:`rosglass.wires.dds.cyclone_identity`.
    IDENTITY = "identity"


def scheme_of(guid: bytes) -> Scheme:
    """Return the scheme of a peer, from the GUID of its reader or writer."""
    return Scheme.HEADER if guid.startswith(_CYCLONE) else Scheme.IDENTITY


def _vendor(guid: bytes) -> str:
    return _VENDORS.get(guid[:2], f"DDS vendor {guid[:2].hex()}")


class MatchedEndpoints:
    """The readers or writers that a writer or reader is matched with.

    Args:
        entity: The writer or reader.
        handles: Returns the handles of its counterparts.
        look_up: Returns the counterpart with a handle.

    Attributes:
        all: The counterparts as of the last :meth:`refresh`.
        by_guid: The same by their GUIDs.
    """

    def __init__(
        self,
        entity: int,
        handles: Callable[[int], list[int]],
        look_up: Callable[[int, int], Discovered | None],
    ) -> None:
        self._entity, self._handles, self._look_up = entity, handles, look_up
        #: Includes some that have left.
        self._known: dict[int, Discovered] = {}
        self.all: tuple[Discovered, ...] = ()
        self.by_guid: dict[bytes, Discovered] = {}

    def get(self, handle: int) -> Discovered | None:
        """Return the counterpart with a handle; None if it left and is no longer remembered."""
        known = self._known.get(handle)
        if known is None:
            known = self._look_up(self._entity, handle)
            if known is not None:
                self._known[handle] = known
        return known

    def refresh(self) -> None:
        """Update the counterparts; for one thread at a time."""
        try:
            handles = self._handles(self._entity)
        except Error:  # the entity was deleted
            handles = []
        here = {handle: found for handle in handles if (found := self.get(handle)) is not None}
        if len(self._known) > len(here) + _MAX_DEPARTED:
            self._known = dict(here)
        self.all = tuple(here.values())
        self.by_guid = {found.guid: found for found in self.all}


class ServiceEndpoints:
    """The reader and the writer of a service's client or server.

    A server's writer is created a little later if the participant has only just joined. Both hold
    many samples, whatever the profile, so that no request or reply is lost.

    Args:
        participant: The participant they belong to.
        graph: Source of the names of peers.
        endpoint: The client or server.
        on_taken: Called with the received samples, after :meth:`start`.
        on_matched: Called, mostly on the participant's pump, when peers appear, leave or settle.

    Attributes:
        reader: Receives requests (of a server) or replies (of a client).
        writer: Sends replies or requests; None while it must not exist yet.
        writers: The writers that the reader is matched with.
        readers: The readers that the writer is matched with.
        outbox: The samples that wait to be sent.
        origins: The origins of received samples.
        depth: Maximum number of waiting samples, unless the profile keeps all.
    """

    def __init__(
        self,
        participant: Participant,
        graph: Graph,
        endpoint: EndpointInfo,
        on_taken: Callable[[list[Taken]], None],
        on_matched: Callable[[], None],
    ) -> None:
        self._participant, self._graph, self._node = participant, graph, endpoint.node
        self._service, self._place = endpoint.name, f"service {endpoint.name}"
        self._server = server = endpoint.kind is EndpointKind.SERVICE_SERVER
        self._kind = EndpointKind.SERVICE_CLIENT if server else EndpointKind.SERVICE_SERVER
        self._on_matched = on_matched
        self._started = False
        self._named: set[bytes] = set()
        self._since: dict[bytes, float] = {}
        #: Held to look up matches, and to create or delete writer and probe.
        self._lock = threading.RLock()
        self._probe: list[int] = []
        self.closed = False
        requests = f"rq{endpoint.name}Request", mangle_type(f"{endpoint.type}_Request")
        replies = f"rr{endpoint.name}Reply", mangle_type(f"{endpoint.type}_Response")
        self._received, self._sent = (requests, replies) if server else (replies, requests)
        what = "serviceid" if server else "clientid"
        self._user_data = format_user_data(
            {what: _new_id(participant.guid), "typehash": endpoint.type_hash}
        )
        self.depth = max(endpoint.qos.depth, _DEPTH)
        self._qos = replace(endpoint.qos, depth=self.depth)
        self.outbox = Outbox(self._wake, in_order=not server)
        self.writer: SampleWriter | None = None
        self.readers: MatchedEndpoints | None = None
        self.origins = Origins()
        self.reader = SampleReader(
            participant,
            *self._received,
            self._qos,
            self._user_data,
            self._place,
            on_taken,
            self.origins.create_topic,
            self.origins.pop,
            self.refresh,
        )
        self.writers = MatchedEndpoints(
            self.reader.entity, cyclone.matched_publications, cyclone.matched_publication
        )
        participant.add_endpoint(self._node, self.reader.guid, writer=False)
        _here[participant.guid[:PREFIX]] += 1
        if not server or self._is_discovery_settled():
            with undo_on_error(self.close):
                self._open()

    def start(self) -> None:
        """Start delivering samples and reporting matches."""
        self._started = True
        self.reader.start()
        self.refresh()
        if self.writer is None:
            self._wake(False)

    def is_settled(self, writer: bytes) -> bool:
        """Return whether all samples of a matched writer arrive, including its first."""
        if scheme_of(writer) is Scheme.HEADER:
            return True
        return time.monotonic() - self._since.get(writer, math.inf) >= _SETTLING_S

    def refresh_readers(self) -> None:
        """Look up the matched readers if their number has changed before its event."""
        writer, readers = self.writer, self.readers
        if writer is None or readers is None:
            return
        # The lock that this waits for is never held while Python is called.
        count = library_with_gil().dds_get_matched_subscriptions(writer.entity, None, 0)
        if count >= 0 and count != len(readers.all):
            self.refresh()

    def find_sender(
        self, handle: int, origin: Origin | None
    ) -> tuple[Discovered | None, Origin | None]:
        """Return the writer of a sample, and the sample's origin.

        A peer that left right after sending may never have been matched, but its sample must not be
        lost: the result then has the peer's GUID alone, or only shows that it uses Cyclone DDS.

        Args:
            handle: The writer's handle.
            origin: The recorded origin.

        Returns:
            The writer, None if it is unknown; and the origin, None if it is another sample's.
        """
        found = self.writers.get(handle)
        if found is not None:
            stale = origin is not None and not origin.may_be_of(found.guid)
            return found, None if stale else origin
        if origin is None:
            # A sample without origin is from this process, and so from Cyclone DDS.
            known = not cyclone_identity.reading.problem
            return (Discovered(False, _DEPARTED, handle) if known else None), None
        return (Discovered(False, origin.guid, handle) if origin.guid else None), origin

    def foreign_peers(self) -> list[EndpointInfo]:
        """Return the peers in the graph that do not use Cyclone DDS."""
        return [
            peer
            for peer in self._graph.endpoints(self._kind, self._service)
            if scheme_of(peer.gid) is Scheme.IDENTITY
        ]

    def has_foreign_participants(self) -> bool:
        """Return whether a participant of the domain does not use Cyclone DDS."""
        seen = self._participant.seen
        return seen is not None and not seen.vendors <= {_CYCLONE}

    def _describe_peer(self, guid: bytes) -> str:
        """Return the node and vendor of a reader or writer, for messages."""
        nodes = {
            peer.node.full
            for peer in self._graph.endpoints(self._kind, self._service)
            if peer.gid[:PREFIX] == guid[:PREFIX]
        }
        return f"{' or '.join(sorted(nodes)) or guid.hex()} ({_vendor(guid)})"

    def log_peer(self, guid: bytes, text: str, *values: object) -> None:
        """Log a problem of a peer, once; `text` has a ``%s`` for the peer, then the others."""
        if guid not in self._named and len(self._named) < _MAX_NAMED:
            self._named.add(guid)
            _log.warning(f"%s: {text}", self._service, self._describe_peer(guid), *values)

    def close(self) -> None:
        """Delete reader and writer; safe to call twice."""
        if self.closed:
            return
        self.closed = True
        _here[self._participant.guid[:PREFIX]] -= 1
        self._participant.remove_endpoint(self.reader.guid)
        self.reader.close()
        self.origins.close()
        self.outbox.close()
        with self._lock:
            self._end_probe()
            writer = self.writer
        if writer is not None:
            self._participant.remove_endpoint(writer.guid)
            writer.close()
            self._participant.pump.forget(writer.entity)

    def _open(self) -> None:
        """Create the writer."""
        with self._participant.in_use():
            if self._server:
                # Clients that appear from now on find a complete server, and may call it before it
                # discovers them. Earlier clients may have called another server.
                problem = cyclone.start_at_first_sample(self.reader.entity)
                if problem:
                    _warn_loss(problem)
            writer = SampleWriter(
                self._participant,
                *self._sent,
                self._qos,
                self._user_data,
                self._place,
                # Requests need no identity other than the one that every sample has.
                cyclone_identity.create_reply_topic if self._server else cyclone.create_topic,
                _SEND_TIMEOUT_S,
            )
            with self._lock:
                if self.closed:
                    writer.close()
                    return
                if self._server:
                    cyclone_identity.prepare_reply_writer(writer.entity)
                self.readers = MatchedEndpoints(
                    writer.entity,
                    cyclone.matched_subscriptions,
                    cyclone.matched_subscription,
                )
                self.writer = writer
            self._participant.pump.watch(writer.entity, Event.PUBLICATION_MATCHED, self._on_event)
            self._participant.add_endpoint(self._node, writer.guid, writer=True)

    def _is_discovery_settled(self) -> bool:
        """Return whether clients that discover this server now are already discovered here."""
        now, seen = time.monotonic(), self._participant.seen
        age = now - self._participant.born
        if seen is None or age < _ANSWERED_S or age >= _SYNC_TIMEOUT_S:
            return age >= _ANSWERED_S
        if not self.has_foreign_participants():
            return True
        return age >= _HEARTBEAT_S and now - seen.moved >= _QUIET_S

    def refresh(self) -> None:
        """Look up the matched peers, and report changes."""
        if not self._started or self.closed:
            return
        with self._lock:  # a thread must not overwrite another's newer result
            self.writers.refresh()
            if self.readers is not None:
                self.readers.refresh()
            foreign_peers = {
                found.guid for found in self.writers.all if scheme_of(found.guid) is Scheme.IDENTITY
            }
            new = not foreign_peers <= self._since.keys()
            now, before = time.monotonic(), self._since
            self._since = {guid: before.get(guid, now) for guid in foreign_peers}
            if new and not self.closed:
                self._start_probe()
            if new:
                self._wake(False)
            try:
                self._on_matched()
            except Error as error:
                _log.warning("%s: %s", self._service, error)

    def _start_probe(self) -> None:
        """Create a second reader for a while.

        A writer sends each reader it discovers a heartbeat with its first sequence number. If it
        discovered ours before we discovered it, that heartbeat was lost, and Cyclone DDS drops the
        writer's next sample, or, with :func:`cyclone.start_at_first_sample`, gets it with the next
        heartbeat, 3 s later from Fast DDS. The heartbeat to the second reader counts for both.

        During that time, rmw_fastrtps counts more request readers than reply writers, and considers
        the service unavailable. A second writer would hide that, but then clients call: Fast DDS
        makes the second reader skip their first request, Cyclone DDS skips it for both, and samples
        that the first reader has not received yet are lost (6 of 10,400 requests).
        """
        self._end_probe()
        try:
            with self._participant.in_use():
                participant = self._participant.entity
                self._probe.append(cyclone.create_topic(participant, *self._received))
                policies = qos_of(replace(self._qos, depth=1), writer=False)
                reader = cyclone.create_reader(participant, self._probe[0], policies, self._place)
                self._probe.insert(0, reader)
        except NodeClosedError:
            pass
        except Error as error:
            _log.warning("%s: the first sample of another may be lost: %s", self._service, error)

    def _end_probe(self) -> None:
        for entity in self._probe:
            cyclone.delete(entity)
        self._probe.clear()

    def _wake(self, at_once: bool) -> None:
        """Schedule :meth:`_run_due_jobs` on the pump's thread, now or up to 30 ms later."""
        if self.closed:
            return
        if at_once and self.writer is not None:
            self._participant.pump.poll(self.writer.entity, None)
        else:
            self._participant.pump.poll(self.reader.entity, self._run_due_jobs)

    def _on_event(self) -> None:
        if self.closed or self.writer is None:
            return
        with suppress(NodeClosedError):  # it was deleted
            if publication_matched(self.writer.entity):
                self.refresh()
        if self.outbox.retry():
            self._wake(False)

    def _run_due_jobs(self) -> None:
        """Run the due work on the pump's thread, repeatedly until none is left."""
        if self.closed:
            self._participant.pump.forget(self.reader.entity)
            return
        unsettled = not all(self.is_settled(guid) for guid in self._since)
        if not unsettled and self._probe:
            with self._lock:
                self._end_probe()
            self.refresh()
        if self.writer is None and self._is_discovery_settled():
            try:
                self._open()
            except NodeClosedError:
                return
            except Error as error:
                _log.error("%s cannot be offered: %s", self._service, error)
                self._participant.pump.poll(self.reader.entity, None)
                return
        if not (self.outbox.retry() or unsettled or self.writer is None):
            self._participant.pump.poll(self.reader.entity, None)


@cache
def _warn_loss(problem: str) -> None:
    _log.warning("the first request of a client on Fast DDS or RustDDS may be lost: %s", problem)


def in_main_thread() -> bool:
    """Return whether the calling thread is the main one, where signals raise exceptions."""
    return threading.current_thread() is threading.main_thread()


def in_this_process(guid: bytes) -> bool:
    """Return whether a reader or writer of a service belongs to this process."""
    return _here[guid[:PREFIX]] > 0


def names_of(peers: Iterable[EndpointInfo]) -> str:
    """Return the nodes and vendors of peers, for messages."""
    named = sorted({f"{peer.node} ({_vendor(peer.gid)})" for peer in peers})
    return ", ".join(named)


def _new_id(participant: bytes) -> str:
    """Return a client or service id in rmw_cyclonedds's format."""
    first, *rest = participant[:PREFIX] + next(_numbers).to_bytes(4, "big")
    return ".".join((f"{first:2x}", *(f"{byte:x}" for byte in rest)))


class _Item(NamedTuple):
    attempt: Callable[[], bool]
    deadline: float
    expired: Callable[[], None]


class Outbox:
    """Sends samples at once if possible, and keeps the others for a retry.

    Args:
        wake: Called when :meth:`retry` is due; its argument is whether to retry at once.
        in_order: Whether samples are sent strictly in order.
    """

    def __init__(self, wake: Callable[[bool], None], *, in_order: bool) -> None:
        self._wake, self._in_order = wake, in_order
        #: Any thread appends; only the one that retries removes.
        self._items: deque[_Item] = deque()
        self._closed = False

    def put(
        self,
        attempt: Callable[[], bool],
        timeout_s: float,
        expired: Callable[[], None],
        *,
        now: bool = True,
    ) -> None:
        """Send a sample now, or as soon as possible.

        Args:
            attempt: Sends it; returns False to be called again a little later.
            timeout_s: Seconds after which the sample is given up.
            expired: Called then, and if the sample cannot be sent at all.
            now: Whether to call `attempt` in the calling thread first, and raise its errors.
        """
        if now and not (self._in_order and self._items) and attempt():
            return
        if not self._closed:
            self._items.append(_Item(attempt, time.monotonic() + timeout_s, expired))
            self._wake(not now)

    def retry(self) -> bool:
        """Retry the waiting samples; return whether some are left. For one thread."""
        for item in self._items.copy():
            if self._try(item):
                with suppress(ValueError):  # the outbox was closed
                    self._items.remove(item)
            elif self._in_order:
                break
        return bool(self._items)

    def drain(self, seconds: float) -> None:
        """Wait up to `seconds` until no sample is left; not in the thread that retries."""
        until = time.monotonic() + seconds
        while self._items and time.monotonic() < until:
            time.sleep(0.005)

    def close(self) -> None:
        """Drop the waiting samples."""
        self._closed = True
        self._items.clear()

    def _try(self, item: _Item) -> bool:
        try:
            if item.attempt():
                return True
        except NodeClosedError:
            return True
        except Exception as error:  # noqa: BLE001 - its caller must not keep waiting
            _log.warning(
                "what was to be sent is lost: %s", error, exc_info=not isinstance(error, Error)
            )
            item.expired()  # its caller must not keep waiting
            return True
        if time.monotonic() < item.deadline:
            return False
        item.expired()
        return True

"""Identities of samples over Cyclone DDS: the writer of a request, and the request of a reply.

DDS implementations other than Cyclone leave a reply's payload alone: the identity of its request is
among the inline QoS parameters of its RTPS submessage (OMG DDS-RPC 1.0, section 7.8.2; RTPS 2.5,
sections 8.3.8.2, 9.4.2.11 and 9.6.3). Cyclone DDS neither passes these on nor writes them. This
module replaces some of the functions with which it creates and serializes samples, to do both:

- ``from_ser`` creates a sample from packets. The replacement records the sample's number from the
  first packet, and the inline QoS with the request that a reply answers.
- A marked reply begins with its inline QoS. ``get_size`` does not count it; ``to_ser_ref`` returns
  the bytes that follow a submessage's header with the inline QoS in front, and sets the header's
  flag for it; ``to_ser_unref`` releases them. The library does the rest: fragments,
  retransmissions, several networks.

How functions are replaced: each topic's type points to a table of functions (``ddsi_serdata_ops``,
meant for other languages' type support). A topic created here gets its own type, which points to a
copy of that table with some functions replaced. This needs private layouts, those of Cyclone DDS
11.0.1 on 64-bit Linux. They are tested once, on our own memory, before anything relies on them.

All types share one copy of each table. The library finds instances by a sample's hash and table,
and all samples without key have the same hash: with a table for each type, the 33rd instance of
that hash makes its hash table (hopscotch hashing with 32 slots) double until memory runs out.

A copy is never freed, as samples outlive readers, writers and topics.
"""

from __future__ import annotations

import ctypes
import logging
import struct
import sys
import threading
from abc import ABC, abstractmethod
from ctypes import (
    CFUNCTYPE,
    PYFUNCTYPE,
    c_char_p,
    c_int,
    c_size_t,
    c_ubyte,
    c_uint32,
    c_void_p,
    string_at,
)
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.handle import undo_on_error
from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone import library_with_gil
from rosglass.wires.dds.cyclone_samples import COPIED, payload

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.wires.dds.endpoints import SampleWriter

__all__ = [
    "SDK_DATA",
    "UNKNOWN_GUID",
    "UNKNOWN_SEQUENCE",
    "Hook",
    "Identity",
    "Origin",
    "Origins",
    "create_reply_topic",
    "expect",
    "inline_qos",
    "make_sample",
    "prepare_reply_writer",
    "read_origin",
    "reading",
    "write_reply",
    "writing",
]

_log = logging.getLogger("rosglass.ros2")

#: ``ddsi_serdata_kind`` of a sample with data.
SDK_DATA = 2
#: Place of ``ddsi_sertype.serdata_ops``, and the number of functions in that table.
_OPS_OF_TYPE = 8
_OPS = 17

#: Held while a topic is created: the first one of each hook tests the library.
_lock = threading.Lock()


class Hook(ABC):
    """Replaces serialization functions in the types of topics."""

    def __init__(self) -> None:
        self.problem = ""
        self._tested = False
        #: Our tables and the functions in them, by the address of the library's table.
        self._tables: dict[int, tuple[Any, dict[int, Any]]] = {}

    def create_topic(self, participant: int, name: str, type_name: str) -> int:
        """Create a topic whose type has replaced functions; see `cyclone.create_topic`."""
        with _lock:
            topic = cyclone.create_topic(participant, name, type_name, own_type=True)
            with undo_on_error(lambda: cyclone.delete(topic)):
                sertype = cyclone.sertype(topic)
                if not self._tested:
                    self._tested = True
                    self.problem = self.check(sertype)
                    if self.problem:
                        _log.warning("%s", self.problem)
                elif not self.problem:
                    self._install(sertype)
        return topic

    def prepare(self, sertype: int) -> None:
        """Replace the functions of a type that has one user."""
        with _lock:
            if not self.problem:
                self._install(sertype)

    def function(self, sertype: int, place: int) -> Any:
        """Return the function that the library calls for a type, by its place in the table."""
        return _table_of(sertype)[place]

    @abstractmethod
    def replace(self, originals: Any) -> dict[int, Any]:
        """Return the replacements, which call the original functions, by place in the table."""

    @abstractmethod
    def test(self, sertype: int) -> None:
        """Raise an error if the functions do not work with samples of a type."""

    def check(self, sertype: int) -> str:
        """Replace a type's functions; return why that is not possible, empty if it is."""
        if strange := cyclone.untested_version():
            return strange
        if sys.platform != "linux" or sys.byteorder != "little":
            return f"DDS on {sys.platform} does without identities: it was never tried there"
        pointer = c_void_p.from_address(sertype + _OPS_OF_TYPE)
        originals = pointer.value
        try:
            self._install(sertype)
            self.test(sertype)
        except Exception as error:  # noqa: BLE001 - of an unknown build; it is reported
            pointer.value = originals
            return (
                f"Cyclone DDS {cyclone.VERSION} is built differently on this machine "
                f"({type(self).__name__}: {error!r})"
            )
        return ""

    def _install(self, sertype: int) -> None:
        pointer = c_void_p.from_address(sertype + _OPS_OF_TYPE)
        originals = pointer.value
        assert originals is not None
        if any(originals == ctypes.addressof(table) for table, _ in self._tables.values()):
            return
        if originals not in self._tables:
            table = (c_void_p * _OPS).from_buffer_copy(_table_of(sertype))
            replaced = self.replace(_table_of(sertype))
            for place, function in replaced.items():
                table[place] = ctypes.cast(function, c_void_p)
            self._tables[originals] = table, replaced
        pointer.value = ctypes.addressof(self._tables[originals][0])


def _table_of(sertype: int) -> Any:
    """Return the table of functions that a type points to."""
    address = c_void_p.from_address(sertype + _OPS_OF_TYPE).value
    assert address is not None
    return (c_void_p * _OPS).from_address(address)


def make_sample(sertype: int, data: bytes) -> int:
    """Return the address of a new serdata, for tests; raises ValueError if none is created."""
    part = (c_size_t * 2)(ctypes.cast(c_char_p(data), c_void_p).value or 0, len(data))
    made = library_with_gil().ddsi_serdata_from_ser_iov(sertype, SDK_DATA, 1, part, len(data))
    if not made:
        raise ValueError("no sample can be made")
    return int(made)


def expect(found: object, wanted: object) -> None:
    """Raise ValueError if a test finds something other than `wanted`."""
    if found != wanted:
        raise ValueError(f"{found!r} instead of {wanted!r}")


#: An unknown GUID.
UNKNOWN_GUID = bytes(16)
#: SEQUENCENUMBER_UNKNOWN (RTPS 2.5, section 8.3.5.4).
UNKNOWN_SEQUENCE = -(2**32)

_DATA, _DATA_FRAG = 0x15, 0x16
_LITTLE_ENDIAN, _INLINE_QOS = 0x01, 0x02
#: Offset in a submessage from which octetsToInlineQos counts.
_COUNTED_FROM = 8
#: flags, octetsToInlineQos, writerId, writerSN of a DATA or DATA_FRAG submessage.
_HEADER = struct.Struct("=xB4xH4xIiI")
_SENTINEL = 0x0001
#: PID_RELATED_SAMPLE_IDENTITY: the standard's number, and the one eProsima uses.
_RELATED = (0x0083, 0x800F)
_IDENTITY_SIZE = 24


class Identity(NamedTuple):
    """The identity of a sample.

    Attributes:
        guid: The writer's GUID (a client may give that of its reply reader instead), 16 bytes.
        sequence: The writer's number for it.
    """

    guid: bytes
    sequence: int


class Origin(NamedTuple):
    """The origin of a received sample.

    Attributes:
        entity: The last 4 bytes of its writer's GUID.
        sequence: The writer's number for it.
        related: The request that it answers, or the identity that a client gives in a request; None
            if it has no such identity.
        prefix: The beginning of its writer's GUID, empty if unknown.
        taken: Whether it was already delivered on the receiving thread.
    """

    entity: bytes
    sequence: int
    related: Identity | None
    prefix: bytes = b""
    taken: bool = False

    @property
    def guid(self) -> bytes:
        """Its writer's GUID, empty if unknown."""
        return self.prefix + self.entity if self.prefix else b""

    def may_be_of(self, guid: bytes) -> bool:
        """Return whether its writer may be the one with the GUID `guid`."""
        return guid.startswith(self.prefix) and guid.endswith(self.entity)


def inline_qos(identity: Identity) -> bytes:
    """Return inline QoS, little endian, that relates a sample to another; always 60 bytes."""
    sequence = identity.sequence
    value = identity.guid + struct.pack("<iI", sequence >> 32, sequence & 0xFFFFFFFF)
    parameters = [struct.pack("<HH", pid, _IDENTITY_SIZE) + value for pid in _RELATED]
    return b"".join((*parameters, struct.pack("<HH", _SENTINEL, 0)))


def read_origin(submessage: bytes) -> Origin | None:
    """Return the origin of the sample in a submessage; None if it has no sample.

    Args:
        submessage: A DATA or DATA_FRAG submessage up to its payload, after Cyclone DDS has parsed
            it: the numbers of its fixed part in the machine's byte order, its parameters as
            received.
    """
    if len(submessage) < _HEADER.size or submessage[0] not in (_DATA, _DATA_FRAG):
        return None
    flags, to_qos, entity, high, low = _HEADER.unpack_from(submessage)
    related = None
    if flags & _INLINE_QOS:
        order = "<" if flags & _LITTLE_ENDIAN else ">"
        related = _find_related(submessage, _COUNTED_FROM + to_qos, order)
    sequence = (high << 32) + low
    return Origin(entity.to_bytes(4, "big"), sequence, related)


def _find_related(data: bytes, at: int, order: str) -> Identity | None:
    """Return the identity in a parameter list; the list may be malformed."""
    parameter = struct.Struct(f"{order}HH")
    while at + parameter.size <= len(data):
        pid, size = parameter.unpack_from(data, at)
        at += parameter.size
        if pid == _SENTINEL or at + size > len(data):
            return None
        if pid in _RELATED and size >= _IDENTITY_SIZE:
            guid, high, low = struct.unpack_from(f"{order}16siI", data, at)
            return Identity(guid, (high << 32) + low)
        at += size + -size % 4
    return None


if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeAlias

    Take: TypeAlias = Callable[[Origin, bytes | memoryview], bool]


#: Place in ``ddsi_serdata_ops``.
_FROM_SER = 2
#: ``ddsi_rdata``: rmsg, nextfrag, min, maxp1, submsg_zoff, payload_zoff, keyhash_zoff; and the
#: offset of the packet in a ``ddsi_rmsg``.
_RDATA = struct.Struct("=QQIIHHH2x")
_PACKET = 48
_RTPS_HEADER = 20
_INFO_SOURCE = 0x0C
#: Maximum number of origins kept for a reader's samples until they are taken. Origins of samples
#: dropped unread are removed when their memory is reused, or by this limit.
_MAX_ORIGINS = 16384

_from_ser_type = c_void_p, c_void_p, c_int, c_void_p, c_size_t
_FromSer, _FromSerFree = PYFUNCTYPE(*_from_ser_type), CFUNCTYPE(*_from_ser_type)

#: By the address of their reader's type.
readers: dict[int, Origins] = {}


class Origins:
    """The origins of a reader's samples.

    Each reader has its own: a sample that is dropped unread leaves its origin behind, and its
    address may later be that of another reader's sample.

    Attributes:
        recorded: Those of samples that are not taken yet, by the address of the sample.
    """

    def __init__(self) -> None:
        self._type = 0
        self.recorded: dict[int, Origin] = {}
        self._take: Take | None = None

    def create_topic(self, participant: int, name: str, type_name: str) -> int:
        """Create the topic of the one reader; see `cyclone.create_topic`."""
        topic = reading.create_topic(participant, name, type_name)
        self.follow(cyclone.sertype(topic))
        return topic

    def follow(self, sertype: int) -> None:
        """Record the origins of samples of a type, by the type's address."""
        self._type = sertype
        readers[sertype] = self

    def pop(self, serdata: int) -> Origin | None:
        """Return and remove the origin of a sample; None if it was sent within this process.

        For a sample from this process, the result may be the origin of one that was dropped unread:
        see :meth:`Origin.may_be_of`.

        Args:
            serdata: The sample's address, while the caller still holds a reference to it.
        """
        return self.recorded.pop(serdata, None)

    def set_receiver(self, take: Take | None) -> None:
        """Set the function that takes samples of other processes on their receiving thread.

        This saves waking a thread, a fifth of a service call's time. The library waits for `take`
        in the middle of its work: `take` must not call it except to write, and must not block.

        Args:
            take: Takes a sample's origin and payload, and returns whether it took them. Samples
                that it declines are delivered later, with the same origin. None ends this.
        """
        self._take = take

    def close(self) -> None:
        """Remove all origins, after the reader was deleted."""
        self._take = None
        if readers.get(self._type) is self:
            del readers[self._type]
        self.recorded.clear()

    def record(self, serdata: int, fragments: int) -> None:
        """Record the origin of a sample just created from fragments, and deliver it."""
        self.recorded.pop(serdata, None)
        found = _read(fragments)
        if found is None:
            return
        while len(self.recorded) >= _MAX_ORIGINS:
            self.recorded.pop(next(iter(self.recorded)), None)
        self.recorded[serdata] = found
        take = self._take
        if take is not None:
            library_with_gil().ddsi_serdata_ref(serdata)
            if take(found, payload(serdata)):
                self.recorded[serdata] = found._replace(taken=True)


class _Reading(Hook):
    """Records the origins of received samples."""

    def replace(self, originals: Any) -> dict[int, Any]:
        small, big = _FromSer(originals[_FROM_SER]), _FromSerFree(originals[_FROM_SER])

        def from_ser(sertype: int, kind: int, fragments: int, size: int) -> int | None:
            make = small if size <= COPIED else big
            serdata: int | None = make(sertype, kind, fragments, size)
            try:
                origins = readers.get(sertype)
                if serdata is not None and kind == SDK_DATA and origins is not None:
                    origins.record(serdata, fragments)
            except BaseException:  # noqa: BLE001 - Cyclone DDS calls this; guarded() costs 1 us
                _log.exception("the origin of a DDS sample cannot be noted")
            return serdata

        return {_FROM_SER: _FromSer(from_ser)}

    def test(self, sertype: int) -> None:
        data = b"\x00\x01\x00\x00rosglass"
        related = Identity(bytes(range(16)), (5 << 32) + 6)
        sent = Origin(b"\x00\x00\x12\x03", (3 << 32) + 4, related, bytes(range(12)))
        header = struct.pack("=BBHHHIIiI", 0x15, 7, 0, 0, 16, 0, 0x1203, 3, 4)
        guid = struct.pack("=3I", *struct.unpack(">3I", sent.prefix))
        before = bytes(8) + guid + header + inline_qos(related)
        packet = ctypes.create_string_buffer(bytes(_PACKET) + before + data)
        place = ctypes.addressof(packet)
        rdata = ctypes.create_string_buffer(
            _RDATA.pack(place, 0, 0, len(data), 20, len(before), 0), _RDATA.size
        )
        # Called through the table, as in the library.
        from_ser = _FromSer(self.function(sertype, _FROM_SER))
        origins = Origins()
        origins.follow(sertype)
        try:
            serdata = from_ser(sertype, SDK_DATA, ctypes.addressof(rdata), len(data))
        finally:
            found = dict(origins.recorded)
            origins.close()
        expect(bytes(payload(serdata)), data)
        expect(found, {serdata: sent})


#: Reads the origins of received samples; `problem` is the reason why it cannot.
reading = _Reading()


def _read(fragments: int) -> Origin | None:
    """Return the origin of a sample from the address of its first fragment."""
    rmsg, _, first, _, submessage, end, _ = _RDATA.unpack(string_at(fragments, _RDATA.size))
    if first != 0 or not rmsg or end <= submessage:
        return None
    # The library has checked that submessage and parameters end where the payload begins.
    found = read_origin(string_at(rmsg + _PACKET + submessage, end - submessage))
    return None if found is None else found._replace(prefix=_prefix(rmsg, submessage))


def _prefix(rmsg: int, submessage: int) -> bytes:
    """Return the sender's GUID prefix; empty if that would take parsing the whole packet."""
    packet = string_at(rmsg + _PACKET, submessage)
    at = _RTPS_HEADER
    while at + 4 <= submessage:
        name, flags, size = struct.unpack_from("=BBH", packet, at)
        if name == _INFO_SOURCE or not flags & 1:
            return b""
        at += 4 + size
    return struct.pack(">3I", *struct.unpack_from("=3I", packet, 8)) if at == submessage else b""


#: Places in ``ddsi_serdata_ops``.
_GET_SIZE, _TO_SER_REF, _TO_SER_UNREF = 1, 7, 8
#: ``ddsi_xmsg``: maxsz, sz, have_params, refd_payload, which precede refd_payload_iov; and the
#: offsets of kind and data.
_XMSG = struct.Struct("=QQi4xQ")
_XMSG_ROOM = 128
_XMSG_KIND, _XMSG_DATA = 24, 112
_XMSG_KINDS = (1, 2, 3)
#: Headers before an xmsg's payload, by whether the payload begins the sample and by their size: the
#: offset of DATA or DATA_FRAG (a sample's first follows INFO_TS), its id, octetsToInlineQos.
_FORMS = {(True, 36): (12, 0x15, 16), (True, 48): (12, 0x16, 28), (False, 36): (0, 0x16, 28)}
#: ``ddsi_xmsg_data``: offsets and ids of INFO_SRC and INFO_DST, then the offset of the rest.
_INFOS = ((0, 0x0C), (24, 0x0E))
_SUBMESSAGES = 40
_INLINE_QOS = 0x02
#: Marks a sample that begins with inline QoS, followed by the payload with its own header: an
#: encapsulation header with unused options, and the first parameter.
_MARK = b"\x00\x01\xa5\x00"
_MARKED = _MARK + b"\x83\x00\x18\x00"
_QOS_SIZE = 60
_BEFORE = len(_MARK) + _QOS_SIZE

_GetSize = PYFUNCTYPE(c_uint32, c_void_p)
_ToSerRef = PYFUNCTYPE(c_void_p, c_void_p, c_size_t, c_size_t, c_void_p)
_ToSerUnref = PYFUNCTYPE(None, c_void_p, c_void_p)

_sending = threading.local()
#: Fragments with inline QoS that the library is sending, by their address.
_fragments: dict[int, Any] = {}


def create_reply_topic(participant: int, name: str, type_name: str) -> int:
    """Create a topic for :func:`prepare_reply_writer`'s writer; see `cyclone.create_topic`.

    Do not use the writer in the main thread: an exception that a signal raises there would be lost
    in the library.
    """
    return writing.create_topic(participant, name, type_name)


def prepare_reply_writer(writer: int) -> None:
    """Prepare a writer for :func:`write_reply`, before it writes anything."""
    # As its topic's type is not the library's usual one, the writer has its own type.
    writing.prepare(cyclone.sertype(writer))


def write_reply(
    writer: SampleWriter, identity: Identity, parts: Sequence[bytes | bytearray | memoryview]
) -> bool:
    """Send a payload with inline QoS that relates it to another sample.

    Args:
        writer: A writer prepared by :func:`prepare_reply_writer`.
        identity: The other sample's identity.
        parts: The payload in one piece or several; it begins with the encapsulation header.

    Returns:
        Whether it was sent with inline QoS; False if no reader outside this process is matched.
    """
    _sending.identity = False
    begin = _MARK + inline_qos(identity)
    small = sum(map(len, parts)) <= COPIED
    writer.write_parts((b"".join((begin, *parts)),) if small else (begin, *parts))
    return bool(_sending.identity)


class _Writing(Hook):
    """Sends inline QoS with marked samples."""

    #: Offset of the encapsulation header in a serdata.
    _header = 0

    def replace(self, originals: Any) -> dict[int, Any]:
        original_size = _GetSize(originals[_GET_SIZE])
        original_ref = _ToSerRef(originals[_TO_SER_REF])
        original_unref = _ToSerUnref(originals[_TO_SER_UNREF])

        def get_size(serdata: int) -> int:
            size: int = original_size(serdata)
            return size - _BEFORE if self._marked(serdata) else size

        def to_ser_ref(serdata: int, offset: int, size: int, part: int) -> int:
            kept: int = original_ref(serdata, offset, size, part)
            try:
                if self._marked(serdata):
                    self._give(serdata + self._header, offset, size, part)
            except BaseException:  # noqa: BLE001 - as above
                _log.exception("a DDS sample cannot be sent with its identity")
            return kept

        def to_ser_unref(serdata: int, part: int) -> None:
            _fragments.pop(c_void_p.from_address(part).value or 0, None)
            original_unref(serdata, part)

        return {
            _GET_SIZE: _GetSize(get_size),
            _TO_SER_REF: _ToSerRef(to_ser_ref),
            _TO_SER_UNREF: _ToSerUnref(to_ser_unref),
        }

    @staticmethod
    def _give(marked: int, offset: int, size: int, part: int) -> None:
        """Fill in the address and size of the bytes that follow a submessage's header."""
        begin = marked + _BEFORE + offset
        if _flag(part, first=offset == 0):
            _sending.identity = True
            if offset == 0:
                begin = marked + len(_MARK)
            else:
                # Each fragment has it: RustDDS reads it from the last one that it receives.
                qos = string_at(marked + len(_MARK), _QOS_SIZE)
                held = ctypes.create_string_buffer(qos + string_at(begin, size), _QOS_SIZE + size)
                begin = ctypes.addressof(held)
                _fragments[begin] = held
            size += _QOS_SIZE
        c_void_p.from_address(part).value = begin
        c_size_t.from_address(part + 8).value = size

    def test(self, sertype: int) -> None:
        self._measure(sertype)
        data = b"\x00\x01\x00\x00rosglass"
        qos = inline_qos(Identity(bytes(range(16)), 7))
        serdata = make_sample(sertype, _MARK + qos + data)
        lib = library_with_gil()
        expect(lib.ddsi_serdata_size(serdata), len(data))
        # Samples within this process have no header to flag.
        expect(_bytes_of(serdata, 0, len(data), None), data)
        expect(_bytes_of(serdata, 4, 8, None), data[4:])
        for first, wanted in ((True, qos + data), (False, qos + data[4:])):
            place, name, to_qos = _FORMS[first, 36]
            held = bytearray(_SUBMESSAGES + 36)
            for at, info in _INFOS:
                held[at] = info
            struct.pack_into("=BBHHH", held, _SUBMESSAGES + place, name, 5, 0, 0, to_qos)
            offset = 0 if first else 4
            expect(_bytes_of(serdata, offset, len(data) - offset, held), wanted)
            expect(held[_SUBMESSAGES + place + 1], 5 | _INLINE_QOS)
        expect(_fragments, {})
        lib.ddsi_serdata_unref(serdata)

    def _measure(self, sertype: int) -> None:
        part = (c_size_t * 2)()
        serdata = make_sample(sertype, b"\x00\x01\x00\x00rosglass")
        lib = library_with_gil()
        lib.ddsi_serdata_to_ser_ref(serdata, 0, 12, part)
        self._header = part[0] - serdata
        lib.ddsi_serdata_to_ser_unref(serdata, part)
        lib.ddsi_serdata_unref(serdata)
        if not 64 <= self._header <= 256:
            raise ValueError(f"payloads begin at {self._header}")

    def _marked(self, serdata: int) -> bool:
        return string_at(serdata + self._header, len(_MARKED)) == _MARKED


#: Writes inline QoS; `problem` is the reason why it cannot.
writing = _Writing()


def _flag(part: int, *, first: bool) -> bool:
    """Flag in a submessage's header that inline QoS follows; return False if it has no header.

    Args:
        part: The place for the payload's address: an xmsg's refd_payload_iov, unless the sample is
            about to be copied for a reader in this process.
        first: Whether the payload begins the sample.
    """
    room, size, parameters, referred = _XMSG.unpack(string_at(part - _XMSG.size, _XMSG.size))
    form = _FORMS.get((first, size))
    if form is None or room != _XMSG_ROOM or parameters or referred:
        return False
    if c_uint32.from_address(part + _XMSG_KIND).value not in _XMSG_KINDS:
        return False
    data = c_void_p.from_address(part + _XMSG_DATA).value
    if not data or data % 8:
        return False
    held = string_at(data, _SUBMESSAGES + size)
    if any(held[at] != name for at, name in _INFOS):
        return False
    place = _SUBMESSAGES + form[0]
    name, flags, to_qos = struct.unpack_from("=BB4xH", held, place)
    if (name, to_qos) != form[1:] or flags & _INLINE_QOS:
        return False
    c_ubyte.from_address(data + place + 1).value = flags | _INLINE_QOS
    return True


def _bytes_of(serdata: int, offset: int, size: int, packet: bytearray | None) -> bytes:
    """Return the bytes of a sample that are sent after the headers in `packet`, if any."""
    room = ctypes.create_string_buffer(_XMSG.size + _XMSG_DATA + 8)
    part = ctypes.addressof(room) + _XMSG.size
    if packet is not None:
        headers = (c_ubyte * len(packet)).from_buffer(packet)
        _XMSG.pack_into(room, 0, _XMSG_ROOM, 36, 0, 0)
        c_uint32.from_address(part + _XMSG_KIND).value = 1
        c_void_p.from_address(part + _XMSG_DATA).value = ctypes.addressof(headers)
    lib = library_with_gil()
    lib.ddsi_serdata_to_ser_ref(serdata, offset, size, part)
    data = string_at(c_void_p.from_address(part).value or 0, c_size_t.from_address(part + 8).value)
    lib.ddsi_serdata_to_ser_unref(serdata, part)
    return data

"""Sample identities into and out of Cyclone DDS, which has no word for them.

Fast DDS, RustDDS and others tell in inline QoS which request a reply answers
(:mod:`rosglass.ros2.dds_identity`). The library drops such parameters when it receives, and writes
none. But it makes and reads samples through a table of functions that each topic's type points to
(``ddsi_serdata_ops``, meant for other languages' type support), so a topic made here gets a table
of its own with some entries replaced:

- Receiving: ``from_ser`` is given the packet; what it says is noted under the new sample's address.
- Sending: a sample that is marked begins with its inline QoS. ``get_size`` leaves that out;
  ``to_ser_ref``, asked for the bytes that follow a submessage's header, returns the inline QoS with
  them and sets the header's flag for it; ``to_ser_unref`` gives them back. The library does the
  rest: fragments, retransmissions, several networks.

That takes private layouts, those of Cyclone DDS 11.0.1 on 64-bit Linux. They are tested once, on
memory of our own, before anything relies on them; where that fails, :func:`reading_problem` and
:func:`writing_problem` say so, and peers other than Cyclone DDS cannot be called or answered.

What the library was given is never freed, as samples outlive readers, writers and topics.
"""

from __future__ import annotations

import ctypes
import logging
import struct
import sys
import threading
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
from typing import TYPE_CHECKING, Any

from rosglass.ros2 import cyclone
from rosglass.ros2.cyclone import keeping
from rosglass.ros2.cyclone_samples import COPIED, payload
from rosglass.ros2.dds_identity import Identity, Origin, inline_qos, read_origin

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.ros2.dds_endpoints import SampleWriter

__all__ = [
    "create_reading_topic",
    "create_writing_topic",
    "hasten",
    "origin",
    "prepare",
    "reading_problem",
    "write",
    "writing_problem",
]

_log = logging.getLogger("rosglass.ros2")

#: ``ddsi_sertype.serdata_ops``, and the entries of ``ddsi_serdata_ops`` that are replaced.
_OPS_OF_TYPE = 8
_OPS = 17
_GET_SIZE, _FROM_SER, _TO_SER_REF, _TO_SER_UNREF = 1, 2, 7, 8
_SDK_DATA = 2
#: ``ddsi_rdata``: rmsg, nextfrag, min, maxp1, submsg_zoff, payload_zoff, keyhash_zoff; and where
#: the packet begins that a ``ddsi_rmsg`` holds.
_RDATA = struct.Struct("=QQIIHHH2x")
_PACKET = 48
#: ``ddsi_xmsg``: maxsz, sz, have_params, refd_payload, which come before refd_payload_iov; and how
#: far behind its beginning kind and data are.
_XMSG = struct.Struct("=QQi4xQ")
_XMSG_ROOM = 128
_XMSG_KIND, _XMSG_DATA = 24, 112
_XMSG_KINDS = (1, 2, 3)
#: What an xmsg has before its payload, by whether that begins the sample and by its size: where the
#: header of DATA or DATA_FRAG begins (a sample's first follows INFO_TS), its id, octetsToInlineQos.
_FORMS = {(True, 36): (12, 0x15, 16), (True, 48): (12, 0x16, 28), (False, 36): (0, 0x16, 28)}
#: ``ddsi_xmsg_data``: where INFO_SRC and INFO_DST begin, with their ids, and then the rest.
_INFOS = ((0, 0x0C), (24, 0x0E))
_SUBMESSAGES = 40
_INLINE_QOS = 0x02
#: Begins a sample with inline QoS, the payload's own header coming after that: an encapsulation
#: header with options that nobody uses, and the first parameter.
_MARK = b"\x00\x01\xa5\x00"
_MARKED = _MARK + b"\x83\x00\x18\x00"
_QOS_SIZE = 60
_BEFORE = len(_MARK) + _QOS_SIZE
#: Origins that are kept until somebody asks for them. Those of samples that a reader drops unread
#: make room when their memory is used again, or here.
_MAX_ORIGINS = 16384

_from_ser_type = c_void_p, c_void_p, c_int, c_void_p, c_size_t
_FromSer, _FromSerFree = PYFUNCTYPE(*_from_ser_type), CFUNCTYPE(*_from_ser_type)
_GetSize = PYFUNCTYPE(c_uint32, c_void_p)
_ToSerRef = PYFUNCTYPE(c_void_p, c_void_p, c_size_t, c_size_t, c_void_p)
_ToSerUnref = PYFUNCTYPE(None, c_void_p, c_void_p)

_lock = threading.Lock()
_origins: dict[int, Origin] = {}
_told = threading.local()
#: What to call with samples while they are received, by the address of their type.
_hasty: dict[int, Callable[[Origin, bytes | memoryview], None]] = {}
#: Fragments with inline QoS that the library is sending, by their address.
_fragments: dict[int, Any] = {}
#: By the address of the type that points to them; the address may be another type's later.
_tables: dict[int, Any] = {}


def create_reading_topic(participant: int, name: str, type_name: str) -> int:
    """Create a topic whose readers' samples have an :func:`origin`; see `cyclone.create_topic`."""
    return _reading.create_topic(participant, name, type_name)


def create_writing_topic(participant: int, name: str, type_name: str) -> int:
    """Create a topic for a writer that :func:`prepare` is applied to; see `cyclone.create_topic`.

    The writer must not be used in the main thread: an exception raised there by a signal would end
    up in the library.
    """
    return _writing.create_topic(participant, name, type_name)


def prepare(writer: int) -> None:
    """Let a writer be given to :func:`write`, before it writes anything."""
    # As its topic's type is not the library's usual one, it has a type of its own.
    _writing.prepare(cyclone.sertype(writer))


def hasten(reader: int, take: Callable[[Origin, bytes | memoryview], None]) -> Callable[[], None]:
    """Have samples of other processes handed on while they are received, besides later on.

    It saves waking a thread, a quarter of a service call's time. Only for what cannot wait for
    anything: it holds up everything else that is received.

    Args:
        reader: Of a topic of :func:`create_reading_topic`.
        take: Takes a sample's origin and payload.

    Returns:
        What ends it.
    """
    sertype = cyclone.sertype(reader)
    if not _reading.problem:
        _hasty[sertype] = take

    def end() -> None:
        _hasty.pop(sertype, None)

    return end


def origin(serdata: int) -> Origin | None:
    """Return where a received sample comes from, once; None when it came within this process.

    Args:
        serdata: The sample's address, while the caller still holds a reference to it.
    """
    return _origins.pop(serdata, None)


def write(
    writer: SampleWriter, identity: Identity, parts: Sequence[bytes | bytearray | memoryview]
) -> bool:
    """Send a payload with inline QoS that relates it to another sample.

    Args:
        writer: One that :func:`prepare` was applied to.
        identity: What it relates to.
        parts: The payload in one piece or several; it begins with the encapsulation header.

    Returns:
        Whether it went out with inline QoS; not so if nobody outside this process is matched.
    """
    _told.identity = False
    begin = _MARK + inline_qos(identity)
    small = sum(map(len, parts)) <= COPIED
    writer.write((b"".join((begin, *parts)),) if small else (begin, *parts))
    return bool(_told.identity)


def reading_problem() -> str:
    """Return why received samples have no origin on this machine; empty when they have."""
    return _reading.problem


def writing_problem() -> str:
    """Return why nothing can be sent with inline QoS on this machine; empty when it can."""
    return _writing.problem


class _Hook:
    """Replaces functions of the types of topics."""

    def __init__(self) -> None:
        self.problem = ""
        self._tested = False
        self._replaced: dict[int, dict[int, Any]] = {}

    def create_topic(self, participant: int, name: str, type_name: str) -> int:
        # Topics whose types look the same to the library share one: nobody may get in between.
        with _lock:
            topic = cyclone.create_topic(participant, name, type_name)
            try:
                sertype = cyclone.sertype(topic)
                if not self._tested:
                    self._tested = True
                    self.problem = self._try(sertype)
                    if self.problem:
                        _log.warning("%s", self.problem)
                elif not self.problem:
                    self._install(sertype)
            except BaseException:
                cyclone.delete(topic)
                raise
        return topic

    def prepare(self, sertype: int) -> None:
        """Replace the functions of a type that nobody else uses."""
        with _lock:
            if not self.problem:
                self._install(sertype)

    def replace(self, originals: Any) -> dict[int, Any]:
        """Return functions by their place in the table, which call the original ones."""
        raise NotImplementedError

    def test(self, sertype: int) -> None:
        """Raise when the functions do not do what they should with samples of a type."""
        raise NotImplementedError

    def _try(self, sertype: int) -> str:
        if strange := cyclone.strange_version():
            return strange
        if sys.platform != "linux" or sys.byteorder != "little":
            return f"DDS on {sys.platform} does without identities: it was never tried there"
        pointer = c_void_p.from_address(sertype + _OPS_OF_TYPE)
        originals = pointer.value
        try:
            self._install(sertype)
            self.test(sertype)
        except Exception as error:
            pointer.value = originals
            return (
                f"Cyclone DDS {cyclone.VERSION} is built differently on this machine "
                f"({type(self).__name__}: {error!r})"
            )
        return ""

    def _install(self, sertype: int) -> None:
        pointer = c_void_p.from_address(sertype + _OPS_OF_TYPE)
        table = _tables.get(sertype)
        if table is not None and pointer.value == ctypes.addressof(table):
            return
        originals = pointer.value
        assert originals is not None
        if originals not in self._replaced:
            self._replaced[originals] = self.replace((c_void_p * _OPS).from_address(originals))
        # One for each type: otherwise the library would take types for the same that it knows as
        # two, and remove the wrong one when a topic is deleted.
        if table is None:
            table = _tables[sertype] = (c_void_p * _OPS)()
        ctypes.memmove(table, originals, ctypes.sizeof(table))
        for place, function in self._replaced[originals].items():
            table[place] = ctypes.cast(function, c_void_p)
        pointer.value = ctypes.addressof(table)


class _Reading(_Hook):
    """Notes where samples come from."""

    def replace(self, originals: Any) -> dict[int, Any]:
        small, big = _FromSer(originals[_FROM_SER]), _FromSerFree(originals[_FROM_SER])
        lib = keeping()

        def from_ser(sertype: int, kind: int, fragments: int, size: int) -> int | None:
            make = small if size <= COPIED else big
            serdata: int | None = make(sertype, kind, fragments, size)
            try:
                if serdata is not None and kind == _SDK_DATA:
                    found = _note(serdata, fragments)
                    take = _hasty.get(sertype)
                    if take is not None and found is not None:
                        lib.ddsi_serdata_ref(serdata)
                        take(found, payload(serdata))
            except Exception:
                _log.exception("the origin of a DDS sample cannot be noted")
            return serdata

        return {_FROM_SER: _FromSer(from_ser)}

    def test(self, sertype: int) -> None:
        data = b"\x00\x01\x00\x00rosglass"
        sent = Origin(b"\x00\x00\x12\x03", (3 << 32) + 4, Identity(bytes(range(16)), (5 << 32) + 6))
        header = struct.pack("=BBHHHIIiI", 0x15, 7, 0, 0, 16, 0, 0x1203, 3, 4)
        assert sent.related is not None
        before = bytes(20) + header + inline_qos(sent.related)
        packet = ctypes.create_string_buffer(bytes(_PACKET) + before + data)
        place = ctypes.addressof(packet)
        rdata = ctypes.create_string_buffer(
            _RDATA.pack(place, 0, 0, len(data), 20, len(before), 0), _RDATA.size
        )
        # Through the table, as the library does it.
        from_ser = _FromSer(_tables[sertype][_FROM_SER])
        serdata = from_ser(sertype, _SDK_DATA, ctypes.addressof(rdata), len(data))
        noted = origin(serdata)
        _expect(bytes(payload(serdata)), data)
        _expect(noted, sent)


class _Writing(_Hook):
    """Sends inline QoS with samples that are marked."""

    #: From a serdata's beginning to its encapsulation header.
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
            except Exception:
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
        """Fill in where the bytes are that follow a submessage's header, and how many."""
        begin = marked + _BEFORE + offset
        if _flag(part, first=offset == 0):
            _told.identity = True
            if offset == 0:
                begin = marked + len(_MARK)
            else:
                # Each fragment has it: RustDDS looks at the last one that it gets.
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
        serdata = _make(sertype, _MARK + qos + data)
        lib = keeping()
        _expect(lib.ddsi_serdata_size(serdata), len(data))
        # What stays within this process has no header to be flagged.
        _expect(_bytes_of(serdata, 0, len(data), None), data)
        _expect(_bytes_of(serdata, 4, 8, None), data[4:])
        for first, wanted in ((True, qos + data), (False, qos + data[4:])):
            place, name, to_qos = _FORMS[first, 36]
            held = bytearray(_SUBMESSAGES + 36)
            for at, info in _INFOS:
                held[at] = info
            struct.pack_into("=BBHHH", held, _SUBMESSAGES + place, name, 5, 0, 0, to_qos)
            offset = 0 if first else 4
            _expect(_bytes_of(serdata, offset, len(data) - offset, held), wanted)
            _expect(held[_SUBMESSAGES + place + 1], 5 | _INLINE_QOS)
        _expect(_fragments, {})
        lib.ddsi_serdata_unref(serdata)

    def _measure(self, sertype: int) -> None:
        part = (c_size_t * 2)()
        serdata = _make(sertype, b"\x00\x01\x00\x00rosglass")
        lib = keeping()
        lib.ddsi_serdata_to_ser_ref(serdata, 0, 12, part)
        self._header = part[0] - serdata
        lib.ddsi_serdata_to_ser_unref(serdata, part)
        lib.ddsi_serdata_unref(serdata)
        if not 64 <= self._header <= 256:
            raise ValueError(f"payloads begin at {self._header}")

    def _marked(self, serdata: int) -> bool:
        return string_at(serdata + self._header, len(_MARKED)) == _MARKED


_reading, _writing = _Reading(), _Writing()


def _note(serdata: int, fragments: int) -> Origin | None:
    """Note the origin of a sample that was made from fragments of which the first is the first."""
    rmsg, _, first, _, submessage, end, _ = _RDATA.unpack(string_at(fragments, _RDATA.size))
    _origins.pop(serdata, None)
    if first != 0 or not rmsg or end <= submessage:
        return None
    # The library has checked that submessage and parameters end where the payload begins.
    found = read_origin(string_at(rmsg + _PACKET + submessage, end - submessage))
    if found is None:
        return None
    while len(_origins) >= _MAX_ORIGINS:
        _origins.pop(next(iter(_origins)), None)
    _origins[serdata] = found
    return found


def _flag(part: int, *, first: bool) -> bool:
    """Say in a submessage's header that inline QoS follows; returns False when there is no header.

    Args:
        part: Where the library wants the payload's address; an xmsg's refd_payload_iov, unless the
            sample is about to be copied for a reader in this process.
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


def _make(sertype: int, data: bytes) -> int:
    part = (c_size_t * 2)(ctypes.cast(c_char_p(data), c_void_p).value or 0, len(data))
    made = keeping().ddsi_serdata_from_ser_iov(sertype, _SDK_DATA, 1, part, len(data))
    if not made:
        raise ValueError("no sample can be made")
    return int(made)


def _bytes_of(serdata: int, offset: int, size: int, packet: bytearray | None) -> bytes:
    """Return what is sent of a sample behind the headers in `packet`, if any."""
    room = ctypes.create_string_buffer(_XMSG.size + _XMSG_DATA + 8)
    part = ctypes.addressof(room) + _XMSG.size
    if packet is not None:
        headers = (c_ubyte * len(packet)).from_buffer(packet)
        _XMSG.pack_into(room, 0, _XMSG_ROOM, 36, 0, 0)
        c_uint32.from_address(part + _XMSG_KIND).value = 1
        c_void_p.from_address(part + _XMSG_DATA).value = ctypes.addressof(headers)
    lib = keeping()
    lib.ddsi_serdata_to_ser_ref(serdata, offset, size, part)
    data = string_at(c_void_p.from_address(part).value or 0, c_size_t.from_address(part + 8).value)
    lib.ddsi_serdata_to_ser_unref(serdata, part)
    return data


def _expect(found: object, wanted: object) -> None:
    if found != wanted:
        raise ValueError(f"{found!r} instead of {wanted!r}")

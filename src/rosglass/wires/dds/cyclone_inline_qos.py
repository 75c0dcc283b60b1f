"""Sending samples with inline QoS through Cyclone DDS, which writes none of its own accord.

A sample that is marked begins with its inline QoS. Of the functions that the library reads samples
with, ``get_size`` is replaced to leave that out; ``to_ser_ref``, asked for the bytes that follow a
submessage's header, to return the inline QoS with them and to set the header's flag for it;
``to_ser_unref`` to take them back. The library does the rest: fragments, retransmissions, several
networks. See :mod:`rosglass.wires.dds.cyclone_hooks` for how.
"""

from __future__ import annotations

import ctypes
import logging
import struct
import threading
from ctypes import PYFUNCTYPE, c_size_t, c_ubyte, c_uint32, c_void_p, string_at
from typing import TYPE_CHECKING, Any

from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone import keeping
from rosglass.wires.dds.cyclone_hooks import Hook, expect, make_sample
from rosglass.wires.dds.cyclone_samples import COPIED
from rosglass.wires.dds.identity import Identity, inline_qos

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.wires.dds.endpoints import SampleWriter

__all__ = ["create_topic", "prepare", "problem", "write"]

_log = logging.getLogger("rosglass.ros2")

#: Places in ``ddsi_serdata_ops``.
_GET_SIZE, _TO_SER_REF, _TO_SER_UNREF = 1, 7, 8
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

_GetSize = PYFUNCTYPE(c_uint32, c_void_p)
_ToSerRef = PYFUNCTYPE(c_void_p, c_void_p, c_size_t, c_size_t, c_void_p)
_ToSerUnref = PYFUNCTYPE(None, c_void_p, c_void_p)

_told = threading.local()
#: Fragments with inline QoS that the library is sending, by their address.
_fragments: dict[int, Any] = {}


def create_topic(participant: int, name: str, type_name: str) -> int:
    """Create a topic for a writer that :func:`prepare` is applied to; see `cyclone.create_topic`.

    The writer must not be used in the main thread: an exception raised there by a signal would end
    up in the library.
    """
    return hook.create_topic(participant, name, type_name)


def prepare(writer: int) -> None:
    """Let a writer be given to :func:`write`, before it writes anything."""
    # As its topic's type is not the library's usual one, it has a type of its own.
    hook.prepare(cyclone.sertype(writer))


def problem() -> str:
    """Return why nothing can be sent with inline QoS on this machine; empty when it can."""
    return hook.problem


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


class _Writing(Hook):
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
        serdata = make_sample(sertype, _MARK + qos + data)
        lib = keeping()
        expect(lib.ddsi_serdata_size(serdata), len(data))
        # What stays within this process has no header to be flagged.
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
        lib = keeping()
        lib.ddsi_serdata_to_ser_ref(serdata, 0, 12, part)
        self._header = part[0] - serdata
        lib.ddsi_serdata_to_ser_unref(serdata, part)
        lib.ddsi_serdata_unref(serdata)
        if not 64 <= self._header <= 256:
            raise ValueError(f"payloads begin at {self._header}")

    def _marked(self, serdata: int) -> bool:
        return string_at(serdata + self._header, len(_MARKED)) == _MARKED


hook = _Writing()


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

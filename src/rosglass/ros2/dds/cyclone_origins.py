"""Where samples come from that Cyclone DDS receives, which it drops when it makes them.

The function that makes a sample from packets (``from_ser``) is replaced by one that notes what the
first of them says: the sample's number, and the inline QoS that says which request a reply answers
(:mod:`rosglass.ros2.dds.identity`). See :mod:`rosglass.ros2.dds.cyclone_hooks` for how.
"""

from __future__ import annotations

import ctypes
import logging
import struct
from ctypes import CFUNCTYPE, PYFUNCTYPE, c_int, c_size_t, c_void_p, string_at
from typing import TYPE_CHECKING, Any

from rosglass.ros2.dds import cyclone
from rosglass.ros2.dds.cyclone import keeping
from rosglass.ros2.dds.cyclone_hooks import SDK_DATA, Hook, expect
from rosglass.ros2.dds.cyclone_samples import COPIED, payload
from rosglass.ros2.dds.identity import Identity, Origin, inline_qos, read_origin

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeAlias

    Take: TypeAlias = Callable[[bytes, Origin, bytes | memoryview], bool]

__all__ = ["TAKEN", "create_topic", "hasten", "origin", "problem"]

_log = logging.getLogger("rosglass.ros2")

#: The origin of what :func:`hasten` has handed on.
TAKEN = Origin(b"", 0, None)

#: Place in ``ddsi_serdata_ops``.
_FROM_SER = 2
#: ``ddsi_rdata``: rmsg, nextfrag, min, maxp1, submsg_zoff, payload_zoff, keyhash_zoff; and where
#: the packet begins that a ``ddsi_rmsg`` holds.
_RDATA = struct.Struct("=QQIIHHH2x")
_PACKET = 48
_RTPS_HEADER = 20
_INFO_SOURCE = 0x0C
#: Origins that are kept until somebody asks for them. Those of samples that a reader drops unread
#: make room when their memory is used again, or here.
_MAX_ORIGINS = 16384

_from_ser_type = c_void_p, c_void_p, c_int, c_void_p, c_size_t
_FromSer, _FromSerFree = PYFUNCTYPE(*_from_ser_type), CFUNCTYPE(*_from_ser_type)

_origins: dict[int, Origin] = {}
#: What to call with samples while they are received, by the address of their type.
_hasty: dict[int, Take] = {}


def create_topic(participant: int, name: str, type_name: str) -> int:
    """Create a topic whose readers' samples have an :func:`origin`; see `cyclone.create_topic`."""
    return _hook.create_topic(participant, name, type_name)


def problem() -> str:
    """Return why received samples have no origin on this machine; empty when they have."""
    return _hook.problem


def origin(serdata: int) -> Origin | None:
    """Return where a received sample comes from, once.

    None when it came within this process; :data:`TAKEN` when it was handed on already.

    Args:
        serdata: The sample's address, while the caller still holds a reference to it.
    """
    return _origins.pop(serdata, None)


def hasten(reader: int, take: Take) -> Callable[[], None]:
    """Have samples of other processes handed on while they are received.

    It saves waking a thread, a fifth of a service call's time. The library is in the middle of
    something then, and waits: `take` must not call it but to write, nor wait for anything.

    Args:
        reader: Of a topic of :func:`create_topic`.
        take: Takes a sample's writer (empty when unknown), origin and payload; returns whether it
            did. What it did not take, and that alone, comes later with an origin.

    Returns:
        What ends it.
    """
    sertype = cyclone.sertype(reader)
    if not _hook.problem:
        _hasty[sertype] = take

    def end() -> None:
        _hasty.pop(sertype, None)

    return end


class _Reading(Hook):
    """Notes where samples come from."""

    def replace(self, originals: Any) -> dict[int, Any]:
        small, big = _FromSer(originals[_FROM_SER]), _FromSerFree(originals[_FROM_SER])
        lib = keeping()

        def from_ser(sertype: int, kind: int, fragments: int, size: int) -> int | None:
            make = small if size <= COPIED else big
            serdata: int | None = make(sertype, kind, fragments, size)
            try:
                if serdata is not None and kind == SDK_DATA:
                    found = _note(serdata, fragments)
                    take = _hasty.get(sertype)
                    if take is not None and found is not None:
                        lib.ddsi_serdata_ref(serdata)
                        if take(_writer(fragments, found), found, payload(serdata)):
                            _origins[serdata] = TAKEN
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
        from_ser = _FromSer(self.function(sertype, _FROM_SER))
        serdata = from_ser(sertype, SDK_DATA, ctypes.addressof(rdata), len(data))
        noted = origin(serdata)
        expect(bytes(payload(serdata)), data)
        expect(noted, sent)


_hook = _Reading()


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


def _writer(fragments: int, found: Origin) -> bytes:
    """Return the GUID of a sample's writer; empty where that takes a closer look at the packet."""
    rmsg, *_, submessage, _, _ = _RDATA.unpack(string_at(fragments, _RDATA.size))
    packet = string_at(rmsg + _PACKET, submessage)
    at = _RTPS_HEADER
    while at + 4 <= submessage:
        name, flags, size = struct.unpack_from("=BBH", packet, at)
        if name == _INFO_SOURCE or not flags & 1:
            return b""
        at += 4 + size
    if at != submessage:
        return b""
    return struct.pack(">3I", *struct.unpack_from("=3I", packet, 8)) + found.entity

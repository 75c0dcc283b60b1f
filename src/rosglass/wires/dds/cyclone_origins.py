"""Where samples come from that Cyclone DDS receives, which it drops when it makes them.

The function that makes a sample from packets (``from_ser``) is replaced by one that notes what the
first of them says: the sample's number, and the inline QoS that says which request a reply answers
(:mod:`rosglass.wires.dds.identity`). See :mod:`rosglass.wires.dds.cyclone_hooks` for how.
"""

from __future__ import annotations

import ctypes
import logging
import struct
from ctypes import CFUNCTYPE, PYFUNCTYPE, c_int, c_size_t, c_void_p, string_at
from typing import TYPE_CHECKING, Any

from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone import keeping
from rosglass.wires.dds.cyclone_hooks import SDK_DATA, Hook, expect
from rosglass.wires.dds.cyclone_samples import COPIED, payload
from rosglass.wires.dds.identity import Identity, Origin, inline_qos, read_origin

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeAlias

    Take: TypeAlias = Callable[[Origin, bytes | memoryview], bool]

__all__ = ["Origins", "problem"]

_log = logging.getLogger("rosglass.ros2")

#: Place in ``ddsi_serdata_ops``.
_FROM_SER = 2
#: ``ddsi_rdata``: rmsg, nextfrag, min, maxp1, submsg_zoff, payload_zoff, keyhash_zoff; and where
#: the packet begins that a ``ddsi_rmsg`` holds.
_RDATA = struct.Struct("=QQIIHHH2x")
_PACKET = 48
_RTPS_HEADER = 20
_INFO_SOURCE = 0x0C
#: Origins that a reader's samples are kept of until somebody asks for them. Those of samples that
#: it drops unread make room when their memory is used again, or here.
_MAX_ORIGINS = 16384

_from_ser_type = c_void_p, c_void_p, c_int, c_void_p, c_size_t
_FromSer, _FromSerFree = PYFUNCTYPE(*_from_ser_type), CFUNCTYPE(*_from_ser_type)

#: By the address of their reader's type.
_readers: dict[int, Origins] = {}


def problem() -> str:
    """Return why received samples have no origin on this machine; empty when they have."""
    return hook.problem


class Origins:
    """Where the samples of one reader come from.

    Each reader has its own: a sample that is dropped unread leaves its origin behind, under an
    address that may be another reader's sample's later.
    """

    def __init__(self) -> None:
        self._type = 0
        self._noted: dict[int, Origin] = {}
        self._take: Take | None = None

    def create_topic(self, participant: int, name: str, type_name: str) -> int:
        """Create the topic of the one reader; see `cyclone.create_topic`."""
        topic = hook.create_topic(participant, name, type_name)
        self.follow(cyclone.sertype(topic))
        return topic

    def follow(self, sertype: int) -> None:
        """Note the origins of the samples of a type, by its address."""
        self._type = sertype
        _readers[sertype] = self

    def of(self, serdata: int) -> Origin | None:
        """Return where a sample comes from, once; None when it came within this process.

        A sample that came within this process may be given the origin of one that was dropped
        unread: see :meth:`Origin.may_be_of`.

        Args:
            serdata: The sample's address, while the caller still holds a reference to it.
        """
        return self._noted.pop(serdata, None)

    def hasten(self, take: Take | None) -> None:
        """Have samples of other processes handed on while they are received.

        It saves waking a thread, a fifth of a service call's time. The library is in the middle of
        something then, and waits: `take` must not call it but to write, nor wait for anything.

        Args:
            take: Takes a sample's origin and payload; returns whether it did. What it did not take
                comes later, with the same origin. None ends it.
        """
        self._take = take

    def close(self) -> None:
        """Forget all; for a reader that was deleted."""
        self._take = None
        if _readers.get(self._type) is self:
            del _readers[self._type]
        self._noted.clear()

    def note(self, serdata: int, fragments: int) -> None:
        """Note the origin of a sample that was just made from fragments, and hand it on."""
        self._noted.pop(serdata, None)
        found = _read(fragments)
        if found is None:
            return
        while len(self._noted) >= _MAX_ORIGINS:
            self._noted.pop(next(iter(self._noted)), None)
        self._noted[serdata] = found
        take = self._take
        if take is not None:
            keeping().ddsi_serdata_ref(serdata)
            if take(found, payload(serdata)):
                self._noted[serdata] = found._replace(taken=True)


class _Reading(Hook):
    """Notes where samples come from."""

    def replace(self, originals: Any) -> dict[int, Any]:
        small, big = _FromSer(originals[_FROM_SER]), _FromSerFree(originals[_FROM_SER])

        def from_ser(sertype: int, kind: int, fragments: int, size: int) -> int | None:
            make = small if size <= COPIED else big
            serdata: int | None = make(sertype, kind, fragments, size)
            try:
                origins = _readers.get(sertype)
                if serdata is not None and kind == SDK_DATA and origins is not None:
                    origins.note(serdata, fragments)
            except Exception:
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
        # Through the table, as the library does it.
        from_ser = _FromSer(self.function(sertype, _FROM_SER))
        origins = Origins()
        origins.follow(sertype)
        try:
            serdata = from_ser(sertype, SDK_DATA, ctypes.addressof(rdata), len(data))
        finally:
            found = dict(origins._noted)
            origins.close()
        expect(bytes(payload(serdata)), data)
        expect(found, {serdata: sent})


hook = _Reading()


def _read(fragments: int) -> Origin | None:
    """Return the origin of a sample that was made from fragments, the first of which is given."""
    rmsg, _, first, _, submessage, end, _ = _RDATA.unpack(string_at(fragments, _RDATA.size))
    if first != 0 or not rmsg or end <= submessage:
        return None
    # The library has checked that submessage and parameters end where the payload begins.
    found = read_origin(string_at(rmsg + _PACKET + submessage, end - submessage))
    return None if found is None else found._replace(prefix=_prefix(rmsg, submessage))


def _prefix(rmsg: int, submessage: int) -> bytes:
    """Return whose submessage it is; empty where that takes a closer look at the packet."""
    packet = string_at(rmsg + _PACKET, submessage)
    at = _RTPS_HEADER
    while at + 4 <= submessage:
        name, flags, size = struct.unpack_from("=BBH", packet, at)
        if name == _INFO_SOURCE or not flags & 1:
            return b""
        at += 4 + size
    return struct.pack(">3I", *struct.unpack_from("=3I", packet, 8)) if at == submessage else b""

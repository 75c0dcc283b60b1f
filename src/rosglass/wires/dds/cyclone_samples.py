"""Reads and writes payloads of Cyclone DDS in their wire format.

The library keeps a sample in a reference-counted block of memory (`serdata`). Reading returns such
references; :func:`payload` turns one into bytes, or into a view that releases the reference with
its last user. The block outlives reader, participant and domain.
"""

from __future__ import annotations

import ctypes
import struct
from ctypes import byref, c_char_p, c_int, c_size_t, c_ssize_t, c_ubyte, c_void_p
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from rosglass.errors import NodeClosedError, UnsupportedError
from rosglass.wires.dds.cyclone import TIMEOUT, check_alive, library, library_with_gil

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

__all__ = ["COPIED", "Batch", "Taken", "discard", "payload", "sample", "send"]

#: Payloads up to this size in bytes are copied: a view would cost more.
COPIED = 16 * 1024

_ANY_STATE = 0x7F
_SDK_DATA = 2
#: Payload, time stamp, handle of the writer, and the result of `describe`.
Taken = tuple["bytes | memoryview", int, int, Any]
#: ``dds_sample_info_t``: valid_data, source_timestamp, publication_handle of its 64 bytes.
_INFO = struct.Struct("=12x?3xq8xQ24x")
#: Does the same as ctypes.string_at(), in one step.
_copy: Callable[[int, int], bytes] = ctypes.PYFUNCTYPE(ctypes.py_object, c_void_p, c_ssize_t)(
    ("PyBytes_FromStringAndSize", ctypes.pythonapi)
)


class Batch:
    """A buffer for the samples that one call takes from a reader; for one thread at a time.

    Args:
        describe: Returns a description of a sample, by the address of its serdata, which is valid
            during the call.
        size: Maximum number of samples.

    Attributes:
        full: Whether the last call filled the buffer, so that more may wait: remaining samples are
            not reported otherwise.
    """

    def __init__(self, describe: Callable[[int], Any] | None = None, size: int = 64) -> None:
        self._describe, self._size = describe, size
        self.full = False
        self._serdata = (c_void_p * size)()
        self._infos = (c_ubyte * (_INFO.size * size))()
        self._addresses = memoryview(self._serdata).cast("B").cast("Q")
        self._info_bytes = memoryview(self._infos).cast("B")
        self._at = ctypes.addressof(self._serdata), ctypes.addressof(self._infos)
        # No thread that calls Python holds its lock, and no other holds it longer than this call.
        self._take = library_with_gil().dds_takecdr

    def take(self, reader: int, place: str) -> list[Taken]:
        """Take the samples that a reader holds, oldest first.

        Args:
            reader: The reader.
            place: Its topic or service, for errors.

        Returns:
            For each sample its payload, as :func:`payload` returns it, the writer's time stamp in
            nanoseconds since the Unix epoch, the handle of the writer, and the result of
            `describe`. Samples that only report a deleted writer are left out.

        Raises:
            NodeClosedError: The reader was deleted.
        """
        count = self._take(reader, self._at[0], self._size, self._at[1], _ANY_STATE)
        self.full = count == self._size
        if count <= 0:
            check_alive(count, "dds_takecdr", place)
            return []
        infos: Iterable[tuple[bool, int, int]]
        if count == 1:
            addresses, infos = [self._addresses[0]], [_INFO.unpack_from(self._info_bytes)]
        else:
            addresses = self._addresses[:count].tolist()
            infos = _INFO.iter_unpack(self._info_bytes[: count * _INFO.size])
        taken = []
        describe = self._describe
        for serdata, (valid, sent, writer) in zip(addresses, infos, strict=True):
            if valid:
                described = None if describe is None else describe(serdata)
                taken.append((payload(serdata), sent, writer, described))
            else:
                discard(serdata)
        return taken


def payload(serdata: int) -> bytes | memoryview:
    """Return a sample's payload with its encapsulation header, and take over its reference.

    Returns:
        Bytes if it is small, otherwise a read-only view of the library's own memory.
    """
    lib, part = library_with_gil(), _Part()
    size: int = lib.ddsi_serdata_size(serdata)
    # From here on there are two references: the one taken over, and the one for the bytes.
    lib.ddsi_serdata_to_ser_ref(serdata, 0, size, byref(part))
    lib.ddsi_serdata_unref(serdata)
    if size > COPIED:
        block = _block(size).from_address(part.base)
        block.serdata = serdata
        return memoryview(block).cast("B").toreadonly()
    data = _copy(part.base, size)
    lib.ddsi_serdata_to_ser_unref(serdata, byref(part))
    return data


def discard(serdata: int) -> None:
    """Release the reference to a sample."""
    library_with_gil().ddsi_serdata_unref(serdata)


def sample(sertype: int, parts: Sequence[bytes | bytearray | memoryview], place: str) -> int:
    """Return the address of a new serdata with a payload, which is copied.

    Args:
        sertype: Type of the writer it is for, see :func:`rosglass.wires.dds.cyclone.sertype`; its
            topic must not be deleted before the sample is sent.
        parts: The payload in one piece or several; the first begins with the encapsulation header.
        place: Its topic or service, for errors.

    Raises:
        UnsupportedError: The payload is not in the wire format.
    """
    pieces: Any
    if len(parts) == 1 and type(parts[0]) is bytes:
        total = len(parts[0])
        pieces = byref(_BytesPart(parts[0], total))
    else:
        pinned = [_pin(part) for part in parts]
        pieces = (_Part * len(parts))(*[_Part(pin.address, pin.size) for pin in pinned])
        total = sum(pin.size for pin in pinned)
    lib = library() if total > COPIED else library_with_gil()
    serdata: int = lib.ddsi_serdata_from_ser_iov(sertype, _SDK_DATA, len(parts), pieces, total)
    if not serdata:
        raise UnsupportedError(
            f"{place}: Cyclone DDS refuses a payload of {total} bytes; it takes CDR, which begins "
            "with 4 bytes of encapsulation header and has at least 1 byte after it"
        )
    return serdata


def send(writer: int, serdata: int, place: str) -> bool:
    """Send a sample; the caller keeps its reference.

    Returns:
        False if it was not sent because the writer's memory stayed full for the blocking time of
        its profile. It waits without the GIL.

    Raises:
        NodeClosedError: The writer was deleted.
        ConnectionLostError: This machine cannot do it now.
    """
    library_with_gil().ddsi_serdata_ref(serdata)
    result = library().dds_writecdr(writer, serdata)
    if result == TIMEOUT:
        return False
    try:
        check_alive(result, "dds_writecdr", place)
    except NodeClosedError:
        # Only in this case does the call not take over the reference.
        discard(serdata)
        raise
    return True


class _Part(ctypes.Structure):
    """``ddsrt_iovec_t``: a piece of memory."""

    _fields_ = (("base", c_void_p), ("size", c_size_t))


class _BytesPart(ctypes.Structure):
    """The same for bytes, which it keeps alive."""

    _fields_ = (("base", c_char_p), ("size", c_size_t))


class _Block:
    """Memory of the library that releases its reference when its last view is gone."""

    serdata: int

    #: A view is hashable if its object is, and then has the hash of the same bytes.
    __hash__ = object.__hash__

    def __del__(self) -> None:
        library_with_gil().ddsi_serdata_unref(self.serdata)


@lru_cache(maxsize=64)
def _block(size: int) -> Any:
    return type("Block", (_Block, c_ubyte * size), {})


class _Buffer(ctypes.Structure):
    """``Py_buffer``, as in CPython's stable ABI since 3.11 and the same before."""

    _fields_ = (
        ("address", c_void_p),
        ("owner", ctypes.py_object),
        ("size", c_ssize_t),
        ("item", c_ssize_t),
        ("readonly", c_int),
        ("dimensions", c_int),
        ("format", c_char_p),
        ("shape", c_void_p),
        ("strides", c_void_p),
        ("offsets", c_void_p),
        ("internal", c_void_p),
    )

    def __del__(self) -> None:
        if self.address is not None:
            ctypes.pythonapi.PyBuffer_Release(byref(self))


def _pin(part: bytes | bytearray | memoryview) -> _Buffer:
    """Return the address of `part`, which stays valid as long as the result exists."""
    buffer = _Buffer()
    ctypes.pythonapi.PyObject_GetBuffer(ctypes.py_object(part), byref(buffer), 0)
    return buffer

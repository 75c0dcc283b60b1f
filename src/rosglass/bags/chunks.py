"""Compressed chunks of recordings: unpacked within a limit, left out where they are damaged."""

from __future__ import annotations

import bz2
import io
import logging
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rosglass.errors import BagError

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["CHUNK_LIMIT", "LeftOut", "decompress"]

_log = logging.getLogger("rosglass.bags")
#: Bytes of a chunk, or of a message that is compressed alone, after decompression.
CHUNK_LIMIT = 512 * 2**20
#: Bytes that lz4 is given room for at a time.
_PIECE = 16 * 2**20


def decompress(compression: str, data: bytes, size: int | None) -> bytes:
    """Return what a chunk holds: `size` bytes at most.

    Args:
        compression: ``zstd``, ``lz4`` or ``bz2``; ``none`` or empty for none.
        data: The chunk as it is in the file.
        size: Bytes that the recording declares; None where it is not known.

    Raises:
        BagError: It is damaged, holds more bytes than are declared, or more than
            :data:`CHUNK_LIMIT`.
    """
    if compression in ("", "none"):
        return data
    if compression not in _DECOMPRESSORS:
        raise BagError(f"its compression {compression!r:.40} is unknown")
    if size is not None and size > CHUNK_LIMIT:
        raise BagError(f"it declares {size} bytes, and {CHUNK_LIMIT} are the most")
    try:
        found = _DECOMPRESSORS[compression](data, CHUNK_LIMIT if size is None else size)
    except BagError:
        raise
    except Exception as error:  # whatever the damage leads to, in whichever library
        raise BagError(str(error) or type(error).__name__) from error
    if len(found) > (CHUNK_LIMIT if size is None else size):
        said = f"{CHUNK_LIMIT} bytes, the most" if size is None else f"the {size} bytes declared"
        raise BagError(f"it holds more than {said}")
    return found


def _zstd(data: bytes, size: int) -> bytes:
    library: Any = import_module("zstandard")  # with mcap; no types
    declared = library.frame_content_size(data)  # -1 when it is not in the frame
    if declared > size:
        raise BagError(f"its compressed data declares {declared} bytes, and {size} are the most")
    # Either size bounds what is allocated, and the library raises where there is more.
    return bytes(library.ZstdDecompressor().decompress(data, max_output_size=size))


def _lz4(data: bytes, size: int) -> bytes:
    library: Any = import_module("lz4.frame")  # with rosbags; no types
    unpacking = library.LZ4FrameDecompressor()
    parts, left = [], size + 1
    while left and not unpacking.eof:
        parts.append(unpacking.decompress(data, max_length=min(left, _PIECE)))
        data = b""
        if not parts[-1]:
            raise BagError("its compressed data ends too early")
        left -= len(parts[-1])
    return b"".join(parts)


def _bz2(data: bytes, size: int) -> bytes:
    with bz2.open(io.BytesIO(data)) as file:
        return bytes(file.read(size + 1))


_DECOMPRESSORS = {"zstd": _zstd, "lz4": _lz4, "bz2": _bz2}


class LeftOut:
    """The parts of a recording that are left out, counted once however often they are read.

    Args:
        path: The recording.
        part: What it consists of: ``chunk`` or ``message``.
    """

    def __init__(self, path: Path, part: str) -> None:
        self._path, self._part = path, part
        self._places: set[str] = set()
        self._first = ""

    def add(self, place: str, error: Exception) -> None:
        """Count the part at a place in the recording, and log the first one."""
        if not self._places:
            self._first = f"{place}: {str(error) or type(error).__name__}"
            _log.warning("%s: a %s is left out, %s", self._path, self._part, self._first)
        self._places.add(place)

    def words(self) -> str:
        """Return how many are left out, and why the first one; empty when none is."""
        if not self._places:
            return ""
        count = len(self._places)
        what = f"1 {self._part} is" if count == 1 else f"{count} {self._part}s are"
        return f"{what} damaged or too large and left out, the first {self._first}"

"""Shared memory: big payloads that programs on one machine pass on without sending them."""

from __future__ import annotations

import logging
import os
import threading
from typing import TYPE_CHECKING

import zenoh
import zenoh.shm

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["SharedMemory"]

_log = logging.getLogger("rosglass.ros2")
#: Payloads from this size in bytes on are put there; Zenoh itself sees to those from 3 kB.
_BIG = 64 * 1024
#: Size of the pool in bytes, at least, and in payloads; only what is used takes up memory.
_POOL = 64 * 1024 * 1024
_PAYLOADS = 10
#: Bytes copied at a time from what Zenoh does not read itself; from 128 kB on, each allocation
#: would get fresh memory from the system.
_PIECE = 96 * 1024
#: Where Linux keeps shared memory.
_PLACE = "/dev/shm"


class SharedMemory:
    """The memory of one session for the payloads it publishes.

    Zenoh would copy a payload into a pool of its own on the way; writing it there spares one copy.
    Where there is no room, because receivers are slow or the machine's memory is full, payloads
    take the usual way.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._provider: zenoh.shm.ShmProvider | None = None
        self._size = self._refused = 0

    def place(self, parts: Sequence[bytes | bytearray | memoryview]) -> zenoh.ZBytes | None:
        """Return a payload in shared memory, None where it is too small or there is no room."""
        size = sum(map(len, parts))
        if size < _BIG:
            return None
        provider = self._provide(size)
        if provider is None:
            return None
        try:
            buffer = provider.alloc(size, policy=zenoh.shm.GarbageCollect())
        except zenoh.ZError:
            return None
        start = 0
        for part in parts:
            _copy(part, buffer, start)
            start += len(part)
        payload: zenoh.ZBytes = zenoh.ZBytes(buffer)
        return payload

    def _provide(self, size: int) -> zenoh.shm.ShmProvider | None:
        with self._lock:
            if size * 2 <= self._size:
                return self._provider
            wanted = min(max(_POOL, size * _PAYLOADS), lockable_bytes())
            if self._refused and wanted >= self._refused:
                return self._provider if size <= self._size else None
            try:
                if wanted < size * 2:
                    raise MemoryError(
                        f"Zenoh locks it, and this user may lock {wanted / 2**20:.0f} MB; "
                        f"{size * 2 / 2**20:.0f} MB are needed at least: raise the limit "
                        "(ulimit -l, memlock in /etc/security/limits.conf, LimitMEMLOCK in systemd)"
                    )
                if wanted > _free() // 2:
                    raise MemoryError(f"{_PLACE} has not {2 * wanted // 2**20} MB left")
                # What was sent from an old pool keeps that until it is received.
                self._provider = zenoh.shm.ShmProvider.default_backend(wanted)
                self._size = wanted
            except (zenoh.ZError, MemoryError) as error:
                self._refused = wanted
                _log.warning(
                    "no shared memory for messages of %d bytes, they are copied once more: %s",
                    size,
                    error,
                )
            return self._provider if size <= self._size else None


def _copy(part: bytes | bytearray | memoryview, buffer: zenoh.shm.ZShmMut, start: int) -> None:
    if not isinstance(part, memoryview):
        buffer[start : start + len(part)] = part
        return
    for offset in range(0, len(part), _PIECE):
        piece = bytes(part[offset : offset + _PIECE])
        buffer[start + offset : start + offset + len(piece)] = piece


def lockable_bytes() -> int:
    """Return how much of the memory that this user may lock a pool takes at most, in bytes.

    Zenoh locks its pools; Debian allows 8 MB to users other than root.
    """
    if resource is None or os.geteuid() == 0:
        return 1 << 62
    limit = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0]
    # Zenoh's own few pages, and what it rounds up to, need room beside it.
    return 1 << 62 if limit == resource.RLIM_INFINITY else limit * 3 // 4


def _free() -> int:
    """Return the bytes of shared memory that are free: writing beyond them kills a program."""
    try:
        state = os.statvfs(_PLACE)
    except (AttributeError, OSError):  # another system than Linux
        return 1 << 62
    return state.f_bavail * state.f_frsize

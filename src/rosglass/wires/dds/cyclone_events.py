"""Being woken by Cyclone DDS when something happens to a reader or writer, and what it was."""

from __future__ import annotations

import ctypes
from ctypes import c_bool, c_int32, c_uint32, c_uint64
from enum import IntFlag
from typing import TypeVar

from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone import INFINITY, check, check_alive, library

__all__ = [
    "Event",
    "LivelinessChanged",
    "Matched",
    "Status",
    "Waitset",
    "liveliness_changed",
    "publication_matched",
    "sample_lost",
    "set_events",
    "subscription_matched",
]

#: Conditions that are told at once at most.
_KEYS = 64
_S = TypeVar("_S", bound=ctypes.Structure)


class Status(ctypes.Structure):
    """What happened to a reader or writer (OMG DDS 1.4, section 2.2.4.1).

    Attributes:
        total: How often since its creation.
        change: How often since the last time this was told.
    """

    _fields_ = (("total", c_uint32), ("change", c_int32))
    total: int
    change: int


class Matched(ctypes.Structure):
    """Counterparts came or went.

    Attributes:
        total: How often one came since the entity's creation.
        change: How often since the last time this was told.
        current: How many there are.
        current_change: How many more than last time.
        handle: Which one it was last.
    """

    _fields_ = (
        ("total", c_uint32),
        ("change", c_int32),
        ("current", c_uint32),
        ("current_change", c_int32),
        ("handle", c_uint64),
    )
    total: int
    change: int
    current: int
    current_change: int
    handle: int


class LivelinessChanged(ctypes.Structure):
    """Writers went silent or spoke again.

    Attributes:
        alive: How many are alive.
        not_alive: How many are not.
        alive_change: How many more are alive than last time.
        not_alive_change: How many more are not.
        handle: Which one it was last.
    """

    _fields_ = (
        ("alive", c_uint32),
        ("not_alive", c_uint32),
        ("alive_change", c_int32),
        ("not_alive_change", c_int32),
        ("handle", c_uint64),
    )
    alive: int
    not_alive: int
    alive_change: int
    not_alive_change: int
    handle: int


class Event(IntFlag):
    """What can happen to a reader or writer (``dds_status_id_t``)."""

    NONE = 0
    SAMPLE_LOST = 1 << 5
    DATA_AVAILABLE = 1 << 8
    LIVELINESS_CHANGED = 1 << 10
    PUBLICATION_MATCHED = 1 << 11
    SUBSCRIPTION_MATCHED = 1 << 12


def set_events(entity: int, events: Event) -> None:
    """Let a waitset that an entity is attached to be woken by these events, and no others."""
    result = library().dds_set_status_mask(entity, events)
    check_alive(result, "dds_set_status_mask", f"entity {entity}")


def subscription_matched(reader: int) -> Matched:
    """Return how a reader is matched; its event is over with it."""
    return _status(reader, "subscription_matched", Matched())


def publication_matched(writer: int) -> Matched:
    """Return how a writer is matched; its event is over with it."""
    return _status(writer, "publication_matched", Matched())


def liveliness_changed(reader: int) -> LivelinessChanged:
    """Return how many of a reader's writers are alive; its event is over with it."""
    return _status(reader, "liveliness_changed", LivelinessChanged())


def sample_lost(reader: int) -> Status:
    """Return how many samples a reader knows that it did not get; its event is over with it."""
    return _status(reader, "sample_lost", Status())


def _status(entity: int, what: str, into: _S) -> _S:
    call = f"dds_get_{what}_status"
    check_alive(getattr(library(), call)(entity, ctypes.byref(into)), call, f"entity {entity}")
    return into


class Waitset:
    """Waits, without the GIL, until one of several conditions holds.

    Args:
        participant: Who owns it.
    """

    def __init__(self, participant: int) -> None:
        lib = library()
        self._entity = check(lib.dds_create_waitset(participant), "dds_create_waitset", "waitset")
        self._guard = check(
            lib.dds_create_guardcondition(participant), "dds_create_guardcondition", "waitset"
        )
        self.attach(self._guard, 0)
        self._keys = (c_uint64 * _KEYS)()
        self._wait = lib.dds_waitset_wait

    def attach(self, entity: int, key: int) -> None:
        """Be woken by a condition, or by an entity with a status mask; `key` must not be 0."""
        check(library().dds_waitset_attach(self._entity, entity, key), "dds_waitset_attach", "")

    def wait(self, timeout: float | None) -> list[int]:
        """Return the keys of what holds, empty after `timeout` seconds or :meth:`wake`."""
        keys = self._keys
        span = INFINITY if timeout is None else int(timeout * 1e9)
        count = self._wait(self._entity, keys, _KEYS, span)
        if count < 0:
            check(count, "dds_waitset_wait", "waitset")
        found: list[int] = keys[:count]  # no more than there are
        if 0 in found:
            library().dds_take_guardcondition(self._guard, ctypes.byref(c_bool()))
            found = [key for key in found if key]
        return found

    def wake(self) -> None:
        """Let :meth:`wait` return, in another thread."""
        library().dds_set_guardcondition(self._guard, True)

    def close(self) -> None:
        """Delete it; nobody may be waiting."""
        for entity in (self._guard, self._entity):
            cyclone.delete(entity)

"""Being called, or woken, by Cyclone DDS when something happens to a reader or writer."""

from __future__ import annotations

import ctypes
import logging
from ctypes import CFUNCTYPE, c_bool, c_int32, c_uint32, c_uint64, c_void_p
from typing import TYPE_CHECKING, Any

from rosglass.ros2 import cyclone
from rosglass.ros2.cyclone import check, library

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = [
    "IncompatibleQos",
    "Listener",
    "LivelinessChanged",
    "Matched",
    "Missed",
    "Status",
    "Waitset",
    "read_condition",
]

_log = logging.getLogger("rosglass.ros2")
_ANY_STATE = 0x7F


class Status(ctypes.Structure):
    """What happened to a reader or writer (OMG DDS 1.4, section 2.2.4.1).

    Attributes:
        total: How often since its creation.
        change: How often since the last time this was told.
    """

    _fields_: Any = (("total", c_uint32), ("change", c_int32))
    total: int
    change: int


class Matched(Status):
    """Counterparts came or went.

    Attributes:
        current: How many there are.
        current_change: How many more than last time.
        handle: Which one it was last.
    """

    _fields_: Any = (("current", c_uint32), ("current_change", c_int32), ("handle", c_uint64))
    current: int
    current_change: int
    handle: int


class IncompatibleQos(Status):
    """A counterpart's policies do not fit.

    Attributes:
        policy: Number of the policy that was last in the way (``dds_qos_policy_id_t``).
    """

    _fields_: Any = (("policy", c_uint32),)
    policy: int


class Missed(Status):
    """A deadline was missed.

    Attributes:
        handle: Of which instance.
    """

    _fields_: Any = (("handle", c_uint64),)
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

    _fields_: Any = (
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


#: What can be listened to, and what is told then; nothing is told about data.
_EVENTS: dict[str, Any] = {
    "data_available": None,
    "subscription_matched": Matched,
    "publication_matched": Matched,
    "requested_incompatible_qos": IncompatibleQos,
    "offered_incompatible_qos": IncompatibleQos,
    "requested_deadline_missed": Missed,
    "offered_deadline_missed": Missed,
    "liveliness_changed": LivelinessChanged,
    "liveliness_lost": Status,
    "sample_lost": Status,
}


class Listener:
    """Callbacks for one or more entities; must be kept as long as an entity has it.

    They are called on threads of the library, or on a thread that writes within this process, and
    must return soon. What they raise is logged.

    Args:
        callbacks: By event, e.g. ``data_available=f``. Each takes the entity, and what happened
            unless the event is ``data_available``. Events: ``data_available``,
            ``subscription_matched``, ``publication_matched``, ``requested_incompatible_qos``,
            ``offered_incompatible_qos``, ``requested_deadline_missed``,
            ``offered_deadline_missed``, ``liveliness_changed``, ``liveliness_lost``,
            ``sample_lost``.

    Attributes:
        address: Where the library keeps it.
    """

    def __init__(self, **callbacks: Callable[..., None]) -> None:
        lib = library()
        self.address: int = lib.dds_create_listener(None)
        self._kept: list[Any] = []
        for event, callback in callbacks.items():
            status = _EVENTS[event]
            between = () if status is None else (status,)
            prototype = CFUNCTYPE(None, c_int32, *between, c_void_p)
            function = prototype(_guarded(event, callback))
            self._kept.append(function)
            setter = getattr(lib, f"dds_lset_{event}")
            setter.argtypes, setter.restype = [c_void_p, c_void_p], None
            setter(self.address, ctypes.cast(function, c_void_p))

    def __del__(self) -> None:
        library().dds_delete_listener(self.address)


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
        self._keys = (c_uint64 * 64)()

    def attach(self, entity: int, key: int) -> None:
        """Be woken by a condition, or by an entity with a status mask; `key` must not be 0."""
        check(library().dds_waitset_attach(self._entity, entity, key), "dds_waitset_attach", "")

    def detach(self, entity: int) -> None:
        """Be woken by it no more."""
        library().dds_waitset_detach(self._entity, entity)

    def wait(self, timeout: float) -> list[int]:
        """Return the keys of what holds, empty after `timeout` seconds or :meth:`wake`."""
        lib, keys = library(), self._keys
        count = lib.dds_waitset_wait(self._entity, keys, len(keys), round(timeout * 1e9))
        found = keys[: min(check(count, "dds_waitset_wait", "waitset"), len(keys))]
        if 0 in found:
            lib.dds_take_guardcondition(self._guard, ctypes.byref(c_bool()))
            return [key for key in found if key]
        return found

    def wake(self) -> None:
        """Let :meth:`wait` return, in another thread."""
        library().dds_set_guardcondition(self._guard, True)

    def close(self) -> None:
        """Delete it; nobody may be waiting."""
        for entity in (self._guard, self._entity):
            cyclone.delete(entity)


def read_condition(reader: int, place: str) -> int:
    """Return a condition that holds while the reader has samples."""
    return check(
        library().dds_create_readcondition(reader, _ANY_STATE), "dds_create_readcondition", place
    )


def _guarded(event: str, callback: Callable[..., None]) -> Callable[..., None]:
    def call(entity: int, *rest: Any) -> None:
        try:
            callback(entity, *rest[:-1])
        except Exception:
            _log.exception("a callback of %s failed", event)

    return call

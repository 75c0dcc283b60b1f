"""Replacing functions that Cyclone DDS makes and reads samples with.

Each topic's type points to a table of functions (``ddsi_serdata_ops``, meant for other languages'
type support); a topic made here gets a type of its own, which points to a copy of that table with
some functions replaced. That takes private layouts, those of Cyclone DDS 11.0.1 on 64-bit Linux.
They are tested once, on memory of our own, before anything relies on them.

All types share one copy of each table. The library finds instances by the hash of a sample and by
its table, and all samples without key have one hash: with a table for each type, the 33rd instance
of that hash makes its hash table (hopscotch hashing with 32 slots) double until memory ends.

A copy is never freed, as samples outlive readers, writers and topics.
"""

from __future__ import annotations

import ctypes
import logging
import sys
import threading
from abc import ABC, abstractmethod
from ctypes import c_char_p, c_size_t, c_void_p
from typing import Any

from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone import keeping

__all__ = ["SDK_DATA", "Hook", "expect", "make_sample"]

_log = logging.getLogger("rosglass.ros2")

#: ``ddsi_serdata_kind`` of a sample that has data.
SDK_DATA = 2
#: ``ddsi_sertype.serdata_ops``, and how many functions it has.
_OPS_OF_TYPE = 8
_OPS = 17

_lock = threading.Lock()


class Hook(ABC):
    """Replaces functions of the types of topics."""

    def __init__(self) -> None:
        self.problem = ""
        self._tested = False
        #: Our tables and the functions in them, by the address of the library's table.
        self._tables: dict[int, tuple[Any, dict[int, Any]]] = {}

    def create_topic(self, participant: int, name: str, type_name: str) -> int:
        """Create a topic whose type has functions replaced; see `cyclone.create_topic`."""
        with _lock:
            topic = cyclone.create_topic(participant, name, type_name, own_type=True)
            try:
                sertype = cyclone.sertype(topic)
                if not self._tested:
                    self._tested = True
                    self.problem = self.check(sertype)
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

    def function(self, sertype: int, place: int) -> Any:
        """Return what the library calls for a type, by the place in the table."""
        return _table_of(sertype)[place]

    @abstractmethod
    def replace(self, originals: Any) -> dict[int, Any]:
        """Return functions by their place in the table, which call the original ones."""

    @abstractmethod
    def test(self, sertype: int) -> None:
        """Raise when the functions do not do what they should with samples of a type."""

    def check(self, sertype: int) -> str:
        """Replace a type's functions; return why that cannot be, empty when it is done."""
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
    """Return the address of a new serdata, for tests; raises ValueError when there is none."""
    part = (c_size_t * 2)(ctypes.cast(c_char_p(data), c_void_p).value or 0, len(data))
    made = keeping().ddsi_serdata_from_ser_iov(sertype, SDK_DATA, 1, part, len(data))
    if not made:
        raise ValueError("no sample can be made")
    return int(made)


def expect(found: object, wanted: object) -> None:
    """Raise ValueError when a test finds something else than wanted."""
    if found != wanted:
        raise ValueError(f"{found!r} instead of {wanted!r}")

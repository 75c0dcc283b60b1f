"""Closed writers that wait until their last samples have arrived."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone_events import Event, set_events

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.wires.dds.pump import Pump

__all__ = ["Lingering"]

#: Seconds that readers have to acknowledge what was sent last, as long as Cyclone DDS gives them.
_PATIENCE = 1.0
#: What the pump knows this by; no entity has that number.
_NUMBER = 0
#: Seconds between two looks while a participant is closed.
_INTERVAL = 0.002


class Lingering:
    """Keeps a participant's closed writers until their readers have everything, a second at most.

    Cyclone DDS can do that, too (``WriterLingerDuration``), but holds up who deletes a writer:
    where a peer was killed, for a second, and one writer after the other. Here all wait together.

    Args:
        pump: What looks after them, some thirty times a second.
    """

    def __init__(self, pump: Pump) -> None:
        self._pump = pump
        self._lock = threading.Lock()
        self._waiting: dict[int, tuple[float, Callable[[], None]]] = {}

    def add(self, writer: int, delete: Callable[[], None]) -> None:
        """Call `delete` once what a writer sent has arrived, or will not; returns at once."""
        set_events(writer, Event.NONE)  # which nobody would read
        with self._lock:
            self._waiting[writer] = time.monotonic() + _PATIENCE, delete
            self._pump.visit(_NUMBER, self._look)

    def close(self) -> None:
        """Wait until all are deleted; for the thread that has closed the pump."""
        while self._waiting:
            self._look()
            time.sleep(_INTERVAL)

    def _look(self) -> None:
        """Delete those that are done."""
        with self._lock:
            waiting = list(self._waiting.items())
        now = time.monotonic()
        for writer, (deadline, delete) in waiting:
            if now >= deadline or cyclone.acknowledged(writer):
                delete()
                with self._lock:
                    self._waiting.pop(writer, None)
        with self._lock:
            if not self._waiting:
                self._pump.forget(_NUMBER)

"""The one thread of a DDS participant on which everything that arrives is handed on."""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING

from rosglass.ros2.cyclone_listener import Event, Waitset, set_events

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Pump"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds between two looks at what nobody waits for.
_IDLE_INTERVAL = 0.03
#: Seconds until a look that failed is repeated.
_BACKOFF = 0.1
#: Seconds that closing waits for the thread.
_PATIENCE = 5.0


class Pump:
    """Waits for a participant's readers and writers, and acts on one after the other.

    A waitset instead of callbacks: those run on the threads that receive, where waiting for the
    interpreter would let the socket's buffer overflow and hold up every acknowledgement.

    Args:
        participant: Whose entities it waits for.
        name: The thread's name.
    """

    def __init__(self, participant: int, name: str) -> None:
        self._waitset = Waitset(participant)
        self._acts: dict[int, Callable[[], None]] = {}
        self._idle: dict[int, Callable[[], None]] = {}
        self._closed = False
        self._due = 0.0
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def watch(self, entity: int, events: Event, act: Callable[[], None]) -> None:
        """Call `act`, on the pump's thread, while one of `events` holds for an entity.

        It is called again and again until the event is over: data taken, a status read. Deleting
        the entity ends it; :meth:`forget` lets go of `act`.
        """
        set_events(entity, events)
        self._acts[entity] = act
        self._waitset.attach(entity, entity)

    def visit(self, entity: int, act: Callable[[], None] | None) -> None:
        """Call `act` some thirty times a second, whatever happens; None ends that."""
        if act is None:
            self._idle.pop(entity, None)
        else:
            self._idle[entity] = act
        self._waitset.wake()

    def forget(self, entity: int) -> None:
        """Let go of what was to be done for an entity that was deleted."""
        self._acts.pop(entity, None)
        self._idle.pop(entity, None)

    @property
    def current(self) -> bool:
        """Whether the calling thread is the pump's."""
        return threading.current_thread() is self._thread

    def close(self) -> None:
        """End the thread; nothing is done afterwards, except what called this."""
        self._closed = True
        if self.current:
            return
        self._waitset.wake()
        self._thread.join(_PATIENCE)
        self._waitset.close()

    def _run(self) -> None:
        while not self._closed:
            self._do(self._turn)

    def _turn(self) -> None:
        for entity in self._waitset.wait(_IDLE_INTERVAL if self._idle else None):
            self._do(self._acts.get(entity))
        if self._idle and (now := time.monotonic()) >= self._due:
            self._due = now + _IDLE_INTERVAL
            for act in list(self._idle.values()):
                self._do(act)

    def _do(self, act: Callable[[], None] | None) -> None:
        if act is None or self._closed:
            return
        try:
            act()
        except Exception:
            if not self._closed:
                _log.exception("%s: what arrived cannot be handed on", self._thread.name)
                time.sleep(_BACKOFF)

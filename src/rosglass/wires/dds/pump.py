"""The one thread of a DDS participant on which everything that arrives is handed on."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from typing import TYPE_CHECKING

from rosglass.wires.dds.cyclone_events import Event, Waitset, set_events

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Pump"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds between two looks at what nobody waits for, and when much of it comes.
_IDLE_INTERVAL, _SHORT_INTERVAL = 0.03, 0.005
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
        self._acts: dict[int, Callable[[], bool | None]] = {}
        self._again: deque[int] = deque()
        self._idle: dict[int, Callable[[], object]] = {}
        self._closed = False
        self._due, self._interval = 0.0, _IDLE_INTERVAL
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def watch(self, entity: int, events: Event, act: Callable[[], bool | None]) -> None:
        """Call `act`, on the pump's thread, when one of `events` happens to an entity.

        New data is told once, and then only after some was taken: `act` returns whether there may
        be more, which it is asked for after the others had their turn. A status is told until it is
        read. Deleting the entity ends it; :meth:`forget` lets go of `act`.
        """
        set_events(entity, events)
        self._acts[entity] = act
        self._waitset.attach(entity, entity)

    def visit(self, entity: int, act: Callable[[], object] | None) -> None:
        """Call `act` some thirty times a second, whatever happens; more often when it says so.

        None ends that, and lets what :meth:`watch` was given look for data at once.
        """
        if act is None:
            self._idle.pop(entity, None)
            self._again.append(entity)
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
        again = [self._again.popleft() for _ in range(len(self._again))] if self._again else None
        woken = self._waitset.wait(0.0 if again else self._interval if self._idle else None)
        for entity in dict.fromkeys((*woken, *again)) if again else woken:
            act = self._acts.get(entity)
            if act is not None and self._do(act):
                self._again.append(entity)
        if self._idle and (now := time.monotonic()) >= self._due:
            busy = [visit for visit in list(self._idle.values()) if self._do(visit)]
            self._interval = _SHORT_INTERVAL if busy else _IDLE_INTERVAL
            self._due = now + self._interval

    def _do(self, act: Callable[[], object]) -> object:
        if self._closed:
            return None
        try:
            return act()
        except BaseException:  # whatever a callback raises, the others' messages must go on
            if not self._closed:
                _log.exception("%s: what arrived cannot be handed on", self._thread.name)
                time.sleep(_BACKOFF)
            return True  # there may be more, which is not told again

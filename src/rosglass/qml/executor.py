"""Callbacks on the GUI thread."""

from __future__ import annotations

import logging
import threading
from collections import deque
from typing import TYPE_CHECKING

from rosglass.comm.handle import Executor
from rosglass.qt import QtCore, Signal, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["GuiExecutor"]

_log = logging.getLogger("rosglass.qml")


class _Waker(QtCore.QObject):
    """Lives on the GUI thread, which its signal wakes.

    An event of our own would do the same, but whoever posts it from another thread touches it once
    more when it may have been delivered, and deleted, already: PySide2 crashes.
    """

    _asked = Signal()

    def __init__(self, job: Callable[[], None]) -> None:
        super().__init__()
        self._job, self._home = job, threading.get_ident()
        # Queued between threads without saying so; naming the kind makes PySide load all of Qt's
        # enumerations, which takes longer than anything else here.
        self._asked.connect(self.run)

    def wake(self) -> None:
        """Run the job soon; from any thread."""
        if threading.get_ident() == self._home:
            QtCore.QTimer.singleShot(0, self.run)
        else:
            self._asked.emit()

    @Slot()
    def run(self) -> None:
        """Run the job; Qt calls this on the GUI thread."""
        self._job()


class GuiExecutor(Executor):
    """Runs jobs on the thread that made it, which must run a Qt event loop.

    Many jobs posted at once cost one event. Jobs posted while jobs run wait for the next event, so
    that a busy topic cannot keep the user interface from drawing.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._jobs: deque[Callable[[], None]] = deque()
        #: Those whose turn it is.
        self._turn: deque[Callable[[], None]] = deque()
        self._waker = _Waker(self._run)
        self._closed = False

    def post(self, job: Callable[[], None]) -> None:
        """Run `job` soon; forgotten when the executor is closed."""
        with self._lock:
            if self._closed:
                return
            self._jobs.append(job)
            first = len(self._jobs) == 1
        if first:
            self._waker.wake()

    def close(self) -> None:
        """Forget the waiting jobs and take no more; safe to call twice."""
        with self._lock:
            self._closed = True
            self._jobs.clear()
            self._turn.clear()

    def resume(self) -> None:
        """Go on with the other jobs although one is running: it waits in an event loop."""
        self._waker.wake()

    def _run(self) -> None:
        with self._lock:
            self._turn.extend(self._jobs)
            self._jobs.clear()
        for _ in range(len(self._turn)):
            # A job that waits may have let others take their turn.
            if self._turn:
                _guarded(self._turn.popleft())


def _guarded(job: Callable[[], None]) -> None:
    try:
        job()
    except Exception:
        # Nothing may be raised through Qt's event loop.
        _log.exception("a callback failed")

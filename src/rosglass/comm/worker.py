"""A thread that does one job whenever it is asked to, and now and then unasked."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Worker"]

_log = logging.getLogger("rosglass.comm")
#: Seconds that closing waits for a run in progress.
_PATIENCE = 2.0


class Worker:
    """Runs `job` soon after each :meth:`wake`, merging requests, and after every pause.

    Args:
        name: The thread's name.
        job: What to do; told whether it runs because the pause is over. Exceptions are logged.
        pause: Longest time between two runs in seconds.
    """

    def __init__(self, name: str, job: Callable[[bool], None], pause: float) -> None:
        self._job, self._pause = job, pause
        self._wanted = threading.Event()
        self._closed = False
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    def wake(self) -> None:
        """Ask for a run soon; from any thread, without waiting."""
        self._wanted.set()

    @property
    def is_current(self) -> bool:
        """Whether this is the worker's own thread."""
        return self._thread is threading.current_thread()

    def close(self) -> None:
        """End the thread after the run in progress and wait for it; safe to call twice.

        A run that takes longer than 2 s more is left to its daemon thread, with a warning: closing
        must not hang a program.
        """
        self._closed = True
        self._wanted.set()
        if self._thread is threading.current_thread():
            return
        self._thread.join(_PATIENCE)
        if self._thread.is_alive():
            _log.warning("%s still runs %.0f s after closing", self._thread.name, _PATIENCE)

    def _work(self) -> None:
        while True:
            asked = self._wanted.wait(self._pause)
            self._wanted.clear()
            if self._closed:
                return
            try:
                self._job(not asked)
            except Exception:
                _log.exception("%s failed", self._thread.name)

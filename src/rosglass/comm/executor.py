"""Where callbacks run: a node's own dispatcher thread, or the middleware's thread at once."""

from __future__ import annotations

import logging
import threading
from queue import SimpleQueue
from typing import TYPE_CHECKING

from rosglass.comm.node import Executor

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["IMMEDIATE", "Dispatcher", "ImmediateExecutor"]

_log = logging.getLogger("rosglass.comm")
#: Seconds that closing waits for a callback that is still running.
_PATIENCE = 2.0


def _run(job: Callable[[], None]) -> None:
    try:
        job()
    except Exception:
        _log.exception("a callback failed")


class ImmediateExecutor(Executor):
    """Runs each job at once, in the thread that posts it.

    For jobs that take microseconds: the middleware receives nothing else meanwhile. They may
    publish and close subscriptions, but must not wait for anything nor close the node.
    """

    def post(self, job: Callable[[], None]) -> None:
        """Run `job` now; an exception it raises is logged."""
        _run(job)


#: The one immediate executor; it has no state.
IMMEDIATE = ImmediateExecutor()


class Dispatcher(Executor):
    """Runs jobs one after the other, in the order they were posted, on a thread of its own.

    The thread starts with the first job. It is a daemon: a program that forgets to close its node
    still ends.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._jobs: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._closed = False

    def post(self, job: Callable[[], None]) -> None:
        """Run `job` on the thread soon; forgotten when the dispatcher is closed."""
        if self._thread is None:
            self._start()
        if not self._closed:
            self._jobs.put(job)

    @property
    def is_current(self) -> bool:
        """Whether this is the dispatcher's own thread."""
        return self._thread is threading.current_thread()

    def close(self) -> None:
        """End the thread after the job that runs now; waiting jobs are forgotten.

        Safe to call twice and from a job. A job that does not return within 2 s is left to its
        daemon thread, with a warning: closing must not hang a program.
        """
        with self._lock:
            self._closed = True
            thread = self._thread
        self._jobs.put(None)
        if thread is None or thread is threading.current_thread():
            return
        thread.join(_PATIENCE)
        if thread.is_alive():
            _log.warning("%s: a callback still runs %.0f s after closing", self._name, _PATIENCE)

    def _start(self) -> None:
        with self._lock:
            if self._thread is None and not self._closed:
                self._thread = threading.Thread(target=self._work, name=self._name, daemon=True)
                self._thread.start()

    def _work(self) -> None:
        while True:
            job = self._jobs.get()
            if job is None or self._closed:
                return
            _run(job)

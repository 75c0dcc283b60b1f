"""The thread that waits for all of a node's sockets."""

from __future__ import annotations

import heapq
import itertools
import logging
import selectors
import socket
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["IoLoop", "Ready"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds that closing waits for a handler that is still running.
_PATIENCE = 2.0
READ, WRITE = selectors.EVENT_READ, selectors.EVENT_WRITE


class Ready(Protocol):
    """What belongs to a socket; called in the loop's thread, and must not wait for anything."""

    def ready(self, events: int) -> None:
        """Do what the socket is ready for: READ, WRITE or both."""


class IoLoop:
    """Calls handlers when their sockets are ready, and jobs when asked to, on one daemon thread."""

    def __init__(self, name: str) -> None:
        self._selector = selectors.DefaultSelector()
        self._lock = threading.Lock()
        self._jobs: deque[Callable[[], None]] = deque()
        self._later: list[tuple[float, int, Callable[[], None]]] = []
        self._numbers = itertools.count()
        self._wake_in, self._wake_out = socket.socketpair()
        for end in (self._wake_in, self._wake_out):
            end.setblocking(False)
        self._selector.register(self._wake_out, READ, None)
        self._awake = False
        self._closed = False
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    @property
    def is_current(self) -> bool:
        """Whether this is the loop's own thread."""
        return self._thread is threading.current_thread()

    @property
    def closed(self) -> bool:
        """Whether it runs nothing any more."""
        return self._closed

    # -- from any thread -------------------------------------------------------------------------

    def call(self, job: Callable[[], None]) -> None:
        """Run `job` in the loop's thread soon; forgotten when the loop is closed."""
        self._jobs.append(job)
        with self._lock:
            if self._awake or self._closed:
                return
            self._awake = True
            with suppress(OSError):
                self._wake_in.send(b"\0")

    def close(self) -> None:
        """End the thread and forget all sockets, which stay open; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            with suppress(OSError):
                self._wake_in.send(b"\0")
        if self.is_current:
            return
        self._thread.join(_PATIENCE)
        if self._thread.is_alive():
            _log.warning("%s still runs %.0f s after closing", self._thread.name, _PATIENCE)

    # -- in the loop's thread --------------------------------------------------------------------

    def after(self, delay: float, job: Callable[[], None]) -> None:
        """Run `job` after `delay` seconds; only from the loop's thread."""
        heapq.heappush(self._later, (time.monotonic() + delay, next(self._numbers), job))

    def watch(self, sock: socket.socket, events: int, handler: Ready) -> None:
        """Call `handler` when `sock` is ready for `events`, 0 for none; from the loop's thread."""
        known = sock.fileno() in self._selector.get_map()
        if not events:
            if known:
                self._selector.unregister(sock)
        elif known:
            self._selector.modify(sock, events, handler)
        else:
            self._selector.register(sock, events, handler)

    def _work(self) -> None:
        while not self._closed:
            timeout = None
            if self._later:
                timeout = max(0.0, self._later[0][0] - time.monotonic())
            for key, events in self._selector.select(timeout):
                if key.data is None:
                    self._wake()
                else:
                    self._run(key.data, events)
            while self._later and self._later[0][0] <= time.monotonic():
                self._run_job(heapq.heappop(self._later)[2])
            for _ in range(len(self._jobs)):
                self._run_job(self._jobs.popleft())
        self._selector.close()
        self._wake_in.close()
        self._wake_out.close()

    def _wake(self) -> None:
        with self._lock:
            self._awake = False
        with suppress(OSError):
            self._wake_out.recv(4096)

    def _run(self, handler: Ready, events: int) -> None:
        try:
            handler.ready(events)
        except Exception:
            _log.exception("%s failed", handler)

    def _run_job(self, job: Callable[[], None]) -> None:
        try:
            job()
        except Exception:
            _log.exception("%s: a job failed", self._thread.name)

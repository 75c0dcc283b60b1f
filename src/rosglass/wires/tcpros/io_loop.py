"""A node's I/O loop: one thread that waits for all its sockets, and accepts connections."""

from __future__ import annotations

import errno
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

from rosglass.comm.handle import guarded
from rosglass.errors import ConnectionLostError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

__all__ = ["READ", "WRITE", "Acceptor", "IoLoop", "Later", "Ready", "listen"]


_log = logging.getLogger("rosglass.ros1")
#: Seconds that closing waits for a handler that is still running.
_HANDLER_TIMEOUT_S = 2.0
#: Seconds that sockets with something left to send keep a closed loop going.
_LINGER_S = 1.0
#: Seconds between polls of the sockets that are not urgent.
_IDLE_POLL_S = 0.1
READ, WRITE = selectors.EVENT_READ, selectors.EVENT_WRITE


class Ready(Protocol):
    """The handler of a socket; called in the loop's thread, and must not block."""

    def ready(self, events: int) -> None:
        """Handle the readiness of the socket: READ, WRITE or both."""

    def end(self, reason: str) -> None:
        """Close the socket: the loop ends, or :meth:`ready` raised."""


class Later:
    """A scheduled job; used in the loop's thread only."""

    __slots__ = ("job",)

    def __init__(self, job: Callable[[], None]) -> None:
        self.job: Callable[[], None] | None = job

    def cancel(self) -> None:
        """Cancel the job; safe after it has run."""
        self.job = None


class IoLoop:
    """Calls handlers when their sockets are ready, and runs jobs, on one daemon thread.

    Args:
        name: The thread's name.
    """

    def __init__(self, name: str) -> None:
        self._selector = selectors.DefaultSelector()
        #: Sockets that are polled: one poll for all costs next to nothing.
        self._polled = selectors.DefaultSelector()
        self._next_poll, self._polling = 0.0, False
        self._jobs: deque[Callable[[], None]] = deque()
        #: Not comm.timers.Timers: with a busy callback thread, a pause of 1 ms lasts 6 ms by this
        #: heap, and up to 11 ms by another thread that must get Python's lock first.
        self._later: list[tuple[float, int, Later]] = []
        self._numbers = itertools.count()
        self._wake_in, self._wake_out = socket.socketpair()
        for end in (self._wake_in, self._wake_out):
            end.setblocking(False)
        self._selector.register(self._wake_out, READ, None)
        self._awake = False
        self._closed = False
        self._deadline = 0.0
        self._lingering: set[Ready] = set()
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    @property
    def is_current(self) -> bool:
        """True in the loop's own thread."""
        return self._thread is threading.current_thread()

    @property
    def closed(self) -> bool:
        """True once it was closed; it runs on for up to a second while data is left to send."""
        return self._closed

    # -- from any thread -------------------------------------------------------------------------

    def call(self, job: Callable[[], None]) -> None:
        """Run `job` in the loop's thread soon; dropped when the loop has ended."""
        self._jobs.append(job)
        # Without a lock: at worst two threads wake the loop at once; see _on_wake(). A closed loop
        # needs no waking, and closes the socket.
        if not (self._awake or self._closed):
            self._awake = True
            with suppress(OSError):  # full: the loop wakes anyway
                self._wake_in.send(b"\0")

    def close(self) -> None:
        """End all handlers and the thread, once the data of :meth:`linger` is sent.

        Safe to call twice, and from the loop's own thread, which ends soon after then.
        """
        if self._closed:
            return
        self._deadline = time.monotonic() + _LINGER_S
        self._closed = True
        with suppress(OSError):  # full: the loop wakes anyway
            self._wake_in.send(b"\0")
        if self.is_current:
            return
        self._thread.join(_LINGER_S + _HANDLER_TIMEOUT_S)
        if self._thread.is_alive():
            _log.warning(
                "%s still runs %.0f s after closing", self._thread.name, _HANDLER_TIMEOUT_S
            )

    # -- in the loop's thread --------------------------------------------------------------------

    def after(self, delay: float, job: Callable[[], None]) -> Later:
        """Run `job` after `delay` seconds, unless it is cancelled; only from the loop's thread."""
        later = Later(job)
        heapq.heappush(self._later, (time.monotonic() + delay, next(self._numbers), later))
        return later

    def watch(
        self, sock: socket.socket, events: int, handler: Ready, *, urgent: bool = True
    ) -> None:
        """Call `handler` when `sock` is ready for `events`, 0 for none; from the loop's thread.

        Args:
            sock: The socket.
            events: READ, WRITE, both or 0.
            handler: Its handler.
            urgent: Whether READ is handled at once; else about ten times a second.
        """
        now = events if urgent else events & ~READ
        _set(self._selector, sock, now, handler)
        if self._polling or events != now:
            _set(self._polled, sock, events & ~now, handler)
            self._polling = len(self._polled.get_map()) > 0

    def linger(self, handler: Ready, lasting: bool) -> None:
        """Set whether closing the loop waits, up to a second, for the handler."""
        (self._lingering.add if lasting else self._lingering.discard)(handler)

    def _work(self) -> None:
        while not self._closed or (self._lingering and time.monotonic() < self._deadline):
            for key, events in itertools.chain(self._selector.select(self._pause()), self._poll()):
                handler = key.data
                if handler is None:
                    self._on_wake()
                    continue
                try:
                    handler.ready(events)
                except BaseException as error:  # noqa: BLE001 - the other connections must go on
                    self._on_error(handler, error)
            while self._later and self._later[0][0] <= time.monotonic():
                job = heapq.heappop(self._later)[2].job
                if job is not None:
                    self._run_job(job)
            for _ in range(len(self._jobs)):
                self._run_job(self._jobs.popleft())
        self._finish()

    def _poll(self) -> Iterator[tuple[selectors.SelectorKey, int]]:
        """Yield the events of the sockets that are not urgent, if it is time to poll them."""
        if self._polling and (now := time.monotonic()) >= self._next_poll:
            self._next_poll = now + _IDLE_POLL_S
            yield from self._polled.select(0)

    def _pause(self) -> float | None:
        """Return how long to wait for sockets, in seconds."""
        if self._jobs:
            return 0.0
        if not (self._later or self._polling or self._closed):
            return None
        pauses = []
        if self._closed:
            pauses.append(self._deadline - time.monotonic())
        while self._later and self._later[0][2].job is None:
            heapq.heappop(self._later)
        if self._later:
            pauses.append(self._later[0][0] - time.monotonic())
        if self._polling:
            pauses.append(self._next_poll - time.monotonic())
        return max(0.0, min(pauses)) if pauses else None

    def _finish(self) -> None:
        """Close the sockets that are left: their owners cannot any more."""
        while self._jobs:
            self._run_job(self._jobs.popleft())
        selectors = (self._selector, self._polled)
        left = {key.data for one in selectors for key in one.get_map().values()}
        for handler in left - {None}:
            self._run_job(lambda handler=handler: handler.end(""))  # type: ignore[misc]
        for selector in selectors:
            selector.close()
        self._wake_in.close()
        self._wake_out.close()

    def _on_wake(self) -> None:
        with suppress(OSError):  # empty
            self._wake_out.recv(4096)
        # In this order: jobs of threads that see the old value run in this round.
        self._awake = False

    def _on_error(self, handler: Ready, error: BaseException) -> None:
        """Log an error and end the handler; no error may end this thread."""
        _log.exception("%s failed", handler)
        reason = f"an error of ours, {error!r}"
        # Data that the handler left in the socket would make it fail again, at once and forever.
        self._run_job(lambda: handler.end(reason))

    def _run_job(self, job: Callable[[], None]) -> None:
        with guarded(_log, "%s: a job failed", self._thread.name):
            job()


def _set(
    selector: selectors.BaseSelector, sock: socket.socket, events: int, handler: Ready
) -> None:
    known = sock.fileno() in selector.get_map()
    if not events:
        if known:
            selector.unregister(sock)
    elif known:
        selector.modify(sock, events, handler)
    else:
        selector.register(sock, events, handler)


_BACKLOG = 128
#: Seconds without accepting connections after the system has run out of a resource.
_ACCEPT_PAUSE_S = 0.1


def listen(interface: str, port: int, url: str) -> socket.socket:
    """Return a listening socket.

    Args:
        interface: This machine's address to listen on; ``0.0.0.0`` for all of IPv4, ``::`` for all
            of both versions.
        port: 0 for any.
        url: The node's connection URL, for the error.

    Raises:
        ConnectionLostError: The port is taken, or not allowed.
    """
    six = ":" in interface
    sock = socket.socket(socket.AF_INET6 if six else socket.AF_INET, socket.SOCK_STREAM)
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if six:
            sock.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 0)
        sock.bind((interface, port))
        sock.listen(_BACKLOG)
        sock.setblocking(False)
    except OSError as error:
        sock.close()
        where = f"port {port}" if port else "any port"
        raise ConnectionLostError(
            f"{url}: cannot listen on {where}: {error.strerror or error}"
        ) from error
    return sock


class Acceptor:
    """Accepts connections; in the loop's thread.

    Args:
        loop: Waits for the socket.
        listener: A socket that listens; closed by :meth:`end`.
        accept: Called with each connection and its address.
    """

    def __init__(
        self,
        loop: IoLoop,
        listener: socket.socket,
        accept: Callable[[socket.socket, str], None],
    ) -> None:
        self._loop, self._listener, self._accept = loop, listener, accept
        #: Whether the current failure is logged.
        self._logged = False

    def open(self) -> None:
        """Begin to accept."""
        if self._listener.fileno() >= 0:
            self._loop.watch(self._listener, READ, self)

    def ready(self, _: int) -> None:
        """Accept the connections that wait."""
        while True:
            try:
                sock, address = self._listener.accept()
            except (BlockingIOError, InterruptedError):  # noqa: PERF203 - the usual end
                return
            except OSError as error:
                if error.errno != errno.ECONNABORTED:
                    # Back off: the selector would report it ready immediately (EMFILE loop).
                    if not self._logged:
                        self._logged = True
                        _log.warning("cannot accept connections: %s", error.strerror)
                    self._loop.watch(self._listener, 0, self)
                    self._loop.after(_ACCEPT_PAUSE_S, self.open)
                    return
            else:
                self._logged = False
                self._accept(sock, f"{address[0]}:{address[1]}")

    def end(self, reason: str = "") -> None:  # noqa: ARG002 - of all handlers
        """Stop accepting connections; safe to call twice."""
        if self._listener.fileno() >= 0:
            self._loop.watch(self._listener, 0, self)
            with suppress(OSError):  # not on every system
                # A process that was forked has the socket, too, and would go on listening.
                self._listener.shutdown(socket.SHUT_RDWR)
            self._listener.close()

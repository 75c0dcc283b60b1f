"""Listening for connections."""

from __future__ import annotations

import errno
import logging
import socket
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.errors import ConnectionLostError
from rosglass.ros1.address import is_loopback
from rosglass.ros1.io_loop import READ

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.ros1.io_loop import IoLoop

__all__ = ["Door", "listen"]

_log = logging.getLogger("rosglass.ros1")
_BACKLOG = 128
#: Seconds without accepting anybody after the system has run out of something.
_REST = 0.1


def listen(address: str, port: int, url: str) -> socket.socket:
    """Return a socket that listens, on this machine only when that is all that `address` reaches.

    Args:
        address: Under which others reach it; one of IPv6 makes it listen for both.
        port: 0 for any.
        url: What the node was connected with, for the error.

    Raises:
        ConnectionLostError: The port is taken, or not allowed.
    """
    six = ":" in address
    place = ""
    if is_loopback(address):
        place = "127.0.0.1" if address == "localhost" else address
    sock = socket.socket(socket.AF_INET6 if six else socket.AF_INET, socket.SOCK_STREAM)
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if six:
            sock.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 0)
        sock.bind((place, port))
        sock.listen(_BACKLOG)
        sock.setblocking(False)
    except OSError as error:
        sock.close()
        where = f"port {port}" if port else "any port"
        raise ConnectionLostError(
            f"{url}: cannot listen on {where}: {error.strerror or error}"
        ) from error
    return sock


class Door:
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
        #: Whether the log says already that nobody can be accepted.
        self._told = False

    def open(self) -> None:
        """Begin to accept."""
        if self._listener.fileno() >= 0:
            self._loop.watch(self._listener, READ, self)

    def ready(self, _: int) -> None:
        """Take in whoever waits."""
        while True:
            try:
                sock, address = self._listener.accept()
            except (BlockingIOError, InterruptedError):  # noqa: PERF203 - the usual end
                return
            except OSError as error:
                if error.errno != errno.ECONNABORTED:
                    # It would be ready again at once, and nobody else would get a turn.
                    if not self._told:
                        self._told = True
                        _log.warning("cannot accept connections: %s", error.strerror)
                    self._loop.watch(self._listener, 0, self)
                    self._loop.after(_REST, self.open)
                    return
            else:
                self._told = False
                self._accept(sock, f"{address[0]}:{address[1]}")

    def end(self, reason: str = "") -> None:  # noqa: ARG002 - as all that belongs to a socket
        """Accept nobody any more; safe to call twice."""
        if self._listener.fileno() >= 0:
            self._loop.watch(self._listener, 0, self)
            with suppress(OSError):
                # A process that was forked has the socket, too, and would go on listening.
                self._listener.shutdown(socket.SHUT_RDWR)
            self._listener.close()

"""Noticing that a link is dead, long before Zenoh does.

Zenoh gives a silent link up after its lease: 10 s, and 60 s with the routers of ROS 2. Until then
an operator would look at the last picture as if it were live. And a connection that survives sends,
when the network returns, all that was meant for the moment in which it failed.
"""

from __future__ import annotations

import ipaddress
import os
import re
import socket
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import zenoh

__all__ = ["Pulse", "limit_silence"]

#: Seconds after which a router that does not answer counts as silent.
_SILENCE = 3.0
#: Seconds after which an unanswered question is asked again.
_FORGET = 10.0
#: Milliseconds for which data may stay unacknowledged before the system ends a connection.
_USER_TIMEOUT_MS = 4000
_SOCKETS = Path("/proc/self/fd")
_LOCATOR = re.compile(r"tcp/(?:\[([^\]]+)\]|([^:\[\]]+)):(\d+)")


class Pulse:
    """Asks a router, at every beat, a question to which the answer is: nothing.

    Args:
        key: A key of tokens that no token matches.

    Attributes:
        silent: Whether the router owes an answer for too long.
    """

    def __init__(self, key: str) -> None:
        self._key = key
        self._asked = self._news = 0.0
        self._answer: Any = None
        self.silent = False

    def beat(self, session: zenoh.Session, now: float) -> None:
        """Look for the answer, and ask again if there was one; now and then, with the time."""
        if self._answer is not None:
            try:
                over = self._answer.try_recv() is not None  # an error: nobody answered in time
            except zenoh.ZError:  # the end of the answer
                over = True
                # A link that is given up ends its questions, too: only a prompt end is an answer.
                if now - self._asked <= _SILENCE:
                    self.silent = False
            if over:
                self._answer = None
            elif now - max(self._asked, self._news) > _SILENCE:
                self.silent = True
        if self._answer is None:
            with suppress(zenoh.ZError):  # the session is closed
                channel = zenoh.handlers.FifoChannel(4)
                self._answer = session.liveliness().get(self._key, channel, timeout=_FORGET)
                self._asked = now

    def on_news(self, now: float) -> None:
        """Take note that the router has sent something, with the time; the answer may queue."""
        self._news = now

    def rest(self) -> None:
        """Take note that there is no router to ask, or that it is busy with the graph."""
        self._answer, self.silent = None, False


def limit_silence(session: zenoh.Session) -> None:
    """Have the system end connections of a session that are not acknowledged any more.

    Zenoh has no setting for it. Only on Linux, and only for connections that leave the machine.
    """
    links = getattr(session.info, "links", None)
    if links is None or not sys.platform.startswith("linux"):
        return
    try:
        ends = {end for link in links() if (end := _address(link.dst)) is not None}
    except zenoh.ZError:  # the session is closed
        return
    for entry in _SOCKETS.iterdir() if ends else ():
        with suppress(OSError):  # closed meanwhile, or no socket
            _limit(os.dup(int(entry.name)), ends)


def _limit(own: int, ends: set[tuple[str, int]]) -> None:
    try:
        connection = socket.socket(fileno=own)
    except OSError:
        os.close(own)
        raise
    with connection:
        if connection.type is not socket.SOCK_STREAM or connection.family not in _INTERNET:
            return
        host, port = connection.getpeername()[:2]
        if (_plain(host), port) in ends:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _USER_TIMEOUT_MS)


_INTERNET = (socket.AF_INET, socket.AF_INET6)


def _address(locator: str) -> tuple[str, int] | None:
    """Return address and port of a TCP locator; None for what stays in this machine."""
    match = _LOCATOR.match(locator)
    if match is None:
        return None
    host = _plain(match[1] or match[2])
    return None if host is None else (host, int(match[3]))


def _plain(host: str) -> str | None:
    """Return an address in its shortest form; None if it stays in this machine, or is a name."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return None
    address = getattr(address, "ipv4_mapped", None) or address
    return None if address.is_loopback else str(address)

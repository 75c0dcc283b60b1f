"""Keeping connections of subscribers through an outage of the network, and old messages out."""

from __future__ import annotations

import socket
import struct
import sys
import time
from contextlib import suppress

__all__ = ["Unconfirmed", "outlast"]

#: Seconds. Only subscribers make connections: one that we gave up before its subscriber does would
#: leave that deaf without knowing. rospy's and roscpp's own keepalive takes 60 s and 9 times 10 s.
_KEEPALIVE = (("TCP_KEEPIDLE", 60), ("TCP_KEEPINTVL", 10), ("TCP_KEEPCNT", 12))
_LONGEST = 180
#: TCP_RTO_MAX_MS, since Linux 6.15; Python has no name for it.
_RTO_MAX = 44
#: SIOCOUTQ (Linux, ``man 7 tcp``): bytes in the send queue that the other end has not confirmed.
_UNCONFIRMED = 0x5411
_int = struct.Struct("i")
#: Seconds without confirmation after which a connection counts as stalled, and between two looks.
_PATIENCE, _LOOK = 0.5, 0.05


def outlast(sock: socket.socket) -> None:
    """Keep a subscriber's connection for three minutes of silence, and go on soon after it.

    Without that, what was published in an outage, such as a stop, is sent again only after as long
    as the outage took: TCP waits twice as long each time.
    """
    for name, value in _KEEPALIVE:
        if (option := getattr(socket, name, None)) is not None:
            sock.setsockopt(socket.IPPROTO_TCP, option, value)
    if sys.platform == "linux":
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _LONGEST * 1000)
        with suppress(OSError):  # an older Linux
            sock.setsockopt(socket.IPPROTO_TCP, _RTO_MAX, 1000)


class Unconfirmed:
    """Whether the other end has stopped confirming what it is sent.

    The system takes some megabytes more all the same, and delivers them when the outage is over: a
    robot would carry out the commands of minutes ago before the one that stops it.

    Attributes:
        written: Bytes that the system took so far; counted by the owner.
    """

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        self.written = 0
        self._confirmed = -1
        self._moved = self._looked = 0.0
        self._stalled = False

    def stalled(self) -> bool:
        """Return whether something was sent, and nothing confirmed for half a second."""
        now = time.monotonic()
        if now - self._looked < _LOOK:
            return self._stalled
        self._looked = now
        waiting = self._waiting()
        confirmed = self.written - waiting
        if not waiting or confirmed != self._confirmed:
            self._confirmed, self._moved = confirmed, now
        self._stalled = now - self._moved > _PATIENCE
        return self._stalled

    def _waiting(self) -> int:
        if sys.platform != "linux":
            return 0  # nobody tells
        import fcntl  # noqa: PLC0415 - not everywhere

        try:
            (waiting,) = _int.unpack(fcntl.ioctl(self._sock, _UNCONFIRMED, bytes(_int.size)))
        except OSError:
            return 0
        return int(waiting)

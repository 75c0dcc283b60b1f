"""Keeping connections of subscribers through an outage of the network."""

from __future__ import annotations

import socket
import sys
from contextlib import suppress

__all__ = ["outlast"]

#: Seconds. Only subscribers make connections: one that we gave up before its subscriber does would
#: leave that deaf without knowing. rospy's and roscpp's own keepalive takes 60 s and 9 times 10 s.
_KEEPALIVE = (("TCP_KEEPIDLE", 60), ("TCP_KEEPINTVL", 10), ("TCP_KEEPCNT", 12))
_LONGEST = 180
#: TCP_RTO_MAX_MS, since Linux 6.15; Python has no name for it.
_RTO_MAX = 44


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

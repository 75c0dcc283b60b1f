"""Ports of the loopback interface for the servers that tests start."""

from __future__ import annotations

import os
import random
import socket
from contextlib import suppress

#: Below those that Linux gives to sockets by itself, from 32768 on.
_FIRST, _PER_PROCESS, _PROCESSES = 11000, 3500, 6
_given: set[int] = set()


def free_port() -> int:
    """Return a port that no program listens on, and that this function has not returned before.

    From a range of this process's own: a client of another test that reconnects to a server which
    has gone must not find this test's.
    """
    number = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:]) % _PROCESSES
    while True:
        port = _FIRST + number * _PER_PROCESS + random.SystemRandom().randrange(_PER_PROCESS)
        if port in _given:
            continue
        with suppress(OSError), socket.socket() as probe:
            probe.bind(("127.0.0.1", port))
            _given.add(port)
            return port

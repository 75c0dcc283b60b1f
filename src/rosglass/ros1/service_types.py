"""The types of the graph's services, which their servers are asked for when somebody wants them."""

from __future__ import annotations

import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.errors import ConnectionLostError
from rosglass.wires.tcpros.registrations import Member
from rosglass.wires.tcpros.service_requester import locate, probe

if TYPE_CHECKING:
    from rosglass.ros1.core import Core
    from rosglass.wires.tcpros.core import BlockingPool
    from rosglass.wires.tcpros.service_requester import Peer, Place

__all__ = ["ServiceTypes"]

#: Servers asked at once; a robot has hundreds of services, and other things to do.
_AT_ONCE = 4
#: Seconds until a server that did not tell is asked again.
_AGAIN = 10.0
#: How many answers are told together while more are awaited.
_BATCH = 32


class ServiceTypes(Member):
    """Remembers what services' servers say of them, and asks those that are new.

    Nobody is asked before :meth:`of` is called for the first time.

    Args:
        core: The node.
        pool: Runs lookups.
    """

    def __init__(self, core: Core, pool: BlockingPool) -> None:
        self._core, self._pool = core, pool
        self._lock = threading.Lock()
        #: What is known, by service: whose it was according to the master, and what it says.
        self._known: dict[str, tuple[list[str], Peer]] = {}
        self._failed: dict[str, float] = {}
        self._wanted: set[str] = set()
        self._queue: deque[str] = deque()
        self._asked: set[str] = set()
        self._news = 0
        self._following = self._closed = False

    def of(self, name: str) -> Peer | None:
        """Return what a service's server says of it, None until it has said so.

        The first time, the server is asked in the background; the graph changes when it has
        answered.
        """
        nodes = self._core.graph.services().get(name)
        with self._lock:
            known = self._known.get(name)
            if nodes is None:
                return None
            if known is not None and known[0] == nodes:
                return known[1]
            self._wanted.add(name)
            begin, self._following = not self._following, True
        if begin and not self._core.closed:
            self._core.add(self)
        self._ask(name)
        return None

    def note(self, name: str, peer: Peer) -> None:
        """Remember what a server said to somebody else."""
        nodes = self._core.graph.services().get(name)
        if nodes == [peer.node]:
            with self._lock:
                self._known[name] = (nodes, peer)

    def follow(self, moved: bool, idle: bool) -> None:
        """Forget services that are gone, and ask the servers of those that are new."""
        if not (moved or idle):
            return
        services = self._core.graph.services()
        with self._lock:
            for name in [name for name in self._known if name not in services]:
                del self._known[name]
            self._wanted &= services.keys()
            open_ = [
                name
                for name in sorted(self._wanted)
                if self._known.get(name, (None,))[0] != services[name]
            ]
        for name in open_:
            self._ask(name)

    def close(self) -> None:
        """Ask nobody any more."""
        with self._lock:
            self._closed = True
            self._queue.clear()
        self._core.remove(self)

    # -- asking ----------------------------------------------------------------------------------

    def _ask(self, name: str) -> None:
        with self._lock:
            recent = time.monotonic() - self._failed.get(name, -_AGAIN) < _AGAIN
            if self._closed or recent or name in self._asked or name in self._queue:
                return
            self._queue.append(name)
        self._next()

    def _next(self) -> None:
        while True:
            with self._lock:
                if not self._queue or len(self._asked) >= _AT_ONCE:
                    return
                name = self._queue.popleft()
                self._asked.add(name)
            self._pool.run(lambda name=name: self._look_up(name))  # type: ignore[misc]

    def _look_up(self, name: str) -> None:
        place: Place | None = None
        with suppress(ConnectionLostError):
            place = locate(self._core.master, name)
        if place is None:
            self._take(name, None)
            return
        found = place
        self._core.loop.call(lambda: self._probe(name, found))

    def _probe(self, name: str, place: Place) -> None:
        try:
            probe(self._core, name, place, lambda peer, _: self._take(name, peer))
        except OSError:  # no more sockets
            self._take(name, None)

    def _take(self, name: str, peer: Peer | None) -> None:
        nodes = self._core.graph.services().get(name)
        with self._lock:
            self._asked.discard(name)
            if peer is None or nodes is None:
                self._failed[name] = time.monotonic()
            else:
                self._failed.pop(name, None)
                self._known[name] = (nodes, peer)
                self._news += 1
            pause = not self._queue and not self._asked
            tell = self._news > 0 and (pause or self._news >= _BATCH)
            if tell:
                self._news = 0
        self._next()
        if tell:
            self._core.wake()

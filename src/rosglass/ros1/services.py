"""A node's services: which it offers, and the types of those that others offer."""

from __future__ import annotations

import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from rosglass.comm import EndpointKind, QoS
from rosglass.comm.service_client import ServiceClient
from rosglass.comm.service_server import ServiceServer
from rosglass.errors import ConnectionLostError, ConversionError
from rosglass.wires.tcpros.registrations import Member
from rosglass.wires.tcpros.service_requester import TcprosRequester, locate, probe

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    from rosglass.comm import Answer, EndpointInfo, Executor
    from rosglass.comm.service_client import PendingCall
    from rosglass.messages import Message, ServiceType
    from rosglass.wires.base import OnReply, OnRequest
    from rosglass.wires.tcpros.core import BlockingPool, TcprosCore
    from rosglass.wires.tcpros.service_replier import TcprosReplier
    from rosglass.wires.tcpros.service_requester import Peer, Place

__all__ = ["ServiceTypes", "Services"]


class Services:
    """Makes clients and servers, and knows the types of others' services.

    Args:
        core: The node.

    Attributes:
        types: What others' servers say of themselves.
    """

    def __init__(self, core: TcprosCore) -> None:
        self._core = core
        self.types = ServiceTypes(core, core.lookups)

    # -- making ----------------------------------------------------------------------------------

    def client(
        self, name: str, type: ServiceType | str | None, qos: QoS | None, persistent: bool
    ) -> ServiceClient:
        """Return a new client of a service."""

        # The client keeps the calls; a connection knows the one that it was made for.
        def create(
            _pending: Mapping[int, PendingCall], on_reply: OnReply, on_change: Callable[[], None]
        ) -> TcprosRequester:
            return TcprosRequester(
                self._core, self.types.note, name, type, persistent, on_reply, on_change
            )

        return ServiceClient(self._core, name, _profile(qos, name), create)

    def serve(
        self,
        name: str,
        type: ServiceType | str,
        callback: Callable[[Message], Answer | Awaitable[Answer]],
        qos: QoS | None,
        executor: Executor | None,
    ) -> ServiceServer:
        """Offer a service.

        Raises:
            ServiceError: The node offers it already.
        """
        core, kind, profile = self._core, self._core.types.service(type), _profile(qos, name)

        # A request is only put aside for the callback, or it is taken at once: both are quick.
        def create(on_request: OnRequest, _quick: bool) -> TcprosReplier:
            return core.create_replier(name, kind, on_request)

        return ServiceServer(core, name, kind, callback, profile, executor, create)

    # -- what there is ---------------------------------------------------------------------------

    def listing(self) -> dict[str, list[str]]:
        """Return every service with its type, none as long as its server has not told it."""
        names = sorted(self._core.graph.services())
        return {name: [kind] if (kind := self._type_of(name)[0]) else [] for name in names}

    def described(self, found: list[EndpointInfo]) -> list[EndpointInfo]:
        """Return endpoints, those of services with their types."""
        return [
            replace(one, type=told[0], type_hash=told[1])
            if one.kind is EndpointKind.SERVICE_SERVER and (told := self._type_of(one.name))[0]
            else one
            for one in found
        ]

    def md5_of(self, name: str) -> str:
        """Return the md5 sum of a service's type, empty as long as it is not known."""
        return self._type_of(name)[1]

    def _type_of(self, name: str) -> tuple[str, str]:
        """Return a service's type and md5 sum, empty as long as they are not known."""
        own = self._core.repliers.get(name)
        nodes = self._core.graph.services().get(name, [])
        if own is not None and nodes == [self._core.name.full]:
            return own.type.name, own.type.md5
        peer = self.types.of(name)
        return ("", "") if peer is None else (peer.type, peer.md5)


def _profile(qos: QoS | None, name: str) -> QoS:
    if qos is not None and not isinstance(qos, QoS):
        raise ConversionError("qos", qos, "a rosglass.QoS, or None for the usual one", name)
    return qos or QoS.services()


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

    def __init__(self, core: TcprosCore, pool: BlockingPool) -> None:
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

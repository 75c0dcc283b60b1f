"""A node's service clients and servers, and the types of other nodes' services."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from rosglass.comm import EndpointKind, QoS
from rosglass.comm.service_client import ServiceClient
from rosglass.comm.service_server import ServiceServer
from rosglass.errors import ConnectionLostError, ConversionError, NodeClosedError
from rosglass.wires.tcpros.registrations import Member
from rosglass.wires.tcpros.service_requester import TcprosRequester, locate, probe

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from rosglass.comm import Answer, EndpointInfo, Executor
    from rosglass.comm.service_client import PendingCalls
    from rosglass.comm.wire import OnRequest
    from rosglass.messages import Message, ServiceType
    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.node import TcprosNode
    from rosglass.wires.tcpros.service_replier import TcprosReplier
    from rosglass.wires.tcpros.service_requester import ServerInfo, ServiceLocation

__all__ = ["ServiceTypes", "Services"]


class Services:
    """Creates service clients and servers, and caches the types of other nodes' services.

    Args:
        core: The node.

    Attributes:
        types: The types that other nodes' servers announce.
    """

    def __init__(self, core: TcprosNode) -> None:
        self._core = core
        self.types = ServiceTypes(core)

    def client(
        self, name: str, type: ServiceType | str | None, qos: QoS | None, persistent: bool
    ) -> ServiceClient:
        """Return a new client of a service."""

        def create(calls: PendingCalls, on_change: Callable[[], None]) -> TcprosRequester:
            return TcprosRequester(
                self._core, self.types.record, name, type, persistent, calls, on_change
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
        core, profile = self._core, _profile(qos, name)
        service_type = core.types.service(type)

        # `quick` makes no difference: requests are received in the loop's thread anyway.
        def create(on_request: OnRequest, _quick: bool) -> TcprosReplier:
            return core.create_replier(name, service_type, on_request)

        return ServiceServer(core, name, service_type, callback, profile, executor, create)

    # -- the graph -------------------------------------------------------------------------------

    def listing(self) -> dict[str, list[str]]:
        """Return every service with its type; no type until its server has announced it."""
        names = sorted(self._core.graph.services())
        return {name: [known] if (known := self._type_of(name)[0]) else [] for name in names}

    def described(self, found: list[EndpointInfo]) -> list[EndpointInfo]:
        """Return endpoints, with the types of services."""
        return [
            replace(one, type=known[0], type_hash=known[1])
            if one.kind is EndpointKind.SERVICE_SERVER and (known := self._type_of(one.name))[0]
            else one
            for one in found
        ]

    def md5_of(self, name: str) -> str:
        """Return the md5 sum of a service's type; empty while it is unknown."""
        return self._type_of(name)[1]

    def _type_of(self, name: str) -> tuple[str, str]:
        """Return a service's type and md5 sum; empty while they are unknown."""
        own = self._core.repliers.get(name)
        nodes = self._core.graph.services().get(name, [])
        if own is not None and nodes == [self._core.name.full]:
            return own.type.name, own.type.md5
        peer = self.types.of(name)
        return ("", "") if peer is None else (peer.type, peer.md5)


def _profile(qos: QoS | None, name: str) -> QoS:
    if qos is not None and not isinstance(qos, QoS):
        raise ConversionError("qos", qos, "a rosglass.QoS, or None for the default", name)
    return qos or QoS.services()


#: Servers probed at once; a robot has hundreds of services, and other things to do.
_MAX_PROBES = 4
#: Seconds until a server that did not answer is probed again.
_RETRY_S = 10.0
#: Answers after which the graph is reported as changed while more are awaited.
_BATCH = 32


class ServiceTypes(Member):
    """Caches the types that services' servers announce, and probes the servers of new services.

    Nothing is probed before the first call of :meth:`of`. The I/O loop's thread owns the state;
    other threads only read what is known.

    Args:
        core: The node.
    """

    def __init__(self, core: TcprosCore) -> None:
        self._core = core
        #: By service: its nodes according to the master, and what its server announces.
        self._known: dict[str, tuple[list[str], ServerInfo]] = {}
        #: When a probe failed, by monotonic time.
        self._failed: dict[str, float] = {}
        #: Services whose types users have asked for.
        self._wanted: set[str] = set()
        #: Services whose servers are to be probed, in order.
        self._queue: dict[str, None] = {}
        self._probed: set[str] = set()
        self._news = 0
        self._following = self._closed = False

    def of(self, name: str) -> ServerInfo | None:
        """Return the announcement of a service's server; None until it has answered.

        The first time, the server is probed in the background; the graph changes when it has
        answered. From any thread.
        """
        nodes = self._core.graph.services().get(name)
        if nodes is None:
            return None
        known = self._known.get(name)
        if known is not None and known[0] == nodes:
            return known[1]
        self._core.loop.call(lambda: self._want(name))
        return None

    def record(self, name: str, peer: ServerInfo) -> None:
        """Store the announcement that a client has received; in the loop's thread."""
        nodes = self._core.graph.services().get(name)
        if nodes == [peer.node]:
            self._known[name] = (nodes, peer)

    def follow(self, moved: bool, idle: bool) -> None:
        """Forget services that are gone, and probe the servers of new ones."""
        if moved or idle:
            self._core.loop.call(self._compare)

    def close(self) -> None:
        """Stop probing servers."""
        self._closed = True
        self._core.remove(self)

    # -- in the loop's thread --------------------------------------------------------------------

    def _want(self, name: str) -> None:
        self._wanted.add(name)
        if not self._following:
            self._following = True
            with suppress(NodeClosedError):  # then nothing follows
                self._core.add(self)
        self._enqueue(name)

    def _compare(self) -> None:
        services = self._core.graph.services()
        for name in self._known.keys() - services.keys():
            del self._known[name]
        self._wanted &= services.keys()
        for name in sorted(self._wanted):
            known = self._known.get(name)
            if known is None or known[0] != services[name]:
                self._enqueue(name)

    def _enqueue(self, name: str) -> None:
        recent = time.monotonic() - self._failed.get(name, -_RETRY_S) < _RETRY_S
        if not (recent or name in self._probed or name in self._queue):
            self._queue[name] = None
            self._advance()

    def _advance(self) -> None:
        while self._queue and len(self._probed) < _MAX_PROBES and not self._closed:
            name = next(iter(self._queue))
            del self._queue[name]
            self._probed.add(name)
            self._core.lookups.run(lambda name=name: self._locate(name))  # type: ignore[misc]

    def _locate(self, name: str) -> None:
        """Ask the master where the server is; on a thread that may wait."""
        location: ServiceLocation | None = None
        with suppress(ConnectionLostError):  # it is tried again later
            location = locate(self._core.master, name)
        self._core.loop.call(lambda: self._probe(name, location))

    def _probe(self, name: str, location: ServiceLocation | None) -> None:
        try:
            if location is not None:
                probe(self._core, name, location, lambda peer, _: self._on_answer(name, peer))
                return
        except OSError:  # no more sockets
            pass
        self._on_answer(name, None)

    def _on_answer(self, name: str, peer: ServerInfo | None) -> None:
        nodes = self._core.graph.services().get(name)
        self._probed.discard(name)
        if peer is None or nodes is None:
            self._failed[name] = time.monotonic()
        else:
            self._failed.pop(name, None)
            self._known[name] = (nodes, peer)
            self._news += 1
        pause = not self._queue and not self._probed
        if self._news and (pause or self._news >= _BATCH):
            self._news = 0
            self._core.wake()
        self._advance()

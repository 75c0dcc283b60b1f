"""A node's services: which it offers, and the types of those that others offer."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import TYPE_CHECKING

from rosglass.comm import EndpointKind, QoS
from rosglass.comm.service_client import ServiceClient
from rosglass.comm.service_server import ServiceServer
from rosglass.errors import ConversionError, ServiceError
from rosglass.ros1.service_types import ServiceTypes
from rosglass.wires.tcpros.service_replier import TcprosReplier
from rosglass.wires.tcpros.service_requester import TcprosRequester

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    from rosglass.comm import Answer, EndpointInfo, Executor
    from rosglass.comm.service_client import PendingCall
    from rosglass.messages import Message, ServiceType
    from rosglass.ros1.core import Core
    from rosglass.wires.base import OnReply, OnRequest
    from rosglass.wires.tcpros.connection import Connection

__all__ = ["Services"]


class Services:
    """Repliers by name, and what clients share.

    Args:
        core: The node.

    Attributes:
        types: What others' servers say of themselves.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        self._lock = threading.Lock()
        self._repliers: dict[str, TcprosReplier] = {}
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
            made = TcprosReplier(core, name, kind, on_request, self._on_close)
            with self._lock:
                taken = name in self._repliers
                if not taken:
                    self._repliers[name] = made
            if taken:
                raise ServiceError(
                    f"{core.name} offers {name} already, and in ROS 1 a service has one server: "
                    "close that one first"
                )
            core.add(made)
            return made

        return ServiceServer(core, name, kind, callback, profile, executor, create)

    # -- connections, in the loop's thread -------------------------------------------------------

    def accept(self, link: Connection, header: dict[str, str]) -> str:
        """Take a client's connection; return why not, empty when it is taken."""
        replier = self._repliers.get(header.get("service", ""))
        if replier is None:
            return f"{self._core.name} does not offer {header.get('service')}"
        return replier.accept(link, header)

    def on_frame(self, link: Connection, data: bytes | memoryview) -> None:
        """Take a request."""
        replier = self._repliers.get(link.header.get("service", ""))
        if replier is not None:
            replier.on_frame(link, data)

    def on_disconnected(self, link: Connection) -> None:
        """Forget a client's connection that has ended."""
        replier = self._repliers.get(link.header.get("service", ""))
        if replier is not None:
            replier.on_disconnected(link)

    def _on_close(self, replier: TcprosReplier) -> None:
        with self._lock:
            if self._repliers.get(replier.name) is replier:
                del self._repliers[replier.name]

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
        own = self._repliers.get(name)
        nodes = self._core.graph.services().get(name, [])
        if own is not None and nodes == [self._core.name.full]:
            return own.type.name, own.type.md5
        peer = self.types.of(name)
        return ("", "") if peer is None else (peer.type, peer.md5)


def _profile(qos: QoS | None, name: str) -> QoS:
    if qos is not None and not isinstance(qos, QoS):
        raise ConversionError("qos", qos, "a rosglass.QoS, or None for the usual one", name)
    return qos or QoS.services()

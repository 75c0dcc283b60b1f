"""A node's services: which it offers, and the types of those that others offer."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rosglass.comm import EndpointKind, QoS
from rosglass.comm.service_client import ServiceClient
from rosglass.comm.service_server import ServiceServer
from rosglass.errors import ConversionError
from rosglass.ros1.service_types import ServiceTypes
from rosglass.wires.tcpros.service_requester import TcprosRequester

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    from rosglass.comm import Answer, EndpointInfo, Executor
    from rosglass.comm.service_client import PendingCall
    from rosglass.messages import Message, ServiceType
    from rosglass.ros1.core import Core
    from rosglass.wires.base import OnReply, OnRequest
    from rosglass.wires.tcpros.service_replier import TcprosReplier

__all__ = ["Services"]


class Services:
    """Makes clients and servers, and knows the types of others' services.

    Args:
        core: The node.

    Attributes:
        types: What others' servers say of themselves.
    """

    def __init__(self, core: Core) -> None:
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

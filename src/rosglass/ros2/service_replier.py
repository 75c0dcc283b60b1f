"""Offering a service to clients of ROS 2: versions of its type, and replies that are not lost."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, QoS
from rosglass.comm.core import NodeMember
from rosglass.comm.service_server import ServiceServer
from rosglass.errors import Error, NodeClosedError
from rosglass.ros2.announced import Announced, mismatches, nodes_of
from rosglass.ros2.pacing import ReplyPacer
from rosglass.wires.base import Replier, RequestId

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from rosglass.comm import Answer, Executor
    from rosglass.messages import Message, ServiceType
    from rosglass.ros2.core import Core
    from rosglass.wires.base import OnRequest

__all__ = ["Ros2Replier", "create_service_server"]

_log = logging.getLogger("rosglass.ros2")


def create_service_server(
    core: Core,
    name: str,
    type: ServiceType | str,
    callback: Callable[[Message], Answer | Awaitable[Answer]],
    qos: QoS | None = None,
    executor: Executor | None = None,
) -> ServiceServer:
    """Offer a service in a ROS 2 node.

    Args:
        core: The node.
        name: Absolute service name.
        type: The type, or its name.
        callback: Called with each request; see :meth:`Node.create_service_server`.
        qos: Profile of requests and replies; None for the usual one.
        executor: Where `callback` runs; None for the node's dispatcher, or for the running event
            loop when `callback` is a coroutine function.
    """
    kind, profile = core.types.service(type), qos or QoS.services()

    def create(on_request: OnRequest, quick: bool) -> Replier:
        return Ros2Replier(core, name, kind, profile, on_request, quick)

    return ServiceServer(core, name, kind, callback, profile, executor, create)


class Ros2Replier(Replier, NodeMember):
    """A middleware's replier, with what every ROS 2 server needs besides.

    It names clients of other versions of the type, and other servers of the same service; and it
    sends no more replies at once than a client's queue holds.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        type: The type.
        qos: Profile of requests and replies.
        on_request: Called with each request.
        quick: Whether that only puts a request aside for another thread.
    """

    def __init__(
        self,
        core: Core,
        name: str,
        type: ServiceType,
        qos: QoS,
        on_request: OnRequest,
        quick: bool,
    ) -> None:
        self._core, self._name, self._on_request = core, name, on_request
        self._announced = Announced(core, core.types.service, type, fixed=True)
        self._pacer = ReplyPacer(core.timers)
        self._closed = False
        self._warned = ""
        kind, known = EndpointKind.SERVICE_SERVER, self._announced.hash
        self._replier = core.middleware.create_replier(
            EndpointInfo(kind, name, type.name, core.name, qos, known), self._count_request
        )
        self._replier.quick = quick
        core.add(self)
        core.wake()

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some clients cannot be served, in words; empty when all is well."""
        graph = self._core.graph
        clients = graph.endpoints(EndpointKind.SERVICE_CLIENT, self._name)
        problems = mismatches(self._announced, clients, "calls", "it is not served")
        if not problems and self._replier.problem:
            problems.append(self._replier.problem)
        servers = graph.endpoints(EndpointKind.SERVICE_SERVER, self._name)
        others = [server for server in servers if server.node != self._core.name]
        if others:
            problems.append(
                f"{nodes_of(others)} offers {self._name}, too: clients get whichever answer comes "
                "first; end one of the two"
            )
        return "; ".join(problems)

    @property
    def tells_failures(self) -> bool:  # type: ignore[override]
        """Whether :meth:`fail` tells anything."""
        return self._replier.tells_failures

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - the graph alone matters
        """Follow a change of the graph: log what is wrong, once."""
        if not moved or self._closed:
            return
        problem = self.problem
        if problem and problem != self._warned:
            _log.warning("%s: %s", self._name, problem)
        self._warned = problem

    def _count_request(self, request: RequestId, data: bytes | memoryview) -> None:
        self._pacer.on_request(request.client)
        self._on_request(request, data)

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Answer a request, as soon as its client can take the reply."""
        if self._pacer.on_reply(request.client):
            self._replier.reply(request, data)
        else:
            self._pacer.send_later(request.client, lambda: self._reply_later(request, data))

    def _reply_later(self, request: RequestId, data: bytes | bytearray) -> None:
        try:
            self._replier.reply(request, data)
        except NodeClosedError:
            pass  # another thread has closed it
        except Error as error:
            _log.error("%s: cannot answer %s: %s", self._name, self.client_name(request), error)

    def fail(self, request: RequestId, reason: str) -> None:
        """Tell the client that no response will come, where the middleware can say so."""
        self._pacer.on_failure(request.client)
        self._replier.fail(request, reason)

    def client_name(self, request: RequestId) -> str:
        """Return who sent a request, for people."""
        clients = self._core.graph.endpoints(EndpointKind.SERVICE_CLIENT, self._name)
        known = [client for client in clients if client.gid and client.gid == request.client]
        if known or len(clients) == 1:
            return nodes_of(known or clients)
        return super().client_name(request)

    def close(self) -> None:
        """Send the replies that wait, and withdraw the service; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._pacer.flush()
        self._replier.close()
        self._core.remove(self)

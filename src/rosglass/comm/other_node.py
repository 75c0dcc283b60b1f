"""Asking another node by the services that such nodes have by themselves, and hearing its news."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from rosglass.comm.handle import Handle
from rosglass.errors import NodeClosedError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm.handle import Executor
    from rosglass.comm.node import Node
    from rosglass.comm.promise import Deadline
    from rosglass.comm.qos import QoS
    from rosglass.comm.service_client import ServiceClient
    from rosglass.comm.subscription import Subscription
    from rosglass.messages import Message

__all__ = ["OtherNode"]


class OtherNode(Handle):
    """Another node's services of one kind; each has a client from its first call on.

    Args:
        owner: The node that asks.
        node: Full name of the node that is asked.
        services: Their types by their names, without the node's.
        first: The one that tells whether the node is there. It has a client at once, so that this
            finds its server while the caller still prepares its question.
        qos: The services' profile; None for the usual one.
    """

    def __init__(
        self,
        owner: Node,
        node: str,
        services: Mapping[str, str],
        first: str,
        qos: QoS | None = None,
    ) -> None:
        self.node = node
        self._owner, self._services, self._qos = owner, services, qos
        self._lock = threading.Lock()
        self._clients: dict[str, ServiceClient] = {}
        self._watches: list[Subscription] = []
        self._closed = False
        self._first = first
        self._client(first)

    @property
    def ready(self) -> bool:
        """Whether the node is there and has such services."""
        return not self._closed and self._client(self._first).ready

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for the node; return whether it is there."""
        return self._client(self._first).wait_for_server(timeout)

    def close(self) -> None:
        """Ask and watch no more; calls that wait end with NodeClosedError. Safe to call twice."""
        with self._lock:
            self._closed = True
            made = [*self._clients.values(), *self._watches]
            self._clients, self._watches = {}, []
        for handle in made:
            handle.close()

    def _check_open(self) -> None:
        if self._closed:
            raise NodeClosedError(f"{self!r} is closed; create another one")

    def _client(self, service: str) -> ServiceClient:
        with self._lock:
            self._check_open()
            client = self._clients.get(service)
            if client is None:
                name = f"{self.node}/{service}"
                client = self._owner.create_service_client(name, self._services[service], self._qos)
                self._clients[service] = client
            return client

    def _call(self, service: str, request: dict[str, Any], deadline: Deadline) -> Message:
        return self._client(service).call(request, timeout=deadline.left())

    def _watch(
        self,
        topic: str,
        type: str,
        receive: Callable[[Message], None],
        qos: QoS | int,
        executor: Executor | None,
    ) -> Handle:
        """Hear of the node's news until the handle, or this, is closed."""
        watch = self._owner.create_subscription(topic, type, receive, qos, executor=executor)
        with self._lock:
            self._watches = [*(w for w in self._watches if not w.closed), watch]
        return watch

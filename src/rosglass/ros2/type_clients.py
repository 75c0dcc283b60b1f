"""Connections to the nodes that are asked for definitions."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from rosglass.ros2.type_descriptions import service_type

if TYPE_CHECKING:
    from rosglass.comm import ServiceClient
    from rosglass.ros2.core import Core

__all__ = ["TypeClients"]

#: Seconds for which an unused connection to a node is kept.
_LINGER = 5.0


class TypeClients:
    """One client of each ``get_type_description`` in use.

    Args:
        core: The node that asks.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        self._lock = threading.Lock()
        self._closed = False
        self._known: dict[str, tuple[ServiceClient, float]] = {}

    def __bool__(self) -> bool:
        return bool(self._known)

    def get(self, service: str) -> ServiceClient:
        """Return the client of a service; raises NodeClosedError, or what creating one raises."""
        from rosglass.ros2.service_client import create_service_client  # noqa: PLC0415 - when needed

        known = self._known.get(service)
        if known is None:
            client = create_service_client(self._core, service, service_type())
        else:
            client = known[0]
        with self._lock:
            closed = self._closed
            if not closed:
                self._known[service] = (client, time.monotonic())
        if closed:
            client.close()
        return client

    def close_idle(self, now: float) -> None:
        """Close those that were not used for a while."""
        with self._lock:
            idle = [
                service
                for service, (client, used) in self._known.items()
                if not client.pending and now - used > _LINGER
            ]
            clients = [self._known.pop(service)[0] for service in idle]
        for client in clients:
            client.close()

    def close(self) -> None:
        """Close all of them."""
        with self._lock:
            self._closed = True
            clients, self._known = list(self._known.values()), {}
        for client, _ in clients:
            client.close()

"""The ROS graph as seen from here: which nodes exist, and what they publish and subscribe to."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, NodeName

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

__all__ = ["Graph"]


class Graph:
    """Nodes and endpoints, each under the key its middleware knows it by.

    Middlewares put and remove entries from their threads; everyone may read from any thread.

    Args:
        changed: Called after each change, in the thread that made it; must return at once.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self._lock = threading.Lock()
        self._nodes: dict[Hashable, NodeName] = {}
        self._endpoints: dict[Hashable, EndpointInfo] = {}
        self._by_name: dict[str, dict[Hashable, EndpointInfo]] = {}

    def put_node(self, key: Hashable, node: NodeName) -> None:
        """Add the node known as `key`."""
        with self._lock:
            known = self._nodes.get(key) == node
            self._nodes[key] = node
        if not known:
            self._changed()

    def put_endpoint(self, key: Hashable, endpoint: EndpointInfo) -> None:
        """Add the endpoint known as `key`, or replace what was known about it."""
        with self._lock:
            known = self._endpoints.get(key)
            if known is not None and known.name != endpoint.name:
                self._forget_name(key, known)
            self._endpoints[key] = endpoint
            self._by_name.setdefault(endpoint.name, {})[key] = endpoint
        if known != endpoint:
            self._changed()

    def remove(self, key: Hashable) -> None:
        """Remove the node or endpoint known as `key`, if there is one."""
        with self._lock:
            node = self._nodes.pop(key, None)
            endpoint = self._endpoints.pop(key, None)
            if endpoint is not None:
                self._forget_name(key, endpoint)
        if node is not None or endpoint is not None:
            self._changed()

    def nodes(self) -> list[NodeName]:
        """Return the names of all nodes, sorted; nodes that share a name appear once."""
        with self._lock:
            names = set(self._nodes.values())
            names.update(endpoint.node for endpoint in self._endpoints.values())
        return sorted(names)

    def topics(self) -> dict[str, list[str]]:
        """Return every topic with the types announced for it, both sorted."""
        topics: dict[str, set[str]] = {}
        with self._lock:
            for endpoint in self._endpoints.values():
                if endpoint.kind in (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION):
                    topics.setdefault(endpoint.name, set()).add(endpoint.type)
        return {name: sorted(types) for name, types in sorted(topics.items())}

    def endpoints(self, kind: EndpointKind, name: str) -> list[EndpointInfo]:
        """Return the endpoints of a kind at a topic or service, in order of appearance."""
        with self._lock:
            found = self._by_name.get(name, {}).values()
            return [endpoint for endpoint in found if endpoint.kind is kind]

    def clear(self) -> None:
        """Forget everything: what cannot be seen any more must not look alive."""
        with self._lock:
            self._nodes.clear()
            self._endpoints.clear()
            self._by_name.clear()
        self._changed()

    def _forget_name(self, key: Hashable, endpoint: EndpointInfo) -> None:
        named = self._by_name[endpoint.name]
        del named[key]
        if not named:
            del self._by_name[endpoint.name]

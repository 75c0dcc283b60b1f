"""The ROS graph: nodes, endpoints, and the state of a node's connection to it."""

from __future__ import annotations

import threading
from collections import Counter
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Protocol

from rosglass.comm.names import action_of, hidden, is_valid_node, is_valid_topic
from rosglass.comm.qos import QoS

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable

__all__ = ["ConnectionState", "EndpointInfo", "EndpointKind", "Graph", "NodeName", "Status"]


class EndpointKind(Enum):
    """The kind of an endpoint."""

    PUBLISHER = "publisher"
    SUBSCRIPTION = "subscription"
    SERVICE_SERVER = "service server"
    SERVICE_CLIENT = "service client"


@dataclass(frozen=True, slots=True, order=True)
class NodeName:
    """A node's name and namespace.

    Attributes:
        namespace: Absolute namespace, ``/`` for the root.
        name: Base name without slashes.
    """

    namespace: str
    name: str

    @property
    def full(self) -> str:
        """Full name, e.g. ``/arm/gripper``."""
        return f"{self.namespace.rstrip('/')}/{self.name}"

    def __str__(self) -> str:
        return self.full


@dataclass(frozen=True, slots=True)
class EndpointInfo:
    """A publisher, subscription, service server or service client seen in the graph.

    Attributes:
        kind: Its kind.
        name: Topic or service name, absolute.
        type: Type name, ``pkg/msg/Type``.
        node: The node it belongs to.
        qos: Its announced quality of service.
        type_hash: RIHS01 hash (REP 2016) or md5 sum (ROS 1); empty if not announced. Over DDS, a
            service is announced with the hash of its request.
        response_hash: The same of a service's response; empty if not announced.
        gid: Identity of the endpoint; empty if the wire has none.
    """

    kind: EndpointKind
    name: str
    type: str
    node: NodeName
    qos: QoS = field(default_factory=QoS)
    type_hash: str = ""
    gid: bytes = b""
    response_hash: str = ""


class ConnectionState(Enum):
    """State of a node's connection to the graph."""

    CONNECTING = "connecting"
    CONNECTED = "connected"
    LOST = "lost"
    CLOSED = "closed"


@dataclass(frozen=True, slots=True)
class Status:
    """The status of a node's connection, for users.

    Attributes:
        state: The state.
        detail: One line about what was tried and what happens next, e.g.
            ``no router at tcp/127.0.0.1:7447, retrying every second``.
        killed: Whether another node requested this one to shut down, as ``rosnode kill`` does;
            False if a new node has taken its name.
    """

    state: ConnectionState
    detail: str = ""
    killed: bool = False

    def __str__(self) -> str:
        return f"{self.state.name}: {self.detail}" if self.detail else self.state.name


_TOPICS = (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION)
_SERVICES = (EndpointKind.SERVICE_SERVER, EndpointKind.SERVICE_CLIENT)


class GraphView(Protocol):
    """The read-only interface of a graph."""

    def topics(self) -> dict[str, list[str]]:
        """Return all topics with their announced types."""

    def nodes(self) -> list[NodeName]:
        """Return all nodes, sorted."""

    def invalid_names(self) -> list[str]:
        """Return invalid names; see :meth:`rosglass.comm.Node.invalid_names`."""

    def endpoints(self, kind: EndpointKind, name: str) -> list[EndpointInfo]:
        """Return the endpoints of a kind at a topic or service."""

    def endpoints_of(self, node: NodeName) -> list[EndpointInfo]:
        """Return the endpoints of a node."""

    def clear(self) -> None:
        """Remove everything."""


class Graph:
    """Nodes and endpoints by the middleware's keys; thread-safe.

    Entries with names that ROS's rules forbid are left out, as they could not be used; see
    :meth:`invalid_names`.

    Args:
        changed: Called after each change, in the thread that made it; must not block.

    Attributes:
        version: Another number after each change.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self._report_change = changed
        self.version = 0
        #: Guards all members below, which belong together.
        self._lock = threading.Lock()
        self._nodes: dict[Hashable, NodeName] = {}
        self._invalid: dict[Hashable, str] = {}
        self._endpoints: dict[Hashable, EndpointInfo] = {}
        self._by_name: dict[str, dict[Hashable, EndpointInfo]] = {}
        self._by_node: dict[NodeName, dict[Hashable, EndpointInfo]] = {}
        self._watchers: dict[str, list[Callable[[EndpointInfo], None]]] = {}

    def watch(self, name: str, on_endpoint_removed: Callable[[EndpointInfo], None]) -> None:
        """Report each removed endpoint of a topic or service, however briefly it existed.

        Args:
            name: Name of the topic or service.
            on_endpoint_removed: Called in the thread that removes it; must not block.
        """
        with self._lock:
            self._watchers.setdefault(name, []).append(on_endpoint_removed)

    def unwatch(self, name: str, on_endpoint_removed: Callable[[EndpointInfo], None]) -> None:
        """Undo :meth:`watch`; safe to call twice."""
        with self._lock:
            left = [one for one in self._watchers.pop(name, ()) if one != on_endpoint_removed]
            if left:
                self._watchers[name] = left

    def put_node(self, key: Hashable, node: NodeName) -> None:
        """Add a node, or replace the one of the same key."""
        if not is_valid_node(node.full):
            self._put_invalid(key, node.full)
            return
        with self._lock:
            known = self._nodes.get(key) == node
            self._nodes[key] = node
            self._invalid.pop(key, None)
        if not known:
            self._changed()

    def put_endpoint(self, key: Hashable, endpoint: EndpointInfo) -> None:
        """Add an endpoint, or replace the one of the same key."""
        name, kind, node = endpoint.name, endpoint.type, endpoint.node.full
        if not (is_valid_topic(name) and kind.isprintable() and is_valid_node(node)):
            self._put_invalid(key, f"{name} [{kind}] of {node}")
            return
        with self._lock:
            self._invalid.pop(key, None)
            known = self._endpoints.get(key)
            if known is not None and (known.name, known.node) != (endpoint.name, endpoint.node):
                self._remove_endpoint(key, known)
            self._endpoints[key] = endpoint
            self._by_name.setdefault(endpoint.name, {})[key] = endpoint
            self._by_node.setdefault(endpoint.node, {})[key] = endpoint
        if known != endpoint:
            self._changed()

    def remove(self, key: Hashable) -> None:
        """Remove the node or endpoint of a key, if there is one."""
        with self._lock:
            endpoint = self._endpoints.get(key)
            watchers = [] if endpoint is None else self._watchers.get(endpoint.name, []).copy()
            moved = self._remove(key)
        if endpoint is not None:
            for on_endpoint_removed in watchers:
                on_endpoint_removed(endpoint)
        if moved:
            self._changed()

    def nodes(self) -> list[NodeName]:
        """Return the names of all nodes, sorted; nodes that share a name appear once."""
        with self._lock:
            names = {*self._nodes.values(), *self._by_node}
        return sorted(names)

    def invalid_names(self) -> list[str]:
        """Return the names that ROS's rules forbid, sorted."""
        with self._lock:
            return sorted(set(self._invalid.values()))

    def duplicate_nodes(self) -> dict[str, int]:
        """Return the full names that several nodes share, with the number of nodes."""
        with self._lock:
            counts = Counter(self._nodes.values())
        return {name.full: count for name, count in sorted(counts.items()) if count > 1}

    def topics(self, *, hidden: bool = True) -> dict[str, list[str]]:
        """Return all topics with their announced types, both sorted.

        Args:
            hidden: Whether to include hidden topics; see :func:`rosglass.comm.names.hidden`.
        """
        return self._names(_TOPICS, hidden)

    def services(self, *, hidden: bool = True) -> dict[str, list[str]]:
        """Return all services with a server or a client; arguments as for :meth:`topics`."""
        return self._names(_SERVICES, hidden)

    def actions(self) -> dict[str, list[str]]:
        """Return all actions with their announced types, both sorted.

        They are derived from the names of their services ``send_goal`` and topics ``feedback``.
        """
        with self._lock:
            hits = [
                action_of(endpoint.name, endpoint.type)
                for name, endpoints in self._by_name.items()
                if "/_action/" in name
                for endpoint in endpoints.values()
            ]
        return _sorted(hit for hit in hits if hit is not None)

    def endpoints(self, kind: EndpointKind, name: str) -> list[EndpointInfo]:
        """Return the endpoints of a kind at a topic or service, in order of appearance."""
        with self._lock:
            found = self._by_name.get(name, {}).values()
            return [endpoint for endpoint in found if endpoint.kind is kind]

    def endpoints_of(self, node: NodeName) -> list[EndpointInfo]:
        """Return all endpoints of a node, in order of appearance."""
        with self._lock:
            return list(self._by_node.get(node, {}).values())

    def users(self) -> dict[str, list[EndpointInfo]]:
        """Return the endpoints of every type, by the type's name, in order of appearance."""
        found: dict[str, list[EndpointInfo]] = {}
        with self._lock:
            for endpoint in self._endpoints.values():
                found.setdefault(endpoint.type, []).append(endpoint)
        return found

    def clear(self) -> None:
        """Remove all entries, so that unreachable endpoints do not look alive."""
        with self._lock:
            self._nodes.clear()
            self._invalid.clear()
            self._endpoints.clear()
            self._by_name.clear()
            self._by_node.clear()
        self._changed()

    def _changed(self) -> None:
        with self._lock:
            self.version += 1
        self._report_change()

    def _names(self, kinds: tuple[EndpointKind, ...], all_names: bool) -> dict[str, list[str]]:
        with self._lock:
            found = [
                (name, endpoint.type)
                for name, endpoints in self._by_name.items()
                if all_names or not hidden(name)
                for endpoint in endpoints.values()
                if endpoint.kind in kinds
            ]
        return _sorted(found)

    def _put_invalid(self, key: Hashable, name: str) -> None:
        with self._lock:
            moved = self._remove(key) or self._invalid.get(key) != name
            self._invalid[key] = name
        if moved:
            self._changed()

    def _remove(self, key: Hashable) -> bool:
        """Remove the entries of a key; return whether there were any. The lock is held."""
        endpoint = self._endpoints.pop(key, None)
        if endpoint is not None:
            self._remove_endpoint(key, endpoint)
        node, name = self._nodes.pop(key, None), self._invalid.pop(key, None)
        return not (endpoint is None and node is None and name is None)

    def _remove_endpoint(self, key: Hashable, endpoint: EndpointInfo) -> None:
        named, owned = self._by_name[endpoint.name], self._by_node[endpoint.node]
        del named[key], owned[key]
        if not named:
            del self._by_name[endpoint.name]
        if not owned:
            del self._by_node[endpoint.node]


def _sorted(pairs: Iterable[tuple[str, str]]) -> dict[str, list[str]]:
    """Return the second items of pairs by their first ones, both sorted."""
    found: dict[str, set[str]] = {}
    for name, type_name in pairs:
        found.setdefault(name, set()).add(type_name)
    return {name: sorted(types) for name, types in sorted(found.items())}

"""One of a bridge's two graphs: its sources, without those of this and of parallel bridges.

So that nothing is relayed in circles, each bridge publishes in both graphs the routes of what it
relays from other bridges; none relays something to a graph where it has been before.
"""

from __future__ import annotations

import json
import logging
import math
import threading
import time
from typing import TYPE_CHECKING

from rosglass.comm import IMMEDIATE, ConnectionState, EndpointKind, NodeName, QoS
from rosglass.errors import UnsupportedError
from rosglass.messages import default_library

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from rosglass.comm import EndpointInfo, Node, Subscription
    from rosglass.messages import ActionTranslation, Message, ServiceTranslation, Translation

__all__ = ["BRIDGE_NAME", "TOPIC", "Routes", "Side", "key_of"]


#: Prefix of the names of bridges' nodes.
BRIDGE_NAME = "rosglass_bridge"
#: Seconds within which both nodes of a new bridge are discovered.
_PAIRING_TIME_S = 3.0
#: Seconds that discovery takes.
_DISCOVERY_TIME_S = 1.5


class Side:
    """One of a bridge's two graphs.

    Parallel bridges, between the same two graphs, do not count as sources: they publish what this
    bridge relays itself. Their nodes have the same base name in both graphs. A bridge to a third
    graph is a source, unless what it relays has been in the other graph before (see
    :class:`Routes`).

    Args:
        node: The bridge's node in this graph.
        number: 0 for the first graph, 1 for the second.

    Attributes:
        other: The other graph.
    """

    other: Side
    routes: Routes | None = None

    def __init__(self, node: Node, number: int) -> None:
        self.node, self.number = node, number
        self.name = NodeName(node.namespace, node.name)
        self._names: set[str] = set()
        self._bridges: set[NodeName] = set()
        self._marked: set[str] = set()
        self._previous_routes: dict[str, frozenset[str]] = {}
        self._new_routes: dict[str, frozenset[str]] = {}
        self._seen: dict[NodeName, float] = {}
        self._since = math.inf

    @property
    def connected(self) -> bool:
        """True while the node is connected, so that its graph is up to date."""
        return self.node.status().state is ConnectionState.CONNECTED

    @property
    def known(self) -> bool:
        """True once discovery has had time to complete."""
        return time.monotonic() - self._since > _DISCOVERY_TIME_S

    def update(self) -> None:
        """Read the nodes and bridges of the graph."""
        nodes = self.node.nodes()
        self._names = {node.name for node in nodes}
        end = f"/{TOPIC}"
        self._marked = {t.removesuffix(end) for t in self.node.topics() if t.endswith(end)}
        now = time.monotonic()
        self._since = min(self._since, now) if self.connected else math.inf
        self._previous_routes, self._new_routes = self._new_routes, {}
        self._bridges = {node for node in nodes if self.is_bridge(node)} - {self.name}
        self._seen = {node: self._seen.get(node, now) for node in self._bridges}

    def follow_routes(self) -> None:
        """Subscribe to the routes of bridges to other graphs; after both sides' :meth:`update`."""
        if self.routes is not None:
            self.routes.follow(node for node in self._bridges if not self.is_parallel(node))

    def is_bridge(self, node: NodeName) -> bool:
        """Return whether a node is that of a bridge."""
        return node.name.startswith(BRIDGE_NAME) or node.full in self._marked

    def is_parallel(self, node: NodeName) -> bool:
        """Return whether a node is that of another bridge between the same two graphs."""
        if node == self.name or not self.is_bridge(node):
            return False
        if node.name in self.other._names:
            return True
        # Its other node may not be discovered yet.
        return time.monotonic() - self._seen.get(node, time.monotonic()) < _PAIRING_TIME_S

    def sources(self, endpoints: Iterable[EndpointInfo]) -> list[EndpointInfo]:
        """Return the endpoints to relay: none of this, a parallel, or a circular bridge."""
        return [e for e in endpoints if e.node != self.name and self._is_source(e)]

    def _is_source(self, end: EndpointInfo) -> bool:
        if self.routes is None or not self.is_bridge(end.node) or self.is_parallel(end.node):
            return not self.is_parallel(end.node)
        path = self.routes.path(end)
        if path is None or path & self.other._names:
            self.routes.reject(end)
            return False
        return self.routes.accept(end)

    def _path(self, endpoints: Iterable[EndpointInfo]) -> frozenset[str]:
        """Return the bridges on the way of those endpoints that are, or will be, relayed."""
        found: set[str] = set()
        for end in endpoints:
            if self.routes is None or end.node not in self._bridges or self.is_parallel(end.node):
                continue
            path = self.routes.path(end) or frozenset()
            if not path & self.other._names:
                found |= path
        return frozenset(found)

    def add_route(self, key: str, endpoints: Sequence[EndpointInfo]) -> None:
        """Add the route of a relayed topic or service, for :meth:`publish_routes`."""
        # A relay without sources is kept for a while, with its last route.
        before = (
            frozenset() if self.sources(endpoints) else self._previous_routes.get(key, frozenset())
        )
        self._new_routes[key] = before | self._path(endpoints)

    def publish_routes(self) -> None:
        """Publish the routes of what is relayed from here, in the other graph."""
        if self.other.routes is not None:
            self.other.routes.publish(self._new_routes)

    def find_circle(self, endpoints: Iterable[EndpointInfo]) -> str:
        """Return why one of these endpoints would be relayed in a circle; empty if none would."""
        for end in endpoints:
            if self.routes is None or end.node not in self._bridges or self.is_parallel(end.node):
                continue
            known = (self.routes.path(end) or frozenset()) & self.other._names
            if known:
                names = " and ".join(sorted(known))
                return (
                    f"these bridges form a ring: {end.node} relays what {names} "
                    f"{'has' if len(known) == 1 else 'have'} relayed from there; it is not relayed "
                    "again, or it would go round for ever: leave one bridge out"
                )
        return ""

    def parallel(self, endpoints: Iterable[EndpointInfo]) -> list[EndpointInfo]:
        """Return the endpoints of parallel bridges."""
        return [e for e in endpoints if self.is_parallel(e.node)]

    def add_type(self, translation: Translation | ServiceTranslation | ActionTranslation) -> None:
        """Make the node describe a derived type, which no other node has."""
        if translation.derived and self.node.wire == "cdr":
            default_library().add_version(translation.type.definition)

    def offered(self, kind: str) -> dict[str, list[str]]:
        """Return all topics, services or actions with their known types."""
        if kind == "topic":
            return self.node.topics()
        try:
            return self.node.actions() if kind == "action" else self.node.services()
        except UnsupportedError:
            return {}

    def servers(self, kind: str, name: str) -> list[EndpointInfo]:
        """Return all publishers of a topic, or servers of a service or action."""
        if kind == "topic":
            return self.node.publishers(name)
        if kind == "service":
            return self.node.service_servers(name)
        if self.node.wire == "ros1":
            return self.node.publishers(f"{name}/result")
        return self.node.service_servers(f"{name}/_action/send_goal")

    def route_key(self, kind: str, name: str) -> str:
        """Return the key of a service or action in published routes."""
        if kind == "action":
            ros1 = self.node.wire == "ros1"
            return f"topic {name}/result" if ros1 else f"service {name}/_action/send_goal"
        return f"service {name}"


_log = logging.getLogger("rosglass.bridge")
#: Private topic on which a bridge publishes its routes as JSON: ``{"topic /scan": ["bridge_1"]}``.
TOPIC = "bridge_routes"
_STRING = "std_msgs/msg/String"
#: Seconds after which a bridge without routes counts as one that does not support them.
_ROUTES_TIMEOUT_S = 5.0
#: Seconds between publishing the route of something and relaying it.
_NOTICE_S = 1.0


class Routes:
    """The routes that bridges publish in one graph.

    Args:
        node: The bridge's node in that graph.
        wake: Called when another bridge publishes new routes.
    """

    def __init__(self, node: Node, wake: Callable[[], None]) -> None:
        self._node, self._wake = node, wake
        #: Guards what the subscriptions' threads receive.
        self._lock = threading.Lock()
        self._published: dict[str, list[str]] = {}
        self._known: dict[NodeName, dict[str, frozenset[str]]] = {}
        self._since: dict[NodeName, float] = {}
        self._readers: dict[NodeName, Subscription] = {}
        self._accepted: dict[tuple[NodeName, str], float] = {}
        self._publisher = node.create_publisher(f"~/{TOPIC}", _STRING, QoS.latched())
        self._publisher.publish(data="{}")

    def follow(self, bridges: Iterable[NodeName]) -> None:
        """Subscribe to the routes of these bridges only."""
        bridges = set(bridges)
        for node in self._readers.keys() - bridges:
            self._readers.pop(node).close()
            with self._lock:
                self._known.pop(node, None)
                self._since.pop(node, None)
            self._accepted = {key: at for key, at in self._accepted.items() if key[0] != node}
        for node in bridges - self._readers.keys():
            self._since[node] = time.monotonic()
            self._readers[node] = self._node.create_subscription(
                f"{node.full}/{TOPIC}",
                _STRING,
                lambda message, node=node: self._on_routes(node, message),  # type: ignore[misc]
                qos=QoS.latched(),
                executor=IMMEDIATE,
            )

    def path(self, end: EndpointInfo) -> frozenset[str] | None:
        """Return the base names of the bridges on the way of a bridge's endpoint.

        None until that bridge has published its routes.
        """
        with self._lock:
            known = self._known.get(end.node)
            if known is None:
                waited = time.monotonic() - self._since.get(end.node, time.monotonic())
                return frozenset({end.node.name}) if waited > _ROUTES_TIMEOUT_S else None
        return known.get(key_of(end), frozenset()) | {end.node.name}

    def accept(self, end: EndpointInfo) -> bool:
        """Return whether a bridge's endpoint may be relayed: all had time to receive the route."""
        now = time.monotonic()
        return now - self._accepted.setdefault((end.node, key_of(end)), now) > _NOTICE_S

    def reject(self, end: EndpointInfo) -> None:
        """Record that a bridge's endpoint is not relayed."""
        self._accepted.pop((end.node, key_of(end)), None)

    def publish(self, routes: Mapping[str, Iterable[str]]) -> None:
        """Publish the routes of what is relayed from other bridges."""
        found = {key: sorted(path) for key, path in sorted(routes.items()) if path}
        if found != self._published:
            self._publisher.publish(data=json.dumps(found))
            self._published = found

    def close(self) -> None:
        """Stop publishing; safe to call twice."""
        self.follow(())
        self._publisher.close()

    def _on_routes(self, node: NodeName, message: Message) -> None:
        try:
            known = {
                str(key): frozenset(map(str, path))
                for key, path in json.loads(message.data).items()
            }
        except (ValueError, TypeError, AttributeError) as error:
            _log.warning("%s publishes invalid routes: %s", node, error)
            return
        with self._lock:
            self._known[node] = known
        self._wake()


def key_of(end: EndpointInfo) -> str:
    """Return the key of an endpoint in published routes, e.g. ``topic /scan``."""
    return f"{'topic' if end.kind is EndpointKind.PUBLISHER else 'service'} {end.name}"

"""One of a bridge's two worlds: who is there, leaving out ourselves and bridges beside us."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from rosglass.bridge.routes import TOPIC
from rosglass.comm import ConnectionState, NodeName
from rosglass.errors import UnsupportedError
from rosglass.messages import default_library

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rosglass.bridge.routes import Routes
    from rosglass.comm import EndpointInfo, Node
    from rosglass.messages import ActionTranslation, ServiceTranslation, Translation

__all__ = ["BRIDGE_NAME", "Side"]

#: What base names of bridges' nodes begin with.
BRIDGE_NAME = "rosglass_bridge"
#: Seconds within which both nodes of a bridge that starts are seen.
_GRACE = 3.0
#: Seconds in which the graph becomes known.
_DISCOVERY = 1.5


class Side:
    """A world, seen from a bridge.

    Bridges beside this one, between the same two worlds, must not be taken for sources: what they
    publish comes from where we take it from ourselves. They are known by their nodes, which have
    the same base name in both worlds. A bridge that goes on to a third world is none of them: what
    it brings is taken on, unless it has been in our other world already (see :class:`Routes`).

    Args:
        node: Our node there.
        number: 0 for the first world, 1 for the second.

    Attributes:
        other: The other world.
    """

    other: Side
    routes: Routes | None = None

    def __init__(self, node: Node, number: int) -> None:
        self.node, self.number = node, number
        self.name = NodeName(node.namespace, node.name)
        self._names: set[str] = set()
        self._bridges: set[NodeName] = set()
        self._marked: set[str] = set()
        self._before: dict[str, frozenset[str]] = {}
        self._brought: dict[str, frozenset[str]] = {}
        self._seen: dict[NodeName, float] = {}
        self._since = math.inf

    @property
    def connected(self) -> bool:
        """Whether what the graph says is what there is."""
        return self.node.status().state is ConnectionState.CONNECTED

    @property
    def known(self) -> bool:
        """Whether the graph was there long enough to tell who is not."""
        return time.monotonic() - self._since > _DISCOVERY

    def look(self) -> None:
        """Look who is there."""
        nodes = self.node.nodes()
        self._names = {node.name for node in nodes}
        end = f"/{TOPIC}"
        self._marked = {t.removesuffix(end) for t in self.node.topics() if t.endswith(end)}
        now = time.monotonic()
        self._since = min(self._since, now) if self.connected else math.inf
        self._before, self._brought = self._brought, {}
        self._bridges = {node for node in nodes if self.is_bridge(node)} - {self.name}
        self._seen = {node: self._seen.get(node, now) for node in self._bridges}

    def listen(self) -> None:
        """Listen to the routes of bridges that go on to other worlds; after both sides' look."""
        if self.routes is not None:
            self.routes.follow(node for node in self._bridges if not self.is_beside(node))

    def is_bridge(self, node: NodeName) -> bool:
        """Return whether a node is a bridge's."""
        return node.name.startswith(BRIDGE_NAME) or node.full in self._marked

    def is_beside(self, node: NodeName) -> bool:
        """Return whether a node is that of another bridge between our two worlds."""
        if node == self.name or not self.is_bridge(node):
            return False
        if node.name in self.other._names:
            return True
        # Its other node may not have shown up yet.
        return time.monotonic() - self._seen.get(node, time.monotonic()) < _GRACE

    def sources(self, endpoints: Iterable[EndpointInfo]) -> list[EndpointInfo]:
        """Return those that are neither ours, nor of bridges beside us or in a ring with us."""
        return [e for e in endpoints if e.node != self.name and self._is_source(e)]

    def _is_source(self, end: EndpointInfo) -> bool:
        if self.routes is None or not self.is_bridge(end.node) or self.is_beside(end.node):
            return not self.is_beside(end.node)
        path = self.routes.path(end)
        if path is None or path & self.other._names:
            self.routes.leave(end)
            return False
        return self.routes.take(end)

    def _path(self, endpoints: Iterable[EndpointInfo]) -> frozenset[str]:
        """Return by way of which bridges these come, as far as they are, or will be, taken."""
        found: set[str] = set()
        for end in endpoints:
            if self.routes is None or end.node not in self._bridges or self.is_beside(end.node):
                continue
            path = self.routes.path(end) or frozenset()
            if not path & self.other._names:
                found |= path
        return frozenset(found)

    def bring(self, key: str, endpoints: Sequence[EndpointInfo]) -> None:
        """Note by way of which bridges something is brought to the other world; see `tell`."""
        # What has lost its sources is offered for a while: by the way by which it came.
        before = frozenset() if self.sources(endpoints) else self._before.get(key, frozenset())
        self._brought[key] = before | self._path(endpoints)

    def tell(self) -> None:
        """Tell the other world's bridges what was noted."""
        if self.other.routes is not None:
            self.other.routes.tell(self._brought)

    def ring(self, endpoints: Iterable[EndpointInfo]) -> str:
        """Say which of these would go in circles; empty when none would."""
        for end in endpoints:
            if self.routes is None or end.node not in self._bridges or self.is_beside(end.node):
                continue
            known = (self.routes.path(end) or frozenset()) & self.other._names
            if known:
                names = " and ".join(sorted(known))
                return (
                    f"these bridges form a ring: {end.node} brings what {names} "
                    f"{'has' if len(known) == 1 else 'have'} taken from there; it is not relayed, "
                    "or it would go round for ever: leave one bridge out"
                )
        return ""

    def beside(self, endpoints: Iterable[EndpointInfo]) -> list[EndpointInfo]:
        """Return those of bridges beside us."""
        return [e for e in endpoints if self.is_beside(e.node)]

    def teach(self, translation: Translation | ServiceTranslation | ActionTranslation) -> None:
        """Let our node describe a type that was derived to those who ask: nobody else can."""
        if translation.derived and self.node.wire == "cdr":
            default_library().add_version(translation.type.definition)

    def offered(self, kind: str) -> dict[str, list[str]]:
        """Return every topic, service or action with its types, as far as they are known."""
        if kind == "topic":
            return self.node.topics()
        try:
            return self.node.actions() if kind == "action" else self.node.services()
        except UnsupportedError:
            return {}

    def servers(self, kind: str, name: str) -> list[EndpointInfo]:
        """Return who publishes a topic, or offers a service or an action, whoever that is."""
        if kind == "topic":
            return self.node.publishers(name)
        if kind == "service":
            return self.node.service_servers(name)
        if self.node.wire == "ros1":
            return self.node.publishers(f"{name}/result")
        return self.node.service_servers(f"{name}/_action/send_goal")

    def key(self, kind: str, name: str) -> str:
        """Return the name under which routes of what servers offer are told."""
        if kind == "action":
            ros1 = self.node.wire == "ros1"
            return f"topic {name}/result" if ros1 else f"service {name}/_action/send_goal"
        return f"service {name}"

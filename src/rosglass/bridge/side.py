"""One of a bridge's two worlds: who is there, leaving out ourselves and bridges beside us."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from rosglass.comm import ConnectionState, NodeName
from rosglass.errors import UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.comm import EndpointInfo, Node

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
    the same name in both worlds. A bridge that goes on to a third world is none of them.

    Args:
        node: Our node there.
        number: 0 for the first world, 1 for the second.

    Attributes:
        other: The other world.
    """

    other: Side

    def __init__(self, node: Node, number: int) -> None:
        self.node, self.number = node, number
        self.name = NodeName(node.namespace, node.name)
        self._nodes: set[NodeName] = set()
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
        self._nodes = set(self.node.nodes())
        now = time.monotonic()
        self._since = min(self._since, now) if self.connected else math.inf
        bridges = {node for node in self._nodes if node.name.startswith(BRIDGE_NAME)}
        self._seen = {node: self._seen.get(node, now) for node in bridges}

    def is_beside(self, node: NodeName) -> bool:
        """Return whether a node is that of another bridge between our two worlds."""
        if node == self.name or not node.name.startswith(BRIDGE_NAME):
            return False
        if node in self.other._nodes:
            return True
        # Its other node may not have shown up yet.
        return time.monotonic() - self._seen.get(node, time.monotonic()) < _GRACE

    def sources(self, endpoints: Iterable[EndpointInfo]) -> list[EndpointInfo]:
        """Return those that are neither ours nor of bridges beside us."""
        return [e for e in endpoints if e.node != self.name and not self.is_beside(e.node)]

    def beside(self, endpoints: Iterable[EndpointInfo]) -> list[EndpointInfo]:
        """Return those of bridges beside us."""
        return [e for e in endpoints if self.is_beside(e.node)]

    def services(self) -> dict[str, list[str]]:
        """Return every service with its types, as far as they are known."""
        try:
            return self.node.services()
        except UnsupportedError:
            return {}

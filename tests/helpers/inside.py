"""What is inside a node, for tests of its parts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rosglass.comm.graph_node import GraphNode


def core_of(node: GraphNode) -> Any:
    """Return what everything that was created from a node shares."""
    return node._core

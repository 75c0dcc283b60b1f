"""What is inside a node, for tests of its parts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rosglass.comm import Node


def core_of(node: Node) -> Any:
    """Return what everything that was created from a node shares."""
    return node._core

"""Names given together with a namespace."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.errors import Error

if TYPE_CHECKING:
    from rosglass.comm.node import Node

__all__ = ["resolved", "within"]


def resolved(node: Node | None, namespace: str) -> str:
    """Return a namespace as a node resolves it; as it is without a node, or when it is wrong."""
    try:
        return node.resolve(namespace) if node is not None and namespace else namespace
    except Error:
        return namespace


def within(namespace: str, name: str) -> str:
    """Return `name` within `namespace`, as a NodeHandle of that namespace resolves it.

    Absolute (``/x``) and private (``~x``) names, and an empty namespace, leave it as it is. See
    http://wiki.ros.org/Names, section 1.2.
    """
    if not namespace or not name or name.startswith(("/", "~")):
        return name
    return f"{namespace.rstrip('/')}/{name}"

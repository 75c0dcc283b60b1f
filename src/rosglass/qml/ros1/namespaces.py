"""What comes with names of ROS 1: namespaces, and queue sizes that may be 0."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rosglass.comm.qos import History
from rosglass.errors import Error
from rosglass.qml.profiles import qos_from_js

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.comm.qos import QoS
    from rosglass.qt import QJSValue

__all__ = ["queue_from_js", "resolved", "within"]


def queue_from_js(value: QJSValue, default: QoS) -> QoS:
    """Return the profile of a queue size, or one given; 0 means no limit, as in ROS 1.

    Raises:
        ConversionError: As of :func:`qos_from_js`.
    """
    if value.isNumber() and value.toNumber() == 0:
        return replace(default, history=History.KEEP_ALL)
    return qos_from_js(value, default)


def resolved(node: Node | None, namespace: str) -> str:
    """Return a namespace as a node resolves it; as it is without a node, or when it is wrong.

    An empty one is the node's own.
    """
    if node is None:
        return namespace
    try:
        return node.resolve(namespace) if namespace else node.namespace
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

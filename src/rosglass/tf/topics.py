"""The topics that carry transforms, and their types in each world."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.comm.qos import QoS
from rosglass.errors import InvalidNameError

if TYPE_CHECKING:
    from rosglass.comm.node import Node

__all__ = ["DEPTH", "TYPE", "is_ros1", "qos_of", "topic_of"]

TYPE = "tf2_msgs/msg/TFMessage"
#: As tf2_ros has it, in both worlds.
DEPTH = 100


def topic_of(node: Node, namespace: str, static: bool) -> str:
    """Return the topic in a namespace; an empty one means the node's own.

    Raises:
        InvalidNameError: The namespace breaks ROS's rules.
    """
    if not isinstance(namespace, str):
        raise InvalidNameError(f"the namespace of tf is a text such as /robot1, got {namespace!r}")
    name = "tf_static" if static else "tf"
    if namespace:
        name = f"{namespace.rstrip('/')}/{name}"
    return node.resolve(name)


def qos_of(static: bool, depth: int) -> QoS:
    """Return the profile: static transforms are latched."""
    return QoS.latched(depth) if static else QoS(depth)


def is_ros1(node: Node) -> bool:
    """Whether stamps and headers are those of ROS 1."""
    return node.wire == "ros1"

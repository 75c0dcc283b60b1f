"""The differences between ``Ros 1.0`` and ``Ros2 1.0``: times, types, fields, namespaces."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from rosglass.errors import Error

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.messages.schema import Schema

__all__ = ["Dialect", "resolve_namespace", "within_namespace"]

#: ROS 1's primitives that are messages in ROS 2.
_PRIMITIVE_TIMES = {
    "time": "builtin_interfaces/msg/Time",
    "duration": "builtin_interfaces/msg/Duration",
}
#: Fields of ROS 1 that are lower case in ROS 2, in all types that both distribute (Noetic's
#: definitions against all of ROS 2's): looking types up takes longer than a screen may stand still.
_CAPITALS = {"sensor_msgs/msg/CameraInfo": "DKRP", "stereo_msgs/msg/DisparityImage": "T"}


class Dialect(Enum):
    """The QML module that an interface imports; the robot may speak either ROS all the same.

    ``Ros 1.0`` shows times as ``{sec, nsec}`` with ``toSec()``, durations as milliseconds and types
    as ``pkg/Type``; ``Ros2 1.0`` shows ``{sec, nanosec}`` with ``seconds()``, and ``pkg/msg/Type``.
    """

    ROS1 = "Ros 1.0"
    ROS2 = "Ros2 1.0"

    @property
    def ros(self) -> int:
        """The ROS version whose names it uses: 1 or 2."""
        return 1 if self is Dialect.ROS1 else 2

    @property
    def time_fields(self) -> tuple[str, str]:
        """What the two parts of a time are called."""
        return ("sec", "nsec") if self is Dialect.ROS1 else ("sec", "nanosec")

    def type_name(self, name: str) -> str:
        """Return a full type name as the module writes it."""
        if name in _PRIMITIVE_TIMES:
            return name if self is Dialect.ROS1 else _PRIMITIVE_TIMES[name]
        if self is Dialect.ROS2:
            return name
        package, _, rest = name.partition("/")
        return f"{package}/{rest.rpartition('/')[2]}"

    def spelled(self, text: str) -> str:
        """Return a text with the names of types in it as the module writes them."""
        if self is Dialect.ROS2 or not text:
            return text
        from rosglass.interfaces.names import spelled_ros1  # noqa: PLC0415 - not at start-up

        return spelled_ros1(text)

    def names(self, schema: Schema) -> dict[str, str]:
        """Return the fields that the module's ROS calls otherwise than the robot's.

        ``sensor_msgs/CameraInfo`` has ``K`` in ROS 1 and ``k`` in ROS 2.

        Returns:
            The module's name by the robot's.
        """
        if schema.ros == self.ros:
            return {}
        upper = _CAPITALS.get(schema.name, "")
        return {n.lower(): n for n in upper} if schema.ros == 2 else {n: n.lower() for n in upper}


def resolve_namespace(node: Node | None, namespace: str) -> str:
    """Return a namespace as a node resolves it; as it is without a node, or when it is wrong.

    An empty one is the node's own.
    """
    if node is None:
        return namespace
    try:
        return node.resolve(namespace) if namespace else node.namespace
    except Error:
        return namespace


def within_namespace(namespace: str, name: str) -> str:
    """Return `name` within `namespace`, as a NodeHandle of that namespace resolves it.

    Absolute (``/x``) and private (``~x``) names, and an empty namespace, leave it as it is. See
    http://wiki.ros.org/Names, section 1.2.
    """
    if not namespace or not name or name.startswith(("/", "~")):
        return name
    return f"{namespace.rstrip('/')}/{name}"

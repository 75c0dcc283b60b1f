"""The differences between ``Ros 1.0`` and ``Ros2 1.0``: times, types, fields, namespaces."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from rosglass.errors import Error
from rosglass.interfaces.names import spelled_ros1

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.messages.schema import Schema

__all__ = ["Dialect", "resolve_namespace", "within_namespace"]

#: Primitive types of ROS 1 that are messages in ROS 2.
_PRIMITIVE_TIMES = {
    "time": "builtin_interfaces/msg/Time",
    "duration": "builtin_interfaces/msg/Duration",
}
#: Fields that are upper case in ROS 1 and lower case in ROS 2, of all types that both distribute
#: (Noetic compared with all of ROS 2). A table, because looking types up would freeze the screen.
_CAPITALS = {"sensor_msgs/msg/CameraInfo": "DKRP", "stereo_msgs/msg/DisparityImage": "T"}


class Dialect(Enum):
    """The QML module that an interface imports; works with robots of either ROS version.

    ``Ros 1.0`` has times as ``{sec, nsec}`` with ``toSec()``, durations in milliseconds and types
    as ``pkg/Type``; ``Ros2 1.0`` has ``{sec, nanosec}`` with ``seconds()``, and ``pkg/msg/Type``.
    """

    ROS1 = "Ros 1.0"
    ROS2 = "Ros2 1.0"

    @property
    def ros(self) -> int:
        """The ROS version whose names the module uses: 1 or 2."""
        return 1 if self is Dialect.ROS1 else 2

    @property
    def time_fields(self) -> tuple[str, str]:
        """The field names of a time's seconds and nanoseconds."""
        return ("sec", "nsec") if self is Dialect.ROS1 else ("sec", "nanosec")

    def type_name(self, name: str) -> str:
        """Return a full type name in the module's spelling."""
        if name in _PRIMITIVE_TIMES:
            return name if self is Dialect.ROS1 else _PRIMITIVE_TIMES[name]
        if self is Dialect.ROS2:
            return name
        package, _, rest = name.partition("/")
        return f"{package}/{rest.rpartition('/')[2]}"

    def spelled(self, text: str) -> str:
        """Return a text with its type names in the module's spelling."""
        if self is Dialect.ROS2 or not text:
            return text
        return spelled_ros1(text)

    def names(self, schema: Schema) -> dict[str, str]:
        """Return the fields whose names differ between the module's ROS version and the robot's.

        ``sensor_msgs/CameraInfo`` has ``K`` in ROS 1 and ``k`` in ROS 2.

        Returns:
            The module's name for each of the robot's names.
        """
        if schema.ros == self.ros:
            return {}
        upper = _CAPITALS.get(schema.name, "")
        return {n.lower(): n for n in upper} if schema.ros == 2 else {n: n.lower() for n in upper}


def resolve_namespace(node: Node | None, namespace: str) -> str:
    """Return the resolved namespace; unchanged without a node or if it is invalid.

    An empty namespace is the node's own.
    """
    if node is None:
        return namespace
    try:
        return node.resolve(namespace) if namespace else node.namespace
    except Error:
        return namespace


def within_namespace(namespace: str, name: str) -> str:
    """Return `name` within `namespace`, as a NodeHandle of that namespace resolves it.

    Absolute (``/x``) and private (``~x``) names, and names in an empty namespace, are unchanged.
    See http://wiki.ros.org/Names, section 1.2.
    """
    if not namespace or not name or name.startswith(("/", "~")):
        return name
    return f"{namespace.rstrip('/')}/{name}"

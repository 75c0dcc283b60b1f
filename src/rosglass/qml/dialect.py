"""Whose habits a value or an element follows: those of ``Ros 1.0`` or of ``Ros2 1.0``."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosglass.messages.schema import Schema

__all__ = ["Dialect"]

#: ROS 1's primitives that are messages in ROS 2.
_PRIMITIVE_TIMES = {
    "time": "builtin_interfaces/msg/Time",
    "duration": "builtin_interfaces/msg/Duration",
}


class Dialect(Enum):
    """The QML module that an interface imports; the robot may speak either ROS all the same.

    ``Ros 1.0`` shows times as ``{sec, nsec}`` with ``toSec()``, durations as milliseconds and types
    as ``pkg/Type``; ``Ros2 1.0`` shows ``{sec, nanosec}`` with ``seconds()``, and ``pkg/msg/Type``.
    """

    ROS1 = "Ros 1.0"
    ROS2 = "Ros2 1.0"

    @property
    def ros(self) -> int:
        """The ROS whose words it uses: 1 or 2."""
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

    def names(self, schema: Schema) -> dict[str, str]:
        """Return the fields that the module's ROS calls otherwise than the robot's.

        ``sensor_msgs/CameraInfo`` has ``K`` in ROS 1 and ``k`` in ROS 2.

        Returns:
            The module's name by the robot's.
        """
        if schema.ros == self.ros or schema.is_time:
            return {}
        found: dict[str, str] = schema.cached(("qml names", self), lambda: _renamed(schema))
        return found


def _renamed(schema: Schema) -> dict[str, str]:
    from rosglass.errors import Error  # noqa: PLC0415 - only where both ROSes meet
    from rosglass.interfaces import Counterparts  # noqa: PLC0415
    from rosglass.messages.loading import default_library  # noqa: PLC0415

    try:
        pair = Counterparts(default_library()).message(schema.definition)
    except Error:
        return {}
    other = pair.two if schema.ros == 1 else pair.one
    if other.source.provider.startswith("derived from "):
        return {}
    paths = [(f.one, f.two) if schema.ros == 1 else (f.two, f.one) for f in pair.fields]
    return {
        ours[0]: theirs[0]
        for ours, theirs in paths
        if len(ours) == 1 and len(theirs) == 1 and ours != theirs
    }

"""The displays PointStamped, Polygon, Range, WrenchStamped, TwistStamped and AccelStamped."""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import Error
from rosglass.messages import read_columns
from rosglass.scene.configs.settings import Setting, rgb_of
from rosglass.scene.displays.shapes import ArrowShapes
from rosglass.scene.displays.topic_display import HistoryDisplay
from rosglass.scene.render.arrays import check_numbers
from rosglass.scene.render.drawing import Lines, Mesh
from rosglass.scene.render.matrices import instance_matrix, pose_along, rotation_of_z_to
from rosglass.scene.render.mesh_shapes import CONE, SPHERE

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from rosglass.scene.render.scene_tree import Group


__all__ = [
    "AccelStampedDisplay",
    "PointStampedDisplay",
    "PolygonDisplay",
    "RangeDisplay",
    "TwistStampedDisplay",
    "WrenchStampedDisplay",
]

_MAX_CORNERS = 100_000


def _vector(name: str, vector: Any) -> tuple[float, float, float]:
    found = (vector.x, vector.y, vector.z)
    check_numbers(name, found)
    return found


class PointStampedDisplay(HistoryDisplay):
    """A ``geometry_msgs/PointStamped``, as a sphere. See its page in ``docs/scene.md``."""

    TYPE = "PointStamped"
    LENGTH = "History Length"
    MESSAGES = ("geometry_msgs/PointStamped",)

    color = Setting("Color", "color", "#cc29cc", "Colour of the sphere.")
    alpha = Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0)
    radius = Setting("Radius", "float", 0.2, "Radius of the sphere, in metres.", min=0.0)
    historyLength = Setting(
        "History Length", "int", 1, "Number of messages.", min=1, max=100_000, then="_on_length"
    )

    def preparer(self) -> Callable[[Any], Any]:
        """Return the function that reads the point."""
        return lambda message: _vector("point", message.point)

    def draw(self, data: Any, group: Group) -> None:
        """Draw a sphere."""
        ball = Mesh(SPHERE, (*rgb_of(self.color), self.alpha))
        ball.owner = self
        ball.set_instances(instance_matrix(data, scale=2 * self.radius)[np.newaxis])
        group.add(ball)


class PolygonDisplay(HistoryDisplay):
    """A ``geometry_msgs/PolygonStamped``, as its outline. See its page in ``docs/scene.md``."""

    TYPE = "Polygon"
    MESSAGES = ("geometry_msgs/PolygonStamped",)

    color = Setting("Color", "color", "#19ff00", "Colour of the outline.")
    alpha = Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0)

    def preparer(self) -> Callable[[Any], Any]:
        """Return the function that reads the corners."""
        return _read_corners

    def draw(self, data: Any, group: Group) -> None:
        """Draw the outline."""
        lines = Lines()
        lines.owner = self
        lines.set_strip(data, (*rgb_of(self.color), self.alpha))
        group.add(lines)


def _read_corners(message: Any) -> NDArray[np.float32]:
    points = message.polygon.points
    if len(points) > _MAX_CORNERS:
        raise Error(
            f"polygon: {len(points)} points are more than the {_MAX_CORNERS} that are drawn"
        )
    corners = read_columns(points, "x", "y", "z").astype(np.float32)
    check_numbers("polygon.points", corners)
    return np.concatenate([corners, corners[:1]])


class RangeDisplay(HistoryDisplay):
    """A ``sensor_msgs/Range``, as a cone. See its page in ``docs/scene.md``."""

    TYPE = "Range"
    LENGTH = "Buffer Length"
    IS_CONTINUOUS = True
    MESSAGES = ("sensor_msgs/Range",)

    color = Setting("Color", "color", "#ffffff", "Colour of the cone.")
    alpha = Setting("Alpha", "float", 0.5, "Opacity.", min=0.0, max=1.0)
    bufferLength = Setting(
        "Buffer Length", "int", 1, "Number of messages.", min=1, then="_on_length"
    )

    def preparer(self) -> Callable[[Any], Any]:
        """Return the function that reads distance and angle."""
        return _read_range

    def draw(self, data: Any, group: Group) -> None:
        """Draw a cone from the sensor along x."""
        distance, angle = data
        if distance <= 0:
            return
        cone = Mesh(CONE, (*rgb_of(self.color), self.alpha))
        cone.owner = self
        wide = 2 * distance * math.tan(min(angle, math.radians(170)) / 2)
        # Its tip is at the sensor: the shape's, which points along z, is turned over.
        matrix = np.array(
            [[0.0, 0, -distance, distance], [wide, 0, 0, 0], [0, wide, 0, 0], [0, 0, 0, 1]]
        )
        cone.set_instances(matrix[np.newaxis])
        group.add(cone)


def _read_range(message: Any) -> tuple[float, float]:
    names = ("min_range", "max_range", "field_of_view")
    low, high, angle = (float(message[name]) for name in names)
    for name, number in zip(names, (low, high, angle), strict=True):
        if not math.isfinite(number):
            raise Error(f"{name}: {number} is not finite")
    value = float(message.range)
    if low == high and value == -math.inf:
        value = low  # a sensor of one fixed distance, where something is (REP 117)
    inside = math.isfinite(value) and low <= value <= high
    check_numbers("range", value if inside else 0.0)
    return (value if inside else 0.0), abs(angle)


def _screw_settings() -> tuple[Setting, Setting, Setting, Setting]:
    """Return the settings of a linear and an angular vector that are shown as arrows.

    They are opacity, width of arrows, length of the history, and whether small values are hidden.
    """
    return (
        Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0),
        Setting("Arrow Width", "float", 0.5, "Width of the arrows, in metres.", min=0.0),
        Setting(
            "History Length", "int", 1, "Number of messages.", min=1, max=100_000, then="_on_length"
        ),
        Setting(
            "Hide Small Values", "bool", True,
            "Hide arrows that are shorter than their width.",
        ),
    )  # fmt: skip


def _screw_reader(holder: str, *fields: str) -> Callable[[Any], Any]:
    """Return the function that reads two vectors, each a field of `holder`."""

    def read(message: Any) -> Any:
        both = getattr(message, holder)
        return [np.array(_vector(f"{holder}.{name}", getattr(both, name))) for name in fields]

    return read


def _draw_screw(display: Any, group: Group, *vectors: tuple[NDArray[Any], Any, float]) -> None:
    """Draw two arrows, and a circle around the second.

    Args:
        display: The display, with the settings of :func:`_screw_settings`.
        group: The group of the drawables.
        vectors: Both vectors, each with its colour and its scale.
    """
    for number, (vector, color, scale) in enumerate(vectors):
        length = float(np.linalg.norm(vector)) * scale
        wide = display.arrowWidth
        if length <= 0 or (display.hideSmallValues and length < wide):
            continue
        rgba = (*rgb_of(color), display.alpha)
        pose = pose_along(vector / np.linalg.norm(vector))
        arrow = ArrowShapes(display)
        # Proportions of RViz's arrow.
        arrow.set_arrows(pose, (length, 0.1 * wide), (0.3 * length, 0.2 * wide), rgba)
        group.add(arrow)
        if number:
            group.add(*_circle(pose[:3, 0], length, wide, rgba))


def _circle(
    axis: NDArray[np.float64], length: float, wide: float, rgba: tuple[float, ...]
) -> tuple[Lines, Mesh]:
    """Return most of a circle around an arrow, and its head: which way it turns."""
    place = np.eye(4)
    place[:3, :3] = rotation_of_z_to(axis)
    place[:3, 3] = axis * length / 2
    angles = np.linspace(math.pi / 4, 2 * math.pi, 29)
    at = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1) * length / 4
    lines = Lines(0.05 * wide, in_metres=True)
    lines.set_strip(at @ place[:3, :3].T + place[:3, 3], rgba)
    head = Mesh(CONE, rgba)
    # From where the circle ends, along y.
    local = np.array(
        [
            [0.2 * wide, 0, 0, length / 4],
            [0, 0, 0.1 * wide, 0],
            [0, -0.2 * wide, 0, 0],
            [0, 0, 0, 1],
        ]
    )
    head.set_instances((place @ local)[np.newaxis])
    return lines, head


class WrenchStampedDisplay(HistoryDisplay):
    """A ``geometry_msgs/WrenchStamped``: force and torque. See its page in ``docs/scene.md``."""

    TYPE = "WrenchStamped"
    IS_CONTINUOUS = True
    LENGTH = "History Length"
    MESSAGES = ("geometry_msgs/WrenchStamped",)

    alpha, arrowWidth, historyLength, hideSmallValues = _screw_settings()
    forceColor = Setting("Force Color", "color", "#cc3333", "Colour of the force.")
    torqueColor = Setting("Torque Color", "color", "#cccc33", "Colour of the torque.")
    forceArrowScale = Setting(
        "Force Arrow Scale", "float", 2.0, "Arrow length in metres per newton."
    )
    torqueArrowScale = Setting(
        "Torque Arrow Scale", "float", 2.0, "Arrow length in metres per newton metre."
    )

    def preparer(self) -> Callable[[Any], Any]:
        """Return the function that reads both vectors."""
        return _screw_reader("wrench", "force", "torque")

    def draw(self, data: Any, group: Group) -> None:
        """Draw both vectors."""
        force = (data[0], self.forceColor, self.forceArrowScale)
        torque = (data[1], self.torqueColor, self.torqueArrowScale)
        _draw_screw(self, group, force, torque)


class TwistStampedDisplay(HistoryDisplay):
    """A ``geometry_msgs/TwistStamped``: velocities. See its page in ``docs/scene.md``."""

    TYPE = "TwistStamped"
    IS_CONTINUOUS = True
    LENGTH = "History Length"
    MESSAGES = ("geometry_msgs/TwistStamped",)

    alpha, arrowWidth, historyLength, hideSmallValues = _screw_settings()
    linearColor = Setting("Linear Color", "color", "#cc3333", "Colour of the linear velocity.")
    angularColor = Setting("Angular Color", "color", "#cccc33", "Colour of the angular velocity.")
    linearArrowScale = Setting(
        "Linear Arrow Scale", "float", 2.0, "Arrow length in metres per m/s."
    )
    angularArrowScale = Setting(
        "Angular Arrow Scale", "float", 2.0, "Arrow length in metres per rad/s."
    )

    def preparer(self) -> Callable[[Any], Any]:
        """Return the function that reads both vectors."""
        return _screw_reader("twist", "linear", "angular")

    def draw(self, data: Any, group: Group) -> None:
        """Draw both vectors."""
        linear = (data[0], self.linearColor, self.linearArrowScale)
        angular = (data[1], self.angularColor, self.angularArrowScale)
        _draw_screw(self, group, linear, angular)


class AccelStampedDisplay(HistoryDisplay):
    """A ``geometry_msgs/AccelStamped``: accelerations. See its page in ``docs/scene.md``."""

    TYPE = "AccelStamped"
    IS_CONTINUOUS = True
    LENGTH = "History Length"
    MESSAGES = ("geometry_msgs/AccelStamped",)

    alpha, arrowWidth, historyLength, hideSmallValues = _screw_settings()
    linearColor = Setting("Linear Color", "color", "#cc3333", "Colour of the linear acceleration.")
    angularColor = Setting(
        "Angular Color", "color", "#cccc33", "Colour of the angular acceleration."
    )
    linearArrowScale = Setting(
        "Linear Arrow Scale", "float", 2.0, "Arrow length in metres per m/s²."
    )
    angularArrowScale = Setting(
        "Angular Arrow Scale", "float", 2.0, "Arrow length in metres per rad/s²."
    )

    def preparer(self) -> Callable[[Any], Any]:
        """Return the function that reads both vectors."""
        return _screw_reader("accel", "linear", "angular")

    def draw(self, data: Any, group: Group) -> None:
        """Draw both vectors."""
        linear = (data[0], self.linearColor, self.linearArrowScale)
        angular = (data[1], self.angularColor, self.angularArrowScale)
        _draw_screw(self, group, linear, angular)

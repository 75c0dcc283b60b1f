"""Geometry of an orbit camera: points, frames, and interpolation between camera poses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = [
    "MIN_DISTANCE_M",
    "STEEPEST",
    "FramePose",
    "Orbit",
    "Point",
    "ease",
    "shortest_turn",
]

#: RViz's maximum pitch in radians: straight from above, yaw would be undefined.
STEEPEST = math.pi / 2 - 0.001
#: Minimum distance between camera and focus, in metres.
MIN_DISTANCE_M = 0.01


class Point(NamedTuple):
    """A point or a vector, in metres."""

    x: float
    y: float
    z: float

    def __add__(self, other: object) -> Point:
        """Return the sum."""
        x, y, z = _numbers(other)
        return Point(self.x + x, self.y + y, self.z + z)

    def __sub__(self, other: Sequence[float]) -> Point:
        """Return the vector from `other` to this point."""
        x, y, z = _numbers(other)
        return Point(self.x - x, self.y - y, self.z - z)

    def rotated(self, yaw: float) -> Point:
        """Return the vector rotated around z by an angle in radians."""
        c, s = math.cos(yaw), math.sin(yaw)
        return Point(c * self.x - s * self.y, s * self.x + c * self.y, self.z)

    def towards(self, other: Sequence[float], part: float) -> Point:
        """Interpolate linearly between this point and `other`; `part` is from 0 to 1."""
        x, y, z = _numbers(other)
        return Point(
            self.x + (x - self.x) * part,
            self.y + (y - self.y) * part,
            self.z + (z - self.z) * part,
        )


def _numbers(point: object) -> tuple[float, float, float]:
    assert isinstance(point, tuple)
    x, y, z = point
    return x, y, z


class FramePose(NamedTuple):
    """The position and yaw of a frame.

    Attributes:
        point: Its origin in the fixed frame.
        yaw: Rotation around z, in radians.
    """

    point: Point
    yaw: float

    def to_local(self, point: Point) -> Point:
        """Transform a point from the fixed frame into this frame."""
        return (point - self.point).rotated(-self.yaw)

    def to_fixed(self, point: Point) -> Point:
        """Transform a point from this frame into the fixed frame."""
        return self.point + point.rotated(self.yaw)


class Orbit(NamedTuple):
    """A camera that looks at a point (RViz's ``rviz/Orbit``, orbit_view_controller.cpp).

    Attributes:
        focus: The point it looks at, in the fixed frame.
        distance: Distance from the focus, in metres.
        yaw: Angle around z in radians; at 0, the camera is in x direction from its focus.
        pitch: Angle above the xy plane, in radians.
    """

    focus: Point
    distance: float
    yaw: float
    pitch: float

    @property
    def eye(self) -> Point:
        """The camera's position in the fixed frame."""
        flat = math.cos(self.pitch) * self.distance
        height = math.sin(self.pitch) * self.distance
        return self.focus + Point(math.cos(self.yaw) * flat, math.sin(self.yaw) * flat, height)

    @classmethod
    def between(cls, eye: Point, focus: Point, yaw: float = 0.0) -> Orbit:
        """Return the camera at one point that looks at another.

        Args:
            eye: Position of the camera.
            focus: The point it looks at.
            yaw: Yaw to use if it looks straight down or up.
        """
        x, y, z = eye - focus
        flat = math.hypot(x, y)
        distance = max(math.hypot(flat, z), MIN_DISTANCE_M)
        pitch = max(-STEEPEST, min(STEEPEST, math.atan2(z, flat)))
        if flat > 1e-6 * distance:
            yaw = math.atan2(y, x)
        return cls(focus, distance, yaw, pitch)

    def towards(self, other: Orbit, part: float) -> Orbit:
        """Interpolate between this camera and `other`; `part` is from 0 to 1.

        It turns the shorter way, and changes the distance exponentially, so that a zoom looks even.
        """
        return Orbit(
            self.focus.towards(other.focus, part),
            self.distance * (other.distance / self.distance) ** part,
            self.yaw + shortest_turn(self.yaw, other.yaw) * part,
            self.pitch + (other.pitch - self.pitch) * part,
        )

    def moved_with(self, before: FramePose, after: FramePose) -> Orbit:
        """Return the camera moved along with a frame, from its old to its new pose."""
        turn = shortest_turn(before.yaw, after.yaw)
        focus = after.point + (self.focus - before.point).rotated(turn)
        return self._replace(focus=focus, yaw=self.yaw + turn)

    def is_near(self, other: Orbit) -> bool:
        """Return whether the two are equal in 32-bit floats, which RViz uses."""
        return (
            max(abs(n) for n in self.focus - other.focus) <= 1e-6 * max(1.0, self.distance)
            and abs(self.distance / other.distance - 1) <= 1e-6
            and abs(shortest_turn(self.yaw, other.yaw)) <= 1e-6
            and abs(self.pitch - other.pitch) <= 1e-6
        )


def shortest_turn(start: float, end: float) -> float:
    """Return the difference between two angles, in the range -pi to pi."""
    return math.remainder(end - start, math.tau)


def ease(progress: float) -> float:
    """Map the elapsed share of a movement's time to the share of its way, both 0 to 1.

    The sigmoid 1 / (1 + e^(-12 (p - 0.5))) of hector_rviz_plugins' view controller, scaled to start
    at 0 and end at 1.
    """
    if progress <= 0:
        return 0.0
    if progress >= 1:
        return 1.0
    low = 1 / (1 + math.exp(6))
    return (1 / (1 + math.exp(-12 * (progress - 0.5))) - low) / (1 - 2 * low)

"""The geometry of RViz's views: a camera that looks at a point, in 3D or from above."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["NEAREST", "STEEPEST", "Orbit", "Place", "Point", "ease", "shortest_turn"]

#: Radians of pitch at which RViz stops: straight from above, yaw would mean nothing.
STEEPEST = math.pi / 2 - 0.001
#: Metres between a camera and what it looks at, at least.
NEAREST = 0.01


class Point(NamedTuple):
    """A point, or the way from one to another, in metres."""

    x: float
    y: float
    z: float

    def __add__(self, other: object) -> Point:
        """Return the sum."""
        x, y, z = _numbers(other)
        return Point(self.x + x, self.y + y, self.z + z)

    def __sub__(self, other: Sequence[float]) -> Point:
        """Return the way from `other` to here."""
        x, y, z = _numbers(other)
        return Point(self.x - x, self.y - y, self.z - z)

    def turned(self, yaw: float) -> Point:
        """Return it turned around z.

        Args:
            yaw: Radians.
        """
        c, s = math.cos(yaw), math.sin(yaw)
        return Point(c * self.x - s * self.y, s * self.x + c * self.y, self.z)

    def towards(self, other: Sequence[float], part: float) -> Point:
        """Interpolate between this and `other`, by a share from 0 to 1."""
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


class Place(NamedTuple):
    """The position and yaw of a frame.

    Attributes:
        point: Its origin, in the fixed frame.
        yaw: Radians around z.
    """

    point: Point
    yaw: float

    def seen(self, point: Point) -> Point:
        """Return a point of the fixed frame as it is seen from here."""
        return (point - self.point).turned(-self.yaw)

    def outside(self, point: Point) -> Point:
        """Return a point that is seen from here as it is in the fixed frame."""
        return self.point + point.turned(self.yaw)


class Orbit(NamedTuple):
    """A camera that looks at a point (RViz's ``rviz/Orbit``, orbit_view_controller.cpp).

    Attributes:
        focus: What it looks at, in the fixed frame.
        distance: Metres from there.
        yaw: Radians around z; 0 where the camera is in the direction of x from its focus.
        pitch: Radians above the plane of x and y.
    """

    focus: Point
    distance: float
    yaw: float
    pitch: float

    @property
    def eye(self) -> Point:
        """Where the camera is, in the fixed frame."""
        flat = math.cos(self.pitch) * self.distance
        height = math.sin(self.pitch) * self.distance
        return self.focus + Point(math.cos(self.yaw) * flat, math.sin(self.yaw) * flat, height)

    @classmethod
    def between(cls, eye: Point, focus: Point, yaw: float = 0.0) -> Orbit:
        """Return the camera that looks from a point at another one.

        Args:
            eye: Where it is.
            focus: What it looks at.
            yaw: What to take where it looks straight down or up.
        """
        x, y, z = eye - focus
        flat = math.hypot(x, y)
        distance = max(math.hypot(flat, z), NEAREST)
        pitch = max(-STEEPEST, min(STEEPEST, math.atan2(z, flat)))
        if flat > 1e-6 * distance:
            yaw = math.atan2(y, x)
        return cls(focus, distance, yaw, pitch)

    def towards(self, other: Orbit, part: float) -> Orbit:
        """Interpolate between this and `other`, by a share from 0 to 1; turns the short way.

        Distances are passed in equal ratios, so that a camera that comes from far seems to move
        evenly.
        """
        return Orbit(
            self.focus.towards(other.focus, part),
            self.distance * (other.distance / self.distance) ** part,
            self.yaw + shortest_turn(self.yaw, other.yaw) * part,
            self.pitch + (other.pitch - self.pitch) * part,
        )

    def carried(self, before: Place, after: Place) -> Orbit:
        """Return it carried along with a frame.

        Args:
            before: Where the frame was.
            after: Where it is now.
        """
        turn = shortest_turn(before.yaw, after.yaw)
        focus = after.point + (self.focus - before.point).turned(turn)
        return self._replace(focus=focus, yaw=self.yaw + turn)

    def is_near(self, other: Orbit) -> bool:
        """Return whether the two look the same: RViz keeps 32 bits of each number."""
        return (
            max(abs(n) for n in self.focus - other.focus) <= 1e-6 * max(1.0, self.distance)
            and abs(self.distance / other.distance - 1) <= 1e-6
            and abs(shortest_turn(self.yaw, other.yaw)) <= 1e-6
            and abs(self.pitch - other.pitch) <= 1e-6
        )


def shortest_turn(start: float, end: float) -> float:
    """Return the radians from one angle to another, from -pi to pi."""
    return math.remainder(end - start, math.tau)


def ease(progress: float) -> float:
    """Return the progress of a movement after a share of its time, both 0 to 1, by a sigmoid.

    As in hector_rviz_plugins' view controller, 1 / (1 + e^(-12 (p - 0.5))), stretched so that it
    begins at 0 and ends at 1.
    """
    if progress <= 0:
        return 0.0
    if progress >= 1:
        return 1.0
    low = 1 / (1 + math.exp(6))
    return (1 / (1 + math.exp(-12 * (progress - 0.5))) - low) / (1 - 2 * low)

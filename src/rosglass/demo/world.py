"""The world of the simulated robot: its objects, the height of the ground, and the laser's view.

Map frame, metres, x to the right of the plan, y up (REP 103). Every object is an upright prism with
a convex outline, so that one description serves collisions, the laser and the camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    Floats = npt.NDArray[np.float64]

__all__ = [
    "LaserScanner",
    "Prism",
    "Ramp",
    "RoughGround",
    "World",
    "box",
    "cast",
    "cylinder",
    "occupancy",
]

Point = tuple[float, float]


@dataclass(frozen=True)
class Prism:
    """An object that stands on the ground.

    Attributes:
        name: Name for users.
        corners: Outline, counter-clockwise seen from above, convex, in metres.
        top: Height of its upper face in metres.
        texture: Name of the texture of its sides.
        top_texture: Name of the texture of its upper face.
        in_map: Whether it is part of the robot's map.
    """

    name: str
    corners: tuple[Point, ...]
    top: float
    texture: str
    top_texture: str = "concrete"
    in_map: bool = True

    @property
    def centre(self) -> Point:
        """Mean of the corners."""
        return (
            sum(x for x, _ in self.corners) / len(self.corners),
            sum(y for _, y in self.corners) / len(self.corners),
        )

    def segments(self) -> list[tuple[float, float, float, float]]:
        """Return the outline's edges as ``(x0, y0, x1, y1)``."""
        following = self.corners[1:] + self.corners[:1]
        return [(*a, *b) for a, b in zip(self.corners, following, strict=True)]


def box(
    name: str,
    centre: Point,
    size: tuple[float, float, float],
    texture: str,
    *,
    yaw: float = 0.0,
    top_texture: str = "concrete",
    in_map: bool = True,
) -> Prism:
    """Return a box of `size` (length, width, height) turned by `yaw` radians."""
    c, s = math.cos(yaw), math.sin(yaw)
    half_length, half_width = size[0] / 2, size[1] / 2
    corners = tuple(
        (centre[0] + c * x - s * y, centre[1] + s * x + c * y)
        for x, y in (
            (-half_length, -half_width),
            (half_length, -half_width),
            (half_length, half_width),
            (-half_length, half_width),
        )
    )
    return Prism(name, corners, size[2], texture, top_texture, in_map)


def cylinder(
    name: str, centre: Point, radius: float, height: float, texture: str, top_texture: str
) -> Prism:
    """Return a barrel, as an upright prism with ten sides."""
    corners = tuple(
        (
            centre[0] + radius * math.cos(2 * math.pi * k / 10),
            centre[1] + radius * math.sin(2 * math.pi * k / 10),
        )
        for k in range(10)
    )
    return Prism(name, corners, height, texture, top_texture)


@dataclass(frozen=True)
class Ramp:
    """A ramp along x: up, a level part, down again.

    Attributes:
        start: Its start in x, metres.
        y: Its middle line, metres.
        width: Its width, metres.
        slope_length: Length of each slope along x.
        top_length: Length of the level part.
        height: Height of the level part, metres.
    """

    start: float
    y: float
    width: float
    slope_length: float
    top_length: float
    height: float

    @property
    def end(self) -> float:
        """End of the ramp in x, metres."""
        return self.start + 2 * self.slope_length + self.top_length

    def ground(self, x: Floats, y: Floats) -> Floats:
        """Return the height of the ramp's surface, 0 beside it."""
        rise = np.minimum(x - self.start, self.end - x) / self.slope_length
        inside = np.abs(y - self.y) <= self.width / 2
        return np.where(inside, np.clip(rise, 0.0, 1.0) * self.height, 0.0)


@dataclass(frozen=True)
class RoughGround:
    """A field of rubble: smooth bumps that fade out towards its border.

    Attributes:
        centre: Its centre.
        radius: Its radius, metres.
        amplitude: Height of the highest bumps, metres.
        wavelength: Distance from bump to bump, metres.
    """

    centre: Point
    radius: float
    amplitude: float
    wavelength: float

    def ground(self, x: Floats, y: Floats) -> Floats:
        """Return the height of the bumps, 0 outside the field."""
        dx, dy = x - self.centre[0], y - self.centre[1]
        fade = np.clip(1.0 - (dx * dx + dy * dy) / self.radius**2, 0.0, 1.0)
        k = 2 * math.pi / self.wavelength
        bumps = 0.25 * (2.0 + np.sin(k * dx + 0.4) + np.sin(k * 0.83 * dy + 1.3 * dx))
        return self.amplitude * fade * bumps


@dataclass(frozen=True)
class World:
    """The complete scene.

    Attributes:
        half_length: Half of the inner size along x, metres.
        half_width: Half of the inner size along y, metres.
        dock: Position of the charging dock; the robot starts there.
        prisms: All fixed objects, including the surrounding walls.
        ramp: The ramp.
        rough: The field of rubble.
    """

    half_length: float
    half_width: float
    dock: Point
    prisms: tuple[Prism, ...]
    ramp: Ramp
    rough: RoughGround
    _segments: Floats = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        edges = [edge for prism in self.prisms for edge in prism.segments()]
        object.__setattr__(self, "_segments", np.array(edges, dtype=np.float64))

    @classmethod
    def standard(cls) -> World:
        """Return the world of the demo: a walled yard with crates, barrels, a ramp and rubble."""
        half_length, half_width, wall, thick = 7.0, 5.0, 1.7, 0.2
        ramp = Ramp(start=2.4, y=-2.0, width=1.7, slope_length=1.3, top_length=1.0, height=0.36)
        rail = (ramp.end - ramp.start, 0.1, 0.5)
        edge = ramp.width / 2 + 0.05
        middle = (ramp.start + ramp.end) / 2
        length, width = 2 * half_length, 2 * half_width
        east, north = half_length + thick / 2, half_width + thick / 2
        crate = (0.7, 0.7, 0.7)
        return cls(
            half_length,
            half_width,
            (-5.4, -3.2),
            (
                box("west wall", (-east, 0), (thick, width, wall), "panel"),
                box("east wall", (east, 0), (thick, width, wall), "panel"),
                box("south wall", (0, -north), (length, thick, wall), "panel"),
                box("north wall", (0, north), (length, thick, wall), "panel"),
                box("brick wall", (-2.0, -3.9), (0.24, 2.2, 1.25), "brick"),
                box("north brick wall", (1.6, 3.4), (0.24, 3.2, 1.25), "brick"),
                box("garden wall", (4.6, 1.8), (2.4, 0.24, 0.8), "brick"),
                box("crate 1", (-1.2, 1.3), crate, "crate", yaw=0.35, top_texture="crate"),
                box("crate 2", (-0.4, 1.75), crate, "crate", yaw=-0.1, top_texture="crate"),
                box("crate 3", (5.9, 4.0), crate, "crate", yaw=0.6, top_texture="crate"),
                box("low crate", (-6.2, 0.3), (0.9, 0.6, 0.38), "crate", top_texture="crate"),
                box("container", (-5.6, 4.2), (2.2, 1.0, 1.3), "container"),
                cylinder("red barrel", (-0.6, -1.5), 0.29, 0.9, "red barrel", "lid"),
                cylinder("blue barrel", (-0.1, -2.15), 0.29, 0.9, "blue barrel", "lid"),
                cylinder("yellow barrel", (3.1, 3.6), 0.29, 0.9, "yellow barrel", "lid"),
                cylinder("pillar", (2.2, 0.2), 0.2, 1.7, "hazard", "concrete"),
                box("south rail", (middle, ramp.y - edge), rail, "hazard"),
                box("north rail", (middle, ramp.y + edge), rail, "hazard"),
            ),
            ramp,
            RoughGround(centre=(-3.9, 2.2), radius=1.6, amplitude=0.09, wavelength=0.62),
        )

    @property
    def segments(self) -> Floats:
        """Edges of all fixed objects, one ``x0, y0, x1, y1`` per row."""
        return self._segments

    def ground(self, x: Floats, y: Floats) -> Floats:
        """Return the height of the ground at the points, metres."""
        return self.ramp.ground(x, y) + self.rough.ground(x, y)

    def carrier(self, phase: float) -> Prism:
        """Return the little transport vehicle that patrols the yard.

        Args:
            phase: Seconds since its start; it moves back and forth in 26 s.
        """
        angle = 2 * math.pi * phase / 26.0
        return box(
            "carrier",
            (0.55, 2.9 * math.sin(angle) - 1.4),
            (0.45, 0.75, 0.55),
            "carrier",
            top_texture="carrier top",
            in_map=False,
        )


def cast(x: float, y: float, angles: Floats, segments: Floats) -> Floats:
    """Return the distance from the point to the nearest segment in each direction.

    Args:
        x: Origin, metres.
        y: Origin, metres.
        angles: Directions in radians.
        segments: One ``x0, y0, x1, y1`` per row.

    Returns:
        Distances in metres, infinite where there is no segment.
    """
    dx, dy = np.cos(angles)[:, None], np.sin(angles)[:, None]
    px, py = segments[:, 0] - x, segments[:, 1] - y
    ex, ey = segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]
    cross = dx * ey - dy * ex
    with np.errstate(divide="ignore", invalid="ignore"):
        along_ray = (px * ey - py * ex) / cross
        along_edge = (px * dy - py * dx) / cross
    hit = (along_ray >= 0) & (along_edge >= 0) & (along_edge <= 1)
    distances: Floats = np.where(hit, along_ray, np.inf).min(axis=1)
    return distances


class LaserScanner:
    """A planar scanner with a view all around.

    Attributes:
        beams: Number of rays.
        angle_min: First direction relative to the robot, radians.
        angle_increment: Between two rays, radians.
        range_min: Nearest distance it measures, metres.
        range_max: Farthest distance it measures, metres.
        mount: Its position on the robot, metres forward of the middle.
    """

    beams = 360
    angle_min = -math.pi
    angle_increment = 2 * math.pi / 360
    range_min = 0.1
    range_max = 12.0
    mount = 0.1

    def __init__(self, world: World, noise: float = 0.01, seed: int = 7) -> None:
        self._world = world
        self._noise = noise
        self._random = np.random.default_rng(seed)
        self._angles: Floats = self.angle_min + self.angle_increment * np.arange(
            self.beams, dtype=np.float64
        )

    def scan(self, x: float, y: float, yaw: float, phase: float) -> npt.NDArray[np.float32]:
        """Return the ranges seen from a robot at the pose, metres.

        Args:
            x: The robot's middle.
            y: The robot's middle.
            yaw: Its heading, radians.
            phase: Position of the moving vehicle (:meth:`World.carrier`).

        Returns:
            One range per beam; infinite beyond :attr:`range_max` (REP 117).
        """
        moving = np.array(self._world.carrier(phase).segments(), dtype=np.float64)
        segments = np.concatenate([self._world.segments, moving])
        x += self.mount * math.cos(yaw)
        y += self.mount * math.sin(yaw)
        ranges = cast(x, y, self._angles + yaw, segments)
        ranges = ranges + self._random.normal(0.0, self._noise, self.beams)
        ranges = np.maximum(ranges, self.range_min)
        return np.where(ranges > self.range_max, np.inf, ranges).astype(np.float32)


def occupancy(world: World, resolution: float = 0.05, margin: float = 0.5) -> npt.NDArray[np.int8]:
    """Return the map of all fixed objects.

    Args:
        world: The world.
        resolution: Metres per cell.
        margin: Unknown border around the walls, metres.

    Returns:
        Rows from south to north, columns from west to east, as in ``nav_msgs/msg/OccupancyGrid``:
        100 occupied, 0 free, -1 unknown; 35 on rough ground.
    """
    half_x, half_y = world.half_length + margin, world.half_width + margin
    columns, rows = round(2 * half_x / resolution), round(2 * half_y / resolution)
    xs = (np.arange(columns) + 0.5) * resolution - half_x
    ys = (np.arange(rows) + 0.5) * resolution - half_y
    x, y = np.meshgrid(xs, ys)
    inside = (np.abs(x) <= world.half_length) & (np.abs(y) <= world.half_width)
    grid = np.where(inside, 0, -1).astype(np.int8)
    grid[inside & (world.ground(x, y) > 0.015)] = 35
    for prism in world.prisms:
        if prism.in_map:
            covered = np.ones_like(inside)
            for x0, y0, x1, y1 in prism.segments():
                covered &= (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) >= 0
            grid[covered] = 100
    return grid

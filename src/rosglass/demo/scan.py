"""The laser scanner, and the robot's map of the walls."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from rosglass.demo.world import World

    Floats = npt.NDArray[np.float64]

__all__ = ["LaserScanner", "cast", "occupancy"]


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

"""The laser scanner and the map against the geometry they are made from."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rosglass.demo.world import LaserScanner, World, cast, occupancy


def test_ray_ends_at_the_nearest_edge() -> None:
    segments = np.array([[2.0, -1.0, 2.0, 1.0], [3.0, -1.0, 3.0, 1.0], [-1.0, 4.0, 1.0, 4.0]])
    angles = np.array([0.0, math.pi / 2, math.pi, math.atan2(0.5, 2.0)])
    assert cast(0.0, 0.0, angles, segments) == pytest.approx(
        [2.0, 4.0, math.inf, math.hypot(2, 0.5)]
    )


def test_scan_shows_the_walls_where_they_are() -> None:
    world = World.standard()
    scanner = LaserScanner(world, noise=0.0)
    x, y, yaw = -5.4, -3.2, 0.55
    ranges = scanner.scan(x, y, yaw, 0.0)
    lx, ly = x + scanner.mount * math.cos(yaw), y + scanner.mount * math.sin(yaw)

    def towards(direction: float) -> float:
        beam = (direction - yaw - scanner.angle_min) / scanner.angle_increment
        beam %= scanner.beams
        low = int(beam)
        share = beam - low
        return float(ranges[low] * (1 - share) + ranges[(low + 1) % scanner.beams] * share)

    assert towards(math.pi) == pytest.approx(lx + world.half_length, abs=0.01)
    assert towards(-math.pi / 2) == pytest.approx(ly + world.half_width, abs=0.01)
    assert towards(0.0) == pytest.approx(-2.12 - lx, abs=0.01), "the brick wall's west side"


def test_scan_sees_the_carrier_move() -> None:
    scanner = LaserScanner(World.standard(), noise=0.0)
    assert not np.array_equal(scanner.scan(-1, -3, 0, 0.0), scanner.scan(-1, -3, 0, 3.0))


def test_noise_is_small_and_the_same_for_the_same_seed() -> None:
    world = World.standard()
    exact = LaserScanner(world, noise=0.0).scan(-3, -1, 0, 0.0)
    noisy = LaserScanner(world, noise=0.01).scan(-3, -1, 0, 0.0)
    again = LaserScanner(world, noise=0.01).scan(-3, -1, 0, 0.0)
    assert np.array_equal(noisy, again)
    seen = np.isfinite(exact) & np.isfinite(noisy)
    assert 0.005 < float(np.std(noisy[seen] - exact[seen])) < 0.015
    assert noisy.dtype == np.float32


def test_map_marks_obstacles_and_unknown_areas() -> None:
    world = World.standard()
    grid = occupancy(world, resolution=0.1, margin=0.5)
    assert grid.shape == (110, 150)

    def cell(x: float, y: float) -> int:
        return int(grid[int((y + 5.5) / 0.1), int((x + 7.5) / 0.1)])

    assert cell(-2.0, -3.9) == 100, "brick wall"
    assert cell(-7.1, 0.0) == 100, "west wall"
    assert cell(*world.dock) == 0
    assert cell(world.ramp.start + 1.5, world.ramp.y) == 35
    assert cell(-7.4, 5.4) == -1
    x, y = world.carrier(0.0).centre
    assert cell(x, y) == 0, "what moves is not in the map"

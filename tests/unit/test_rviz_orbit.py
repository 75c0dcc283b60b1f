"""The position of a camera that looks at a point; needs no RViz."""

from __future__ import annotations

import math
import random

import pytest

from rosglass.overlay.orbit import STEEPEST, FramePose, Orbit, Point, ease, shortest_turn


def near(a: Point, b: Point, within: float = 1e-9) -> bool:
    return max(abs(n) for n in a - b) <= within


def test_eye_and_focus_come_back() -> None:
    chance = random.Random(1)
    for _ in range(200):
        eye, focus = (Point(*(chance.uniform(-9, 9) for _ in range(3))) for _ in range(2))
        orbit = Orbit.between(eye, focus)
        assert near(orbit.eye, eye, 0.02)
        assert orbit.focus == focus


def test_straight_down_keeps_the_yaw_it_is_given() -> None:
    orbit = Orbit.between(Point(1, 2, 9), Point(1, 2, 0), yaw=0.7)
    assert (orbit.yaw, orbit.pitch, orbit.distance) == (0.7, STEEPEST, 9)


def test_yaw_is_where_the_camera_is() -> None:
    assert Orbit.between(Point(0, 5, 0), Point(0, 0, 0)).yaw == pytest.approx(math.pi / 2)


def test_movements_turn_the_short_way_and_end_where_they_should() -> None:
    start = Orbit(Point(0, 0, 0), 1.0, 0.1, 0.2)
    end = Orbit(Point(1, 2, 3), 100.0, math.tau - 0.1, 0.6)
    middle = start.towards(end, 0.5)
    assert middle.yaw == pytest.approx(0.0)
    assert middle.distance == pytest.approx(10.0)
    assert start.towards(end, 1.0).is_near(end)
    assert start.towards(end, 0.0).is_near(start)
    assert not start.is_near(end)
    assert shortest_turn(0.1, math.tau - 0.1) == pytest.approx(-0.2)


def test_it_goes_along_with_a_frame() -> None:
    before, after = FramePose(Point(1, 1, 0), 0.0), FramePose(Point(5, 1, 1), math.pi / 2)
    orbit = Orbit.between(Point(3, 1, 2), Point(2, 1, 0))
    carried = orbit.moved_with(before, after)
    assert near(carried.focus, Point(5, 2, 1))
    assert near(carried.eye, Point(5, 3, 3))
    assert near(after.to_local(carried.focus), before.to_local(orbit.focus))
    assert near(after.to_fixed(after.to_local(Point(4, 5, 6))), Point(4, 5, 6))


def test_movements_begin_and_end_softly() -> None:
    steps = [ease(n / 100) for n in range(-10, 111)]
    assert steps == sorted(steps)
    assert (ease(-1), ease(0), ease(1), ease(2)) == (0, 0, 1, 1)
    assert ease(0.5) == pytest.approx(0.5)
    assert ease(0.001) < 0.001 < 1 - ease(0.999) + 0.001

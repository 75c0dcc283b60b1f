"""Cameras that are looked at now and then never fire together."""

from __future__ import annotations

import heapq
import itertools

import pytest

from rosglass.qml.elements.load_balancer import LoadBalancer


def simulate(intervals: list[float], seconds: float) -> list[tuple[float, int]]:
    """Return when which camera fired."""
    balancer = LoadBalancer()
    queue = [(balancer.place(c, every, 0.01 * c), c) for c, every in enumerate(intervals)]
    heapq.heapify(queue)
    fired = []
    while queue[0][0] < seconds:
        due, camera = heapq.heappop(queue)
        fired.append((due, camera))
        heapq.heappush(queue, (balancer.place(camera, intervals[camera], due + 0.02), camera))
    return fired


@pytest.mark.parametrize("count", [1, 2, 3, 4, 8, 16])
def test_equal_cameras_take_turns(count: int) -> None:
    fired = simulate([1.0] * count, 20)
    gaps = [after - before for (before, _), (after, _) in itertools.pairwise(fired)]
    # The best there is would be 1 / count.
    assert min(gaps) > 1 / count / 5
    for camera in range(count):
        mine = [at for at, who in fired if who == camera]
        assert len(mine) >= 19


@pytest.mark.parametrize("intervals", [[1, 0.5], [1, 0.7, 0.3], [5, 2, 1, 1, 0.45]])
def test_different_cameras_keep_apart_and_never_come_too_often(intervals: list[float]) -> None:
    fired = simulate(intervals, 60)
    for camera, interval in enumerate(intervals):
        mine = [at for at, who in fired if who == camera]
        assert min(b - a for a, b in itertools.pairwise(mine)) >= interval - 1e-9
        assert len(mine) > 60 / interval * 0.75
    gaps = [after - before for (before, _), (after, _) in itertools.pairwise(fired)]
    least = min(intervals) / (4 * len(intervals))
    assert sum(gap < least / 2 for gap in gaps) < 0.02 * len(gaps)


def test_a_new_one_gets_the_middle_of_the_largest_gap() -> None:
    balancer = LoadBalancer()
    assert balancer.place("a", 1.0, 0.0) == pytest.approx(0.5)
    assert balancer.place("b", 1.0, 0.0) in [pytest.approx(0.25), pytest.approx(0.75)]
    balancer.forget("a")
    balancer.forget("b")
    balancer.forget("b")
    assert balancer.place("c", 2.0, 10.0) == pytest.approx(11.0)


def test_a_late_camera_is_not_asked_to_catch_up() -> None:
    balancer = LoadBalancer()
    balancer.place("a", 1.0, 0.0)
    assert balancer.place("a", 1.0, 100.0) == pytest.approx(100.0)

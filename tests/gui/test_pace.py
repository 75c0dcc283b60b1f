"""A rate that is kept by timers that fire late and in whole milliseconds."""

from __future__ import annotations

import math

import pytest

from rosglass.qml.elements.element import Pace


@pytest.mark.parametrize("rate", [0.5, 20, 30, 62.5, 120])
@pytest.mark.parametrize("late", [0.0, 0.0004, 0.003])
def test_late_turns_do_not_lower_the_rate(rate: float, late: float) -> None:
    pace, interval, now, turns = Pace(), 1 / rate, 100.0, 0
    while now < 100 + 1000 * interval:
        wait = pace.wait(interval, now)
        if wait > 0.0005:
            now += math.ceil(wait * 1000) / 1000 + late
        pace.take(interval, now)
        turns += 1
    assert turns == pytest.approx(1000, abs=3)


@pytest.mark.parametrize("rate", [30, 62.5, 120, 400, 1000])
def test_timers_in_milliseconds_keep_the_rate(rate: float, monkeypatch: pytest.MonkeyPatch) -> None:
    now, turns, pace = 100.0, 0, Pace()
    monkeypatch.setattr("rosglass.qml.elements.element.time.monotonic", lambda: now)
    while now < 110:
        now += pace.take_ms(rate) / 1000
        turns += 1
    assert turns == pytest.approx(10 * rate, rel=0.01)


def test_pause_is_not_caught_up() -> None:
    pace = Pace()
    pace.take(0.1, 5.0)
    pace.take(0.1, 7.31)
    assert pace.wait(0.1, 7.31) == pytest.approx(0.1)


def test_turns_taken_early_wait_for_less_than_two_intervals() -> None:
    pace = Pace()
    for _ in range(100):
        pace.take(0.1, 5.0)
        assert 0 < pace.wait(0.1, 5.0) < 0.2 + 1e-9


def test_another_rate_counts_at_once() -> None:
    pace = Pace()
    pace.take(10.0, 5.0)
    assert pace.wait(0.1, 5.05) == pytest.approx(0.05)

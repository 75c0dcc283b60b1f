"""Detecting a regular publisher that has fallen silent."""

from __future__ import annotations

import pytest

from rosglass.wires.tcpros.arrivals import SilenceMonitor


def look(silence: SilenceMonitor, counts: list[int], start: float = 0.0) -> list[str]:
    """Look once a second; return the problem after each look."""
    problems = []
    for number, count in enumerate(counts):
        silence.update("/robot", count, start + number)
        problems.append(silence.problem)
    return problems


def regular(rate: int, looks: int = 20) -> list[int]:
    return [rate * number for number in range(looks)]


def test_regular_publisher_is_missed_after_a_second():
    counts = regular(30)
    problems = look(SilenceMonitor(), [*counts, counts[-1], counts[-1]])
    assert problems[:-2] == [""] * len(counts)
    assert "nothing was received from /robot since " in problems[-2]
    assert "(it sent 30 per second before); is it frozen, or cut off?" in problems[-2]
    assert problems[-1] == problems[-2]  # or it would be notified again and again


@pytest.mark.parametrize("last", [1, 7, 29])
def test_publisher_that_falls_silent_between_two_checks_is_missed(last):
    counts = regular(30)
    end = counts[-1] + last
    problems = look(SilenceMonitor(), [*counts, end, end, end])
    assert "(it sent 30 per second before)" in problems[-1]


def test_slow_publisher_is_missed_after_five_of_its_intervals():
    counts = regular(1)
    problems = look(SilenceMonitor(), [*counts, *[counts[-1]] * 6])
    assert problems[len(counts) : -2] == [""] * 4
    assert "(it sent 1 per second before)" in problems[-2]


def test_next_message_ends_it_at_once():
    silence, counts = SilenceMonitor(), regular(30)
    look(silence, [*counts, counts[-1], counts[-1]])
    assert silence.problem
    silence.update("/robot", counts[-1] + 1, len(counts) + 1.01)
    assert not silence.problem


def test_missed_publisher_has_to_become_regular_again():
    silence, counts = SilenceMonitor(), regular(30)
    look(silence, [*counts, counts[-1], counts[-1]])
    assert not any(look(silence, [counts[-1] + 1] * 60, 100.0))


@pytest.mark.parametrize(
    "counts",
    [
        [1] * 60,
        [0] * 60,
        [number // 3 for number in range(60)] + [20] * 60,
        regular(30, 8) + [210] * 60,
        [0, 2, 40, 41, 90, 92, 100, 170, 171, 200, 206, 290, 291, 330, 333, *[333] * 60],
    ],
    ids=["one message", "none", "every three seconds", "for some seconds", "now and then"],
)
def test_irregular_publisher_is_not_missed(counts):
    assert not any(look(SilenceMonitor(), counts))


def test_looks_in_quick_succession_count_as_one():
    silence = SilenceMonitor()
    for number in range(200):
        silence.update("/robot", number, number / 100)
    silence.update("/robot", 200, 60.0)
    silence.update("/robot", 200, 120.0)
    assert not silence.problem

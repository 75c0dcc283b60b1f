"""Matching messages by their stamps."""

from __future__ import annotations

import itertools
from random import Random
from typing import Any

import pytest

from rosglass.comm.approximate_time import ApproximateTime
from rosglass.errors import ConversionError

MS = 1_000_000


def feed(matcher: ApproximateTime[Any], *messages: tuple[int, int]) -> list[list[int]]:
    """Add messages (topic, milliseconds); the items are the stamps."""
    found = []
    for topic, stamp in messages:
        found += matcher.add(topic, stamp * MS, stamp)
    return found


def test_equal_stamps_match_at_once():
    matcher: ApproximateTime[int] = ApproximateTime(3, 10, 0)
    assert feed(matcher, (0, 5), (1, 5)) == []
    assert feed(matcher, (2, 5)) == [[5, 5, 5]]
    assert feed(matcher, (2, 6), (0, 6), (1, 7), (0, 7), (2, 7)) == [[7, 7, 7]]
    assert matcher.dropped == 2


def test_nearest_are_matched_not_the_first():
    matcher: ApproximateTime[int] = ApproximateTime(2, 10, 100 * MS)
    # 0 and 33 could be matched with 30, too.
    assert feed(matcher, (0, 0), (1, 30)) == []
    assert feed(matcher, (0, 33)) == [[33, 30]]


def test_messages_further_apart_than_the_slop_are_dropped():
    matcher: ApproximateTime[int] = ApproximateTime(2, 10, 20 * MS)
    assert feed(matcher, (0, 0), (1, 30), (0, 60), (1, 90)) == []
    assert matcher.dropped == 3
    assert feed(matcher, (0, 91), (1, 120)) == [[91, 90]]


def test_full_queue_drops_the_oldest():
    matcher: ApproximateTime[int] = ApproximateTime(2, 3, 1000 * MS)
    assert feed(matcher, *((0, 10 * i) for i in range(8))) == []
    assert matcher.dropped == 5
    # What was thrown out might have fitted better, so that 50 with 45 would be a guess.
    assert feed(matcher, (1, 45)) == []
    assert feed(matcher, (1, 61), (1, 71)) == [[60, 61]]


def test_stamps_that_go_back_begin_anew():
    matcher: ApproximateTime[int] = ApproximateTime(2, 10, 20 * MS)
    assert feed(matcher, (0, 1000), (0, 1100)) == []
    assert feed(matcher, (0, 5), (1, 5)) == [[5, 5]]
    assert matcher.dropped == 2


def streams(seed: int) -> tuple[list[list[int]], list[tuple[int, int]]]:
    random = Random(seed)
    periods = [random.choice([20, 33, 50]) for _ in range(random.choice([2, 3]))]
    made = [
        sorted({round(k * period + random.gauss(0, 3)) + 50 for k in range(40)})
        for period in periods
    ]
    merged = sorted((stamp, topic) for topic, stamps in enumerate(made) for stamp in stamps)
    return made, [(topic, stamp) for stamp, topic in merged]


@pytest.mark.parametrize("seed", range(30))
def test_sets_are_in_order_disjoint_and_within_the_slop(seed):
    made, arrivals = streams(seed)
    matcher: ApproximateTime[int] = ApproximateTime(len(made), 100, 25 * MS)
    found = feed(matcher, *arrivals)
    assert len(found) > 10
    for one in found:
        assert max(one) - min(one) <= 25
        assert all(stamp in stamps for stamp, stamps in zip(one, made, strict=True))
    for before, after in itertools.pairwise(found):
        assert all(a < b for a, b in zip(before, after, strict=True))


@pytest.mark.parametrize("seed", range(30))
def test_order_of_arrival_does_not_matter(seed):
    made, arrivals = streams(seed)
    random = Random(seed)
    late = [random.choice([0, 15, 60, 200]) for _ in made]
    delayed = sorted(arrivals, key=lambda m: m[1] + late[m[0]])
    results = [
        feed(ApproximateTime(len(made), 1000, 25 * MS), *order) for order in (arrivals, delayed)
    ]
    common = min(map(len, results))
    assert common > 10
    assert results[0][:common] == results[1][:common]


@pytest.mark.parametrize("seed", range(10))
def test_same_rate_with_jitter_loses_nothing(seed):
    random = Random(seed)
    matcher: ApproximateTime[tuple[int, int]] = ApproximateTime(2, 10, 30 * MS)
    found = []
    for k in range(100):
        for topic in (0, 1):
            found += matcher.add(topic, (100 * k + random.randint(0, 20)) * MS, (topic, k))
    assert found[:98] == [[(0, k), (1, k)] for k in range(98)]


@pytest.mark.parametrize(
    ("arguments", "message"), [((1,), "two"), ((2, 0), "at least 1"), ((2, 1, -1), "0 or more")]
)
def test_invalid_argument_is_rejected(arguments, message):
    with pytest.raises(ConversionError, match=message):
        ApproximateTime(*arguments)

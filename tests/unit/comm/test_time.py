from __future__ import annotations

import math
import operator
import time

import pytest

from rosglass import ConversionError, Duration, Time


def test_times_keep_every_nanosecond():
    stamp = Time.from_parts(1_700_000_000, 123_456_789)
    assert stamp.nanoseconds == 1_700_000_000_123_456_789
    assert (stamp.sec, stamp.nanosec) == (1_700_000_000, 123_456_789)
    assert stamp.to_dict() == {"sec": 1_700_000_000, "nanosec": 123_456_789}


def test_seconds_round_towards_minus_infinity_so_that_nanoseconds_stay_positive():
    assert Time(-1).to_dict() == {"sec": -1, "nanosec": 999_999_999}


def test_arithmetic():
    start = Time(10)
    assert start + Duration(5) == Time(15)
    assert Time(15) - start == Duration(5)
    assert Duration(5) - Duration(7) == -Duration(2)
    assert Duration(1) + Duration(2) == Duration(3)
    assert Duration(1) < Duration(2)


@pytest.mark.parametrize(("seconds", "nanoseconds"), [(0.1, 100_000_000), (-1.5, -1_500_000_000)])
def test_durations_from_seconds(seconds, nanoseconds):
    assert Duration.from_seconds(seconds) == Duration(nanoseconds)
    assert Duration(nanoseconds).seconds == seconds


def test_now_is_the_system_clock():
    assert abs(Time.now().nanoseconds - time.time_ns()) < 1_000_000_000
    assert Time.now().seconds == pytest.approx(time.time(), abs=1)


@pytest.mark.parametrize("kind", [Time, Duration])
@pytest.mark.parametrize("value", [1.5, "1", True, None])
def test_only_whole_nanoseconds(kind, value):
    with pytest.raises(ConversionError, match=f"{kind.__name__}: nanoseconds: expected an integer"):
        kind(value)


@pytest.mark.parametrize("seconds", ["1", None, math.nan, math.inf])
def test_durations_need_finite_seconds(seconds):
    with pytest.raises(ConversionError, match="seconds: expected a finite number"):
        Duration.from_seconds(seconds)


@pytest.mark.parametrize("other", [5, 1.5, "x"])
@pytest.mark.parametrize("value", [Time(1), Duration(1)])
def test_plain_numbers_have_no_unit(value, other):
    for operate in (operator.add, operator.sub):
        with pytest.raises(TypeError):
            operate(value, other)


def test_going_back_in_time():
    assert Time(5) - Duration(2) == Time(3)

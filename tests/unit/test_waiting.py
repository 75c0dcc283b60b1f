"""Failures of the waiting helper name what did not happen."""

from __future__ import annotations

import time

import pytest
from waiting import eventually, nothing_happens


def test_it_returns_the_first_true_value() -> None:
    values = iter([0, None, "", "there"])
    assert eventually(lambda: next(values)) == "there"


def test_it_fails_with_the_condition_its_value_and_what_it_looked_at() -> None:
    heard = ["a", "b"]
    with pytest.raises(AssertionError) as failure:
        eventually(lambda: len(heard) > 2, lambda: "a third message", timeout=0.02)
    said = str(failure.value)
    assert said.startswith("not within 0.02 s: ")
    for part in ("len(heard) > 2", "is False", "a third message", "heard = ['a', 'b']"):
        assert part in said


def test_condition_without_source_is_reported() -> None:
    with pytest.raises(AssertionError, match=r"<built-in method .*>\n  is \{\}"):
        eventually({}.copy, timeout=0)


def test_time_passes_in_turns() -> None:
    turns = []
    begin = time.monotonic()
    nothing_happens(0.05, turn=lambda: turns.append(time.sleep(0.01)))
    assert time.monotonic() - begin >= 0.05
    assert turns

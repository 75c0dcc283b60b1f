from __future__ import annotations

import pytest

from rosglass.comm.inbox import DuplicateFilter

A, B = b"a" * 16, b"b" * 16


def accepted(*samples):
    """Return the (gid, sequence, sent) that pass."""
    repeats = DuplicateFilter()
    return [sample for sample in samples if not repeats.is_duplicate(*sample)]


@pytest.mark.parametrize(
    ("sequences", "expected"),
    [
        ([1, 2, 3], [1, 2, 3]),
        ([1, 1, 2, 2, 3], [1, 2, 3]),
        ([1, 2, 1, 2, 3], [1, 2, 3]),
        ([1, 2, 3, 1, 2, 3, 4], [1, 2, 3, 4]),
        ([1, 4, 2, 3, 5], [1, 4, 2, 3, 5]),
        ([1, 4, 2, 2, 3, 4], [1, 4, 2, 3]),
        ([5, 6], [5, 6]),
        ([5, 3], [5]),
        ([1, 1_000_000, 999_999, 999_999], [1, 1_000_000, 999_999]),
    ],
    ids=[
        "in order",
        "each twice",
        "history again",
        "all again",
        "late ones are not repeats",
        "late ones once",
        "joining late",
        "older than the first one seen",
        "a wide gap",
    ],
)
def test_repeats_of_one_publisher(sequences, expected):
    # Published one nanosecond after the other.
    passed = accepted(*[(A, n, n) for n in sequences])
    assert [n for _, n, _ in passed] == expected


def test_publishers_do_not_disturb_each_other():
    samples = [(A, 1, 1), (B, 1, 1), (A, 2, 2), (B, 2, 2)]
    assert accepted(*samples) == samples


def test_publisher_that_starts_counting_again_is_not_repeating():
    samples = [(A, 9, 9), (A, 1, 10), (A, 2, 11)]
    assert accepted(*samples, samples[-1]) == samples


def test_publisher_that_does_not_count_is_judged_by_its_time_stamps():
    assert accepted((A, 0, 1), (A, 0, 2), (A, 0, 2)) == [(A, 0, 1), (A, 0, 2)]


def test_clock_set_back_does_not_count_as_repeat():
    samples = [(A, 1, 100), (A, 2, 50), (A, 3, 51)]
    assert accepted(*samples) == samples


@pytest.mark.parametrize("sample", [(b"", 1, 1), (A, -1, 1), (A, 1, None)])
def test_samples_without_identity_are_never_repeats(sample):
    assert accepted(sample, sample) == [sample, sample]


def test_memory_is_bounded():
    repeats = DuplicateFilter()
    publishers = [number.to_bytes(16, "big") for number in range(5000)]
    for publisher in publishers:
        repeats.is_duplicate(publisher, 1, 1)
    assert repeats.is_duplicate(publishers[-1], 1, 1)
    assert not repeats.is_duplicate(publishers[0], 1, 1), "it is forgotten"
    for number in range(5000):
        repeats.is_duplicate(A, number * 100, number)
    assert not repeats.is_duplicate(A, 499_899, 0), "it was missing"
    assert repeats.is_duplicate(A, 150, 0), "that it was missing is forgotten"

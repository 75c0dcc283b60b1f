from __future__ import annotations

import pytest
from receiving import deliver

from rosglass import Duration, QoS
from rosglass.comm import IMMEDIATE, Sample, Subscription
from rosglass.comm import statistics as module
from rosglass.comm.statistics import LatencyEstimator

P = b"p" * 16
MS = 1_000_000
S = 1000 * MS


@pytest.fixture
def offset(monkeypatch):
    """The system's clock against one that nobody sets, in nanoseconds."""
    value = [0]
    monkeypatch.setattr(module, "_offset", lambda: value[0])
    return value


def lateness_of(*samples):
    """Return the lateness in ms of samples given by (received, sent), in ms."""
    seen = LatencyEstimator()
    return [seen.add(P, received * MS, sent * MS) / MS for received, sent in samples]


@pytest.mark.parametrize("skew", [0, 5_000_000, -5_000_000], ids=["same clock", "ahead", "behind"])
def test_the_fastest_sample_is_the_measure_whatever_the_clocks_say(offset, skew):
    samples = [(100 + 3, 100), (200 + 1, 200), (300 + 50, 300), (400 + 1, 400)]
    found = lateness_of(*[(received + skew, sent) for received, sent in samples])
    assert found == pytest.approx([0, 0, 49, 0], abs=0.3)


def test_what_a_silent_link_kept_back_is_late_and_what_follows_is_not(offset):
    live = [(number * 100 + 1, number * 100) for number in range(10)]
    kept = [(10_000, number * 100) for number in range(10, 100)]
    after = [(number * 100 + 1, number * 100) for number in range(101, 110)]
    found = lateness_of(*live, *kept, *after)
    assert found[10] == pytest.approx(9000, abs=10)
    assert found[99] == pytest.approx(100, abs=10)
    assert found[100] == pytest.approx(0, abs=10)


def test_a_link_that_stays_slow_is_noticed_for_long(offset):
    samples = [(0, 0), *[(n * 1000 + 5000, n * 1000) for n in range(1, 601)]]
    found = lateness_of(*samples)
    assert found[1] == pytest.approx(5000, rel=0.01)
    assert found[600] > 4500, "ten minutes later"


def test_clocks_that_drift_apart_are_followed(offset):
    # 100 ppm, a poor crystal: 0.36 s in an hour.
    found = lateness_of(*[(n * 1000 + n // 10, n * 1000) for n in range(3600)])
    assert max(found) < 2


def test_a_publishers_clock_that_is_set_back_is_followed(offset):
    before = [(n * 100, n * 100) for n in range(10)]
    after = [(n * 100, n * 100 - 30_000) for n in range(10, 20)]
    found = lateness_of(*before, *after)
    assert found[10] == pytest.approx(30_000, rel=0.01), "it may as well be late itself"
    assert found[11:] == [0] * 9


def test_a_publishers_clock_that_is_set_forward_is_followed(offset):
    samples = [(0, 0), (100, 100), (200, 30_200), (300, 30_300)]
    assert lateness_of(*samples) == pytest.approx([0, 0, 0, 0], abs=1)


def test_one_sample_that_was_overtaken_does_not_count_as_a_clock_set_back(offset):
    samples = [(0, 0), (10_000, 10_000), (10_001, 5_000), (10_002, 10_002), (10_003, 9_000)]
    found = lateness_of(*samples)
    assert found[2] == pytest.approx(5_001, abs=10)
    assert found[4] == pytest.approx(1_003, abs=10)


@pytest.mark.parametrize("step", [3600 * S, -3600 * S])
def test_a_step_of_our_own_clock_is_measured(offset, step):
    seen = LatencyEstimator()
    assert seen.add(P, 100 * S, 100 * S) == 0
    offset[0] = step
    assert seen.add(P, 101 * S + step, 101 * S) == pytest.approx(0, abs=MS)
    assert seen.lateness(P, 105 * S + step, 101 * S) == pytest.approx(4 * S, rel=0.01)


def test_unknown_publishers_and_many_of_them(offset):
    seen = LatencyEstimator()
    assert seen.lateness(P, 10, 5) == 0
    for number in range(2000):
        seen.add(number.to_bytes(16, "big"), 10, 5)
    known = [n for n in range(2000) if seen.lateness(n.to_bytes(16, "big"), 10 + S, 5)]
    assert 1 <= len(known) <= 256


def test_subscriptions_tell_latency_and_lateness(offset):
    sub = Subscription("/t", None, QoS(), IMMEDIATE)
    assert sub.statistics().latency is None
    assert sub.statistics().lateness is None
    live = Sample(b"x", "cdr", None, 1_000 * MS, 998 * MS, P, 1)
    deliver(sub, live)
    assert sub.statistics().latency == Duration(2 * MS)
    assert sub.statistics().lateness == Duration()
    late = live._replace(received_ns=5_000 * MS, sent_ns=2_000 * MS)
    assert sub.lateness(late).seconds == pytest.approx(2.998, abs=0.01)
    assert sub.lateness(live._replace(sent_ns=None)) == Duration()
    assert (live.received.nanoseconds, live.sent.nanoseconds) == (1_000 * MS, 998 * MS)
    assert live._replace(sent_ns=None).sent is None

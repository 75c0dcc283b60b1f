from __future__ import annotations

import pytest
from receiving import deliver

from rosglass import Duration, QoS, load
from rosglass.comm import IMMEDIATE, Sample, Subscription, inbox
from rosglass.comm import statistics as module
from rosglass.comm.statistics import LatencyEstimator, StampMonitor

P = b"p" * 16
MS = 1_000_000
S = 1000 * MS


@pytest.fixture
def offset(monkeypatch):
    """The difference of the system's clock to one that is never set, in nanoseconds."""
    value = [0]
    monkeypatch.setattr(module, "_offset", lambda: value[0])
    return value


def lateness_of(*samples):
    """Return the lateness in ms of samples given by (received, sent), in ms."""
    seen = LatencyEstimator()
    return [seen.add(P, received * MS, sent * MS) / MS for received, sent in samples]


@pytest.mark.parametrize("skew", [0, 5_000_000, -5_000_000], ids=["same clock", "ahead", "behind"])
def test_lateness_is_relative_to_the_fastest_sample(offset, skew):
    samples = [(100 + 3, 100), (200 + 1, 200), (300 + 50, 300), (400 + 1, 400)]
    found = lateness_of(*[(received + skew, sent) for received, sent in samples])
    assert found == pytest.approx([0, 0, 49, 0], abs=0.3)


def test_samples_held_back_by_a_silent_link_are_late(offset):
    live = [(number * 100 + 1, number * 100) for number in range(10)]
    kept = [(10_000, number * 100) for number in range(10, 100)]
    after = [(number * 100 + 1, number * 100) for number in range(101, 110)]
    found = lateness_of(*live, *kept, *after)
    assert found[10] == pytest.approx(9000, abs=10)
    assert found[99] == pytest.approx(100, abs=10)
    assert found[100] == pytest.approx(0, abs=10)


def test_link_that_stays_slow_is_noticed_for_long(offset):
    samples = [(0, 0), *[(n * 1000 + 5000, n * 1000) for n in range(1, 601)]]
    found = lateness_of(*samples)
    assert found[1] == pytest.approx(5000, rel=0.01)
    assert found[600] > 4500, "ten minutes later"


def test_clocks_that_drift_apart_are_followed(offset):
    # 100 ppm, a poor crystal: 0.36 s in an hour.
    found = lateness_of(*[(n * 1000 + n // 10, n * 1000) for n in range(3600)])
    assert max(found) < 2


def test_publishers_clock_that_is_set_back_is_followed(offset):
    before = [(n * 100, n * 100) for n in range(10)]
    after = [(n * 100, n * 100 - 30_000) for n in range(10, 20)]
    found = lateness_of(*before, *after)
    assert found[10] == pytest.approx(30_000, rel=0.01), "it may as well be late itself"
    assert found[11:] == [0] * 9


def test_publishers_clock_that_is_set_forward_is_followed(offset):
    samples = [(0, 0), (100, 100), (200, 30_200), (300, 30_300)]
    assert lateness_of(*samples) == pytest.approx([0, 0, 0, 0], abs=1)


def test_one_sample_that_was_overtaken_does_not_count_as_a_clock_set_back(offset):
    samples = [(0, 0), (10_000, 10_000), (10_001, 5_000), (10_002, 10_002), (10_003, 9_000)]
    found = lateness_of(*samples)
    assert found[2] == pytest.approx(5_001, abs=10)
    assert found[4] == pytest.approx(1_003, abs=10)


@pytest.mark.parametrize("step", [3600 * S, -3600 * S])
def test_step_of_our_own_clock_is_measured(offset, step):
    seen = LatencyEstimator()
    assert seen.add(P, 100 * S, 100 * S) == 0
    offset[0] = step
    assert seen.add(P, 101 * S + step, 101 * S) == pytest.approx(0, abs=MS)
    assert seen.lateness(P, 105 * S + step, 101 * S) == pytest.approx(4 * S, rel=0.01)


def test_unknown_publishers_and_many_of_them(offset):
    seen = LatencyEstimator()
    assert seen.lateness(P, 10, 5) == 0
    for number in range(5000):
        seen.add(number.to_bytes(16, "big"), 10, 5)
    known = [n for n in range(5000) if seen.lateness(n.to_bytes(16, "big"), 10 + S, 5)]
    assert 1 <= len(known) <= 2048


def test_subscriptions_report_latency_and_lateness(offset):
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


IMU1, IMU2 = load("sensor_msgs/Imu", ros=1), load("sensor_msgs/msg/Imu")


def stamped(received, stamp, wire="ros1", **more):
    """Return a sample that begins with a header; times in ms."""
    seconds, rest = divmod(round(stamp * MS), S)
    if wire == "ros1":
        data = IMU1.encode(header={"stamp": {"secs": seconds, "nsecs": rest}})
    else:
        order = more.pop("byteorder", "little")
        header = {"stamp": {"sec": seconds, "nanosec": rest}}
        data = IMU2.encode(header=header, byteorder=order)
    kind = IMU1 if wire == "ros1" else IMU2
    return Sample(data, wire, kind, received * MS, publisher=P)._replace(**more)


@pytest.fixture
def topic(monkeypatch, offset):
    """A subscription that measures each sample; returns the lateness of those given, in ms."""
    sub = Subscription("/imu", None, QoS(), IMMEDIATE)
    monkeypatch.setattr(inbox, "_MARK_PERIOD_S", 0.0)

    def lateness(*samples):
        found = []
        for sample in samples:
            deliver(sub, sample)
            found.append(sub.lateness(sample).seconds * 1000)
        return found

    return lateness


@pytest.mark.parametrize(
    "form", [{}, {"wire": "cdr"}, {"wire": "cdr", "byteorder": "big"}], ids=["1", "2", "2 big"]
)
@pytest.mark.parametrize("skew", [0, 90_000, -90_000])
def test_header_stamps_reveal_held_back_messages(topic, form, skew):
    live = [stamped(100_000 + n * 100 + skew, 100_000 + n * 100, **form) for n in range(10)]
    kept = [stamped(111_000 + skew, 101_000 + n * 100, **form) for n in range(100)]
    after = [stamped(111_000 + n * 100 + skew, 111_000 + n * 100, **form) for n in range(5)]
    found = topic(*live, *kept, *after)
    assert found[:10] == pytest.approx([0] * 10, abs=1)
    assert found[10] == pytest.approx(10_000, abs=10)
    assert found[109] == pytest.approx(100, abs=10)
    assert found[110:] == pytest.approx([0] * 5, abs=10)


def test_later_of_two_stamps_counts(topic):
    # A bridge on this machine sends at once what a bad link has brought it late.
    samples = [
        stamped(n * 100 + 500, 100_000 + n * 100, "cdr", sent_ns=n * 100 * MS) for n in range(5)
    ]
    bridged = stamped(1_000 + 500, 97_000, "cdr", sent_ns=1_000 * MS)
    slow = stamped(9_000 + 500, 108_900, "cdr", sent_ns=1_100 * MS)
    found = topic(*samples, bridged, slow)
    assert found[5] == pytest.approx(4_000, abs=10)
    assert found[6] == pytest.approx(7_900, abs=10)


def test_stamps_of_zero_and_stamps_that_stand_still_say_nothing(topic):
    assert topic(*[stamped(n * 1000, 0) for n in range(5)]) == [0] * 5
    # A map that is sent again every second, as it was made.
    assert topic(*[stamped(10_000 + n * 1000, 7_000) for n in range(5)])[1:] == [0] * 4
    short = stamped(20_000, 20_000)._replace(data=b"short")
    assert topic(short, short._replace(type=None)) == [0, 0]


def test_robots_clock_that_is_set_and_a_bag_that_loops_are_followed(topic):
    live = [stamped(100_000 + n * 100, 100_000 + n * 100) for n in range(10)]
    back = [stamped(101_000 + n * 100, 71_000 + n * 100) for n in range(10)]
    ahead = [stamped(102_000 + n * 100, 602_000 + n * 100) for n in range(10)]
    found = topic(*live, *back, *ahead)
    assert found[10] == pytest.approx(30_000, abs=10), "it may as well be late itself"
    assert found[11:] == pytest.approx([0] * 19, abs=1)


def test_recording_that_was_paused_is_live_again_after_a_minute(topic):
    live = [stamped(100_000 + n * 1000, 100_000 + n * 1000) for n in range(10)]
    after = [stamped(120_000 + n * 1000, 110_000 + n * 1000) for n in range(120)]
    found = topic(*live, *after)[10:]
    assert found[20] == pytest.approx(10_000, abs=20)
    assert found[62:] == pytest.approx([0] * 58, abs=20)


def test_fastest_message_is_remembered_through_a_long_outage(topic):
    live = [stamped(100_000 + n * 1000, 100_000 + n * 1000) for n in range(10)]
    kept = [stamped(400_000, 110_000 + n * 1000) for n in range(280)]
    assert topic(*live, *kept)[10] == pytest.approx(290_000, rel=0.01)


def test_transforms_and_other_data_with_stamps(offset):
    seen = StampMonitor()
    assert [seen.add(b"map base", n * S, n * S) for n in range(1, 5)] == [0.0] * 4
    assert seen.add(b"map base", 20 * S, 5 * S) == pytest.approx(15, rel=0.01)
    assert seen.add(b"odom base", 20 * S, 5 * S) == 0
    assert seen.add(b"map base", 21 * S, 0) == 0

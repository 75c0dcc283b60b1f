from __future__ import annotations

import pytest
from executors import Manual
from receiving import deliver

from rosglass import QoS
from rosglass.comm import IMMEDIATE, History, Sample, Subscription


class FakeType:
    wire = "cdr"

    def decode(self, data, wire):
        if data == b"bad":
            raise ValueError("bad data")
        return data.decode()


def sample(text="x"):
    return Sample(text.encode(), "cdr", FakeType(), 1)


def subscription(executor=IMMEDIATE, **kwargs):
    kwargs.setdefault("qos", QoS(depth=3))
    qos = kwargs.pop("qos")
    return Subscription("/t", None, qos, executor, **kwargs)


def feed(target, *texts):
    deliver(target, *map(sample, texts))


def test_keep_all_keeps_all():
    sub = subscription(qos=QoS(depth=1, history=History.KEEP_ALL))
    feed(sub, *"abcde")
    assert sub.statistics().dropped == 0
    assert sub.take().data == b"a"


def test_callbacks_get_decoded_messages_on_the_executor():
    executor, seen = Manual(), []
    sub = subscription(executor, callback=seen.append)
    feed(sub, "a", "b")
    assert seen == []
    assert len(executor.jobs) == 1, "one job drains the inbox"
    executor.run()
    assert seen == ["a", "b"]


def test_slow_callback_gets_the_newest_samples():
    executor, seen = Manual(), []
    sub = subscription(executor, callback=seen.append)
    feed(sub, *"abcdef")
    executor.run()
    assert seen == ["d", "e", "f"]
    assert sub.statistics().dropped == 3


def test_samples_that_come_during_a_callback_wait_for_their_turn():
    executor, seen = Manual(), []
    sub = subscription(executor, callback=lambda m: (seen.append(m), feed(sub, "b")))
    feed(sub, "a")
    executor.run()
    assert seen == ["a"]
    executor.run()
    assert seen == ["a", "b"]


@pytest.mark.parametrize("kind", ["callback", "raw_callback"])
def test_failing_callback_is_logged_with_the_topic_and_the_next_sample_arrives(kind, caplog):
    seen = []

    def callback(thing):
        seen.append(thing)
        raise RuntimeError("of the callback")

    sub = subscription(**{kind: callback})
    feed(sub, "a", "b")
    assert len(seen) == 2
    assert "callback of subscription /t failed" in caplog.text


def test_failures_are_not_logged_for_every_message(caplog):
    def callback(thing):
        raise RuntimeError("of the callback")

    feed(subscription(callback=callback), *"abcdefghij")
    assert caplog.text.count("callback of subscription /t failed") == 1


def test_message_that_cannot_be_decoded_is_logged_and_the_next_one_arrives(caplog):
    seen = []
    feed(subscription(callback=seen.append), "bad", "good")
    assert seen == ["good"]
    assert "bad data" in caplog.text


def test_callback_may_close_its_subscription_and_gets_nothing_more():
    seen, executor = [], Manual()
    sub = subscription(executor, callback=lambda m: (seen.append(m), sub.close()))
    feed(sub, "a", "b")
    executor.run()
    feed(sub, "c")
    executor.run()
    sub.close()
    assert seen == ["a"]
    assert sub.take() is None


def test_statistics_before_the_first_sample():
    now = subscription().statistics()
    assert (now.received, now.frequency, now.bandwidth, now.age) == (0, 0.0, 0.0, None)


def test_frequency_and_bandwidth_fall_when_samples_stop(monkeypatch):
    clock = [100.0]
    monkeypatch.setattr("rosglass.comm.inbox.time.monotonic", lambda: clock[0])
    sub = subscription()
    for _ in range(40):
        feed(sub, "1234")
        clock[0] += 0.1
    live = sub.statistics()
    assert live.frequency == pytest.approx(10, rel=0.05)
    assert live.bandwidth == pytest.approx(40, rel=0.05)
    clock[0] += 4
    stale = sub.statistics()
    assert (stale.frequency, stale.bandwidth) == (0, 0)
    assert stale.age.seconds == pytest.approx(4.1)


def test_patient_is_a_deprecated_name_of_batching():
    sub = subscription()
    with pytest.warns(DeprecationWarning, match=r"set_patient\(\) is now set_batching\(\)"):
        sub.set_patient(True)
    assert sub.batching
    with pytest.warns(DeprecationWarning, match="patient is now batching"):
        assert sub.patient


def test_wrong_arguments_are_type_errors():
    for wrong in ({"callback": print, "raw_callback": print}, {"executor": 1}):
        with pytest.raises(TypeError):
            subscription(**wrong)
    with pytest.raises(TypeError, match=r"a rosglass\.comm\.Sample"):
        subscription().lateness(7)
    with pytest.raises(TypeError, match="a number of bytes"):
        subscription().set_inbox_limit(0)

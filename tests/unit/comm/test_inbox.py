"""Waiting, dropping and calling back, with several threads and little memory."""

from __future__ import annotations

import asyncio
import sys
import threading
import time

import pytest
from receiving import deliver
from waiting import eventually

from rosglass import ConversionError, QoS
from rosglass.comm import IMMEDIATE, Dispatcher, History, Sample, Subscription

KEEP_ALL = QoS(history=History.KEEP_ALL)


def sample(data=b"x", sequence=1):
    return Sample(data, "cdr", None, 1, 1, b"p", sequence)


def subscription(qos=KEEP_ALL, executor=IMMEDIATE, **kwargs):
    return Subscription("/t", None, qos, executor, **kwargs)


# -- bounded memory ------------------------------------------------------------------------------


def test_keep_all_is_bounded_by_bytes_counts_what_it_drops_and_complains_once(caplog):
    sub = subscription()
    sub.set_inbox_limit(10_000)
    for number in range(100):
        deliver(sub, sample(bytes(1000), number))
    waiting = []
    while (taken := sub.take()) is not None:
        waiting.append(taken.sequence)
    assert waiting == list(range(94, 100)), "1000 bytes and some 500 more for each"
    assert (sub.statistics().received, sub.statistics().dropped) == (100, 94)
    (line,) = caplog.messages
    assert line.startswith(
        "/t: messages are dropped, the oldest first, 1 so far: they are not taken"
    )


def test_slow_callback_is_reported(caplog):
    def much_too_slow(_):
        go_on.wait(30)

    go_on = threading.Event()
    dispatcher = Dispatcher("test")
    sub = subscription(executor=dispatcher, raw_callback=much_too_slow)
    sub.set_inbox_limit(2000)
    for _ in range(10):
        deliver(sub, sample(bytes(1000)))
    go_on.set()
    dispatcher.close()
    assert "much_too_slow is too slow" in caplog.text


def test_slow_callback_lets_others_have_their_turn_and_goes_on_with_the_newest():
    def slow(given):
        order.append(f"slow {given.sequence}")
        if len(order) == 1:
            for number in range(5, 9):
                deliver(sub, sample(sequence=number))
        time.sleep(0.02)

    order = []
    dispatcher, gate = Dispatcher("test"), threading.Event()
    dispatcher.post(lambda: gate.wait(30))
    sub = subscription(QoS(4), dispatcher, raw_callback=slow)
    for number in range(1, 5):
        deliver(sub, sample(sequence=number))
    dispatcher.post(lambda: order.append("other"))
    gate.set()
    eventually(lambda: len(order) == 6)
    dispatcher.close()
    assert order == ["slow 1", "other", "slow 5", "slow 6", "slow 7", "slow 8"]
    assert sub.statistics().dropped == 3


def test_one_message_beyond_the_limit_is_kept_all_the_same():
    sub = subscription()
    sub.set_inbox_limit(100)
    deliver(sub, sample(bytes(1000)))
    assert sub.take() is not None


def test_smaller_limit_holds_at_once_and_taking_makes_room():
    sub = subscription()
    for _ in range(10):
        deliver(sub, sample(bytes(1000)))
    sub.set_inbox_limit(3000)
    assert sub.statistics().dropped == 8
    assert sub.take_latest() is not None
    assert sub.statistics().dropped == 9
    for _ in range(2):
        deliver(sub, sample(bytes(1000)))
    assert sub.statistics().dropped == 9


@pytest.mark.parametrize("limit", [0, -1, 1.5, "1 MB", None, True])
def test_limit_is_a_number_of_bytes(limit):
    with pytest.raises(ConversionError, match="/t: limit: expected a number of bytes"):
        subscription().set_inbox_limit(limit)


# -- callbacks -----------------------------------------------------------------------------------


@pytest.mark.parametrize("executor", ["immediate", "dispatcher"])
def test_samples_from_many_threads_are_called_back_with_one_at_a_time_each_once(executor):
    chosen = IMMEDIATE if executor == "immediate" else Dispatcher("test")
    seen, running, overlaps = [], [], []

    def callback(got):
        overlaps.extend(running)
        running.append(1)
        seen.append(got.sequence)
        running.pop()

    sub = subscription(executor=chosen, raw_callback=callback)
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        threads = [
            threading.Thread(
                target=lambda start=start: [
                    deliver(sub, sample(sequence=n)) for n in range(start, start + 500)
                ]
            )
            for start in range(0, 2000, 500)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval)
    eventually(lambda: len(seen) == 2000)
    assert sorted(seen) == list(range(2000))
    assert overlaps == []
    assert sub.statistics().dropped == 0
    for start in range(0, 2000, 500):
        own = [n for n in seen if start <= n < start + 500]
        assert own == sorted(own), "each thread's samples stay in order"
    if executor == "dispatcher":
        chosen.close()


def test_immediate_callback_that_publishes_to_itself_gets_what_fits_and_counts_the_rest():
    seen = []

    def callback(got):
        if got.sequence == 0:
            for number in range(1, 6):
                deliver(sub, sample(sequence=number))
        seen.append(got.sequence)

    sub = subscription(QoS(depth=3), raw_callback=callback)
    deliver(sub, sample(sequence=0))
    assert seen == [0, 3, 4, 5]
    assert (sub.statistics().received, sub.statistics().dropped) == (6, 2)


def test_interrupted_immediate_callback_does_not_end_the_subscription():
    calls = []

    def callback(_):
        calls.append(1)
        if len(calls) == 1:
            raise KeyboardInterrupt

    sub = subscription(raw_callback=callback)
    with pytest.raises(KeyboardInterrupt):
        deliver(sub, sample())
    deliver(sub, sample())
    assert len(calls) == 2


# -- waiting -------------------------------------------------------------------------------------


def test_iterating_yields_samples_until_the_subscription_is_closed():
    sub = subscription()

    def feed():
        for number in range(3):
            deliver(sub, sample(sequence=number))
        eventually(lambda: taken[2:])
        sub.close()

    taken = []
    later = threading.Timer(0.02, feed)
    later.start()
    for got in sub:
        taken.append(got.sequence)  # noqa: PERF401 - one by one, as they come
    later.join()
    assert taken == [0, 1, 2]


def test_asynchronous_iteration():
    sub = subscription()

    async def collect():
        taken = []
        async for got in sub:
            taken.append(got.sequence)
            if got.sequence == 2:
                sub.close()
        return taken

    async def run():
        task = asyncio.create_task(collect())
        await asyncio.sleep(0.02)
        for number in range(3):
            threading.Thread(target=deliver, args=(sub, sample(sequence=number))).start()
            await asyncio.sleep(0.01)
        return await asyncio.wait_for(task, 30)

    assert asyncio.run(run()) == [0, 1, 2]


def test_task_that_was_cancelled_leaves_nothing_behind():
    sub = subscription()

    async def collect():
        async for _ in sub:
            pass

    async def run():
        task = asyncio.create_task(collect())
        await asyncio.sleep(0.02)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    asyncio.run(run())
    deliver(sub, sample())  # the loop has ended
    assert sub.take() is not None


def test_several_threads_wait_and_each_sample_goes_to_one_of_them():
    sub = subscription()
    taken = []
    begun = threading.Barrier(5)

    def take():
        begun.wait(30)
        taken.append(sub.wait(30).sequence)

    threads = [threading.Thread(target=take) for _ in range(4)]
    for thread in threads:
        thread.start()
    begun.wait(30)
    for number in range(4):
        deliver(sub, sample(sequence=number))
    for thread in threads:
        thread.join()
    assert sorted(taken) == [0, 1, 2, 3]


@pytest.mark.parametrize("timeout", [-1, "1", float("nan"), True])
def test_timeout_is_a_number_of_seconds(timeout):
    with pytest.raises(ConversionError, match="seconds"):
        subscription().wait(timeout)


def test_waiting_for_ever_ends_with_the_subscription():
    sub = subscription()
    later = threading.Timer(0.02, sub.close)
    later.start()
    assert sub.wait() is None
    later.join()


# -- rates ---------------------------------------------------------------------------------------


def test_rates_hold_for_samples_that_come_some_at_a_time(monkeypatch):
    clock = [100.0]
    monkeypatch.setattr("rosglass.comm.inbox.time.monotonic", lambda: clock[0])
    sub = subscription(QoS(depth=1))
    for _ in range(30):
        clock[0] += 0.1
        for _ in range(100):
            deliver(sub, sample(bytes(10)))
    now = sub.statistics()
    assert now.frequency == pytest.approx(1000, rel=0.01)
    assert now.bandwidth == pytest.approx(10_000, rel=0.01)
    assert now.received == 3000


@pytest.mark.parametrize("rate", [2, 20, 1000])
def test_rates_fall_at_once_when_samples_stop(monkeypatch, rate):
    clock = [100.0]
    monkeypatch.setattr("rosglass.comm.inbox.time.monotonic", lambda: clock[0])
    sub = subscription(QoS(depth=1))
    for _ in range(3 * rate):
        clock[0] += 1 / rate
        deliver(sub, sample(bytes(10)))
    assert sub.statistics().frequency == pytest.approx(rate, rel=0.01)
    clock[0] += max(0.04, 1 / rate)
    assert sub.statistics().frequency > rate / 2, "a slightly late sample is not silence"
    clock[0] += 1.5
    falling = sub.statistics()
    assert 0 < falling.frequency < rate
    assert falling.bandwidth == pytest.approx(10 * falling.frequency)
    clock[0] += 2.4
    stopped = sub.statistics()
    assert (stopped.frequency, stopped.bandwidth) == (0, 0)


def test_rates_are_taken_anew_after_a_silence(monkeypatch):
    clock = [100.0]
    monkeypatch.setattr("rosglass.comm.inbox.time.monotonic", lambda: clock[0])
    sub = subscription(QoS(depth=1))
    for silence in (0, 600):
        clock[0] += silence
        for _ in range(5):
            clock[0] += 0.1
            deliver(sub, sample(bytes(10)))
        assert sub.statistics().frequency == pytest.approx(10)
        assert sub.statistics().bandwidth == pytest.approx(100)

"""Executors whose post() raises: their jobs are not lost, and other listeners are unaffected."""

from __future__ import annotations

import logging
import queue
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext

import pytest
from receiving import deliver, inbox_of
from waiting import eventually

from rosglass import QoS
from rosglass.comm import IMMEDIATE, Clock, Dispatcher, History, Sample, Subscription, Timers
from rosglass.comm.executor import RetryingExecutor
from rosglass.comm.handle import Executor
from rosglass.comm.listeners import Listeners
from rosglass.comm.promise import Promise

LIMIT = 60


class Refusing(Executor):
    """Raises the first `times` times, as a full queue does; runs the others at once."""

    def __init__(self, times):
        self.left = times

    def post(self, job):
        if self.left > 0:
            self.left -= 1
            raise queue.Full
        job()


def sample(number):
    return Sample(b"x", "cdr", None, 1, 1, b"p", number)


def receive(executor, qos):
    """Return a subscription, the numbers of what its callback received, and their semaphore."""
    seen, came = [], threading.Semaphore(0)

    def callback(given):
        seen.append(given.sequence)
        came.release()

    return Subscription("/cmd_vel", None, qos, executor, raw_callback=callback), seen, came


@pytest.mark.parametrize("many", [False, True])
@pytest.mark.parametrize("times", [1, 3])
def test_subscription_continues_and_retries_the_rejected_message(times, many, caplog):
    keep_all = QoS(history=History.KEEP_ALL)
    sub, seen, came = receive(Refusing(times), keep_all)
    if many:
        inbox_of(sub).put_many([sample(1), sample(2)])
    else:
        deliver(sub, sample(1))  # a stop command after which nothing else comes
    assert came.acquire(timeout=LIMIT)
    for number in (3, 4):
        deliver(sub, sample(number))
    for _ in range(2 + many):
        assert came.acquire(timeout=LIMIT)
    assert seen == ([1, 2, 3, 4] if many else [1, 3, 4])
    assert "/cmd_vel: the executor" in caplog.text
    assert "queue.Full" in caplog.text


def test_closed_pool_fills_neither_log_nor_memory(caplog):
    class Pool(Executor):
        def __init__(self):
            self.pool = ThreadPoolExecutor()

        def post(self, job):
            self.pool.submit(job)

    executor = Pool()
    sub, _, _ = receive(executor, QoS(depth=5))
    executor.pool.shutdown()
    for number in range(1000):
        deliver(sub, sample(number))
    assert (inbox_of(sub).waiting, sub.statistics().dropped) == (5, 995)
    assert len([one for one in caplog.records if one.levelno >= logging.ERROR]) == 1
    executor.pool = ThreadPoolExecutor()
    sub.close()


def test_sys_exit_in_a_callback_ends_neither_its_subscription_nor_the_dispatcher(caplog):
    dispatcher, came = Dispatcher("test"), threading.Semaphore(0)

    def callback(given):
        came.release()
        if given.sequence == 1:
            raise SystemExit

    sub = Subscription("/t", None, QoS(), dispatcher, raw_callback=callback)
    for number in (1, 2, 3):
        deliver(sub, sample(number))
        assert came.acquire(timeout=LIMIT)
    dispatcher.close()
    assert "SystemExit" in caplog.text


@pytest.mark.parametrize("immediate", [False, True])
def test_sys_exit_in_a_callback_loses_nothing_that_came_together(immediate, caplog):
    dispatcher, seen, came = Dispatcher("test"), [], threading.Semaphore(0)

    def callback(given):
        seen.append(given.sequence)
        came.release()
        if given.sequence in {1, 3}:
            raise SystemExit

    executor, qos = IMMEDIATE if immediate else dispatcher, QoS(depth=10)
    sub = Subscription("/t", None, qos, executor, raw_callback=callback)
    given = [sample(number) for number in range(1, 6)]
    thread = threading.Thread(target=inbox_of(sub).put_many, args=(given,))
    thread.start()
    for _ in given:
        assert came.acquire(timeout=LIMIT)
    thread.join(LIMIT)
    dispatcher.close()
    assert seen == [1, 2, 3, 4, 5]
    assert "SystemExit" in caplog.text


def test_sys_exit_in_the_main_thread_ends_the_program_but_nothing_halfway(caplog):
    def leave(_):
        raise SystemExit

    class Here(Executor):
        def post(self, job):
            job()

    for executor, leaves in ((Here(), True), (IMMEDIATE, False)):
        sub = Subscription("/t", None, QoS(), executor, raw_callback=leave)
        listeners = Listeners(where="/t")
        listeners.add(leave, executor)
        for give in (lambda sub=sub: deliver(sub, sample(1)), lambda ls=listeners: ls.notify(1)):
            with pytest.raises(SystemExit) if leaves else nullcontext():
                give()
    assert len(caplog.records) == 2


@pytest.mark.parametrize("kind", ["refuses", "exits"])
def test_one_timer_that_fails_stops_neither_itself_nor_the_others(kind, caplog):
    timers = Timers("tester")
    clock = Clock("tester", IMMEDIATE, timers)
    calls = {"good": threading.Semaphore(0), "bad": threading.Semaphore(0)}

    def bad():
        calls["bad"].release()
        if kind == "exits":
            raise SystemExit

    clock.create_timer(0.01, bad, Refusing(3) if kind == "refuses" else IMMEDIATE)
    clock.create_timer(0.01, calls["good"].release)
    for _ in range(10):
        assert calls["good"].acquire(timeout=LIMIT)
        assert calls["bad"].acquire(timeout=LIMIT)
    clock.close()
    timers.close()
    assert "Timer every 0.01 s" in caplog.text


@pytest.mark.parametrize("merge", [False, True])
def test_every_listener_is_notified_although_one_executor_raises(merge, caplog):
    listeners, seen, other, came = Listeners(merge=merge, where="/t"), [], [], threading.Event()

    def last(value):
        seen.append(value)
        if value == "lost":
            came.set()

    listeners.add(last, Refusing(2))
    listeners.add(other.append, IMMEDIATE)
    for value in ("connecting", "connected", "lost"):
        listeners.notify(value)
    assert other == ["connecting", "connected", "lost"]
    assert came.wait(LIMIT)
    assert seen == (["lost"] if merge else ["connecting", "connected", "lost"])
    assert "/t: the executor" in caplog.text


def test_listener_whose_callback_fails_is_called_once(caplog):
    class Bare(Executor):
        def post(self, job):
            job()

    listeners, calls = Listeners(), []

    def fail(value):
        calls.append(value)
        raise ValueError("mine")

    listeners.add(fail, Bare())
    listeners.notify(1)
    listeners.notify(2)
    assert calls == [1, 2]
    assert "mine" in caplog.text


def test_promise_calls_back_although_its_executor_raised_at_first():
    promise, came = Promise(cancellable=True), threading.Event()
    promise.on_done(lambda _: came.set(), Refusing(2))
    promise.set_result(1)
    assert came.wait(LIMIT)


def test_jobs_that_were_refused_keep_their_order_and_are_forgotten_at_the_end():
    seen, came = [], threading.Event()
    executor = RetryingExecutor(Refusing(4), "test")
    for number in range(5):
        executor.post(lambda number=number: seen.append(number))
    executor.post(came.set)
    assert came.wait(LIMIT)
    assert seen == [0, 1, 2, 3, 4]
    never = Refusing(10**9)
    executor = RetryingExecutor(never, "test")
    executor.post(seen.clear)
    executor.close()
    asked = threading.Event()  # behind it, on the same thread
    other = RetryingExecutor(Refusing(6), "test")
    other.post(asked.set)
    assert asked.wait(LIMIT)
    assert 10**9 - never.left <= 2
    assert seen


def test_job_without_owner_is_given_up_and_counted(caplog):
    executor = RetryingExecutor(Refusing(10**9), "on_done() of a call", give_up_s=0.1)
    executor.post(lambda: None)
    executor.post(lambda: None)
    eventually(lambda: "2 callbacks are dropped" in caplog.text, timeout=LIMIT)
    assert "on_done() of a call" in caplog.text

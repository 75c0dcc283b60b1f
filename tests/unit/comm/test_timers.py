"""Jobs that run after a while."""

from __future__ import annotations

import gc
import queue
import sys
import threading
import weakref

import pytest

from rosglass.comm import Duration, Timers, Worker
from rosglass.comm.timers import Watchdog


@pytest.fixture
def timers():
    made = Timers("timers of the test")
    yield made
    made.close()


def threads():
    return [thread for thread in threading.enumerate() if thread.name == "timers of the test"]


def test_jobs_run_in_order_of_time_on_one_thread(timers):
    done = queue.Queue()
    for delay in (0.6, 0.2, 0.4, 0.0):
        timers.after(delay, lambda d=delay: done.put((d, threading.current_thread().name)))
    assert [done.get(timeout=30) for _ in range(4)] == [
        (delay, "timers of the test") for delay in (0.0, 0.2, 0.4, 0.6)
    ]


def test_cancelled_job_does_not_run(timers):
    done = queue.Queue()

    def begin():  # both jobs are due at once, but their thread is busy here
        handle = timers.after(0, lambda: done.put("called off"))
        timers.after(0, lambda: done.put("kept"))
        handle.close()
        handle.close()

    timers.after(0, begin)
    assert done.get(timeout=30) == "kept"
    assert done.empty()


def test_job_that_fails_is_logged_and_the_others_run(timers, caplog):
    done = threading.Event()

    def fail():
        raise ValueError("broken")

    timers.after(0, fail)
    timers.after(0.01, done.set)
    assert done.wait(30)
    assert "timers of the test: a job failed" in caplog.text


def test_jobs_called_off_take_no_memory(timers):
    kept = timers.after(60, print)
    ended = []
    for _ in range(1000):
        job = timers.after(60, print)
        ended.append(weakref.ref(job))
        job.close()
    gc.collect()
    assert sum(job() is not None for job in ended) < 100
    kept.close()


def test_closing_forgets_jobs_and_may_be_done_by_one(timers):
    ended, done = threading.Event(), threading.Event()

    def close():
        timers.after(0, done.set)  # due, but this thread is busy with closing
        timers.close()
        ended.set()

    timers.after(0, close)
    assert ended.wait(30)
    timers.close()
    assert not threads()
    timers.after(0, done.set)
    assert not done.wait(0.1)


def test_without_jobs_there_is_no_thread(timers):
    assert not threads()
    timers.after(60, print)
    assert threads()


def test_job_that_calls_exit_ends_no_other(timers):
    done = threading.Event()
    timers.after(0, lambda: sys.exit(1))
    timers.after(0, done.set)
    assert done.wait(30)


def test_watchdog_closed_during_its_check_does_not_check_again(timers):
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    missed = []
    try:
        for _ in range(500):
            dog = Watchdog(timers, Duration.from_seconds(1e-5), lambda: 0.0, missed.append)
            dog.close()
            dog.close()
    finally:
        sys.setswitchinterval(interval)
    looks = weakref.ref(dog)
    del dog
    done = queue.Queue()
    timers.after(0.0, lambda: done.put(len(missed)))
    count = done.get(timeout=30)  # no look is under way any more
    timers.after(0.05, lambda: done.put(len(missed)))
    assert done.get(timeout=30) == count
    gc.collect()
    assert looks() is None


def test_worker_that_is_woken_all_the_time_keeps_its_regular_run(eventually):
    runs = []
    worker = Worker("worker of the test", runs.append, pause=0.2)
    stop = threading.Event()

    def keep_waking():
        while not stop.wait(0.001):
            worker.wake()

    waking = threading.Thread(target=keep_waking)
    waking.start()
    try:
        eventually(lambda: True in runs)
    finally:
        stop.set()
        waking.join()
        worker.close()

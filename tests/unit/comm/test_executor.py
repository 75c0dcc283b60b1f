from __future__ import annotations

import logging
import math
import threading
import time
from types import SimpleNamespace

import pytest
from waiting import eventually, nothing_happens

from rosglass.comm import IMMEDIATE, Dispatcher, Listeners, Worker
from rosglass.comm.handle import guarded, undo_on_error


@pytest.fixture
def dispatcher():
    made = Dispatcher("test callbacks")
    yield made
    made.close()


def run_all(dispatcher):
    done = threading.Event()
    dispatcher.post(done.set)
    assert done.wait(30)


def test_jobs_run_in_order_on_one_other_thread(dispatcher):
    seen = []
    for number in range(100):
        dispatcher.post(lambda n=number: seen.append((n, threading.current_thread().name)))
    run_all(dispatcher)
    assert seen == [(n, "test callbacks") for n in range(100)]


@pytest.mark.parametrize("kind", ["dispatcher", "immediate"])
def test_failing_job_is_logged_and_the_next_one_runs(kind, dispatcher, caplog):
    executor = dispatcher if kind == "dispatcher" else IMMEDIATE
    executor.post(lambda: 1 / 0)
    seen = []
    executor.post(lambda: seen.append(1))
    run_all(dispatcher)
    assert seen == [1]
    assert "ZeroDivisionError" in caplog.text


@pytest.mark.parametrize("error", [SystemExit, KeyboardInterrupt, GeneratorExit, ValueError])
def test_no_error_ends_a_thread_that_others_need(error, dispatcher, caplog):
    def fail():
        raise error("of a job")

    def fail_guarded():
        with guarded(logging.getLogger("rosglass"), "%s has failed", "a guarded job"):
            fail()
        seen.append("after it")

    seen = []
    dispatcher.post(fail)
    dispatcher.post(fail_guarded)
    run_all(dispatcher)
    assert seen == ["after it"]
    assert caplog.text.count(f"{error.__name__}: of a job") == 2
    assert "a guarded job has failed" in caplog.text


@pytest.mark.parametrize("error", [SystemExit, KeyboardInterrupt])
def test_main_thread_can_be_ended_from_guarded_code(error):
    with pytest.raises(error), guarded(logging.getLogger("rosglass"), "a job failed"):
        raise error


def test_any_error_undoes_what_was_begun_and_is_raised_again():
    undone = []
    with undo_on_error(lambda: undone.append("not this")):
        pass
    with pytest.raises(KeyboardInterrupt), undo_on_error(lambda: undone.append("this")):
        raise KeyboardInterrupt
    assert undone == ["this"]


def test_closing_ends_the_thread_and_forgets_what_waits(dispatcher):
    started, go_on, seen = threading.Event(), threading.Event(), []
    dispatcher.post(lambda: (started.set(), go_on.wait(30)))
    dispatcher.post(lambda: seen.append("forgotten"))
    assert started.wait(30)
    closing = threading.Thread(target=dispatcher.close)
    closing.start()
    go_on.set()
    closing.join(5)
    assert not closing.is_alive()
    dispatcher.close()
    dispatcher.post(lambda: seen.append("late"))
    assert seen == []
    assert "test callbacks" not in [t.name for t in threading.enumerate()]


def test_job_may_close_its_dispatcher(dispatcher):
    closed = threading.Event()
    dispatcher.post(lambda: (dispatcher.close(), closed.set()))
    assert closed.wait(30)


def test_job_that_hangs_does_not_hang_closing(dispatcher, monkeypatch, caplog):
    monkeypatch.setattr("rosglass.comm.executor._CLOSE_TIMEOUT_S", 0.05)
    started, go_on = threading.Event(), threading.Event()
    dispatcher.post(lambda: (started.set(), go_on.wait(30)))
    assert started.wait(30)
    dispatcher.close()
    assert "still runs" in caplog.text
    go_on.set()


def test_listeners_get_every_value_until_they_close():
    listeners = Listeners()
    seen = []
    handle = listeners.add(seen.append, IMMEDIATE)
    listeners.notify(1)
    listeners.notify(2)
    handle.close()
    handle.close()
    listeners.notify(3)
    assert seen == [1, 2]


def test_merging_listeners_get_the_newest_value_once(dispatcher):
    listeners = Listeners(merge=True)
    go_on, seen = threading.Event(), []
    dispatcher.post(lambda: go_on.wait(30))
    listeners.add(seen.append, dispatcher)
    for value in range(10):
        listeners.notify(value)
    go_on.set()
    run_all(dispatcher)
    assert seen == [9]


def test_listener_closed_while_its_call_waits_is_not_called(dispatcher):
    listeners = Listeners()
    go_on, seen = threading.Event(), []
    dispatcher.post(lambda: go_on.wait(30))
    handle = listeners.add(seen.append, dispatcher)
    listeners.notify(1)
    handle.close()
    go_on.set()
    run_all(dispatcher)
    assert seen == []


def test_worker_runs_when_asked_and_when_its_pause_is_over(caplog):
    ran, idle = threading.Event(), threading.Event()
    worker = Worker("test worker", lambda paused: (idle if paused else ran).set(), pause=0.01)
    # A wake-up that comes when the regular run is due is merged into that.
    eventually(lambda: worker.wake() or ran.is_set())
    assert idle.wait(30)
    worker.close()
    worker.close()
    assert "test worker" not in [t.name for t in threading.enumerate()]


def test_worker_survives_an_error_in_its_job(caplog):
    calls = []
    twice = threading.Event()

    def job(_):
        calls.append(1)
        if len(calls) == 2:
            twice.set()
        raise RuntimeError("of the job")

    worker = Worker("test worker", job, pause=0.01)
    assert twice.wait(30)
    worker.close()
    assert "of the job" in caplog.text


def test_worker_that_hangs_does_not_hang_closing(monkeypatch, caplog):
    monkeypatch.setattr("rosglass.comm.timers._CLOSE_TIMEOUT_S", 0.05)
    started, go_on = threading.Event(), threading.Event()
    worker = Worker("test worker", lambda _: (started.set(), go_on.wait(30)), pause=10)
    worker.wake()
    assert started.wait(30)
    worker.close()
    assert "test worker still runs" in caplog.text
    go_on.set()


def test_busy_dispatcher_takes_several_jobs_at_a_time(dispatcher, monkeypatch):
    done, pauses = [], []

    def pause(seconds):
        number = len(pauses)
        pauses.append(seconds)
        if number < 3:
            for job in range(5):
                dispatcher.post(lambda job=job: done.append((number, job)))
        else:
            dispatcher.post(ended.set)

    ended = threading.Event()
    monkeypatch.setattr("rosglass.comm.executor._BUSY_HZ", 0.0)
    monkeypatch.setattr("rosglass.comm.executor._RATE_JOBS", 1)
    monkeypatch.setattr(
        "rosglass.comm.executor.time", SimpleNamespace(sleep=pause, monotonic=time.monotonic)
    )
    dispatcher.post(lambda: None)
    assert ended.wait(30)
    assert done == [(number, job) for number in range(3) for job in range(5)]


def test_worker_rests_after_a_run_and_still_ends_at_once(monkeypatch):
    monkeypatch.setattr("rosglass.comm.timers._REST_FACTOR", math.inf)
    monkeypatch.setattr("rosglass.comm.timers._MAX_REST_S", 3600.0)
    runs, ran = [], threading.Event()

    def run(regular):
        runs.append(regular)
        ran.set()

    worker = Worker("worker that ends", run, 3600.0)
    worker.wake()
    assert ran.wait(30)
    for _ in range(3):
        worker.wake()
        nothing_happens(0.05)
    worker.close()
    assert runs == [False]
    assert "worker that ends" not in {thread.name for thread in threading.enumerate()}

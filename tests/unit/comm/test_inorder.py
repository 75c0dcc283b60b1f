"""Jobs in order, without a thread for them."""

from __future__ import annotations

import threading

import pytest

from rosglass.comm.executor import InOrder


def test_jobs_run_one_at_a_time_in_order():
    jobs, done, busy = InOrder(), {}, []

    def add(thread):
        for number in range(200):

            def job(number=number):
                assert not busy
                busy.append(thread)
                done.setdefault(thread, []).append(number)
                busy.pop()

            jobs.add(job)

    threads = [threading.Thread(target=add, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert done == {number: list(range(200)) for number in range(4)}


def test_job_may_add_jobs_which_run_after_it():
    jobs, done = InOrder(), []

    def outer():
        jobs.add(lambda: done.append("inner"))
        done.append("outer")

    jobs.add(outer)
    assert done == ["outer", "inner"]


def test_job_that_fails_is_logged_and_an_interrupted_one_stops_nothing(caplog):
    jobs, done = InOrder(), []

    def fail():
        raise ValueError("broken")

    def interrupt():
        jobs.add(lambda: done.append("left"))
        raise KeyboardInterrupt

    jobs.add(fail)
    assert "ValueError: broken" in caplog.text
    with pytest.raises(KeyboardInterrupt):
        jobs.add(interrupt)
    jobs.add(lambda: done.append("next"))
    assert done == ["left", "next"]

"""Promises: results that arrive later."""

from __future__ import annotations

import asyncio
import concurrent.futures
import subprocess
import sys
import threading

import pytest

import rosglass
from rosglass import QoS, UnsupportedError
from rosglass.comm import IMMEDIATE, Dispatcher, Promise, Subscription


@pytest.fixture(params=[True, False], ids=["cancellable", "not cancellable"])
def promise(request):
    return Promise("the tea is not ready", cancellable=request.param)


def test_it_comes_once(promise):
    promise.set_result(1)
    promise.set_result(2)
    promise.set_exception(ValueError())
    assert promise.result() == promise.result(0) == 1
    assert promise.exception() is None
    assert not promise.cancel()


def test_error_in_place_of_a_result(promise):
    promise.set_exception(rosglass.TimeoutError("its own"))
    with pytest.raises(rosglass.TimeoutError, match="its own"):
        promise.result(1)
    assert str(promise.exception(1)) == "its own"


def test_waiting_ends_and_the_promise_stands(promise):
    with pytest.raises(rosglass.TimeoutError, match=r"the tea is not ready within 0\.01 s"):
        promise.result(0.01)
    threading.Timer(0.3, promise.set_result, [3]).start()
    assert promise.result() == 3


@pytest.mark.parametrize("timeout", [-1, "x", True, float("nan"), []])
def test_odd_timeouts_are_refused(promise, timeout):
    with pytest.raises(rosglass.ConversionError, match="seconds, at least 0, or None for no limit"):
        promise.result(timeout)


def test_giving_up():
    promise = Promise(cancellable=True)
    done = []
    promise.on_done(done.append)
    assert promise.cancel()
    assert promise.cancel()
    promise.set_result(1)
    assert done == [promise]
    assert concurrent.futures.wait([promise], 0).done == {promise}
    with pytest.raises(concurrent.futures.CancelledError):
        promise.result()


def test_promise_that_cannot_be_cancelled_survives_a_timeout():
    promise = Promise(cancellable=False)

    async def main():
        with pytest.raises((asyncio.TimeoutError, TimeoutError)):
            await asyncio.wait_for(promise, 0.01)
        threading.Timer(0.01, promise.set_result, [1]).start()
        return await promise

    assert asyncio.run(main()) == 1


def test_callbacks_run_where_they_should():
    home, elsewhere = Dispatcher("home"), Dispatcher("elsewhere")
    promise = Promise(executor=home, cancellable=False)
    results = concurrent.futures.Future(), concurrent.futures.Future(), []
    promise.on_done(lambda _: results[0].set_result(threading.current_thread().name))
    promise.on_done(lambda _: results[1].set_result(threading.current_thread().name), elsewhere)
    promise.on_done(results[2].append, IMMEDIATE)
    promise.set_result(None)
    assert results[2] == [promise]
    assert [future.result(30) for future in results[:2]] == ["home", "elsewhere"]
    late = concurrent.futures.Future()
    promise.on_done(late.set_result)
    assert late.result(30) is promise
    home.close()
    elsewhere.close()


def test_asyncio_is_imported_only_on_use():
    code = "import rosglass.ros2, sys; print('asyncio' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_receiving_thread_may_poll_but_not_wait(monkeypatch):
    """Its result could never arrive."""
    monkeypatch.setattr("rosglass.comm.handle._RECEIVING", (__name__,))
    results = []

    def receive():
        promise = Promise("/add has not answered", cancellable=True)
        subscription = Subscription("/chatter", None, QoS(), IMMEDIATE)
        for wait in (promise.result, promise.exception, subscription.wait):
            with pytest.raises(UnsupportedError) as refused:
                wait()
            results.append(str(refused.value))
        with pytest.raises(TimeoutError):
            promise.result(0)
        assert subscription.wait(0) is None
        promise.set_result(3)
        results.append(promise.result())

    thread = threading.Thread(target=receive, daemon=True)
    thread.start()
    thread.join(5)
    waiting = ["/add has not answered", "/add has not answered", "/chatter"]
    assert [text.partition(":")[0] for text in results[:3]] == waiting
    assert results[3:] == [3]

"""The clock of a node: system and simulated time, sleeping, jumps, timers."""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING

import pytest
from waiting import eventually

from rosglass.comm import (
    IMMEDIATE,
    Clock,
    ClockChange,
    Dispatcher,
    Duration,
    Jump,
    Time,
    Timers,
)
from rosglass.errors import ConversionError, NodeClosedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@pytest.fixture
def timers() -> Iterator[Timers]:
    made = Timers("tester")
    yield made
    made.close()


@pytest.fixture
def clock(timers: Timers) -> Iterator[Clock]:
    made = Clock("tester", IMMEDIATE, timers)
    yield made
    made.close()


@pytest.fixture
def settle(timers: Timers) -> Callable[[], None]:
    """Wait until the timers' thread has done what is due."""

    def settle() -> None:
        done = threading.Event()
        timers.after(0, done.set)
        assert done.wait(30)

    return settle


def seconds(value: float) -> Time:
    return Time(round(value * 1e9))


def test_system_time_is_the_default(clock: Clock) -> None:
    assert not clock.is_simulated
    assert abs(clock.now().nanoseconds - time.time_ns()) < 1e9
    clock.advance(seconds(5))
    assert clock.now().seconds > 1e9


def test_simulated_time_is_zero_until_it_is_set(clock: Clock) -> None:
    clock.simulate(True)
    assert clock.is_simulated
    assert clock.now() == Time(0)
    clock.advance(seconds(12.5))
    assert clock.now() == seconds(12.5)
    clock.simulate(False)
    assert abs(clock.now().nanoseconds - time.time_ns()) < 1e9


def test_sleeping_takes_as_long_as_asked(clock: Clock) -> None:
    start = time.monotonic()
    assert clock.sleep(0.05)
    assert clock.sleep_until(Time.now() + Duration.from_seconds(0.05))
    assert 0.09 < time.monotonic() - start < 20
    assert clock.sleep(-1)


def in_background(job: object) -> tuple[threading.Thread, list[object]]:
    results: list[object] = []

    def run() -> None:
        try:
            results.append(job())  # type: ignore[operator]
        except NodeClosedError as error:
            results.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    time.sleep(0.05)
    return thread, results


def test_sleeping_while_simulated_time_stands_still_is_logged_once(clock: Clock, caplog) -> None:
    clock.simulate(True)
    clock.advance(seconds(10))
    thread, results = in_background(lambda: clock.sleep(2.0))
    eventually(lambda: caplog.messages)
    (message,) = caplog.messages
    assert (
        message == "tester sleeps by simulated time, which stands at 10.000 s: is /clock published?"
    )
    clock.advance(seconds(12))
    thread.join(10)
    assert results == [True]


def test_handlers_of_the_log_may_use_the_clock_that_stands_still(clock: Clock) -> None:
    class Handler(logging.Handler):
        def emit(self, _: logging.LogRecord) -> None:
            made = threading.Thread(target=lambda: clock.create_timer(1.0, print), daemon=True)
            made.start()
            made.join(10)
            results.append(not made.is_alive())

    results: list[bool] = []
    handler, log = Handler(), logging.getLogger("rosglass.comm")
    clock.simulate(True)
    log.addHandler(handler)
    try:
        thread, _ = in_background(lambda: clock.sleep(2.0))
        eventually(lambda: results)
    finally:
        log.removeHandler(handler)
    clock.advance(seconds(12))
    thread.join(10)
    assert results == [True]


def test_sleeping_in_simulated_time_waits_for_the_simulation(clock: Clock) -> None:
    clock.simulate(True)
    clock.advance(seconds(10))
    thread, results = in_background(lambda: clock.sleep(2.0))
    clock.advance(seconds(11.9))
    clock.advance(seconds(3))  # set back: the end stays where it was
    thread.join(0.05)
    assert not results
    clock.advance(seconds(12))
    thread.join(5)
    assert results == [True]


def test_sleeper_wakes_when_the_clock_changes_or_closes(clock: Clock) -> None:
    thread, results = in_background(lambda: clock.sleep(100))
    clock.simulate(True)
    thread.join(5)
    assert results == [False]
    thread, results = in_background(lambda: clock.sleep_until(seconds(100)))
    clock.close()
    thread.join(5)
    assert isinstance(results[0], NodeClosedError)
    assert "tester" in str(results[0])


def test_jumps_are_notified(clock: Clock) -> None:
    jumps: list[Jump] = []
    ahead: list[Jump] = []
    handle = clock.on_jump(jumps.append)
    clock.on_jump(ahead.append, forward=Duration.from_seconds(5))
    clock.simulate(True)
    clock.advance(seconds(10))
    clock.advance(seconds(11))
    clock.advance(seconds(4))
    assert [jump.change for jump in jumps] == [ClockChange.TO_SIMULATED, ClockChange.NONE]
    assert jumps[1].delta == Duration.from_seconds(-7)
    assert [jump.delta.seconds for jump in ahead[1:]] == [10, -7]
    handle.close()
    handle.close()
    clock.simulate(False)
    assert len(jumps) == 2
    assert ahead[-1].change is ClockChange.TO_SYSTEM
    assert ahead[-1].delta > Duration()


def test_timer_calls_back_at_its_rate(clock: Clock) -> None:
    calls: list[float] = []
    begun = time.monotonic()
    timer = clock.create_timer(0.02, lambda: calls.append(time.monotonic()))
    eventually(lambda: len(calls) >= 5)
    timer.close()
    timer.close()
    # A call that was late does not delay the following ones.
    assert 0.09 < calls[4] - begun < 30
    count, turns = len(calls), []
    clock.create_timer(0.02, lambda: turns.append(1))
    eventually(lambda: len(turns) >= 3)
    assert len(calls) <= count + 1


def test_timer_follows_simulated_time(clock: Clock, settle: Callable[[], None]) -> None:
    clock.simulate(True)
    clock.advance(seconds(100))
    calls: list[Time] = []
    clock.create_timer(Duration.from_seconds(1), lambda: calls.append(clock.now()))
    settle()
    assert not calls
    clock.advance(seconds(101))
    eventually(lambda: len(calls) == 1)
    clock.advance(seconds(105.5))  # turns that were missed are not made up for
    eventually(lambda: len(calls) == 2)
    clock.advance(seconds(1))  # set back: the period counts from here
    clock.advance(seconds(1.9))
    settle()
    assert len(calls) == 2
    clock.advance(seconds(2))
    eventually(lambda: len(calls) == 3)


def test_slow_callback_misses_turns_instead_of_piling_up(clock: Clock) -> None:
    dispatcher = Dispatcher("slow")
    release, calls, turns = threading.Event(), [], []

    def slow() -> None:
        calls.append(1)
        release.wait(30)

    timer = clock.create_timer(0.005, slow, dispatcher)
    clock.create_timer(0.005, lambda: turns.append(1))
    eventually(lambda: len(turns) >= 10)
    timer.close()
    release.set()
    done = threading.Event()
    dispatcher.post(done.set)
    assert done.wait(30)
    dispatcher.close()
    assert len(calls) == 1


def test_failing_callback_does_not_end_its_timer(
    clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    calls: list[int] = []

    def fail() -> None:
        calls.append(1)
        raise RuntimeError("oops")

    with clock.create_timer(0.005, fail):
        eventually(lambda: len(calls) >= 3)
    assert "Timer every 0.005 s" in caplog.text
    assert len(caplog.records) == 1, "a fast timer must not fill the log"
    assert "oops" in caplog.text


@pytest.mark.parametrize(
    ("period", "message"),
    [
        (0, "above zero"),
        (-1.0, "above zero"),
        ("1", "seconds"),
        (True, "seconds"),
        (1e12, "seconds"),
    ],
)
def test_bad_periods_are_refused(clock: Clock, period: object, message: str) -> None:
    with pytest.raises(ConversionError, match=message):
        clock.create_timer(period, lambda: None)  # type: ignore[arg-type]


def test_other_bad_arguments_are_refused(clock: Clock) -> None:
    with pytest.raises(ConversionError, match="callback"):
        clock.create_timer(1.0, None)  # type: ignore[arg-type]
    with pytest.raises(ConversionError, match="callback"):
        clock.on_jump(None)  # type: ignore[arg-type]
    with pytest.raises(ConversionError, match="duration"):
        clock.sleep(float("nan"))
    with pytest.raises(ConversionError, match="when"):
        clock.sleep_until(5)  # type: ignore[arg-type]


def test_closing_ends_timers() -> None:
    timers, calls = Timers("closed"), threading.Semaphore(0)
    clock = Clock("closed", IMMEDIATE, timers)
    clock.create_timer(0.02, calls.release)
    assert calls.acquire(timeout=30)
    clock.close()
    clock.close()
    done = threading.Event()
    timers.after(0.1, done.set)
    calls.acquire(blocking=False)  # one may have been under way
    assert done.wait(30)
    assert not calls.acquire(blocking=False)
    timers.close()
    with pytest.raises(NodeClosedError):
        clock.create_timer(1, lambda: None)
    with pytest.raises(NodeClosedError):
        clock.sleep(1)

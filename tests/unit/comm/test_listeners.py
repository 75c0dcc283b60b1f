"""Callbacks that are notified of a value."""

from __future__ import annotations

import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from executors import Manual

import rosglass
from rosglass.comm import (
    IMMEDIATE,
    EndpointInfo,
    EndpointKind,
    Listeners,
    Matched,
    NodeName,
)
from rosglass.comm.events import EndpointListeners
from rosglass.comm.listeners import ChangeListeners
from rosglass.comm.log_limits import LogOnce


@pytest.mark.parametrize(
    ("options", "expected"),
    [({}, [1, 2, 3, 4]), ({"merge": True}, [4]), ({"depth": 3}, [2, 3, 4]), ({"depth": 9}, None)],
)
def test_how_many_values_wait_for_a_slow_callback(options, expected):
    listeners, executor, seen = Listeners(**options), Manual(), []
    listeners.add(seen.append, executor)
    expected = expected or [1, 2, 3, 4]
    kept = [listeners.notify(value) for value in (1, 2, 3, 4)]
    assert kept.count(True) == len(expected)
    executor.run()
    assert seen == expected
    assert listeners.notify(5)
    executor.run()
    assert seen == [*expected, 5]


async def later(value):
    raise AssertionError(value)


@pytest.mark.parametrize(
    ("callback", "executor", "parameter"),
    [(5, Manual(), "callback"), (later, Manual(), "callback"), (print, 5, "executor")],
)
def test_invalid_callback_is_refused_with_the_topic(callback, executor, parameter):
    listeners = Listeners(where="/scan")
    with pytest.raises(rosglass.ConversionError, match=f"/scan: {parameter}: "):
        listeners.add(callback, executor)
    assert not listeners


def test_closed_and_cleared_listeners_are_not_notified():
    listeners, executor, seen = Listeners(), Manual(), []
    first = listeners.add(lambda value: seen.append(("first", value)), executor)
    listeners.add(lambda value: seen.append(("second", value)), executor)
    listeners.notify(1)
    first.close()
    executor.run()
    assert seen == [("second", 1)]
    listeners.notify(2)
    listeners.clear()
    executor.run()
    assert seen == [("second", 1)]


@pytest.fixture
def hasty_threads():
    """Let threads take turns as often as Python can."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval)


@pytest.mark.usefixtures("hasty_threads")
def test_listeners_may_be_added_and_closed_in_several_threads_during_notification():
    listeners, seen, rounds = Listeners(), [], 300
    listeners.add(seen.append, IMMEDIATE)
    failures = []

    def come_and_go():
        try:
            for _ in range(rounds):
                with listeners.add(str, IMMEDIATE):
                    listeners.notify(-1)
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=come_and_go) for _ in range(4)]
    for thread in threads:
        thread.start()
    for value in range(rounds):
        assert listeners.notify(value)
    for thread in threads:
        thread.join()
    assert not failures
    assert sorted(seen) == [-1] * 4 * rounds + list(range(rounds))
    listeners.clear()
    assert not listeners


def in_threads(job, count=4):
    """Run `job` in several threads, each with its number; return what each returned."""
    with ThreadPoolExecutor(count) as pool:
        return [future.result() for future in [pool.submit(job, n) for n in range(count)]]


@pytest.mark.usefixtures("hasty_threads")
def test_new_endpoint_is_notified_to_listeners_added_in_several_threads():
    appearances, rounds = EndpointListeners(), 200
    there = EndpointInfo(EndpointKind.PUBLISHER, "/t", "p/msg/T", NodeName("/", "a"), gid=b"there")
    stayed, over = [], threading.Event()

    def come_and_go(_):
        for _ in range(rounds):
            appearances.add(str, IMMEDIATE).close()
        appearances.add(lambda event: stayed.append((event.count, event.total)), IMMEDIATE)

    def look():
        while not over.is_set():
            appearances.update([there], Matched)

    looking = threading.Thread(target=look)
    looking.start()
    try:
        in_threads(come_and_go)
    finally:
        over.set()
        looking.join()
    appearances.update([there], Matched)
    assert stayed == [(1, 1)] * 4
    appearances.clear()
    assert not appearances


@pytest.mark.usefixtures("hasty_threads")
def test_log_once_is_true_in_one_thread_only():
    log_once, rounds = LogOnce(1000), 300
    firsts = in_threads(lambda _: [log_once.is_first(about) for about in range(rounds)])
    assert [sum(made) for made in zip(*firsts, strict=True)] == [1] * rounds
    few = LogOnce(2)
    assert [few.is_first(about) for about in "aabca"] == [True, False, True, False, False]


def test_value_that_was_read_is_notified_when_it_changes_back():
    value, seen = [False], []
    listeners = ChangeListeners(lambda: value[0], False)
    listeners.add(seen.append, IMMEDIATE)
    value[0] = True
    assert listeners.read()
    value[0] = False
    assert listeners.update()
    assert seen == [False]
    assert not listeners.update()


def test_value_that_was_read_and_notified_is_notified_once():
    value, seen = [False], []
    listeners = ChangeListeners(lambda: value[0], False)
    listeners.add(seen.append, IMMEDIATE)
    for new in (False, True, True, False):
        value[0] = new
        listeners.read()
        listeners.update()
        listeners.update()
    assert seen == [True, False]

"""Callbacks that are told about a value."""

from __future__ import annotations

import sys
import threading

import pytest
from executors import Manual

import rosglass
from rosglass.comm import IMMEDIATE, Listeners
from rosglass.comm.listeners import ChangeListeners


@pytest.mark.parametrize(
    ("options", "told"),
    [({}, [1, 2, 3, 4]), ({"merge": True}, [4]), ({"depth": 3}, [2, 3, 4]), ({"depth": 9}, None)],
)
def test_how_many_values_wait_for_a_slow_callback(options, told):
    listeners, executor, seen = Listeners(**options), Manual(), []
    listeners.add(seen.append, executor)
    told = told or [1, 2, 3, 4]
    kept = [listeners.notify(value) for value in (1, 2, 3, 4)]
    assert kept.count(True) == len(told)
    executor.run()
    assert seen == told
    assert listeners.notify(5)
    executor.run()
    assert seen == [*told, 5]


async def later(value):
    raise AssertionError(value)


@pytest.mark.parametrize(
    ("callback", "executor", "told"),
    [(5, Manual(), "callback"), (later, Manual(), "callback"), (print, 5, "executor")],
)
def test_what_cannot_be_called_is_refused_and_the_place_named(callback, executor, told):
    listeners = Listeners(where="/scan")
    with pytest.raises(rosglass.ConversionError, match=f"/scan: {told}: "):
        listeners.add(callback, executor)
    assert not listeners


def test_closed_and_cleared_listeners_are_not_told():
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
def test_listeners_come_and_go_in_several_threads_while_values_are_told():
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


def test_who_read_a_value_is_told_that_it_changed_back_before_anyone_looked():
    value, seen = [False], []
    listeners = ChangeListeners(lambda: value[0], False)
    listeners.add(seen.append, IMMEDIATE)
    value[0] = True
    assert listeners.read()
    value[0] = False
    assert listeners.update()
    assert seen == [False]
    assert not listeners.update()


def test_a_value_that_was_read_and_told_is_told_once():
    value, seen = [False], []
    listeners = ChangeListeners(lambda: value[0], False)
    listeners.add(seen.append, IMMEDIATE)
    for new in (False, True, True, False):
        value[0] = new
        listeners.read()
        listeners.update()
        listeners.update()
    assert seen == [True, False]

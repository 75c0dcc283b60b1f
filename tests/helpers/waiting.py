"""Waiting in tests and their peers: for what must come, and for what must not."""

from __future__ import annotations

import inspect
import itertools
import reprlib
import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_POLL_S = 0.005
_short = reprlib.Repr()
_short.maxstring = _short.maxother = 2000
_short.maxlist = _short.maxtuple = _short.maxdict = 20


def _sleep() -> None:
    time.sleep(_POLL_S)


def eventually(
    condition: Callable[[], Any],
    what: Callable[[], object] | object = "",
    *,
    timeout: float = 30.0,
    turn: Callable[[], object] = _sleep,
) -> Any:
    """Return the first true value of a condition.

    Args:
        condition: Called until it returns something true.
        what: What to say if it does not, or a function that returns it. The condition's source,
            its last value and the variables that it uses are said anyway.
        timeout: For how long, in seconds.
        turn: What lets time pass between two calls, e.g. a turn of Qt's event loop.

    Raises:
        AssertionError: The condition did not become true in time.
    """
    deadline = time.monotonic() + timeout
    while not (value := condition()):
        if time.monotonic() > deadline:
            said = what() if callable(what) else what
            raise AssertionError(f"not within {timeout:g} s: {_describe(condition, value, said)}")
        turn()
    return value


def at_rate(period: float, count: int | None = None) -> Iterator[int]:
    """Yield 0, 1, 2 and so on, with a pause after each.

    Args:
        period: The pause, in seconds.
        count: How many times; None for as long as the caller takes more.
    """
    for number in itertools.count() if count is None else range(count):
        yield number
        time.sleep(period)


def nothing_happens(seconds: float, *, turn: Callable[[], object] = _sleep) -> None:
    """Let time pass in which something would happen that must not.

    For what no later event can show: where one comes after it, wait for that.
    """
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        turn()


def _describe(condition: Callable[[], Any], value: object, said: object) -> str:
    try:
        source = " ".join(inspect.getsource(condition).split())
    except (OSError, TypeError):  # a method of C, or of a class, which is not a function
        source = repr(condition)
    lines = [source, f"is {_short.repr(value)}", str(said)]
    if inspect.isfunction(condition):
        used = inspect.getclosurevars(condition).nonlocals
        lines += [f"{name} = {_short.repr(found)}" for name, found in used.items()]
    return "\n  ".join(filter(None, lines))

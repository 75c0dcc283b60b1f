"""Asking the master without waiting: one question after the other, in the order they were put."""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.comm import Promise
from rosglass.errors import ConnectionLostError, NodeClosedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.ros1.core import Core

__all__ = ["Questions"]

_T = TypeVar("_T")


class Questions:
    """Puts questions to the master on a thread that may wait.

    Answers come in order, so that of two values that are set the second one stays. When the master
    is gone, all that wait are told at once, instead of one after the other.

    Args:
        core: The node.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        self._lock = threading.Lock()
        self._waiting: deque[tuple[Promise[Any], Callable[[], Any]]] = deque()
        self._asked: Promise[Any] | None = None
        self._busy = self._closed = False

    def ask(self, what: str, job: Callable[[], _T]) -> Promise[_T]:
        """Run `job`, which waits for the master; return the promise of what it returns.

        Args:
            what: What is asked for, for messages.
            job: Asks.
        """
        made: Promise[_T] = Promise(
            f"{self._core.master.uri} has not answered ({what})",
            self._core.dispatcher,
            cancellable=True,
        )
        with self._lock:
            closed, start = self._closed, not self._busy
            if not closed:
                self._busy = True
                self._waiting.append((made, job))
        if closed:
            made.fail(self._end())
        elif start:
            self._core.errands.run(self._work)
        return made

    def close(self) -> None:
        """Give up what was asked; safe to call twice."""
        with self._lock:
            self._closed = True
            waiting = [promise for promise, _ in self._waiting]
            self._waiting.clear()
            asked, self._asked = self._asked, None
        for promise in waiting if asked is None else [asked, *waiting]:
            promise.fail(self._end())

    def _work(self) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    self._busy = False
                    return
                promise, job = self._waiting.popleft()
                self._asked = promise
            if promise.done():
                continue  # it was given up
            try:
                promise.fulfil(job())
            except ConnectionLostError as error:
                promise.fail(error)
                self._lose(error)
            except Exception as error:
                promise.fail(error)

    def _lose(self, error: ConnectionLostError) -> None:
        with self._lock:
            waiting = [promise for promise, _ in self._waiting]
            self._waiting.clear()
        for promise in waiting:
            promise.fail(error)

    def _end(self) -> NodeClosedError:
        return NodeClosedError(f"node {self._core.name} was closed meanwhile")

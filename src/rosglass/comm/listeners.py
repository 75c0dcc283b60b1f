"""Callbacks that are told about a value, each on its own executor."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Generic, TypeVar

from rosglass.comm.executor import RetryingExecutor, check_plain, run_job
from rosglass.comm.handle import Executor, Handle
from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["ChangeListeners", "Listener", "Listeners"]

_T = TypeVar("_T")
#: Values that wait for a callback at most: its executor may never run it.
_MAX_WAITING = 1000


class Listeners(Generic[_T]):
    """A list of callbacks; true while there is one.

    Args:
        merge: Whether a callback that has not run yet is only told the newest value, so that a
            burst of changes costs one call.
        depth: How many values wait for a callback that is slow, the newest ones; None for 1000.
        where: What they listen to, e.g. a topic; for errors.
    """

    def __init__(self, merge: bool = False, depth: int | None = None, where: str = "") -> None:
        self._depth, self._where = 1 if merge else depth, where
        #: In the order they came. Every use is one operation of the dictionary, which is atomic:
        #: keys compare by identity.
        self._listeners: dict[Listener[_T], None] = {}

    def __bool__(self) -> bool:
        return bool(self._listeners)

    def add(self, callback: Callable[[_T], None], executor: Executor) -> Listener[_T]:
        """Tell `callback` each new value on `executor`, until the handle is closed.

        Raises:
            ArgumentError: One of the two is not what it should be.
        """
        check_plain(callback, self._where)
        if not isinstance(executor, Executor):
            raise ArgumentError("executor", executor, "a rosglass.comm.Executor", self._where)
        listener = Listener(self, callback, executor, self._depth, self._where)
        self._listeners[listener] = None
        return listener

    def notify(self, value: _T) -> bool:
        """Tell everyone `value`; from any thread, without waiting.

        Returns:
            Whether everyone will be told all values; not so when one was dropped to make room.
        """
        kept = [listener.tell(value) for listener in list(self._listeners)]
        return all(kept)

    def clear(self) -> None:
        """Forget everyone."""
        for listener in list(self._listeners):
            listener.close()

    def remove(self, listener: Listener[_T]) -> None:
        """Forget a listener; for listeners that are closed."""
        self._listeners.pop(listener, None)


class ChangeListeners(Listeners[_T]):
    """A list of callbacks that are told when a value has changed.

    Who reads the value and registers a callback learns of every change after that, even when it has
    changed back before anyone looked.

    Args:
        compute: Returns the value; it can be hashed.
        told: What callbacks take for the value as long as they were told nothing.
        where: What they listen to, e.g. a topic; for errors.
    """

    def __init__(self, compute: Callable[[], _T], told: _T, where: str = "") -> None:
        super().__init__(where=where)
        self._compute, self._told = compute, told
        #: What was read since the last look, by any thread; every use is atomic.
        self._read: set[_T] = set()

    def read(self) -> _T:
        """Return the value."""
        value = self._compute()
        self._read.add(value)
        return value

    def update(self) -> bool:
        """Look, and tell the value if it has changed; by one thread only.

        Returns:
            Whether it was told.
        """
        read = self._read.copy()
        self._read.difference_update(read)  # what is read from here on is compared by the next look
        value = self._compute()
        if value == self._told and read <= {value}:
            return False
        self._told = value
        self.notify(value)
        return True


class Listener(Handle, Generic[_T]):
    """A callback of :class:`Listeners`; closing it ends it.

    Attributes:
        closed: Whether it has ended.
    """

    def __init__(
        self,
        owner: Listeners[_T],
        callback: Callable[[_T], None],
        executor: Executor,
        depth: int | None,
        where: str,
    ) -> None:
        self._owner, self._callback = owner, callback
        self._executor = RetryingExecutor(executor, where or getattr(callback, "__qualname__", ""))
        self._depth = _MAX_WAITING if depth is None else depth
        self._lock = threading.Lock()
        self._waiting: list[_T] = []
        self.closed = False

    def tell(self, value: _T) -> bool:
        """Call back with `value` soon; returns whether no other value made room for it."""
        with self._lock:
            self._waiting.append(value)
            if len(self._waiting) > self._depth:
                # Its run is asked for already; it will find what is left.
                del self._waiting[0]
                return False
        self._executor.post(self._run)
        return True

    def _run(self) -> None:
        with self._lock:
            value = self._waiting.pop(0)
        if not self.closed:
            run_job(lambda: self._callback(value))

    def close(self) -> None:
        """Call back no more; safe to call twice."""
        self.closed = True
        self._executor.close()
        self._owner.remove(self)

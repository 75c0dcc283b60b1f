"""Lists of callbacks that are notified of values, each on its own executor."""

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
#: Maximum number of values that wait for a callback, as its executor may never run it.
_MAX_WAITING = 1000


class Listeners(Generic[_T]):
    """A list of callbacks; true while it is not empty.

    Args:
        merge: Whether a waiting callback is called only with the newest value, so that a burst of
            changes costs one call.
        depth: Number of newest values that wait for a slow callback; None for 1000.
        where: What the callbacks listen to, e.g. a topic; for errors.
    """

    def __init__(self, merge: bool = False, depth: int | None = None, where: str = "") -> None:
        self._depth, self._where = 1 if merge else depth, where
        #: In order of registration. Each use is one atomic operation of the dictionary.
        self._listeners: dict[Listener[_T], None] = {}

    def __bool__(self) -> bool:
        return bool(self._listeners)

    def add(self, callback: Callable[[_T], None], executor: Executor) -> Listener[_T]:
        """Call `callback` with each new value on `executor`, until the handle is closed.

        Raises:
            ArgumentError: `callback` is not a plain function, or `executor` not an Executor.
        """
        check_plain(callback, self._where)
        if not isinstance(executor, Executor):
            raise ArgumentError("executor", executor, "a rosglass.comm.Executor", self._where)
        listener = Listener(self, callback, executor, self._depth, self._where)
        self._listeners[listener] = None
        return listener

    def notify(self, value: _T) -> bool:
        """Call all callbacks with `value`; from any thread, without waiting.

        Returns:
            False if an older value was dropped to make room for it.
        """
        kept = [listener.notify(value) for listener in list(self._listeners)]
        return all(kept)

    def clear(self) -> None:
        """Remove all callbacks."""
        for listener in list(self._listeners):
            listener.close()

    def remove(self, listener: Listener[_T]) -> None:
        """Remove a closed listener."""
        self._listeners.pop(listener, None)


class ChangeListeners(Listeners[_T]):
    """A list of callbacks that are notified when a value has changed.

    A program that reads the value and then registers a callback is notified of every later change,
    even if the value has changed back before the next :meth:`update`.

    Args:
        compute: Returns the value, which is hashable.
        initial: The value that callbacks assume before the first notification.
        where: What the callbacks listen to, e.g. a topic; for errors.
    """

    def __init__(self, compute: Callable[[], _T], initial: _T, where: str = "") -> None:
        super().__init__(where=where)
        self._compute, self._reported = compute, initial
        #: Values read by any thread since the last update; each use is atomic.
        self._read: set[_T] = set()

    def read(self) -> _T:
        """Return the value."""
        value = self._compute()
        self._read.add(value)
        return value

    def update(self) -> bool:
        """Notify the callbacks if the value has changed; always called by the same thread.

        Returns:
            Whether they were notified.
        """
        read = self._read.copy()
        self._read.difference_update(read)  # later reads belong to the next update
        value = self._compute()
        if value == self._reported and read <= {value}:
            return False
        self._reported = value
        self.notify(value)
        return True


class Listener(Handle, Generic[_T]):
    """A callback of :class:`Listeners`, until it is closed.

    Attributes:
        closed: Whether it is closed.
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
        #: Guards the waiting values.
        self._lock = threading.Lock()
        self._waiting: list[_T] = []
        self.closed = False

    def notify(self, value: _T) -> bool:
        """Call back with `value` soon; return False if an older value was dropped for it."""
        with self._lock:
            self._waiting.append(value)
            if len(self._waiting) > self._depth:
                # Its run is already posted, and will take the next value instead.
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
        """Stop calling back; safe to call twice."""
        self.closed = True
        self._executor.close()
        self._owner.remove(self)

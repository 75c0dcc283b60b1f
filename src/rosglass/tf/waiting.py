"""Transforms that are waited for: looked up again whenever something came, until they are there."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from rosglass.comm.node import check_may_wait
from rosglass.comm.promise import Promise, check_timeout
from rosglass.comm.timers import Timers
from rosglass.errors import (
    InvalidArgumentException,
    NodeClosedError,
    TimeoutException,
    TransformException,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Handle
    from rosglass.tf.transform import Transform

__all__ = ["Waiting", "check_may_wait_for"]


class Waiting:
    """The lookups of a buffer that wait."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._requests: list[_Request] = []
        self._timers: Timers | None = None
        self._closed = False

    def __bool__(self) -> bool:
        return bool(self._requests)

    def add(
        self, what: str, query: Callable[[], Transform], timeout: float | None
    ) -> Promise[Transform]:
        """Return the promise of what `query` returns, as soon as it does not fail any more.

        Args:
            what: What is looked up.
            query: Looks it up.
            timeout: Seconds; None for ever.

        Raises:
            ConversionError: The timeout is no number of seconds.
            InvalidArgumentException: Waiting cannot help.
            NodeClosedError: The buffer is closed.
        """
        timeout = check_timeout(timeout, what)
        request = _Request(what, query)
        with self._lock:
            if self._closed:
                raise NodeClosedError(f"{what}: the transform buffer is closed")
            self._requests.append(request)
        if request.attempt():
            self._forget(request)
            error = request.promise.exception(0)
            if error is not None:
                raise error
            return request.promise
        request.promise.add_done_callback(lambda _: self._forget(request))
        if timeout is not None:
            with self._lock:
                if self._timers is None:
                    self._timers = Timers("rosglass tf timeouts")
                timers = self._timers
            request.timer = timers.after(timeout, lambda: request.expire(timeout))
            if request.promise.done():
                request.timer.close()
        return request.promise

    def test(self) -> None:
        """Try all again: something came. Without a lock held."""
        with self._lock:
            requests = list(self._requests)
        for request in requests:
            request.attempt()

    def close(self) -> None:
        """Fail all that wait; safe to call twice."""
        with self._lock:
            self._closed = True
            requests, self._requests = self._requests, []
            timers, self._timers = self._timers, None
        if timers is not None:
            timers.close()
        for request in requests:
            request.promise.fail(
                NodeClosedError(f"{request.what}: the transform buffer was closed meanwhile")
            )

    def _forget(self, request: _Request) -> None:
        with self._lock:
            if request in self._requests:
                self._requests.remove(request)
        if request.timer is not None:
            request.timer.close()


class _Request:
    def __init__(self, what: str, query: Callable[[], Transform]) -> None:
        self.what, self._query = what, query
        self.promise: Promise[Transform] = Promise(f"{what} is not available", cancellable=True)
        self.timer: Handle | None = None
        self._reason: TransformException | None = None

    def attempt(self) -> bool:
        """Look it up; returns whether it was there, or never will be."""
        try:
            found = self._query()
        except InvalidArgumentException as error:
            self.promise.fail(error)
            return True
        except TransformException as error:
            self._reason = error
            return False
        self.promise.fulfil(found)
        return True

    def expire(self, timeout: float) -> None:
        """Give up."""
        error = TimeoutException(
            f"{self.what} is not available within {timeout:g} s: {self._reason}"
        )
        error.__cause__ = self._reason
        self.promise.fail(error)


def check_may_wait_for(promise: Promise[Transform], what: str) -> None:
    """Cancel a promise that the calling thread must not wait for.

    Args:
        promise: Of a transform.
        what: What is looked up.

    Raises:
        UnsupportedError: This is a thread that receives transforms.
    """
    try:
        check_may_wait(what)
    except Exception:
        promise.cancel()
        raise

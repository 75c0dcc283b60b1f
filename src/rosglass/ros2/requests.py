"""Requests on their way to a service: which reply belongs to which."""

from __future__ import annotations

import logging
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.comm.calling import CallRequest

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.messages import ServiceType
    from rosglass.wires.base import Requester

__all__ = ["Link", "Request"]

_log = logging.getLogger("rosglass.ros2")


@dataclass(eq=False, kw_only=True)
class Request(CallRequest):
    """A call's request.

    Attributes:
        deadline: Monotonic time at which it is of no use any more, None for never.
        servers: Identities of the servers that were there when it was sent.
        alone: Since when none of them is there, or was; None while one is that may answer.
        link: Through which it was sent, and its number there.
    """

    deadline: float | None
    servers: frozenset[bytes | str] = frozenset()
    alone: float | None = None
    link: tuple[Link, int] | None = None


class Link:
    """One requester, and the requests that were sent through it.

    Args:
        type: The type it speaks.
        answer: Called with each request, its response's bytes or None, and the error.
    """

    def __init__(
        self,
        type: ServiceType,
        answer: Callable[[Link, Request, bytes | memoryview | None, str], None],
    ) -> None:
        self.type = type
        self.requester: Requester
        self._answer = answer
        self._lock = threading.Lock()
        self._requests: dict[int, Request] = {}
        self._sending = 0
        #: Replies that came before sending their request returned.
        self._early: dict[int, tuple[bytes | memoryview | None, str]] = {}

    def send(self, request: Request, data: bytes, timeout: float | None) -> None:
        """Send; the middleware's errors come out of here."""
        with self._lock:
            self._sending += 1
        number = -1
        try:
            number = self.requester.send(data, timeout)
        finally:
            with self._lock:
                self._sending -= 1
                early = self._early.pop(number, None)
                if not self._sending:
                    self._early.clear()
                if early is None and number >= 0:
                    self._requests[number] = request
        request.link = (self, number)
        if early is not None:
            self._answer(self, request, *early)
        elif request.call.done():
            self.forget(number)

    def take(self, number: int, data: bytes | memoryview | None, error: str) -> None:
        """Take a reply; called by the middleware."""
        try:
            with self._lock:
                request = self._requests.pop(number, None)
                if request is None:
                    if self._sending:
                        self._early[number] = (data, error)
                    return
            self._answer(self, request, data, error)
        except Exception:
            _log.exception("taking a reply failed")

    def quick(self, number: int) -> bool:
        """Return whether taking a reply now runs none but our own code."""
        with self._lock:
            request = self._requests.get(number)
            # While requests are sent, a reply is put aside for whoever sends its request.
            return request.private if request is not None else self._sending > 0

    def forget(self, number: int) -> None:
        """Drop a request's reply, should it still come."""
        with self._lock:
            known = self._requests.pop(number, None)
        if known is not None:
            self.requester.forget(number)

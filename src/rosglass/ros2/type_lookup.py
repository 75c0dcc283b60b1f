"""Definitions that the middleware itself can tell, where it can: DDS's TypeLookup."""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING

from rosglass.comm import EndpointKind
from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.comm import EndpointInfo
    from rosglass.interfaces import Definition
    from rosglass.wires.base import Middleware

__all__ = ["Lookup"]

_log = logging.getLogger("rosglass.ros2")
_TOPICS = (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION)
#: Seconds that each endpoint has to answer, and how many are asked.
_TIMEOUT, _MAX_ASKED = 2.0, 3


class Lookup:
    """Asks the middleware for a message's definition, on a thread that ends with the answer.

    Args:
        middleware: What to ask.
        name: The message's name.
        endpoints: Who uses it.
        on_done: Called in that thread when there is an answer.

    Attributes:
        done: Whether there is.
        found: The definition, if there was one.
        problem: Why there is none although an endpoint announced one.
    """

    def __init__(
        self,
        middleware: Middleware,
        name: str,
        endpoints: Iterable[EndpointInfo],
        on_done: Callable[[], None],
    ) -> None:
        self._middleware, self._on_done = middleware, on_done
        self.found: Definition | None = None
        self.problem = ""
        self._begun = time.monotonic()
        asked = [e for e in endpoints if e.kind in _TOPICS and e.type == name]
        self.done = not (asked and middleware.describes_types)
        self._thread = threading.Thread(
            target=self._work, args=(asked[:_MAX_ASKED],), name=f"{name} lookup", daemon=True
        )
        if not self.done:
            self._thread.start()

    @property
    def age(self) -> float:
        """Seconds since it was begun."""
        return time.monotonic() - self._begun

    def join(self) -> None:
        """Wait for the thread, which takes a few seconds at most."""
        if self._thread.ident is not None and self._thread is not threading.current_thread():
            self._thread.join(_TIMEOUT)

    def _work(self, endpoints: list[EndpointInfo]) -> None:
        for endpoint in endpoints:
            try:
                self.found = self._middleware.describe_type(endpoint, _TIMEOUT)
            except Error as error:
                self.problem = f"{endpoint.node}: {error}"
            except Exception as error:
                _log.exception("looking up the type of %s failed", endpoint.name)
                self.problem = f"{endpoint.node}: {error}"
            if self.found is not None:
                break
        self.done = True
        self._on_done()

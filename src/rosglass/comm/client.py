"""The common part of service and action clients: monitoring whether a server is available."""

from __future__ import annotations

import copy
import logging
import threading
import time
from abc import abstractmethod
from typing import TYPE_CHECKING, Any

from rosglass.comm.handle import Handle, check_may_wait
from rosglass.comm.listeners import ChangeListeners
from rosglass.comm.promise import check_timeout
from rosglass.errors import ArgumentError, ConversionError, NodeClosedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.core import NodeCore
    from rosglass.comm.handle import Executor

__all__ = ["Client", "Readiness", "copy_value"]

#: Longest wait without a check: not every middleware reports a server at once.
_POLL_PERIOD_S = 0.1


class Client(Handle):
    """A client of a service or an action.

    Args:
        core: The node it belongs to.
        name: Absolute name of the service or action.
    """

    name: str
    _core: NodeCore

    def __init__(self, core: NodeCore, name: str) -> None:
        self._core, self.name = core, name
        self._closed = False
        self._logged_conflicts = ""
        self._readiness = Readiness(name, self._is_ready, self._check_open, core.dispatcher)

    @property
    def ready(self) -> bool:
        """True while a compatible server is available."""
        return self._readiness.read()

    @abstractmethod
    def _is_ready(self) -> bool:
        """Return whether a compatible server is available."""

    @abstractmethod
    def _server_conflicts(self) -> list[str]:
        """Return the problems that the user has to fix, in words."""

    @abstractmethod
    def _unavailable_reason(self) -> str:
        """Return why no server is available, if there are no conflicts."""

    @property
    def problem(self) -> str:
        """Why the server cannot be called, in words; empty if there is no problem."""
        if self._closed:
            return "the client is closed"
        problems = self._server_conflicts()
        if not problems and not self.ready:
            problems.append(self._unavailable_reason())
        return "; ".join(problems)

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait up to `timeout` seconds (None: forever) for a server; return whether there is one.

        Raises:
            NodeClosedError: The client is closed, or is closed during the wait.
        """
        return self._readiness.wait(timeout)

    def on_ready_change(
        self, callback: Callable[[bool], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with :attr:`ready` whenever that changes.

        Args:
            callback: Called with the new value.
            executor: Where it runs; None for the node's own dispatcher thread.
        """
        return self._readiness.add(callback, executor)

    def _log_conflicts(self, log: logging.Logger, level: int = logging.WARNING) -> None:
        """Log the problems that the user has to fix, once."""
        conflicts = "; ".join(self._server_conflicts())
        if conflicts and conflicts != self._logged_conflicts:
            log.log(level, "%s: %s", self.name, conflicts)
        self._logged_conflicts = conflicts

    def _check_open(self) -> None:
        self._core.check_open()
        if self._closed:
            raise NodeClosedError(f"the client of {self.name} is closed; create another one")


class Readiness:
    """The availability of a server, to read, wait for or listen to.

    Args:
        name: Name of the service or action, for errors.
        ready: Returns whether a server is available.
        check_open: Raises NodeClosedError if waiting has become pointless.
        default: Executor of callbacks that are added without one.
    """

    def __init__(
        self,
        name: str,
        ready: Callable[[], bool],
        check_open: Callable[[], None],
        default: Executor,
    ) -> None:
        self._name, self._check_open, self._default = name, check_open, default
        #: Guards no data; wakes the threads that wait.
        self._changed = threading.Condition()
        self._listeners = ChangeListeners(ready, False, where=name)

    def read(self) -> bool:
        """Return whether a server is available."""
        return self._listeners.read()

    def wait(self, timeout: float | None) -> bool:
        """Wait up to `timeout` seconds, None forever; return whether a server is available."""
        timeout = check_timeout(timeout, self._name)
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            self._check_open()
            if self.read():
                return True
            check_may_wait(self._name)
            left = _POLL_PERIOD_S if deadline is None else deadline - time.monotonic()
            if left <= 0:
                return False
            with self._changed:
                self._changed.wait(min(left, _POLL_PERIOD_S))

    def add(self, callback: Callable[[bool], None], executor: Executor | None) -> Handle:
        """Call `callback` with each change; see :meth:`Client.on_ready_change`."""
        self._check_open()
        if not callable(callback):
            raise ArgumentError("callback", callback, "something that can be called", self._name)
        return self._listeners.add(callback, executor or self._default)

    def update(self) -> None:
        """Check for a change, and notify listeners and waiting threads; for one thread only."""
        self._wake()
        self._listeners.update()

    def close(self) -> None:
        """Remove all listeners, and wake the threads that wait."""
        self._wake()
        self._listeners.clear()

    def _wake(self) -> None:
        with self._changed:
            self._changed.notify_all()


def copy_value(value: Any, where: str) -> Any:
    """Return a copy of a value to encode later, when its type is known.

    Raises:
        ConversionError: It is neither a message nor a dict, nor None.
    """
    if value is None or hasattr(value, "to_dict") or isinstance(value, dict):
        return copy.deepcopy(value)
    raise ConversionError("", value, "a message or a dict of fields", where)

"""Asking a server that may come and go: what clients of services and of actions have in common."""

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

__all__ = [
    "Client",
    "Readiness",
    "untyped",
]

#: Longest sleep in seconds of a thread that waits: not every middleware tells at once.
_WAIT_SLICE_S = 0.1


class Client(Handle):
    """A client of a service or an action; it follows whether there is a server.

    Args:
        core: The node it belongs to.
        name: Absolute name of the service or action.
    """

    name: str
    _core: NodeCore

    def __init__(self, core: NodeCore, name: str) -> None:
        self._core, self.name = core, name
        self._closed = False
        self._warned = ""
        self._readiness = Readiness(name, self._is_ready, self._check_open, core.dispatcher)

    @property
    def ready(self) -> bool:
        """Whether a server is there that understands what it is asked."""
        return self._readiness.read()

    @abstractmethod
    def _is_ready(self) -> bool:
        """Return whether a server is there that understands what it is asked."""

    @abstractmethod
    def _conflicts(self) -> list[str]:
        """Say what a person has to mend."""

    @abstractmethod
    def _absence(self) -> str:
        """Say why no server is there although nothing is wrong."""

    @property
    def problem(self) -> str:
        """Why the server cannot be asked, in words; empty when all is well."""
        if self._closed:
            return "the client is closed"
        problems = self._conflicts()
        if not problems and not self.ready:
            problems.append(self._absence())
        return "; ".join(problems)

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait up to `timeout` seconds (None: for ever) for a server; return whether it is there.

        Raises:
            NodeClosedError: The client is closed, or gets closed meanwhile.
        """
        return self._readiness.wait(timeout)

    def on_ready_change(
        self, callback: Callable[[bool], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with :attr:`ready` whenever it changes, to and fro.

        Args:
            callback: Called with the new value.
            executor: Where it runs; None for the node's own dispatcher thread.
        """
        return self._readiness.add(callback, executor)

    def _warn(self, log: logging.Logger, level: int = logging.WARNING) -> None:
        """Log what a person has to mend, once."""
        problem = "; ".join(self._conflicts())
        if problem and problem != self._warned:
            log.log(level, "%s: %s", self.name, problem)
        self._warned = problem

    def _check_open(self) -> None:
        self._core.check_open()
        if self._closed:
            raise NodeClosedError(f"the client of {self.name} is closed; create another one")


class Readiness:
    """Whether the server of a service or action is there: waited for, and told when it changes.

    Args:
        name: Of the service or action, for messages.
        ready: Says whether the server is there.
        check_open: Raises NodeClosedError when it makes no sense to wait any more.
        default: Where callbacks run unless told otherwise.
    """

    def __init__(
        self,
        name: str,
        ready: Callable[[], bool],
        check_open: Callable[[], None],
        default: Executor,
    ) -> None:
        self._name, self._check_open, self._default = name, check_open, default
        self._changed = threading.Condition()
        self._listeners = ChangeListeners(ready, False, where=name)

    def read(self) -> bool:
        """Return whether the server is there."""
        return self._listeners.read()

    def wait(self, timeout: float | None) -> bool:
        """Wait up to `timeout` seconds, None for ever; return whether the server is there."""
        timeout = check_timeout(timeout, self._name)
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            self._check_open()
            if self.read():
                return True
            check_may_wait(self._name)
            left = _WAIT_SLICE_S if deadline is None else deadline - time.monotonic()
            if left <= 0:
                return False
            with self._changed:
                self._changed.wait(min(left, _WAIT_SLICE_S))

    def add(self, callback: Callable[[bool], None], executor: Executor | None) -> Handle:
        """Tell `callback` each change."""
        self._check_open()
        if not callable(callback):
            raise ArgumentError("callback", callback, "something that can be called", self._name)
        return self._listeners.add(callback, executor or self._default)

    def update(self) -> None:
        """Look, and tell; by one thread only."""
        self._wake()
        self._listeners.update()

    def close(self) -> None:
        """Forget the listeners, and let those who wait find out."""
        self._wake()
        self._listeners.clear()

    def _wake(self) -> None:
        with self._changed:
            self._changed.notify_all()


def untyped(value: Any, where: str) -> Any:
    """Return a copy of what will become a message once its type is known: it may change meanwhile.

    Raises:
        ConversionError: It is neither a message nor a dict, nor None.
    """
    if value is None or hasattr(value, "to_dict") or isinstance(value, dict):
        return copy.deepcopy(value)
    raise ConversionError("", value, "a message or a dict of fields", where)

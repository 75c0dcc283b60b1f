"""Asking a server that may come and go: what clients of services and of actions have in common."""

from __future__ import annotations

import copy
import logging
from abc import abstractmethod
from typing import TYPE_CHECKING, Any

from rosglass.comm.node import Handle
from rosglass.comm.readiness import Readiness
from rosglass.errors import ConversionError, NodeClosedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.core import NodeCore
    from rosglass.comm.node import Executor

__all__ = ["Client", "untyped"]


class Client(Handle):
    """A client of a service or an action; it follows whether there is a server.

    Args:
        core: The node it belongs to.
        name: Absolute name of the service or action.
    """

    name: str
    _core: NodeCore[Any]

    def __init__(self, core: NodeCore[Any], name: str) -> None:
        self._core, self.name = core, name
        self._closed = False
        self._warned = ""
        self._readiness = Readiness(name, lambda: self.ready, self._check_open, core.dispatcher)

    @property
    @abstractmethod
    def ready(self) -> bool:
        """Whether a server is there that understands what it is asked."""

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


def untyped(value: Any, where: str) -> Any:
    """Return a copy of what will become a message once its type is known: it may change meanwhile.

    Raises:
        ConversionError: It is neither a message nor a dict, nor None.
    """
    if value is None or hasattr(value, "to_dict") or isinstance(value, dict):
        return copy.deepcopy(value)
    raise ConversionError("", value, "a message or a dict of fields", where)

"""Reading and setting another node's parameters: those in its private namespace."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from rosglass.comm import ConnectionState, ParameterClient, SetResult
from rosglass.comm.promise import check_timeout
from rosglass.comm.readiness import Readiness
from rosglass.errors import NodeClosedError, ParameterError, UnsupportedError
from rosglass.ros1.parameter_namespace import ParameterNamespace, check_values
from rosglass.ros1.parameter_values import to_wire

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from os import PathLike

    from rosglass.comm import (
        Executor,
        Handle,
        ParameterDescriptor,
        ParameterEvent,
        ParameterValue,
    )
    from rosglass.ros1.core import Core
    from rosglass.ros1.parameter_server import ParameterServer

__all__ = ["Ros1ParameterClient"]

#: Seconds that the master may take to answer, whatever longer time is given.
_TIMEOUT = 5.0


class Ros1ParameterClient(ParameterClient):
    """A client of another node's parameters; made by :meth:`Node.create_parameter_client`.

    They live on the master's parameter server, whether the node runs or not, and so do those in any
    other namespace, ``/`` included. Groups are namespaces: ``camera/exposure``. Values may be what
    only ROS 1 has: namespaces as dicts, lists of several types, dates. A master that does not
    answer within `timeout`, 5 s at most, is a ConnectionLostError.

    Args:
        core: The node that asks.
        server: The parameter server.
        node: Full name of the other node, or any absolute namespace.
    """

    def __init__(self, core: Core, server: ParameterServer, node: str) -> None:
        self.node = node
        self._core, self._server = core, server
        self._namespace = ParameterNamespace(server, node)
        self._readiness = Readiness(
            f"parameters of {node}", lambda: self.ready, self._check_open, core.dispatcher
        )
        self._lock = threading.Lock()
        self._watches: list[Handle] = []
        self._closed = False

    @property
    def ready(self) -> bool:
        """Whether the master, which keeps the parameters, is there."""
        return not self._closed and self._core.status().state is ConnectionState.CONNECTED

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for the master; return whether it is there."""
        return self._readiness.wait(timeout)

    def names(
        self, prefixes: Iterable[str] = (), depth: int = 0, *, timeout: float | None = 10.0
    ) -> list[str]:
        """Return the names of its parameters, sorted; see the base class."""
        return self._namespace.find(prefixes, depth, self._seconds(timeout))

    def get(
        self, names: Iterable[str] | None = None, *, timeout: float | None = 10.0
    ) -> dict[str, ParameterValue]:
        """Return the values of parameters, of all without `names`; None for what is not set."""
        return self._namespace.values(names, self._seconds(timeout))

    def describe(
        self, names: Iterable[str] | None = None, *, timeout: float | None = 10.0
    ) -> dict[str, ParameterDescriptor]:
        """Return the types of parameters, of all without `names`; ROS 1 knows no more of them."""
        found = self._namespace.values(names, self._seconds(timeout))
        return {name: self._namespace.describe(name, value) for name, value in found.items()}

    def set(
        self, values: Mapping[str, ParameterValue], *, timeout: float | None = 10.0
    ) -> dict[str, SetResult]:
        """Set parameters one by one, None deletes; return what the master says to each.

        Raises:
            ParameterError: A value can be no parameter's; nothing is sent.
        """
        seconds = self._seconds(timeout)
        check_values(values, self.node)
        wanted = {name: self._namespace.full(name) for name in values}
        for name, full in wanted.items():
            self._server.resolve(full, strict=True)
            if values[name] is not None:
                to_wire(full, values[name])
        return {name: self._set(full, values[name], seconds) for name, full in wanted.items()}

    def set_atomically(
        self, values: Mapping[str, ParameterValue], *, timeout: float | None = 10.0
    ) -> SetResult:
        """Set one parameter; raises UnsupportedError for several, which ROS 1 cannot set at once.

        Errors as of :meth:`set`.
        """
        check_values(values, self.node)
        if len(values) > 1:
            raise UnsupportedError(
                f"{self.node}: ROS 1's parameter server sets one parameter after the other; take "
                "set(), or node.parameter_server.set() with a dict, which replaces a namespace"
            )
        return next(iter(self.set(values, timeout=timeout).values()), SetResult(True))

    def watch(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each change, whoever makes it; quick ones may be merged."""
        self._check_open()
        chosen = executor or self._core.dispatcher
        made = self._namespace.watch(callback, chosen, f"{self.node}: watch()")
        with self._lock:
            self._watches.append(made)
        return made

    def load(self, path: str | PathLike[str], *, timeout: float | None = 10.0) -> list[str]:
        """Set what a file has, as ``rosparam load FILE /node`` does; return the names.

        Raises:
            ParameterError: The file cannot be read or is empty, or has a value that can be no
                parameter's; nothing is set then.
        """
        seconds = self._seconds(timeout)
        prefix = self.node.rstrip("/") + "/"
        names = self._server.load(path, self.node, timeout=seconds)
        if not names:
            raise ParameterError(f"{path} has no parameters")
        return [name.removeprefix(prefix) for name in names]

    def save(self, path: str | PathLike[str], *, timeout: float | None = 10.0) -> None:
        """Write the node's parameters into a file, as ``rosparam dump FILE /node`` does."""
        from rosglass.ros1 import parameter_files  # noqa: PLC0415 - yaml

        parameter_files.write(path, self._namespace.tree(self._seconds(timeout)))

    def close(self) -> None:
        """Ask and watch no more; safe to call twice."""
        with self._lock:
            self._closed = True
            watches, self._watches = self._watches, []
        for watch in watches:
            watch.close()
        self._readiness.close()

    def _set(self, full: str, value: Any, seconds: float) -> SetResult:
        try:
            if value is None:
                self._server.delete(full, timeout=seconds)
            else:
                self._server.set(full, value, timeout=seconds)
        except ParameterError as error:
            return SetResult(False, str(error))
        return SetResult(True)

    def _seconds(self, timeout: float | None) -> float:
        self._check_open()
        seconds = check_timeout(timeout, self.node)
        return _TIMEOUT if seconds is None else min(seconds, _TIMEOUT)

    def _check_open(self) -> None:
        self._core.check_open()
        if self._closed:
            raise NodeClosedError(f"{self!r} is closed; create another one")

"""A node's parameters: those in its namespace on ROS 1's parameter server.

Every node may set the parameters of every other one, to values of any type.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rosglass.comm import (
    IMMEDIATE,
    ConnectionState,
    Handle,
    Listeners,
    ParameterDescriptor,
    ParameterEvent,
    Parameters,
    ParameterType,
    SetResult,
)
from rosglass.comm.client import Readiness
from rosglass.comm.executor import check_plain
from rosglass.comm.handle import undo_on_error
from rosglass.comm.names import similar
from rosglass.comm.parameters import RemoteParameters, check_values
from rosglass.errors import ConnectionLostError, NodeClosedError, ParameterError, UnsupportedError
from rosglass.ros1 import rosparam_files
from rosglass.ros1.parameter_server import flatten, is_same_value, to_wire

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from os import PathLike

    from rosglass.comm import Executor, ParameterValue
    from rosglass.comm.promise import Deadline
    from rosglass.ros1.parameter_server import ParameterServer
    from rosglass.wires.tcpros.core import TcprosCore

__all__ = ["RemoteNamespace", "Ros1Parameters"]

#: How long the master may take to answer, even if the caller's timeout is longer.
_TIMEOUT_S = 5.0
_SCALARS = {
    bool: ParameterType.BOOL,
    int: ParameterType.INTEGER,
    float: ParameterType.DOUBLE,
    str: ParameterType.STRING,
    bytes: ParameterType.BYTE_ARRAY,
}
_ARRAYS = {
    bool: ParameterType.BOOL_ARRAY,
    int: ParameterType.INTEGER_ARRAY,
    float: ParameterType.DOUBLE_ARRAY,
    str: ParameterType.STRING_ARRAY,
}


class ParameterNamespace:
    """A namespace of the parameter server.

    Args:
        server: The parameter server.
        name: The absolute namespace.
    """

    def __init__(self, server: ParameterServer, name: str) -> None:
        self.server, self.name = server, name

    def full(self, name: object) -> str:
        """Return the absolute name of a parameter; raises ParameterError."""
        if not isinstance(name, str) or not name:
            raise ParameterError(
                f"{self.name}: a parameter's name must be a non-empty string, got {name!r}"
            )
        if name[0] in "/~":
            raise ParameterError(
                f"{self.name}: {name!r} is not the name of a parameter in this namespace; leave "
                f"{name[0]!r} out, or use node.parameter_server, which has all names"
            )
        if "." in name:
            raise ParameterError(
                f"{self.name}: {name!r} has a '.'; in ROS 1 parameters are grouped with '/': "
                f"{name.replace('.', '/')!r}"
            )
        return f"{self.name.rstrip('/')}/{name}"

    def tree(self, timeout: float) -> dict[str, Any]:
        """Return its parameters as nested dicts; empty when the namespace does not exist."""
        found = self.server.get(self.name, None, timeout=timeout)
        return found if isinstance(found, dict) else {}

    def describe(self, name: str, value: Any) -> ParameterDescriptor:
        """Return a parameter's descriptor, which has only its type."""
        parameter_type = type_of(value)
        text = ""
        if value is not None and parameter_type is ParameterType.NOT_SET:
            text = f"A {'namespace' if isinstance(value, dict) else type(value).__name__}."
        return ParameterDescriptor(name, parameter_type, text, dynamic_typing=True)


class _Changes(Handle):
    """Calls back with each change of a namespace since `before`, or since it is known."""

    def __init__(
        self,
        namespace: ParameterNamespace,
        callback: Callable[[ParameterEvent], None],
        executor: Executor,
        before: dict[str, Any] | None,
    ) -> None:
        self._name = namespace.name
        self._before = before
        self._listeners: Listeners[ParameterEvent] = Listeners(where=namespace.name)
        self._listeners.add(callback, executor)
        self._subscription = namespace.server.subscribe(namespace.name, self._on_value, IMMEDIATE)

    def close(self) -> None:
        self._listeners.clear()
        self._subscription.close()

    def _on_value(self, value: Any) -> None:
        now = dict(flatten(value)) if isinstance(value, dict) else {}
        before, self._before = self._before, now
        if before is None:
            return
        new = {name: now[name] for name in now if name not in before}
        changed = {n: now[n] for n in now if n in before and not is_same_value(now[n], before[n])}
        deleted = tuple(name for name in before if name not in now)
        if new or changed or deleted:
            self._listeners.notify(ParameterEvent(self._name, new, changed, deleted))


class Ros1Parameters(Parameters):
    """A node's own parameters, ``~name``; :attr:`Node.parameters`.

    They are on the master's parameter server, where every node can set them, to values of any type:
    nothing can be refused, and no parameter is read-only, has a range or keeps its type. Groups are
    namespaces: ``camera/exposure``. Values may be of types that only ROS 1 has: namespaces as
    dicts, lists of mixed types, dates. Each method calls the master and waits up to 5 s for it;
    :attr:`Ros1Node.parameter_server` has methods that do not wait.

    Raises:
        ConnectionLostError: The master does not answer; from every method.
        InvalidNameError: A name breaks ROS's rules; from every method with a name.
    """

    def __init__(self, core: TcprosCore, server: ParameterServer) -> None:
        self.node = core.name.full
        self._core, self._server = core, server
        self._namespace = ParameterNamespace(server, core.name.full)
        #: Any thread declares and undeclares; every use is atomic.
        self._declared: dict[str, ParameterDescriptor] = {}

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.node}>"

    def declare(
        self,
        name: str,
        default: ParameterValue = None,
        descriptor: ParameterDescriptor | None = None,
    ) -> ParameterValue:
        """Return a parameter's value; sets it to `default` if it has none.

        Args:
            name: Its name.
            default: Its value unless the parameter server has one.
            descriptor: A description for :meth:`describe`; other nodes cannot read it.

        Raises:
            ParameterError: It is declared already, or the value is not valid for a parameter.
            UnsupportedError: The descriptor has a range, or makes it read-only.
        """
        self._core.check_open()
        full = self._namespace.full(name)
        descriptor = ParameterDescriptor() if descriptor is None else descriptor
        if not isinstance(descriptor, ParameterDescriptor):
            raise ParameterError(f"parameter {name!r}: {descriptor!r} is not a ParameterDescriptor")
        if descriptor.range is not None or descriptor.read_only:
            what = "a range" if descriptor.range is not None else "read-only parameters"
            raise UnsupportedError(
                f"parameter {full}: ROS 1's parameter server has no {what.removeprefix('a ')}: "
                "every node may set everything; check the value where it is used"
            )
        if default is not None:
            to_wire(full, default)
        mine = replace(descriptor)  # the same one may be given twice
        if self._declared.setdefault(name, mine) is not mine:
            raise ParameterError(f"{self.node}: parameter {name!r} is declared already")
        with undo_on_error(lambda: self._declared.pop(name, None)):
            value: ParameterValue = self._server.get(full, None)
            if value is None and default is not None:
                self._server.set(full, default)
        return default if value is None else value

    def undeclare(self, name: str) -> None:
        """Delete a parameter; raises ParameterError when it is neither declared nor set.

        It may be deleted already: other nodes can do so, too.
        """
        self._core.check_open()
        declared = self._declared.pop(name, None)
        full = self._namespace.full(name)
        if declared is None or self._server.has(full):
            self._server.delete(full)

    def get(self, name: str) -> ParameterValue:
        """Return a parameter's value; None for one that is declared and not set.

        Raises:
            ParameterError: It is neither declared nor set; the message names similar ones.
        """
        self._core.check_open()
        value: ParameterValue = self._server.get(self._namespace.full(name), None)
        if value is None and name not in self._declared:
            hint = similar(name, self.names())
            raise ParameterError(f"{self.node}: parameter {name!r} is not set{hint}")
        return value

    def set(self, values: Mapping[str, ParameterValue]) -> None:
        """Set parameters one after the other, declared or not; None deletes.

        Raises:
            ParameterError: A value is not valid for a parameter; then none is set.
        """
        self._core.check_open()
        check_values(values, self.node)
        wanted = {self._namespace.full(name): value for name, value in values.items()}
        for full, value in wanted.items():
            if value is not None:
                to_wire(self._server.resolve(full, strict=True), value)
        for full, value in wanted.items():
            if value is not None:
                self._server.set(full, value)
            elif self._server.has(full):
                self._server.delete(full)

    def describe(self, name: str) -> ParameterDescriptor:
        """Return a parameter's type and declaration; raises what :meth:`get` does."""
        found = self._namespace.describe(name, self.get(name))
        declared = self._declared.get(name)
        if declared is None:
            return found
        parameter_type = declared.type if found.type is ParameterType.NOT_SET else found.type
        return replace(declared, name=name, type=parameter_type, dynamic_typing=True)

    def names(self) -> list[str]:
        """Return the names that are set or declared, sorted."""
        self._core.check_open()
        known = (name for name, _ in flatten(self._namespace.tree(_TIMEOUT_S)))
        return sorted({*known, *self._declared})

    def on_set(self, validate: Callable[[Mapping[str, ParameterValue]], str]) -> Handle:
        """Raise UnsupportedError: ROS 1 cannot validate values before they are set."""
        raise UnsupportedError(
            f"{self.node}: ROS 1's parameter server accepts every value without calling "
            f"{getattr(validate, '__name__', validate)!r}; on_change() reports it afterwards"
        )

    def on_change(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each change, by any node; quick ones may be merged."""
        self._core.check_open()
        chosen = executor or self._core.dispatcher
        check_plain(callback, f"{self.node}: on_change()")
        before = dict(flatten(self._namespace.tree(_TIMEOUT_S)))
        return _Changes(self._namespace, callback, chosen, before)

    def load(self, path: str | PathLike[str]) -> None:
        """Set the parameters of a file, as ``rosparam load FILE /node`` does; declared or not.

        Raises:
            ParameterError: The file cannot be read or is empty, or a value is not valid for a
                parameter; then nothing is set.
        """
        self._core.check_open()
        if not self._server.load(path, self.node):
            raise ParameterError(f"{path} has no parameters")

    def save(self, path: str | PathLike[str]) -> None:
        """Write the parameters into a file, as ``rosparam dump FILE /node`` does."""
        self._core.check_open()
        rosparam_files.write(path, self._namespace.tree(_TIMEOUT_S))

    def close(self) -> None:
        """Do nothing: the parameters stay on the server, and callbacks end with the node."""


class RemoteNamespace(RemoteParameters):
    """Another node's parameters: those in its namespace on the parameter server.

    Args:
        core: The calling node.
        server: The parameter server.
        node: Full name of the other node, or any absolute namespace.
    """

    def __init__(self, core: TcprosCore, server: ParameterServer, node: str) -> None:
        self.node = node
        self._core, self._server = core, server
        self._namespace = ParameterNamespace(server, node)
        self._readiness = Readiness(
            f"parameters of {node}", lambda: self.ready, self._check_open, core.dispatcher
        )
        self._watches: list[Handle] = []
        self._closed = False

    @property
    def ready(self) -> bool:
        """True while the master, which has the parameters, is connected."""
        return self._core.status().state is ConnectionState.CONNECTED

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for the master; return whether it is connected."""
        return self._readiness.wait(timeout)

    def find(self, prefixes: list[str], depth: int, deadline: Deadline) -> list[str]:
        """Return the names under `prefixes`."""
        names = [name for name, _ in flatten(self._namespace.tree(_seconds(deadline)))]
        if not prefixes:
            return [name for name in names if not depth or name.count("/") < depth]
        return [name for name in names if any(_below(name, p, depth) for p in prefixes)]

    def values(self, names: list[str] | None, deadline: Deadline) -> dict[str, ParameterValue]:
        """Return values by name; None for unset parameters."""
        if names is None:
            return dict(sorted(flatten(self._namespace.tree(_seconds(deadline)))))
        wanted = {name: self._namespace.full(name) for name in names}
        if len(wanted) <= 1:
            seconds = _seconds(deadline)
            return {n: self._server.get(f, None, timeout=seconds) for n, f in wanted.items()}
        tree = self._namespace.tree(_seconds(deadline))
        return {name: _at(tree, name) for name in wanted}

    def descriptors(
        self, names: list[str] | None, deadline: Deadline
    ) -> dict[str, ParameterDescriptor]:
        """Return descriptors by name, which have only the types."""
        found = self.values(names, deadline)
        return {name: self._namespace.describe(name, value) for name, value in found.items()}

    def set(self, values: Mapping[str, ParameterValue], deadline: Deadline) -> dict[str, SetResult]:
        """Set parameters one by one, None deletes; return the result of each."""
        wanted = {name: self._namespace.full(name) for name in values}
        for name, full in wanted.items():
            self._server.resolve(full, strict=True)
            if values[name] is not None:
                to_wire(full, values[name])
        return {name: self._set(full, values[name], deadline) for name, full in wanted.items()}

    def set_atomically(self, values: Mapping[str, ParameterValue], deadline: Deadline) -> SetResult:
        """Set one parameter; raises UnsupportedError for several."""
        if len(values) > 1:
            raise UnsupportedError(
                f"{self.node}: ROS 1's parameter server sets one parameter at a time; use "
                "set(), or node.parameter_server.set() with a dict, which replaces a namespace"
            )
        return next(iter(self.set(values, deadline).values()), SetResult(True))

    def watch(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None
    ) -> Handle:
        """Call `callback` with each change; waits for the values to compare with."""
        self._check_open()
        before = None
        # Without them, when there is no master yet or in threads that must not wait, changes are
        # those since the master's first answer.
        with suppress(ConnectionLostError, UnsupportedError):
            before = dict(flatten(self._namespace.tree(_TIMEOUT_S)))
        made = _Changes(self._namespace, callback, executor or self._core.dispatcher, before)
        self._watches.append(made)
        if self._closed:  # just now, by another thread
            self.close()
        return made

    def load(self, path: str | PathLike[str], deadline: Deadline) -> list[str]:
        """Set the parameters of a file, as ``rosparam load FILE /node`` does; none if one fails."""
        prefix = self.node.rstrip("/") + "/"
        names = self._server.load(path, self.node, timeout=_seconds(deadline))
        if not names:
            raise ParameterError(f"{path} has no parameters")
        return [name.removeprefix(prefix) for name in names]

    def save(self, path: str | PathLike[str], deadline: Deadline) -> None:
        """Write a file, as ``rosparam dump FILE /node`` does."""
        rosparam_files.write(path, self._namespace.tree(_seconds(deadline)))

    def close(self) -> None:
        """End all subscriptions; safe to call twice."""
        self._closed = True
        while self._watches:
            self._watches.pop().close()
        self._readiness.close()

    def _check_open(self) -> None:
        self._core.check_open()
        if self._closed:
            raise NodeClosedError(f"{self!r} is closed; create another one")

    def _set(self, full: str, value: Any, deadline: Deadline) -> SetResult:
        try:
            if value is None:
                self._server.delete(full, timeout=_seconds(deadline))
            else:
                self._server.set(full, value, timeout=_seconds(deadline))
        except ParameterError as error:
            return SetResult(False, str(error))
        return SetResult(True)


def type_of(value: Any) -> ParameterType:
    """Return a value's type; NOT_SET for those only in ROS 1: namespaces, mixed lists, dates."""
    if isinstance(value, list):
        kinds = {type(item) for item in value}
        return (
            _ARRAYS.get(kinds.pop(), ParameterType.NOT_SET)
            if len(kinds) == 1
            else (ParameterType.NOT_SET)
        )
    return _SCALARS.get(type(value), ParameterType.NOT_SET)


def _below(name: str, prefix: str, depth: int) -> bool:
    prefix = str(prefix).strip("/")
    if name == prefix:
        return True
    inner = name.removeprefix(f"{prefix}/") if prefix else name
    return (inner != name or not prefix) and (not depth or inner.count("/") < depth)


def _at(tree: Any, name: str) -> Any:
    for part in name.strip("/").split("/"):
        if not isinstance(tree, dict) or part not in tree:
            return None
        tree = tree[part]
    return tree


def _seconds(deadline: Deadline) -> float:
    """Return the timeout of a call before a deadline."""
    left = deadline.left()
    return _TIMEOUT_S if left is None else min(left, _TIMEOUT_S)

"""The parameters in one namespace, by their names there: a node's private ones, as a rule."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from rosglass.comm import (
    IMMEDIATE,
    Handle,
    Listeners,
    ParameterDescriptor,
    ParameterEvent,
    ParameterType,
)
from rosglass.comm.loop import check_plain
from rosglass.errors import ConversionError, ParameterError
from rosglass.ros1.parameter_values import flat, same

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Executor
    from rosglass.ros1.parameter_server import ParameterServer

__all__ = ["ParameterNamespace", "check_values", "type_of"]

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
    """Reads and follows the parameters in a namespace.

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
                f"{self.name}: a parameter's name must be a text that is not empty, got {name!r}"
            )
        if name[0] in "/~":
            raise ParameterError(
                f"{self.name}: {name!r} is not the name of a parameter in this namespace; leave "
                f"{name[0]!r} out, or ask node.parameter_server, which knows all names"
            )
        if "." in name:
            raise ParameterError(
                f"{self.name}: {name!r} has a '.'; in ROS 1 parameters are grouped with '/': "
                f"{name.replace('.', '/')!r}"
            )
        return f"{self.name.rstrip('/')}/{name}"

    def tree(self, timeout: float) -> dict[str, Any]:
        """Return all as nested dicts; none when the namespace is not there."""
        found = self.server.get(self.name, None, timeout=timeout)
        return found if isinstance(found, dict) else {}

    def find(self, prefixes: Iterable[str], depth: int, timeout: float) -> list[str]:
        """Return the names below `prefixes` (all without), up to `depth` levels (0: all)."""
        wanted = texts(prefixes, "prefixes", self.name)
        if type(depth) is not int or depth < 0:
            raise ConversionError("depth", depth, "a number of levels, 0 for all", self.name)
        names = sorted(name for name, _ in flat(self.tree(timeout)))
        if not wanted:
            return [name for name in names if not depth or name.count("/") < depth]
        return [name for name in names if any(_below(name, p, depth) for p in wanted)]

    def values(self, names: Iterable[str] | None, timeout: float) -> dict[str, Any]:
        """Return values by name, of all without `names`; None for what is not set."""
        if names is None:
            return dict(sorted(flat(self.tree(timeout))))
        wanted = {name: self.full(name) for name in texts(names, "names", self.name)}
        if len(wanted) <= 1:
            return {n: self.server.get(f, None, timeout=timeout) for n, f in wanted.items()}
        tree = self.tree(timeout)
        return {name: _at(tree, name) for name in wanted}

    def describe(self, name: str, value: Any) -> ParameterDescriptor:
        """Return what is known about a parameter, which is its type."""
        kind = type_of(value)
        told = ""
        if value is not None and kind is ParameterType.NOT_SET:
            told = f"A {'namespace' if isinstance(value, dict) else type(value).__name__}."
        return ParameterDescriptor(name, kind, told, dynamic_typing=True)

    def watch(
        self,
        callback: Callable[[ParameterEvent], None],
        executor: Executor,
        where: str,
        before: dict[str, Any] | None = None,
    ) -> Handle:
        """Call `callback` with each change since the values `before`, or since they are known."""
        check_plain(callback, where)
        return _Changes(self, callback, executor, before)


class _Changes(Handle):
    """Tells what has changed between two values of a namespace."""

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
        self._subscription = namespace.server.subscribe(namespace.name, self._take, IMMEDIATE)

    def close(self) -> None:
        self._listeners.clear()
        self._subscription.close()

    def _take(self, value: Any) -> None:
        now = dict(flat(value)) if isinstance(value, dict) else {}
        before, self._before = self._before, now
        if before is None:
            return
        new = {name: now[name] for name in now if name not in before}
        changed = {n: now[n] for n in now if n in before and not same(now[n], before[n])}
        deleted = tuple(name for name in before if name not in now)
        if new or changed or deleted:
            self._listeners.notify(ParameterEvent(self._name, new, changed, deleted))


def type_of(value: Any) -> ParameterType:
    """Return a value's type, NOT_SET for what only ROS 1 has: namespaces, mixed lists, dates."""
    if isinstance(value, list):
        kinds = {type(item) for item in value}
        return (
            _ARRAYS.get(kinds.pop(), ParameterType.NOT_SET)
            if len(kinds) == 1
            else (ParameterType.NOT_SET)
        )
    return _SCALARS.get(type(value), ParameterType.NOT_SET)


def check_values(values: object, where: str) -> None:
    """Raise ParameterError unless `values` gives values by name."""
    if not isinstance(values, Mapping):
        raise ParameterError(
            f"{where}: parameters are set by a dict of names and values, e.g. "
            f"set({{'speed': 1.5}}); got {values!r}"
        )


def texts(given: object, what: str, where: str) -> list[str]:
    """Return names as a list; raises ParameterError."""
    if isinstance(given, str):
        return [given]
    if not isinstance(given, Iterable):
        raise ParameterError(f"{where}: {what} must be a list of names, got {given!r}")
    return list(given)


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

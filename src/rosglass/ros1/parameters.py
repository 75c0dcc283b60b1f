"""The parameters of our own node: those in its private namespace on the parameter server."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import TYPE_CHECKING

from rosglass.comm import Handle, ParameterDescriptor, Parameters, ParameterType
from rosglass.comm.similar import similar
from rosglass.errors import ParameterError, UnsupportedError
from rosglass.ros1.parameter_namespace import ParameterNamespace, check_values
from rosglass.ros1.parameter_values import flat, to_wire

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from os import PathLike

    from rosglass.comm import Executor, ParameterEvent, ParameterValue
    from rosglass.ros1.core import Core
    from rosglass.ros1.parameter_server import ParameterServer

__all__ = ["Ros1Parameters"]

_TIMEOUT = 5.0


class Ros1Parameters(Parameters):
    """A node's own parameters, ``~name``; :attr:`Node.parameters`.

    They live on the master's parameter server, where every node can set them, to values of any
    type: nothing can be refused, and no parameter is read-only, has a range or keeps its type.
    Groups are namespaces: ``camera/exposure``. Values may be what only ROS 1 has: namespaces as
    dicts, lists of several types, dates. Each method asks the master and waits up to 5 s for it;
    :attr:`Ros1Node.parameter_server` can do so without waiting.

    Raises:
        ConnectionLostError: The master does not answer; from every method.
        InvalidNameError: A name breaks ROS's rules; from every method that takes one.
    """

    def __init__(self, core: Core, server: ParameterServer) -> None:
        self.node = core.name.full
        self._core, self._server = core, server
        self._namespace = ParameterNamespace(server, core.name.full)
        self._lock = threading.Lock()
        self._declared: dict[str, ParameterDescriptor] = {}

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.node}>"

    def declare(
        self,
        name: str,
        default: ParameterValue = None,
        descriptor: ParameterDescriptor | None = None,
    ) -> ParameterValue:
        """Return a parameter's value; where it has none, `default` is set, for others to see.

        Args:
            name: Its name.
            default: Its value unless the parameter server has another one.
            descriptor: A description for :meth:`describe`; others cannot read it.

        Raises:
            ParameterError: It is declared already, or can be no parameter's value.
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
                f"parameter {full}: ROS 1's parameter server knows no {what.removeprefix('a ')}: "
                "every node may set everything; check the value where it is used"
            )
        if default is not None:
            to_wire(full, default)
        with self._lock:
            if name in self._declared:
                raise ParameterError(f"{self.node}: parameter {name!r} is declared already")
            self._declared[name] = descriptor
        try:
            value: ParameterValue = self._server.get(full, None)
            if value is None and default is not None:
                self._server.set(full, default)
        except BaseException:
            with self._lock:
                del self._declared[name]
            raise
        return default if value is None else value

    def undeclare(self, name: str) -> None:
        """Forget and delete a parameter; raises ParameterError when it is neither there nor known.

        It may be gone from the server already: others can delete it, too.
        """
        self._core.check_open()
        with self._lock:
            declared = self._declared.pop(name, None)
        full = self._namespace.full(name)
        if declared is None or self._server.has(full):
            self._server.delete(full)

    def get(self, name: str) -> ParameterValue:
        """Return its value, None for one that is declared and not set.

        Raises:
            ParameterError: It is neither declared nor set; similar names are told.
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
            ParameterError: A value can be no parameter's; then none is set.
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
        """Return its type, and what it was declared with; errors as of :meth:`get`."""
        found = self._namespace.describe(name, self.get(name))
        declared = self._declared.get(name)
        if declared is None:
            return found
        kind = declared.type if found.type is ParameterType.NOT_SET else found.type
        return replace(declared, name=name, type=kind, dynamic_typing=True)

    def names(self) -> list[str]:
        """Return the names that are set or declared, sorted."""
        self._core.check_open()
        there = (name for name, _ in flat(self._namespace.tree(_TIMEOUT)))
        return sorted({*there, *self._declared})

    def on_set(self, validate: Callable[[Mapping[str, ParameterValue]], str]) -> Handle:
        """Raise UnsupportedError: nobody asks a node before its parameters are set."""
        raise UnsupportedError(
            f"{self.node}: ROS 1's parameter server takes every value without asking "
            f"{getattr(validate, '__name__', validate)!r}; on_change() tells afterwards"
        )

    def on_change(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each change, whoever makes it; quick ones may be merged."""
        self._core.check_open()
        chosen = executor or self._core.dispatcher
        where, before = f"{self.node}: on_change()", dict(flat(self._namespace.tree(_TIMEOUT)))
        return self._namespace.watch(callback, chosen, where, before)

    def load(self, path: str | PathLike[str]) -> None:
        """Set what a file has, as ``rosparam load FILE /node`` does; declared or not.

        Raises:
            ParameterError: The file cannot be read or is empty, or has a value that can be no
                parameter's; nothing is set then.
        """
        if not self._server.load(path, self.node):
            raise ParameterError(f"{path} has no parameters")

    def save(self, path: str | PathLike[str]) -> None:
        """Write the parameters into a file, as ``rosparam dump FILE /node`` does."""
        self._core.check_open()
        from rosglass.ros1 import parameter_files  # noqa: PLC0415 - yaml

        parameter_files.write(path, self._namespace.tree(_TIMEOUT))

    def close(self) -> None:
        """Do nothing: the parameters stay on the server, and callbacks end with the node."""

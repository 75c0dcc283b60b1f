"""Parameters of this node and of other nodes."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from rosglass.comm.executor import check_plain
from rosglass.comm.handle import Handle
from rosglass.comm.promise import Deadline
from rosglass.errors import ArgumentError, NodeClosedError, ParameterError, UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from os import PathLike

    from rosglass.comm.handle import Executor

__all__ = [
    "ParameterClient",
    "ParameterDescriptor",
    "ParameterEvent",
    "ParameterType",
    "ParameterValue",
    "Parameters",
    "Range",
    "RemoteParameters",
    "SetResult",
    "check_values",
]

#: The value of a parameter; None if it is not set.
ParameterValue: TypeAlias = (
    "bool | int | float | str | bytes | list[bool] | list[int] | list[float] | list[str] | None"
)


class ParameterType(IntEnum):
    """Types of parameters (rcl_interfaces/msg/ParameterType)."""

    NOT_SET = 0
    BOOL = 1
    INTEGER = 2
    DOUBLE = 3
    STRING = 4
    BYTE_ARRAY = 5
    BOOL_ARRAY = 6
    INTEGER_ARRAY = 7
    DOUBLE_ARRAY = 8
    STRING_ARRAY = 9


class Range(NamedTuple):
    """Allowed values of a number, both ends included.

    Attributes:
        low: Smallest value.
        high: Greatest value.
        step: Distance between allowed values, from `low` on; 0 for any. `high` is always allowed.
    """

    low: float
    high: float
    step: float = 0


@dataclass(frozen=True, slots=True)
class ParameterDescriptor:
    """The properties of a parameter besides its value.

    Attributes:
        name: Its name, e.g. ``camera.exposure``.
        type: Its type.
        description: A description for users.
        constraints: Further constraints, described for users.
        read_only: Whether it can only be set when it is declared.
        dynamic_typing: Whether its type may change.
        range: Allowed values of a number; None for all.
    """

    name: str = ""
    type: ParameterType = ParameterType.NOT_SET
    description: str = ""
    constraints: str = ""
    read_only: bool = False
    dynamic_typing: bool = False
    range: Range | None = None


class SetResult(NamedTuple):
    """The result of setting a parameter.

    Attributes:
        successful: True if the parameter was set.
        reason: Why it was not set, as the node reports it.
    """

    successful: bool
    reason: str = ""


@dataclass(frozen=True, slots=True)
class ParameterEvent:
    """Parameters of one node that changed together.

    Attributes:
        node: Full name of the node.
        new: Values of the parameters that were declared.
        changed: New values of the parameters that were changed.
        deleted: Names of the parameters that were deleted.
    """

    node: str
    new: Mapping[str, ParameterValue]
    changed: Mapping[str, ParameterValue]
    deleted: Sequence[str]


class Parameters(Handle):
    """The parameters of this node, which other nodes may read and set; see :attr:`Node.parameters`.

    A parameter keeps the type it was declared with: one declared as 1.0 can be set to neither 1
    nor "1.0", unless its descriptor has `dynamic_typing`.
    """

    def __contains__(self, name: object) -> bool:
        return name in self.names()

    @abstractmethod
    def declare(
        self,
        name: str,
        default: ParameterValue = None,
        descriptor: ParameterDescriptor | None = None,
    ) -> ParameterValue:
        """Declare a parameter and return its value: the override from the start, or `default`.

        Args:
            name: Its name; dots group parameters, as in ``camera.exposure``.
            default: Its value, unless the program was started with a different one.
            descriptor: Its other properties. The type is that of `default`; without a default, set
                it here, or allow any type with `dynamic_typing`.

        Raises:
            ParameterError: It is declared already, or the value violates the descriptor.
        """

    @abstractmethod
    def undeclare(self, name: str) -> None:
        """Remove a parameter; raises ParameterError if it is not declared or read-only."""

    @abstractmethod
    def get(self, name: str) -> ParameterValue:
        """Return the value of a parameter; raises ParameterError if it is not declared."""

    @abstractmethod
    def set(self, values: Mapping[str, ParameterValue]) -> None:
        """Set parameters, all or none; raises ParameterError with the reason.

        An empty list keeps the parameter's type. None removes a parameter with dynamic typing.
        """

    @abstractmethod
    def describe(self, name: str) -> ParameterDescriptor:
        """Return the properties of a parameter; raises ParameterError if it is not declared."""

    @abstractmethod
    def names(self) -> list[str]:
        """Return the declared names, sorted."""

    @abstractmethod
    def on_set(self, validate: Callable[[Mapping[str, ParameterValue]], str]) -> Handle:
        """Validate values before they are set.

        Args:
            validate: Returns why the values must not be set; an empty string accepts them, an
                exception refuses them. It runs in the thread that sets them, before anything
                changes; if another node sets them, on one of this node's threads.
        """

    @abstractmethod
    def on_change(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each change of parameters."""

    def load(self, path: str | PathLike[str]) -> None:
        """Set declared parameters, all or none, to a file's values for this node.

        Raises:
            ParameterError: The file cannot be read, names a parameter that is not declared, or
                has a value that is refused; the message gives the place.
        """
        raise UnsupportedError(f"{type(self).__name__} has no parameter files")

    def save(self, path: str | PathLike[str]) -> None:
        """Write the parameters to a file for :meth:`load`; raises ParameterError."""
        raise UnsupportedError(f"{type(self).__name__} has no parameter files")


class RemoteParameters(Handle):
    """The protocol of a :class:`ParameterClient`, of ROS 1 or ROS 2.

    Its arguments have been checked by the client.

    Attributes:
        node: Full name of the other node.
    """

    node: str

    def __repr__(self) -> str:
        return f"<parameters of {self.node}>"

    @property
    @abstractmethod
    def ready(self) -> bool:
        """True while the parameters are available."""

    @abstractmethod
    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait until they are available; return whether they are."""

    @abstractmethod
    def find(self, prefixes: list[str], depth: int, deadline: Deadline) -> list[str]:
        """Return the names below one of `prefixes` (none: all), up to `depth` levels (0: all)."""

    @abstractmethod
    def values(self, names: list[str] | None, deadline: Deadline) -> dict[str, ParameterValue]:
        """Return values by name (`names` None: of all parameters); None for those not set."""

    @abstractmethod
    def descriptors(
        self, names: list[str] | None, deadline: Deadline
    ) -> dict[str, ParameterDescriptor]:
        """Return descriptors by name (`names` None: of all parameters)."""

    @abstractmethod
    def set(self, values: Mapping[str, ParameterValue], deadline: Deadline) -> dict[str, SetResult]:
        """Set parameters one by one; raises ParameterError before anything is sent."""

    @abstractmethod
    def set_atomically(self, values: Mapping[str, ParameterValue], deadline: Deadline) -> SetResult:
        """Set parameters, all or none; raises the errors of :meth:`set`, or UnsupportedError."""

    @abstractmethod
    def watch(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None
    ) -> Handle:
        """Call `callback` with each change, until the handle or this object is closed."""

    @abstractmethod
    def load(self, path: str | PathLike[str], deadline: Deadline) -> list[str]:
        """Set the parameters that a file contains for the node; return their names."""

    @abstractmethod
    def save(self, path: str | PathLike[str], deadline: Deadline) -> None:
        """Write the parameters to a file for :meth:`load`; raises ParameterError."""


class ParameterClient(Handle):
    """Reads and sets another node's parameters; created by :meth:`Node.create_parameter_client`.

    Methods that call the node take `timeout`, the total seconds to wait (None for no limit), and
    raise ServiceUnavailableError if the node or its parameters are not available, TimeoutError if
    it does not answer, and NodeClosedError.

    In ROS 1, parameters are on the master's parameter server, whether the node runs or not, and so
    are those of any other namespace, including ``/``. Groups are namespaces: ``camera/exposure``.
    Values may also be namespaces as dicts, lists of several types, and dates; None deletes. If the
    master does not answer within `timeout`, at most 5 s, ConnectionLostError is raised.

    Args:
        remote: The protocol by which the parameters are reached.

    Attributes:
        node: Full name of the other node.
    """

    def __init__(self, remote: RemoteParameters) -> None:
        self.node, self._remote = remote.node, remote
        self._closed = False

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.node}>"

    @property
    def ready(self) -> bool:
        """True while the node (in ROS 1, the master) is available and serves parameters."""
        return not self._closed and self._remote.ready

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for the node (in ROS 1, the master); return whether it is available."""
        self._check_open()
        return self._remote.wait_for_server(timeout)

    def names(
        self, prefixes: Iterable[str] = (), depth: int = 0, *, timeout: float | None = 10.0
    ) -> list[str]:
        """Return the names of its parameters, sorted.

        Args:
            prefixes: Only names below one of these; none for all.
            depth: Levels below the prefix; 0 for all.
            timeout: Seconds to wait.
        """
        deadline = self._deadline(timeout)
        wanted = self._texts(prefixes, "prefixes")
        if type(depth) is not int or depth < 0:
            raise ArgumentError("depth", depth, "a number of levels, 0 for all", self.node)
        return sorted(self._remote.find(wanted, depth, deadline))

    def get(
        self, names: Iterable[str] | None = None, *, timeout: float | None = 10.0
    ) -> dict[str, ParameterValue]:
        """Return the values of parameters by name; without `names`, of all.

        The value is None if a parameter is not declared or not set.
        """
        deadline = self._deadline(timeout)
        return self._remote.values(self._names(names), deadline)

    def describe(
        self, names: Iterable[str] | None = None, *, timeout: float | None = 10.0
    ) -> dict[str, ParameterDescriptor]:
        """Return the properties of parameters by name; without `names`, of all.

        The type is NOT_SET if a parameter is not declared. In ROS 1, the type is the only property.
        """
        deadline = self._deadline(timeout)
        return self._remote.descriptors(self._names(names), deadline)

    def set(
        self, values: Mapping[str, ParameterValue], *, timeout: float | None = 10.0
    ) -> dict[str, SetResult]:
        """Set parameters one by one; return the node's answer by name.

        Types matter: a node refuses 1 for a parameter that is 1.0. For an empty list, this first
        requests the type from the node.

        Raises:
            ParameterError: A value has a type that parameters cannot have; nothing is sent.
        """
        deadline = self._deadline(timeout)
        check_values(values, self.node)
        return self._remote.set(values, deadline)

    def set_atomically(
        self, values: Mapping[str, ParameterValue], *, timeout: float | None = 10.0
    ) -> SetResult:
        """Set parameters, all or none; return the node's answer.

        Types and errors as in :meth:`set`.

        Raises:
            UnsupportedError: ROS 1 cannot set several parameters at once.
        """
        deadline = self._deadline(timeout)
        check_values(values, self.node)
        return self._remote.set_atomically(values, deadline)

    def watch(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each change of the node's parameters.

        In ROS 1 this waits for the current values to compare with, and changes in quick succession
        may be merged.
        """
        self._check_open()
        check_plain(callback, f"{self.node}: watch()")
        return self._remote.watch(callback, executor)

    def load(self, path: str | PathLike[str], *, timeout: float | None = 10.0) -> list[str]:
        """Set parameters, one by one, to a file's values for the node; return their names.

        In ROS 1 like ``rosparam load FILE /node``.

        Raises:
            ParameterError: The file cannot be read or has no values for the node, or the node
                refuses values; the message lists them.
        """
        return self._remote.load(path, self._deadline(timeout))

    def save(self, path: str | PathLike[str], *, timeout: float | None = 10.0) -> None:
        """Write the node's parameters to a file for :meth:`load`; raises ParameterError."""
        self._remote.save(path, self._deadline(timeout))

    def close(self) -> None:
        """End all calls and callbacks; safe to call twice."""
        self._closed = True
        self._remote.close()

    def _deadline(self, timeout: float | None) -> Deadline:
        self._check_open()
        return Deadline(timeout, self.node)

    def _check_open(self) -> None:
        if self._closed:
            raise NodeClosedError(f"{self!r} is closed; create another one")

    def _names(self, names: Iterable[str] | None) -> list[str] | None:
        if names is None:
            return None
        wanted = self._texts(names, "names")
        for name in wanted:
            if not isinstance(name, str) or not name:
                raise ParameterError(
                    f"{self.node}: a parameter's name must be a non-empty string, got {name!r}"
                )
        return list(dict.fromkeys(wanted))

    def _texts(self, given: object, what: str) -> list[str]:
        if isinstance(given, str):
            return [given]
        if not isinstance(given, Iterable):
            raise ParameterError(f"{self.node}: {what} must be a list of names, got {given!r}")
        return list(given)


def check_values(values: object, node: str) -> None:
    """Raise ParameterError unless `values` maps names to values."""
    if not isinstance(values, Mapping):
        raise ParameterError(
            f"{node}: parameters are set by a dict of names and values, e.g. "
            f"set({{'speed': 1.5}}); got {values!r}"
        )

"""Parameters: the settings of this node, and those of other nodes."""

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

#: What a parameter can be; None stands for "not set".
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
        step: Distance between allowed values from `low` on; 0 for any. `high` is always allowed.
    """

    low: float
    high: float
    step: float = 0


@dataclass(frozen=True, slots=True)
class ParameterDescriptor:
    """What is known about a parameter besides its value.

    Attributes:
        name: Its name, e.g. ``camera.exposure``.
        type: Its type.
        description: For people.
        constraints: Further rules, for people.
        read_only: Whether it can only be set when it is declared.
        dynamic_typing: Whether its type may change.
        range: Allowed values of a number, None for all.
    """

    name: str = ""
    type: ParameterType = ParameterType.NOT_SET
    description: str = ""
    constraints: str = ""
    read_only: bool = False
    dynamic_typing: bool = False
    range: Range | None = None


class SetResult(NamedTuple):
    """Whether a parameter was set.

    Attributes:
        successful: Whether it was.
        reason: Why not, in the words of the node.
    """

    successful: bool
    reason: str = ""


@dataclass(frozen=True, slots=True)
class ParameterEvent:
    """Parameters of one node that changed together.

    Attributes:
        node: Full name of the node.
        new: Declared just now, with their values.
        changed: Their new values.
        deleted: Names.
    """

    node: str
    new: Mapping[str, ParameterValue]
    changed: Mapping[str, ParameterValue]
    deleted: Sequence[str]


class Parameters(Handle):
    """The parameters of this node, which other nodes may read and set; :attr:`Node.parameters`.

    A parameter keeps the type that it is declared with: neither 1 nor "1.0" can become the value
    of one declared as 1.0. `dynamic_typing` in its descriptor lifts that.
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
        """Make a parameter known and return its value: an override from the start, or `default`.

        Args:
            name: Its name; dots group parameters, as in ``camera.exposure``.
            default: Its value unless the program was started with another one.
            descriptor: What else is to be known about it. Its type is the default's; without a
                default, give the type here, or allow any with `dynamic_typing`.

        Raises:
            ParameterError: It is declared already, or the value breaks the descriptor's rules.
        """

    @abstractmethod
    def undeclare(self, name: str) -> None:
        """Forget a parameter; raises ParameterError."""

    @abstractmethod
    def get(self, name: str) -> ParameterValue:
        """Return its value; raises ParameterError for one that is not declared."""

    @abstractmethod
    def set(self, values: Mapping[str, ParameterValue]) -> None:
        """Set parameters, all or none; raises ParameterError with the reason.

        An empty list keeps the parameter's type. None forgets a parameter with dynamic typing.
        """

    @abstractmethod
    def describe(self, name: str) -> ParameterDescriptor:
        """Return what is known about it; raises ParameterError."""

    @abstractmethod
    def names(self) -> list[str]:
        """Return the declared names, sorted."""

    @abstractmethod
    def on_set(self, validate: Callable[[Mapping[str, ParameterValue]], str]) -> Handle:
        """Let `validate` say why values must not be set; an empty string lets them pass.

        It runs in the thread that sets them, before anything changes; for values that another
        node sets, that is a thread of the node's own. An exception refuses the values, too.
        """

    @abstractmethod
    def on_change(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each change."""

    def load(self, path: str | PathLike[str]) -> None:
        """Set, all or none, the declared parameters that a file has for this node.

        Raises:
            ParameterError: The file cannot be read, names a parameter that is not declared, or
                has a value that is refused; the message says where.
        """
        raise UnsupportedError(f"{type(self).__name__} has no parameter files")

    def save(self, path: str | PathLike[str]) -> None:
        """Write the parameters to a file that can be loaded; raises ParameterError."""
        raise UnsupportedError(f"{type(self).__name__} has no parameter files")


class RemoteParameters(Handle):
    """Another node's parameters, as ROS 1 or ROS 2 lets them be read and set.

    A :class:`ParameterClient` asks it, and has checked what the caller gave.

    Attributes:
        node: Full name of the other node.
    """

    node: str

    def __repr__(self) -> str:
        return f"<parameters of {self.node}>"

    @property
    @abstractmethod
    def ready(self) -> bool:
        """Whether the parameters can be reached."""

    @abstractmethod
    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait until they can be reached; return whether they can."""

    @abstractmethod
    def find(self, prefixes: list[str], depth: int, deadline: Deadline) -> list[str]:
        """Return the names under one of `prefixes` (all without), up to `depth` levels (0: all)."""

    @abstractmethod
    def values(self, names: list[str] | None, deadline: Deadline) -> dict[str, ParameterValue]:
        """Return values by name, of all without `names`; None for what has none."""

    @abstractmethod
    def descriptors(
        self, names: list[str] | None, deadline: Deadline
    ) -> dict[str, ParameterDescriptor]:
        """Return what is known by name, of all without `names`."""

    @abstractmethod
    def set(self, values: Mapping[str, ParameterValue], deadline: Deadline) -> dict[str, SetResult]:
        """Set parameters one by one; raises ParameterError before anything is sent."""

    @abstractmethod
    def set_atomically(self, values: Mapping[str, ParameterValue], deadline: Deadline) -> SetResult:
        """Set parameters, all or none; raises as :meth:`set`, or UnsupportedError."""

    @abstractmethod
    def watch(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None
    ) -> Handle:
        """Call `callback` with each change, until the handle, or this, is closed."""

    @abstractmethod
    def load(self, path: str | PathLike[str], deadline: Deadline) -> list[str]:
        """Set what a file has for the node; return the names; raises ParameterError."""

    @abstractmethod
    def save(self, path: str | PathLike[str], deadline: Deadline) -> None:
        """Write a file that can be loaded; raises ParameterError."""


class ParameterClient(Handle):
    """Reads and sets another node's parameters; made by :meth:`Node.create_parameter_client`.

    Every method that asks the node takes `timeout`, seconds in all (None waits for ever), and
    raises ServiceUnavailableError when the node (or its parameters) cannot be reached,
    TimeoutError when it does not answer, and NodeClosedError.

    In ROS 1, parameters live on the master's parameter server, whether the node runs or not, and
    so do those in any other namespace, ``/`` included. Groups are namespaces there:
    ``camera/exposure``. Values may be what only ROS 1 has: namespaces as dicts, lists of several
    types, dates; None deletes. A master that does not answer within `timeout`, 5 s at most, is a
    ConnectionLostError.

    Args:
        remote: The other node's parameters.

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
        """Whether the node is there and serves its parameters; in ROS 1, the master."""
        return not self._closed and self._remote.ready

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for the node, in ROS 1 for the master; return whether it is there."""
        self._check_open()
        return self._remote.wait_for_server(timeout)

    def names(
        self, prefixes: Iterable[str] = (), depth: int = 0, *, timeout: float | None = 10.0
    ) -> list[str]:
        """Return the names of its parameters, sorted.

        Args:
            prefixes: Only those under one of these; none for all.
            depth: Levels below the prefix, 0 for all.
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
        """Return the values of parameters, of all without `names`.

        Those that are not declared, or have no value, are None.
        """
        deadline = self._deadline(timeout)
        return self._remote.values(self._names(names), deadline)

    def describe(
        self, names: Iterable[str] | None = None, *, timeout: float | None = 10.0
    ) -> dict[str, ParameterDescriptor]:
        """Return what is known about parameters, about all without `names`.

        Those that are not declared have the type NOT_SET. ROS 1 knows no more than the type.
        """
        deadline = self._deadline(timeout)
        return self._remote.descriptors(self._names(names), deadline)

    def set(
        self, values: Mapping[str, ParameterValue], *, timeout: float | None = 10.0
    ) -> dict[str, SetResult]:
        """Set parameters one by one; return what the node says to each.

        The type matters: a node refuses 1 for a parameter that is 1.0. For an empty list, the node
        is asked for the type first.

        Raises:
            ParameterError: A value can be no parameter's; nothing is sent.
        """
        deadline = self._deadline(timeout)
        check_values(values, self.node)
        return self._remote.set(values, deadline)

    def set_atomically(
        self, values: Mapping[str, ParameterValue], *, timeout: float | None = 10.0
    ) -> SetResult:
        """Set parameters, all or none; return what the node says.

        Types and errors as in :meth:`set`.

        Raises:
            UnsupportedError: There are several, which ROS 1 cannot set at once.
        """
        deadline = self._deadline(timeout)
        check_values(values, self.node)
        return self._remote.set_atomically(values, deadline)

    def watch(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each change of the node's parameters.

        In ROS 1 this waits for the values that changes are compared with, and changes in quick
        succession may be merged.
        """
        self._check_open()
        check_plain(callback, f"{self.node}: watch()")
        return self._remote.watch(callback, executor)

    def load(self, path: str | PathLike[str], *, timeout: float | None = 10.0) -> list[str]:
        """Set, one by one, the parameters that a file has for the node; return their names.

        In ROS 1 as ``rosparam load FILE /node`` does.

        Raises:
            ParameterError: The file cannot be read or has nothing for the node, or the node
                refuses a value; the message lists all that it refused.
        """
        return self._remote.load(path, self._deadline(timeout))

    def save(self, path: str | PathLike[str], *, timeout: float | None = 10.0) -> None:
        """Write the node's parameters to a file that can be loaded; raises ParameterError."""
        self._remote.save(path, self._deadline(timeout))

    def close(self) -> None:
        """Ask and watch no more; safe to call twice."""
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
                    f"{self.node}: a parameter's name must be a text that is not empty, "
                    f"got {name!r}"
                )
        return list(dict.fromkeys(wanted))

    def _texts(self, given: object, what: str) -> list[str]:
        if isinstance(given, str):
            return [given]
        if not isinstance(given, Iterable):
            raise ParameterError(f"{self.node}: {what} must be a list of names, got {given!r}")
        return list(given)


def check_values(values: object, node: str) -> None:
    """Raise ParameterError unless `values` gives values by name."""
    if not isinstance(values, Mapping):
        raise ParameterError(
            f"{node}: parameters are set by a dict of names and values, e.g. "
            f"set({{'speed': 1.5}}); got {values!r}"
        )

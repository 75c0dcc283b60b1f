"""Parameters: the settings of this node, and those of other nodes."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from rosglass.comm.node import Handle
from rosglass.errors import UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from os import PathLike

    from rosglass.comm.node import Executor

__all__ = [
    "ParameterClient",
    "ParameterDescriptor",
    "ParameterEvent",
    "ParameterType",
    "ParameterValue",
    "Parameters",
    "Range",
    "SetResult",
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


class ParameterClient(Handle):
    """Reads and sets another node's parameters; made by :meth:`Node.create_parameter_client`.

    Every method that asks the node takes `timeout`, seconds in all (None waits for ever), and
    raises ServiceUnavailableError when the node (or its parameters) cannot be reached,
    TimeoutError when it does not answer, and NodeClosedError.

    Attributes:
        node: Full name of the other node.
    """

    node: str

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.node}>"

    @property
    @abstractmethod
    def ready(self) -> bool:
        """Whether the node is there and serves its parameters."""

    @abstractmethod
    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for the node; return whether it is there."""

    @abstractmethod
    def names(
        self, prefixes: Iterable[str] = (), depth: int = 0, *, timeout: float | None = 10.0
    ) -> list[str]:
        """Return the names of its parameters, sorted.

        Args:
            prefixes: Only those under one of these; none for all.
            depth: Levels below the prefix, 0 for all.
            timeout: Seconds to wait.
        """

    @abstractmethod
    def get(
        self, names: Iterable[str] | None = None, *, timeout: float | None = 10.0
    ) -> dict[str, ParameterValue]:
        """Return the values of parameters, of all without `names`.

        Those that are not declared, or have no value, are None.
        """

    @abstractmethod
    def describe(
        self, names: Iterable[str] | None = None, *, timeout: float | None = 10.0
    ) -> dict[str, ParameterDescriptor]:
        """Return what is known about parameters, about all without `names`.

        Those that are not declared have the type NOT_SET.
        """

    @abstractmethod
    def set(
        self, values: Mapping[str, ParameterValue], *, timeout: float | None = 10.0
    ) -> dict[str, SetResult]:
        """Set parameters one by one; return what the node says to each.

        The type matters: a node refuses 1 for a parameter that is 1.0. For an empty list, the node
        is asked for the type first.

        Raises:
            ParameterError: A value can be no parameter's; nothing is sent.
        """

    @abstractmethod
    def set_atomically(
        self, values: Mapping[str, ParameterValue], *, timeout: float | None = 10.0
    ) -> SetResult:
        """Set parameters, all or none; return what the node says.

        Types and errors as in :meth:`set`.
        """

    @abstractmethod
    def watch(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each change of the node's parameters."""

    def load(self, path: str | PathLike[str], *, timeout: float | None = 10.0) -> list[str]:
        """Set, one by one, the parameters that a file has for the node; return their names.

        Raises:
            ParameterError: The file cannot be read or has nothing for the node, or the node
                refuses a value; the message lists all that it refused.
        """
        raise UnsupportedError(f"{type(self).__name__} has no parameter files")

    def save(self, path: str | PathLike[str], *, timeout: float | None = 10.0) -> None:
        """Write the node's parameters to a file that can be loaded; raises ParameterError."""
        raise UnsupportedError(f"{type(self).__name__} has no parameter files")

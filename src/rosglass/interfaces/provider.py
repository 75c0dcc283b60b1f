"""What the library asks for definitions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from rosglass.errors import DefinitionConflictError
from rosglass.interfaces.definition import ActionDefinition, Definition, ServiceDefinition

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from rosglass.interfaces.definition import InterfaceDefinition

__all__ = ["MemoryProvider", "Provider", "difference"]


class Provider(ABC):
    """A place that definitions come from.

    Attributes:
        name: Short name, which users pass to :meth:`rosglass.Library.prefer`.
    """

    name: str

    @abstractmethod
    def find(self, name: str, ros: int) -> Sequence[InterfaceDefinition]:
        """Return the unresolved definitions of a full type name, the best first, or nothing.

        Several are variants that are all fine (other distributions'); the library uses the first,
        unless a peer's hash asks for another.
        """

    @abstractmethod
    def names(self, ros: int) -> Iterable[str]:
        """Return the full names of all types on offer."""

    @abstractmethod
    def describe(self, ros: int) -> str:
        """Say where it looks, for error messages; empty when it has nothing to look at."""

    def views(self, ros: int) -> Iterator[Provider]:  # noqa: ARG002 - part of the interface
        """Yield the provider once for every consistent set of variants that it has."""
        yield self


class MemoryProvider(Provider):
    """Definitions that were handed in, e.g. those received from peers.

    Args:
        name: The provider's name.
    """

    def __init__(self, name: str = "wire") -> None:
        self.name = name
        self._known: dict[tuple[int, str], InterfaceDefinition] = {}

    def add(self, definition: InterfaceDefinition) -> bool:
        """Store a definition; returns whether it is new.

        Raises:
            DefinitionConflictError: Another definition of the type is stored already.
        """
        known = self._known.setdefault((definition.ros, definition.name), definition)
        found = difference(known, definition)
        if found:
            raise DefinitionConflictError(
                f"{definition.name} was received with two definitions: {known.source.provider} "
                f"and {definition.source.provider} differ: {found}. Peers that use both can't be "
                "read with one Library: give each its own"
            )
        return known is definition

    def replace(self, definition: InterfaceDefinition) -> None:
        """Store a definition in place of the one that is stored, if any."""
        self._known[definition.ros, definition.name] = definition

    def find(self, name: str, ros: int) -> Sequence[InterfaceDefinition]:
        """Return the stored definition."""
        found = self._known.get((ros, name))
        return () if found is None else (found,)

    def names(self, ros: int) -> Iterable[str]:
        """Return the full names of the stored definitions."""
        return [name for world, name in list(self._known) if world == ros]

    def describe(self, ros: int) -> str:
        """Say how many definitions were received."""
        count = len(list(self.names(ros)))
        return f"{self.name} ({count} received)" if count else ""


def difference(one: InterfaceDefinition, other: InterfaceDefinition) -> str:
    """Say how two definitions of a type differ on the wire, empty when they don't.

    Compares what the hashes cover: fields and, in ROS 1, constants. Field types that are messages
    are compared by name: their own definitions are compared when they are looked up.
    """
    if one is other:
        return ""
    if isinstance(one, Definition) and isinstance(other, Definition):
        return _message_difference(one, other)
    if isinstance(one, ServiceDefinition) and isinstance(other, ServiceDefinition):
        pairs = {
            "request": (one.request, other.request),
            "response": (one.response, other.response),
        }
    elif isinstance(one, ActionDefinition) and isinstance(other, ActionDefinition):
        pairs = {
            "goal": (one.goal, other.goal),
            "result": (one.result, other.result),
            "feedback": (one.feedback, other.feedback),
        }
    else:
        return "they are different kinds of interfaces"
    for part, (first, second) in pairs.items():
        found = _message_difference(first, second)
        if found:
            return f"in the {part} {found}"
    return ""


def _message_difference(one: Definition, other: Definition) -> str:
    first = [f"{field.type} {field.name}" for field in one.fields]
    second = [f"{field.type} {field.name}" for field in other.fields]
    if one.ros == 1:
        first += [f"{c.type} {c.name}={c.value}" for c in one.constants]
        second += [f"{c.type} {c.name}={c.value}" for c in other.constants]
    if first == second:
        return ""
    for ours, theirs in zip(first, second, strict=False):
        if ours != theirs:
            return f"the first has {ours!r} where the second has {theirs!r}"
    longer = "first" if len(first) > len(second) else "second"
    extra = max(first, second, key=len)[min(len(first), len(second))]
    return f"only the {longer} has {extra!r}"

"""Resolving definitions: finding all message types that they use, within limits."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from rosglass.errors import CyclicTypeError, DefinitionError
from rosglass.interfaces.definition import (
    ActionDefinition,
    ArrayKind,
    Definition,
    ServiceDefinition,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.interfaces.definition import Field, InterfaceDefinition

__all__ = [
    "MAX_DEPTH",
    "MAX_EMPTY",
    "MAX_FIELDS",
    "MAX_FIXED_SIZE",
    "MAX_TYPES",
    "MAX_VALUES",
    "Extent",
    "Resolver",
]

#: Limits for the nesting depth of types, and for the number of types that a definition needs. ROS's
#: own stay below 10 and 20.
MAX_DEPTH = 64
MAX_TYPES = 500
#: Limit for the fields of a message at every depth, counting each occurrence, and array elements
#: once: the generated code grows with them. ROS's own stay below 500.
MAX_FIELDS = 3000
#: Limits for the values of a message with empty sequences, where an array of numbers is one, and
#: for the bytes of its fixed arrays: the memory of an empty message.
MAX_VALUES = 100_000
MAX_FIXED_SIZE = 1 << 25
#: Limit for the messages without fields in a message or sequence: in ROS 1 they take no bytes, so
#: that the size of a buffer does not limit their number.
MAX_EMPTY = 1024

_SIZES = {"bool": 1, "byte": 1, "char": 1, "string": 4, "wstring": 4, "time": 8, "duration": 8}
_SIZES |= {f"{kind}{8 * size}": size for kind in ("int", "uint") for size in (1, 2, 4, 8)}
_SIZES |= {"float32": 4, "float64": 8}
_NONE, _FIXED = ArrayKind.NONE, ArrayKind.FIXED


class Extent:
    """The size of a message type, summed over its fields.

    Attributes:
        depth: Levels of messages, itself included.
        fields: Fields at every depth, those of an array's elements once.
        values: Values at every depth if sequences are empty; an array of numbers is one.
        empties: Messages without fields among them.
        size: Bytes of its fields on the wire if sequences and strings are empty, roughly.
    """

    __slots__ = ("depth", "empties", "fields", "size", "values")

    def __init__(self) -> None:
        self.depth = 1
        self.fields = self.values = self.empties = self.size = 0

    def add(self, owner: Definition, field: Field, inner: Extent | None) -> None:
        """Count one more field.

        Args:
            owner: The message, for errors.
            field: The field.
            inner: The extent of an element that is a message; None for primitives.

        Raises:
            DefinitionError: The message exceeds a limit.
        """
        kind = field.type
        array, count = kind.array, 1
        if array is _FIXED:
            count = kind.size or 1
        self.fields += 1
        if inner is not None:
            self.fields += inner.fields
            self.depth = max(self.depth, 1 + inner.depth)
        if array is not _NONE and array is not _FIXED:
            self.values += 1
            self.size += 4
        elif inner is None:
            self.values += count if kind.name in ("string", "wstring") else 1
            self.size += count * _SIZES[kind.name]
        else:
            self.values += count * (1 + inner.values)
            self.empties += count * (inner.empties if inner.fields else 1)
            self.size += count * inner.size
        if (
            self.fields > MAX_FIELDS
            or self.values > MAX_VALUES
            or self.size > MAX_FIXED_SIZE
            or self.empties > MAX_EMPTY
            or self.depth > MAX_DEPTH
        ):
            raise _error(owner, field, self._beyond(owner.name))

    def _beyond(self, name: str) -> str:
        """Describe which limit is exceeded."""
        if self.depth > MAX_DEPTH:
            return f"types nest deeper than {MAX_DEPTH} levels"
        if self.size > MAX_FIXED_SIZE:
            return f"a {name} would always take more than {MAX_FIXED_SIZE} bytes"
        if self.fields > MAX_FIELDS:
            return f"{name} has more than {MAX_FIELDS} fields, those of nested messages included"
        if self.empties > MAX_EMPTY:
            return f"a {name} would always hold more than {MAX_EMPTY} messages without fields"
        return f"a {name} would always hold more than {MAX_VALUES} values"


class Resolver:
    """Resolves definitions, and caches the results.

    Args:
        find: Called with a full message name and the place that needs it; returns the unresolved
            definition, or raises any error if there is none.
    """

    def __init__(self, find: Callable[[str, Definition, Field], Definition]) -> None:
        self._find = find
        self._done: dict[str, Definition] = {}
        self._extents: dict[str, Extent] = {}
        self._chain: list[str] = []

    def known(self, name: str) -> Definition | None:
        """Return the resolved definition of a message; None if it has not been used yet."""
        return self._done.get(name)

    def resolve(self, definition: InterfaceDefinition) -> InterfaceDefinition:
        """Return the definition with ``nested`` complete, also in its messages.

        Raises:
            CyclicTypeError: A type contains itself.
            DefinitionError: A type is unknown, or a limit is exceeded.
        """
        if isinstance(definition, ServiceDefinition):
            return replace(
                definition,
                request=self.message(definition.request),
                response=self.message(definition.response),
            )
        if isinstance(definition, ActionDefinition):
            return replace(
                definition,
                goal=self.message(definition.goal),
                result=self.message(definition.result),
                feedback=self.message(definition.feedback),
            )
        return self.message(definition)

    def message(self, definition: Definition) -> Definition:
        """Return a message definition resolved; errors as in :meth:`resolve`."""
        done = self._done.get(definition.name)
        if done is not None:
            return done
        nested: dict[str, Definition] = {}
        extent = Extent()
        self._chain.append(definition.name)
        try:
            for field in definition.fields:
                extent.add(definition, field, self._element(definition, field, nested))
        finally:
            self._chain.pop()
        resolved = replace(definition, nested=MappingProxyType(nested))
        self._done[definition.name] = resolved
        self._extents[definition.name] = extent
        return resolved

    def _element(
        self, owner: Definition, field: Field, nested: dict[str, Definition]
    ) -> Extent | None:
        """Resolve a field's type into `nested`; returns its extent, None for a primitive."""
        name = field.type.name
        if not field.type.is_compound:
            return None
        if name in nested:
            return self._extents[name]
        if name in self._chain:
            chain = [*self._chain[self._chain.index(name) :], name]
            raise _error(
                owner, field, f"the type contains itself: {' -> '.join(chain)}", CyclicTypeError
            )
        if len(self._chain) >= MAX_DEPTH:
            raise _error(owner, field, f"types nest deeper than {MAX_DEPTH} levels")
        child = self._done.get(name)
        if child is None:
            child = self.message(self._find(name, owner, field))
        nested.update(child.nested)
        nested[name] = child
        if len(nested) > MAX_TYPES:
            raise _error(owner, field, f"{owner.name} needs more than {MAX_TYPES} other types")
        return self._extents[name]


def _error(
    owner: Definition, field: Field, message: str, kind: type[DefinitionError] = DefinitionError
) -> DefinitionError:
    line, column = field.place
    return kind(f"field {field.name}: {message}", owner.source.file, line, column)

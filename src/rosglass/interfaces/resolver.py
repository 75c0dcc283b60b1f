"""Resolving: finding every message type that a definition needs, and refusing hostile ones."""

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

__all__ = ["MAX_DEPTH", "MAX_FIXED_SIZE", "MAX_TYPES", "Resolver"]

#: How deep types may nest, how many types one definition may need in all, and how many bytes
#: its fixed arrays may take. Real definitions stay below 10, 100 and a few megabytes.
MAX_DEPTH = 64
MAX_TYPES = 1000
MAX_FIXED_SIZE = 1 << 30

_SIZES = {"bool": 1, "byte": 1, "char": 1, "string": 4, "wstring": 4, "time": 8, "duration": 8}


class Resolver:
    """Resolves definitions and remembers the results.

    Args:
        find: Returns the unresolved definition of a full message name; raises what it likes when
            there is none (called with the name and the place that needs it).
    """

    def __init__(self, find: Callable[[str, Definition, Field], Definition]) -> None:
        self._find = find
        self._done: dict[str, Definition] = {}
        self._sizes: dict[str, int] = {}
        self._chain: list[str] = []

    def known(self, name: str) -> Definition | None:
        """Return the resolved definition of a message, None when it was not needed yet."""
        return self._done.get(name)

    def resolve(self, definition: InterfaceDefinition) -> InterfaceDefinition:
        """Return `definition` with ``nested`` complete, its messages' too.

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
        size = 0
        self._chain.append(definition.name)
        try:
            for field in definition.fields:
                element = self._field(definition, field, nested)
                count = field.type.size if field.type.array is ArrayKind.FIXED else 1
                if field.type.array in (ArrayKind.BOUNDED, ArrayKind.UNBOUNDED):
                    element = 4
                size += element * (count or 1)
                if size > MAX_FIXED_SIZE:
                    raise _error(
                        definition,
                        field,
                        f"a {definition.name} would always take more than {MAX_FIXED_SIZE} bytes",
                    )
        finally:
            self._chain.pop()
        resolved = replace(definition, nested=MappingProxyType(nested))
        self._done[definition.name] = resolved
        self._sizes[definition.name] = max(size, 1)
        return resolved

    def _field(self, owner: Definition, field: Field, nested: dict[str, Definition]) -> int:
        """Resolve a field's type into `nested`; returns an element's smallest size in bytes."""
        name = field.type.name
        if not field.type.is_compound:
            return _SIZES.get(name) or int(name.lstrip("uintfloa")) // 8
        if name in nested:
            return self._sizes[name]
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
        return self._sizes[name]


def _error(
    owner: Definition, field: Field, message: str, kind: type[DefinitionError] = DefinitionError
) -> DefinitionError:
    line, column = field.place
    return kind(f"field {field.name}: {message}", owner.source.file, line, column)

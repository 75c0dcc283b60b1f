"""Definitions that peers sent on request, kept under their hashes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.errors import DefinitionError, UnsupportedError
from rosglass.interfaces.definition import Definition, ServiceDefinition, parts_of
from rosglass.interfaces.derived import derive, derived_from
from rosglass.interfaces.hashes import announced_hashes, check_definition, rihs01
from rosglass.interfaces.resolver import Resolver

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.interfaces.definition import Field, InterfaceDefinition

__all__ = ["Versions"]


class Versions:
    """Complete ROS 2 definitions, each under its name and RIHS01 hash.

    Versions of a type exist side by side: the hash that a peer announces says which one it means.
    The library's lock guards all methods.

    Args:
        find: Returns the definition of a message that types imply (times, identifiers) and no
            description has; None when there is none.
    """

    def __init__(self, find: Callable[[str], InterfaceDefinition | None]) -> None:
        self._find = find
        self._known: dict[str, dict[str, InterfaceDefinition]] = {}

    def add(self, definition: InterfaceDefinition) -> str:
        """Store a resolved definition, and those it needs; returns its hash.

        Raises:
            UnsupportedError: It is a ROS 1 definition, or none.
            DefinitionError: It is not resolved.
        """
        check_definition(definition)
        if definition.ros != 2:
            raise UnsupportedError(
                f"{definition.name} is a ROS 1 definition, which has no versions"
            )
        type_hash = rihs01(definition)
        for part in parts_of(definition):
            for nested in part.nested.values():
                self._put(nested, rihs01(nested))
        self._put(definition, type_hash)
        return type_hash

    def find(self, name: str, wanted: str = "") -> InterfaceDefinition | None:
        """Return a version of a type, or of one that a known service or action implies.

        Args:
            name: Full type name.
            wanted: A hash that it is announced by; empty takes what came last.
        """
        known = self._known.get(name, {})
        found = known.get(wanted) if wanted else next(reversed(known.values()), None)
        if found is not None:
            return found
        for version in known.values():
            if isinstance(version, ServiceDefinition) and wanted in announced_hashes(version):
                return version
        for owner, suffix in derived_from(name, 2):
            for version in reversed(self._known.get(owner, {}).values()):
                derived = derive(version, suffix)
                if derived is None:
                    continue
                derived = self._resolver(version).resolve(derived)
                type_hash = rihs01(derived)
                if wanted in ("", type_hash):
                    return self._known.setdefault(name, {}).setdefault(type_hash, derived)
        return None

    def names(self) -> list[str]:
        """Return the full names of the stored types."""
        return list(self._known)

    def _put(self, definition: InterfaceDefinition, type_hash: str) -> None:
        known = self._known.setdefault(definition.name, {})
        # The first object stays: types are made once per definition. It becomes the last to come.
        known[type_hash] = known.pop(type_hash, definition)

    def _resolver(self, owner: InterfaceDefinition) -> Resolver:
        nested = {
            name: inner for part in parts_of(owner) for name, inner in part.nested.items()
        } | {part.name: part for part in parts_of(owner)}

        def find(name: str, needs: Definition, field: Field) -> Definition:
            found = nested.get(name) or needs.nested.get(name) or self._find(name)
            if not isinstance(found, Definition):
                raise DefinitionError(
                    f"field {field.name} has the unknown type {name}", needs.source.file
                )
            return found

        return Resolver(find)

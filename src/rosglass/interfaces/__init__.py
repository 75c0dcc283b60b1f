"""Interface definitions, the library that finds them, and their hashes."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosglass.interfaces.counterparts import Counterparts, Pair, PairedField
    from rosglass.interfaces.definition import (
        ActionDefinition,
        ArrayKind,
        Constant,
        Definition,
        Field,
        FieldType,
        InterfaceDefinition,
        ServiceDefinition,
        Source,
        Value,
    )
    from rosglass.interfaces.derived import service_event
    from rosglass.interfaces.hashes import (
        announced_hashes,
        md5,
        rihs01,
        type_description,
    )
    from rosglass.interfaces.idl import parse_idl
    from rosglass.interfaces.library import Library
    from rosglass.interfaces.names import adding_definitions, join_name, ros1_name, split_name
    from rosglass.interfaces.parser import (
        INTEGER_RANGES,
        PRIMITIVES,
        parse,
        parse_action,
        parse_message,
        parse_service,
    )
    from rosglass.interfaces.provider import (
        DISTRIBUTIONS,
        Distributions,
        Folders,
        MemoryProvider,
        Provider,
        workspace,
    )
    from rosglass.interfaces.texts import full_text, schema_text
    from rosglass.interfaces.type_descriptions import (
        TypeCache,
        add_type_sources,
        cache_folder,
        parse_type_description,
        type_sources,
    )

__all__ = [
    "DISTRIBUTIONS",
    "INTEGER_RANGES",
    "PRIMITIVES",
    "ActionDefinition",
    "ArrayKind",
    "Constant",
    "Counterparts",
    "Definition",
    "Distributions",
    "Field",
    "FieldType",
    "Folders",
    "InterfaceDefinition",
    "Library",
    "MemoryProvider",
    "Pair",
    "PairedField",
    "Provider",
    "ServiceDefinition",
    "Source",
    "TypeCache",
    "Value",
    "add_type_sources",
    "adding_definitions",
    "announced_hashes",
    "cache_folder",
    "full_text",
    "join_name",
    "md5",
    "parse",
    "parse_action",
    "parse_idl",
    "parse_message",
    "parse_service",
    "parse_type_description",
    "rihs01",
    "ros1_name",
    "schema_text",
    "service_event",
    "split_name",
    "type_description",
    "type_sources",
    "workspace",
]

_HOMES = {
    "counterparts": (
        "Counterparts",
        "Pair",
        "PairedField",
    ),
    "definition": (
        "ActionDefinition",
        "ArrayKind",
        "Constant",
        "Definition",
        "Field",
        "FieldType",
        "InterfaceDefinition",
        "ServiceDefinition",
        "Source",
        "Value",
    ),
    "derived": ("service_event",),
    "hashes": (
        "announced_hashes",
        "md5",
        "rihs01",
        "type_description",
    ),
    "idl": ("parse_idl",),
    "library": ("Library",),
    "names": (
        "adding_definitions",
        "join_name",
        "ros1_name",
        "split_name",
    ),
    "parser": (
        "INTEGER_RANGES",
        "PRIMITIVES",
        "parse",
        "parse_action",
        "parse_message",
        "parse_service",
    ),
    "provider": (
        "DISTRIBUTIONS",
        "Distributions",
        "Folders",
        "MemoryProvider",
        "Provider",
        "workspace",
    ),
    "texts": ("full_text", "schema_text"),
    "type_descriptions": (
        "TypeCache",
        "add_type_sources",
        "cache_folder",
        "parse_type_description",
        "type_sources",
    ),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    # Imported on first use: before its first frame, a user interface needs names only.
    if name not in _HOME_OF:
        raise AttributeError(f"module 'rosglass.interfaces' has no attribute {name!r}")
    value: object = getattr(import_module(f"rosglass.interfaces.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)

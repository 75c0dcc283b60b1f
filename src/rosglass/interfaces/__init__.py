"""Interface definitions, the library that finds them, and their hashes."""

from __future__ import annotations

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
from rosglass.interfaces.hashes import announced_hashes, full_text, md5, rihs01, type_description
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
    "service_event",
    "split_name",
    "type_description",
    "type_sources",
    "workspace",
]

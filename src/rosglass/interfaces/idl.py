"""``.idl`` definitions of ROS 2, read by rosbags' IDL parser."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import DefinitionError
from rosglass.interfaces.definition import (
    ActionDefinition,
    ArrayKind,
    Constant,
    Definition,
    Field,
    FieldType,
    ServiceDefinition,
    Source,
)
from rosglass.interfaces.names import join_name

if TYPE_CHECKING:
    from rosglass.interfaces.definition import InterfaceDefinition

__all__ = ["parse_idl"]

_PLACEHOLDER = "structure_needs_at_least_one_member"
_ARRAYS = {3: ArrayKind.FIXED, 4: ArrayKind.UNBOUNDED}


def parse_idl(
    text: str, name: str, *, file: str = "", provider: str = "text"
) -> InterfaceDefinition:
    """Parse an IDL file.

    Args:
        text: The IDL.
        name: Full name of the type to take from it; ``pkg/Type`` means a message.
        file: Label for error messages.
        provider: Recorded in the definition's source.

    Raises:
        DefinitionError: The text is not IDL, or has no such type.
        InvalidNameError: `name` is not a type name.
    """
    from rosbags.typesys import TypesysError, get_types_from_idl  # noqa: PLC0415 - 40 ms

    full = join_name(name)
    source = Source(provider, file or f"<{full}>")
    try:
        types = get_types_from_idl(text)
    except TypesysError as error:
        raise DefinitionError(f"the IDL can't be parsed: {error}", source.file) from error
    messages = {key: _definition(key, types[key], source) for key in types}
    return _pick(full, messages, text, source)


def _pick(
    full: str, messages: dict[str, Definition], text: str, source: Source
) -> InterfaceDefinition:
    def part(suffix: str) -> Definition:
        found = messages.get(f"{full}{suffix}")
        if found is None:
            known = ", ".join(messages) or "nothing"
            raise DefinitionError(f"the IDL has no {full}{suffix}; it has {known}", source.file)
        return found

    kind = full.split("/")[1]
    if kind == "srv" and full not in messages:
        return ServiceDefinition(full, 2, part("_Request"), part("_Response"), text, source)
    if kind == "action" and full not in messages:
        return ActionDefinition(
            full, 2, part("_Goal"), part("_Result"), part("_Feedback"), text, source
        )
    return part("")


def _definition(name: str, parsed: Any, source: Source) -> Definition:
    constants, fields = parsed
    return Definition(
        name=name,
        ros=2,
        fields=tuple(
            Field(field, _type(description))
            for field, description in fields
            if field != _PLACEHOLDER
        ),
        constants=tuple(Constant(key, kind, value, str(value)) for key, kind, value in constants),
        source=source,
    )


def _type(description: Any) -> FieldType:
    kind, rest = int(description[0]), description[1]
    if kind == 1:
        return FieldType(str(rest[0]), string_bound=rest[1] or None)
    if kind == 2:
        return FieldType(str(rest))
    inner = _type(rest[0])
    array = ArrayKind.BOUNDED if kind == 4 and rest[1] else _ARRAYS[kind]
    return FieldType(inner.name, array, rest[1] or None, inner.string_bound)

"""Texts of definitions: ``.msg`` and IDL written from a definition, and with all types it uses.

Recordings join definitions as https://mcap.dev/spec/registry describes for ``ros2msg`` and
``ros2idl``.
"""

from __future__ import annotations

import math
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.errors import DefinitionError
from rosglass.interfaces.definition import (
    PLACEHOLDER,
    ActionDefinition,
    ArrayKind,
    Definition,
    Field,
    FieldType,
    ServiceDefinition,
    parts_of,
)
from rosglass.interfaces.hashes import check_definition, nested_definition
from rosglass.interfaces.names import split_name
from rosglass.interfaces.parser import find_unit, parse_action, parse_message, parse_service

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from rosglass.interfaces.definition import Constant, InterfaceDefinition, Value

__all__ = ["full_text", "idl_text", "message_text", "schema_text"]

_LINE = "=" * 80
_PARSERS = {
    Definition: parse_message,
    ServiceDefinition: parse_service,
    ActionDefinition: parse_action,
}
_ESCAPES = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"}


def full_text(definition: InterfaceDefinition) -> str:
    """Return the definition followed by the ones it uses, as in ROS 1 connection headers.

    IDL is translated to ``.msg``.

    Raises:
        UnsupportedError: `definition` is not a definition.
        DefinitionError: `definition` is not resolved.
    """
    check_definition(definition)
    texts = [_received_or_written(definition)]
    for name, nested in _needed(definition).items():
        texts.append(f"{_LINE}\nMSG: {_short(name)}\n{_received_or_written(nested)}")
    return "\n".join(texts)


def schema_text(definition: Definition) -> tuple[str, str]:
    """Return the language (``msg`` or ``idl``) and text of a message type for a recording.

    It is ``.msg``, which all tools read, unless a type has what only IDL can say: its own ``char``,
    or names with other letters.

    Raises:
        UnsupportedError: `definition` is not a definition.
        DefinitionError: `definition` is not resolved.
    """
    check_definition(definition)
    messages = {definition.name: definition, **_needed(definition)}
    if definition.ros == 1 or all(
        _is_msg(part) or _is_msg(part, message_text(part)) for part in messages.values()
    ):
        return "msg", full_text(definition)
    texts = (f"{_LINE}\nIDL: {name}\n{idl_text(part)}" for name, part in messages.items())
    return "idl", "\n".join(texts)


def _needed(definition: InterfaceDefinition) -> dict[str, Definition]:
    """Return the messages that a definition uses, directly or indirectly."""
    needed: dict[str, Definition] = {}
    for part in parts_of(definition):
        _collect(part, part.nested, needed)
    return needed


def _collect(
    owner: Definition, nested: Mapping[str, Definition], needed: dict[str, Definition]
) -> None:
    for field in owner.fields:
        if field.type.is_compound and field.type.name not in needed:
            found = nested_definition(owner, field, nested)
            needed[found.name] = found
            _collect(found, nested, needed)


def _received_or_written(definition: InterfaceDefinition) -> str:
    """Return the text of a definition as received, or as ``.msg`` if that is IDL."""
    if definition.ros == 1 or _is_msg(definition):
        return definition.text
    return "\n---\n".join(message_text(part) for part in parts_of(definition))


def _is_msg(definition: InterfaceDefinition, text: str | None = None) -> bool:
    """Return whether a text, by default the definition's own, is ``.msg`` and says the same."""
    parser: Any = _PARSERS[type(definition)]
    with suppress(DefinitionError):  # then it is not .msg
        parsed = parser(definition.text if text is None else text, definition.name)
        return list(map(_members, parts_of(parsed))) == list(map(_members, parts_of(definition)))
    return False


def _members(definition: Definition) -> list[tuple[str, Any]]:
    fields = [(field.name, field.type) for field in definition.fields]
    return [*fields, *((constant.name, constant.value) for constant in definition.constants)]


def message_text(definition: Definition) -> str:
    """Return `definition` as the text of a ROS 2 ``.msg`` file, with comments and constants.

    Parsing the text gives the same fields, defaults and constants.
    """
    head = definition.comment
    members: list[Constant | Field] = [*definition.constants, *definition.fields]
    # A head comment that touches the first member also belongs to that member.
    shared = bool(head and members and _begins(members[0].comment, head))
    touching = shared and "\n" not in _own(members[0].comment, head)
    lines = list(_comment(head))
    if head and not touching:
        lines.append("")

    def write(member: Constant | Field, code: str) -> None:
        own = _own(member.comment, head)
        unit = member.unit if isinstance(member, Field) else ""
        if unit and find_unit(own) != unit:
            own = f"{own} [{unit}]".lstrip()
        if touching and member is members[0]:
            lines.append(f"{code}  # {own}" if own else code)
        else:
            lines.extend((*_comment(own), code))

    for constant in definition.constants:
        write(constant, f"{constant.type} {constant.name}={_value(constant.value)}")
    if definition.constants and definition.fields:
        lines.append("")
    for field in definition.fields:
        default = "" if field.default is None else f" {_value(field.default)}"
        write(field, f"{_type(field.type)} {field.name}{default}")
    return "\n".join(lines)


def _begins(comment: str, head: str) -> bool:
    """Return whether a member's comment begins with the adjacent one of the message."""
    return f"{comment}\n".startswith(f"{head}\n")


def _own(comment: str, head: str) -> str:
    """Return a member's comment without the message's at its beginning."""
    return comment[len(head) :].lstrip("\n") if head and _begins(comment, head) else comment


def _comment(text: str) -> Iterator[str]:
    return (f"# {line}".rstrip() for line in text.splitlines())


def _type(kind: FieldType) -> str:
    return str(kind).replace(kind.name, _short(kind.name), 1) if kind.is_compound else str(kind)


def _short(name: str) -> str:
    """Return a message's name as ``.msg`` writes it."""
    package, kind, base = split_name(name)
    return f"{package}/{base}" if kind == "msg" else name


def _value(value: Value) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_value(element) for element in value)}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, str):
        return repr(value)
    return f'"{"".join(_character(sign) for sign in value)}"'


def _character(sign: str) -> str:
    known = _ESCAPES.get(sign)
    return known or (sign if sign.isprintable() else f"\\U{ord(sign):08x}")


_IDL_TYPES = {"bool": "boolean", "byte": "octet", "float32": "float", "float64": "double"}


def idl_text(definition: Definition) -> str:
    """Return `definition` as an IDL text, with comments, units and constants."""
    package, kind, base = definition.name.split("/")
    lines = [f"module {package} {{", f"module {kind} {{"]
    if definition.constants:
        lines.append(f"module {base}_Constants {{")
        for constant in definition.constants:
            lines += _verbatim(constant.comment)
            declared = _idl_type(FieldType(constant.type))
            lines.append(f"const {declared} {constant.name} = {_idl_value(constant.value)};")
        lines.append("};")
    lines += [*_verbatim(definition.comment), f"struct {base} {{"]
    for field in definition.fields:
        lines += _verbatim(field.comment)
        if field.unit:
            lines.append(f"@unit (value={_value(field.unit)})")
        # IDL has no infinity and NaN; decoding needs no defaults.
        if field.default is not None and _is_finite(field.default):
            lines.append(f"@default (value={_idl_value(field.default)})")
        size = f"[{field.type.size}]" if field.type.array is ArrayKind.FIXED else ""
        lines.append(f"{_idl_type(field.type)} {field.name}{size};")
    if not definition.fields:
        lines.append(f"uint8 {PLACEHOLDER};")
    return "\n".join((*lines, "};", "};", "};"))


def _is_finite(value: Value) -> bool:
    values = value if isinstance(value, tuple) else (value,)
    return all(math.isfinite(one) for one in values if isinstance(one, float))


def _verbatim(comment: str) -> Iterator[str]:
    if comment:
        yield f'@verbatim (language="comment", text={_value(comment)})'


def _idl_type(kind: FieldType) -> str:
    name = "::".join(kind.name.split("/"))
    if name == "char" and not kind.letter:
        name = "uint8"  # as in a .msg file
    name = _IDL_TYPES.get(name, name)
    if kind.string_bound is not None:
        name = f"{name}<{kind.string_bound}>"
        if kind.array in (ArrayKind.BOUNDED, ArrayKind.UNBOUNDED):
            name += " "  # to some parsers, ">>" is one sign
    if kind.array is ArrayKind.BOUNDED:
        return f"sequence<{name}, {kind.size}>"
    return f"sequence<{name}>" if kind.array is ArrayKind.UNBOUNDED else name


def _idl_value(value: Value) -> str:
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, tuple):  # as rosidl writes it
        return _value(f"({', '.join(map(_value, value))})")
    return _value(value)

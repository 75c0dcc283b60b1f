"""Reading type descriptions, as ROS 2 nodes send them over ``~/get_type_description``.

REP 2016 and ``type_description_interfaces/msg/TypeDescription``: the inverse of
:func:`rosglass.interfaces.type_description`. A description has all that the wire format and the
RIHS01 hash depend on, but neither constants nor comments: see
:mod:`rosglass.interfaces.type_sources`.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rosglass.errors import DefinitionError, InvalidNameError
from rosglass.interfaces.definition import (
    ActionDefinition,
    ArrayKind,
    Definition,
    Field,
    FieldType,
    ServiceDefinition,
    Source,
)
from rosglass.interfaces.literals import LiteralError, parse_default
from rosglass.interfaces.names import (
    check_field_name,
    check_package_name,
    check_type_name,
    split_name,
)
from rosglass.interfaces.resolver import MAX_TYPES, Resolver
from rosglass.interfaces.writing import message_text

if TYPE_CHECKING:
    from rosglass.interfaces.definition import InterfaceDefinition, Value

__all__ = ["parse_type_description"]

_log = logging.getLogger("rosglass.interfaces")

_NESTED_ID = 1
_BLOCK = 48
_KINDS = (ArrayKind.NONE, ArrayKind.FIXED, ArrayKind.BOUNDED, ArrayKind.UNBOUNDED)
_NAMES = {
    2: "int8", 3: "uint8", 4: "int16", 5: "uint16", 6: "int32", 7: "uint32", 8: "int64",
    9: "uint64", 10: "float32", 11: "float64", 15: "bool", 16: "byte", 17: "string",
    18: "wstring", 21: "string", 22: "wstring",
}  # fmt: skip
_BOUNDED_STRINGS = (21, 22)
# A .msg file's char is IDL's uint8 (id 3); the ids below come from hand-written IDL only.
_FOREIGN = {
    12: "IDL's long double",
    13: "IDL's char",
    14: "IDL's wchar",
    19: "strings of fixed length",
    20: "wide strings of fixed length",
}
_PLACEHOLDER = "structure_needs_at_least_one_member"
_MAX_COUNT = 2**32 - 1
#: Fields that a description may have in all; real ones stay below a thousand.
_MAX_FIELDS = 50_000

_SERVICE = {"request_message": "_Request", "response_message": "_Response"}
_ACTION = {"goal": "_Goal", "result": "_Result", "feedback": "_Feedback"}


def parse_type_description(
    description: Mapping[str, Any], *, provider: str = "description"
) -> InterfaceDefinition:
    """Make a definition of a type description.

    Args:
        description: ``type_description`` and ``referenced_type_descriptions``, as in the message
            ``type_description_interfaces/msg/TypeDescription`` made a dict.
        provider: Recorded in the definition's source.

    Returns:
        The definition, resolved; a service or action when the description is one's.

    Raises:
        DefinitionError: It makes no sense; names the type and the field.
        CyclicTypeError: A type contains itself.
    """
    reader = _Reader(provider)
    main = reader.individual(_get(description, "type_description", Mapping, "the description"))
    referenced = _get(description, "referenced_type_descriptions", Sequence, "the description")
    if len(referenced) > MAX_TYPES:
        raise DefinitionError(f"it needs more than {MAX_TYPES} other types", _label(main.name))
    messages = {main.name: main}
    for part in referenced:
        found = reader.individual(part)
        if messages.setdefault(found.name, found) is not found:
            raise DefinitionError("it is described twice", found.source.file)
    resolver = Resolver(lambda name, owner, field: _referenced(messages, name, owner, field))
    services = ("srv", "action")  # an action's are X_SendGoal and X_GetResult
    kind = main.name.split("/")[1]
    if kind == "action" and _has_parts(main, _ACTION):
        goal, result, feedback = parts = _parts(main, _ACTION, messages, resolver)
        return ActionDefinition(main.name, 2, goal, result, feedback, _joined(parts), main.source)
    if kind in services and _has_parts(main, _SERVICE):
        request, response = parts = _parts(main, _SERVICE, messages, resolver)
        return ServiceDefinition(main.name, 2, request, response, _joined(parts), main.source)
    return resolver.message(main)


def _has_parts(main: Definition, members: Mapping[str, str]) -> bool:
    """Return whether a description is that of a service or action, not of a message."""
    types = {field.name: field.type for field in main.fields}
    return all(types.get(name) == FieldType(main.name + suffix) for name, suffix in members.items())


def _parts(
    main: Definition,
    members: Mapping[str, str],
    messages: Mapping[str, Definition],
    resolver: Resolver,
) -> list[Definition]:
    fields = {field.name: field for field in main.fields}
    return [
        resolver.message(_referenced(messages, main.name + suffix, main, fields[name]))
        for name, suffix in members.items()
    ]


def _joined(parts: Sequence[Definition]) -> str:
    return "\n---\n".join(part.text for part in parts)


def _referenced(
    messages: Mapping[str, Definition], name: str, owner: Definition, field: Field
) -> Definition:
    found = messages.get(name)
    if found is None:
        raise DefinitionError(
            f"field {field.name} has the type {name}, which the description leaves out",
            owner.source.file,
        )
    return found


class _Reader:
    """Reads individual descriptions, and counts their fields."""

    def __init__(self, provider: str) -> None:
        self._provider = provider
        self._fields = 0

    def individual(self, part: object) -> Definition:
        """Return one type's definition, not resolved."""
        if not isinstance(part, Mapping):
            raise DefinitionError(f"expected a description, got {part!r:.80}", "<description>")
        name = _get(part, "type_name", str, "the description")
        label = _label(name)
        _check_type_name(name, label)
        described = _get(part, "fields", Sequence, "the description", label)
        self._fields += len(described)
        if self._fields > _MAX_FIELDS:
            raise DefinitionError(f"it has more than {_MAX_FIELDS} fields", label)
        fields = tuple(_field(field, label) for field in described)
        names = [field.name for field in fields]
        seen: set[str] = set()
        for twice in names:
            if twice in seen:
                raise DefinitionError(f"field {twice} appears twice", label)
            seen.add(twice)
        if names == [_PLACEHOLDER] and fields[0].type == FieldType("uint8"):
            fields = ()  # what rosidl puts into empty structs
        source = Source(self._provider, f"<{name} from {self._provider}>")
        definition = Definition(name, 2, fields, source=source)
        return replace(definition, text=message_text(definition))


def _label(name: str) -> str:
    return f"<description of {name[:300]}>"


def _check_type_name(name: str, label: str) -> None:
    try:
        package, kind, base = split_name(name)
    except InvalidNameError as error:
        raise DefinitionError(str(error), label) from None
    fault = check_package_name(package, 2) or check_type_name(base, 2)
    if fault or not kind:
        raise DefinitionError(fault or f"{name!r:.80} has no kind (msg, srv or action)", label)


def _field(field: object, label: str) -> Field:
    if not isinstance(field, Mapping):
        raise DefinitionError(f"expected a field, got {field!r:.80}", label)
    name = _get(field, "name", str, "a field", label)
    fault = check_field_name(name[:300], 1)  # IDL takes any identifier
    if fault:
        raise DefinitionError(fault, label)
    where = f"field {name}"
    kind = _field_type(_get(field, "type", Mapping, where, label), where, label)
    return Field(name, kind, _default(field, kind, where, label))


def _field_type(described: Mapping[str, Any], where: str, label: str) -> FieldType:
    type_id = _get(described, "type_id", int, where, label)
    capacity = _get(described, "capacity", int, where, label)
    bound = _get(described, "string_capacity", int, where, label)
    nested = _get(described, "nested_type_name", str, where, label)
    block, base = divmod(type_id, _BLOCK)
    known = 0 <= block < len(_KINDS)
    name = nested if base == _NESTED_ID else _NAMES.get(base, "")
    if known and base in _FOREIGN:
        raise DefinitionError(
            f"{where} has type id {type_id}: {_FOREIGN[base]}, which no .msg file has, "
            "cannot be read",
            label,
        )
    if not known or not (name or base == _NESTED_ID):
        raise DefinitionError(f"{where} has type id {type_id}, which means nothing", label)
    if base == _NESTED_ID:
        _check_type_name(nested, label)
    elif nested:
        raise DefinitionError(f"{where} is a {name}, yet names the type {nested!r:.80}", label)
    kind = _KINDS[block]
    _check_count(capacity, kind in (ArrayKind.FIXED, ArrayKind.BOUNDED), "capacity", where, label)
    _check_count(bound, base in _BOUNDED_STRINGS, "string capacity", where, label)
    return FieldType(name, kind, capacity or None, bound or None)


def _check_count(count: int, wanted: bool, what: str, where: str, label: str) -> None:
    if (1 <= count <= _MAX_COUNT) if wanted else count == 0:
        return
    rule = f"must be from 1 to {_MAX_COUNT}" if wanted else "has to be 0 for its type"
    raise DefinitionError(f"{where}: the {what} {rule}, got {count}", label)


def _default(field: Mapping[str, Any], kind: FieldType, where: str, label: str) -> Value | None:
    """Return the default value, written as Python prints it (rosidl's generator does)."""
    text: str = _get(field, "default_value", str, where, label)
    if not text:
        return None
    single = kind.array is ArrayKind.NONE
    try:
        if single and kind.name in ("string", "wstring"):
            if kind.string_bound is not None and len(text) > kind.string_bound:
                raise LiteralError(f"it is longer than {kind.string_bound} characters")
            return text
        if not single:
            text = text.strip().removeprefix("(").removesuffix(")").strip().removesuffix(",")
            text = f"[{text}]"
        return parse_default(kind, text)
    except LiteralError as error:
        # No hash covers defaults, and nothing that is received depends on them.
        _log.warning("%s: %s is used without its default value: %s", label, where, error)
        return None


def _get(part: object, key: str, kind: type[Any], where: str, label: str = "<description>") -> Any:
    value = part.get(key) if isinstance(part, Mapping) else None
    wrong = kind is Sequence and isinstance(value, str)
    if wrong or not isinstance(value, kind) or isinstance(value, bool):
        raise DefinitionError(f"{where} has no proper {key}: {value!r:.80}", label)
    return value

"""Strict conversion of dicts and messages into messages; missing fields get the type's defaults."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from rosglass.errors import ConversionError
from rosglass.messages.message import Message, plain_class, to_dict
from rosglass.messages.schema import Kind
from rosglass.messages.source import hint, load_numpy, number_type
from rosglass.messages.values import as_number, as_sequence, as_text, check_length, numbers

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.messages.schema import Member, Schema

__all__ = ["complete", "convert"]

_NANO = 1_000_000_000


def convert(schema: Schema, value: Any) -> Message:
    """Return a plain message made from a dict, a message of the type, or something like a time.

    Raises:
        ConversionError: A value does not fit; its path is the field's from the root.
    """
    try:
        return _message(schema, value, "")
    except ConversionError as error:
        raise ConversionError(error.path, error.value, error.expected, schema.name) from None


def _message(schema: Schema, value: Any, path: str) -> Message:
    cls = plain_class(schema)
    if isinstance(value, Message):
        if value._schema__ is not schema:
            raise ConversionError(path, value, _expected(schema, value._schema__))
        given = _attributes(value)
    elif isinstance(value, Mapping):
        given = _known_fields(schema, value, path)
    elif schema.is_time and (parts := _time_parts(value)) is not None:
        given = dict(zip((m.name for m in schema.members), parts, strict=True))
    else:
        raise ConversionError(path, value, f"a dict or a {schema.name}")
    made = cls()
    for member in schema.members:
        if member.name in given:
            inner = f"{path}.{member.name}" if path else member.name
            found = _member(member, given[member.name], inner)
        else:
            found = _default(member)
        setattr(made, member.attr, found)
    return made


def _attributes(message: Message) -> dict[str, Any]:
    return {m.name: getattr(message, m.attr) for m in message._schema__.members}


def complete(schema: Schema, value: Any) -> dict[str, Any]:
    """Return a dict with every field, the missing ones with their defaults; checks no values.

    Raises:
        LookupError, TypeError, AttributeError, ConversionError: Missing fields are not the only
            fault.
    """
    if isinstance(value, Message):
        if value._schema__ is not schema:
            raise TypeError
        value = _attributes(value)
    defaults: dict[str, Any] = schema.cached("defaults", lambda: to_dict(_message(schema, {}, "")))
    made = dict(defaults)
    for name, given in value.items():
        member = schema.by_name[name]
        if name != member.name and member.name in value:
            raise LookupError
        struct = member.struct
        if struct is None:
            made[member.name] = given
        elif member.is_array:
            items = as_sequence(given, name, struct.name)
            made[member.name] = [complete(struct, item) for item in items]
        else:
            made[member.name] = complete(struct, given)
    return made


def _expected(schema: Schema, other: Schema) -> str:
    text = f"a {schema.name}"
    if schema.name == other.name:
        text += f" of ROS {schema.ros}" if schema.ros != other.ros else " with the same definition"
    return text


def _known_fields(schema: Schema, value: Mapping[Any, Any], path: str) -> dict[str, Any]:
    given = {}
    for key, item in value.items():
        member = schema.by_name.get(key) if isinstance(key, str) else None
        if member is None:
            names = [known.name for known in schema.members]
            where = f"{path}.{key}" if path else str(key)
            raise ConversionError(where, item, f"a field of {schema.name} ({hint(key, names)})")
        if member.name in given:
            raise ConversionError(f"{path}.{key}" if path else str(key), item, "each field once")
        given[member.name] = item
    return given


def _time_parts(value: Any) -> tuple[Any, Any] | None:
    for names in (("secs", "nsecs"), ("sec", "nanosec")):
        if all(hasattr(value, name) for name in names):
            return getattr(value, names[0]), getattr(value, names[1])
    total = getattr(value, "nanoseconds", None)
    if isinstance(total, int) and not isinstance(total, bool):
        return divmod(total, _NANO)
    return None


def _member(member: Member, value: Any, path: str) -> Any:
    """Return the value of a field, checked and in its canonical Python form."""
    if not member.is_array:
        return _element(member, value, path)
    if member.number is not None:
        return numbers(member, value, path)
    items = as_sequence(value, path, member.field.type.name)
    check_length(member, len(items), value, path)
    return [_element(member, item, f"{path}[{index}]") for index, item in enumerate(items)]


def _element(member: Member, value: Any, path: str) -> Any:
    if member.number is not None:
        return as_number(member.number, value, path)
    if member.kind is Kind.TEXT:
        return as_text(member, value, path)
    assert member.struct is not None
    return _message(member.struct, value, path)


def _default(member: Member) -> Any:
    """Return a fresh default value of a field: the definition's, or zero and empty."""
    given = member.field.default
    if given is not None:
        return _member(member, list(given) if isinstance(given, tuple) else given, member.name)
    count = member.fixed_count or 0
    one: Callable[[], Any]
    if member.number is not None:
        if member.is_array:
            kind = bool if member.number.python is bool else number_type(member.number.dtype, "<")
            return load_numpy().zeros(count, kind)
        one = member.number.python
    elif member.kind is Kind.TEXT:
        one = str
    else:
        assert member.struct is not None
        one = partial(_message, member.struct, {}, "")
    return [one() for _ in range(count)] if member.is_array else one()

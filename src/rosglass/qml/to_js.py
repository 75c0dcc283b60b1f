"""Messages on their way to QML: the part of a message that becomes JSON, and its long arrays.

Only what is short is written out. Arrays longer than :data:`INLINE` stay in Python, where the
JavaScript side fetches what it is asked for.
"""

from __future__ import annotations

import json
import math
from operator import attrgetter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.messages import Message
    from rosglass.messages.schema import Member, Schema

__all__ = ["INLINE", "LongArray", "describe", "exact", "reader", "to_json"]

#: Arrays of more numbers, texts or messages than this are fetched when they are asked for.
INLINE = {"number": 64, "text": 32, "message": 16}
_EXACT = 1 << 53

#: A long array: its member and its values.
LongArray = tuple["Member", Any]


def exact(value: int) -> int | str:
    """Return an integer as JavaScript can hold it: as decimal text from 2^53 on."""
    return value if -_EXACT < value < _EXACT else str(value)


def reader(schema: Schema) -> Callable[[Message, list[LongArray]], dict[str, Any]]:
    """Return a function that reads a message's short parts and collects its long arrays."""
    made: Callable[[Message, list[LongArray]], dict[str, Any]] = schema.cached(
        "qml reader", lambda: _make_reader(schema)
    )
    return made


def _make_reader(schema: Schema) -> Callable[[Message, list[LongArray]], dict[str, Any]]:
    members = schema.members
    if not members:
        return lambda message, arrays: {}  # noqa: ARG005 - the signature is shared
    names = [member.name for member in members]
    get = attrgetter(*(member.attr for member in members))
    fixes = [(member.name, fix) for member in members if (fix := _fix(member)) is not None]
    single = len(members) == 1

    def read(message: Message, arrays: list[LongArray]) -> dict[str, Any]:
        values = (get(message),) if single else get(message)
        out = dict(zip(names, values, strict=True))
        for name, fix in fixes:
            out[name] = fix(out[name], arrays)
        return out

    return read


def _fix(member: Member) -> Callable[[Any, list[LongArray]], Any] | None:
    """Return what has to be done to a member's value, None when it can stay as it is."""
    if member.is_array:
        return _array_fix(member)
    if member.struct is not None:
        return reader(member.struct)
    if _is_wide(member):
        return lambda value, arrays: exact(int(value))  # noqa: ARG005
    return None


def _is_wide(member: Member) -> bool:
    return member.number is not None and member.number.code in "qQ"


def _array_fix(member: Member) -> Callable[[Any, list[LongArray]], Any]:
    limit = 0 if _is_wide(member) else INLINE[member.kind.value]
    element = reader(member.struct) if member.struct is not None else None
    boolean = member.number is not None and member.number.code == "?"

    def fix(values: Any, arrays: list[LongArray]) -> Any:
        count = len(values)
        if count > limit or (count and not limit):
            arrays.append((member, values))
            return {"#at": len(arrays) - 1, "length": count}
        if element is not None:
            return [element(value, arrays) for value in values]
        listed = values.tolist() if hasattr(values, "tolist") else list(values)
        return [bool(value) for value in listed] if boolean else listed

    return fix


def describe(schema: Schema) -> tuple[dict[str, Any], list[tuple[str, str, Schema | None]]]:
    """Return a type's constants, and its fields that are more than a single value.

    Each of those fields is given as name, kind of array element (empty for a nested message) and
    schema of the nested message.
    """
    constants = {
        constant.name: exact(constant.value) if type(constant.value) is int else constant.value
        for constant in schema.definition.constants
    }
    fields = []
    for member in schema.members:
        if member.is_array:
            kind = member.number.name if member.number is not None else member.kind.value
            fields.append((member.name, kind, member.struct))
        elif member.struct is not None:
            fields.append((member.name, "", member.struct))
    return constants, fields


def to_json(value: Any) -> tuple[str, bool]:
    """Return JSON, and whether it marks floats that JSON cannot say as ``{"#": name}``."""
    try:
        return json.dumps(value, allow_nan=False), False
    except ValueError:
        return json.dumps(_mark(value), allow_nan=False), True


def _mark(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        name = "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
        return {"#": name}
    if isinstance(value, dict):
        return {key: _mark(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_mark(inner) for inner in value]
    return value

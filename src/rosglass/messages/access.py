"""Field paths such as ``poses[2].position.x``: parsing them, and following them in messages."""

from __future__ import annotations

import re
from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rosglass.errors import ConversionError, Error, FieldPathError
from rosglass.messages.runtime import hint, number_type
from rosglass.messages.schema import Kind

if TYPE_CHECKING:
    import numpy as np

    from rosglass.messages.message import Message
    from rosglass.messages.schema import Member, Schema

__all__ = ["Step", "column_type", "find", "get", "parse", "put", "resolve", "writable"]

#: One step of a path: a field name, an index, or a slice (``[*]`` is ``slice(None)``).
Step = str | int | slice

_TOKEN = re.compile(
    r"(?P<dot>\.?)(?P<name>[A-Za-z_]\w*)"
    r"|\[(?P<index>[+-]?\d+)\]"
    r"|\[(?P<star>\*)\]"
    r"|\[(?P<start>[+-]?\d+)?:(?P<stop>[+-]?\d+)?(?::(?P<step>[+-]?\d+)?)?\]"
)


@lru_cache(maxsize=1024)
def parse(path: str) -> tuple[Step, ...]:
    """Split a path into its steps.

    Raises:
        FieldPathError: It is not of the form ``name.name[3].name[*]``.
    """
    if not isinstance(path, str):
        raise FieldPathError(f"a field path is a str such as 'pose.position.x', got {path!r}")
    steps: list[Step] = []
    place = 0
    while place < len(path):
        match = _TOKEN.match(path, place)
        if match is None or (bool(steps) != bool(match["dot"]) and match["name"]):
            raise FieldPathError(
                f"field path {path!r} is malformed at character {place + 1}; "
                "write it like 'poses[2].position.x', 'ranges[1:5]' or 'markers[*].id'"
            )
        place = match.end()
        if match["name"]:
            steps.append(match["name"])
        elif match["index"]:
            steps.append(int(match["index"]))
        elif match["star"]:
            steps.append(slice(None))
        else:
            parts = (match["start"], match["stop"], match["step"])
            cut = slice(*(None if part is None else int(part) for part in parts))
            if cut.step == 0:
                raise FieldPathError(f"field path {path!r}: a slice's step cannot be 0")
            steps.append(cut)
    if not steps:
        raise FieldPathError("a field path cannot be empty")
    return tuple(steps)


def find(schema: Schema, name: str, path: str) -> Member:
    """Return the member called `name`; raises FieldPathError with the nearest name."""
    member = schema.by_name.get(name)
    if member is None:
        names = [known.name for known in schema.members]
        raise FieldPathError(
            f"field path {path!r}: {schema.name} has no field {name!r}; {hint(name, names)}"
        )
    return member


def resolve(schema: Schema, path: str) -> list[tuple[Member, Step | None]]:
    """Check a path against a schema; return (member, index or slice) for each field on it.

    Raises:
        FieldPathError: The path does not exist in the type.
    """
    found: list[tuple[Member, Step | None]] = []
    inside: Schema | None = schema
    open_array = False
    for step in parse(path):
        if isinstance(step, str):
            if open_array:
                raise FieldPathError(
                    f"field path {path!r}: {found[-1][0].name!r} is an array; "
                    f"write {found[-1][0].name}[0] or {found[-1][0].name}[*]"
                )
            if inside is None:
                raise FieldPathError(
                    f"field path {path!r}: {found[-1][0].name!r} is a "
                    f"{found[-1][0].field.type.name} and has no fields"
                )
            member = find(inside, step, path)
            found.append((member, None))
            inside, open_array = member.struct, member.is_array
        else:
            if not open_array:
                what = found[-1][0].name if found else "the message"
                raise FieldPathError(f"field path {path!r}: {what!r} is not an array")
            member = found[-1][0]
            if isinstance(step, int) and member.fixed_count is not None:
                _check_index(step, member.fixed_count, path)
            found[-1] = (member, step)
            open_array = False
    return found


def column_type(rest: list[tuple[Member, Step | None]]) -> Any:
    """Return the numpy type of a column whose elements a route leads to, None for other values."""
    number, step = rest[-1][0].number, rest[-1][1]
    if number is None or (rest[-1][0].is_array and not isinstance(step, int)):
        return None
    if any(isinstance(step, slice) for _, step in rest):
        return None  # a column of columns, each as long as it likes
    return bool if number.python is bool else number_type(number.dtype, "<")


def _check_index(index: int, count: int, path: str) -> None:
    if not -count <= index < count:
        raise FieldPathError(
            f"field path {path!r}: index {index} is out of range, the array holds {count}"
        )


def get(message: Message, path: str) -> Any:
    """Return what a path leads to; slices of messages continue in every element."""
    route = resolve(message._schema__, path)
    try:
        return _follow(message, route, path)
    except (AttributeError, TypeError) as error:
        raise _astray(error, path) from None


def _astray(error: Exception, path: str) -> Exception:
    # Assigned values are not checked before they are encoded.
    if isinstance(error, Error):
        return error
    return FieldPathError(f"field path {path!r} meets an assigned value of the wrong kind: {error}")


def _follow(message: Any, route: list[tuple[Member, Step | None]], path: str) -> Any:
    value = message
    for place, (member, step) in enumerate(route):
        value = getattr(value, member.attr)
        if isinstance(step, int):
            _check_index(step, len(value), path)
            value = value[step]
            if member.number is not None:
                value = value.item() if hasattr(value, "item") else value
        elif isinstance(step, slice):
            value = value[step]
            rest = route[place + 1 :]
            if rest and member.kind is Kind.STRUCT:
                found = [_follow(element, rest, path) for element in value]
                leaf = column_type(rest)
                return found if leaf is None else import_module("numpy").array(found, leaf)
    return value


def put(message: Message, path: str, value: Any) -> None:
    """Set what a path leads to; an array still in the received bytes is copied first.

    Raises:
        FieldPathError: The path leads nowhere.
        ConversionError: A number does not fit its array; other values are checked when encoding.
    """
    route = resolve(message._schema__, path)
    try:
        _put(message, route, path, value)
    except ConversionError as error:
        name = message._schema__.name
        raise ConversionError(error.path, error.value, error.expected, name) from None
    except (AttributeError, TypeError) as error:
        raise _astray(error, path) from None


def _put(message: Message, route: list[tuple[Member, Step | None]], path: str, value: Any) -> None:
    target: Any = message
    for place, (member, step) in enumerate(route):
        final = place + 1 == len(route)
        if final and step is None:
            setattr(target, member.attr, value)
            return
        holder = target
        target = getattr(target, member.attr)
        if step is None:
            continue
        if isinstance(step, int):
            _check_index(step, len(target), path)
        elif not final:
            raise FieldPathError(f"field path {path!r}: only the last step can be a slice to set")
        if final:
            if member.number is not None:
                target = _own(holder, member)
                count = len(range(len(target))[step]) if isinstance(step, slice) else 1
                value = _conversion().elements(member, step, count, value, path)
            target[step] = value
        else:
            target = target[step]


def writable(message: Message, path: str) -> np.ndarray:
    """Return the numeric array at a path, copied out of the received bytes if it is in there."""
    route = resolve(message._schema__, path)
    member, step = route[-1]
    if not member.is_array or member.number is None or step is not None:
        raise FieldPathError(f"field path {path!r} does not lead to a numeric array")
    holder = _follow(message, route[:-1], path)
    if isinstance(holder, list):
        raise FieldPathError(f"field path {path!r} leads to several arrays")
    array: np.ndarray = _own(holder, member)
    return array


def _own(holder: Any, member: Member) -> Any:
    array = getattr(holder, member.attr)
    flags = getattr(array, "flags", None)
    if flags is None:  # what was assigned to the field
        array = _conversion().numbers(member, array, member.name)
    elif flags.writeable:
        return array
    else:
        array = array.copy()
    setattr(holder, member.attr, array)
    return array


def _conversion() -> Any:
    # It makes messages, which need this module.
    return import_module("rosglass.messages.conversion")

"""Values written in definitions: constants and default values."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosglass.interfaces.definition import FieldType, Value

__all__ = [
    "INTEGER_RANGES",
    "LiteralError",
    "parse_constant",
    "parse_default",
    "strip_comment",
    "unescape",
]

_SIGNED = {f"int{n}": (-(1 << (n - 1)), (1 << (n - 1)) - 1) for n in (8, 16, 32, 64)}
_UNSIGNED = {f"uint{n}": (0, (1 << n) - 1) for n in (8, 16, 32, 64)}

#: Smallest and largest value of every integer type, by ROS version: ROS 1's byte is signed.
INTEGER_RANGES: dict[int, dict[str, tuple[int, int]]] = {
    1: {**_SIGNED, **_UNSIGNED, "byte": (-128, 127), "char": (0, 255)},
    2: {**_SIGNED, **_UNSIGNED, "byte": (0, 255), "char": (0, 255)},
}

# Beyond it a double no longer rounds to a finite float32.
_FLOAT32_LIMIT = (2 - 2**-24) * 2.0**127
# int() of very long digit strings takes quadratic time; no number needs more characters.
_MAX_NUMBER = 400

# Compiled on first use by re's own cache: few definitions have quoted strings.
_INTEGER = r"[+-]?(?:[0-9]+(?:_[0-9]+)*|(0[xX][0-9a-fA-F]+|0[oO][0-7]+|0[bB][01]+))"
_QUOTED = r"""(?s)(["'])((?:\\.|(?!\1)[^\\])*)\1"""
_ESCAPE = r"(?s)\\(x[0-9A-Fa-f]{2}|u[0-9A-Fa-f]{4}|U[0-9A-Fa-f]{8}|[0-7]{1,3}|.)"
_QUOTE_OR_COMMENT = r"""(?s)\\.|["'#]"""
_ESCAPES = {
    "a": "\a", "b": "\b", "f": "\f", "n": "\n", "r": "\r", "t": "\t", "v": "\v",
    "\\": "\\", '"': '"', "'": "'",
}  # fmt: skip


class LiteralError(ValueError):
    """A literal doesn't fit its type; the text says why."""


def strip_comment(text: str) -> str:
    """Cut a trailing ``# comment`` off a ROS 2 value; a ``#`` inside a quoted string stays."""
    stripped = text.strip()
    if "#" not in stripped:
        return stripped
    quote = ""
    # Quotes count only where strings begin with them: an apostrophe in bare text is just that.
    quoting = stripped[0] in "\"'["
    for match in re.finditer(_QUOTE_OR_COMMENT, stripped):
        sign = match.group()
        if sign == quote:
            quote = ""
        elif not quote and sign == "#":
            return stripped[: match.start()].rstrip()
        elif not quote and quoting and sign in ("'", '"'):
            quote = sign
    # Without a closing quote the text isn't a quoted string after all.
    return stripped.partition("#")[0].rstrip() if quote else stripped


def parse_constant(type_name: str, text: str, ros: int) -> bool | int | float | str:
    """Convert the text of a constant (comment already removed, except in ROS 1 strings).

    Args:
        type_name: A primitive type name.
        text: The value as written.
        ros: 1 or 2.

    Raises:
        LiteralError: The text isn't a value of the type.
    """
    if type_name in ("string", "wstring"):
        return text.strip() if ros == 1 else _string(text)
    return _number(type_name, text, ros)


def parse_default(field_type: FieldType, text: str) -> Value:
    """Convert the text of a ROS 2 default value.

    Args:
        field_type: The field's type.
        text: The value as written, comment already removed.

    Raises:
        LiteralError: The text isn't a value of the type.
    """
    if field_type.is_compound:
        raise LiteralError(
            f"a field of the message type {field_type.name} can't have a default value"
        )
    name, bound = field_type.name, field_type.string_bound
    if field_type.array.value == "single value":
        return _element(name, text, bound)
    if not (text.startswith("[") and text.endswith("]") and len(text) >= 2):
        raise LiteralError(f"the default value of an array is written [a, b, c], got {text!r}")
    inner = text[1:-1]
    if name in ("string", "wstring"):
        elements = list(_split_strings(inner))
    else:
        elements = [part.strip() for part in inner.split(",")] if inner.strip() else []
    size = field_type.size
    if size is not None and field_type.array.value == "fixed array" and len(elements) != size:
        raise LiteralError(f"expected exactly {size} elements, got {len(elements)}")
    if size is not None and len(elements) > size:
        raise LiteralError(f"expected at most {size} elements, got {len(elements)}")
    values: list[bool | int | float | str] = []
    try:
        values.extend(_element(name, element, bound) for element in elements)
    except LiteralError as error:
        raise LiteralError(f"element {len(values)}: {error}") from None
    return tuple(values)


def _element(name: str, text: str, bound: int | None) -> bool | int | float | str:
    if name not in ("string", "wstring"):
        return _number(name, text, 2)
    value = _string(text)
    if bound is not None and len(value) > bound:
        raise LiteralError(f"the string has {len(value)} characters, its bound is {bound}")
    return value


def _number(name: str, text: str, ros: int) -> bool | int | float:
    text = text.strip()
    if len(text) > _MAX_NUMBER:
        raise LiteralError(f"{text[:20]}... is too long for a number")
    if name == "bool":
        return _bool(text, ros)
    if name in ("float32", "float64"):
        return _float(name, text)
    low, high = INTEGER_RANGES[ros][name]
    value = _int(text)
    if value is None:
        raise LiteralError(f"{text!r} is not a whole number; {name} takes {low} to {high}")
    if not low <= value <= high:
        raise LiteralError(f"{text} is out of range; {name} takes {low} to {high}")
    return value


def _int(text: str) -> int | None:
    # "010" is ten, "0x10" sixteen: rosidl tries base 10 first, then Python's prefixes.
    match = re.fullmatch(_INTEGER, text)
    if match is None:
        return None
    return int(text, 10 if match.group(1) is None else 0)


def _bool(text: str, ros: int) -> bool:
    lowered = text.lower()
    if lowered in ("true", "1"):
        return True
    if lowered in ("false", "0"):
        return False
    value = _int(text) if ros == 1 else None
    if value is None:
        raise LiteralError(f"{text!r} is not a bool; write true, false, 1 or 0")
    return value != 0


def _float(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise LiteralError(f"{text!r} is not a number; write it like 1.5, -3 or 1e-9") from None
    too_big = math.isinf(value) and "inf" not in text.lower()
    if too_big or (name == "float32" and _FLOAT32_LIMIT <= abs(value) < math.inf):
        raise LiteralError(f"{text} is out of range of {name}")
    return value


def _string(text: str) -> str:
    if text[:1] in ("'", '"') and len(text) >= 2 and text[-1] == text[0]:
        match = re.fullmatch(_QUOTED, text)
        if match is None:
            raise LiteralError(f"a {text[0]} inside the string {text} must be written \\{text[0]}")
        return unescape(match.group(2))
    return text


def unescape(text: str) -> str:
    """Replace backslash escapes; raises LiteralError for code points that do not exist."""
    return re.sub(_ESCAPE, _unescape_one, text) if "\\" in text else text


def _unescape_one(match: re.Match[str]) -> str:
    code = match.group(1)
    if code[0] in "xuU" and len(code) > 1:
        return _character(int(code[1:], 16), match.group())
    if code[0] in "01234567":
        return _character(int(code, 8), match.group())
    # An escape nobody defines keeps its backslash, as in Python and in rosidl.
    return _ESCAPES.get(code, match.group())


def _character(code: int, text: str) -> str:
    if code > 0x10FFFF or 0xD800 <= code <= 0xDFFF:
        raise LiteralError(f"{text} is not a Unicode character")
    return chr(code)


def _split_strings(text: str) -> Iterator[str]:
    """Split the inside of ``['a', "b, c", d]``; quotes are kept."""
    position, end = 0, len(text)
    if not text.strip():
        return
    while True:
        while position < end and text[position] in " \t":
            position += 1
        if position < end and text[position] in "\"'":
            match = re.compile(_QUOTED).match(text, position)
            if match is None:
                raise LiteralError(f"no closing quote after {text[position : position + 20]!r}")
            yield match.group()
            position = match.end()
            while position < end and text[position] in " \t":
                position += 1
            if position < end and text[position] != ",":
                raise LiteralError(f"expected a comma before {text[position : position + 20]!r}")
        else:
            comma = text.find(",", position)
            stop = end if comma < 0 else comma
            element = text[position:stop].strip()
            if not element:
                raise LiteralError('an element is missing; write an empty string as ""')
            yield element
            position = stop
        if position >= end:
            return
        position += 1

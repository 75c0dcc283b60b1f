"""The parser of ``.msg``, ``.srv`` and ``.action`` definitions of ROS 1 and ROS 2.

Line formats: http://wiki.ros.org/msg, http://wiki.ros.org/srv, and for ROS 2
https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html. The results are not resolved:
``nested`` has only what the text itself includes (definitions joined by ``===`` lines, as in ROS 1
connection headers and MCAP files). :class:`rosglass.Library` resolves.
"""

from __future__ import annotations

import math
import re
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from rosglass.errors import DefinitionError, InvalidNameError
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
)
from rosglass.interfaces.names import (
    KINDS,
    check_constant_name,
    check_field_name,
    check_package_name,
    check_type_name,
    join_name,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from rosglass.interfaces.definition import Value

__all__ = [
    "INTEGER_RANGES",
    "MAX_TEXT",
    "PRIMITIVES",
    "Context",
    "LiteralError",
    "Part",
    "build_message",
    "clean_comment",
    "find_unit",
    "parse",
    "parse_action",
    "parse_constant",
    "parse_default",
    "parse_message",
    "parse_service",
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
    """A literal is invalid for its type; the message gives the reason."""


def strip_comment(text: str) -> str:
    """Cut a trailing ``# comment`` off a ROS 2 value; a ``#`` inside a quoted string stays."""
    stripped = text.strip()
    if "#" not in stripped:
        return stripped
    quote = ""
    # Only a quote at the start of a value is a delimiter: elsewhere it is an apostrophe.
    quoting = stripped[0] in "\"'["
    for match in re.finditer(_QUOTE_OR_COMMENT, stripped):
        sign = match.group()
        if sign == quote:
            quote = ""
        elif not quote and sign == "#":
            return stripped[: match.start()].rstrip()
        elif not quote and quoting and sign in ("'", '"'):
            quote = sign
    # Without a closing quote, the text is not a quoted string.
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
    # An undefined escape keeps its backslash, as in Python and in rosidl.
    return _ESCAPES.get(code, match.group())


def _character(code: int, text: str) -> str:
    if code > 0x10FFFF or 0xD800 <= code <= 0xDFFF:
        raise LiteralError(f"{text} is not a Unicode character")
    return chr(code)


def _split_strings(text: str) -> Iterator[str]:
    """Split the content of ``['a', "b, c", d]``; quotes are kept."""
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


_BRACKETS = re.compile(r"\[([^\[\],]{1,24})\]")
# Starts like a unit (m, rad/s, °C, %, 1/s) and not like an index, a range or a sentence.
_UNIT = re.compile(
    r"(?:[A-Za-z\u00b5\u03bc\u03a9\u00b0%]|1 ?/)"
    r"[A-Za-z0-9\u00b5\u03bc\u03a9\u00b0%\u00b2\u00b3\u207b\u00b9\u00b7.*/^()+-]*"
    r"(?: ?[*/\u00b7] ?[A-Za-z0-9^\u00b2\u00b3]+)*"
)

# Other words that authors put in brackets.
_NO_UNITS = frozenset(
    {"default", "deprecated", "enum", "internal", "optional", "required", "todo", "unused"}
)


def clean_comment(lines: list[str]) -> str:
    """Join comment lines (without their ``#``) to one text.

    Common indentation, leading and trailing empty lines and repeated empty lines are dropped.
    """
    kept: list[str] = []
    for line in lines:
        if line.strip() or (kept and kept[-1]):
            kept.append(line.rstrip())
    while kept and not kept[-1]:
        kept.pop()
    indent = min((len(line) - len(line.lstrip()) for line in kept if line), default=0)
    return "\n".join(line[indent:] for line in kept)


def find_unit(comment: str) -> str:
    """Return the unit in brackets in a comment, e.g. ``rad/s`` for ``Speed [rad/s]``.

    As in rosidl, a unit has no comma in it (``[0, 1]`` is a range) and must be the only one; unlike
    in rosidl, bracketed numbers, ranges and sentences are not units.
    """
    if "[" not in comment:
        return ""
    units = {text.strip() for text in _BRACKETS.findall(comment)}
    units = {text for text in units if _UNIT.fullmatch(text) and text.lower() not in _NO_UNITS}
    return units.pop() if len(units) == 1 else ""


_COMMON = frozenset(
    ["bool", "byte", "char", "float32", "float64", "string"]
    + [f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)]
)

#: Names of the primitive types, by ROS version.
PRIMITIVES: dict[int, frozenset[str]] = {
    1: _COMMON | {"time", "duration"},
    2: _COMMON | {"wstring"},
}

_MAX_COUNT = 2**32 - 1  # lengths are unsigned 32-bit numbers in every wire format
_SCALARS = {ros: {name: FieldType(name) for name in PRIMITIVES[ros]} for ros in (1, 2)}

_ELEMENT = re.compile(r"([^\s#]+)(?:\s+([^\s#=]+))?\s*(.*)", re.DOTALL)
_TYPE = re.compile(r"([A-Za-z][A-Za-z0-9_/]*)(?:<=([^\[\]]*))?(?:(\[)(<=)?([^\[\]]*)\])?")
_COUNT = re.compile(r"0*[1-9][0-9]{0,9}")
_LIKELY = {
    "int": "int32",
    "uint": "uint32",
    "float": "float32",
    "double": "float64",
    "str": "string",
    "boolean": "bool",
}


class Context(NamedTuple):
    """The context of the text being parsed."""

    file: str
    provider: str
    ros: int

    def error(self, message: str, line: int = 0, column: int = 0) -> DefinitionError:
        """Create the error for a position in the file."""
        return DefinitionError(message, self.file, line, column)


class Part(NamedTuple):
    """Consecutive lines of a text.

    Attributes:
        first: Line number of the first one.
        lines: Their text, without line ends.
    """

    first: int
    lines: list[str]

    @property
    def text(self) -> str:
        """The lines joined again."""
        return "\n".join(self.lines)


class _FaultError(Exception):
    """A syntax error at an offset into the line, without its indentation."""

    def __init__(self, message: str, offset: int = 0) -> None:
        super().__init__(message)
        self.offset = offset


class _Element:
    """A field or constant whose comment may continue."""

    __slots__ = ("comment", "shared", "value")

    def __init__(self, value: Field | Constant, comment: list[str], shared: int) -> None:
        self.value, self.comment, self.shared = value, comment, shared


def build_message(
    name: str, part: Part, context: Context, nested: Mapping[str, Definition]
) -> Definition:
    """Parse the lines of one message.

    Args:
        name: Its full name.
        part: Its lines.
        context: Their context.
        nested: Definitions in the same text.

    Raises:
        DefinitionError: A line breaks a rule.
    """
    builder = _Builder(name.partition("/")[0], context)
    for number, line in enumerate(part.lines, part.first):
        text = line.strip()
        indent = len(line) - len(line.lstrip()) if text else 0
        try:
            builder.add(text, number, indent)
        except _FaultError as fault:
            column = indent + fault.offset + 1
            raise context.error(str(fault), number, column) from None
    constants, fields, comment = builder.finish()
    return Definition(
        name=name,
        ros=context.ros,
        fields=fields,
        constants=constants,
        text=part.text,
        source=Source(context.provider, context.file),
        nested=nested,
        comment=comment,
    )


class _Builder:
    """Collects the lines of one message.

    Comments belong where rosidl puts them: those at the very start to the message, those above and
    beside a field or constant to it; indented ones continue the previous one. Unlike in rosidl, a
    start comment that touches the first field belongs to both: it is ambiguous.
    """

    def __init__(self, package: str, context: Context) -> None:
        self._package, self._ros = package, context.ros
        self._elements: list[_Element] = []
        self._names: dict[str, int] = {}
        self._types = dict(_SCALARS[context.ros])
        self._header: list[str] = []
        self._in_header = True
        self._pending: list[str] = []
        self._adjacent = False

    def add(self, text: str, number: int, indent: int) -> None:
        """Parse a stripped line; raises _FaultError."""
        if not text:
            self._in_header = self._in_header and not self._header
            self._adjacent = False
        elif text[0] == "#":
            self._comment(text.lstrip("#"), indent)
        else:
            shared = 0
            above = self._pending
            if self._in_header:
                shared = len(self._header)
                above = self._header + above
            value, beside = self._parse(text, number, indent)
            comment = above if beside is None else [*above, beside]
            self._elements.append(_Element(value, comment, shared))
            self._pending, self._in_header, self._adjacent = [], False, True

    def _comment(self, comment: str, indent: int) -> None:
        if self._in_header:
            self._header.append(comment)
        elif indent and self._adjacent and not self._pending:
            self._elements[-1].comment.append(comment)
        else:
            self._pending.append(comment)

    def finish(self) -> tuple[tuple[Constant, ...], tuple[Field, ...], str]:
        """Return the constants, the fields, and the comment about the message."""
        fields: list[Field] = []
        constants: list[Constant] = []
        alone = sum(isinstance(element.value, Field) for element in self._elements) == 1
        for element in self._elements:
            value = element.value
            comment = clean_comment(element.comment) if element.comment else ""
            if isinstance(value, Constant):
                if comment:
                    value = Constant(value.name, value.type, value.value, value.text, comment)
                constants.append(value)
            elif comment:
                own = element.comment if alone else element.comment[element.shared :]
                unit = find_unit("\n".join(own))
                fields.append(
                    Field(value.name, value.type, value.default, comment, unit, value.place)
                )
            else:
                fields.append(value)
        header = self._header if self._elements else [*self._header, "", *self._pending]
        return tuple(constants), tuple(fields), clean_comment(header)

    def _parse(self, text: str, number: int, indent: int) -> tuple[Field | Constant, str | None]:
        match = _ELEMENT.match(text)
        if match is None or match.group(2) is None:
            raise _FaultError(_incomplete(text))
        type_text, name, rest = match.groups()
        if type_text[0] == "@":
            raise _FaultError(
                f"the annotation {type_text} is not supported: it changes the wire format"
            )
        element: Field | Constant
        if rest[:1] == "=":
            element, beside = self._constant(match)
        else:
            element, beside = self._field(match, (number, indent + 1))
        before = self._names.setdefault(name, number)
        if before != number:
            raise _FaultError(f"{name!r} is already defined in line {before}", match.start(2))
        return element, beside

    def _field(self, match: re.Match[str], place: tuple[int, int]) -> tuple[Field, str | None]:
        type_text, name, rest = match.groups()
        field_type = self._types.get(type_text)
        if field_type is None:
            field_type = self._types[type_text] = _field_type(type_text, self._package, self._ros)
        fault = check_field_name(name, self._ros)
        if fault:
            raise _FaultError(fault, match.start(2))
        default = None
        if rest and rest[0] != "#":
            if self._ros == 1:
                raise _FaultError(
                    f"unexpected {rest[:30]!r} after the field's name; a constant needs '=', and "
                    "default values exist in ROS 2 only",
                    match.start(3),
                )
            value_text = strip_comment(rest)
            try:
                default = parse_default(field_type, value_text)
            except LiteralError as error:
                raise _FaultError(f"default value of {name}: {error}", match.start(3)) from None
            rest = rest[len(value_text) :].lstrip()
        return Field(name, field_type, default, place=place), rest.lstrip("#") if rest else None

    def _constant(self, match: re.Match[str]) -> tuple[Constant, str | None]:
        type_text, name, rest = match.groups()
        if type_text not in PRIMITIVES[self._ros] or type_text in ("time", "duration"):
            raise _FaultError(f"a constant has a primitive type, not {type_text!r}")
        fault = check_constant_name(name, self._ros)
        if fault:
            hint = "; a default value is written without '='" if self._ros == 2 else ""
            raise _FaultError(fault + hint, match.start(2))
        written = rest[1:].lstrip()
        # ROS 1 keeps everything after the '=' of a string constant, comment signs included.
        whole = self._ros == 1 and type_text == "string"
        value_text = written if whole else strip_comment(written)
        offset = match.end(3) - len(written)
        if not value_text and type_text not in ("string", "wstring"):
            raise _FaultError(f"the constant {name} has no value", offset)
        try:
            value = parse_constant(type_text, value_text, self._ros)
        except LiteralError as error:
            raise _FaultError(f"constant {name}: {error}", offset) from None
        beside = written[len(value_text) :].lstrip()
        return Constant(name, type_text, value, value_text), beside.lstrip("#") if beside else None


def _incomplete(text: str) -> str:
    if text.startswith("---"):
        return "'---' separates the parts of services and actions; a message has only one"
    word = text.split(maxsplit=1)[0].partition("#")[0]
    return f"expected a type and a name, got only {word[:80]!r}"


def _field_type(text: str, package: str, ros: int) -> FieldType:
    """Parse the type of a field."""
    match = _TYPE.fullmatch(text)
    if match is None:
        if text.count("[") > 1:
            raise _FaultError(
                f"{text[:80]!r}: there are no arrays of arrays; put the inner one into a message"
            )
        raise _FaultError(f"{text[:80]!r} is not a type")
    base, string_bound, bracket, bounded, size = match.groups()
    if ros == 1 and (string_bound is not None or bounded):
        raise _FaultError(f"{text!r}: bounds ('<=') exist in ROS 2 only", text.index("<="))
    bound = None
    if string_bound is not None:
        if base not in ("string", "wstring"):
            raise _FaultError(f"{text!r}: only strings take a bound before '['", len(base))
        bound = _count(string_bound, "bound of a string", match.start(2))
    array, count = ArrayKind.NONE, None
    if bracket:
        array = ArrayKind.UNBOUNDED
        if bounded or size:
            array = ArrayKind.BOUNDED if bounded else ArrayKind.FIXED
            count = _count(size, "size of an array", match.start(5))
    if text == "Header" and ros == 1:
        base = "std_msgs/msg/Header"  # but Header[] is a message of the package, as in genmsg
    elif base not in PRIMITIVES[ros]:
        base = _compound(base, package, ros)
    return FieldType(base, array, count, bound)


def _count(text: str, what: str, offset: int) -> int:
    count = int(text) if _COUNT.fullmatch(text) else 0
    if not 1 <= count <= _MAX_COUNT:
        raise _FaultError(
            f"the {what} must be a whole number from 1 to {_MAX_COUNT}, got {text[:40]!r}", offset
        )
    return count


def _compound(base: str, package: str, ros: int) -> str:
    """Return the full name of a message type that a field names."""
    if base in _LIKELY:
        raise _FaultError(f"{base!r} is not a ROS type; did you mean {_LIKELY[base]}?")
    if ros == 2 and base in ("time", "duration"):
        raise _FaultError(
            f"{base!r} is a ROS 1 type; ROS 2 has builtin_interfaces/{base.capitalize()}"
        )
    if ros == 1 and base == "wstring":
        raise _FaultError("'wstring' exists in ROS 2 only")
    parts = base.split("/")
    if len(parts) == 1:
        parts = [package, "msg", base]
    elif len(parts) == 2:
        parts = [parts[0], "msg", parts[1]]
    elif len(parts) != 3 or parts[1] not in KINDS:
        raise _FaultError(f"{base[:80]!r} is not a type; a message type is written package/Type")
    fault = check_package_name(parts[0], ros) or check_type_name(parts[2], ros)
    if fault:
        raise _FaultError(f"unknown type {base[:80]!r}: {fault}")
    return "/".join(parts)


#: Size limit of a definition in characters; real ones have less than a tenth.
MAX_TEXT = 1024 * 1024

_NEWLINE = re.compile(r"\r\n|\r|\n")
_SEPARATOR = re.compile(r"={3,}[ \t]*")
_BLOCK_NAME = re.compile(r"[ \t]*MSG:[ \t]*(\S+)[ \t]*")


def parse(
    text: str, name: str, *, ros: int = 2, file: str = "", provider: str = "text"
) -> InterfaceDefinition:
    """Parse a definition, of the kind given by its name (``pkg/msg/..``, ``pkg/srv/..``, ...).

    Args:
        text: The definition, optionally with those it needs appended after ``===`` lines.
        name: Full type name; ``pkg/Type`` means a message.
        ros: 1 or 2.
        file: Label for error messages, by default the name in angle brackets.
        provider: Recorded in the definition's source.

    Raises:
        DefinitionError: The text breaks a rule; the message names the place.
        InvalidNameError: `name` is not a type name.
    """
    kind = join_name(name).split("/")[1]
    if kind == "srv":
        return parse_service(text, name, ros=ros, file=file, provider=provider)
    if kind == "action":
        return parse_action(text, name, ros=ros, file=file, provider=provider)
    return parse_message(text, name, ros=ros, file=file, provider=provider)


def parse_message(
    text: str, name: str, *, ros: int = 2, file: str = "", provider: str = "text"
) -> Definition:
    """Parse a message definition; arguments and errors as in :func:`parse`."""
    full, context = _check(text, name, "msg", ros, file, provider)
    main, nested = _split_blocks(text, context)
    return build_message(full, main, context, nested)


def parse_service(
    text: str, name: str, *, ros: int = 2, file: str = "", provider: str = "text"
) -> ServiceDefinition:
    """Parse a service definition; arguments and errors as in :func:`parse`.

    The request and response are called ``pkg/srv/Type_Request`` and ``_Response`` in ROS 2,
    ``pkg/srv/TypeRequest`` and ``TypeResponse`` in ROS 1.
    """
    full, context = _check(text, name, "srv", ros, file, provider)
    main, nested = _split_blocks(text, context)
    parts = _split_parts(main, context)
    if len(parts) == 1 and ros == 1:
        parts.append(Part(0, []))  # genmsg reads it as a service with an empty response
    if len(parts) != 2:
        raise context.error(
            f"a service has one line '---' between request and response, found {len(parts) - 1}",
            parts[2].first - 1 if len(parts) > 2 else 0,
        )
    stem = full if ros == 1 else f"{full}_"
    return ServiceDefinition(
        name=full,
        ros=ros,
        request=build_message(f"{stem}Request", parts[0], context, nested),
        response=build_message(f"{stem}Response", parts[1], context, nested),
        text=main.text,
        source=Source(provider, context.file),
    )


def parse_action(
    text: str, name: str, *, ros: int = 2, file: str = "", provider: str = "text"
) -> ActionDefinition:
    """Parse an action definition; arguments and errors as in :func:`parse`.

    Goal, result and feedback are called ``pkg/action/Type_Goal`` and so on in ROS 2,
    ``pkg/msg/TypeGoal`` and so on in ROS 1.
    """
    full, context = _check(text, name, "action", ros, file, provider)
    main, nested = _split_blocks(text, context)
    parts = _split_parts(main, context)
    if len(parts) != 3:
        raise context.error(
            "an action has two lines '---', between goal, result and feedback, found "
            f"{len(parts) - 1}",
            parts[3].first - 1 if len(parts) > 3 else 0,
        )
    stem = full.replace("/action/", "/msg/") if ros == 1 else f"{full}_"
    return ActionDefinition(
        name=full,
        ros=ros,
        goal=build_message(f"{stem}Goal", parts[0], context, nested),
        result=build_message(f"{stem}Result", parts[1], context, nested),
        feedback=build_message(f"{stem}Feedback", parts[2], context, nested),
        text=main.text,
        source=Source(provider, context.file),
    )


def _check(
    text: str, name: str, kind: str, ros: int, file: str, provider: str
) -> tuple[str, Context]:
    """Check the arguments; returns the full name and the context."""
    full = join_name(name, kind)
    context = Context(file or f"<{full}>", provider, ros)
    if ros not in (1, 2):
        raise context.error(f"ros must be 1 or 2, got {ros!r}")
    if not isinstance(text, str):
        raise context.error(f"the definition must be a str, got {type(text).__name__}")
    if len(text) > MAX_TEXT:
        raise context.error(f"the definition has {len(text)} characters, the limit is {MAX_TEXT}")
    package, found, base = full.split("/")
    # Requests, goals and such are messages that live in a service's or action's namespace.
    if kind not in (found, "msg"):
        raise InvalidNameError(f"{name} names a {found}, but a {kind} is to be parsed")
    fault = check_package_name(package, ros) or check_type_name(base, ros)
    if fault:
        raise context.error(fault)
    return full, context


def _split_blocks(text: str, context: Context) -> tuple[Part, dict[str, Definition]]:
    """Split joined definitions at their ``===`` and ``MSG: pkg/Type`` lines; parse the others."""
    lines = _NEWLINE.split(text.removeprefix("\ufeff"))
    starts = [
        index
        for index, line in enumerate(lines)
        if line.startswith("===") and _SEPARATOR.fullmatch(line)
    ]
    nested: dict[str, Definition] = {}
    for start, end in pairwise([*starts, len(lines)]):
        header = lines[start + 1] if start + 1 < end else ""
        match = _BLOCK_NAME.fullmatch(header)
        if match is None:
            raise context.error("expected 'MSG: package/Type' after a '===' line", start + 2, 1)
        try:
            name = join_name(match.group(1))
        except InvalidNameError as error:
            raise context.error(str(error), start + 2, match.start(1) + 1) from None
        block = build_message(name, Part(start + 3, lines[start + 2 : end]), context, {})
        # Some recorders repeat definitions.
        known = nested.setdefault(name, block)
        if (known.fields, known.constants) != (block.fields, block.constants):
            raise context.error(f"{name} is defined twice, differently", start + 2, 1)
    main = lines[: starts[0]] if starts else lines
    return Part(1, main), nested


def _split_parts(part: Part, context: Context) -> list[Part]:
    """Split at the ``---`` lines of services and actions."""
    cuts = [index for index, line in enumerate(part.lines) if line.startswith("---")]
    for cut in cuts:
        # genmsg accepts any line with this prefix, rosidl only '---' itself.
        if context.ros == 2 and part.lines[cut].strip("- \t"):
            raise context.error("a line that separates is just '---'", part.first + cut, 1)
    bounds = [-1, *cuts, len(part.lines)]
    return [
        Part(part.first + start + 1, part.lines[start + 1 : end]) for start, end in pairwise(bounds)
    ]

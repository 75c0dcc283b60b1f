"""The lines of a message: fields, constants and comments."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from rosglass.errors import DefinitionError
from rosglass.interfaces.comments import clean_comment, find_unit
from rosglass.interfaces.definition import (
    ArrayKind,
    Constant,
    Definition,
    Field,
    FieldType,
    Source,
)
from rosglass.interfaces.literals import LiteralError, parse_constant, parse_default, strip_comment
from rosglass.interfaces.names import (
    KINDS,
    check_constant_name,
    check_field_name,
    check_package_name,
    check_type_name,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["PRIMITIVES", "Context", "Part", "build_message"]

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
    """Where the text being parsed belongs."""

    file: str
    provider: str
    ros: int

    def error(self, message: str, line: int = 0, column: int = 0) -> DefinitionError:
        """Return the error to raise for a place in the file."""
        return DefinitionError(message, self.file, line, column)


class Part(NamedTuple):
    """A run of lines.

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
    """Something is wrong at an offset into the line, counted without its indentation."""

    def __init__(self, message: str, offset: int = 0) -> None:
        super().__init__(message)
        self.offset = offset


class _Element:
    """A field or constant whose comment is still growing."""

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
        context: Where they belong.
        nested: Definitions that came along.

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

    Comments go the way rosidl sends them: those at the very start are about the message, those
    above and beside a field or constant about it, indented ones continue the one before. Unlike
    rosidl, a start comment that touches the first field goes to both: nobody can tell whose it is.
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
        """Take one line, stripped; raises _FaultError."""
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

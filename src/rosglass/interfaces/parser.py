"""The parser of ``.msg``, ``.srv`` and ``.action`` definitions of ROS 1 and ROS 2.

Line formats: http://wiki.ros.org/msg, http://wiki.ros.org/srv, and for ROS 2
https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html. The results are not resolved:
``nested`` holds only what the text itself brought along (definitions joined by ``===`` lines, as
ROS 1 connection headers and MCAP files carry them). :class:`rosglass.Library` resolves.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from rosglass.errors import DefinitionError
from rosglass.interfaces.comments import clean_comment, find_unit
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
from rosglass.interfaces.literals import (
    LiteralError,
    parse_constant,
    parse_default,
    strip_comment,
)
from rosglass.interfaces.names import (
    check_constant_name,
    check_field_name,
    check_package_name,
    check_type_name,
    join_name,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rosglass.interfaces.definition import InterfaceDefinition

__all__ = ["PRIMITIVES", "parse", "parse_action", "parse_message", "parse_service"]

_COMMON = frozenset(
    ["bool", "byte", "char", "float32", "float64", "string"]
    + [f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)]
)

#: Names of the primitive types, by ROS version.
PRIMITIVES: dict[int, frozenset[str]] = {
    1: _COMMON | {"time", "duration"},
    2: _COMMON | {"wstring"},
}

_MAX_TEXT = 8 * 1024 * 1024
_MAX_COUNT = 2**32 - 1  # lengths are unsigned 32-bit numbers in every wire format
_SCALARS = {ros: {name: FieldType(name) for name in PRIMITIVES[ros]} for ros in (1, 2)}

_NEWLINE = re.compile(r"\r\n|\r|\n")
_ELEMENT = re.compile(r"([^\s#]+)(?:\s+([^\s#=]+))?\s*(.*)", re.DOTALL)
_TYPE = re.compile(r"([A-Za-z][A-Za-z0-9_/]*)(?:<=([^\[\]]*))?(?:(\[)(<=)?([^\[\]]*)\])?", re.ASCII)
_NUMBER = re.compile(r"[0-9]{1,20}", re.ASCII)
_SEPARATOR = re.compile(r"={3,}\s*")
_BLOCK_NAME = re.compile(r"\s*MSG:\s*(\S+)\s*")

_SPLIT_HINT = {"int": "int32", "uint": "uint32", "float": "float32", "double": "float64"}


class _Line(NamedTuple):
    number: int
    text: str


class _Context(NamedTuple):
    """Where the text being parsed belongs."""

    file: str
    provider: str
    ros: int

    def error(self, message: str, line: int = 0, column: int = 0) -> DefinitionError:
        return DefinitionError(message, self.file, line, column)


def parse(
    text: str, name: str, *, ros: int = 2, file: str = "", provider: str = "text"
) -> InterfaceDefinition:
    """Parse a definition whose kind is in its name (``pkg/msg/..``, ``pkg/srv/..``, ...).

    Args:
        text: The definition, optionally with those it needs appended after ``===`` lines.
        name: Full type name; ``pkg/Type`` means a message.
        ros: 1 or 2.
        file: Label for error messages, by default the name in angle brackets.
        provider: Recorded in the definition's source.

    Raises:
        DefinitionError: The text breaks a rule; says where.
        InvalidNameError: `name` is not a type name.
    """
    kind = join_name(name).split("/")[1]
    parser = {"msg": parse_message, "srv": parse_service, "action": parse_action}[kind]
    return parser(text, name, ros=ros, file=file, provider=provider)


def parse_message(
    text: str, name: str, *, ros: int = 2, file: str = "", provider: str = "text"
) -> Definition:
    """Parse a message definition; arguments and errors as in :func:`parse`."""
    full, context, blocks = _prepare(text, name, "msg", ros, file, provider)
    return _message(full, blocks.pop(full), context, _parse_blocks(blocks, context))


def parse_service(
    text: str, name: str, *, ros: int = 2, file: str = "", provider: str = "text"
) -> ServiceDefinition:
    """Parse a service definition; arguments and errors as in :func:`parse`.

    The request and response are called ``pkg/srv/Type_Request`` and ``_Response`` in ROS 2,
    ``pkg/srv/TypeRequest`` and ``TypeResponse`` in ROS 1.
    """
    full, context, blocks = _prepare(text, name, "srv", ros, file, provider)
    lines = blocks.pop(full)
    parts = _split_parts(lines, context)
    if len(parts) == 1 and ros == 1:
        parts.append([])  # genmsg reads it as a service that answers nothing
    if len(parts) != 2:
        raise context.error(
            f"a service has one line '---' between request and response, found {len(parts) - 1}",
            parts[2][0].number - 1 if len(parts) > 2 and parts[2] else 0,
        )
    nested = _parse_blocks(blocks, context)
    joint = "" if ros == 1 else "_"
    return ServiceDefinition(
        name=full,
        ros=ros,
        request=_message(f"{full}{joint}Request", parts[0], context, nested),
        response=_message(f"{full}{joint}Response", parts[1], context, nested),
        text=_join(lines),
        source=Source(provider, context.file),
    )


def parse_action(
    text: str, name: str, *, ros: int = 2, file: str = "", provider: str = "text"
) -> ActionDefinition:
    """Parse an action definition; arguments and errors as in :func:`parse`.

    Goal, result and feedback are called ``pkg/action/Type_Goal`` and so on in ROS 2,
    ``pkg/msg/TypeGoal`` and so on in ROS 1.
    """
    full, context, blocks = _prepare(text, name, "action", ros, file, provider)
    lines = blocks.pop(full)
    parts = _split_parts(lines, context)
    if len(parts) != 3:
        raise context.error(
            "an action has two lines '---', between goal, result and feedback, "
            f"found {len(parts) - 1}",
            parts[3][0].number - 1 if len(parts) > 3 and parts[3] else 0,
        )
    nested = _parse_blocks(blocks, context)
    package, _, base = full.split("/")
    stem = f"{package}/msg/{base}" if ros == 1 else f"{full}_"
    goal, result, feedback = (
        _message(stem + part, part_lines, context, nested)
        for part, part_lines in zip(("Goal", "Result", "Feedback"), parts, strict=True)
    )
    return ActionDefinition(
        name=full,
        ros=ros,
        goal=goal,
        result=result,
        feedback=feedback,
        text=_join(lines),
        source=Source(provider, context.file),
    )


def _prepare(
    text: str, name: str, kind: str, ros: int, file: str, provider: str
) -> tuple[str, _Context, dict[str, list[_Line]]]:
    """Check the arguments and split the text into the definitions that it holds."""
    full = join_name(name, kind)
    context = _Context(file or f"<{full}>", provider, ros)
    if ros not in (1, 2):
        raise context.error(f"ros must be 1 or 2, got {ros!r}")
    if not isinstance(text, str):
        raise context.error(f"the definition must be a str, got {type(text).__name__}")
    if len(text) > _MAX_TEXT:
        raise context.error(f"the definition has {len(text)} characters, the limit is {_MAX_TEXT}")
    package, found, base = full.split("/")
    # Requests, goals and such are messages that live in a service's or action's namespace.
    if found != kind and (kind != "msg" or ros == 1):
        raise context.error(f"{name} is the name of a {found}, expected one of a {kind}")
    fault = check_package_name(package, ros) or check_type_name(base, ros)
    if fault:
        raise context.error(fault)
    lines = [
        _Line(number, line)
        for number, line in enumerate(_NEWLINE.split(text.removeprefix("\ufeff")), 1)
    ]
    return full, context, _split_blocks(full, lines, context)


def _split_blocks(full: str, lines: list[_Line], context: _Context) -> dict[str, list[_Line]]:
    """Split joined definitions at their ``===`` and ``MSG: pkg/Type`` lines."""
    blocks: dict[str, list[_Line]] = {full: []}
    current, expect_name = blocks[full], False
    for line in lines:
        if expect_name:
            match = _BLOCK_NAME.fullmatch(line.text)
            if match is None:
                raise context.error(
                    "expected 'MSG: package/Type' after the '===' line", line.number, 1
                )
            current, expect_name = [], False
            name = join_name(match.group(1))
            known = blocks.setdefault(name, current)
            if known is not current:
                # Some recorders repeat a definition; parsed once, compared as text.
                current = []
                blocks[f"{name} {line.number}"] = current
        elif line.text.startswith("===") and _SEPARATOR.fullmatch(line.text):
            expect_name = True
        else:
            current.append(line)
    return _without_repetitions(blocks, context)


def _without_repetitions(
    blocks: dict[str, list[_Line]], context: _Context
) -> dict[str, list[_Line]]:
    for key in [key for key in blocks if " " in key]:
        name, lines = key.split(" ")[0], blocks.pop(key)
        if _join(lines).strip() != _join(blocks[name]).strip():
            raise context.error(
                f"the text defines {name} twice, differently", int(key.split(" ")[1]), 1
            )
    return blocks


def _parse_blocks(blocks: dict[str, list[_Line]], context: _Context) -> dict[str, Definition]:
    return {name: _message(name, lines, context, {}) for name, lines in blocks.items()}


def _split_parts(lines: list[_Line], context: _Context) -> list[list[_Line]]:
    """Split at the ``---`` lines of services and actions."""
    parts: list[list[_Line]] = [[]]
    for line in lines:
        if line.text.startswith("---"):
            if line.text.strip("- \t") and context.ros == 2:
                raise context.error("a separator line is just '---'", line.number, 1)
            parts.append([])
        else:
            parts[-1].append(line)
    return parts


def _join(lines: list[_Line]) -> str:
    return "\n".join(line.text for line in lines)


def _message(
    name: str, lines: list[_Line], context: _Context, nested: Mapping[str, Definition]
) -> Definition:
    builder = _Builder(name, context)
    for line in lines:
        builder.add(line)
    return builder.build(_join(lines), nested)


class _Element:
    """A field or constant whose comment is still growing."""

    __slots__ = ("comment", "leading", "value")

    def __init__(self, value: Field | Constant, leading: int, comment: list[str]) -> None:
        self.value, self.leading, self.comment = value, leading, comment


class _Builder:
    """Collects the lines of one message."""

    def __init__(self, name: str, context: _Context) -> None:
        self.name, self.context = name, context
        self.package = name.split("/", maxsplit=1)[0]
        self.elements: list[_Element] = []
        self.names: dict[str, int] = {}
        self.types = dict(_SCALARS[context.ros])
        # A comment at the very start is about the message; followed directly by a field it may
        # as well be about that field, so it goes to both.
        self.header: list[str] | None = []
        self.header_comment = ""
        self.pending: list[str] = []
        self.adjacent = False

    def add(self, line: _Line) -> None:
        text = line.text
        stripped = text.strip()
        if not stripped:
            self._end_header(blank=True)
            self.adjacent = False
        elif stripped[0] == "#":
            comment = stripped.lstrip("#")
            if text[0] != "#" and self.adjacent and not self.pending:
                self.elements[-1].comment.append(comment)
            elif self.header is not None and text[0] == "#":
                self.header.append(comment)
            else:
                self.pending.append(comment)
        else:
            leading = self._end_header(blank=False)
            value, beside = self._parse(line, stripped, len(text) - len(text.lstrip()))
            comment_lines = self.pending if beside is None else [*self.pending, beside]
            self.elements.append(_Element(value, leading, comment_lines))
            self.pending, self.adjacent = [], True

    def _end_header(self, *, blank: bool) -> int:
        """Close the leading comment; returns how many of its lines the next field shares."""
        if self.header is None or (blank and not self.header and not self.pending):
            return 0
        shared = 0
        if self.header:
            self.header_comment = clean_comment(self.header)
            if not blank:
                shared = len(self.header)
                self.pending = self.header + self.pending
        self.header = None
        return shared

    def _parse(self, line: _Line, text: str, indent: int) -> tuple[Field | Constant, str | None]:
        def error(message: str, offset: int = 0) -> DefinitionError:
            return self.context.error(message, line.number, indent + offset + 1)

        match = _ELEMENT.match(text)
        if match is None or match.group(2) is None:
            raise error(self._incomplete(text))
        type_text, name, rest = match.groups()
        if type_text[0] == "@":
            raise error(
                f"the annotation {type_text} is not supported; such fields have no plain CDR"
            )
        if rest[:1] == "=":
            return self._constant(match, line, indent)
        field_type = self.types.get(type_text)
        if field_type is None:
            field_type = self._type(type_text, error)
            self.types[type_text] = field_type
        fault = check_field_name(name, self.context.ros)
        if fault:
            raise error(fault, match.start(2))
        self._claim(name, line, indent + match.start(2))
        default = None
        beside: str | None = None
        if rest and rest[0] != "#":
            if self.context.ros == 1:
                raise error(
                    f"unexpected {rest[:30]!r} after the field name; ROS 1 has no default values, "
                    "constants need '='",
                    match.start(3),
                )
            value_text = strip_comment(rest)
            try:
                default = parse_default(field_type, value_text)
            except LiteralError as fault_:
                raise error(f"default of {name}: {fault_}", match.start(3)) from None
            rest = rest[len(value_text) :].lstrip()
        if rest:
            beside = rest.lstrip("#")
        place = (line.number, indent + 1)
        return Field(name, field_type, default, place=place), beside

    def _constant(
        self, match: re.Match[str], line: _Line, indent: int
    ) -> tuple[Constant, str | None]:
        def error(message: str, offset: int) -> DefinitionError:
            return self.context.error(message, line.number, indent + offset + 1)

        type_text, name, rest = match.groups()
        ros = self.context.ros
        if type_text not in PRIMITIVES[ros] or type_text in ("time", "duration"):
            raise error(
                f"a constant can't be of the type {type_text!r}, only of a primitive one", 0
            )
        fault = check_constant_name(name, ros)
        if fault:
            hint = "; a default value is written without '='" if ros == 2 else ""
            raise error(fault + hint, match.start(2))
        after = rest[1:]
        # ROS 1 keeps everything after the '=' of a string constant, comment signs included.
        whole = ros == 1 and type_text == "string"
        value_text = after.strip() if whole else strip_comment(after)
        if not value_text and type_text not in ("string", "wstring"):
            raise error(f"the constant {name} has no value", match.start(3))
        try:
            value = parse_constant(type_text, value_text, ros)
        except LiteralError as fault_:
            offset = match.start(3) + 1 + len(after) - len(after.lstrip())
            raise error(f"constant {name}: {fault_}", offset) from None
        self._claim(name, line, indent + match.start(2))
        remainder = after.lstrip()[len(value_text) :].lstrip()
        return Constant(name, type_text, value, value_text), remainder.lstrip("#") or None

    def _claim(self, name: str, line: _Line, column: int) -> None:
        before = self.names.setdefault(name, line.number)
        if before != line.number:
            raise self.context.error(
                f"{name!r} is already defined in line {before}", line.number, column + 1
            )

    def _incomplete(self, text: str) -> str:
        if text.startswith("---"):
            return "'---' separates the parts of services and actions; a message has none"
        word = text.split(maxsplit=1)[0].split("#", maxsplit=1)[0]
        return f"expected 'type name', got only {word!r}"

    def _type(self, text: str, error: object) -> FieldType:
        assert callable(error)
        match = _TYPE.fullmatch(text)
        if match is None:
            raise error(self._bad_type(text))
        base, string_bound, bracket, bounded, size = match.groups()
        ros = self.context.ros
        if ros == 1 and (string_bound is not None or bounded):
            raise error(f"{text!r}: bounds ('<=') exist in ROS 2 only", text.index("<="))
        if string_bound is not None and base not in ("string", "wstring"):
            raise error(f"{text!r}: only string and wstring take a bound before '['", len(base))
        bound = None
        if string_bound is not None:
            bound = self._count(string_bound, "string bound", error, match.start(2))
        array, count = ArrayKind.NONE, None
        if bracket:
            array = ArrayKind.UNBOUNDED
            if bounded or size:
                array = ArrayKind.BOUNDED if bounded else ArrayKind.FIXED
                count = self._count(size, "array size", error, match.start(5))
        if base not in PRIMITIVES[ros]:
            base = self._compound(base, error)
        return FieldType(base, array, count, bound)

    def _bad_type(self, text: str) -> str:
        if text.count("[") > 1:
            return f"{text!r}: arrays of arrays don't exist; put the inner array into a message"
        return f"{text!r} is not a type"

    def _count(self, text: str, what: str, error: object, offset: int) -> int:
        assert callable(error)
        count = int(text) if _NUMBER.fullmatch(text) else 0
        if not 1 <= count <= _MAX_COUNT:
            raise error(f"{what} {text!r} must be a whole number from 1 to {_MAX_COUNT}", offset)
        return count

    def _compound(self, base: str, error: object) -> str:
        assert callable(error)
        ros = self.context.ros
        if base in _SPLIT_HINT:
            raise error(f"{base!r} is not a ROS type; did you mean {_SPLIT_HINT[base]}?")
        if ros == 2 and base in ("time", "duration"):
            raise error(
                f"{base!r} is a ROS 1 type; in ROS 2 write builtin_interfaces/{base.capitalize()}"
            )
        if ros == 1 and base == "wstring":
            raise error("'wstring' exists in ROS 2 only")
        if ros == 1 and base == "Header":
            return "std_msgs/msg/Header"
        parts = base.split("/")
        if len(parts) == 1:
            package, kind, name = self.package, "msg", parts[0]
        elif len(parts) == 2:
            package, kind, name = parts[0], "msg", parts[1]
        elif len(parts) == 3 and parts[1] in ("msg", "srv", "action"):
            package, kind, name = parts
        else:
            raise error(f"{base!r} is not a type name; write package/Type")
        fault = check_package_name(package, ros) or check_type_name(name, ros)
        if fault:
            raise error(f"unknown type {base!r}: {fault}")
        return f"{package}/{kind}/{name}"

    def build(self, text: str, nested: Mapping[str, Definition]) -> Definition:
        if self.header is not None:
            self.header_comment = clean_comment(self.header)
        elif not self.elements and self.pending:
            self.header_comment = clean_comment([self.header_comment, "", *self.pending])
        fields: list[Field] = []
        constants: list[Constant] = []
        alone = sum(isinstance(element.value, Field) for element in self.elements) == 1
        for element in self.elements:
            value = element.value
            if isinstance(value, Constant):
                if element.comment:
                    comment = clean_comment(element.comment)
                    value = Constant(value.name, value.type, value.value, value.text, comment)
                constants.append(value)
                continue
            if element.comment:
                own = element.comment if alone else element.comment[element.leading :]
                value = Field(
                    value.name,
                    value.type,
                    value.default,
                    clean_comment(element.comment),
                    find_unit("\n".join(own)),
                    value.place,
                )
            fields.append(value)
        return Definition(
            name=self.name,
            ros=self.context.ros,
            fields=tuple(fields),
            constants=tuple(constants),
            text=text,
            source=Source(self.context.provider, self.context.file),
            nested=nested,
            comment=self.header_comment,
        )

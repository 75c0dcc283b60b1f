"""The parser of ``.idl`` definitions, for the subset of OMG IDL 4.2 that rosidl supports.

Grammar: https://www.omg.org/spec/IDL/4.2 and
https://design.ros2.org/articles/idl_interface_definition.html. Written here because the parser in
rosbags 0.11 refuses the ``#include`` lines of every generated file, drops default values, units and
comments, and takes minutes for a constant in three pairs of parentheses.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from rosglass.errors import DefinitionError
from rosglass.interfaces.definition import (
    PLACEHOLDER,
    ActionDefinition,
    ArrayKind,
    Constant,
    Definition,
    Field,
    FieldType,
    ServiceDefinition,
    Source,
)
from rosglass.interfaces.names import check_package_name, check_type_name, join_name
from rosglass.interfaces.parser import (
    MAX_TEXT,
    LiteralError,
    clean_comment,
    parse_constant,
    parse_default,
    unescape,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosglass.interfaces.definition import InterfaceDefinition, Value

__all__ = ["parse_idl"]

_HEADER = r"(?m)^={3,}[ \t]*\r?\n[ \t]*IDL:[ \t]*(\S{1,255})[ \t]*\r?$"
# A generated file has a few hundred.
_MAX_TOKENS = 250_000

# Compiled on first use: it takes longer than the rest of this package takes to import.
_TOKEN = r"""
    (?P<skip>\s+|//[^\n]*|/\*(?:[^*]|\*(?!/))*\*/|^[ \t]*\#[^\n]*)
    |(?P<string>L?"(?:\\.|[^"\\\n])*")
    |(?P<char>L?'(?:\\(?:x[0-9A-Fa-f]{1,2}|u[0-9A-Fa-f]{1,4}|[0-7]{1,3}|.)|[^'\\\n])')
    |(?P<number>0[xX][0-9a-fA-F]+|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
    |(?P<name>[A-Za-z_][A-Za-z0-9_]*)
    |(?P<sign>::|[{}()\[\]<>;:,=@+\-*%&|^~]|/(?!\*))
"""


class Token(NamedTuple):
    """A token.

    Attributes:
        kind: ``string``, ``char``, ``number``, ``name``, ``sign`` or ``end``.
        text: As written.
        offset: Its start in the text.
    """

    kind: str
    text: str
    offset: int


class Lexer:
    """Splits a text into tokens.

    Args:
        text: The IDL.
        file: Label for errors.

    Raises:
        DefinitionError: The text contains something that is not a token.
    """

    def __init__(self, text: str, file: str) -> None:
        self.file = file
        self._lines = [0, *(match.end() for match in re.finditer("\n", text))]
        self._tokens: list[Token] = []
        self._next = 0
        for token in self._scan(text):
            self._tokens.append(token)
            if len(self._tokens) > _MAX_TOKENS:
                raise self.error(f"the text has more than {_MAX_TOKENS} words and signs", token)

    def _scan(self, text: str) -> Iterator[Token]:
        token = re.compile(_TOKEN, re.VERBOSE | re.MULTILINE | re.DOTALL)
        position, end = 0, len(text)
        while position < end:
            match = token.match(text, position)
            if match is None:
                shown = text[position : position + 20].partition("\n")[0]
                raise self.error(f"{shown!r} is not IDL", Token("", "", position))
            kind = match.lastgroup or ""
            if kind != "skip":
                yield Token(kind, match.group(), position)
            position = match.end()
        yield Token("end", "end of file", end)

    def place(self, token: Token) -> tuple[int, int]:
        """Return the line and column of a token, both from 1."""
        line = bisect_right(self._lines, token.offset)
        return line, token.offset - self._lines[line - 1] + 1

    def error(self, message: str, token: Token) -> DefinitionError:
        """Create the error for a token."""
        return DefinitionError(message, self.file, *self.place(token))

    @property
    def token(self) -> Token:
        """The next token."""
        return self._tokens[self._next]

    def take(self, expected: str = "", kind: str = "") -> Token:
        """Consume and return the next token.

        Raises:
            DefinitionError: The token does not have the expected text or kind.
        """
        token = self.token
        if (expected and token.text != expected) or (kind and token.kind != kind):
            raise self.error(f"expected {expected or 'a ' + kind!r}, got {token.text!r}", token)
        if token.kind != "end":
            self._next += 1
        return token

    def accept(self, text: str) -> bool:
        """Consume the next token if it is `text`; return whether it was."""
        if self.token.text != text or self.token.kind in ("string", "char"):
            return False
        self._next += 1
        return True

    def strings(self) -> str:
        """Consume adjacent string literals and return their joined value."""
        parts = []
        while self.token.kind == "string":
            token = self.take()
            try:
                parts.append(unescape(token.text.removeprefix("L")[1:-1]))
            except LiteralError as error:
                raise self.error(str(error), token) from None
        return "".join(parts)


_MAX_COUNT = 2**32 - 1
_MAX_MODULES = 16

_BASIC = {
    "boolean": "bool",
    "octet": "byte",
    "char": "char",
    "float": "float32",
    "double": "float64",
    "short": "int16",
    "long": "int32",
    "long long": "int64",
    "unsigned short": "uint16",
    "unsigned long": "uint32",
    "unsigned long long": "uint64",
    **{name: name for name in ("int8", "uint8", "int16", "uint16", "int32", "uint32")},
    **{name: name for name in ("int64", "uint64", "string", "wstring")},
}
_UNSUPPORTED = frozenset(
    {"any", "bitmask", "bitset", "component", "exception", "fixed", "import", "interface", "map"}
    | {"native", "Object", "union", "valuetype", "wchar"}
)
#: Annotations that change the wire format of a struct, which ROS 2 does not support.
_WIRE_ANNOTATIONS = frozenset(("mutable", "optional"))

_Literal = bool | int | float | str


class _Annotations(NamedTuple):
    comment: str = ""
    unit: str = ""
    default: tuple[_Literal, Token] | None = None


class _Struct(NamedTuple):
    fields: list[Field]
    comment: str


def parse_idl(
    text: str, name: str, *, file: str = "", provider: str = "text"
) -> InterfaceDefinition:
    """Parse an IDL file of ROS 2.

    Args:
        text: The IDL; its includes are not read, types are looked up by name. It may be several
            files, each after a ``===`` line and ``IDL: pkg/msg/Type``, as recordings have them.
        name: Full name of the type to return; ``pkg/Type`` means a message.
        file: Label for error messages, by default the name in angle brackets.
        provider: Recorded in the definition's source.

    Returns:
        The definition, not resolved; ``nested`` holds the other messages in the text.

    Raises:
        DefinitionError: The text is not IDL, uses a feature ROS 2 lacks, or has no such type.
        InvalidNameError: `name` is not a type name.
    """
    full = join_name(name)
    source = Source(provider, file or f"<{full}>")
    if not isinstance(text, str):
        raise DefinitionError(
            f"the definition must be a str, got {type(text).__name__}", source.file
        )
    if len(text) > MAX_TEXT:
        raise DefinitionError(
            f"the definition has {len(text)} characters, the limit is {MAX_TEXT}", source.file
        )
    # One mapping for all, so that many structs don't take quadratic memory.
    messages: dict[str, Definition] = {}
    for label, part_text in _split_files(text.removeprefix("\ufeff"), source.file):
        _Parser(Lexer(part_text, label)).read(part_text, Source(provider, label), messages)

    def part(suffix: str) -> Definition:
        found = messages.get(f"{full}{suffix}")
        if found is None:
            known = ", ".join(messages) or "no struct"
            raise DefinitionError(f"the IDL has no {full}{suffix}, but {known}", source.file)
        return found

    kind = full.split("/")[1]
    if kind == "srv" and full not in messages:
        return ServiceDefinition(full, 2, part("_Request"), part("_Response"), text, source)
    if kind == "action" and full not in messages:
        goal, result, feedback = part("_Goal"), part("_Result"), part("_Feedback")
        return ActionDefinition(full, 2, goal, result, feedback, text, source)
    return part("")


def _split_files(text: str, file: str) -> Iterator[tuple[str, str]]:
    """Yield a label and the text of each file; without ``===`` lines, the text is one."""
    start, label = 0, file
    for header in re.finditer(_HEADER, text):
        if text[start : header.start()].strip():
            yield label, text[start : header.start()]
        start, label = header.end(), f"<{header.group(1)}>"
    yield label, text[start:]


class _Parser:
    """Parses a file; scoped names are tuples of their parts."""

    def __init__(self, lexer: Lexer) -> None:
        self._lexer = lexer
        self._scope: tuple[str, ...] = ()
        #: The struct whose fields are read.
        self._struct_name = ""
        self._structs: dict[tuple[str, ...], _Struct] = {}
        self._typedefs: dict[tuple[str, ...], FieldType] = {}
        self._constants: dict[tuple[str, ...], Constant] = {}
        #: Those of messages without their modules, X_Constants: the values by these.
        self._homes: dict[tuple[str, ...], dict[str, _Literal]] = {}

    def read(self, text: str, source: Source, messages: dict[str, Definition]) -> None:
        """Parse the file; adds its structs by full name, each with all of `messages` as nested."""
        while self._lexer.token.kind != "end":
            self._definition()
        constants: dict[tuple[str, ...], list[Constant]] = {}
        for scope, constant in self._constants.items():
            constants.setdefault(scope[:-1], []).append(constant)
        for scope, struct in self._structs.items():
            name = "/".join(scope)
            read = Definition(
                name=name,
                ros=2,
                fields=tuple(field for field in struct.fields if field.name != PLACEHOLDER),
                constants=tuple(constants.get((*scope[:-1], f"{scope[-1]}_Constants"), ())),
                text=text,
                source=source,
                nested=messages,
                comment=struct.comment,
            )
            known = messages.setdefault(name, read)
            if (known.fields, known.constants) != (read.fields, read.constants):
                raise DefinitionError(f"{name} is defined twice, differently", source.file)

    def _definition(self) -> None:
        notes = self._annotations()
        token = self._lexer.take()
        if token.text == "module":
            self._module()
        elif token.text == "struct":
            self._struct(notes)
        elif token.text == "const":
            self._const(notes)
        elif token.text == "typedef":
            self._typedef()
        elif token.text == "enum":
            self._enum()
        else:
            raise self._lexer.error(self._refusal(token), token)
        self._lexer.take(";")

    def _refusal(self, token: Token) -> str:
        if token.text in _UNSUPPORTED:
            return f"ROS 2 has no {token.text!r}"
        return f"expected module, struct, const, typedef or enum, got {token.text!r}"

    def _module(self) -> None:
        name = self._lexer.take(kind="name")
        if len(self._scope) >= _MAX_MODULES:
            raise self._lexer.error(f"modules nest deeper than {_MAX_MODULES} levels", name)
        outer, self._scope = self._scope, (*self._scope, name.text)
        self._lexer.take("{")
        while not self._lexer.accept("}"):
            self._definition()
        self._scope = outer

    def _struct(self, notes: _Annotations) -> None:
        name = self._lexer.take(kind="name")
        if self._lexer.token.text == ";":
            return  # a forward declaration
        if self._lexer.token.text == ":":
            raise self._lexer.error("ROS 2 has no structs that inherit", self._lexer.token)
        scope = (*self._scope, name.text)
        if len(scope) != 3 or scope[1] not in ("msg", "srv", "action"):
            raise self._lexer.error(
                "a struct lies in the modules of its package and kind, package::msg::Type", name
            )
        fault = check_package_name(scope[0], 2) or check_type_name(scope[2], 2)
        if fault:
            raise self._lexer.error(fault, name)
        if scope in self._structs:
            raise self._lexer.error(f"struct {name.text} is defined twice", name)
        fields: dict[str, Field] = {}
        self._lexer.take("{")
        self._struct_name = name.text
        while not self._lexer.accept("}"):
            self._members(fields)
        self._struct_name = ""
        self._structs[scope] = _Struct(list(fields.values()), notes.comment)

    def _members(self, fields: dict[str, Field]) -> None:
        notes = self._annotations()
        base = self._type()
        while True:
            name = self._lexer.take(kind="name")
            if name.text in fields:
                raise self._lexer.error(f"{name.text!r} is already defined", name)
            kind = self._declarator(base)
            default = None if notes.default is None else self._default(kind, notes.default)
            place = self._lexer.place(name)
            fields[name.text] = Field(name.text, kind, default, notes.comment, notes.unit, place)
            if not self._lexer.accept(","):
                break
        self._lexer.take(";")

    def _declarator(self, base: FieldType) -> FieldType:
        """Parse ``[n]`` after a name."""
        opening = self._lexer.token
        if not self._lexer.accept("["):
            return base
        size = self._count()
        self._lexer.take("]")
        if base.array is not ArrayKind.NONE or self._lexer.token.text == "[":
            raise self._lexer.error(
                "there are no arrays of arrays; put the inner one into a struct", opening
            )
        return replace(base, array=ArrayKind.FIXED, size=size)

    def _typedef(self) -> None:
        base = self._type()
        while True:
            name = self._lexer.take(kind="name")
            scope = (*self._scope, name.text)
            self._typedefs[scope] = self._declarator(base)
            if not self._lexer.accept(","):
                break

    def _enum(self) -> None:
        name = self._lexer.take(kind="name")
        self._lexer.take("{")
        while True:
            self._annotations()
            self._lexer.take(kind="name")
            if not self._lexer.accept(","):
                break
        self._lexer.take("}")
        scope = (*self._scope, name.text)
        self._typedefs[scope] = FieldType("uint32")  # as CDR writes them

    def _const(self, notes: _Annotations) -> None:
        start = self._lexer.token
        kind = self._type()
        if kind.is_compound or kind.array is not ArrayKind.NONE:
            raise self._lexer.error("a constant has a basic type", start)
        name = self._lexer.take(kind="name")
        self._lexer.take("=")
        at = self._lexer.token
        value = self._literal()
        try:
            checked = _convert(kind, value)
        except LiteralError as error:
            raise self._lexer.error(f"constant {name.text}: {error}", at) from None
        scope = (*self._scope, name.text)
        if scope in self._constants:
            raise self._lexer.error(f"{name.text!r} is already defined", name)
        assert not isinstance(checked, tuple)
        self._constants[scope] = Constant(
            name.text, kind.name, checked, str(checked), notes.comment
        )
        if self._scope[-1:] and self._scope[-1].endswith("_Constants"):
            self._homes.setdefault((*scope[:-2], name.text), {})[scope[-2]] = checked

    def _default(self, kind: FieldType, default: tuple[_Literal, Token]) -> Value:
        value, at = default
        try:
            return _convert(kind, value)
        except LiteralError as error:
            raise self._lexer.error(f"default value: {error}", at) from None

    def _type(self) -> FieldType:
        token = self._lexer.take(kind="name")
        if token.text == "sequence":
            return self._sequence(token)
        words = token.text
        if words in ("unsigned", "long"):
            while self._lexer.token.text in ("short", "long", "double"):
                words += f" {self._lexer.take().text}"
        if words in _UNSUPPORTED or words == "long double":
            raise self._lexer.error(f"ROS 2 has no {words!r}", token)
        basic = _BASIC.get(words)
        if basic is None:
            return self._named(token)
        if basic in ("string", "wstring") and self._lexer.accept("<"):
            bound = self._count()
            self._lexer.take(">")
            return FieldType(basic, string_bound=bound)
        return FieldType(basic, letter=basic == "char")

    def _sequence(self, token: Token) -> FieldType:
        self._lexer.take("<")
        nested = self._lexer.token.text == "sequence"
        inner = FieldType("", ArrayKind.UNBOUNDED) if nested else self._type()
        if inner.array is not ArrayKind.NONE:
            raise self._lexer.error(
                "there are no sequences of sequences or arrays; put the inner one into a struct",
                token,
            )
        kind, size = ArrayKind.UNBOUNDED, None
        if self._lexer.accept(","):
            kind, size = ArrayKind.BOUNDED, self._count()
        self._lexer.take(">")
        return replace(inner, array=kind, size=size)

    def _named(self, token: Token) -> FieldType:
        path = self._path(token)
        # IDL's rule: the innermost enclosing module that has the name.
        for depth in range(len(self._scope), -1, -1):
            scope = (*self._scope[:depth], *path)
            if scope in self._typedefs:
                return self._typedefs[scope]
            if scope in self._structs:
                return FieldType("/".join(scope))
        if len(path) == 1:
            path = (*self._scope, *path)
        if len(path) != 3 or path[1] not in ("msg", "srv", "action"):
            raise self._lexer.error(
                f"unknown type {'::'.join(path)!r}; a message type is written package::msg::Type",
                token,
            )
        return FieldType("/".join(path))

    def _path(self, token: Token) -> tuple[str, ...]:
        path = [token.text]
        while self._lexer.accept("::"):
            path.append(self._lexer.take(kind="name").text)
        return tuple(path)

    def _count(self) -> int:
        token = self._lexer.token
        value = self._literal()
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= _MAX_COUNT:
            raise self._lexer.error(
                f"a size must be a whole number from 1 to {_MAX_COUNT}, got {token.text!r}", token
            )
        return value

    def _literal(self) -> _Literal:
        """Parse a literal with an optional sign, or the name of a constant."""
        token = self._lexer.token
        if token.kind == "string":
            return self._lexer.strings()
        sign = 1
        while self._lexer.token.text in ("-", "+") and self._lexer.token.kind == "sign":
            sign = -sign if self._lexer.take().text == "-" else sign
        token = self._lexer.take()
        value: _Literal
        if token.kind == "number":
            value = self._number(token)
        elif token.kind == "char":
            value = ord(unescape(token.text.removeprefix("L")[1:-1])[0])
        elif token.text in ("TRUE", "FALSE"):
            value = token.text == "TRUE"
        elif token.kind == "name":
            value = self._constant_value(token)
        else:
            raise self._lexer.error(
                f"expected a value, got {token.text!r}; expressions are not evaluated", token
            )
        if sign < 0:
            if isinstance(value, (str, bool)):
                raise self._lexer.error(f"{token.text!r} can't have a sign", token)
            value = -value
        return value

    def _number(self, token: Token) -> int | float:
        text = token.text.lower()
        if len(text) > 400:
            raise self._lexer.error(f"{text[:20]}... is too long for a number", token)
        if text.startswith("0x"):
            return int(text, 16)
        if text.isdigit():
            octal = len(text) > 1 and text[0] == "0" and not set(text) & {"8", "9"}
            return int(text, 8 if octal else 10)
        return float(text)

    def _constant_value(self, token: Token) -> _Literal:
        path = self._path(token)
        for depth in range(len(self._scope), -1, -1):
            found = self._constants.get((*self._scope[:depth], *path))
            if found is not None:
                return found.value
        # As in rosidl, those of a message need no qualification.
        homes = self._homes.get((*self._scope, *path), {})
        own = f"{self._struct_name}_Constants"
        if own in homes or len(homes) == 1:
            return homes.get(own, next(iter(homes.values())))
        raise self._lexer.error(f"unknown constant {'::'.join(path)!r}", token)

    def _annotations(self) -> _Annotations:
        comments: list[str] = []
        unit = ""
        default: tuple[_Literal, Token] | None = None
        while self._lexer.accept("@"):
            token = self._lexer.take(kind="name")
            if token.text in _WIRE_ANNOTATIONS:
                raise self._lexer.error(
                    f"@{token.text} is not supported: it changes the wire format", token
                )
            values = self._parameters()
            if token.text == "verbatim" and values.get("language", ("",))[0] == "comment":
                comments += str(values.get("text", ("",))[0]).split("\n")
            elif token.text == "unit" and "value" in values:
                unit = str(values["value"][0])
            elif token.text == "default" and "value" in values:
                default = values["value"]
        return _Annotations(clean_comment(comments), unit, default)

    def _parameters(self) -> dict[str, tuple[_Literal, Token]]:
        """Parse ``(name=value, ...)`` or ``(value)``, if present."""
        values: dict[str, tuple[_Literal, Token]] = {}
        if not self._lexer.accept("("):
            return values
        while not self._lexer.accept(")"):
            key = "value"
            token = self._lexer.token
            if token.kind == "name" and token.text not in ("TRUE", "FALSE"):
                self._lexer.take()
                if not self._lexer.accept("="):
                    values[key] = (token.text, token)
                    continue
                key, token = token.text, self._lexer.token
            enumerator = token.kind == "name" and token.text not in ("TRUE", "FALSE")
            values[key] = (self._lexer.take().text if enumerator else self._literal(), token)
            if not self._lexer.accept(",") and self._lexer.token.text != ")":
                raise self._lexer.error("expected ',' or ')'", self._lexer.token)
        return values


def _convert(kind: FieldType, value: _Literal) -> Value:
    """Check a value against a type; raises LiteralError."""
    if isinstance(value, str) and kind.array is not ArrayKind.NONE:
        # rosidl writes array defaults as the text of a Python tuple.
        inner = value.strip().removeprefix("(").removesuffix(")").strip().removesuffix(",")
        return parse_default(kind, f"[{inner}]")
    if kind.is_compound or kind.array is not ArrayKind.NONE:
        return parse_default(kind, str(value))
    if kind.name in ("string", "wstring"):
        if not isinstance(value, str):
            raise LiteralError(f"{value!r} is not a string")
        if kind.string_bound is not None and len(value) > kind.string_bound:
            raise LiteralError(
                f"the string has {len(value)} characters, its bound is {kind.string_bound}"
            )
        return value
    return parse_constant(kind.name, str(value), 2)

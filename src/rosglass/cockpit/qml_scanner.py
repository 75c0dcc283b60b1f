"""The object layer of QML: imports, objects and their members, with their places in the text.

JavaScript is skipped: only strings, templates, regular expressions, comments and brackets matter in
it, and an expression ends where ECMAScript inserts a semicolon.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, NoReturn

from rosglass.cockpit.qml_values import from_qml, is_literal
from rosglass.errors import QmlSyntaxError, shown

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["Import", "Member", "Object", "Scanner", "Span"]

#: Brackets, and objects, that may be open at the same time. Qt's parser allows 4,096.
_MOST_BRACKETS = 4096
_MOST_OBJECTS = 256

_END = r"\n\r\u2028\u2029"
_BLANK = r" \t\v\f\xa0\u1680\u2000-\u200a\u202f\u205f\u3000"
_WORD = r"[$\w\u200c\u200d]"
_ID = rf"(?:{_WORD}|\\u[\da-fA-F]{{4}}|\\u\{{[\da-fA-F]+\}})+"
_TOKEN = re.compile(
    rf"(?P<space>[{_BLANK}{_END}]+)"
    rf"|(?P<comment>//[^{_END}]*|/\*(?s:.*?)\*/)"
    rf"|(?P<number>(?:0[xXbBoO][\da-fA-F_]+|(?:\d[\d_]*\.?[\d_]*|\.\d[\d_]*)(?:[eE][+-]?\d+)?))"
    rf"|(?P<name>{_ID})"
    # Strings of QML may contain line feeds.
    r"|(?P<string>\"[^\"\\]*(?:(?s:\\.)[^\"\\]*)*\"|'[^'\\]*(?:(?s:\\.)[^'\\]*)*')"
    r"|(?P<sign>=>|\?\.(?!\d)|\?\?=?|\+\+|--|&&=?|\|\|=?|\.\.\.|[=!]==?"
    r"|\*\*=?|>>>?=?|<<=?|[-+*%&|^<>]=?|(?s:.))"
)
_TEMPLATE = re.compile(r"[^`\\$]*(?:(?:(?s:\\.)|\$(?!\{))[^`\\$]*)*(?P<end>`|\$\{)")
_REGEX = re.compile(
    rf"/[^\\/\[{_END}]*(?:(?:\\[^{_END}]|\[[^\]\\{_END}]*(?:\\[^{_END}][^\]\\{_END}]*)*\])"
    rf"[^\\/\[{_END}]*)*/[$\w]*"
)
_LINE_END = re.compile(rf"\r\n|[{_END}]")
_HANDLER = re.compile(r"on_*[^\W_a-z]")
_CLOSING = {"(": ")", "[": "]", "{": "}", "${": "}"}
_OPENING = frozenset("([{")

#: Words after which an operand follows, so that `/` opens a regular expression.
_BEFORE_OPERAND = frozenset(
    "case delete do else extends in instanceof new return throw typeof void".split()  # noqa: SIM905
)
_PREFIXES = frozenset(["+", "-", "!", "~", "++", "--", "..."])
_PREFIX_WORDS = frozenset(["typeof", "void", "delete", "new", "await"])
#: Words whose parentheses a statement follows, not an operator.
_BEFORE_CONDITION = frozenset(["if", "while", "for", "with"])
_STATEMENTS = _BEFORE_CONDITION | {"switch", "try", "do", "return", "throw", "var", "let", "const"}
_NOT_TYPES = _STATEMENTS | {"function", "class", "else", "finally"}
_BINARY = frozenset(
    "= == === != !== < > <= >= + - * / % ** & | ^ && || ?? << >> >>> += -= *= /= %= **= &= |= ^= "  # noqa: SIM905
    "&&= ||= ??= <<= >>= >>>= ,".split()
)
_DECLARATIONS = frozenset(["property", "required", "signal", "function", "enum", "component"])
_MODIFIERS = frozenset(["default", "required", "readonly", "final", "virtual", "override"])


class Span(NamedTuple):
    """A range of the text: offsets in characters, the end excluded."""

    start: int
    end: int


@dataclass(slots=True, eq=False)
class Import:
    """An import.

    Attributes:
        span: All of it, with its semicolon.
        name: The module, folder or file.
        version: ``2.15``, or empty.
        alias: The name after ``as``, or empty.
        is_path: Whether a folder or file is imported.
    """

    span: Span
    name: str
    version: str = ""
    alias: str = ""
    is_path: bool = False


@dataclass(slots=True, eq=False)
class Member:
    """A named member of an object: a binding, declaration, handler, function, group.

    Attributes:
        owner: The object, or the group.
        name: Such as ``anchors.fill``, ``id``, ``Keys.onPressed``.
        span: All of it, modifiers and semicolon included.
        name_span: The name.
        value_span: The value without its semicolon; of functions and enums the braces with their
            contents; None for declarations without a value.
        form: ``value``, ``object``, ``list``, ``group``, ``function``, ``signal``, ``enum``,
            ``component``, ``required``, as it is written.
        type: Type of a declared property, such as ``list<Item>``; empty if it is not declared here.
        modifiers: Such as ``readonly``.
        objects: The objects that are its value.
        group: Contents of ``anchors { ... }``.
        closed: Whether it ends with a bracket that no semicolon may follow.
    """

    owner: Object
    name: str
    span: Span
    name_span: Span
    form: str = "value"
    value_span: Span | None = None
    type: str = ""
    modifiers: tuple[str, ...] = ()
    objects: list[Object] = field(default_factory=list)
    group: Object | None = None
    closed: bool = False

    @property
    def text(self) -> str:
        """The value as it is written; empty without one."""
        return self.owner.source[slice(*self.value_span)] if self.value_span else ""

    @property
    def kind(self) -> str:
        """`form`, but for values ``id``, ``handler``, ``literal`` or ``binding``.

        A declaration without a value is a ``property``.
        """
        if self.form != "value":
            return self.form
        if self.value_span is None:
            return "property"
        if not self.type:
            if self.name == "id":
                return "id"
            if self.is_handler:
                return "handler"
        return "literal" if is_literal(self.text) else "binding"

    @property
    def is_handler(self) -> bool:
        """True for handlers of signals, such as ``Keys.onPressed``."""
        last = self.name.rpartition(".")[2]
        return self.form == "value" and not self.type and _HANDLER.match(last) is not None

    @property
    def value(self) -> object:
        """The value of a literal, as :func:`from_qml` gives it.

        Raises:
            ArgumentError: The member is not a literal.
        """
        return from_qml(self.text)


@dataclass(slots=True, eq=False)
class Object:
    """An object, or the contents of a group such as ``anchors { ... }``.

    Attributes:
        source: The text that it is in.
        type: Such as ``Controls.Button``; of a group its name.
        span: From the type to the closing brace.
        body: From the opening to behind the closing brace.
        parent: The object around it; None for the root. Groups are left out.
        member: The member whose value it is; None for a child.
        on: The property that ``Behavior on x {}`` modifies; empty without.
        items: Members and children, in the order of the text.
        objects: Children and objects that are values, in the order of the text, those in groups
            included; each has this object as its parent.
        index: Place in the `objects` of its parent.
    """

    source: str = field(repr=False)
    type: str
    span: Span
    body: Span
    parent: Object | None = field(default=None, repr=False)
    member: Member | None = field(default=None, repr=False)
    on: str = ""
    items: list[Member | Object] = field(default_factory=list, repr=False)
    objects: list[Object] = field(default_factory=list, repr=False)
    index: int = 0

    @property
    def members(self) -> list[Member]:
        """The named members."""
        return [item for item in self.items if isinstance(item, Member)]

    @property
    def children(self) -> list[Object]:
        """The objects of the default property, those with ``on`` left out."""
        return [item for item in self.items if isinstance(item, Object) and not item.on]

    @property
    def text(self) -> str:
        """The object as it is written."""
        return self.source[slice(*self.span)]

    @property
    def id(self) -> str:
        """Its id; empty without one."""
        member = self.get("id")
        return member.text if member is not None else ""

    @property
    def closed(self) -> bool:
        """True, as for members that end with a bracket."""
        return True

    @property
    def path(self) -> tuple[int, ...]:
        """Index in the `objects` of each object on the way from the root."""
        path = []
        child, parent = self, self.parent
        while parent is not None:
            path.append(child.index)
            child, parent = parent, parent.parent
        return tuple(reversed(path))

    def get(self, name: str) -> Member | None:
        """Return a property, handler or function by its name.

        Args:
            name: ``anchors.fill`` also finds ``fill`` in ``anchors { ... }``.
        """
        for item in self.items:
            if not isinstance(item, Member) or item.form in {"signal", "enum", "component"}:
                continue
            if item.name == name and item.form != "required":
                return item
            if item.group is not None and name.startswith(f"{item.name}."):
                found = item.group.get(name[len(item.name) + 1 :])
                if found is not None:
                    return found
        return None

    def walk(self) -> Iterator[Object]:
        """Yield this object and all in it, in the order of the text."""
        waiting = [self]
        while waiting:
            found = waiting.pop()
            yield found
            waiting.extend(reversed(found.objects))


class Scanner:
    """Reads a text of QML.

    Attributes:
        text: The text.
        imports: Its imports.
        pragmas: Spans of its pragmas.
        root: Its root object.
        fixed: Spans of strings and templates with several lines, whose indentation is content.

    Args:
        text: A whole file.
        file: Its name, for errors.
        is_part: The text is an object of a file, which may be ``Behavior on x {}``.

    Raises:
        QmlSyntaxError: The text is not QML; line, column, and what was expected.
    """

    def __init__(self, text: str, file: str = "<text>", is_part: bool = False) -> None:
        self.text, self.file = text, file
        self.imports: list[Import] = []
        self.pragmas: list[Span] = []
        self.fixed: list[Span] = []
        self._lines: list[int] | None = None
        # A byte order mark is a part of the file, but not of its QML.
        at = self._header(int(text.startswith("\ufeff")))
        at = self._annotations(at)
        name, start, end = self._qualified(at, "an object such as Item { }")
        on = ""
        _, token, _, after, _ = self._next(end)
        if is_part and token == "on":
            on, _, end = self._qualified(after, "a property after on")
        brace = self._skip(end)[0]
        if not text.startswith("{", brace):
            self._fail(brace, f"{{ after {name}")
        self.root, at = self._object(name, start, brace)
        self.root.on = on
        at = self._skip(at)[0]
        if at < len(text):
            self._fail(at, "the end of the file: it has one root object")
        # Tokens are looked at more than once.
        self.fixed = sorted(set(self.fixed))

    # ---- places

    def position(self, offset: int) -> tuple[int, int]:
        """Return line and column of an offset, counted from 1."""
        if self._lines is None:
            self._lines = [0, *(found.end() for found in _LINE_END.finditer(self.text))]
        line = bisect_right(self._lines, offset)
        return line, offset - self._lines[line - 1] + 1

    def _fail(self, at: int, expected: str) -> NoReturn:
        found = _TOKEN.match(self.text, at)
        got = shown(found[0][:40]) if found else "the end of the file"
        line, column = self.position(at)
        raise QmlSyntaxError(f"expected {expected}, got {got}", self.file, line, column)

    # ---- tokens

    def _skip(self, at: int) -> tuple[int, bool]:
        """Return the offset behind blanks and comments, and whether a line ended in them."""
        text, ended = self.text, False
        while True:
            found = _TOKEN.match(text, at)
            if found is None:
                return at, ended
            if found.lastgroup in {"space", "comment"}:
                # As in Qt, a line that ends inside a comment does not count.
                ended = ended or (
                    found.lastgroup == "space" and _LINE_END.search(found[0]) is not None
                )
                at = found.end()
            elif text.startswith("/*", at):
                self._fail(at, "*/ at the end of the comment")
            else:
                return at, ended

    def _next(self, at: int) -> tuple[str, str, int, int, bool]:
        """Return kind, text, start and end of the next token, and whether a line ended before."""
        at, ended = self._skip(at)
        found = _TOKEN.match(self.text, at)
        if found is None:
            return "end", "", at, at, ended
        kind, token = str(found.lastgroup), found[0]
        if kind == "string" and _LINE_END.search(token):
            self.fixed.append(Span(at, found.end()))
        elif kind == "sign" and token in {'"', "'"}:
            self._fail(at, f"{token} at the end of the string")
        return kind, token, at, found.end(), ended

    def _name(self, at: int, expected: str) -> tuple[str, int, int]:
        kind, token, start, end, _ = self._next(at)
        if kind != "name":
            self._fail(start, expected)
        return token, start, end

    def _qualified(self, at: int, expected: str) -> tuple[str, int, int]:
        name, start, end = self._name(at, expected)
        parts = [name]
        while True:
            _, token, _, after, _ = self._next(end)
            if token != ".":
                return ".".join(parts), start, end
            name, _, end = self._name(after, f"a name after {name}.")
            parts.append(name)

    def _template(self, at: int) -> tuple[int, bool]:
        """Return the end of a template's text, and whether an expression follows."""
        found = _TEMPLATE.match(self.text, at)
        if found is None:
            self._fail(at - 1, "` at the end of the template")
        if _LINE_END.search(self.text, at, found.end()):
            self.fixed.append(Span(at, found.end()))
        return found.end(), found["end"] == "${"

    def _regex(self, at: int) -> int:
        found = _REGEX.match(self.text, at)
        if found is None:
            self._fail(at, "a regular expression that ends with / on its line")
        return found.end()

    def _balanced(self, at: int) -> int:
        """Return the offset behind the bracket or template that opens at an offset."""
        text = self.text
        # Of each open bracket: what it is, its offset, whether an operand follows its end.
        stack: list[tuple[str, int, bool]] = []
        operand, before, previous = True, "", ""
        while True:
            kind, token, start, at, _ = self._next(at)
            if kind == "name":
                operand = token in _BEFORE_OPERAND and previous != "."
            elif kind in {"number", "string"}:
                operand = False
            elif token in _OPENING:
                if len(stack) >= _MOST_BRACKETS:
                    self._fail(start, f"at most {_MOST_BRACKETS} open brackets")
                then = False
                if token == "(":
                    then = previous in _BEFORE_CONDITION and before != "."
                elif token == "{":
                    # A block, unless a value is expected here.
                    then = not operand or previous in {"", ";", "{", "}", ")", "=>", ":"}
                    then = then or previous in {"else", "do"}
                stack.append((token, start, then))
                operand = True
            elif token == "`" or (token == "}" and stack and stack[-1][0] == "${"):
                if token == "}":
                    stack.pop()
                at, opened = self._template(at)
                operand = opened
                if opened:
                    if len(stack) >= _MOST_BRACKETS:
                        self._fail(start, f"at most {_MOST_BRACKETS} open brackets")
                    stack.append(("${", start, False))
                elif not stack:
                    return at
            elif token in {")", "]", "}"} or kind == "end":
                opening, opened_at, operand = stack.pop()
                if token != _CLOSING[opening]:
                    line = self.position(opened_at)[0]
                    self._fail(start, f"{_CLOSING[opening]} for the {opening} in line {line}")
                if not stack:
                    return at
            elif token == "/":
                if operand:
                    at = self._regex(start)
                    operand = False
                else:
                    at += text.startswith("=", at)
                    operand = True
            elif token not in {"++", "--"}:
                operand = True
            before, previous = previous, token

    # ---- values

    def _expression(self, at: int) -> int:
        """Return the end of an expression."""
        operand, ternaries, end = True, 0, at
        while True:
            kind, token, start, after, ended = self._next(at)
            if operand:
                operand = False
                if kind == "name":
                    if token == "function":
                        after = self._function(after)[1]
                    elif token == "class":
                        after = self._class(after)
                    else:
                        operand = token in _PREFIX_WORDS
                elif token in _OPENING or token == "`":
                    after = self._balanced(start)
                elif token == "/":
                    after = self._regex(start)
                elif token in _PREFIXES:
                    operand = True
                elif kind not in {"number", "string"}:
                    self._fail(start, "a value")
            elif token in {".", "?."}:
                kind, _, start, name_end, _ = self._next(after)
                if kind == "name":
                    after = name_end
                elif token == "." or self.text[start : start + 1] not in {"(", "["}:
                    self._fail(start, f"a name after {token}")
            elif token in {"(", "[", "`"}:
                after = self._balanced(start)
            elif token == "=>" and not ended:
                brace = self._skip(after)[0]
                if self.text.startswith("{", brace):
                    after = self._balanced(brace)
                else:
                    operand = True
            elif token == "?":
                ternaries += 1
                operand = True
            elif token == ":" and ternaries:
                ternaries -= 1
                operand = True
            elif token in _BINARY or token in {"in", "instanceof"} or (token == "as" and not ended):
                after += token == "/" and self.text.startswith("=", after)
                operand = True
            elif token in {"++", "--"} and not ended:
                pass
            elif ternaries:
                self._fail(start, ": of the ? before")
            elif ended or token in {"}", ")", "]", ";", ""}:
                return end
            else:
                self._fail(start, "; or a line break")
            at = end = after

    def _function(self, at: int) -> tuple[int, int]:
        """Return start and end of the body of a function; its name may be missing."""
        kind, token, start, after, _ = self._next(at)
        if token == "*":
            kind, token, start, after, _ = self._next(after)
        if kind == "name":
            _, token, start, _, _ = self._next(after)
        if token != "(":
            self._fail(start, "( of the function's arguments")
        _, token, start, after, _ = self._next(self._balanced(start))
        if token == ":":
            after = self._type(after)[2]
            start = self._skip(after)[0]
        if not self.text.startswith("{", start):
            self._fail(start, "{ of the function")
        return start, self._balanced(start)

    def _class(self, at: int) -> int:
        while True:
            kind, token, start, at, _ = self._next(at)
            if token == "{":
                return self._balanced(start)
            if token in {"(", "["}:
                at = self._balanced(start)
            elif kind != "name" and token != ".":
                self._fail(start, "{ of the class")

    def _statement(self, at: int) -> tuple[int, bool]:
        """Return the end of a binding's value, and whether a semicolon may follow."""
        kind, token, start, _, _ = self._next(at)
        if token == "{":
            return self._balanced(start), False
        if token == ";":
            return start, True
        if kind != "name" or token not in _STATEMENTS:
            return self._expression(start), True
        if token not in {"if", "with", "switch", "try"}:
            self._fail(start, "a value")
        return self._nested_statement(start)

    def _nested_statement(self, at: int) -> tuple[int, bool]:
        """Return the end of a statement, and whether a semicolon may follow; without recursion."""
        open_words: list[str] = []  # each if and do whose statement is being read
        while True:
            kind, token, start, after, _ = self._next(at)
            if kind == "name" and token in _BEFORE_CONDITION:
                at = self._parentheses(after, token)
                if token == "if":
                    open_words.append(token)
                continue
            if kind == "name" and token == "do":
                open_words.append(token)
                at = after
                continue
            end, semicolon = self._simple_statement(kind, token, start, after)
            while open_words:
                word = open_words.pop()
                behind = self._end(end) if semicolon else end
                _, token, start, after, _ = self._next(behind)
                if word == "do":
                    if token != "while":
                        self._fail(start, "while of the do before")
                    end, semicolon = self._parentheses(after, token), True
                elif token == "else":
                    at = after
                    break
            else:
                return end, semicolon

    def _simple_statement(self, kind: str, token: str, start: int, after: int) -> tuple[int, bool]:
        if token == "{":
            return self._balanced(start), False
        if token == ";":
            return after, False
        if kind != "name" or token not in _STATEMENTS:
            return self._expression(start), True
        if token == "switch":
            return self._block(self._parentheses(after, token), token), False
        if token == "try":
            end = self._block(after, token)
            _, token, _, after, _ = self._next(end)
            if token == "catch":
                _, token, start, _, _ = self._next(after)
                after = self._balanced(start) if token == "(" else after
                end = self._block(after, "catch")
                _, token, _, after, _ = self._next(end)
            return (self._block(after, token) if token == "finally" else end), False
        _, token, _, _, ended = self._next(after)
        # A return alone; otherwise declarations are read like an expression with commas.
        alone = ended or token in {";", "}"}
        return (after if alone else self._expression(after)), True

    def _parentheses(self, at: int, word: str) -> int:
        at = self._skip(at)[0]
        if not self.text.startswith("(", at):
            self._fail(at, f"( after {word}")
        return self._balanced(at)

    def _block(self, at: int, word: str) -> int:
        at = self._skip(at)[0]
        if not self.text.startswith("{", at):
            self._fail(at, f"{{ after {word}")
        return self._balanced(at)

    # ---- the header

    def _end(self, at: int) -> int:
        """Return the end of a member that ends at an offset, its semicolon included."""
        _, token, start, after, ended = self._next(at)
        if token == ";":
            return after
        if not ended and token not in {"}", ""}:
            self._fail(start, "; or a line break")
        return at

    def _header(self, at: int) -> int:
        while True:
            _, token, start, after, _ = self._next(at)
            if token == "pragma":
                _, _, end = self._name(after, "the name of a pragma")
                _, token, _, after, ended = self._next(end)
                while token in {":", ","} and not ended:
                    kind, _, at, end, _ = self._next(after)
                    if kind not in {"name", "string"}:
                        self._fail(at, "a value of the pragma")
                    _, token, _, after, ended = self._next(end)
                at = self._end(end)
                self.pragmas.append(Span(start, at))
            elif token == "import":
                at = self._import(start, after)
            else:
                return start

    def _import(self, start: int, at: int) -> int:
        kind, token, name_at, end, _ = self._next(at)
        if kind == "string":
            name = str(from_qml(token))
        else:
            name, _, end = self._qualified(name_at, "a module, or a path in quotation marks")
        found = Import(Span(start, end), name, is_path=kind == "string")
        kind, token, _, after, _ = self._next(end)
        if kind == "number":
            found.version, end = token, after
            _, token, _, after, _ = self._next(end)
        if token == "as":
            found.alias, _, end = self._name(after, "a name after as")
        end = self._end(end)
        found.span = Span(start, end)
        self.imports.append(found)
        return end

    def _annotations(self, at: int) -> int:
        at = self._skip(at)[0]
        while self.text.startswith("@", at):
            at = self._qualified(at + 1, "the name of an annotation")[2]
            at = self._skip(self._block(at, "the annotation"))[0]
        return at

    # ---- objects

    def _object(self, name: str, start: int, brace: int) -> tuple[Object, int]:
        """Return the object whose body opens at `brace`, and its end; without recursion."""
        text = self.text
        root = Object(text, name, Span(start, start), Span(brace, brace))
        # Open objects, and members with a list of objects.
        stack: list[Object | Member] = [root]
        at = brace + 1
        while stack:
            top = stack[-1]
            at = self._skip(at)[0]
            if len(stack) > _MOST_OBJECTS:
                self._fail(at, f"at most {_MOST_OBJECTS} objects in each other")
            sign = text[at : at + 1]
            if isinstance(top, Member):
                assert top.value_span is not None
                if sign == "]":
                    at += 1
                    top.value_span = Span(top.value_span.start, at)
                    at = self._finish(top, at, True)
                    stack.pop()
                else:
                    if top.value_span.end > top.value_span.start:
                        if sign != ",":
                            self._fail(at, ", or ] after an object of the list")
                        at = self._skip(at + 1)[0]
                        if text.startswith("]", at):
                            continue
                    top.value_span = Span(top.value_span.start, at)
                    word, first, at = self._qualified(at, "an object, or ] at the end of the list")
                    at = self._open(stack, word, first, at, "", top)
            elif sign == "}":
                at += 1
                top.span, top.body = Span(top.span.start, at), Span(top.body.start, at)
                stack.pop()
                if top.member is not None and top.member.form != "list":
                    member = top.member
                    is_group = member.form == "group"
                    member.value_span = top.body if is_group else Span(top.span.start, at)
                    at = self._finish(member, at, True)
            else:
                at = self._member(stack, top, at)
        return root, at

    def _open(
        self,
        stack: list[Object | Member],
        name: str,
        start: int,
        at: int,
        on: str,
        member: Member | None,
    ) -> int:
        """Open the object whose name ends at an offset."""
        brace = self._skip(at)[0]
        if not self.text.startswith("{", brace):
            self._fail(brace, f"{{ after {name}")
        holder = member.owner if member is not None else stack[-1]
        assert isinstance(holder, Object)
        opened = Object(self.text, name, Span(start, start), Span(brace, brace), holder, member, on)
        if member is not None and member.form == "group":
            member.group = opened
        else:
            # Objects in groups belong to the object around.
            while holder.member is not None and holder.member.group is holder:
                holder = holder.member.owner
            opened.parent, opened.index = holder, len(holder.objects)
            holder.objects.append(opened)
            if member is not None:
                member.objects.append(opened)
            else:
                stack[-1].items.append(opened)  # type: ignore[union-attr]
        stack.append(opened)
        return brace + 1

    def _member(self, stack: list[Object | Member], owner: Object, at: int) -> int:
        start = at
        at = self._annotations(at)
        if at == len(self.text):
            line = self.position(owner.body.start)[0]
            self._fail(at, f"}} of the {owner.type} in line {line}")
        name, first, end = self._qualified(at, "a property, an object or }")
        _, token, sign_at, after, _ = self._next(end)
        member = Member(owner, name, Span(start, end), Span(first, end))
        if token == "{":
            if name.rpartition(".")[2][0].isupper():
                # The annotation is a part of the object's span.
                return self._open(stack, name, start, end, "", None)
            member.form = "group"
            owner.items.append(member)
            return self._open(stack, name, first, end, "", member)
        if token == ":":
            owner.items.append(member)
            return self._value(stack, member, after)
        if token == "on" and name not in _DECLARATIONS:
            on, _, end = self._qualified(after, "a property after on")
            return self._open(stack, name, start, end, on, None)
        return self._declaration(stack, member, name, end, sign_at)

    def _type(self, at: int) -> tuple[str, int, int]:
        name, start, end = self._qualified(at, "a type")
        _, token, _, after, _ = self._next(end)
        if token == "<":
            of, _, end = self._qualified(after, "a type after <")
            _, token, close, end, _ = self._next(end)
            if token != ">":
                self._fail(close, "> after the type")
            name = f"{name}<{of}>"
        return name, start, end

    def _declaration(
        self, stack: list[Object | Member], member: Member, word: str, end: int, next_at: int
    ) -> int:
        member.owner.items.append(member)
        modifiers: list[str] = []
        while word in _MODIFIERS:
            modifiers.append(word)
            word, first, end = self._name(end, "property")
            member.name, member.name_span = word, Span(first, end)
        member.modifiers = tuple(modifiers)
        if word == "property":
            member.type, _, end = self._type(end)
            member.name, first, end = self._name(end, "the name of the property")
            member.name_span = Span(first, end)
            _, token, _, after, _ = self._next(end)
            if token == ":":
                return self._value(stack, member, after)
        elif modifiers == ["required"]:
            member.form = "required"
        elif modifiers or word not in {"signal", "function", "enum", "component"}:
            self._fail(next_at, f": or {{ after {word}")
        else:
            member.form = word
            at = self._skip(end)[0]
            if word == "function" and self.text.startswith("*", at):
                at += 1
            member.name, first, end = self._name(at, f"the name of the {word}")
            member.name_span = Span(first, end)
            if word == "component":
                _, token, at, after, _ = self._next(end)
                if token != ":":
                    self._fail(at, ": after the name of the component")
                return self._value(stack, member, after)
            if word == "function":
                body, end = self._function(first)
                member.value_span = Span(body, end)
            elif word == "enum":
                body = self._skip(end)[0]
                end = self._block(end, member.name)
                member.value_span = Span(body, end)
            elif self.text.startswith("(", self._skip(end)[0]):
                end = self._balanced(self._skip(end)[0])
        return self._finish(member, end, member.form in {"function", "enum"})

    def _type_at(self, at: int) -> tuple[str, int]:
        """Return the type of an object that starts at an offset, and its end; empty without one."""
        parts = []
        while True:
            kind, token, _, end, _ = self._next(at)
            if kind != "name":
                return "", at
            parts.append(token)
            _, token, _, at, _ = self._next(end)
            if token == "{" and (len(parts) > 1 or parts[0] not in _NOT_TYPES):
                return ".".join(parts), end
            if token != ".":
                return "", at

    def _value(self, stack: list[Object | Member], member: Member, at: int) -> int:
        at = self._skip(at)[0]
        listed = self.text.startswith("[", at)
        first = self._skip(at + 1)[0] if listed else at
        name, end = self._type_at(first)
        if name:
            member.value_span = Span(at, at)
            if listed:
                if member.type and not member.type.startswith("list<"):
                    self._fail(at, f"list<{member.type}> as the type of a list of objects")
                member.form = "list"
                stack.append(member)
                return first
            if member.form == "value":
                member.form = "object"
            return self._open(stack, name, first, end, "", member)
        if member.form == "component":
            self._fail(at, "an object after component")
        end, semicolon = self._statement(at)
        member.value_span = Span(at, end)
        return self._finish(member, end, not semicolon)

    def _finish(self, member: Member, at: int, closed: bool) -> int:
        """Return the end of a member whose value ends at an offset."""
        # Declarations are stricter with lists, and more tolerant else.
        member.closed = closed and not member.type.startswith("list<")
        _, token, _, after, _ = self._next(at)
        if member.closed:
            at = after if member.type and token == ";" else at
        else:
            at = self._end(at)
        member.span = Span(member.span.start, at)
        return at

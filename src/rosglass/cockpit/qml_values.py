"""Values of Python as texts of QML, and literals of QML as values of Python."""

from __future__ import annotations

import math
import re

from rosglass.errors import ArgumentError, shown

__all__ = ["Code", "from_qml", "is_literal", "quote", "to_qml", "translated"]

#: Nested lists and objects of a literal; deeper ones count as bindings.
_MOST_DEPTH = 32
#: Integers beyond this are no longer exact in JavaScript, where each number is a double.
_MOST_INTEGER = 2**53

_ESCAPED = {"\\": "\\\\", "\n": "\\n", "\r": "\\r", "\t": "\\t", "\b": "\\b", "\f": "\\f"}
_UNESCAPED = {"n": "\n", "r": "\r", "t": "\t", "b": "\b", "f": "\f", "v": "\v", "0": "\0"}
#: Characters that end a line, are invisible, or cannot be encoded: they are written as \uXXXX.
_UNSEEN = re.compile("[\\\\\x00-\x1f\x7f-\x9f\u2028\u2029\ufeff\ud800-\udfff]")
_ESCAPE = re.compile(
    r"\\(?:u\{(?P<point>[0-9a-fA-F]{1,6})\}|u(?P<u>[0-9a-fA-F]{4})|x(?P<x>[0-9a-fA-F]{2})"
    r"|(?P<line>\r\n|[\n\r\u2028\u2029])|(?P<other>.))",
    re.DOTALL,
)

_STRING = r"\"[^\"\\]*(?:\\.[^\"\\]*)*\"|'[^'\\]*(?:\\.[^'\\]*)*'"
_ENUM = r"[A-Z]\w*(?:\.[A-Z]\w*)+"
_LITERAL = re.compile(
    rf"(?s:(?P<string>{_STRING})"
    r"|(?P<number>[+-]?(?:0[xX][0-9a-fA-F]+|0[bB][01]+|0[oO][0-7]+"
    r"|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)(?![$\w]))"
    rf"|(?P<enum>{_ENUM}(?:\s*\|\s*{_ENUM})*(?![$\w.]))"
    r"|(?P<word>-Infinity|[$\w]+)|(?P<sign>[\[\]{}(),:])|(?P<space>\s+))"
)
_TRANSLATED = re.compile(rf"(?s:qsTr\s*\(\s*(?P<text>{_STRING})\s*(?:,[^()]*)?\))")
_WORDS = {
    "true": True,
    "false": False,
    "null": None,
    "NaN": math.nan,
    "Infinity": math.inf,
    "-Infinity": -math.inf,
}
_NAME = re.compile(r"[A-Za-z_$][\w$]*", re.ASCII)


class Code(str):
    """A text of QML that is written as it is: the name of an enum, or an expression."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"Code({super().__repr__()})"


def quote(text: str, mark: str = '"') -> str:
    """Return a string literal.

    Args:
        text: The string. Control characters and lone surrogates are escaped, others stay readable.
        mark: The quotation mark, `"` or `'`.
    """

    def escape(found: re.Match[str]) -> str:
        return _ESCAPED.get(found[0]) or f"\\u{ord(found[0]):04x}"

    return f"{mark}{_UNSEEN.sub(escape, text).replace(mark, chr(92) + mark)}{mark}"


def to_qml(value: object) -> str:
    """Return the text of QML for a value.

    Args:
        value: A string, number, boolean, None, list or tuple, dict with strings as keys, or `Code`.

    Raises:
        ArgumentError: QML has no text for the value, or not an exact one.
    """
    text = _text_of(value, 0)
    return f"({text})" if isinstance(value, dict) else text


def _text_of(value: object, depth: int) -> str:
    if depth > _MOST_DEPTH:
        raise ArgumentError("value", value, f"at most {_MOST_DEPTH} lists in each other")
    if isinstance(value, Code):
        return str(value)
    if isinstance(value, str):
        return quote(value)
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        if abs(value) > _MOST_INTEGER:
            raise ArgumentError("value", value, "an integer of at most 53 bits, as QML keeps them")
        return int.__repr__(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            return "NaN" if math.isnan(value) else f"{'-' if value < 0 else ''}Infinity"
        return float.__repr__(value).removesuffix(".0")
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_text_of(entry, depth + 1) for entry in value)}]"
    if isinstance(value, dict):
        for key in value:
            if not isinstance(key, str):
                raise ArgumentError("value", value, f"strings as keys, not {shown(key)}")
        entries = (
            f"{key if _NAME.fullmatch(key) else quote(key)}: {_text_of(entry, depth + 1)}"
            for key, entry in value.items()
        )
        return f"{{{', '.join(entries)}}}"
    raise ArgumentError("value", value, "a string, number, boolean, None, list, dict or Code")


def translated(text: str) -> tuple[int, int] | None:
    """Return the range of the string in ``qsTr("...")``; None if the text is something else."""
    found = _TRANSLATED.fullmatch(text)
    return found.span("text") if found else None


def is_literal(text: str) -> bool:
    """Return whether a text of QML is a literal, which :func:`from_qml` reads."""
    try:
        from_qml(text)
    except ArgumentError:
        return False
    return True


def from_qml(text: str) -> object:
    """Return the value of a literal.

    Strings (in ``qsTr()`` too), numbers, booleans, null, lists and objects of them become values of
    Python; names of enums such as ``Qt.Vertical`` become `Code`.

    Raises:
        ArgumentError: The text is an expression.
    """
    place = translated(text)
    try:
        if place is not None:
            return _unquoted(text[slice(*place)])
        return _Literals(text).all()
    except ValueError:
        raise ArgumentError("value", text, "a literal") from None


def _unquoted(text: str) -> str:
    def decode(found: re.Match[str]) -> str:
        code = found["point"] or found["u"] or found["x"]
        if code:
            return chr(int(code, 16))
        if found["line"]:
            return ""
        if found["other"] in "ux":
            raise ValueError("an escape without its digits")
        return _UNESCAPED.get(found["other"], found["other"])

    decoded = _ESCAPE.sub(decode, text[1:-1])
    # Two escapes of surrogates are one character.
    return decoded.encode("utf-16-le", "surrogatepass").decode("utf-16-le", "surrogatepass")


class _Literals:
    """Reads nested literals; ValueError if the text is anything else."""

    def __init__(self, text: str) -> None:
        self._text, self._at = text, 0

    def all(self) -> object:
        value = self._value(self._next(), 0)
        if self._next() != ("end", ""):
            raise ValueError("more than one literal")
        return value

    def _next(self) -> tuple[str, str]:
        while self._at < len(self._text):
            found = _LITERAL.match(self._text, self._at)
            if found is None:
                break
            self._at = found.end()
            if found.lastgroup != "space":
                return str(found.lastgroup), found[0]
        return ("end", "") if self._at == len(self._text) else ("wrong", "")

    def _value(self, token: tuple[str, str], depth: int) -> object:
        kind, text = token
        if depth > _MOST_DEPTH:
            raise ValueError("too deep")
        if kind == "string":
            return _unquoted(text)
        if kind == "number":
            return _number(text)
        if kind == "enum":
            return Code(text)
        if kind == "word" and text in _WORDS:
            return _WORDS[text]
        if text == "[":
            return self._list(depth)
        if text == "{" and depth:
            return self._dict(depth)
        if text == "(" and not depth:
            # A brace alone would be a block of statements.
            value = self._value(self._next(), 1)
            if self._next()[1] != ")":
                raise ValueError("an expression")
            return value
        raise ValueError("an expression")

    def _list(self, depth: int) -> list[object]:
        values: list[object] = []
        token = self._next()
        while token[1] != "]":
            values.append(self._value(token, depth + 1))
            token = self._next()
            if token[1] == ",":
                token = self._next()
            elif token[1] != "]":
                raise ValueError("an expression")
        return values

    def _dict(self, depth: int) -> dict[str, object]:
        values: dict[str, object] = {}
        kind, text = self._next()
        while text != "}":
            if kind not in {"string", "word"} or self._next()[1] != ":":
                raise ValueError("an expression")
            key = _unquoted(text) if kind == "string" else text
            values[key] = self._value(self._next(), depth + 1)
            kind, text = self._next()
            if text == ",":
                kind, text = self._next()
            elif text != "}":
                raise ValueError("an expression")
        return values


def _number(text: str) -> int | float:
    digits = text.lstrip("+-")
    sign = -1 if text.startswith("-") else 1
    whole = digits.isdecimal()
    if digits[:2].lower() not in {"0x", "0b", "0o"} and not whole:
        return sign * float(digits)
    if whole and digits != "0" and digits.startswith("0"):
        raise ValueError("an octal number")
    # As in JavaScript, which has doubles only.
    value = int(digits, 0) if len(digits) <= 1100 else 1 << 1024
    return sign * (value if value < 1 << 1024 else math.inf)

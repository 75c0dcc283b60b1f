"""Tokens of OMG IDL 4.2, with their places."""

from __future__ import annotations

import re
from bisect import bisect_right
from typing import TYPE_CHECKING, NamedTuple

from rosglass.errors import DefinitionError
from rosglass.interfaces.literals import LiteralError, unescape

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["Lexer", "Token"]

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
        offset: Where it starts.
    """

    kind: str
    text: str
    offset: int


class Lexer:
    """Hands out the tokens of a text, one after the other.

    Args:
        text: The IDL.
        file: Label for errors.

    Raises:
        DefinitionError: Something in the text is no token.
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
        """Return the line and column of a token, from 1."""
        line = bisect_right(self._lines, token.offset)
        return line, token.offset - self._lines[line - 1] + 1

    def error(self, message: str, token: Token) -> DefinitionError:
        """Return the error to raise for a token."""
        return DefinitionError(message, self.file, *self.place(token))

    @property
    def token(self) -> Token:
        """The token that comes next."""
        return self._tokens[self._next]

    def take(self, expected: str = "", kind: str = "") -> Token:
        """Return the next token and go on.

        Raises:
            DefinitionError: It is not the text, or not of the kind, that was expected.
        """
        token = self.token
        if (expected and token.text != expected) or (kind and token.kind != kind):
            raise self.error(f"expected {expected or 'a ' + kind!r}, got {token.text!r}", token)
        if token.kind != "end":
            self._next += 1
        return token

    def accept(self, text: str) -> bool:
        """Skip the next token if it is `text`; returns whether it was."""
        if self.token.text != text or self.token.kind in ("string", "char"):
            return False
        self._next += 1
        return True

    def strings(self) -> str:
        """Take adjacent string literals and return their joined value."""
        parts = []
        while self.token.kind == "string":
            token = self.take()
            try:
                parts.append(unescape(token.text.removeprefix("L")[1:-1]))
            except LiteralError as error:
                raise self.error(str(error), token) from None
        return "".join(parts)

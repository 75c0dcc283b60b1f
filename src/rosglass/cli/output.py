"""The output of commands: colours, tables, notes, and no control characters from others."""

from __future__ import annotations

import os
import select
import sys
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.errors import escape_controls

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable, Mapping, Sequence
    from typing import TextIO

__all__ = [
    "CLEAR_LINE",
    "CLEAR_REST",
    "HOME",
    "EscapingStream",
    "ProblemReports",
    "Style",
    "note",
    "require_reader",
    "table",
]

#: Stands for the ESC of own sequences until a stream writes it: no peer can guess it.
_ESCAPE = f"\0{os.urandom(8).hex()}\0"
#: Returns to the beginning of the line and clears it, on a terminal.
CLEAR_LINE = f"{_ESCAPE}[G{_ESCAPE}[K"
#: Returns to the beginning of the screen and clears it, on a terminal; clears the rest of it.
HOME, CLEAR_REST = f"{_ESCAPE}[H{_ESCAPE}[2J", f"{_ESCAPE}[J"
_CODES = {
    "bold": 1, "dim": 2, "red": 31, "green": 32, "yellow": 33, "blue": 34, "magenta": 35,
    "cyan": 36,
}  # fmt: skip


class EscapingStream:
    """Standard output or error, but without any control characters except this module's.

    Everything from robots (names, types, texts) reaches the terminal through it, from any command
    or log. All but :meth:`write` is the stream's.

    Args:
        stream: The stream to write to.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        r"""Write a text, its control characters as ``\uXXXX``; returns its length."""
        safe = "\033".join(map(escape_controls, text.split(_ESCAPE)))
        self._stream.write(safe)
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


class Style:
    """Colours text, or leaves it as it is."""

    def __init__(self, args: argparse.Namespace) -> None:
        wanted = getattr(args, "color", "auto")
        plain = not sys.stdout.isatty() or bool(os.environ.get("NO_COLOR"))
        self._on = wanted == "always" or (wanted == "auto" and not plain)

    def __call__(self, text: object, *kinds: str) -> str:
        """Return `text` as ``bold``, ``dim``, or in the colour of one of these names.

        The text is for an :class:`EscapingStream`.
        """
        if not self._on or not kinds:
            return str(text)
        codes = ";".join(str(_CODES[kind]) for kind in kinds)
        return f"{_ESCAPE}[{codes}m{text}{_ESCAPE}[0m"


def note(text: str) -> None:
    """Print a note for the user, which is not a result."""
    print(f"rosglass: {text}", file=sys.stderr, flush=True)


class ProblemReports:
    """Prints problems that last, and when they are over.

    Args:
        delay: Seconds that a problem must last before it is printed.
        over_status: Whether the terminal's last line shows a status, which notes replace.
    """

    def __init__(self, delay: float, *, over_status: bool) -> None:
        self._delay = delay
        self._before = CLEAR_LINE if over_status else ""
        #: Name -> problem, and since when.
        self._current: dict[str, tuple[str, float]] = {}
        self._reported: dict[str, str] = {}

    def update(self, problems: Mapping[str, str], *, last: bool = False) -> None:
        """Print changes.

        Args:
            problems: Problems by the name of their cause.
            last: Whether the command ends: new problems are printed at once.
        """
        now = time.monotonic()
        for name, problem in problems.items():
            before, since = self._current.get(name, ("", now))
            since = since if before == problem else now
            self._current[name] = (problem, since)
            if self._reported.get(name) != problem and (last or now - since >= self._delay):
                self._reported[name] = problem
                self.note(f"{name}: {problem}")
        for name in self._current.keys() - problems.keys():
            del self._current[name]
            if self._reported.pop(name, None) is not None and not last:
                self.note(f"{name}: well again")

    def note(self, text: str) -> None:
        """Print a note for the user."""
        print(f"{self._before}rosglass: {text}", file=sys.stderr, flush=True)


def require_reader() -> None:
    """Raise BrokenPipeError if the reader of the output has exited, as in ``... | head -1``.

    Without this, a command that waits for something to print would not end.
    """
    events: list[tuple[int, int]] = []
    with suppress(OSError, ValueError, AttributeError):  # no file, closed, or on Windows
        poll = select.poll()
        poll.register(sys.stdout.fileno(), 0)
        events = poll.poll(0)
    if any(event & select.POLLERR for _, event in events):
        raise BrokenPipeError


def table(rows: Iterable[Sequence[str]], indent: str = "") -> list[str]:
    """Return rows as lines with aligned columns."""
    found = [list(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(*found, strict=True)]
    return [
        indent + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in found
    ]

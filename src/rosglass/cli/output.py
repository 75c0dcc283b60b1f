"""The output of commands: colours for people, JSON for programs."""

from __future__ import annotations

import json
import os
import select
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.errors import escape_controls

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable, Sequence
    from typing import TextIO

    from rosglass.messages import MessageType

__all__ = [
    "CLEAR_LINE",
    "SHOWN",
    "SHOWN_JSON",
    "EscapingStream",
    "Style",
    "add_output_options",
    "fields",
    "note",
    "print_json",
    "require_reader",
    "table",
    "template",
    "to_json",
    "to_yaml",
]

#: Number of elements of an array that are shown, unless all are requested.
SHOWN = 36
#: The same for programs, which accept more, but no pictures.
SHOWN_JSON = 10_000
#: Stands for the ESC of own sequences until a stream writes it: no peer can guess it.
_ESCAPE = f"\0{os.urandom(8).hex()}\0"
#: Returns to the beginning of the line and clears it, on a terminal.
CLEAR_LINE = f"{_ESCAPE}[G{_ESCAPE}[K"
_CODES = {"bold": 1, "dim": 2, "red": 31, "green": 32, "yellow": 33, "cyan": 36}


def add_output_options(parser: argparse.ArgumentParser) -> None:
    """Declare ``--json`` and ``--color``."""
    group = parser.add_argument_group("output")
    group.add_argument("--json", action="store_true", help="print JSON")
    group.add_argument(
        "--color",
        choices=("auto", "always", "never"),
        default="auto",
        help="auto: on a terminal, unless NO_COLOR is set (default: %(default)s)",
    )


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
        """Return `text` as ``bold``, ``dim``, ``red``, ``green``, ``yellow`` or ``cyan``.

        The text is for an :class:`EscapingStream`.
        """
        if not self._on or not kinds:
            return str(text)
        codes = ";".join(str(_CODES[kind]) for kind in kinds)
        return f"{_ESCAPE}[{codes}m{text}{_ESCAPE}[0m"


def note(text: str) -> None:
    """Print a note for the user, which is not a result."""
    print(f"rosglass: {text}", file=sys.stderr, flush=True)


def print_json(value: object) -> None:
    """Print a value as strict JSON on several lines; bytes become a list of numbers."""
    from rosglass.messages.message import finite

    print(json.dumps(finite(value), indent=2, ensure_ascii=False, default=list), flush=True)


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


def fields(value: Any, limit: int | None = SHOWN) -> Any:
    """Return a message, or a field of one, as dicts, lists and plain values, long arrays cut.

    Args:
        value: The message or field.
        limit: Elements of an array to keep; None for all. A longer one becomes its first elements
            and a text with their number.
    """
    from rosglass.messages.message import plain

    if hasattr(value, "_schema__"):
        value = value.to_dict()
    return plain(value) if limit is None else _cut(value, limit)


def template(message_type: MessageType) -> str:
    """Return an empty message of the type as one line of YAML."""
    import yaml

    text: str = yaml.safe_dump(
        fields(message_type.create(), 3), default_flow_style=True, sort_keys=False, width=2**31
    )
    return text.strip()


def to_yaml(value: object) -> str:
    """Return the result of :func:`fields` as YAML; lists of numbers take one line."""
    import yaml

    class Dumper(yaml.SafeDumper):
        def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002 - PyYAML's signature
            return True

    def sequence(dumper: Any, items: list[Any]) -> Any:
        flow = not any(isinstance(item, (dict, list)) for item in items)
        return dumper.represent_sequence("tag:yaml.org,2002:seq", items, flow_style=flow)

    Dumper.add_representer(list, sequence)
    dumped: str = yaml.dump(
        value, Dumper=Dumper, sort_keys=False, default_flow_style=False, allow_unicode=True,
        width=2**31,
    )  # fmt: skip
    return dumped.removesuffix("...\n")


def to_json(value: object) -> str:
    """Return the result of :func:`fields` as strict JSON, in one line."""
    from rosglass.messages.message import finite

    return json.dumps(finite(value), ensure_ascii=False, allow_nan=False)


def table(rows: Iterable[Sequence[str]], indent: str = "") -> list[str]:
    """Return rows as lines with aligned columns."""
    found = [list(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(*found, strict=True)]
    return [
        indent + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in found
    ]


def _cut(value: Any, limit: int) -> Any:
    from rosglass.messages.message import plain

    if hasattr(value, "_schema__"):
        value = value.to_dict()
    if isinstance(value, dict):
        return {key: _cut(inner, limit) for key, inner in value.items()}
    if isinstance(value, str):
        text: str = plain(value)
        # A robot's description is a string of 100 kB.
        return text if len(text) <= 100 * limit else f"{text[: 100 * limit]}... {len(text)} in all"
    if not hasattr(value, "__len__"):
        return value
    count = len(value)
    few = value[:limit]
    items = plain(few)
    if isinstance(few, list):
        items = [_cut(item, limit) for item in few]
    return items if count <= limit else [*items, f"... {count} in all"]

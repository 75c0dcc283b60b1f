"""Texts of robots, as lists show and copy them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from rosglass.errors import escape_controls
from rosglass.qt import QtGui

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["bounded", "copy_text", "joined"]

#: Names that a text lists before it counts the rest.
_MAX_NAMES = 20
_SURROGATE = re.compile("[\ud800-\udfff]")


def bounded(text: str, most: int = 500, *, lines: bool = False) -> str:
    """Return a robot's text with at most `most` characters, and how many it has if it has more.

    Control characters are escaped, and bytes that are not UTF-8 become U+FFFD.

    Args:
        text: The text.
        most: Characters to keep.
        lines: Whether it may have several lines.
    """
    cut = text[:most]
    if not (cut.isascii() and cut.isprintable()):
        cut = escape_controls(_SURROGATE.sub("\N{REPLACEMENT CHARACTER}", cut))
        if not lines:
            cut = cut.replace("\n", " ⏎ ").replace("\t", " ")
    return cut if len(text) <= most else f"{cut}… ({len(text)} characters)"


def joined(names: Sequence[str], most: int = _MAX_NAMES) -> str:
    """Return names in one line, the rest counted: ``/a, /b and 3 more``."""
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most:,} more"


def copy_text(text: str) -> None:
    """Put a text into the clipboard."""
    QtGui.QGuiApplication.clipboard().setText(text)

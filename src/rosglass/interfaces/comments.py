"""Comments of definitions, kept for people to read, and the units they name."""

from __future__ import annotations

import re

__all__ = ["clean_comment", "find_unit"]

_BRACKETS = re.compile(r"\[([^\[\],]{1,24})\]")
# Starts like a unit (m, rad/s, °C, %, 1/s) and not like an index, a range or a sentence.
_UNIT = re.compile(
    r"(?:[A-Za-z\u00b5\u03bc\u03a9\u00b0%]|1 ?/)"
    r"[A-Za-z0-9\u00b5\u03bc\u03a9\u00b0%\u00b2\u00b3\u207b\u00b9\u00b7.*/^()+-]*"
    r"(?: ?[*/\u00b7] ?[A-Za-z0-9^\u00b2\u00b3]+)*"
)

# What people also put in brackets.
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
    """Return the unit that a comment names in brackets, e.g. ``rad/s`` for ``Speed [rad/s]``.

    As in rosidl a unit has no comma in it (``[0, 1]`` is a range) and must be the only one;
    beyond rosidl, bracketed numbers, ranges and sentences are not taken for units.
    """
    if "[" not in comment:
        return ""
    units = {text.strip() for text in _BRACKETS.findall(comment)}
    units = {text for text in units if _UNIT.fullmatch(text) and text.lower() not in _NO_UNITS}
    return units.pop() if len(units) == 1 else ""

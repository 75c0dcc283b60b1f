"""Hints for entering the fields of a message: choices of constants, and ranges in comments."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from rosglass.interfaces.definition import Constant, Definition, Field

__all__ = ["Choice", "choices_of", "range_of"]

_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_END = rf"(?:{_NUMBER}|[-+]?(?:\d+(?:\.\d+)?\s*\*?\s*)?(?:pi|PI|Pi|π)(?:\s*/\s*\d+)?|[-+]?inf)"
#: ``[0, 1]``, ``(0..255)``, ``[-pi, pi)``; ``range 0 to 100``, ``between 0 and 1``.
_BRACKETS = re.compile(rf"[\[(]\s*({_END})\s*(?:,|;|\.\.\.?|-|to)\s*({_END})\s*[\])]")
_WORDS = re.compile(
    rf"\b(?:ranges?|between|from|in|limits?)\b:?\s*(?:is|of|from)?\s*({_END})\s*"
    rf"(?:to|and|\.\.\.?|-)\s*({_END})(?![\w.])",
    re.I,
)
_PI = re.compile(r"([-+]?)(\d+(?:\.\d+)?)?\s*\*?\s*(?:pi|π)(?:\s*/\s*(\d+))?", re.I)
#: Types that constants and fields of one meaning have.
_SIMILAR = {"byte": "8", "char": "8", "uint8": "8", "int8": "8", "wstring": "string"}
_MAX_COMMENT, _MAX_CHOICES = 4000, 200


class Choice(NamedTuple):
    """A constant that a field can be set to.

    Attributes:
        name: Its name.
        text: Its value as it is entered.
        comment: Its meaning; empty if the definition does not say.
    """

    name: str
    text: str
    comment: str


def choices_of(definition: Definition, field: Field) -> tuple[Choice, ...]:
    """Return the constants that a definition has for one of its fields.

    Definitions do not say which constants belong to which field. These do: constants whose names
    begin with the field's name (``POWER_SUPPLY_STATUS_FULL`` for ``power_supply_status``), then
    those that the field's comment names, and then, if no other field has their type, all of it.
    """
    known = [one for one in definition.constants if _alike(one.type, field.type.name)]
    prefix = field.name.upper().rstrip("_") + "_"
    named = [one for one in known if one.name.startswith(prefix)]
    if not named:
        words = set(re.findall(r"\b[A-Z][A-Z0-9_]+\b", field.comment[:_MAX_COMMENT]))
        named = [one for one in known if one.name in words]
    others = [one for one in definition.fields if _alike(one.type.name, field.type.name)]
    if len(named) < 2 and len(others) == 1:
        named = known
    return tuple(map(_choice, named[:_MAX_CHOICES])) if len(named) > 1 else ()


def _choice(constant: Constant) -> Choice:
    value = constant.value
    text = str(value).lower() if isinstance(value, bool) else str(value)
    return Choice(constant.name, text, " ".join(constant.comment.split())[:200])


def _alike(one: str, other: str) -> bool:
    return _SIMILAR.get(one, one) == _SIMILAR.get(other, other)


def range_of(comment: str) -> tuple[float, float] | None:
    """Return the range that a comment names: ``[0, 1]``, ``[-pi, pi]``; None without one."""
    text = comment[:_MAX_COMMENT]
    for pattern in (_BRACKETS, _WORDS):
        match = pattern.search(text)
        if match is not None:
            low, high = _value(match[1]), _value(match[2])
            return (low, high) if low < high else None
    return None


def _value(text: str) -> float:
    match = _PI.fullmatch(text)
    if match is None:
        return float(text)
    value = float(match[2] or 1) * math.pi / float(match[3] or 1)
    return -value if match[1] == "-" else value

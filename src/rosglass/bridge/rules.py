"""The rules of a bridge: names, patterns, new names and directions."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum
from fnmatch import fnmatchcase, translate
from typing import TYPE_CHECKING

from rosglass.errors import ArgumentError, InvalidNameError

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["Direction", "Rule", "Rules"]

_SIGN = re.compile(r":=|<->|->|<-")
_WILD = frozenset("*?[")
#: The built-in topics and services of nodes, which ``*`` does not match.
_BUILTIN = re.compile(
    r"/parameter_events|/rosout_agg"
    r"|.*/(get_loggers|set_logger_level|describe_parameters|get_parameter_types|get_parameters"
    r"|list_parameters|set_parameters|set_parameters_atomically|get_type_description"
    r"|get_logger_levels|set_logger_levels|bridge_routes|rosglass_bridge[^/]*/statistics)"
)


class Direction(Enum):
    """The direction of a relay."""

    BOTH = "<->"
    #: From the first graph to the second.
    THERE = "->"
    #: From the second graph to the first.
    BACK = "<-"


@dataclass(frozen=True, slots=True)
class Rule:
    """Topics, services or actions to relay.

    Attributes:
        name: Absolute name in the first graph, or a pattern: ``*`` matches any characters,
            slashes included, ``?`` matches one.
        other: Name in the second graph; for a pattern, the same.
        direction: The direction; that of a service is from its server to its clients.
    """

    name: str
    other: str
    direction: Direction = Direction.BOTH

    @classmethod
    def parse(cls, text: str) -> Rule:
        """Parse ``/scan``, ``/scan->``, ``/scan<-``, ``/scan:=/other``, ``/a->/b`` or ``/a<-/b``.

        Raises:
            InvalidNameError: It is none of these.
        """
        if not isinstance(text, str):
            raise InvalidNameError(f"what to relay is given by its name, not by {text!r:.80}")
        parts = _SIGN.split(text)
        sign = _SIGN.search(text)
        name = parts[0].strip()
        other = parts[1].strip() if len(parts) == 2 else ""
        direction = Direction.BOTH
        if sign is not None and sign.group() != ":=":
            direction = Direction(sign.group())
        if len(parts) > 2 or not name or (sign is not None and sign.group() == ":=" and not other):
            raise InvalidNameError(
                f"{text!r} does not say what to relay; write /name, /name:=/other_name, "
                "/name->, /name<-, or /name->/other_name"
            )
        if not _is_pattern(name):
            name, other = _absolute(name), _absolute(other or name)
            return cls(name, other, direction)
        if other:
            raise InvalidNameError(f"{text!r}: what a pattern stands for keeps its name")
        return cls(name, name, direction)

    @property
    def is_pattern(self) -> bool:
        """Whether it can match several names."""
        return _is_pattern(self.name)

    def applies(self, side: int) -> bool:
        """Return whether it relays from the first (0) or the second (1) graph."""
        return self.direction is not (Direction.BACK if side == 0 else Direction.THERE)


class Rules:
    """The rules for topics, services or actions.

    Args:
        rules: Rules, or texts for :meth:`Rule.parse`.
        exclude: Regular expression; full names that match are never relayed.

    Raises:
        InvalidNameError: A text is invalid.
        ArgumentError: `exclude` is no regular expression.
    """

    def __init__(self, rules: Iterable[str | Rule], exclude: str = "") -> None:
        if isinstance(rules, str):
            raise InvalidNameError(f"what to relay is given as a list, e.g. [{rules!r}]")
        self.rules = tuple(r if isinstance(r, Rule) else Rule.parse(r) for r in rules)
        try:
            self._exclude = re.compile(exclude) if exclude else None
        except re.error as error:
            what = f"a regular expression ({error})"
            raise ArgumentError("exclude", exclude, what, "Bridge") from None

    def __bool__(self) -> bool:
        return bool(self.rules)

    def other_name(self, side: int, name: str) -> str:
        """Return the other graph's name for `name` in graph `side`; empty if it is not relayed."""
        if self._exclude is not None and self._exclude.fullmatch(name):
            return ""
        for rule in self.rules:
            if not rule.is_pattern and rule.applies(side):
                ours, other = (rule.name, rule.other) if side == 0 else (rule.other, rule.name)
                if ours == name:
                    return other
        if any(name in (rule.name, rule.other) for rule in self.rules if not rule.is_pattern):
            return ""  # a rule of its own excludes this direction
        hidden = any(part.startswith("_") for part in name.split("/"))
        for rule in self.rules:
            if rule.is_pattern and rule.applies(side) and fnmatchcase(name, rule.name):
                usual = hidden or _BUILTIN.fullmatch(name)
                if not (usual and rule.name.strip("/") in ("*", "**")):
                    return name
        return ""

    def named(self, side: int) -> list[str]:
        """Return the names in graph `side` that are relayed from there, without patterns."""
        return [
            rule.name if side == 0 else rule.other
            for rule in self.rules
            if not rule.is_pattern and rule.applies(side)
        ]


def _is_pattern(name: str) -> bool:
    if not _WILD & set(name):
        return False
    try:
        re.compile(translate(name))
    except re.error:
        raise InvalidNameError(f"{name!r} is no pattern; * stands for any characters") from None
    return True


def _absolute(name: str) -> str:
    if not re.fullmatch(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*", name):
        raise InvalidNameError(
            f"{name!r} is no name of a topic or service; write /name or /namespace/name"
        )
    return name if name.startswith("/") else f"/{name}"

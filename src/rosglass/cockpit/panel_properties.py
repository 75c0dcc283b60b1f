"""Properties of a QML type, read from its file: types, defaults, and what their comments say.

The comments above the properties are the only source of meanings, units, ranges and choices. A
comment belongs to all properties below it, up to an empty line or the next comment.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

__all__ = ["KINDS", "PanelProperty", "declared_types", "described_types", "heading_of",
           "message_types", "properties_of", "python_properties"]  # fmt: skip

#: The kinds of properties, each with a field of its own in a form.
KINDS = ("number", "integer", "bool", "choice", "text", "color", "topic", "path", "frame", "node",
         "action", "service", "namespace", "list", "value")  # fmt: skip
#: Characters of a comment that are kept, of a file that is read, and properties of a type.
_MAX_COMMENT, _MAX_TEXT, _MAX_PROPERTIES = 400, 1_000_000, 300

_DECLARATION = re.compile(
    r"^ {4}(?:default )?property (?:alias )?(?:(?P<type>[\w.]+(?:<[\w.]+>)?) )?(?P<name>\w+)"
    r"(?: *: *(?P<value>.*))?$"
)
_TYPE_NAME = re.compile(r"\b([a-z][a-z0-9_]*)/(?:msg/)?([A-Z]\w*)")
#: Unit by the words of a comment, the first that matches.
_UNITS = tuple(
    (re.compile(rf"\b(?:{words})\b", re.I), unit)
    for words, unit in (
        (r"milliseconds", "ms"),
        (r"degrees? per second", "°/s"),
        (r"radians per second", "rad/s"),
        (r"met(?:re|er)s per second", "m/s"),
        (r"(?:images|updates|messages) per second", "Hz"),
        (r"seconds", "s"),
        (r"degrees", "°"),
        (r"radians", "rad"),
        (r"met(?:re|er)s", "m"),
        (r"pixels", "px"),
        (r"bytes", "B"),
        (r"per cent|percent", "%"),
    )
)
_BRACKETED_UNIT = re.compile(r"[(\[](m/s|m/s²|rad/s|rad|m|s|ms|Hz|°|°/s|px|%|V|A|N|B)[)\]]")
_NUMBER = r"-?\d+(?:\.\d+)?"
_RANGE = re.compile(rf"(?<![\w.])({_NUMBER})\s*(?:to|\.\.|\.{3})\s*({_NUMBER})(?![\w.]|\s*=)")
#: Numbers of a choice: ``0, 90, 180 or 270``.
_LISTED = re.compile(r"\b\d+(?:, \d+)+ or \d+\b")
_STRING = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
_NUMERIC = ("real", "double", "int", "float")
_KIND_BY_TYPE = {
    "bool": "bool",
    "int": "integer",
    "real": "number",
    "double": "number",
    "float": "number",
    "color": "color",
    "QColor": "color",
    "var": "value",
    "QVariant": "value",
    "QJSValue": "value",
}
_NAMESPACE = "Namespace of relative names."


@dataclass(frozen=True, slots=True)
class PanelProperty:
    """A property that a form shows.

    Attributes:
        name: Its name in QML.
        kind: One of :data:`KINDS`.
        line: Its meaning in one line; empty if its file does not say.
        default: The expression of its default value, as written; empty if the type decides.
        unit: Unit of a number; empty without one.
        low: Least value; None for no limit.
        high: Greatest value; None for no limit.
        choices: The values of a choice.
        types: Message types of a topic, best first; empty for any.
    """

    name: str
    kind: str
    line: str = ""
    default: str = ""
    unit: str = ""
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    types: tuple[str, ...] = ()


def heading_of(text: str) -> str:
    """Return the first sentence of the comment that a QML file opens with; empty without one."""
    lines = []
    for line in text[:_MAX_TEXT].removeprefix("\ufeff").splitlines():
        if not line.startswith("//"):
            break
        lines.append(line.lstrip("/ ").rstrip())
    return _first_sentence(" ".join(lines))


def message_types(text: str) -> tuple[str, ...]:
    """Return the message types that a comment names, in full: ``sensor_msgs/msg/Imu``."""
    found = (f"{package}/msg/{name}" for package, name in _TYPE_NAME.findall(text))
    return tuple(dict.fromkeys(name for name in found if "_srvs/" not in name))


def declared_types(text: str) -> dict[str, str]:
    """Return the types of the properties that a QML file declares, without its aliases."""
    return {name: kind for name, kind, _, _ in _declarations(text) if kind}


def described_types(text: str) -> dict[str, dict[str, str]]:
    """Return the property types of each QML type that a ``plugins.qmltypes`` file describes."""
    found: dict[str, dict[str, str]] = {}
    for part in text.split("Component {")[1:]:
        export = re.search(r'exports: \["[\w.]+/(\w+) ', part)
        if export is not None:
            found[export[1]] = dict(re.findall(r'Property \{ name: "(\w+)"; type: "([^"]+)"', part))
    return found


def properties_of(
    text: str, types: tuple[str, ...] = (), known: Mapping[str, Mapping[str, str]] | None = None
) -> tuple[PanelProperty, ...]:
    """Return the properties that a QML file declares for its users.

    Read-only ones and those whose names end in ``_`` are left out.

    Args:
        text: The QML file, formatted as usual: four spaces before the root's members.
        types: Message types of the property ``topic``, where its own comment names none.
        known: Types of the properties of other QML types, for aliases.
    """
    text = text[:_MAX_TEXT]
    found: dict[str, PanelProperty] = {}
    for name, kind, value, comment in _declarations(text):
        if kind:
            made = _property(name, kind, value, comment)
        else:
            made = _property(name, _alias_type(text, value, known or {}), "", comment)
        if made.kind == "topic" and not made.types and name == "topic":
            made = replace(made, types=types)
        found[name] = made
        if len(found) >= _MAX_PROPERTIES:
            break
    return tuple(found.values())


def python_properties(source: str) -> tuple[PanelProperty, ...]:
    """Return the properties that a Python element declares, with their ``#:`` comments.

    Args:
        source: The source of the module of an element, each ``name = Property(type, read, write``
            with a comment above it. Read-only ones, lists and objects are left out.
    """
    found = []
    pattern = re.compile(
        r"((?:^    #:.*\n)+)^    (\w+) = (?:Property|Writable)\(\s*(\w+),([^)]*)", re.M
    )
    for comment, name, kind, rest in pattern.findall(source[:_MAX_TEXT]):
        shown = {"str": "string", "float": "real", "QColor": "color"}.get(kind, kind)
        if shown in ("string", "real", "color", "bool", "int") and "_set" in rest:
            text = " ".join(line.strip().lstrip("#: ") for line in comment.splitlines())
            found.append(_property(name, shown, "", text.replace("``", '"')))
    return tuple(found)


def _declarations(text: str) -> Iterator[tuple[str, str, str, str]]:
    """Yield name, type (empty for an alias), default and comment of each property."""
    comment: list[str] = []
    is_open = False
    for line in text.splitlines():
        if line.startswith("    //"):
            if not is_open:
                comment = []
            is_open = True
            comment.append(line.strip().lstrip("/").strip())
            continue
        is_open = False
        if not line.strip():
            comment = []
            continue
        match = _DECLARATION.match(line)
        if match is None or match["name"].endswith("_"):
            continue
        is_alias = " alias " in line.partition(":")[0]
        kind = "" if is_alias else match["type"] or ""
        value = (match["value"] or "").split(" // ")[0].strip()
        beside = line.partition(" // ")[2].strip()
        yield match["name"], kind, value, beside or " ".join(comment)


def _alias_type(text: str, target: str, known: Mapping[str, Mapping[str, str]]) -> str:
    """Return the type of the property that an alias stands for; ``var`` if it is unknown."""
    identifier, _, name = target.partition(".")
    owner = re.search(rf"\b([A-Z]\w+) \{{\s*id: {re.escape(identifier)}\b", text)
    if owner is None or not name:
        return "var"
    return "string" if name == "text" else known.get(owner[1], {}).get(name, "var")


def _property(name: str, kind: str, value: str, comment: str) -> PanelProperty:
    line = _first_sentence(comment)
    if name == "ns":
        return PanelProperty(name, "namespace", _NAMESPACE, value)
    choices = _choices(comment) if kind in ("string", "var") else ()
    shown = _kind(name, kind, value, choices)
    made = PanelProperty(name, shown, line, value)
    if shown in ("number", "integer"):
        low, high = _range(comment)
        some = _LISTED.search(comment) if shown == "integer" else None
        listed = tuple(re.findall(r"\d+", some[0])) if some is not None else ()
        return replace(made, unit=_unit(comment), low=low, high=high, choices=listed)
    if shown == "choice":
        default = _STRING.fullmatch(value)
        own = (default[1],) if default is not None else ()
        return replace(made, choices=tuple(dict.fromkeys((*choices, *own))))
    if shown == "topic":
        return replace(made, types=message_types(comment))
    return made


def _kind(name: str, kind: str, value: str, choices: tuple[str, ...]) -> str:
    if kind in ("bool", *_NUMERIC, "color", "QColor"):
        return _KIND_BY_TYPE[kind]
    if kind in ("string", "QString", "url"):
        lower = name.lower()
        if name == "path":
            return "path"
        if len(choices) > 1:
            return "choice"
        if lower == "topic" or lower.endswith("topic") or name == "panTilt":
            return "topic"
        for ending in ("frame", "action", "service"):
            if lower == ending or name.endswith(ending.capitalize()):
                return ending
        if name in ("nodeName", "node"):
            return "node"
        return "text"
    if value.startswith("[") or kind.startswith("list<"):
        return "list"
    return _KIND_BY_TYPE.get(kind, "value")


def _first_sentence(comment: str) -> str:
    text = " ".join(comment.split())[:_MAX_COMMENT]
    match = re.match(r"(.+?(?<!e\.g)[^.])\.(?=\s+[A-Z]|$)", text)
    return (match[1] if match else text.rstrip(".")) + ("." if text else "")


def _unit(comment: str) -> str:
    bracketed = _BRACKETED_UNIT.search(comment)
    if bracketed is not None:
        return bracketed[1]
    # Behind a semicolon are exceptions: "0 for 5 times its usual pause, at least 1 s".
    head = comment.partition(";")[0]
    # "Bytes and seconds after which ...": of several properties with different units.
    units = [unit for pattern, unit in _UNITS if pattern.search(head)]
    if "ms" in units or len(units) == 1:
        return units[0]
    return units[0] if units and not re.search(r"\b\w+ and (?:seconds|metres)\b", head) else ""


def _range(comment: str) -> tuple[float | None, float | None]:
    match = _RANGE.search(comment)
    if match is None:
        if comment.startswith("Share"):
            return 0.0, 1.0
        return (0.0, None) if re.search(r"\b0 for\b", comment) else (None, None)
    low, high = (float(one) for one in match.groups())
    return (low, high) if low < high else (None, None)


def _choices(comment: str) -> tuple[str, ...]:
    """Return the texts that a comment lists: ``"dial" or "bar".``; empty if there is no list."""
    listed = _STRING.findall(comment)
    joined = re.findall(r'"[^"]*"(?:\s*\([^)]*\))?[^"]{0,60}?(?:,|\bor\b)\s*(?=")', comment)
    return tuple(listed) if len(listed) > 1 and len(joined) == len(listed) - 1 else ()

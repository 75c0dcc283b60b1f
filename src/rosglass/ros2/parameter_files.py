"""ROS 2 parameter files, as used by ``ros2 param dump`` and ``load`` and ``--params-file``.

Rules: ``rcl_yaml_param_parser`` (with which nodes read such files), whose scalars differ a little
from YAML's; rclcpp's ``parameter_map`` (wildcards in node names); ros2cli's ``ros2 param dump``
(output format); design article "ROS Command Line Arguments" (which value wins).
"""

from __future__ import annotations

import base64
import binascii
import logging
import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rosglass.comm.names import validate_node_name
from rosglass.comm.text_files import explain_yaml_error, load_pyyaml, read_text, write_text
from rosglass.errors import InvalidNameError, ParameterError

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Mapping

    from rosglass.comm import ParameterValue

__all__ = ["ParameterFile", "dump", "parse", "parse_value", "read", "write"]

_log = logging.getLogger("rosglass.ros2")
_KEY = "ros__parameters"
#: Maximum depth of nested mappings in a file; only an attack on the stack has more.
_MAX_DEPTH = 64
#: Maximum size of a file in bytes; the largest seen in the wild have about 100 kB.
_MAX_SIZE = 16 * 1024 * 1024
_TRUE = frozenset(["Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"])
_FALSE = frozenset(["N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"])
_NULL = frozenset(["null", "Null", "NULL", "~"])
#: Numbers that C's strtoll (base 0) and strtod accept, and infinity and NaN as in YAML.
_INTEGER = re.compile(r"([+-]?)(?:0[xX]([0-9a-fA-F]+)|(0[0-7]*)|([1-9][0-9]*))\Z")
_DOUBLE = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?\Z")
_HEX_DOUBLE = re.compile(
    r"[+-]?0[xX](?:[0-9a-fA-F]+\.?[0-9a-fA-F]*|\.[0-9a-fA-F]+)(?:[pP][+-]?[0-9]+)?\Z"
)
_INFINITE = re.compile(r"([+-]?)(?:\.(?:inf|Inf|INF)|(?i:inf|infinity))\Z")
_NAN = re.compile(r"(?:\.(?:nan|NaN|NAN)|[+-]?(?i:nan))\Z")
_STR_TAG, _BINARY_TAG = "tag:yaml.org,2002:str", "tag:yaml.org,2002:binary"


@dataclass(frozen=True)
class ParameterFile:
    """The contents of a parameter file.

    A list with mappings in it is left out, with a warning in the log.

    Attributes:
        label: The file's path or another source, for messages.
        entries: Pairs of a node's full name, which may have wildcards, and its parameters by
            dotted name, in the file's order.
    """

    label: str
    entries: tuple[tuple[str, Mapping[str, ParameterValue]], ...]

    def for_node(self, node: str) -> dict[str, ParameterValue]:
        """Return the parameters for the node with the full name `node`.

        Entries for the node itself win over those with wildcards; otherwise the last wins.
        """
        values: dict[str, ParameterValue] = {}
        for exact in (False, True):
            for pattern, parameters in self.entries:
                if exact is ("*" not in pattern) and matches(pattern, node):
                    values.update(parameters)
        return values


def matches(pattern: str, node: str) -> bool:
    """Return whether a node's full name matches `pattern`.

    ``/*`` stands for one part of a name, ``/**`` for any number of parts, none included.
    """
    regex = "".join(
        {"/**": r"(/\w+)*", "/*": r"/\w+"}.get(part, re.escape(part))
        for part in re.split(r"(/\*\*|/\*)(?=/|\Z)", pattern)
    )
    return re.fullmatch(regex, node, re.ASCII) is not None


def read(path: str | os.PathLike[str]) -> ParameterFile:
    """Read a parameter file; raises ParameterError with file, line and column."""
    text, label = read_text(path, _MAX_SIZE)
    return parse(text, label)


def parse(text: str, label: str = "<text>") -> ParameterFile:
    """Read the text of a parameter file.

    Args:
        text: The text.
        label: The file's path or another source, for messages.

    Raises:
        ParameterError: It is not a parameter file; the message has file, line and column.
    """
    return ParameterFile(label, tuple(_Reader(text, label).nodes()))


def parse_value(text: str, label: str) -> ParameterValue:
    """Return the value of `text` as YAML, by the rules for parameter files.

    Raises:
        ParameterError: It is not a parameter value.
    """
    return _Reader(text, label).value()


def dump(nodes: Mapping[str, Mapping[str, ParameterValue]]) -> str:
    """Return a parameter file's text in the layout of ``ros2 param dump``.

    Strings that nodes would read as another type (``1e5``, ``nan``) are quoted, which that tool
    forgets.

    Args:
        nodes: Parameters by dotted name, by the node's full name.
    """
    yaml = load_pyyaml()

    class Dumper(yaml.SafeDumper):  # type: ignore[misc, name-defined]
        def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002 - PyYAML's
            return True  # nodes refuse aliases

    def represent_text(dumper: Any, text: str) -> Any:
        # Strings that rcl_yaml_param_parser would read as another type.
        ambiguous = text in _TRUE or text in _FALSE or _looks_like_number(text)
        return dumper.represent_scalar(_STR_TAG, text, style="'" if ambiguous else None)

    Dumper.add_representer(str, represent_text)
    document = {node: {_KEY: _nested(parameters)} for node, parameters in nodes.items()}
    dumped: str = yaml.dump(document, Dumper=Dumper, default_flow_style=False)
    return dumped


def write(path: str | os.PathLike[str], nodes: Mapping[str, Mapping[str, ParameterValue]]) -> None:
    """Write a parameter file atomically; raises ParameterError if that is not possible."""
    write_text(path, dump(nodes))


class _MapInListError(ParameterError):
    """A list has a mapping in it, up to which it was read."""


class _Reader:
    """Reads YAML events: tags and quotes matter, and PyYAML's own types are not ROS's."""

    def __init__(self, text: str, label: str) -> None:
        self._label = label
        self._yaml = yaml = load_pyyaml()
        self._events: Iterator[Any] = yaml.parse(text, Loader=yaml.SafeLoader)

    def nodes(self) -> Iterator[tuple[str, dict[str, ParameterValue]]]:
        while not isinstance(event := self._next(), self._yaml.StreamEndEvent):
            if isinstance(event, self._yaml.MappingStartEvent):
                yield from self._node("", event, 0)
            elif isinstance(event, (self._yaml.ScalarEvent, self._yaml.SequenceStartEvent)):
                raise self._error(event, f"expected node names with {_KEY!r} below them")

    def value(self) -> ParameterValue:
        found: ParameterValue = None
        while not isinstance(event := self._next(), self._yaml.StreamEndEvent):
            if isinstance(event, self._yaml.ScalarEvent):
                found = self._scalar(event)
            elif isinstance(event, self._yaml.SequenceStartEvent):
                found = self._sequence()
            elif isinstance(event, self._yaml.MappingStartEvent):
                raise self._error(event, "a parameter's value is a scalar or a list, not a mapping")
        return found

    def _next(self) -> Any:
        """Return the next event; aliases are refused, as in nodes."""
        try:
            event = next(self._events)
        except self._yaml.YAMLError as error:
            raise ParameterError(explain_yaml_error(error, self._label, "not YAML")) from None
        if isinstance(event, self._yaml.AliasEvent):
            raise self._error(
                event,
                f"aliases (*{event.anchor}) are not part of parameter files; repeat the value",
            )
        return event

    def _error(self, event: Any, problem: str) -> ParameterError:
        mark = event.start_mark
        return ParameterError(f"{self._label}:{mark.line + 1}:{mark.column + 1}: {problem}")

    def _pairs(self) -> Iterator[tuple[Any, str, Any]]:
        """Read a mapping's keys, each with the first event of its value."""
        while not isinstance(key := self._next(), self._yaml.MappingEndEvent):
            if not isinstance(key, self._yaml.ScalarEvent):
                raise self._error(key, "a key must be a name, not a list or a mapping")
            if not key.value:
                raise self._error(key, "a key is empty")
            yield key, key.value, self._next()

    def _node(
        self, namespace: str, start: Any, depth: int
    ) -> Iterator[tuple[str, dict[str, ParameterValue]]]:
        if depth > _MAX_DEPTH:
            raise self._error(start, "too deeply nested")
        for key, name, begin in self._pairs():
            if name == _KEY:
                if not namespace:
                    raise self._error(key, f"{_KEY!r} needs the name of a node above it")
                if not isinstance(begin, self._yaml.MappingStartEvent):
                    raise self._error(begin, f"expected names of parameters below {_KEY!r}")
                yield self._full(key, namespace), dict(self._parameters("", begin, 0))
            elif isinstance(begin, self._yaml.MappingStartEvent):
                yield from self._node(
                    f"{namespace}/{name}" if namespace else name, begin, depth + 1
                )
            else:
                misspelt = any(p.startswith("ros_") for p in (name, *namespace.split("/")))
                hint = f"; it is spelled {_KEY!r}" if misspelt else ""
                raise self._error(
                    key,
                    f"{name!r} has a value, but stands above {_KEY!r}, where only names of "
                    f"namespaces and nodes can be{hint}",
                )

    def _full(self, key: Any, name: str) -> str:
        full = "/" + name.lstrip("/")
        for part in re.sub("/{2,}", "/", full)[1:].split("/"):
            if part in ("*", "**"):
                continue
            try:
                validate_node_name(part)
            except InvalidNameError as error:
                hint = "; a wildcard stands for whole parts: '*' or '**'" if "*" in part else ""
                raise self._error(
                    key, f"{full!r} is not the name of a node: {error}{hint}"
                ) from None
        return re.sub("/{2,}", "/", full)

    def _parameters(
        self, prefix: str, start: Any, depth: int
    ) -> Iterator[tuple[str, ParameterValue]]:
        if depth > _MAX_DEPTH:
            raise self._error(start, "too deeply nested")
        for _key, name, begin in self._pairs():
            full = f"{prefix}.{name}" if prefix else name
            if isinstance(begin, self._yaml.MappingStartEvent):
                yield from self._parameters(full, begin, depth + 1)
            elif isinstance(begin, self._yaml.SequenceStartEvent):
                try:
                    yield full, self._sequence()
                except _MapInListError as error:
                    # Nodes read other names and values out of it, and the rest of the file.
                    _log.warning("%s; the parameter %r is left out", error, full)
                    self._skip(2)
            else:
                yield full, self._scalar(begin)

    def _skip(self, depth: int) -> None:
        """Skip to the end of so many lists and mappings."""
        starts = (self._yaml.MappingStartEvent, self._yaml.SequenceStartEvent)
        ends = (self._yaml.MappingEndEvent, self._yaml.SequenceEndEvent)
        while depth:
            event = self._next()
            depth += isinstance(event, starts) - isinstance(event, ends)

    def _sequence(self) -> ParameterValue:
        items: list[Any] = []
        while not isinstance(event := self._next(), self._yaml.SequenceEndEvent):
            if isinstance(event, self._yaml.MappingStartEvent):
                problem = self._error(event, "a mapping in a list is not a parameter value")
                raise _MapInListError(str(problem))
            if not isinstance(event, self._yaml.ScalarEvent):
                raise self._error(event, "a list in a list is not a parameter value")
            item = self._scalar(event)
            if item is None:
                raise self._error(event, "a list cannot hold null")
            if items and type(item) is not type(items[0]):
                names = f"{_name_of(items[0])} before, {_name_of(item)} here"
                advice = "; write whole numbers as 1.0" if "a float" in names else ""
                raise self._error(
                    event, f"the items of a list must be of one type: {names}{advice}"
                )
            items.append(item)
        if items and isinstance(items[0], bytes):
            return b"".join(items)
        return items

    def _scalar(self, event: Any) -> Any:
        tag, text = event.tag, event.value
        if tag not in (None, "!", _STR_TAG, _BINARY_TAG):
            raise self._error(
                event, f"nodes take no notice of the tag {tag!r}; write the value as what it is"
            )
        if tag == _BINARY_TAG:
            try:
                return base64.b64decode("".join(text.split()), validate=True)
            except (ValueError, binascii.Error) as error:
                raise self._error(event, f"this is not base64: {error}") from None
        if tag in (_STR_TAG, "!") or event.style in ("'", '"'):
            return text
        if not text:
            raise self._error(event, "there is no value; an empty text is written ''")
        return self._plain(event, text)

    def _plain(self, event: Any, text: str) -> Any:
        if text in _TRUE or text in _FALSE:
            return text in _TRUE
        if text in _NULL:
            return None
        try:
            return _number(text)
        except OverflowError as error:
            raise self._error(event, str(error)) from None


def _number(text: str) -> int | float | str:
    """Return the number that C's strtoll or strtod reads in all of `text`, or else `text`."""
    match = _INTEGER.match(text)
    if match:
        sign, hexadecimal, octal, decimal = match.groups()
        digits = hexadecimal or octal or decimal
        value = (
            int(digits, 16 if hexadecimal else 8 if octal else 10) if len(digits) < 99 else 2**64
        )
        value = -value if sign == "-" else value
        if not -(2**63) <= value < 2**63:
            raise OverflowError(
                f"{text} is beyond the 64 bits of an integer; write {text}.0 for a float"
            )
        return value
    infinite = _INFINITE.match(text)
    if infinite:
        return -math.inf if infinite[1] == "-" else math.inf
    if _NAN.match(text):
        return math.nan
    if _DOUBLE.match(text) or _HEX_DOUBLE.match(text):
        try:
            number = float.fromhex(text) if _HEX_DOUBLE.match(text) else float(text)
        except OverflowError:
            number = math.inf
        nonzero = re.search("[1-9a-f]", re.split("p|e(?=[+-]?[0-9]+$)", text.lower())[0])
        if math.isinf(number) or (number == 0 and nonzero):
            raise OverflowError(f"{text} is beyond the range of a double")
        return number
    return text


def _name_of(value: object) -> str:
    names = {bool: "a boolean", int: "an integer", float: "a float", str: "a text", bytes: "bytes"}
    return names[type(value)]


def _nested(parameters: Mapping[str, ParameterValue]) -> dict[str, Any]:
    """Return parameters as nested dicts, split at the dots of their names."""
    root: dict[str, Any] = {}
    for name, value in sorted(parameters.items()):
        place, rest = root, name
        while "." in rest:
            first, _, tail = rest.partition(".")
            # A parameter has the name of a group: the names in the group keep their dots.
            if not first or not tail or not isinstance(place.get(first, {}), dict):
                break
            place, rest = place.setdefault(first, {}), tail
        place[rest] = [bytes([byte]) for byte in value] if isinstance(value, bytes) else value
    return root


def _looks_like_number(text: str) -> bool:
    try:
        return not isinstance(_number(text), str)
    except OverflowError:
        return True

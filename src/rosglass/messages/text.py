"""Messages as dicts, JSON, YAML and one line of text."""

from __future__ import annotations

import math
import re
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rosglass.errors import DecodeError
from rosglass.messages.schema import Kind

if TYPE_CHECKING:
    from rosglass.messages.message import Message
    from rosglass.messages.schema import Member

__all__ = ["finite", "plain", "short", "to_dict", "to_json", "to_yaml"]

_SHOWN = 6
_LONGEST = 60
#: What stands for a byte that is not UTF-8, or for half a pair in a ``wstring``.
_SURROGATE = re.compile("[\ud800-\udfff]")


def to_dict(message: Message) -> dict[str, Any]:
    """Return the message as nested dicts; numeric arrays stay what they are."""
    return {
        member.name: _dict_value(member, getattr(message, member.attr))
        for member in message._schema__.members
    }


def _dict_value(member: Member, value: Any) -> Any:
    if member.kind is not Kind.STRUCT:
        number = member.number
        single = isinstance(value, (bytes, bytearray)) and len(value) == 1 and not member.is_array
        if single and number is not None and number.name == "byte":
            return int.from_bytes(value, "little", signed=number.low != 0)
        return value
    if member.is_array:
        return [to_dict(element) if hasattr(element, "_schema__") else element for element in value]
    return to_dict(value) if hasattr(value, "_schema__") else value


def plain(value: Any) -> Any:
    """Return a value of :func:`to_dict` with lists for arrays and readable strings."""
    if isinstance(value, dict):
        return {key: plain(inner) for key, inner in value.items()}
    if isinstance(value, str):
        return _SURROGATE.sub("\N{REPLACEMENT CHARACTER}", value)
    if isinstance(value, (bytes, bytearray, memoryview)):
        return list(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    return value


def to_json(message: Message, indent: int | None = None) -> str:
    """Return the message as strict JSON."""
    dumped: str = import_module("json").dumps(
        finite(plain(to_dict(message))), indent=indent, ensure_ascii=False, allow_nan=False
    )
    return dumped


def finite(value: Any) -> Any:
    """Return a value of :func:`plain` with words for numbers that JSON does not have."""
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if isinstance(value, dict):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [finite(inner) for inner in value]
    return value


def to_yaml(message: Message) -> str:
    """Return the message as YAML; lists of numbers take one line."""
    yaml = import_module("yaml")

    class Dumper(yaml.SafeDumper):  # type: ignore[misc, name-defined]
        pass

    def represent_list(dumper: Any, items: list[Any]) -> Any:
        flow = not any(isinstance(item, (dict, list, str)) for item in items)
        return dumper.represent_sequence("tag:yaml.org,2002:seq", items, flow_style=flow)

    Dumper.add_representer(list, represent_list)
    dumped: str = yaml.dump(
        plain(to_dict(message)),
        Dumper=Dumper,
        sort_keys=False,
        default_flow_style=False,
        allow_unicode=True,
        width=2**31,
    )
    return dumped


def short(message: Message) -> str:
    """Return one line: the type and the fields, long arrays and strings cut."""
    try:
        return message._schema__.name + _fields(message)
    except DecodeError as error:
        return f"{message._schema__.name}(<{error}>)"


def _fields(message: Message) -> str:
    parts = []
    for member in message._schema__.members:
        try:
            value = getattr(message, member.attr)
        except AttributeError:
            parts.append(f"{member.name}=<deleted>")
            continue
        parts.append(f"{member.name}={_short_value(member, value)}")
    return f"({', '.join(parts)})"


def _short_value(member: Member, value: Any) -> str:
    if not member.is_array:
        if hasattr(value, "_schema__"):
            return _fields(value)
        return _cut(repr(value))
    if not hasattr(value, "__len__") or isinstance(value, str):
        return _cut(repr(value))
    count = len(value)
    few = value[: _SHOWN if count > _SHOWN else count]
    few = few.tolist() if hasattr(few, "tolist") else list(few)
    shown = [_fields(item) if hasattr(item, "_schema__") else _cut(repr(item)) for item in few]
    more = [f"... {count} in all"] if count > _SHOWN else []
    return f"[{', '.join(shown + more)}]"


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."

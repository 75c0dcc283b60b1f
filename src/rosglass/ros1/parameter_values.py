"""What a ROS 1 parameter can be: Python's values on one side, XML-RPC's on the other.

Types: ROS wiki, "Parameter Server", section 3: 32-bit integers, booleans, strings, doubles, ISO
8601 dates, lists, base64-encoded binary data, and dictionaries, which are namespaces.
"""

from __future__ import annotations

import re
import xmlrpc.client
from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import Any

from rosglass.errors import ParameterError

__all__ = ["flat", "from_wire", "pruned", "same", "to_wire"]

_LOWEST, _GREATEST = -(2**31), 2**31 - 1
#: XML 1.0, section 2.2; a carriage return is legal there, but arrives as a line feed (2.11).
_NOT_CARRIED = re.compile("[^\t\n\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
#: Nothing that people write is nested deeper; a list that contains itself is.
_DEEPEST = 50
_DATE = "%Y%m%dT%H:%M:%S"


def to_wire(name: str, value: object) -> Any:
    """Return a value as the parameter server takes it, a copy.

    Numpy's scalars and arrays, tuples, bytearrays and the like become plain values and lists.

    Args:
        name: The parameter's name, for messages.
        value: A bool, int, float, str, bytes, datetime, or a list or dict of these.

    Raises:
        ParameterError: The parameter server cannot hold it; the message says why, and what to do.
    """
    return _to_wire(name, value, 0)


def from_wire(value: Any) -> Any:
    """Return what the parameter server sent as plain Python values."""
    if isinstance(value, dict):
        return {str(key): from_wire(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [from_wire(item) for item in value]
    if isinstance(value, xmlrpc.client.Binary):
        return bytes(value.data)
    if isinstance(value, xmlrpc.client.DateTime):
        try:
            return datetime.strptime(str(value), _DATE)
        except ValueError:
            return str(value)
    return value


def flat(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield name and value of each parameter in a namespace, names joined with ``/``."""
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            yield from flat(value, f"{name}/")
        else:
            yield name, value


def pruned(value: Any) -> Any:
    """Return a value without empty namespaces: the master says "not set" with them, too."""
    if not isinstance(value, dict):
        return value
    kept = ((key, pruned(item)) for key, item in value.items())
    return {key: item for key, item in kept if item != {}}


def same(one: Any, other: Any) -> bool:
    """Return whether nothing has changed; 1, 1.0 and True are not the same."""
    if type(one) is not type(other):
        return False
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other) or (one != one and other != other)  # noqa: PLR0124 - not a number


def _to_wire(name: str, value: object, depth: int) -> Any:
    if depth > _DEEPEST:
        raise ParameterError(f"parameter {name}: nested more than {_DEEPEST} levels deep")
    if not isinstance(value, (bool, int, float, str, bytes, bytearray, memoryview, list, tuple)):
        plain = getattr(value, "tolist", None)
        value = value if plain is None else plain()
    if isinstance(value, bool):
        return bool(value)
    if isinstance(value, int):
        if not _LOWEST <= value <= _GREATEST:
            raise ParameterError(
                f"parameter {name}: {value} is beyond the 32 bits of an integer on a ROS 1 "
                f"parameter server ({_LOWEST} to {_GREATEST}); set it as a float "
                f"({float(value)!r}) or as a text"
                if abs(value) < 1e300
                else f"parameter {name}: an integer has 32 bits on a ROS 1 parameter server"
            )
        return int(value)
    if isinstance(value, float):
        return float(value)
    if isinstance(value, str):
        return _text(f"parameter {name}", value)
    if isinstance(value, (bytes, bytearray, memoryview)):
        return xmlrpc.client.Binary(bytes(value))
    if isinstance(value, datetime):
        return _date(name, value)
    if isinstance(value, (list, tuple)):
        return [_to_wire(f"{name}[{i}]", item, depth + 1) for i, item in enumerate(value)]
    if isinstance(value, Mapping):
        return {
            _key(name, key): _to_wire(f"{name.rstrip('/')}/{key}", item, depth + 1)
            for key, item in value.items()
        }
    advice = "; to unset it, delete it" if value is None else ""
    raise ParameterError(
        f"parameter {name}: a ROS 1 parameter is a bool, int, float, str, bytes, datetime, or a "
        f"list or dict of these, got {_shown(value)}{advice}"
    )


def _text(what: str, text: str) -> str:
    found = _NOT_CARRIED.search(text)
    if found is None:
        return str(text)
    if found.group() == "\r":
        problem = "a carriage return, which XML turns into a line feed; replace '\\r\\n' by '\\n'"
    else:
        problem = f"{found.group()!r}, which XML cannot carry; set bytes instead, or leave it out"
    raise ParameterError(f"{what}: at position {found.start()} there is {problem}")


def _key(name: str, key: object) -> str:
    if not isinstance(key, str):
        raise ParameterError(
            f"parameter {name}: the keys of a dict are names of parameters, got {_shown(key)}; "
            f"write {str(key)!r} for it"
        )
    if not key or "/" in key:
        parts = "{'a': {'b': 1}} instead of {'a/b': 1}"
        problem = f"{key!r} has a '/'; write {parts}" if key else "there is an empty one"
        raise ParameterError(f"parameter {name}: the keys of a dict are names: {problem}")
    return _text(f"parameter {name}: key {key!r}", key)


def _date(name: str, value: datetime) -> datetime:
    if value.tzinfo is not None or value.microsecond:
        raise ParameterError(
            f"parameter {name}: dates on a ROS 1 parameter server have whole seconds and no time "
            f"zone, got {value.isoformat()}; set it as a text, or as seconds"
        )
    return value


def _shown(value: object) -> str:
    shown = repr(value)
    return f"{shown[:77]}..." if len(shown) > 80 else shown

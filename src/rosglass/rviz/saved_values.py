"""Values of any shape in a ``.rviz`` file, whose scalars are all read back as text."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any

from rosglass.errors import ConversionError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["from_config", "merged", "plain_config", "to_config", "writable"]

_INT = re.compile(r"[-+]?[0-9]+\Z")
_FLOAT = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?\Z")
_WORDS: dict[str, Any] = {
    "true": True,
    "false": False,
    "null": None,
    "~": None,
    ".inf": math.inf,
    "-.inf": -math.inf,
    ".nan": math.nan,
    "{}": {},
    "[]": [],
}
_WANTED = "null, true, false, a number, a text, a list or a map of these"
_DEEPEST = 50
#: What YAML has no way to write, or what would not come back as it was.
_UNWRITABLE = re.compile(r"[\0-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff\ufeff\u2028\u2029]")


def writable(value: Any, path: str) -> Any:
    """Return a value with lists for tuples, after a look whether a file can keep it.

    Raises:
        ConversionError: It cannot; the error says where in it.
    """
    return _writable(value, path, 0)


def _writable(value: Any, path: str, depth: int) -> Any:
    if depth > _DEEPEST:
        raise ConversionError(path[:60], "more", f"values nested at most {_DEEPEST} deep")
    if isinstance(value, dict):
        for key in value:
            if not isinstance(key, str) or _UNWRITABLE.search(key):
                raise ConversionError(path, key, "names that are texts without control characters")
        items = value.items()
        return {key: _writable(inner, f"{path}.{key}", depth + 1) for key, inner in items}
    if isinstance(value, (list, tuple)):
        return [_writable(inner, f"{path}[{at}]", depth + 1) for at, inner in enumerate(value)]
    if value is None or isinstance(value, (bool, int, float)):
        return value
    if isinstance(value, str) and not _UNWRITABLE.search(value):
        return value
    raise ConversionError(path, value, _WANTED)


def to_config(config: Any, value: Any, *, plain: bool = False) -> None:
    """Write a value to RViz's ``Config``.

    Args:
        config: RViz's; as yet empty.
        value: From :func:`writable`.
        plain: Write texts as they are, for a reader who knows what is a text.
    """
    if isinstance(value, dict) and value:
        for key, inner in value.items():
            to_config(config.mapMakeChild(key), inner, plain=plain)
    elif isinstance(value, list) and value:
        for inner in value:
            to_config(config.listAppendNew(), inner, plain=plain)
    else:
        config.setValue(value if plain and isinstance(value, str) else _text(value))


def _text(value: Any) -> str:
    if isinstance(value, str):
        # What would be read as something else is kept as JSON would have it.
        return value if _scalar(value) == value and value[:1] != '"' else json.dumps(value)
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return repr(value)


def _scalar(text: str) -> Any:
    if text.lower() in _WORDS:
        word = _WORDS[text.lower()]
        return type(word)() if isinstance(word, (dict, list)) else word
    if text[:1] == '"':
        try:
            return json.loads(text)
        except ValueError:
            return text
    if _INT.match(text) and len(text) < 20:
        return int(text)
    return float(text) if _FLOAT.match(text) else text


def from_config(config: Any) -> Any:
    """Return what :func:`to_config`, or the overlays of hector_rviz_overlay, have written."""
    return _typed(plain_config(config))


def _typed(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _typed(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_typed(inner) for inner in value]
    return _scalar(value) if isinstance(value, str) else value


def plain_config(config: Any) -> Any:
    """Return an RViz ``Config`` as dicts, lists and scalars, which are text in a file's."""
    kinds = type(config)
    kind = config.getType()
    if kind == kinds.Map:
        found, at = {}, config.mapIterator()
        while at.isValid():
            found[str(at.currentKey())] = plain_config(at.currentChild())
            at.advance()
        return found
    if kind == kinds.List:
        return [plain_config(config.listChildAt(at)) for at in range(config.listLength())]
    return config.getValue() if kind == kinds.Value else None


def merged(older: Mapping[str, Any], newer: Mapping[str, Any]) -> dict[str, Any]:
    """Return `newer` with what only `older` has."""
    found = {**older, **newer}
    for key, value in newer.items():
        before = older.get(key)
        if isinstance(before, dict):
            found[key] = merged(before, value if isinstance(value, dict) else {"Value": value})
    return found

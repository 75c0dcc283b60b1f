"""Times and durations on their way from QML: of either module, dates, milliseconds."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from rosglass.comm.time import Duration, Time
from rosglass.errors import ConversionError
from rosglass.qml.js_values import integral, is_model, properties_of, shown, wide

if TYPE_CHECKING:
    from fractions import Fraction

    from rosglass.qt import QJSValue

__all__ = [
    "DECIMAL",
    "duration_from_js",
    "from_milliseconds",
    "known_parts",
    "number_from_text",
    "time_from_js",
    "time_parts",
]

#: What says a number in text.
DECIMAL = re.compile(r"[+-]?([0-9]{1,40}(\.[0-9]{0,40})?|\.[0-9]{1,40})([eE][+-]?[0-9]{1,3})?\Z")
_SECONDS, _NANOSECONDS = ("sec", "secs"), ("nanosec", "nsec", "nsecs")
_NS = 1_000_000_000


def number_from_text(text: str) -> Fraction:
    """Return the number that a decimal text says, exactly; raises ConversionError."""
    from fractions import Fraction  # noqa: PLC0415 - takes milliseconds at start-up

    if not DECIMAL.match(text.strip()):
        raise ConversionError("", text, "a decimal number")
    return Fraction(text.strip())


def time_from_js(value: QJSValue, name: str = "time") -> Time:
    """Return the point in time that QML gave: a time of either module, a Date, or milliseconds.

    Raises:
        ConversionError: It is none of these; names `name`.
    """
    return Time(_nanoseconds(value, name, "a time or a Date"))


def duration_from_js(value: QJSValue, name: str = "duration") -> Duration:
    """Return the span of time that QML gave: milliseconds, or a duration of either module.

    Raises:
        ConversionError: It is none of these; names `name`.
    """
    return Duration(_nanoseconds(value, name, "a duration or milliseconds"))


def _nanoseconds(value: QJSValue, name: str, wanted: str) -> int:
    sec, nanosec = time_parts(value, name, wanted)
    if type(sec) is not int or type(nanosec) is not int:
        raise ConversionError(name, shown(value), wanted)
    return sec * _NS + nanosec


def time_parts(value: QJSValue, path: str, wanted: str) -> tuple[Any, Any]:
    """Return seconds and nanoseconds of anything that says a time; numbers are milliseconds.

    The parts are as they were given, unless they are not integers: the codec knows their ranges.

    Raises:
        ConversionError: It is no time; says that `wanted` was.
    """
    if value.isDate():
        return from_milliseconds(value.property("getTime").callWithInstance(value).toNumber(), path)
    if value.isNumber():
        return from_milliseconds(value.toNumber(), path)
    if not value.isObject() or value.isArray() or value.isCallable() or is_model(value):
        raise ConversionError(path, shown(value), wanted)
    if value.isQObject():
        known = (*_SECONDS, *_NANOSECONDS)
        names = [name for name in known if value.hasProperty(name)]
    else:
        names = [name for name in properties_of(value) if name != "#messageType"]
    if not names and value.toString() != "[object Object]" and not value.hasProperty("#kind"):
        raise ConversionError(path, shown(value), wanted)
    given = {name: _given(value.property(name)) for name in names}
    return known_parts(given, path, wanted)


def known_parts(given: dict[str, Any], path: str, wanted: str) -> tuple[Any, Any]:
    """Return seconds and nanoseconds of an object's properties; errors as in :func:`time_parts`."""
    if set(given) == {"nanoseconds"}:
        total = wide(given["nanoseconds"]) if isinstance(given["nanoseconds"], str) else None
        total = integral(given["nanoseconds"]) if total is None else total
        if type(total) is not int:
            raise ConversionError(f"{path}.nanoseconds", given["nanoseconds"], "an integer")
        return divmod(total, _NS)
    parts: list[Any] = [0, 0]
    for name, item in given.items():
        if name not in _SECONDS and name not in _NANOSECONDS:
            here = f"{path}.{name}" if path else name
            raise ConversionError(here, item, f"{wanted} of sec and nanosec (or nsec)")
        if item is not None:
            parts[name in _NANOSECONDS] = integral(item)
    return parts[0], parts[1]


def from_milliseconds(milliseconds: float, path: str) -> tuple[int, int]:
    """Return seconds and nanoseconds of milliseconds."""
    if not math.isfinite(milliseconds) or abs(milliseconds) > 2**53:
        raise ConversionError(path, milliseconds, "milliseconds")
    whole = math.floor(milliseconds)
    return divmod(whole * 1_000_000 + round((milliseconds - whole) * 1_000_000), _NS)


def _given(value: QJSValue) -> Any:
    return None if value.isUndefined() else shown(value)

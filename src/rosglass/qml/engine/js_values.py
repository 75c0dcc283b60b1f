"""JavaScript values in Python: their types, conversions, and text for errors."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rosglass.comm.qos import BEST_AVAILABLE, Durability, History, Liveliness, QoS, Reliability
from rosglass.comm.time import Duration, Time
from rosglass.errors import ArgumentError, ConversionError
from rosglass.qt import QJSValue, QtCore, QtQml

if TYPE_CHECKING:
    from collections.abc import Iterator
    from fractions import Fraction


__all__ = [
    "DECIMAL",
    "Shown",
    "duration_from_js",
    "from_milliseconds",
    "integral",
    "is_model",
    "known_parts",
    "null",
    "number_from_text",
    "object_of",
    "properties_of",
    "qos_from_js",
    "qos_parts",
    "queue_from_js",
    "roles_of",
    "shown",
    "time_from_js",
    "time_parts",
    "wide",
]

#: No 64-bit integer has more digits.
_WHOLE = re.compile(r"-?0*[0-9]{1,20}\Z")
#: Maximum length of an array that errors show in full.
_SHOWN = 100


def properties_of(value: QJSValue) -> list[str]:
    """Return the names of an object's own properties."""
    return list(_iterate(value))


def _iterate(value: QJSValue) -> Iterator[str]:
    properties = QtQml.QJSValueIterator(value)
    while properties.hasNext():
        properties.next()
        yield properties.name()


def object_of(value: QJSValue) -> Any:
    """Return a value's QObject; another Python value if it is not a QObject."""
    # PySide2 treats the value as the owner of the result of toQObject(): the object's wrapper would
    # be destroyed with the value, despite other references in Python.
    return value.toVariant()


def is_model(value: QJSValue) -> bool:
    """Return whether a value is an item model: a ListModel, or one from C++ or Python."""
    return value.isQObject() and isinstance(object_of(value), QtCore.QAbstractItemModel)


def roles_of(model: Any) -> dict[str, int]:
    """Return an item model's role numbers by name, sorted by number."""
    names = model.roleNames()
    return {bytes(names[number].data()).decode(): number for number in sorted(names)}


def wide(text: str) -> int | str:
    """Return a decimal text as an integer, other texts unchanged."""
    return int(text) if _WHOLE.match(text) else text


def integral(value: Any) -> Any:
    """Return a whole float as an integer, other values unchanged."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def shown(value: QJSValue) -> Any:
    """Return a Python value whose repr shows a JavaScript value in an error."""
    if value.isNull() or value.isUndefined():
        return None
    if value.isNumber():
        return value.toNumber()
    if value.isBool():
        return value.toBool()
    if value.isCallable():
        return Shown("a function")
    if value.isArray():
        length = value.property("length").toNumber()
        # Do not build the text of a huge array (``a.length = 4e9``) or of objects with cycles.
        if length > _SHOWN or any(value.property(at).isObject() for at in range(int(length))):
            return Shown(f"an array of {length:.0f} elements")
    return value.toString() if value.isString() else Shown(value.toString())


class Shown:
    """A value without a Python type, with JavaScript's text as its repr."""

    def __init__(self, text: str) -> None:
        self._text = text

    def __repr__(self) -> str:
        return self._text


def null() -> QJSValue:
    """Return JavaScript's null."""
    return QJSValue(QJSValue.SpecialValue.NullValue)


#: A decimal number as text.
DECIMAL = re.compile(r"[+-]?([0-9]{1,40}(\.[0-9]{0,40})?|\.[0-9]{1,40})([eE][+-]?[0-9]{1,3})?\Z")
_SECONDS, _NANOSECONDS = ("sec", "secs"), ("nanosec", "nsec", "nsecs")
_NS = 1_000_000_000


def fraction(value: float | str) -> Fraction:
    """Return the exact value of a number, or of its text."""
    from fractions import Fraction  # noqa: PLC0415 - takes milliseconds at start-up

    return Fraction(value)


def number_from_text(text: str) -> Fraction:
    """Return the exact number of a decimal text; raises ConversionError."""
    if not DECIMAL.match(text.strip()):
        raise ConversionError("", text, "a decimal number")
    return fraction(text.strip())


def time_from_js(value: QJSValue, name: str = "time") -> Time:
    """Return a QML value as a point in time: a time of either module, a Date, or milliseconds.

    Raises:
        ConversionError: It is none of these; the message contains `name`.
    """
    return Time(_nanoseconds(value, name, "a time or a Date"))


def duration_from_js(value: QJSValue, name: str = "duration") -> Duration:
    """Return a QML value as a duration: milliseconds, or a duration of either module.

    Raises:
        ConversionError: It is none of these; the message contains `name`.
    """
    return Duration(_nanoseconds(value, name, "a duration or milliseconds"))


def _nanoseconds(value: QJSValue, name: str, wanted: str) -> int:
    sec, nanosec = time_parts(value, name, wanted)
    if type(sec) is not int or type(nanosec) is not int:
        raise ConversionError(name, shown(value), wanted)
    return sec * _NS + nanosec


def time_parts(value: QJSValue, path: str, wanted: str) -> tuple[Any, Any]:
    """Return seconds and nanoseconds of a time in any form; numbers are milliseconds.

    Integer parts are returned unchanged: the codec checks their ranges.

    Raises:
        ConversionError: It is not a time; the message says that `wanted` was expected.
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
    """Return seconds and nanoseconds of an object; raises like :func:`time_parts`."""
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
    """Convert milliseconds to seconds and nanoseconds."""
    if not math.isfinite(milliseconds) or abs(milliseconds) > 2**53:
        raise ConversionError(path, milliseconds, "milliseconds")
    whole = math.floor(milliseconds)
    return divmod(whole * 1_000_000 + round((milliseconds - whole) * 1_000_000), _NS)


def _given(value: QJSValue) -> Any:
    return None if value.isUndefined() else shown(value)


_BEST = "best_available"


def qos_parts(qos: QoS) -> tuple[Any, ...]:
    """Return the arguments of ``makeQos`` in helpers.js; durations in ms, 0 for no limit."""
    limits = (qos.deadline, qos.lifespan, qos.lease_duration, qos.send_timeout)
    head = (qos.reliability.value, qos.durability.value, qos.history.value, qos.depth)
    return (*head, qos.liveliness.value, *map(_milliseconds, limits))


def _milliseconds(limit: Duration | None) -> float | str:
    if limit is None:
        return 0
    return _BEST if limit == BEST_AVAILABLE else limit.nanoseconds / 1e6


def qos_from_js(value: QJSValue | None, default: QoS) -> QoS:
    """Return the QoS profile of a QML value: the result of ``Ros2.QoS()``, or a queue size.

    Raises:
        ConversionError: It is neither, its depth is not a positive integer, or a limit is not a
            number of milliseconds.
    """
    if value is None or value.isUndefined() or value.isNull():
        return default
    if value.isNumber():
        return default.with_depth(_depth(value.toNumber()))
    try:
        if not value.hasProperty("reliability"):
            raise ValueError
        liveliness = value.property("liveliness")
        return QoS(
            depth=_depth(value.property("size").toNumber()),
            reliability=Reliability(value.property("reliability").toString()),
            durability=Durability(value.property("durability").toString()),
            history=History(value.property("history").toString()),
            deadline=_limit(value, "deadline"),
            lifespan=_limit(value, "lifespan"),
            liveliness=Liveliness(
                "automatic" if liveliness.isUndefined() else liveliness.toString()
            ),
            lease_duration=_limit(value, "lease"),
            send_timeout=_limit(value, "sendTimeout"),
        )
    except ArgumentError as error:
        raise ConversionError(f"qos.{error.path}", shown(value), error.expected) from None
    except ValueError:
        raise ConversionError("qos", shown(value), "a queue size or Ros2.QoS()") from None


def queue_from_js(value: QJSValue, default: QoS) -> QoS:
    """Return the profile of a queue size (0 for no limit, as in ROS 1), or a given profile.

    Raises:
        ConversionError: Like :func:`qos_from_js`.
    """
    if value.isNumber() and value.toNumber() == 0:
        return replace(default, history=History.KEEP_ALL)
    return qos_from_js(value, default)


def _limit(value: QJSValue, name: str) -> Duration | None:
    """Return a duration of a profile; None for no limit (0 or infinity)."""
    given = value.property(f"{name}Ms")
    if given.isString() and given.toString() == _BEST:
        return BEST_AVAILABLE
    if given.isUndefined() or (given.isNumber() and given.toNumber() in (0, float("inf"))):
        return None
    milliseconds = given.toNumber() if given.isNumber() else -1.0
    # 292 years, the most that 64-bit nanoseconds can express.
    if not 1e-6 <= milliseconds < 9e12:
        wanted = "milliseconds above zero, or 0 for no limit"
        raise ConversionError(f"qos.{name}", shown(given), wanted)
    return Duration(round(milliseconds * 1e6))


def _depth(value: float) -> int:
    if not value.is_integer() or not 1 <= value <= 1_000_000:
        raise ConversionError("queue size", value, "an integer of 1 to 1000000")
    return int(value)

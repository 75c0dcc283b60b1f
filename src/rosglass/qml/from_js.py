"""Values on their way from QML into a message, guided by the message's type.

Nothing is guessed: what a field cannot take is left as it is, so that the codec refuses it with
the field's path. Only what JavaScript has no word for is translated: integral numbers for integer
fields, decimal text for 64-bit integers, milliseconds and dates for times, typed arrays.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from rosglass.comm.qos import Durability, History, QoS, Reliability
from rosglass.errors import ConversionError
from rosglass.qt import QJSValue, QtGui, QtQml

if TYPE_CHECKING:
    from rosglass.messages.schema import Member, Schema

__all__ = ["fields_from_js", "qos_from_js"]

#: No 64-bit integer has more digits.
_WHOLE = re.compile(r"-?0*[0-9]{1,20}\Z")
_TYPED = {
    "Int8Array": "i1",
    "Uint8Array": "u1",
    "Uint8ClampedArray": "u1",
    "Int16Array": "<i2",
    "Uint16Array": "<u2",
    "Int32Array": "<i4",
    "Uint32Array": "<u4",
    "Float32Array": "<f4",
    "Float64Array": "<f8",
}
#: Arrays longer than this cross into Python in one call instead of one call per element.
_BULK = 32
#: Longer arrays than this are a mistake (``a.length = 4e9``) that would freeze the screen.
_LONGEST = 1 << 24


def fields_from_js(value: QJSValue, schema: Schema, path: str = "") -> dict[str, Any]:
    """Return the fields that a JavaScript value gives for a message; undefined ones are left out.

    Args:
        value: An object, a message received before, a QML object with properties of the fields'
            names, or a vector or quaternion.
        schema: The message type.
        path: Field path of the message, for errors.

    Raises:
        ConversionError: The value cannot be a message of this type.
    """
    if value.isQObject():
        names = [member.name for member in schema.members if value.hasProperty(member.name)]
        return _read(names, value, schema, path)
    if not value.isObject() or value.isArray() or value.isCallable() or value.isDate():
        raise ConversionError(path, _shown(value), f"an object with {schema.name}'s fields")
    names = []
    properties = QtQml.QJSValueIterator(value)
    while properties.hasNext():
        properties.next()
        names.append(properties.name())
    if not names and value.toString() != "[object Object]":
        # A Map, a Set: their content would silently be lost.
        raise ConversionError(path, _shown(value), f"an object with {schema.name}'s fields")
    if "scalar" in names and "scalar" not in schema.by_name:
        held = value.toVariant()
        if isinstance(held, QtGui.QQuaternion):
            return {"x": held.x(), "y": held.y(), "z": held.z(), "w": held.scalar()}
    return _read([name for name in names if name != "#messageType"], value, schema, path)


def _read(names: list[str], value: QJSValue, schema: Schema, path: str) -> dict[str, Any]:
    fields = {}
    for name in names:
        inner = value.property(name)
        if inner.isUndefined():
            continue
        member = schema.by_name.get(name)
        # An unknown field goes along: the codec refuses it and names those that exist.
        here = f"{path}.{name}" if path else name
        fields[name] = _shown(inner) if member is None else _field(inner, member, here)
    return fields


def _field(value: QJSValue, member: Member, path: str) -> Any:
    if not member.is_array:
        return _single(value, member, path)
    # A long array that was received is a Proxy, which isArray() does not see through.
    if value.isArray() or value.property("#index").isNumber():
        return _elements(value, member, path)
    constructor = value.property("constructor").property("name").toString()
    if constructor in _TYPED and member.number is not None:
        return _typed_array(value, constructor)
    if constructor == "ArrayBuffer" and member.number is not None and member.number.size == 1:
        return bytes(value.toVariant().data())
    raise ConversionError(path, _shown(value), f"an array ({member.field.type})")


def _elements(value: QJSValue, member: Member, path: str) -> Any:
    source = value.property("#source")
    if source.isQObject():
        # A received array on its way back, untouched: no need to fetch it into JavaScript.
        held: Any = source.toQObject()
        return held.arrays[value.property("#index").toInt()][1]
    count = value.property("length").toNumber()
    if count > _LONGEST:
        raise ConversionError(
            path, _Shown(f"{count:.0f}"), f"an array of at most {_LONGEST} elements"
        )
    length = int(count)
    if length > _BULK and member.struct is None:
        whole = member.number is not None and member.number.low is not None
        elements = value.toVariant()
        if _is_wide(member):
            return [_wide(v) if isinstance(v, str) else _integral(v) for v in elements]
        return [_integral(v) if whole else v for v in elements]
    return [_single(value.property(i), member, f"{path}[{i}]") for i in range(length)]


def _typed_array(value: QJSValue, constructor: str) -> Any:
    import numpy as np  # noqa: PLC0415 - few programs send typed arrays

    data = bytes(value.property("buffer").toVariant().data())
    count, offset = value.property("length").toInt(), value.property("byteOffset").toInt()
    return np.frombuffer(data, np.dtype(_TYPED[constructor]), count, offset)


def _single(value: QJSValue, member: Member, path: str) -> Any:
    schema = member.struct
    if schema is not None:
        if schema.is_time and (value.isNumber() or value.isDate()):
            return _time(value, schema)
        return fields_from_js(value, schema, path)
    if value.isNumber():
        number = value.toNumber()
        whole = member.number is not None and member.number.low is not None
        return _integral(number) if whole else number
    if value.isString():
        text = value.toString()
        return _wide(text) if _is_wide(member) else text
    if value.isBool():
        return value.toBool()
    return _shown(value)


def _is_wide(member: Member) -> bool:
    return member.number is not None and member.number.code in "qQ"


def _wide(text: str) -> int | str:
    return int(text) if _WHOLE.match(text) else text


def _integral(value: Any) -> Any:
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _time(value: QJSValue, schema: Schema) -> dict[str, Any]:
    """Take a number for milliseconds, and a Date for a point in time."""
    if value.isDate():
        milliseconds: float = value.toDateTime().toMSecsSinceEpoch()
    else:
        milliseconds = value.toNumber()
    if not math.isfinite(milliseconds) or abs(milliseconds) > 2**53:
        raise ConversionError("", milliseconds, "milliseconds")
    whole, rest = divmod(round(milliseconds * 1_000_000), 1_000_000_000)
    return dict(zip((member.name for member in schema.members), (whole, rest), strict=True))


def _shown(value: QJSValue) -> Any:
    """Return a Python value that shows in an error what was given."""
    if value.isNull() or value.isUndefined():
        return None
    if value.isNumber():
        return value.toNumber()
    if value.isBool():
        return value.toBool()
    if value.isCallable():
        return _Shown("a function")
    return value.toString() if value.isString() else _Shown(value.toString())


class _Shown:
    """A value of no Python type, shown as JavaScript shows it."""

    def __init__(self, text: str) -> None:
        self._text = text

    def __repr__(self) -> str:
        return self._text


def qos_from_js(value: QJSValue | None, default: QoS) -> QoS:
    """Return the profile that QML gave: one made by ``Ros2.QoS()``, or a queue size.

    Raises:
        ConversionError: It is neither, or its depth is not a positive integer.
    """
    if value is None or value.isUndefined() or value.isNull():
        return default
    if value.isNumber():
        return default.with_depth(_depth(value.toNumber()))
    try:
        if not value.hasProperty("reliability"):
            raise ValueError
        return QoS(
            depth=_depth(value.property("size").toNumber()),
            reliability=Reliability(value.property("reliability").toString()),
            durability=Durability(value.property("durability").toString()),
            history=History(value.property("history").toString()),
        )
    except ValueError:
        raise ConversionError("qos", _shown(value), "a queue size or Ros2.QoS()") from None


def _depth(value: float) -> int:
    if not value.is_integer() or not 1 <= value <= 1_000_000:
        raise ConversionError("queue size", value, "an integer of 1 to 1000000")
    return int(value)

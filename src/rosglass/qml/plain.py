"""JavaScript values as plain Python values, without a message type that says what is wanted."""

from __future__ import annotations

from typing import Any

from rosglass.errors import ConversionError
from rosglass.qml.from_js import typed_array
from rosglass.qml.js_values import Shown, integral, is_model, object_of, properties_of, roles_of
from rosglass.qml.times import duration_from_js, time_from_js
from rosglass.qt import QJSValue, QtCore

__all__ = ["plain_from_js"]

_DEEPEST = 100
_LONGEST = 1 << 24


def plain_from_js(value: QJSValue, path: str = "", depth: int = 0) -> Any:
    """Return a value as None, bool, int, float, str, list, dict, bytes, QDateTime, Time, Duration.

    Objects of QML give the properties that their own class declares, item models a list of their
    rows, as dicts by role.

    Raises:
        ConversionError: It is a function, refers to itself, or is nested too deeply.
    """
    if depth > _DEEPEST:
        wanted = f"values nested at most {_DEEPEST} deep, not referring to themselves"
        raise ConversionError(path[:60], Shown("more"), wanted)
    if value.isUndefined() or value.isNull():
        return None
    if value.isBool():
        return value.toBool()
    if value.isNumber():
        number = value.toNumber()
        return integral(number) if abs(number) < 2**53 else number
    if value.isString():
        return value.toString()
    if value.isDate():
        return value.toDateTime()
    if value.isCallable():
        raise ConversionError(path, Shown("a function"), "a value")
    kind = value.property("#kind").toString()
    if kind in {"time", "duration"} and not value.isQObject():
        return time_from_js(value, path) if kind == "time" else duration_from_js(value, path)
    if value.isArray() or value.property("#index").isNumber():
        return _array(value, path, depth)
    if is_model(value):
        return _rows(object_of(value), path, depth)
    if value.isQObject():
        meta = object_of(value).metaObject()
        own = range(meta.propertyOffset(), meta.propertyCount())
        names = [str(meta.property(at).name()) for at in own]
        return {name: _inner(value, name, path, depth) for name in names}
    numbers = typed_array(value)
    if numbers is not None:
        return numbers.tolist()
    return _object(value, path, depth)


def _inner(value: QJSValue, name: str, path: str, depth: int) -> Any:
    return plain_from_js(value.property(name), f"{path}.{name}" if path else name, depth + 1)


def _array(value: QJSValue, path: str, depth: int) -> list[Any]:
    if value.property("#index").isNumber():
        value = value.property("toArray").callWithInstance(value)
    length = value.property("length").toNumber()
    if length > _LONGEST:
        raise ConversionError(path, Shown(f"{length:.0f} elements"), f"at most {_LONGEST}")
    return [
        plain_from_js(value.property(index), f"{path}[{index}]", depth + 1)
        for index in range(int(length))
    ]


def _object(value: QJSValue, path: str, depth: int) -> Any:
    names = properties_of(value)
    if not names and value.toString() != "[object Object]":
        return _python(value.toVariant(), path, depth)
    return {name: _inner(value, name, path, depth) for name in names if name != "#messageType"}


def _rows(model: Any, path: str, depth: int) -> list[Any]:
    roles = roles_of(model)
    found = []
    for row in range(model.rowCount()):
        index, here = model.index(row, 0), f"{path}[{row}]"
        items = {name: model.data(index, number) for name, number in roles.items()}
        found.append({name: _python(item, here, depth + 1) for name, item in items.items()})
    return found


def _python(value: Any, path: str, depth: int) -> Any:
    """Return a value that Qt has made a Python value of."""
    if isinstance(value, QJSValue):
        return plain_from_js(value, path, depth)
    if isinstance(value, (bool, float, int, str, type(None), QtCore.QDateTime)):
        return value
    if isinstance(value, QtCore.QUrl):
        return value.toString()
    if isinstance(value, QtCore.QByteArray):
        return bytes(value.data())
    if isinstance(value, QtCore.QAbstractItemModel):
        return _rows(value, path, depth)
    if isinstance(value, dict):
        return {name: _python(inner, f"{path}.{name}", depth + 1) for name, inner in value.items()}
    if isinstance(value, list):
        return [_python(inner, f"{path}[{at}]", depth + 1) for at, inner in enumerate(value)]
    raise ConversionError(path, Shown(repr(value)), "a value of JavaScript")

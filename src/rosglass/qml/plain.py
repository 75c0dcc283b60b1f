"""JavaScript values as plain Python values, without a message type that says what is wanted."""

from __future__ import annotations

import time
from typing import Any

from rosglass.errors import ConversionError
from rosglass.qml.from_js import typed_array
from rosglass.qml.js_values import Shown, integral, is_model, object_of, properties_of, roles_of
from rosglass.qml.times import duration_from_js, time_from_js
from rosglass.qt import QJSValue, QtCore

__all__ = ["plain_from_js"]

_DEEPEST = 100
#: Values in all that are read one by one: what shares its parts can have more than atoms there are.
_MOST = 1 << 18
#: How long reading a value may block the interface.
_READ_TIMEOUT_S = 5.0


def plain_from_js(value: QJSValue) -> Any:
    """Return a value as None, bool, int, float, str, list, dict, bytes, QDateTime, Time, Duration.

    Objects of QML give the properties that their own class declares, item models a list of their
    rows, as dicts by role.

    Raises:
        ConversionError: It is a function, refers to itself, is nested too deeply, has more than
            2^18 values, or takes more than 5 s to read; received arrays and typed arrays of
            numbers count as one.
    """
    return _Reader().read(value, "", 0)


def _number(number: float | str) -> float | str:
    # Integers that JavaScript's numbers do not hold come as text.
    return integral(number) if not isinstance(number, str) and abs(number) < 2**53 else number


class _Reader:
    """Reads one value and all that is in it."""

    def __init__(self) -> None:
        self._left = _MOST
        self._deadline = time.monotonic() + _READ_TIMEOUT_S

    def read(self, value: QJSValue, path: str, depth: int) -> Any:
        """Return a value; `path` is where it is."""
        self._count(path, depth)
        if value.isUndefined() or value.isNull():
            return None
        if value.isBool():
            return value.toBool()
        if value.isNumber():
            return _number(value.toNumber())
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
            return self._array(value, path, depth)
        if is_model(value):
            return self._rows(object_of(value), path, depth)
        if value.isQObject():
            meta = object_of(value).metaObject()
            own = range(meta.propertyOffset(), meta.propertyCount())
            names = [str(meta.property(at).name()) for at in own]
            return {name: self._inner(value, name, path, depth) for name in names}
        numbers = typed_array(value)
        if numbers is not None:
            return numbers.tolist()
        return self._object(value, path, depth)

    def _count(self, path: str, depth: int) -> None:
        if depth > _DEEPEST:
            wanted = f"values nested at most {_DEEPEST} deep, not referring to themselves"
            raise ConversionError(path[:60], Shown("more"), wanted)
        self._left -= 1
        if self._left < 0:
            wanted = (
                f"at most {_MOST} values in all, counting again what appears twice; numbers in a "
                "typed array count as one"
            )
            raise ConversionError(path[:60], Shown("more"), wanted)
        if not self._left % 256 and time.monotonic() > self._deadline:
            wanted = (
                f"a value that is read within {_READ_TIMEOUT_S:g} s, for which it blocks the "
                "interface; numbers in a typed array are read at once"
            )
            raise ConversionError(
                path[:60], Shown(f"more than {_MOST - self._left} values"), wanted
            )

    def _inner(self, value: QJSValue, name: str, path: str, depth: int) -> Any:
        here = f"{path}.{name}" if path else name
        return self.read(value.property(name), here, depth + 1)

    def _array(self, value: QJSValue, path: str, depth: int) -> list[Any]:
        if value.property("#index").isNumber():
            value = value.property("toArray").callWithInstance(value)
            if value.property(0).isNumber():
                return [_number(number) for number in value.toVariant()]
        length = value.property("length").toNumber()
        if length > self._left:
            told = f"at most {_MOST} values in all; numbers in a typed array count as one"
            raise ConversionError(path, Shown(f"{length:.0f} elements"), told)
        return [
            self.read(value.property(index), f"{path}[{index}]", depth + 1)
            for index in range(int(length))
        ]

    def _object(self, value: QJSValue, path: str, depth: int) -> Any:
        names = properties_of(value)
        if not names and value.toString() != "[object Object]":
            return self._python(value.toVariant(), path, depth)
        found = (name for name in names if name != "#messageType")
        return {name: self._inner(value, name, path, depth) for name in found}

    def _rows(self, model: Any, path: str, depth: int) -> list[Any]:
        roles = roles_of(model)
        found = []
        for row in range(model.rowCount()):
            index, here = model.index(row, 0), f"{path}[{row}]"
            items = {name: model.data(index, number) for name, number in roles.items()}
            made = {name: self._python(item, here, depth + 1) for name, item in items.items()}
            found.append(made)
        return found

    def _python(self, value: Any, path: str, depth: int) -> Any:
        """Return a value that Qt has made a Python value of."""
        if isinstance(value, QJSValue):
            return self.read(value, path, depth)
        self._count(path, depth)
        if isinstance(value, (bool, float, int, str, type(None), QtCore.QDateTime)):
            return value
        if isinstance(value, QtCore.QUrl):
            return value.toString()
        if isinstance(value, QtCore.QByteArray):
            return bytes(value.data())
        if isinstance(value, QtCore.QAbstractItemModel):
            return self._rows(value, path, depth)
        if isinstance(value, dict):
            items = value.items()
            return {name: self._python(inner, f"{path}.{name}", depth + 1) for name, inner in items}
        if isinstance(value, list):
            return [
                self._python(inner, f"{path}[{at}]", depth + 1) for at, inner in enumerate(value)
            ]
        raise ConversionError(path, Shown(repr(value)), "a value of JavaScript")

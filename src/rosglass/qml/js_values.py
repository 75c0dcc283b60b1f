"""JavaScript values in Python: what they are, and how errors show them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from rosglass.qt import QJSValue, QtCore, QtQml

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = [
    "Shown",
    "integral",
    "is_model",
    "null",
    "object_of",
    "properties_of",
    "roles_of",
    "shown",
    "wide",
]

#: No 64-bit integer has more digits.
_WHOLE = re.compile(r"-?0*[0-9]{1,20}\Z")
#: Elements of an array that an error shows in full.
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
    """Return the QObject that a value is; something else when it is none."""
    # PySide2 takes the value for the owner of what toQObject() gives: whoever else holds the object
    # in Python would find it gone with the value.
    return value.toVariant()


def is_model(value: QJSValue) -> bool:
    """Return whether it is an item model: a ListModel, or one of C++ or Python."""
    return value.isQObject() and isinstance(object_of(value), QtCore.QAbstractItemModel)


def roles_of(model: Any) -> dict[str, int]:
    """Return an item model's roles by name, in the order of their numbers."""
    names = model.roleNames()
    return {bytes(names[number].data()).decode(): number for number in sorted(names)}


def wide(text: str) -> int | str:
    """Return the integer that a decimal text says, otherwise the text."""
    return int(text) if _WHOLE.match(text) else text


def integral(value: Any) -> Any:
    """Return a whole float as an integer, everything else as it is."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def shown(value: QJSValue) -> Any:
    """Return a Python value that shows in an error what was given."""
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
        # ``a.length = 4e9`` is written in a moment, and its text never is; nor that of a web.
        if length > _SHOWN or any(value.property(at).isObject() for at in range(int(length))):
            return Shown(f"an array of {length:.0f} elements")
    return value.toString() if value.isString() else Shown(value.toString())


class Shown:
    """A value of no Python type, shown as JavaScript shows it."""

    def __init__(self, text: str) -> None:
        self._text = text

    def __repr__(self) -> str:
        return self._text


def null() -> QJSValue:
    """Return JavaScript's null."""
    return QJSValue(QJSValue.SpecialValue.NullValue)

"""Conversion of QML values to message fields, by the message's type.

Nothing is guessed: a value that does not fit its field stays unchanged, and the codec refuses it
with the field's path. Converted are values that JavaScript has no type for (integral numbers for
integer fields, decimal text for 64-bit integers, milliseconds and dates for times, typed arrays),
and values that the plugins accept without loss.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

from rosglass.errors import ConversionError
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.js_values import (
    DECIMAL,
    Shown,
    duration_from_js,
    from_milliseconds,
    integral,
    is_model,
    known_parts,
    number_from_text,
    object_of,
    properties_of,
    roles_of,
    shown,
    time_from_js,
    time_parts,
    wide,
)
from rosglass.qt import QJSValue, QtCore, QtGui

if TYPE_CHECKING:
    from rosglass.messages import MessageType
    from rosglass.messages.schema import Member, Number, Schema


__all__ = [
    "elements_from_js",
    "fields_from_js",
    "numpy",
    "plain_from_js",
    "scalar_from_python",
    "typed_array",
]

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
#: Longer arrays are passed to Python in one call instead of one call per element.
_BULK = 32
#: Longer arrays are mistakes (``a.length = 4e9``) that would freeze the screen.
_LONGEST = 1 << 24
_HEADER = "std_msgs/msg/Header"


def fields_from_js(
    value: QJSValue, type: MessageType, path: str = "", dialect: Dialect = Dialect.ROS2
) -> dict[str, Any]:
    """Return the message fields in a JavaScript value, without undefined ones.

    Args:
        value: An object, a received message, a QML object whose properties have the fields' names,
            or a vector or quaternion.
        type: The message type.
        path: Field path of the message, for errors.
        dialect: The module that the value is from. ``Ros2 1.0`` also converts texts to numbers and
            numbers to texts where nothing is lost.

    Raises:
        ConversionError: The value is not a message of this type.
    """
    return _Conversion(dialect).fields(value, type._schema, path)


def elements_from_js(values: QJSValue, kind: str) -> list[Any]:
    """Return the elements of an array of 64-bit integers.

    Args:
        values: A JavaScript array of numbers and decimal texts.
        kind: Element type, for errors.

    Raises:
        ConversionError: An element is not an integer.
    """
    found = []
    for index, value in enumerate(_list(values, kind)):
        whole = wide(value) if isinstance(value, str) else integral(value)
        if type(whole) is not int:
            raise ConversionError(f"[{index}]", value, f"an integer ({kind})")
        found.append(whole)
    return found


def numpy() -> Any:
    """Return numpy; importing it takes longer than all of QML's elements, and few need it."""
    import numpy  # noqa: PLC0415

    return numpy


def _renamed_time(given: dict[str, Any], schema: Schema) -> dict[str, Any]:
    parts = known_parts(given, "", f"a time ({schema.name})")
    return dict(zip((member.name for member in schema.members), parts, strict=True))


def scalar_from_python(value: Any, member: Member) -> Any:
    """Convert a number, text or bool from a view's editor by the rules of ``Ros2 1.0``."""
    return _Conversion(Dialect.ROS2)._scalar(value, member, in_array=False)


class _Conversion:
    """Converts values by the rules of one module."""

    def __init__(self, dialect: Dialect) -> None:
        self._dialect = dialect
        self._loose = dialect is Dialect.ROS2

    def fields(self, value: QJSValue, schema: Schema, path: str) -> dict[str, Any]:
        """Return the fields of a message in a value."""
        if schema.is_time:
            parts = time_parts(value, path, f"a time ({schema.name})")
            return dict(zip((member.name for member in schema.members), parts, strict=True))
        names = self._names(schema)
        if value.isQObject() and not is_model(value):
            found = [name for name in names if value.hasProperty(name)]
            return self._read(found, names, value, schema, path)
        if (
            not value.isObject()
            or value.isArray()
            or value.isCallable()
            or value.isDate()
            or value.isQObject()
        ):
            raise _no_message(value, schema, path)
        found = properties_of(value)
        if not found and value.toString() != "[object Object]":
            # The contents of a Map, a Set or a url would be lost without an error.
            raise _no_message(value, schema, path)
        # Check first: reading a missing name would be reported as a mistake in the interface.
        scalar = value.hasProperty("scalar") and value.property("scalar").isNumber()
        if scalar and "scalar" not in schema.by_name:
            held = value.toVariant()
            if isinstance(held, QtGui.QQuaternion):
                return {"x": held.x(), "y": held.y(), "z": held.z(), "w": held.scalar()}
        found = [name for name in found if name != "#messageType"]
        return self._read(found, names, value, schema, path)

    def _names(self, schema: Schema) -> dict[str, str]:
        """Return the fields by each of their accepted names."""
        names = {member.name: member.name for member in schema.members}
        names.update({ours: theirs for theirs, ours in self._dialect.names(schema).items()})
        return names

    def _read(
        self, found: list[str], names: dict[str, str], value: QJSValue, schema: Schema, path: str
    ) -> dict[str, Any]:
        fields: dict[str, Any] = {}
        for name in found:
            inner = value.property(name)
            if inner.isUndefined() or self._is_needless(name, schema):
                continue
            member = schema.by_name.get(names.get(name, ""))
            # Pass unknown fields on: the codec refuses them and lists those that exist.
            here = f"{path}.{name}" if path else name
            if member is None:
                fields[name] = shown(inner)
            else:
                fields[member.name] = self._field(inner, member, here)
        return fields

    def _is_needless(self, name: str, schema: Schema) -> bool:
        """Return whether this is the ``seq`` counter, which only ROS 1's headers have."""
        ros1 = self._dialect is Dialect.ROS1
        return ros1 and name == "seq" and schema.name == _HEADER and name not in schema.by_name

    def _field(self, value: QJSValue, member: Member, path: str) -> Any:
        if not member.is_array:
            return self._single(value, member, path)
        # A long received array is a Proxy, for which isArray() is false.
        if value.isArray() or value.property("#index").isNumber():
            return self._elements(value, member, path)
        if is_model(value):
            return self._rows(object_of(value), member, path)
        constructor = value.property("constructor").property("name").toString()
        if member.number is not None and value.isObject():
            numbers = typed_array(value)
            if numbers is not None:
                return _as_bools(numbers, member.number)
            if constructor == "ArrayBuffer":
                return _buffer(value, member, path)
        if constructor == "DataView":
            wanted = f"an array ({member.field.type}); pass the DataView's .buffer"
            raise ConversionError(path, Shown("a DataView"), wanted)
        # JavaScript objects may have cycles, which Qt would follow forever.
        strange = value.isObject() and not value.isCallable() and constructor != "Object"
        held = value.toVariant() if strange else None
        if isinstance(held, list):
            # A list from C++ or Python, which is not an array in JavaScript.
            return [
                self._python(item, member, f"{path}[{index}]") for index, item in enumerate(held)
            ]
        raise ConversionError(path, shown(value), f"an array ({member.field.type})")

    def _elements(self, value: QJSValue, member: Member, path: str) -> Any:
        source = value.property("#source")
        if source.isQObject():
            # An unchanged received array: no need to fetch it into JavaScript.
            arrays: Any = getattr(object_of(source), "arrays", [])
            index = value.property("#index").toInt()
            if 0 <= index < len(arrays) and arrays[index][0].struct is member.struct:
                return arrays[index][1]
        if value.property("#index").isNumber():
            value = value.property("toArray").callWithInstance(value)
        length = _length(value, path)
        # As above: elements that are objects are converted one by one.
        if length > _BULK and member.struct is None and not value.property(0).isObject():
            items = value.toVariant()
            if None not in items:
                return [
                    self._python(item, member, f"{path}[{index}]")
                    for index, item in enumerate(items)
                ]
        return [
            self._element(value.property(index), member, f"{path}[{index}]")
            for index in range(length)
        ]

    def _element(self, value: QJSValue, member: Member, path: str) -> Any:
        if value.isUndefined():
            # An element that was skipped when the array's length grew.
            return _default(member)
        return self._single(value, member, path)

    def _rows(self, model: Any, member: Member, path: str) -> list[Any]:
        """Return the rows of an item model: values of its first role, or messages of all its roles.

        A single role that is not a field of the message contains the elements themselves.
        """
        roles = roles_of(model)
        struct = member.struct
        whole = struct is None or (len(roles) == 1 and not {*roles} & {*self._names(struct)})
        found: list[Any] = []
        count = model.rowCount()
        if count > _LONGEST:
            raise ConversionError(path, Shown(f"{count} rows"), f"at most {_LONGEST} rows")
        for row in range(count):
            index, here = model.index(row, 0), f"{path}[{row}]"
            if struct is None or whole:
                item = model.data(index, min(roles.values(), default=0))
                found.append(self._python(item, member, here))
                continue
            items = {name: model.data(index, number) for name, number in roles.items()}
            found.append(self._python_fields(items, struct, here))
        return found

    def _python_fields(self, items: dict[str, Any], schema: Schema, path: str) -> dict[str, Any]:
        names = self._names(schema)
        fields = {}
        for name, item in items.items():
            # An item model returns None for roles that a row does not have.
            if item is None:
                continue
            member = schema.by_name.get(names.get(name, ""))
            here = f"{path}.{name}"
            if member is None:
                fields[name] = item
            elif not member.is_array:
                fields[member.name] = self._python(item, member, here)
            elif isinstance(item, QtCore.QAbstractItemModel):
                fields[member.name] = self._rows(item, member, here)
            elif isinstance(item, list):
                fields[member.name] = [self._python(inner, member, here) for inner in item]
            else:
                fields[member.name] = item
        return fields

    def _python(self, value: Any, member: Member, path: str) -> Any:
        """Convert one element that Qt has already converted to a Python value."""
        if isinstance(value, QJSValue):
            return self._single(value, member, path)
        struct = member.struct
        if struct is None:
            return self._scalar(value, member, in_array=True)
        if isinstance(value, dict):
            if struct.is_time:
                return _renamed_time(value, struct)
            return self._python_fields(value, struct, path)
        if isinstance(value, QtCore.QDateTime) and value.isValid():
            value = value.toMSecsSinceEpoch()
        if struct.is_time and isinstance(value, (int, float)):
            parts = from_milliseconds(value, path)
            return dict(zip((inner.name for inner in struct.members), parts, strict=True))
        names = [inner.name for inner in struct.members]
        if all(callable(getattr(value, name, None)) for name in names):
            return {name: getattr(value, name)() for name in names}
        return value

    def _single(self, value: QJSValue, member: Member, path: str) -> Any:
        if member.struct is not None:
            return self.fields(value, member.struct, path)
        if value.isNumber():
            return self._scalar(value.toNumber(), member, member.is_array)
        if value.isString():
            return self._scalar(value.toString(), member, member.is_array)
        if value.isBool():
            return self._scalar(value.toBool(), member, member.is_array)
        # A url has no properties; objects that have some may have cycles.
        if value.isObject() and not value.isQObject() and not properties_of(value):
            held = value.toVariant()
            if member.number is None and isinstance(held, QtCore.QUrl):
                return held.toString()
        return shown(value)

    def _scalar(self, value: Any, member: Member, in_array: bool) -> Any:
        """Return a number, text or bool for a field, converted if nothing is lost."""
        number = member.number
        if number is None:
            if isinstance(value, QtCore.QUrl):
                return value.toString()
            plain = isinstance(value, (bool, int, float))
            return _text(value) if plain and (self._loose or in_array) else value
        if isinstance(value, str) and number.code in "qQ":
            return wide(value)
        if self._loose and not in_array:
            value = _as_number(value, number.code)
        return integral(value) if number.low is not None else value


def _no_message(value: QJSValue, schema: Schema, path: str) -> ConversionError:
    return ConversionError(path, shown(value), f"an object with {schema.name}'s fields")


def _length(value: QJSValue, path: str) -> int:
    count = value.property("length").toNumber()
    if not 0 <= count <= _LONGEST:
        raise ConversionError(
            path, Shown(f"{count:.0f}"), f"an array of at most {_LONGEST} elements"
        )
    return int(count)


def _list(value: QJSValue, path: str) -> list[Any]:
    _length(value, path)
    items = value.toVariant()
    return items if isinstance(items, list) else []


def _default(member: Member) -> Any:
    if member.struct is not None:
        return {}
    return "" if member.number is None else member.number.python()


def typed_array(value: QJSValue) -> Any:
    """Return a typed array as a numpy array; None for other values."""
    kind = _TYPED.get(value.property("constructor").property("name").toString())
    if kind is None or not value.isObject():
        return None
    np = numpy()
    held = value.property("buffer").toVariant()
    data = bytes(held.data()) if isinstance(held, QtCore.QByteArray) else b""
    count, offset = value.property("length").toInt(), value.property("byteOffset").toInt()
    kind_of = np.dtype(kind)
    # Any object may claim to be one: {constructor: {name: "Int8Array"}}.
    fits = count >= 0 and offset >= 0 and offset + count * kind_of.itemsize <= len(data)
    return np.frombuffer(data[offset:], kind_of, count) if fits else None


def _as_bools(found: Any, number: Number) -> Any:
    """Return bytes as bools: ``buffer()`` of a received array returns bytes."""
    fits = (
        number.code == "?" and found.dtype.kind != "f" and bool(((found == 0) | (found == 1)).all())
    )
    return found.astype(bool) if fits else found


def _buffer(value: QJSValue, member: Member, path: str) -> Any:
    """Return the elements of an ArrayBuffer, as ``buffer()`` of a received array returns it."""
    assert member.number is not None
    held = value.toVariant()
    if not isinstance(held, QtCore.QByteArray):
        raise ConversionError(path, shown(value), f"an array ({member.field.type})")
    data, size = bytes(held.data()), member.number.size
    if size == 1 and member.number.low is not None:
        return data
    if len(data) % size:
        wanted = f"a multiple of {size} bytes ({member.field.type})"
        raise ConversionError(path, Shown(f"an ArrayBuffer of {len(data)} bytes"), wanted)
    np = numpy()
    return _as_bools(np.frombuffer(data, np.dtype(member.number.dtype)), member.number)


def _text(value: float) -> str:
    """Return a number or bool as text in JavaScript's format."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if float(value).is_integer() and abs(value) < 1e21:
        return str(int(value))
    return repr(value).replace("e-0", "e-").replace("e+0", "e+")


def _as_number(value: Any, code: str) -> Any:
    """Convert a text or bool to a number, and a number or text to a bool."""
    if code == "?":
        words = {"true": True, "false": False, "1": True, "0": False, 1: True, 0: False}
        return words.get(value, value) if isinstance(value, (str, int, float)) else value
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, str) and DECIMAL.match(value.strip()):
        if code in "fd":
            return float(value)
        found = number_from_text(value)
        return int(found) if found.denominator == 1 else value
    return value


#: Constructors of JavaScript's objects whose content is not in their properties.
_COLLECTIONS = frozenset({"Map", "Set"})
_BOXES = frozenset({"Boolean", "Number", "String"})
_WITHOUT_CONTENT = frozenset({"DataView", "Promise", "RegExp", "WeakMap", "WeakSet"})
_DEEPEST = 100
#: Maximum number of values read one by one: with shared parts, the count can grow exponentially.
_MOST = 1 << 18
#: Seconds that reading a value may block the interface.
_READ_TIMEOUT_S = 5.0


def plain_from_js(value: QJSValue) -> Any:
    """Return a value as None, bool, int, float, str, list, dict, bytes, QDateTime, Time, Duration.

    QML objects become the properties that their own class declares, item models a list of their
    rows, as dicts by role, a Map a dict, and a Set a list.

    Raises:
        ConversionError: The value is a function, refers to itself, is nested too deeply, has more
            than 2^18 values, or takes more than 5 s to read; received arrays and typed arrays of
            numbers count as one.
    """
    return _Reader().read(value, "", 0)


def _number(number: float | str) -> float | str:
    # Integers beyond the range of JavaScript's numbers are passed as text.
    return integral(number) if not isinstance(number, str) and abs(number) < 2**53 else number


class _Reader:
    """Converts one value recursively."""

    def __init__(self) -> None:
        self._left = _MOST
        self._deadline = time.monotonic() + _READ_TIMEOUT_S

    def read(self, value: QJSValue, path: str, depth: int) -> Any:
        """Return a value converted to Python; `path` is its location, for errors."""
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
            expected = f"at most {_MOST} values in all; numbers in a typed array count as one"
            raise ConversionError(path, Shown(f"{length:.0f} elements"), expected)
        return [
            self.read(value.property(index), f"{path}[{index}]", depth + 1)
            for index in range(int(length))
        ]

    def _object(self, value: QJSValue, path: str, depth: int) -> Any:
        # The content of these is not in their properties.
        own = value.hasOwnProperty("constructor")
        constructor = "" if own else value.property("constructor").property("name").toString()
        if constructor in _COLLECTIONS and value.property("entries").isCallable():
            return self._collection(value, constructor, path, depth)
        if constructor in _BOXES:
            return self.read(value.property("valueOf").callWithInstance(value), path, depth + 1)
        if constructor in _WITHOUT_CONTENT:
            raise ConversionError(path, Shown(f"a {constructor}"), "a value")
        names = properties_of(value)
        if not names and value.toString() != "[object Object]":
            return self._python(value.toVariant(), path, depth)
        found = (name for name in names if name != "#messageType")
        return {name: self._inner(value, name, path, depth) for name in found}

    def _collection(self, value: QJSValue, constructor: str, path: str, depth: int) -> Any:
        """Return a Map as a dict, whose keys become texts as those of objects, a Set as a list."""
        iterator = value.property("entries").callWithInstance(value)
        found: dict[str, Any] = {}
        items: list[Any] = []
        while True:
            step = iterator.property("next").callWithInstance(iterator)
            if step.isError() or not step.isObject() or step.property("done").toBool():
                break
            key, inner = (step.property("value").property(at) for at in (0, 1))
            if constructor == "Set":
                items.append(self.read(inner, f"{path}[{len(items)}]", depth + 1))
                continue
            name = key.toString()
            here = f"{path}.{name}" if path else name
            if key.isObject() or name in found:
                wanted = "keys that differ as texts" if name in found else "texts as keys of a Map"
                raise ConversionError(here, shown(key), wanted)
            found[name] = self.read(inner, here, depth + 1)
        return items if constructor == "Set" else found

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
        """Return a value that Qt has already converted to Python."""
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

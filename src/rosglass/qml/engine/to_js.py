"""Conversion of messages for QML: short values become JSON, long arrays stay in Python.

Arrays longer than :data:`INLINE` stay in Python; JavaScript fetches their elements on access.
"""

from __future__ import annotations

import json
import math
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.errors import Error
from rosglass.qml.engine.dialect import Dialect
from rosglass.qt import QJSValue, QtCore, QtQml, Slot, is_valid

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.interfaces import Definition
    from rosglass.messages import Message
    from rosglass.messages.schema import Member, Schema
    from rosglass.qml.engine.runtime import Runtime

__all__ = [
    "INLINE",
    "LongArray",
    "LongArrays",
    "MessageConverter",
    "Shape",
    "constants_of",
    "describe",
    "exact",
    "is_duration",
    "milliseconds",
    "reader",
    "to_json",
]

#: Longer arrays of numbers, texts or messages are fetched on access.
INLINE = {"number": 64, "text": 32, "message": 16}
_EXACT = 1 << 53
#: Bytes of long arrays passed to JavaScript after which its garbage collector is called: it does
#: not see how much memory its small objects hold in Python.
_GARBAGE = 64 << 20
_HEADER = "std_msgs/msg/Header"

#: A long array: its member and its values.
LongArray = tuple["Member", Any]
if TYPE_CHECKING:
    #: Returns a message's short values, and appends its long arrays.
    MessageReader = Callable[[Message, list[LongArray]], dict[str, Any]]


def exact(value: int) -> int | str:
    """Return an integer for JavaScript, as decimal text from 2^53 on."""
    return value if -_EXACT < value < _EXACT else str(value)


def reader(schema: Schema, dialect: Dialect = Dialect.ROS2) -> MessageReader:
    """Return a function that reads a message's short values and collects its long arrays."""
    made: MessageReader = schema.cached(
        ("qml reader", dialect), lambda: _make_reader(schema, dialect)
    )
    return made


def _make_reader(schema: Schema, dialect: Dialect) -> MessageReader:
    members = schema.members
    if not members:
        return lambda message, arrays: {}  # noqa: ARG005 - the signature is shared
    names = _names(schema, dialect)
    get = attrgetter(*(member.attr for member in members))
    fixes = [
        (name, fix)
        for name, member in zip(names, members, strict=True)
        if (fix := _fix(member, dialect)) is not None
    ]
    single = len(members) == 1

    def read(message: Message, arrays: list[LongArray]) -> dict[str, Any]:
        values = (get(message),) if single else get(message)
        out = dict(zip(names, values, strict=True))
        for name, fix in fixes:
            out[name] = fix(out[name], arrays)
        return out

    return read


def _names(schema: Schema, dialect: Dialect) -> list[str]:
    """Return the names of the fields in the module."""
    if schema.is_time:
        return list(dialect.time_fields)
    renamed = dialect.names(schema)
    return [renamed.get(member.name, member.name) for member in schema.members]


def is_duration(schema: Schema) -> bool:
    """Return whether a type is a duration."""
    return schema.is_time and schema.name.endswith("uration")


def milliseconds(duration: Message) -> float:
    """Return a duration in milliseconds, its form in ``Ros 1.0``."""
    (first, second) = (getattr(duration, member.attr) for member in duration._schema__.members)
    return float(first * 1000 + second / 1_000_000)


def _is_number(member: Member, dialect: Dialect) -> bool:
    """Return whether a field is a duration that becomes a number."""
    return dialect is Dialect.ROS1 and member.struct is not None and is_duration(member.struct)


def _fix(member: Member, dialect: Dialect) -> Callable[[Any, list[LongArray]], Any] | None:
    """Return a conversion for a member's values; None if they need none."""
    if member.is_array:
        return _array_fix(member, dialect)
    if _is_number(member, dialect):
        return lambda value, arrays: milliseconds(value)  # noqa: ARG005
    if member.struct is not None:
        return reader(member.struct, dialect)
    if _is_wide(member):
        return lambda value, arrays: exact(int(value))  # noqa: ARG005
    return None


def _is_wide(member: Member) -> bool:
    return member.number is not None and member.number.code in "qQ"


def _array_fix(member: Member, dialect: Dialect) -> Callable[[Any, list[LongArray]], Any]:
    limit = 0 if _is_wide(member) else INLINE[member.kind.value]
    boolean = member.number is not None and member.number.code == "?"
    element: Callable[[Any, list[LongArray]], Any] | None = None
    if _is_number(member, dialect):
        element = lambda value, arrays: milliseconds(value)  # noqa: E731, ARG005
    elif member.struct is not None:
        element = reader(member.struct, dialect)

    def fix(values: Any, arrays: list[LongArray]) -> Any:
        count = len(values)
        if count > limit or (count and not limit):
            arrays.append((member, values))
            return {"#at": len(arrays) - 1, "length": count}
        if element is not None:
            return [element(value, arrays) for value in values]
        listed = values.tolist() if hasattr(values, "tolist") else list(values)
        return [bool(value) for value in listed] if boolean else listed

    return fix


class Shape(NamedTuple):
    """The description of a type for JavaScript.

    Attributes:
        name: The type's name.
        time: Which time or duration methods its values have (see ``times.js``); empty for none.
        constants: Its constants.
        fields: Arrays and nested messages: field name, type of the array's elements (empty for a
            nested message), schema of the nested message.
    """

    name: str
    time: str
    constants: dict[str, Any]
    fields: list[tuple[str, str, Schema | None]]


def describe(schema: Schema, dialect: Dialect = Dialect.ROS2) -> Shape:
    """Return the description of a type for JavaScript."""
    constants = constants_of(schema.definition)
    if dialect is Dialect.ROS1 and schema.name == _HEADER and "seq" not in schema.by_name:
        # ROS 1 interfaces may show it; ROS 2 headers have no counter.
        constants["seq"] = 0
    time = ""
    if schema.is_time:
        time = f"{'duration' if is_duration(schema) else 'time'}{dialect.ros}"
    fields = []
    for name, member in zip(_names(schema, dialect), schema.members, strict=True):
        number = _is_number(member, dialect)
        if member.is_array:
            kind = member.number.name if member.number is not None else member.kind.value
            fields.append((name, "duration", None) if number else (name, kind, member.struct))
        elif member.struct is not None and not number:
            fields.append((name, "", member.struct))
    return Shape(dialect.type_name(schema.name), time, constants, fields)


def constants_of(definition: Definition) -> dict[str, Any]:
    """Return a message's constants for JavaScript."""
    return {
        constant.name: exact(constant.value) if type(constant.value) is int else constant.value
        for constant in definition.constants
    }


def to_json(value: Any) -> tuple[str, bool]:
    """Return JSON, and whether it contains NaN or infinities, written as ``{"#": name}``."""
    try:
        return json.dumps(value, allow_nan=False), False
    except ValueError:
        return json.dumps(_mark(value), allow_nan=False), True


def _mark(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        name = "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
        return {"#": name}
    if isinstance(value, dict):
        return {key: _mark(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_mark(inner) for inner in value]
    return value


class MessageConverter:
    """Converts messages for the QML of one engine.

    Args:
        runtime: The engine's runtime.
        engine: The engine.
    """

    def __init__(self, runtime: Runtime, engine: QtQml.QQmlEngine) -> None:
        self._runtime, self._engine = runtime, engine
        self._formats: dict[tuple[Schema, Dialect], tuple[MessageReader, QJSValue]] = {}
        self._debt = 0

    def convert(self, message: Message, dialect: Dialect = Dialect.ROS2) -> QJSValue:
        """Return a message as a JavaScript value, in the style of a module.

        Undefined if the engine no longer exists.

        Raises:
            DecodeError: The received bytes are malformed.
        """
        runtime, engine, schema = self._runtime, self._engine, message._schema__
        if not is_valid(engine):
            return QJSValue()
        arrays: list[LongArray] = []
        read, shape = self._formats.get((schema, dialect)) or self._format(schema, dialect)
        text, marked = to_json(read(message, arrays))
        source = QJSValue()
        if arrays:
            source = engine.newQObject(runtime.keep(LongArrays(runtime, arrays, dialect)))
            self._charge(arrays)
        build = "buildWithNan" if marked else "build"
        result: QJSValue = runtime.helpers[build].call([QJSValue(text), shape, source])
        return runtime.checked(build, result) if result.isError() else result

    def _format(self, schema: Schema, dialect: Dialect) -> tuple[MessageReader, QJSValue]:
        """Return a type's reader, and its shape for JavaScript."""
        made = self._formats.get((schema, dialect))
        if made is None:
            runtime, found = self._runtime, describe(schema, dialect)
            fields = self._engine.newArray(len(found.fields))
            for index, (name, kind, inner) in enumerate(found.fields):
                field = runtime.value([name, kind, 0])
                if inner is not None:
                    field.setProperty(2, self._format(inner, dialect)[1])
                fields.setProperty(index, field)
            number = runtime.value(runtime.host.know(schema, dialect))
            head = [QJSValue(found.name), QJSValue(found.time), fields]
            shape = runtime.call_helper("shape", [*head, runtime.value(found.constants), number])
            made = self._formats[schema, dialect] = reader(schema, dialect), shape
        return made

    def _charge(self, arrays: list[LongArray]) -> None:
        self._debt += sum(getattr(values, "nbytes", 0) for _, values in arrays)
        if self._debt > _GARBAGE:
            self._debt = 0
            self._runtime.session.executor.post(self._collect)

    def _collect(self) -> None:
        if is_valid(self._engine):
            self._engine.collectGarbage()


class LongArrays(QtCore.QObject):
    """The long arrays of one message; exists while JavaScript refers to one of them."""

    def __init__(self, runtime: Runtime, arrays: list[LongArray], dialect: Dialect) -> None:
        super().__init__()
        self._runtime, self.arrays, self._dialect = runtime, arrays, dialect

    @Slot(int, int, result=QJSValue)
    def at(self, index: int, place: int) -> QJSValue:
        """Return one element of an array."""
        if not 0 <= index < len(self.arrays) or not 0 <= place < len(self.arrays[index][1]):
            return QJSValue()
        member, values = self.arrays[index]
        try:
            value = values[place]
            if member.struct is not None:
                if self._dialect is Dialect.ROS1 and is_duration(member.struct):
                    return self._runtime.value(milliseconds(value))
                return self._runtime.message(value, self._dialect)
        except Error as error:
            self._runtime.throw(str(error))
            return QJSValue()
        if member.number is None:
            return QJSValue(str(value))
        if member.number.code == "?":
            return self._runtime.value(bool(value))
        whole = exact(int(value)) if member.number.low is not None else float(value)
        return self._runtime.value(whole)

    @Slot(int, result="QVariant")
    def buffer(self, index: int) -> QtCore.QByteArray | None:
        """Return a numeric array's bytes in native byte order; None for other arrays."""
        if not 0 <= index < len(self.arrays):
            return None
        member, values = self.arrays[index]
        if member.number is None:
            return None
        native = values.astype(values.dtype.newbyteorder("="), copy=False)
        return QtCore.QByteArray(native.tobytes())

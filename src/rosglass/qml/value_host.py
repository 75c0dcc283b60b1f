"""What JavaScript asks Python for: long arrays, arithmetic beyond doubles, near names."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm.names import similar
from rosglass.errors import ConversionError, Error
from rosglass.qml.dialect import Dialect
from rosglass.qml.from_js import elements_from_js
from rosglass.qml.log import explain, log_from_qml
from rosglass.qml.times import number_from_text
from rosglass.qml.to_js import exact, is_duration, milliseconds
from rosglass.qt import QJSValue, QtCore, Slot

if TYPE_CHECKING:
    from rosglass.messages.schema import Schema
    from rosglass.qml.runtime import Runtime
    from rosglass.qml.to_js import LongArray

__all__ = ["Host", "LongArrays"]

_NS = 1_000_000_000
#: Nanoseconds of as many seconds as a double counts exactly.
_LONGEST = 2**53 * _NS


class LongArrays(QtCore.QObject):
    """The long arrays of one message; lives as long as JavaScript holds one of them."""

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
        """Return a numeric array's bytes in this machine's byte order, otherwise None."""
        if not 0 <= index < len(self.arrays):
            return None
        member, values = self.arrays[index]
        if member.number is None:
            return None
        native = values.astype(values.dtype.newbyteorder("="), copy=False)
        return QtCore.QByteArray(native.tobytes())


class Host(QtCore.QObject):
    """Serves the scripts of one engine.

    Args:
        runtime: The engine's; also its parent, so that JavaScript does not collect it.
    """

    def __init__(self, runtime: Runtime) -> None:
        super().__init__(runtime)
        self._runtime = runtime
        self._types: list[tuple[Schema, Dialect]] = []
        #: Places and names of which was said that no such field is there.
        self.named: set[tuple[str, int, str]] = set()

    @Slot(str, str, "QStringList")
    def missing(self, type: str, name: str, known: list[str]) -> None:
        """Say that QML reads a field that a message does not have, once for each place.

        A name that is like none of the message's may be read to find out whether it is there, so
        that is no warning; an error that follows from it is explained.
        """
        caller = self._runtime.caller()
        if not caller.line:
            return  # Python reads it
        hint = similar(name, known)
        text = f"{type} has no field {name!r:.80}{hint or '; it has ' + ', '.join(known[:20])}"
        explain(caller, text)
        place = (caller.file, caller.line, name)
        if place not in self.named:
            self.named.add(place)
            level, end = (logging.WARNING, "") if hint else (logging.INFO, ".")
            log_from_qml("", level, f"{text}{end} It is undefined here.", caller)

    def know(self, schema: Schema, dialect: Dialect) -> int:
        """Return the number by which scripts ask for a type."""
        self._types.append((schema, dialect))
        return len(self._types) - 1

    @Slot(int, result=QJSValue)
    def empty(self, number: int) -> QJSValue:
        """Return a message of a type with every field at its default."""
        if not 0 <= number < len(self._types):
            return QJSValue()
        schema, dialect = self._types[number]
        return self._runtime.message(schema.type.create(), dialect)

    @Slot(float, float, float, result=QJSValue)
    def multiply(self, sec: float, nanosec: float, factor: float) -> QJSValue:
        """Return a duration times a number, rounded to the nanosecond, as two parts."""
        from fractions import Fraction  # noqa: PLC0415 - takes milliseconds at start-up

        total = round(Fraction(factor) * (int(sec) * _NS + int(nanosec)))
        return self._runtime.value(list(divmod(total, _NS)))

    @Slot(str, int, result=QJSValue)
    def parts(self, text: str, digits: int) -> QJSValue:
        """Return the seconds and nanoseconds of a decimal number.

        Args:
            text: The number.
            digits: What it counts, as a power of ten: 0 for seconds, 9 for nanoseconds.
        """
        try:
            found = number_from_text(text) * _NS / 10**digits
            if abs(found) > _LONGEST:
                raise ConversionError("", text, "a time that JavaScript can hold")
        except Error as error:
            self._runtime.throw(str(error))
            return QJSValue()
        return self._runtime.value(list(divmod(round(found), _NS)))

    @Slot(str, QJSValue, result="QVariant")
    def pack(self, kind: str, values: QJSValue) -> QtCore.QByteArray | None:
        """Return 64-bit integers, given as numbers or decimal text, as bytes."""
        import numpy as np  # noqa: PLC0415 - few programs ask for them

        try:
            whole: list[Any] = elements_from_js(values, kind)
            packed = np.array(whole, np.dtype(kind)).tobytes()
        except (Error, OverflowError, TypeError, ValueError) as error:
            self._runtime.throw(f"these are no {kind}: {error}")
            return None
        return QtCore.QByteArray(packed)

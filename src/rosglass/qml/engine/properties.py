"""Declarations of QML properties: type, default, check and notify signal in one line.

A class body says ``rate = Writable(float, 10.0, within(0, 1000, "per second"))`` or
``age = ReadOnly(float, -1.0)``. Each becomes a Qt property with the notify signal ``rateChanged``
or ``ageChanged``, unless the class has declared that signal already.
"""

from __future__ import annotations

import math
from operator import attrgetter, methodcaller
from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

from rosglass.errors import Error
from rosglass.qt import Property, QJSValue, QtCore, Signal, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = [
    "ReadOnly",
    "Writable",
    "at_least",
    "changed_enough",
    "function",
    "one_of",
    "report",
    "within",
]

_T = TypeVar("_T")


class _Declaration(Generic[_T]):
    """A declaration in a class body; replaced by a Qt property when the class is created."""

    def __init__(self, kind: Any, notify: str) -> None:
        self._kind, self._notify = kind, notify

    def _define(
        self,
        owner: type[Any],
        name: str,
        read: Callable[[Any], Any],
        write: Callable[[Any, Any], None] | None = None,
    ) -> None:
        signal_name = self._notify or f"{name}Changed"
        bodies = (vars(base) for base in owner.__mro__)
        signal = next((body[signal_name] for body in bodies if signal_name in body), None)
        if signal is None:
            signal = Signal()
            setattr(owner, signal_name, signal)
        setattr(owner, name, Property(self._kind, read, write, notify=signal))

    if TYPE_CHECKING:

        @overload
        def __get__(self, item: None, owner: type[Any]) -> Any: ...
        @overload
        def __get__(self, item: Any, owner: type[Any]) -> _T: ...
        def __get__(self, item: Any, owner: type[Any]) -> Any: ...


class Writable(_Declaration[_T]):
    """A property that QML can set.

    A new value is stored in ``_NAME``, the signal emitted, and the element's update scheduled.

    Args:
        kind: The Qt type.
        default: Its value until it is set.
        accept: Returns the value to store. Raises ValueError with the fault ("is negative"), or
            Error with the whole message; either is logged with the QML line.
        then: Method to call after a change; empty for none.
        notify: Name of the notify signal; empty for ``NAMEChanged``.
        unit: Unit in error messages.
        read: Getter, or the name of a method; by default, the stored value is returned.
        write: Name of a method that replaces all this.
    """

    def __init__(
        self,
        kind: type[_T],
        default: Any = None,
        accept: Callable[[Any], Any] | None = None,
        *,
        then: str = "_schedule",
        notify: str = "",
        unit: str = "",
        read: Callable[[Any], Any] | str = "",
        write: str = "",
    ) -> None:
        super().__init__(kind, notify)
        self._default, self._accept, self._then = default, accept, then
        self._unit, self._write = unit, write
        self._read = methodcaller(read) if isinstance(read, str) and read else read

    def __set_name__(self, owner: type[Any], name: str) -> None:
        attribute, accept, then, unit = f"_{name}", self._accept, self._then, self._unit
        signal_name = self._notify or f"{name}Changed"
        is_script = self._kind is QJSValue

        def write(item: Any, value: Any) -> None:
            if is_script and value is None:
                value = QJSValue()  # null and undefined, in some versions of PySide
            try:
                new = value if accept is None else accept(value)
            except Error as error:
                item._refuse(f"{item.label}: {error}")
                return
            except ValueError as error:
                item._refuse(f"{item.label}: {name} {_shown(value, unit)}{error}")
                return
            if not isinstance(new, QJSValue) and new == getattr(item, attribute):
                return
            setattr(item, attribute, new)
            getattr(item, signal_name).emit()
            if then:
                getattr(item, then)()

        def call(item: Any, value: Any) -> None:
            getattr(item, self._write)(value)

        if not self._write:
            default = QJSValue() if is_script and self._default is None else self._default
            setattr(owner, attribute, default)
        read: Any = self._read or attrgetter(attribute)
        self._define(owner, name, read, call if self._write else write)

    if TYPE_CHECKING:

        def __set__(self, item: Any, value: Any) -> None: ...


class ReadOnly(_Declaration[_T]):
    """A property that QML can only read; Python changes it with :func:`report`.

    Args:
        kind: The Qt type.
        default: Its value until :func:`report` sets one.
        read: Getter, or the name of a method, instead of the stored value; the class then emits
            the notify signal itself.
        notify: Name of the notify signal; empty for ``NAMEChanged``.
        tolerance: Relative change up to which the signal is not emitted.
    """

    def __init__(
        self,
        kind: type[_T],
        default: Any = None,
        *,
        read: Callable[[Any], _T] | str = "",
        notify: str = "",
        tolerance: float = 0.0,
    ) -> None:
        super().__init__(kind, notify)
        self._default, self._tolerance = default, tolerance
        self._read = methodcaller(read) if isinstance(read, str) and read else read

    def __set_name__(self, owner: type[Any], name: str) -> None:
        if not self._read:
            setattr(owner, f"_{name}", self._default)
            rule = (self._notify or f"{name}Changed", self._tolerance)
            owner._reported = {**getattr(owner, "_reported", {}), name: rule}
        read: Any = self._read or attrgetter(f"_{name}")
        self._define(owner, name, read)


def report(item: QtCore.QObject, **values: object) -> bool:
    """Store new values of read-only properties, then emit the signals of changed ones.

    Handlers see all new values. If a handler destroys the object, no more signals are emitted; if
    it changes a value, the remaining handlers see the changed value.

    Returns:
        Whether the object is still alive.
    """
    signals: dict[str, None] = {}
    for name, value in values.items():
        signal, tolerance = item._reported[name]  # type: ignore[attr-defined]
        before = getattr(item, f"_{name}")
        changed = changed_enough(before, value, tolerance) if tolerance else value != before
        if changed:
            setattr(item, f"_{name}", value)
            signals[signal] = None
    for signal in signals:
        if not is_alive(item):
            return False
        getattr(item, signal).emit()
    return is_alive(item)


def changed_enough(before: float, after: Any, tolerance: float = 0.01) -> bool:
    """Return whether a rate changed by more than a fraction of itself, or from or to zero."""
    return bool(abs(after - before) > tolerance * abs(before) or (after == 0) != (before == 0))


# -- checks --------------------------------------------------------------------------------------


def at_least(least: int) -> Callable[[int], int]:
    """Return a check for integers of at least `least`."""

    def check(value: int) -> int:
        if value < least:
            raise ValueError("is negative" if least == 0 else f"is less than {least}")
        return value

    return check


def within(low: float, high: float, unit: str = "") -> Callable[[Any], Any]:
    """Return a check for numbers from `low` to `high`; NaN is refused."""

    def check(value: Any) -> Any:
        if not low <= value <= high:
            raise ValueError(f"is not from {low:.9g} to {high:.9g} {unit}".rstrip())
        return value

    return check


def one_of(*choices: str) -> Callable[[str], str]:
    """Return a check for one of several texts."""

    def check(value: str) -> str:
        if value not in choices:
            raise ValueError(f"is not one of {', '.join(choices)}")
        return value

    return check


def function(value: QJSValue) -> QJSValue:
    """Accept a JavaScript function, null or undefined."""
    if not (value.isCallable() or value.isNull() or value.isUndefined()):
        raise ValueError("is not a function")
    return value


def _shown(value: Any, unit: str) -> str:
    """Return a refused value as error messages show it, with a space after it."""
    if isinstance(value, (QJSValue, QtCore.QObject)) or value is None:
        return ""
    if isinstance(value, QtCore.QSize):
        text = f"{value.width()}x{value.height()}"
    elif isinstance(value, QtCore.QRectF):
        text = str((value.x(), value.y(), value.width(), value.height()))
    elif isinstance(value, float):
        text = f"{value:g}" if math.isfinite(value) else str(value)
    else:
        text = repr(value)
    return f"{text} {unit} " if unit else f"{text} "

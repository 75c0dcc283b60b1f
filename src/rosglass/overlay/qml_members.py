"""Declarations of the properties and slots by which QML over RViz sees Python objects.

Also reports misspelled members: Qt silently lets JavaScript assign a member that an object does not
have, and reads it as undefined.
"""

from __future__ import annotations

import contextlib
import logging
import re
from functools import wraps
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.overlay.property_values import shown
from rosglass.qml.engine.from_js import plain_from_js
from rosglass.qml.engine.js_values import object_of
from rosglass.qml.engine.log import log_from_qml
from rosglass.qt import Property, QJSValue, QtCore, QtGui, QtQml, Signal, Slot

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.overlay.plugins import PluginList
    from rosglass.qml.engine.runtime import Runtime

__all__ = [
    "LIST",
    "VARIANT",
    "QmlWrapper",
    "QmlWrappers",
    "boolean",
    "errors_to_js",
    "forward",
    "member",
    "options",
    "point",
    "point_of",
    "property_path",
    "slot",
    "spell_checked",
    "text",
    "to_python",
    "unchecked",
]

#: Type of a property that accepts any value in Qt, and validates it in Python.
VARIANT: Any = "QVariant"
#: Type of list properties; with a list of strings, Qt would append to the old value.
LIST: Any = "QVariantList"
_OWNERSHIP: Any = QtQml.QQmlEngine.ObjectOwnership


class QmlWrapper(QtCore.QObject):
    """The QML object that wraps a Python object, its `model`."""

    #: Name in error messages.
    CALLED: ClassVar[str] = "object"

    def __init__(self, model: Any, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self.model, self.runtime = model, runtime
        QtQml.QQmlEngine.setObjectOwnership(self, _OWNERSHIP.CppOwnership)
        self._held: QJSValue | None = spell_checked(runtime, self)

    def release(self) -> None:
        """Transfer ownership to JavaScript, which may use it longer than the model exists."""
        self.setParent(None)
        self.runtime.keep(self)
        # JavaScript collects only objects that it has a wrapper of.
        self._held = None


class QmlWrappers(QtCore.QObject):
    """The QML objects of all tools or all displays, created on demand by the class `kind`."""

    #: The list of items has changed.
    changed = Signal()
    added = Signal(QtCore.QObject)
    removed = Signal(QtCore.QObject)

    def __init__(
        self, items: PluginList, kind: type[QmlWrapper], runtime: Runtime, parent: QtCore.QObject
    ) -> None:
        super().__init__(parent)
        self._items, self._kind, self._runtime = items, kind, runtime
        self._wrappers: dict[Any, Any] = {}
        items.added.connect(self._on_added)
        items.removed.connect(self._on_removed)
        items.changed.connect(self._on_changed)

    def of(self, item: Any) -> Any:
        """Return the QML object of an item; None for None."""
        if item is None:
            return None
        if item not in self._wrappers:
            self._wrappers[item] = self._kind(item, self._runtime, self)
        return self._wrappers[item]

    def all(self) -> list[Any]:
        """Return the QML objects of all items, in RViz's order."""
        return [self.of(item) for item in self._items.all]

    def known(self) -> list[Any]:
        """Return the QML objects created so far."""
        return list(self._wrappers.values())

    @Slot(object)
    def _on_added(self, item: Any) -> None:
        self.changed.emit()
        self.added.emit(self.of(item))

    @Slot(object)
    def _on_removed(self, item: Any) -> None:
        wrapper = self.of(item)
        del self._wrappers[item]
        wrapper.release()
        self.changed.emit()
        wrapper.existsChanged.emit()
        wrapper.changed.emit()
        self.removed.emit(wrapper)

    @Slot(object)
    def _on_changed(self, item: Any) -> None:
        if item in self._wrappers:
            self._wrappers[item].changed.emit()


# Declarations, for classes with the attributes `CALLED` and `runtime`.


def member(
    name: str,
    kind: Any,
    notify: Any = None,
    *,
    path: str = "",
    from_qml: Callable[[Any], Any] | None = None,
    setter: Callable[[Any, Any], object] | None = None,
    to_qml: Callable[[Any], Any] | None = None,
    on_error: Any = None,
) -> Any:
    """Return a QML property that reads and writes a Python attribute.

    Args:
        name: Its name in QML.
        kind: Its type in Qt; :data:`VARIANT` if `from_qml` validates values.
        notify: Its change signal; None for a constant property.
        path: Path of the attribute, relative to the QML object; by default ``model.`` and the name
            in snake case.
        from_qml: Converter of new values; None for a read-only property.
        setter: Called with the QML object and the new value, instead of setting the attribute.
        to_qml: Converter of the attribute's value, applied before the one to `kind`.
        on_error: Its value if reading the attribute raises an Error, which is thrown into
            JavaScript.
    """
    path = path or f"model.{_snake_case(name)}"
    get, (owner, _, attribute) = attrgetter(path), path.rpartition(".")

    def read(self: Any) -> Any:
        try:
            value = get(self)
        except Error as error:
            self.runtime.throw(f"{self.CALLED}.{name}: {error}")
            return on_error
        value = value if to_qml is None else to_qml(value)
        return _to_js(self.runtime, value) if kind is QJSValue else value

    def write(self: Any, value: Any) -> None:
        assert from_qml is not None
        try:
            wanted = from_qml(to_python(value))
            if setter is None:
                setattr(attrgetter(owner)(self), attribute, wanted)
            else:
                setter(self, wanted)
        except Error as error:
            self.runtime.throw(f"{self.CALLED}.{name}: {error}")

    more: dict[str, Any] = {"constant": True} if notify is None else {"notify": notify}
    if from_qml is not None:
        more["fset"] = write
    return Property(kind, read, **more)


def slot(optional: int = 0, /, **converters: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a decorator that makes a method callable from QML, and throws its Errors there.

    QML gets null for None, an object for a QObject, and undefined from a method that is annotated
    to return None.

    Args:
        optional: Number of optional parameters, at the end.
        converters: Converter of each argument, by the parameter's name in QML.
    """
    names = list(converters)
    least = len(names) - optional
    rest = "".join(
        f"[, {name}" if at else f"[{name}" for at, name in enumerate(names) if at >= least
    )
    usage = ", ".join(names[:least]) + rest + "]" * optional

    def decorate(function: Any) -> Any:
        name = function.__name__
        gives_nothing = function.__annotations__.get("return") == "None"

        @wraps(function)
        def call(self: Any, *arguments: Any) -> Any:
            runtime, answer = self.runtime, None
            missing = " and ".join(names[len(arguments) : least])
            if missing:
                runtime.throw(f"{self.CALLED}.{name}({usage}): {missing} must be given")
                return None if gives_nothing else QJSValue()
            try:
                values = [to_python(argument) for argument in arguments]
                while len(values) > least and values[-1] is None:
                    values.pop()
                given = [
                    None if value is None and at >= least else convert(value)
                    for at, (convert, value) in enumerate(
                        zip(converters.values(), values, strict=False)
                    )
                ]
                answer = function(self, *given)
            except Error as error:
                runtime.throw(f"{self.CALLED}.{name}: {error}")
                return None if gives_nothing else QJSValue()
            return None if gives_nothing else _to_js(runtime, answer)

        result: dict[str, Any] = {} if gives_nothing else {"result": QJSValue}
        for count in range(len(names) + 1):
            call = Slot(*[QJSValue] * count, **result)(call)
        return call

    return decorate


def forward(
    name: str, optional: int = 0, to: str = "", /, **converters: Callable[[Any], Any]
) -> Any:
    """Return a slot that passes its arguments to a method, and returns nothing.

    Args:
        name: Its name in QML.
        optional: See :func:`slot`.
        to: Path of the method, relative to the QML object; by default ``model.`` and the name in
            snake case.
        converters: See :func:`slot`; :func:`options` become keyword arguments of the method.
    """
    get = attrgetter(to or f"model.{_snake_case(name)}")

    def call(self: Any, *arguments: Any) -> None:
        named: dict[str, Any] = {}
        if arguments and isinstance(arguments[-1], _Keywords):
            *arguments, named = arguments  # type: ignore[assignment]
        get(self)(*arguments, **named)

    call.__name__ = name
    return slot(optional, **converters)(call)


def _snake_case(name: str) -> str:
    """Return a QML name in snake case."""
    return re.sub(r"(?<=[a-z])(?=[A-Z0-9])", "_", name).lower()


def _to_js(runtime: Runtime, value: Any) -> QJSValue:
    engine = runtime.engine
    if isinstance(value, QJSValue):
        return value
    if value is None or engine is None:
        return QJSValue(QJSValue.SpecialValue.NullValue)
    return engine.newQObject(value) if isinstance(value, QtCore.QObject) else runtime.value(value)


@contextlib.contextmanager
def errors_to_js(runtime: Runtime | None, what: str, *given: Any) -> Iterator[None]:
    """Throw errors into the calling JavaScript; raise them if Python is the caller.

    Args:
        runtime: The QML engine's runtime; None without an engine.
        what: The called function or the property, for the error.
        given: The arguments.
    """
    try:
        yield
    except Error as error:
        # The engine no longer knows its caller after a JavaScript getter has thrown.
        sure = any(isinstance(value, QJSValue) for value in given)
        if runtime is None or not (sure or runtime.caller().file != "<python>"):
            raise Error(f"{what}: {error}") from error
        runtime.throw(f"{what}: {error}")


# Converters.


def to_python(value: Any) -> Any:
    """Return a JavaScript value as plain values, colours, dicts for vectors, or QObjects.

    Raises:
        ConversionError: It is a function, refers to itself, or is too large.
    """
    if not isinstance(value, QJSValue):
        return value
    if value.isQObject():
        return object_of(value)
    found = plain_from_js(value)
    names = set(found) if isinstance(found, dict) else set()
    if names == {"scalar", "x", "y", "z"}:
        return {"x": found["x"], "y": found["y"], "z": found["z"], "w": found["scalar"]}
    if {"r", "g", "b", "a", "hsvHue"} <= names:
        return QtGui.QColor.fromRgbF(*(found[name] for name in "rgba"))
    return found


def unchecked(value: Any) -> Any:
    """Return a value unchanged: the called method validates it."""
    return value


def _of_kind(kind: type, wanted: str, parameter: str) -> Callable[[Any], Any]:
    # Qt itself would convert any value.
    def take(value: Any) -> Any:
        if not isinstance(value, kind):
            prefix = f"{parameter}: " if parameter else ""
            raise Error(f"{prefix}expected {wanted}, got {shown(value)}")
        return value

    return take


def text(wanted: str = "a text", parameter: str = "") -> Callable[[Any], str]:
    """Return a converter for strings.

    Args:
        wanted: Description of a valid value, for the error.
        parameter: Name of the parameter, for the error.
    """
    return _of_kind(str, wanted, parameter)


def boolean(parameter: str = "") -> Callable[[Any], bool]:
    """Return a converter for booleans; see :func:`text`."""
    return _of_kind(bool, "true or false", parameter)


def point(parameter: str = "") -> Callable[[Any], tuple[float, float, float]]:
    """Return a converter for points; see :func:`point_of` and :func:`text`."""
    return lambda value: point_of(value, parameter)


def point_of(value: Any, parameter: str = "") -> tuple[float, float, float]:
    """Return a point given as a vector, an object with x, y and z, or a list of three numbers.

    Raises:
        Error: It is not a point, or its numbers are not finite.
    """
    parts = list(value) if isinstance(value, (list, tuple)) else []
    if isinstance(value, dict) and {"x", "y", "z"} <= set(value):
        parts = [value["x"], value["y"], value["z"]]
    fits = len(parts) == 3 and all(
        isinstance(part, (int, float)) and not isinstance(part, bool) and abs(part) < 1e30
        for part in parts
    )
    if not fits:
        raise Error(
            f"{parameter}{': ' if parameter else ''}expected x, y and z in metres, "
            f"e.g. Qt.vector3d(1, 2, 0), got {shown(value)}"
        )
    return float(parts[0]), float(parts[1]), float(parts[2])


def property_path(example: str) -> Callable[[Any], str | list[str]]:
    """Return a converter for the path of a property, a string or a list of names.

    Args:
        example: A valid path, for the error.
    """

    def take(value: Any) -> str | list[str]:
        names = value if isinstance(value, list) else [value]
        if not names or not all(isinstance(name, str) for name in names):
            raise Error(f"expected the path of a property, e.g. {example!r}, got {shown(value)}")
        return value  # type: ignore[no-any-return]

    return take


class _Keywords(dict[str, Any]):
    """Options, marked to become keyword arguments."""


def options(**kinds: type) -> Callable[[Any], dict[str, Any]]:
    """Return a converter for an object with options, which :func:`forward` turns into keywords.

    Args:
        kinds: The type of each option, `str` or `bool`.
    """
    known = ", ".join(kinds)

    def take(value: Any) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise Error(f"options: expected {{{known}}}, got {shown(value)}")
        found = _Keywords()
        for name, given in value.items():
            if name not in kinds:
                raise Error(f"there is no option {shown(name)}; there are {known}")
            kind = text if kinds[name] is str else boolean
            found[_snake_case(name)] = kind(parameter=name)(given)
        return found

    return take


# Misspelled members.

#: Members that JavaScript itself looks up in any object.
_LOOKED_UP_BY_JS = {"toJSON", "then"}
#: Inserts a proxy at the end of the prototype chain, for names found nowhere else.
_PROXY = """(function (guard, item) {
    const last = Object.getPrototypeOf(item)
    return new Proxy(last, {get: guard.read, set: guard.write})
})"""
_SET_PROTOTYPE_OF = "Object.setPrototypeOf"
_MAX_WARNINGS = 1000


class _MissingMembers(QtCore.QObject):
    """Handler of the proxy that reports missing members; does not appear in JavaScript's stack."""

    def __init__(self, runtime: Runtime) -> None:
        super().__init__(runtime)
        self._runtime = runtime
        self._warned: set[tuple[str, int, str]] = set()
        self._last: Any = None
        self._set: Any = None
        QtQml.QQmlEngine.setObjectOwnership(self, QtQml.QQmlEngine.ObjectOwnership.CppOwnership)

    def wrap(self, item: QtCore.QObject) -> QJSValue:
        """Return the JavaScript object of a QObject, which reports missing members."""
        engine: Any = self._runtime.engine
        if engine is None:
            return QJSValue()
        value: QJSValue = engine.newQObject(item)
        if self._last is None:
            self._set = engine.evaluate(_SET_PROTOTYPE_OF)
            self._last = engine.evaluate(_PROXY).call([engine.newQObject(self), value])
        self._set.call([value, self._last])
        return value

    @Slot(QJSValue, QJSValue, QJSValue, result=QJSValue)
    def read(self, last: QJSValue, name: QJSValue, item: QJSValue) -> QJSValue:
        """Return a member of JavaScript's Object; log a warning if there is none."""
        # Only JavaScript itself looks up symbols.
        if not name.isString():
            return QJSValue()
        asked = name.toString()
        found = last.property(asked)
        if found.isUndefined() and asked not in _LOOKED_UP_BY_JS:
            self._warn(asked, item)
        return found

    def _warn(self, asked: str, item: QJSValue) -> None:
        caller = self._runtime.caller()
        location = (caller.file, caller.line, asked)
        if location in self._warned or len(self._warned) > _MAX_WARNINGS:
            return
        self._warned.add(location)
        log_from_qml("", logging.WARNING, f"{_missing(item, asked)}; it is undefined", caller)

    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, result=bool)
    def write(self, last: QJSValue, name: QJSValue, value: QJSValue, item: QJSValue) -> bool:
        """Throw an error into the JavaScript that assigns to a missing member."""
        del last, value
        self._runtime.throw(_missing(item, name.toString()))
        return True


def spell_checked(runtime: Runtime, item: QtCore.QObject) -> QJSValue:
    """Return the JavaScript object of a QObject, which reports misspelled members.

    Args:
        runtime: The QML engine's runtime.
        item: A QObject that JavaScript has no wrapper of yet. Unless JavaScript owns it, keep the
            result: otherwise JavaScript may create a new, unchecked wrapper.
    """
    guard = runtime.findChild(_MissingMembers) or _MissingMembers(runtime)
    return guard.wrap(item)


def _missing(value: QJSValue, name: str) -> str:
    item = object_of(value)
    # A JavaScript object may have ours as its prototype.
    known = _members(item) if isinstance(item, QtCore.QObject) else []
    called = getattr(item, "CALLED", "object")
    return f"{called} has no member {name!r:.80}{similar(name, known)}"


def _members(item: QtCore.QObject) -> list[str]:
    meta: Any = item.metaObject()
    names = [meta.property(at).name() for at in range(meta.propertyCount())]
    methods = (meta.method(at).name() for at in range(meta.methodCount()))
    names += [bytes(name.data()).decode() for name in methods]
    return list(dict.fromkeys(name for name in names if not name.startswith("_")))

"""How QML over RViz sees objects of Python: properties, slots and errors, made from declarations.

Also misspelled members: Qt takes a value for a member that an object does not have, as JavaScript's
own objects do, and reads such a member as undefined, both without a word.
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
from rosglass.qml.from_js import plain_from_js
from rosglass.qml.js_values import object_of
from rosglass.qml.log import log_from_qml
from rosglass.qt import Property, QJSValue, QtCore, QtGui, QtQml, Signal, Slot
from rosglass.rviz.property_values import shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.qml.runtime import Runtime
    from rosglass.rviz.plugins import Watched

__all__ = [
    "LIST",
    "VARIANT",
    "Face",
    "ItemFaces",
    "anything",
    "errors_to_js",
    "member",
    "options",
    "passing",
    "point",
    "point_of",
    "property_path",
    "slot",
    "spell_checked",
    "switch",
    "text",
    "to_python",
]

#: The type of a property that takes anything, and refuses by itself what it cannot hold.
VARIANT: Any = "QVariant"
#: The type of a list; Qt reads lists of texts into what it has of them already, and so twice.
LIST: Any = "QVariantList"
_OWNERSHIP: Any = QtQml.QQmlEngine.ObjectOwnership


class Face(QtCore.QObject):
    """The object with which QML reaches an object of Python, its `model`.

    Args:
        model: The object.
        runtime: Of the engine that sees it.
        parent: What it ends with.
    """

    #: Its name in errors.
    CALLED: ClassVar[str] = "object"

    def __init__(self, model: Any, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self.model, self.runtime = model, runtime
        QtQml.QQmlEngine.setObjectOwnership(self, _OWNERSHIP.CppOwnership)
        self._held: QJSValue | None = spell_checked(runtime, self)

    def release(self) -> None:
        """Give ownership to JavaScript, which may hold it for longer than its model exists."""
        self.setParent(None)
        self.runtime.keep(self)
        # JavaScript collects only what it has known.
        self._held = None


class ItemFaces(QtCore.QObject):
    """The faces of all tools or all displays, one for each as long as it exists.

    Args:
        items: The tools or displays.
        kind: The class of their faces, with signals `existsChanged` and `changed`.
        runtime: Of the engine that sees them.
        parent: What they end with.
    """

    #: Another list of faces.
    changed = Signal()
    added = Signal(QtCore.QObject)
    removed = Signal(QtCore.QObject)

    def __init__(
        self, items: Watched, kind: type[Face], runtime: Runtime, parent: QtCore.QObject
    ) -> None:
        super().__init__(parent)
        self._items, self._kind, self._runtime = items, kind, runtime
        self._faces: dict[Any, Any] = {}
        items.added.connect(self._on_added)
        items.removed.connect(self._on_removed)
        items.changed.connect(self._on_changed)

    def of(self, item: Any) -> Any:
        """Return the face of an item; None for None."""
        if item is None:
            return None
        if item not in self._faces:
            self._faces[item] = self._kind(item, self._runtime, self)
        return self._faces[item]

    def all(self) -> list[Any]:
        """Return the faces of all items, in RViz's order."""
        return [self.of(item) for item in self._items.all]

    def known(self) -> list[Any]:
        """Return the faces that QML has asked for."""
        return list(self._faces.values())

    @Slot(object)
    def _on_added(self, item: Any) -> None:
        self.changed.emit()
        self.added.emit(self.of(item))

    @Slot(object)
    def _on_removed(self, item: Any) -> None:
        face = self.of(item)
        del self._faces[item]
        face.release()
        self.changed.emit()
        face.existsChanged.emit()
        face.changed.emit()
        self.removed.emit(face)

    @Slot(object)
    def _on_changed(self, item: Any) -> None:
        if item in self._faces:
            self._faces[item].changed.emit()


# Declarations. Those that use them have `CALLED`, and `runtime`, the engine's.


def member(
    name: str,
    kind: Any,
    notify: Any = None,
    *,
    of: str = "",
    takes: Callable[[Any], Any] | None = None,
    sets: Callable[[Any, Any], object] | None = None,
    gives: Callable[[Any], Any] | None = None,
    otherwise: Any = None,
) -> Any:
    """Return a QML property that stands for an attribute.

    Args:
        name: Its name in QML.
        kind: Its type for Qt; :data:`VARIANT` where `takes` is to refuse values.
        notify: The signal of its changes; None where it never changes.
        of: Path of the attribute from the face; ``model.`` and the name in Python's spelling by
            default.
        takes: What a new value goes through; None for a property that cannot be set.
        sets: Called with the face and the new value, instead of setting the attribute.
        gives: What the attribute's value goes through; one for QJSValue becomes a JavaScript value.
        otherwise: Its value where reading the attribute raises an Error, which is thrown.
    """
    path = of or f"model.{_snake(name)}"
    get, (owner, _, attribute) = attrgetter(path), path.rpartition(".")

    def read(self: Any) -> Any:
        try:
            value = get(self)
        except Error as error:
            self.runtime.throw(f"{self.CALLED}.{name}: {error}")
            return otherwise
        value = value if gives is None else gives(value)
        return _to_js(self.runtime, value) if kind is QJSValue else value

    def write(self: Any, value: Any) -> None:
        assert takes is not None
        try:
            wanted = takes(to_python(value))
            if sets is None:
                setattr(attrgetter(owner)(self), attribute, wanted)
            else:
                sets(self, wanted)
        except Error as error:
            self.runtime.throw(f"{self.CALLED}.{name}: {error}")

    more: dict[str, Any] = {"constant": True} if notify is None else {"notify": notify}
    if takes is not None:
        more["fset"] = write
    return Property(kind, read, **more)


def slot(optional: int = 0, /, **takes: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Make a method callable from QML; its Errors are thrown.

    JavaScript gets null for None, an object for a QObject, and undefined where the method is
    annotated to return None.

    Args:
        optional: How many of the last parameters QML may leave out.
        takes: What each argument goes through, by the name of the parameter in QML.
    """
    names = list(takes)
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
                    None if value is None and at >= least else take(value)
                    for at, (take, value) in enumerate(zip(takes.values(), values, strict=False))
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


def passing(name: str, optional: int = 0, to: str = "", /, **takes: Callable[[Any], Any]) -> Any:
    """Return a slot that hands its arguments to a method, and returns nothing.

    Args:
        name: Its name in QML.
        optional: See :func:`slot`.
        to: Path of the method from the face; ``model.`` and the name in Python's spelling by
            default.
        takes: See :func:`slot`; those of :func:`options` are keywords for the method.
    """
    get = attrgetter(to or f"model.{_snake(name)}")

    def call(self: Any, *arguments: Any) -> None:
        named: dict[str, Any] = {}
        if arguments and isinstance(arguments[-1], _Keywords):
            *arguments, named = arguments  # type: ignore[assignment]
        get(self)(*arguments, **named)

    call.__name__ = name
    return slot(optional, **takes)(call)


def _snake(name: str) -> str:
    """Return a QML name in Python's spelling."""
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
    """Throw errors into the JavaScript that is running; where none is, raise them.

    Args:
        runtime: Of the engine; None where there is none.
        what: What was called or set, for the error.
        given: The arguments.
    """
    try:
        yield
    except Error as error:
        # Once a getter of JavaScript's own has thrown, the engine no longer knows its caller.
        sure = any(isinstance(value, QJSValue) for value in given)
        if runtime is None or not (sure or runtime.caller().file != "<python>"):
            raise Error(f"{what}: {error}") from error
        runtime.throw(f"{what}: {error}")


# What values go through.


def to_python(value: Any) -> Any:
    """Return what JavaScript gave: plain values, colours, vectors as dicts, and our own objects.

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


def anything(value: Any) -> Any:
    """Return a value as it is: the method refuses what it does not take."""
    return value


def _of_kind(kind: type, wanted: str, parameter: str) -> Callable[[Any], Any]:
    # Qt would make one of anything.
    def take(value: Any) -> Any:
        if not isinstance(value, kind):
            prefix = f"{parameter}: " if parameter else ""
            raise Error(f"{prefix}expected {wanted}, got {shown(value)}")
        return value

    return take


def text(wanted: str = "a text", parameter: str = "") -> Callable[[Any], str]:
    """Return a converter for strings.

    Args:
        wanted: What it is to be, for the error.
        parameter: Which parameter it is for, if the error is to name it.
    """
    return _of_kind(str, wanted, parameter)


def switch(parameter: str = "") -> Callable[[Any], bool]:
    """Return a converter for true and false; see :func:`text`."""
    return _of_kind(bool, "true or false", parameter)


def point(parameter: str = "") -> Callable[[Any], tuple[float, float, float]]:
    """Return a converter for points; see :func:`point_of` and :func:`text`."""
    return lambda value: point_of(value, parameter)


def point_of(value: Any, parameter: str = "") -> tuple[float, float, float]:
    """Return a point that is given as a vector, an object with x, y and z, or a list of three.

    Raises:
        Error: It is none, or its numbers are not finite.
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
        example: Such a path, for the error.
    """

    def take(value: Any) -> str | list[str]:
        names = value if isinstance(value, list) else [value]
        if not names or not all(isinstance(name, str) for name in names):
            raise Error(f"expected the path of a property, e.g. {example!r}, got {shown(value)}")
        return value  # type: ignore[no-any-return]

    return take


class _Keywords(dict[str, Any]):
    """Options as keyword arguments."""


def options(**kinds: type) -> Callable[[Any], dict[str, Any]]:
    """Return a converter for an object with options; :func:`passing` makes keywords of them.

    Args:
        kinds: The kind of each option, `str` or `bool`.
    """
    known = ", ".join(kinds)

    def take(value: Any) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise Error(f"options: expected {{{known}}}, got {shown(value)}")
        found = _Keywords()
        for name, given in value.items():
            if name not in kinds:
                raise Error(f"there is no option {shown(name)}; there are {known}")
            kind = text if kinds[name] is str else switch
            found[_snake(name)] = kind(parameter=name)(given)
        return found

    return take


# Misspelled members.

#: JavaScript asks any object for these, to find out what it is.
_ASKED = {"toJSON", "then"}
#: What is looked at last, where neither the object nor JavaScript has a member of a name.
_PROXY = """(function (guard, item) {
    const last = Object.getPrototypeOf(item)
    return new Proxy(last, {get: guard.read, set: guard.write})
})"""
_SET = "Object.setPrototypeOf"
_MAX_WARNINGS = 1000


class _Guard(QtCore.QObject):
    """Answers for missing members; its slots leave no trace in JavaScript's stack.

    Args:
        runtime: Of the engine.
    """

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
            self._set = engine.evaluate(_SET)
            self._last = engine.evaluate(_PROXY).call([engine.newQObject(self), value])
        self._set.call([value, self._last])
        return value

    @Slot(QJSValue, QJSValue, QJSValue, result=QJSValue)
    def read(self, last: QJSValue, name: QJSValue, item: QJSValue) -> QJSValue:
        """Return a member of JavaScript's own; log a warning if it does not exist either."""
        # Symbols are asked for by JavaScript itself.
        if not name.isString():
            return QJSValue()
        asked = name.toString()
        found = last.property(asked)
        if found.isUndefined() and asked not in _ASKED:
            self._warn(asked, item)
        return found

    def _warn(self, asked: str, item: QJSValue) -> None:
        caller = self._runtime.caller()
        place = (caller.file, caller.line, asked)
        if place in self._warned or len(self._warned) > _MAX_WARNINGS:
            return
        self._warned.add(place)
        log_from_qml("", logging.WARNING, f"{_missing(item, asked)}; it is undefined", caller)

    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, result=bool)
    def write(self, last: QJSValue, name: QJSValue, value: QJSValue, item: QJSValue) -> bool:
        """Throw into the JavaScript that assigns to a missing member."""
        del last, value
        self._runtime.throw(_missing(item, name.toString()))
        return True


def spell_checked(runtime: Runtime, item: QtCore.QObject) -> QJSValue:
    """Return the JavaScript object of a QObject, which reports misspelled members.

    Args:
        runtime: Of the engine.
        item: Not seen by JavaScript before. Unless JavaScript owns it, hold the result for as long
            as members are to be checked: otherwise JavaScript may make a new, unchecked one.
    """
    guard = runtime.findChild(_Guard) or _Guard(runtime)
    return guard.wrap(item)


def _missing(value: QJSValue, name: str) -> str:
    item = object_of(value)
    # A JavaScript object may inherit from ours.
    known = _members(item) if isinstance(item, QtCore.QObject) else []
    called = getattr(item, "CALLED", "object")
    return f"{called} has no member {name!r:.80}{similar(name, known)}"


def _members(item: QtCore.QObject) -> list[str]:
    meta: Any = item.metaObject()
    names = [meta.property(at).name() for at in range(meta.propertyCount())]
    methods = (meta.method(at).name() for at in range(meta.methodCount()))
    names += [bytes(name.data()).decode() for name in methods]
    return list(dict.fromkeys(name for name in names if not name.startswith("_")))

"""What QML objects over RViz have in common."""

from __future__ import annotations

import contextlib
import inspect
import logging
from functools import wraps
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.qml.js_values import object_of
from rosglass.qml.log import log_from_qml
from rosglass.qml.plain import plain_from_js
from rosglass.qt import QJSValue, QtCore, QtGui, QtQml, Slot
from rosglass.rviz.property_values import shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.qml.runtime import Runtime

__all__ = ["VARIANT", "Face", "given", "place", "spelled", "switch_of", "taking", "text_of"]


#: JavaScript asks any object for these, to find out what it is.
_ASKED = {"toJSON", "then"}
#: What is looked for last, where neither the object nor JavaScript has a member of a name.
_PROXY = """(function (guard, item) {
    const last = Object.getPrototypeOf(item)
    return new Proxy(last, {get: guard.read, set: guard.write})
})"""
_SET = "Object.setPrototypeOf"
_MOST = 1000


class _Guard(QtCore.QObject):
    """Answers for members that there are not; its slots leave no trace in JavaScript's stack.

    Args:
        runtime: Of the engine.
    """

    def __init__(self, runtime: Runtime) -> None:
        super().__init__(runtime)
        self._runtime = runtime
        self._told: set[tuple[str, int, str]] = set()
        self._last: Any = None
        self._set: Any = None
        QtQml.QQmlEngine.setObjectOwnership(self, QtQml.QQmlEngine.ObjectOwnership.CppOwnership)

    def wrap(self, item: QtCore.QObject) -> QJSValue:
        """Return what JavaScript has for an object, where mistakes are told from now on."""
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
        """Return a member of JavaScript's own; tell of one that it does not have either."""
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
        if place in self._told or len(self._told) > _MOST:
            return
        self._told.add(place)
        text = f"{_missing(item, asked)}; it is undefined"
        log_from_qml("", logging.WARNING, text, caller)

    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, result=bool)
    def write(self, last: QJSValue, name: QJSValue, value: QJSValue, item: QJSValue) -> bool:
        """Throw into the JavaScript that assigns to a member which there is not."""
        del last, value
        self._runtime.throw(_missing(item, name.toString()))
        return True


def spelled(runtime: Runtime, item: QtCore.QObject) -> QJSValue:
    """Return what JavaScript has for an object, where misspelled members are told from now on.

    Args:
        runtime: Of the engine.
        item: Not seen by JavaScript before. Where JavaScript does not own it, hold the result for
            as long as it is to be so: JavaScript may make a new one otherwise.
    """
    guard = runtime.findChild(_Guard) or _Guard(runtime)
    return guard.wrap(item)


def _missing(value: QJSValue, name: str) -> str:
    item = object_of(value)
    # An object of JavaScript's may inherit from ours.
    known = _members(item) if isinstance(item, QtCore.QObject) else []
    called = getattr(item, "CALLED", "object")
    return f"{called} has no member {name!r:.80}{similar(name, known)}"


def _members(item: QtCore.QObject) -> list[str]:
    meta: Any = item.metaObject()
    names = [meta.property(at).name() for at in range(meta.propertyCount())]
    methods = (meta.method(at).name() for at in range(meta.methodCount()))
    names += [bytes(name.data()).decode() for name in methods]
    return list(dict.fromkeys(name for name in names if not name.startswith("_")))


#: The type of a property that takes anything, and says itself what it does not.
VARIANT: Any = "QVariant"
_OWN: Any = QtQml.QQmlEngine.ObjectOwnership


class Face(QtCore.QObject):
    """An object of QML with which it reaches something of RViz.

    Args:
        runtime: Of the engine that sees it.
        parent: What it ends with.
    """

    #: What errors call it.
    CALLED: ClassVar[str] = "object"

    def __init__(self, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self._runtime = runtime
        QtQml.QQmlEngine.setObjectOwnership(self, _OWN.CppOwnership)
        self._held: QJSValue | None = spelled(runtime, self)

    def throw(self, text: str) -> None:
        """Throw an error into the JavaScript that is running."""
        self._runtime.throw(text)

    @contextlib.contextmanager
    def _telling(self, what: str) -> Iterator[None]:
        """Throw an error into the JavaScript that is running."""
        try:
            yield
        except Error as error:
            self.throw(f"{what}: {error}")

    def _to_js(self, item: QtCore.QObject | None) -> QJSValue:
        """Return an object for JavaScript; null for None."""
        engine = self._runtime.engine
        if engine is None or item is None:
            return QJSValue(QJSValue.SpecialValue.NullValue)
        return engine.newQObject(item)

    def let_go(self) -> None:
        """Leave it to JavaScript, which may hold what is no more for as long as it likes."""
        self.setParent(None)
        self._runtime.keep(self)
        # Only what JavaScript has known is ever collected by it.
        self._held = None


def taking(least: int, most: int, result: Any = QJSValue) -> Callable[[Any], Any]:
    """Make a method callable from QML with so many arguments of any kind; fewer are told."""

    def decorate(function: Any) -> Any:
        names = list(inspect.signature(function).parameters)[1:]
        said = [name.replace("class_id", "classId") for name in names]
        optional = "".join(f"[, {name}" for name in said[least:]) + "]" * (most - least)
        usage = f"{function.__name__}({', '.join(said[:least])}{optional})"

        @wraps(function)
        def call(self: Any, *arguments: Any, **named: Any) -> Any:
            given_names = {*names[: len(arguments)], *named}
            missing = [said[at] for at in range(least) if names[at] not in given_names]
            if missing:
                self.throw(f"{self.CALLED}.{usage}: {' and '.join(missing)} must be given")
                return None if result is None else QJSValue()
            return function(self, *arguments, **named)

        answer = {} if result is None else {"result": result}
        for count in range(most + 1):
            call = Slot(*[QJSValue] * count, **answer)(call)
        return call

    return decorate


def given(value: QJSValue | None) -> Any:
    """Return what JavaScript gave: plain values, colours, vectors as dicts, and our own faces.

    Raises:
        ConversionError: It is a function, refers to itself, or is too large.
    """
    if value is None:
        return None
    if value.isQObject():
        return object_of(value)
    found = plain_from_js(value)
    names = set(found) if isinstance(found, dict) else set()
    if names == {"scalar", "x", "y", "z"}:
        return {"x": found["x"], "y": found["y"], "z": found["z"], "w": found["scalar"]}
    if {"r", "g", "b", "a", "hsvHue"} <= names:
        return QtGui.QColor.fromRgbF(*(found[name] for name in "rgba"))
    return found


def text_of(value: Any, wanted: str = "a text") -> str:
    """Return a text that is given for a property; Qt would make one of anything.

    Args:
        value: What was given.
        wanted: What it is to be, in words.

    Raises:
        Error: It is none.
    """
    found = given(value) if isinstance(value, QJSValue) else value
    if not isinstance(found, str):
        raise Error(f"expected {wanted}, got {shown(found)}")
    return found


def switch_of(value: Any) -> bool:
    """Return true or false as given for a property; Qt would make one of anything.

    Raises:
        Error: It is neither.
    """
    found = given(value) if isinstance(value, QJSValue) else value
    if not isinstance(found, bool):
        raise Error(f"expected true or false, got {shown(found)}")
    return found


def place(value: Any, what: str = "") -> tuple[float, float, float]:
    """Return a point that is given as a vector, an object with x, y and z, or a list of three.

    Args:
        value: What was given.
        what: What to call it in the error, if it is not the only point.

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
        called = f"{what}: " if what else ""
        raise Error(
            f"{called}expected x, y and z in metres, e.g. Qt.vector3d(1, 2, 0), got {shown(value)}"
        )
    return float(parts[0]), float(parts[1]), float(parts[2])

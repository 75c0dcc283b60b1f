"""What the faces that QML sees of RViz have in common: values given, values and errors returned."""

from __future__ import annotations

import contextlib
import inspect
from functools import wraps
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.errors import Error
from rosglass.qml.js_values import object_of
from rosglass.qml.plain import plain_from_js
from rosglass.qt import QJSValue, QtCore, QtGui, QtQml, Slot
from rosglass.rviz.shown import shown
from rosglass.rviz.spelling import spelled

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.qml.runtime import Runtime

__all__ = ["VARIANT", "Face", "given", "place", "switch_of", "taking", "text_of"]

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

"""Misspelled members of the objects that QML over RViz is given: told, with what may be meant.

Qt takes a value for a member that an object does not have, as JavaScript's own objects do, and
reads such a member as undefined; neither says a word.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm.names import similar
from rosglass.qml.js_values import object_of
from rosglass.qml.log import log_from_qml
from rosglass.qt import QJSValue, QtCore, QtQml, Slot

if TYPE_CHECKING:
    from rosglass.qml.runtime import Runtime

__all__ = ["spelled"]

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

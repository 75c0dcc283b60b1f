"""Calling functions of JavaScript so that other threads of Python live on meanwhile."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.qt import QJSValue, QtCore, Signal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.qt import QtQml

__all__ = ["JsCalls"]

_SCRIPT = """(function (calls, jobs) {
    function thrown(value) {
        return Object.assign(new Error(String(value)), { fileName: undefined })
    }
    calls.asked.connect(function (number) {
        const job = jobs[number]
        try {
            job.result = job.callee.apply(undefined, job.passed)
        } catch (error) {
            job.result = error instanceof Error ? error : thrown(error)
        }
        job.done = true
    })
})"""
_ENDED = "new Error('the function was ended, for it kept the screen from living')"


class JsCalls(QtCore.QObject):
    """Calls functions, in the thread of their engine.

    QJSValue.call keeps Python's lock until the function has returned: one that never does could
    not even be ended. Sending a signal does not.

    Args:
        engine: The engine.
    """

    asked = Signal(int)

    def __init__(self, engine: QtQml.QQmlEngine) -> None:
        super().__init__(engine)
        self._engine = engine
        self._jobs, self._number = engine.newObject(), 0
        script: Any = engine.evaluate(_SCRIPT)
        script.call([engine.newQObject(self), self._jobs])

    def call(self, function: QJSValue, arguments: Sequence[QJSValue]) -> QJSValue:
        """Return what a function returns, or the error that it throws, or that it was ended."""
        self._number = (self._number + 1) % 2**31
        name = str(self._number)
        job, passed = self._engine.newObject(), self._engine.newArray(len(arguments))
        for index, argument in enumerate(arguments):
            passed.setProperty(index, argument)
        job.setProperty("callee", function)
        job.setProperty("passed", passed)
        self._jobs.setProperty(name, job)
        try:
            self.asked.emit(self._number)
        finally:
            self._jobs.deleteProperty(name)
        result: Any = job.property("result")
        if not job.property("done").toBool():
            result = self._engine.evaluate(_ENDED)
        value: QJSValue = result
        return value

"""JavaScript functions that are called later, and promises that are settled later."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from rosglass.qml.log import Caller, log_from_qml, plain_path
from rosglass.qt import QJSValue

if TYPE_CHECKING:
    from rosglass.qml.runtime import Runtime

__all__ = ["Deferred", "call_back"]


def call_back(runtime: Runtime, callback: QJSValue, *arguments: QJSValue) -> QJSValue:
    """Call a JavaScript function; what it throws is logged with file and line.

    Args:
        runtime: The engine's runtime; when the engine is gone, nothing happens.
        callback: The function; anything else is ignored.
        arguments: What it is given.

    Returns:
        What the function returned; undefined when it threw.
    """
    if runtime.engine is None or not callback.isCallable():
        return QJSValue()
    result = runtime.call(callback, arguments)
    if not result.isError():
        return result
    named = result.property("fileName")
    file = "<unknown>" if named.isUndefined() else plain_path(named.toString())
    line = 0 if named.isUndefined() else result.property("lineNumber").toInt()
    log_from_qml("", logging.ERROR, result.toString(), Caller(file, max(line, 0), ""))
    return QJSValue()


class Deferred:
    """A JavaScript promise and who will settle it; on the GUI thread only.

    Args:
        runtime: The engine's runtime.
        what: What was asked for, for the log: a rejection that no QML handles would go unnoticed.
    """

    def __init__(self, runtime: Runtime, what: str) -> None:
        self._runtime, self._what = runtime, what
        self._caller = runtime.caller()
        #: What JavaScript holds.
        self.promise, self._resolve, self._reject = runtime.promise()

    def resolve(self, value: QJSValue) -> None:
        """Let it come."""
        call_back(self._runtime, self._resolve, value)

    def reject(self, reason: str) -> None:
        """Let a JavaScript Error come instead."""
        text = f"{self._what}: {reason}" if self._what not in reason else reason
        log_from_qml("", logging.WARNING, text, self._caller)
        call_back(self._runtime, self._reject, QJSValue(text))

"""Callbacks of JavaScript, promises for JavaScript, and answers from JavaScript."""

from __future__ import annotations

import logging
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.engine.log import Caller, log_from_qml, plain_path
from rosglass.qt import QJSValue, QtCore, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.qml.engine.runtime import Runtime


__all__ = ["Answers", "Deferred", "call_back", "pass_on"]

#: Maximum number of open answers of one function; more requests are refused.
_MAX_OPEN = 1000


def call_back(runtime: Runtime, callback: QJSValue, *arguments: QJSValue) -> QJSValue:
    """Call a JavaScript function; log the error that it throws, with file and line.

    Args:
        runtime: The engine's runtime; if the engine no longer exists, nothing is called.
        callback: The function; other values are ignored.
        arguments: The arguments of the call.

    Returns:
        The function's result; undefined if it threw.
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
    """A JavaScript promise and the functions that settle it; on the GUI thread only.

    Args:
        runtime: The engine's runtime.
        what: The request, for the log: a rejection that QML does not handle is logged.
    """

    def __init__(self, runtime: Runtime, what: str) -> None:
        self._runtime, self._what = runtime, what
        self._caller = runtime.caller()
        #: The promise for JavaScript.
        self.promise, self._resolve, self._reject = runtime.promise()

    def resolve(self, value: QJSValue) -> None:
        """Resolve the promise."""
        call_back(self._runtime, self._resolve, value)

    def reject(self, reason: str) -> None:
        """Reject the promise with a JavaScript Error."""
        text = f"{self._what}: {reason}" if self._what not in reason else reason
        log_from_qml("", logging.WARNING, text, self._caller)
        call_back(self._runtime, self._reject, QJSValue(text))


class _Settler(QtCore.QObject):
    """Settles a future with the outcome of a JavaScript promise."""

    def __init__(
        self,
        parent: QtCore.QObject,
        take: Callable[[QJSValue], Any],
        future: Future[Any],
    ) -> None:
        super().__init__(parent)
        self._take, self._future = take, future

    @Slot(QJSValue)
    @Slot()
    def settle(self, value: QJSValue | None = None) -> None:
        """Set the result of the future."""
        if not self._future.done():
            try:
                self._future.set_result(self._take(QJSValue() if value is None else value))
            except Error as error:
                self._future.set_exception(error)
        self.deleteLater()

    @Slot(QJSValue)
    @Slot()
    def fail(self, reason: QJSValue | None = None) -> None:
        """Set the error of the future."""
        if not self._future.done():
            text = "no reason given" if reason is None else reason.toString()
            self._future.set_exception(Error(text.removeprefix("Error: ")))
        self.deleteLater()


class Answers:
    """Calls a JavaScript function for an immediate or later answer; on the GUI thread only.

    Args:
        runtime: The engine's runtime.
        what: The function's name in errors, e.g. ``the handler of service /lamp``.
    """

    def __init__(self, runtime: Runtime, what: str) -> None:
        self._runtime, self._what = runtime, what
        self._pending: set[Future[Any]] = set()

    def ask(
        self, handler: QJSValue, arguments: list[QJSValue], take: Callable[[QJSValue], Any]
    ) -> Any:
        """Return the answer, or a future of it.

        A function may answer after it has returned: it returns a promise, or declares one more
        parameter, which receives a function to answer with.

        Args:
            handler: The function.
            arguments: The arguments of the call.
            take: Converts the JavaScript value; raises Error if it cannot.

        Raises:
            Error: There is no function, it threw, or its answer cannot be converted.
        """
        engine = self._runtime.engine
        if engine is None or not handler.isCallable():
            raise Error(f"{self._what} is not a function")
        later = handler.property("length").toInt() > len(arguments)
        promise, respond, _ = self._runtime.promise() if later else (QJSValue(),) * 3
        answer = self._runtime.call(handler, [*arguments, respond] if later else arguments)
        if answer.isError():
            file, line = answer.property("fileName"), answer.property("lineNumber")
            place = f"{file.toString()}:{line.toInt()}: " if not file.isUndefined() else ""
            raise Error(f"{self._what} failed: {place}{answer.toString()}")
        if later and answer.isUndefined():
            answer = promise
        if not answer.property("then").isCallable():
            return take(answer)
        future = self.open()
        settler = engine.newQObject(_Settler(self._runtime, take, future))
        functions = [settler.property("settle"), settler.property("fail")]
        answer.property("then").callWithInstance(answer, functions)
        return future

    def open(self) -> Future[Any]:
        """Return a future of a later answer, which fails when the function no longer exists.

        Raises:
            Error: Too many answers are open.
        """
        if len(self._pending) >= _MAX_OPEN:
            raise Error(f"{self._what} has {_MAX_OPEN} requests open: answer them first")
        future: Future[Any] = Future()
        self._pending.add(future)
        future.add_done_callback(self._pending.discard)
        return future

    def later(self, queue: list[Callable[[], None]], ask: Callable[[], Any]) -> Future[Any]:
        """Queue a call of `ask`; return a future of its result or error."""
        future = self.open()

        def run() -> None:
            if future.done():
                return
            self._pending.discard(future)  # what `ask` opens takes its place
            try:
                answer = ask()
            except Error as error:
                future.set_exception(error)
                return
            if isinstance(answer, Future):
                answer.add_done_callback(lambda done: pass_on(done, future))
            else:
                future.set_result(answer)

        queue.append(run)
        return future

    def give_up(self) -> None:
        """Fail every outstanding answer: the function no longer exists."""
        for future in list(self._pending):
            if not future.done():
                future.set_exception(Error(f"{self._what} was closed before it answered"))


def pass_on(done: Future[Any], future: Future[Any]) -> None:
    """Pass the outcome of a future to another one, unless that has one."""
    if future.done():
        return
    error = done.exception()
    if error is None:
        future.set_result(done.result())
    else:
        future.set_exception(error)

"""Answers from JavaScript: given at once, by a promise, or by calling a function later."""

from __future__ import annotations

from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qt import QJSValue, QtCore, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.qml.runtime import Runtime

__all__ = ["Answers"]


class _Settler(QtCore.QObject):
    """Takes over what a JavaScript promise comes to."""

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
        """Let the answer come."""
        if not self._future.done():
            try:
                self._future.set_result(self._take(QJSValue() if value is None else value))
            except Error as error:
                self._future.set_exception(error)
        self.deleteLater()

    @Slot(QJSValue)
    @Slot()
    def fail(self, reason: QJSValue | None = None) -> None:
        """Let the failure come."""
        if not self._future.done():
            text = "no reason given" if reason is None else reason.toString()
            self._future.set_exception(Error(text.removeprefix("Error: ")))
        self.deleteLater()


class Answers:
    """Asks a JavaScript function, and waits for what it answers; on the GUI thread only.

    Args:
        runtime: The engine's runtime.
        what: Who is asked, for errors: ``the handler of service /lamp``.
    """

    def __init__(self, runtime: Runtime, what: str) -> None:
        self._runtime, self._what = runtime, what
        self._pending: set[Future[Any]] = set()

    def ask(
        self, handler: QJSValue, arguments: list[QJSValue], take: Callable[[QJSValue], Any]
    ) -> Any:
        """Return the answer, or the future of it.

        A function that declares one more parameter than it is given is handed a function to answer
        with, and may do so after it has returned; so may one that returns a promise.

        Args:
            handler: The function.
            arguments: What it is given.
            take: Makes of the JavaScript value what is wanted; raises Error when it cannot.

        Raises:
            Error: There is no function, it threw, or its answer cannot be taken.
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
        future: Future[Any] = Future()
        self._pending.add(future)
        future.add_done_callback(self._pending.discard)
        settler = engine.newQObject(_Settler(self._runtime, take, future))
        functions = [settler.property("settle"), settler.property("fail")]
        answer.property("then").callWithInstance(answer, functions)
        return future

    def later(self, queue: list[Callable[[], None]], ask: Callable[[], Any]) -> Future[Any]:
        """Return the future of what `ask` will return, or raise, when the queue's job runs."""
        future: Future[Any] = Future()
        self._pending.add(future)
        future.add_done_callback(self._pending.discard)

        def run() -> None:
            if future.done():
                return
            try:
                answer = ask()
            except Error as error:
                future.set_exception(error)
                return
            if isinstance(answer, Future):
                answer.add_done_callback(lambda done: _pass_on(done, future))
            else:
                future.set_result(answer)

        queue.append(run)
        return future

    def give_up(self) -> None:
        """Fail every answer that has not come: who was asked is gone."""
        for future in list(self._pending):
            if not future.done():
                future.set_exception(Error(f"{self._what} was closed before it answered"))


def _pass_on(done: Future[Any], future: Future[Any]) -> None:
    if future.done():
        return
    error = done.exception()
    if error is None:
        future.set_result(done.result())
    else:
        future.set_exception(error)

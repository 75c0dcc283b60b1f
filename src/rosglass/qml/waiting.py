"""Waiting in a call from QML: for an answer while the screen is drawn, for files with a limit."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, TypeVar

from rosglass.errors import Error
from rosglass.qt import QtCore, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.qml.session import Session


__all__ = ["FILE_TIMEOUT_S", "FOLDER_TIMEOUT_S", "MOST_WAITING", "wait_for", "within"]

#: Calls that wait within each other at most. Each needs a part of the stack, and once that is used
#: up, nothing works any more, a stop button neither.
MOST_WAITING = 16


class _Keeper(QtCore.QObject):
    """Delays the deletion of objects while a call waits.

    Qt ends the program when an object is destroyed whose signal handler is still running, which
    happens when a page is closed during the call.
    """

    def __init__(self) -> None:
        super().__init__()
        self._kept: list[QtCore.QObject] = []

    def eventFilter(self, watched: QtCore.QObject, event: QtCore.QEvent) -> bool:  # noqa: N802
        """Delay deletions; Qt calls this before every event."""
        if event.type() == QtCore.QEvent.Type.DeferredDelete:
            self._kept.append(watched)
            return True
        return False

    def release(self) -> None:
        """Delete the objects after all."""
        for item in self._kept:
            if is_alive(item):
                item.deleteLater()


def wait_for(session: Session, begin: Callable[[Callable[[], None]], None]) -> bool:
    """Return once an operation has ended; the interface keeps running until then.

    Events are handled as ever: pictures are drawn, a stop button works. Ends early when the
    program does.

    Args:
        session: The session.
        begin: Starts it; given the function to call, on the GUI thread, when it has ended.

    Returns:
        False when it was started and not waited for, as :data:`MOST_WAITING` calls wait already.
    """
    app = QtCore.QCoreApplication.instance()
    assert app is not None
    loop, keeper = QtCore.QEventLoop(), _Keeper()
    ended = False

    def end() -> None:
        nonlocal ended
        ended = True
        loop.quit()

    # Nothing is drawn before this call returns.
    session.go_on()
    begin(end)
    if ended:
        return True
    if session.waiting_calls >= MOST_WAITING:
        return False
    app.installEventFilter(keeper)
    session.waiting_calls += 1
    try:
        # Jobs behind the one that is running now would wait for it.
        session.executor.resume()
        execute = loop.exec if hasattr(loop, "exec") else loop.exec_
        execute()
    finally:
        app.removeEventFilter(keeper)
        keeper.release()
        session.waiting_calls -= 1
        session.call_ended.emit()
    return True


_T = TypeVar("_T")

#: How long a file, and a folder that is searched, may block the interface.
FILE_TIMEOUT_S, FOLDER_TIMEOUT_S = 2.0, 5.0


def within(seconds: float, what: str, work: Callable[[], _T]) -> _T:
    """Return what `work` returns; it runs on a thread, since calls to a dead server never end.

    Args:
        seconds: How long it may take.
        what: The file or folder, for the error.
        work: Touches files, and nothing else.

    Raises:
        Error: It took longer; it may come to its end later.
        Exception: What `work` raises.
    """
    found: list[_T] = []
    failed: list[Exception] = []

    def run() -> None:
        try:
            found.append(work())
        except Exception as error:
            failed.append(error)

    thread = threading.Thread(target=run, name="rosglass-files", daemon=True)
    thread.start()
    thread.join(seconds)
    if failed:
        raise failed[0]
    if not found:
        raise Error(
            f"{what} did not answer within {seconds:g} s: is it on a network drive that cannot be "
            "reached? The screen is frozen until then"
        )
    return found[0]

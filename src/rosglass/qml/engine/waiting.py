"""Waiting in calls from QML: for replies while the interface runs, for files with a timeout."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, TypeVar

from rosglass.errors import Error
from rosglass.qt import QtCore, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.qml.engine.session import Session


__all__ = ["FILE_TIMEOUT_S", "FOLDER_TIMEOUT_S", "MOST_WAITING", "wait_for", "within"]

#: Maximum number of nested waiting calls. Each needs stack space, and without any left nothing
#: works, not even a stop button.
MOST_WAITING = 16


class _Keeper(QtCore.QObject):
    """Delays the deletion of objects while a call waits.

    Qt aborts the program if an object is destroyed while its signal handler runs, which happens if
    a page is closed during the call.
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
        """Delete the delayed objects."""
        for item in self._kept:
            if is_alive(item):
                item.deleteLater()


def wait_for(session: Session, begin: Callable[[Callable[[], None]], None]) -> bool:
    """Wait for an operation; the interface keeps running.

    Events are handled as usual: frames are drawn, a stop button works. Returns early if the
    program ends.

    Args:
        session: The session.
        begin: Starts the operation; its argument is the function to call, on the GUI thread, when
            the operation has ended.

    Returns:
        False if it was started without waiting, because :data:`MOST_WAITING` calls already wait.
    """
    app = QtCore.QCoreApplication.instance()
    assert app is not None
    loop, keeper = QtCore.QEventLoop(), _Keeper()
    ended = False

    def end() -> None:
        nonlocal ended
        ended = True
        loop.quit()

    # The first frame cannot be drawn before this call returns.
    session.go_on()
    begin(end)
    if ended:
        return True
    if session.waiting_calls >= MOST_WAITING:
        return False
    app.installEventFilter(keeper)
    session.waiting_calls += 1
    try:
        # Otherwise the jobs after the current one would wait for it.
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

#: Seconds that reading a file or searching a folder may block the interface.
FILE_TIMEOUT_S, FOLDER_TIMEOUT_S = 2.0, 5.0


def within(seconds: float, what: str, work: Callable[[], _T]) -> _T:
    """Run `work` on a thread with a timeout: calls to a dead file server never return.

    Args:
        seconds: The timeout.
        what: The file or folder, for the error.
        work: Accesses files and nothing else.

    Raises:
        Error: It took longer; it may still finish later.
        Exception: An exception from `work`.
    """
    found: list[_T] = []
    failed: list[Exception] = []

    def run() -> None:
        try:
            found.append(work())
        except Exception as error:  # noqa: BLE001 - raised in the waiting thread
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

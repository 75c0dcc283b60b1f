"""Waiting within a call from QML without freezing the screen."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.qt import QtCore, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.qml.session import Session

__all__ = ["MOST_WAITING", "wait_for"]

#: Calls that wait within each other at most. Each needs a part of the stack, and once that is used
#: up, nothing works any more, a stop button neither.
MOST_WAITING = 16


class _Keeper(QtCore.QObject):
    """Puts off the deletion of objects while a call waits.

    Qt ends the program when an object is destroyed whose signal handler is still running, which
    is what a page that is closed meanwhile would bring about.
    """

    def __init__(self) -> None:
        super().__init__()
        self._kept: list[QtCore.QObject] = []

    def eventFilter(self, watched: QtCore.QObject, event: QtCore.QEvent) -> bool:  # noqa: N802
        """Keep deletions back; Qt calls this before every event."""
        if event.type() == QtCore.QEvent.Type.DeferredDelete:
            self._kept.append(watched)
            return True
        return False

    def release(self) -> None:
        """Let the objects go."""
        for item in self._kept:
            if is_alive(item):
                item.deleteLater()


def wait_for(session: Session, begin: Callable[[Callable[[], None]], None]) -> bool:
    """Return once something has ended; meanwhile the interface lives on.

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

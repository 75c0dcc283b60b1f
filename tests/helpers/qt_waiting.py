"""Waiting in tests while Qt's event loop runs."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from waiting import eventually, nothing_happens

from rosglass.qt import QtCore, send_deferred_deletes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.qml import Session

#: How long a condition that changes without an event of Qt stays unseen at most.
_LOOK_AGAIN_MS = 10


class QtWaiting:
    """Runs Qt's event loop until something is so; an event wakes it, not a clock.

    Calling it waits for a condition, see :func:`waiting.eventually`.

    Args:
        before_frame: The signal of :meth:`frames`.
    """

    def __init__(self, before_frame: Any = None) -> None:
        self._before_frame = before_frame
        flags = QtCore.QEventLoop.ProcessEventsFlag
        self._flags = flags.AllEvents | flags.WaitForMoreEvents

    def __call__(
        self,
        condition: Callable[[], Any],
        what: Callable[[], object] | object = "",
        *,
        timeout: float = 30.0,
    ) -> Any:
        with self._woken():
            return eventually(condition, what, timeout=timeout, turn=self._turn)

    def signals(self, signal: Any, count: int = 1) -> None:
        """Wait until a signal has been sent so many times more."""
        seen: list[None] = []
        on_signal = lambda *_: seen.append(None)  # noqa: E731 - methods change metaobjects
        signal.connect(on_signal)
        try:
            self(lambda: len(seen) >= count, f"{count} times {signal}")
        finally:
            signal.disconnect(on_signal)

    def frames(self, count: int) -> None:
        """Wait until so many frames more have begun."""
        self.signals(self._before_frame, count)

    def settled(self, session: Session) -> None:
        """Wait until QML, the session's worker and what they give each other are done.

        What has been given to either of them has happened by then: messages that were published
        within this process, properties that changed, endpoints that are to be made.
        """
        for _ in range(3):
            done: list[object] = []
            session.background(lambda: None, done.append)
            self(lambda done=done: done, "an answer of the session's worker")

    def nothing_happens(self, seconds: float) -> None:
        """See :func:`waiting.nothing_happens`."""
        with self._woken():
            nothing_happens(seconds, turn=self._turn)

    def _turn(self) -> None:
        QtCore.QCoreApplication.processEvents(self._flags)
        send_deferred_deletes()  # they otherwise wait for exec()

    @contextmanager
    def _woken(self) -> Iterator[None]:
        timer = QtCore.QTimer()
        timer.start(_LOOK_AGAIN_MS)
        try:
            yield
        finally:
            timer.stop()

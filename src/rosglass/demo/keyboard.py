"""The keys that are held down, regardless of the repeats of X11."""

from __future__ import annotations

from typing import Any

from rosglass.qt import QtCore, QtQml

__all__ = ["HeldKeys", "register"]

#: Milliseconds of a tick, and ticks from a release until it counts. Two, so that after a pause a
#: press that waits in the queue is handled between them.
_TICK, _TICKS = 16, 2


class HeldKeys(QtCore.QObject):
    """Distinguishes released keys from repeating ones.

    On X11, a key held down repeats as releases and presses, and Qt marks those as repeats only if
    both wait in its queue; on an idle window most do not. A press within 32 ms of the release of
    the same key is therefore a repeat, and a release counts only if no such press follows.

    Not a Timer of QML's, which ticks with the frames and would report a release late.
    """

    #: A key was released, 16 to 32 ms ago.
    lifted = QtCore.Signal(int)

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._down: set[int] = set()
        self._leaving: dict[int, int] = {}
        self._timer = QtCore.QTimer(self)
        self._timer.setTimerType(QtCore.Qt.TimerType.PreciseTimer)
        self._timer.setInterval(_TICK)
        self._timer.timeout.connect(self._tick)

    @QtCore.Slot(int, result=bool)
    def press(self, key: int) -> bool:
        """Handle a key's press; return False if it is a repeat."""
        repeats = self._leaving.pop(key, None) is not None or key in self._down
        if not repeats:
            self._down.add(key)
        return not repeats

    @QtCore.Slot(int)
    def lift(self, key: int) -> None:
        """Handle a key's release, even if another window received the press."""
        self._leaving[key] = _TICKS
        if not self._timer.isActive():
            self._timer.start()

    @QtCore.Slot()
    def clear(self) -> None:
        """Forget all keys without a signal: their release may go to another window."""
        self._down.clear()

    @QtCore.Slot()
    def _tick(self) -> None:
        gone = [key for key, ticks in self._leaving.items() if ticks == 1]
        self._leaving = {key: ticks - 1 for key, ticks in self._leaving.items() if ticks > 1}
        if not self._leaving:
            self._timer.stop()
        for key in gone:
            if key in self._down:
                self._down.remove(key)
                self.lifted.emit(key)


def register() -> None:
    """Register the type in QML as ``RosglassDemo 1.0``."""
    register_type: Any = QtQml.qmlRegisterType  # PySide6's annotation wants bytes for names
    register_type(HeldKeys, "RosglassDemo", 1, 0, "HeldKeys")

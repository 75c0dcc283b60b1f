"""The element ``WindowKeys``: keys that are held down in a window, wherever the focus in it is."""
# ruff: noqa: N802 - the names of slots and signals are QML's

from __future__ import annotations

from typing import Any

from rosglass.controls.steering.in_front import FocusWatch, find_item
from rosglass.qml.elements.image_sinks import window_of
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QtCore, QtGui, QtQuick, Signal, Slot, is_alive

__all__ = ["WindowKeys"]

#: Milliseconds of a tick, and ticks from a release until it counts. Two, so that after a pause a
#: press that waits in the queue is handled between them.
_TICK_MS, _TICKS = 8, 2


class WindowKeys(QtCore.QObject):
    """Reports which of some keys are held down. See its page in ``docs/controls``.

    On X11, a key held down repeats as releases and presses, which Qt marks as repeats only if both
    wait in its queue; on an idle window most do not. A press within 16 ms of the release of the
    same key is therefore a repeat, and a release counts only if no such press follows.
    """

    #: A key was pressed; it was released, 8 to 16 ms ago, or by another cause than the hand.
    pressed = Signal(int)
    released = Signal(int)

    #: The keys, such as ``Qt.Key_W``.
    keys = Writable(list, [], then="_release_all")
    enabled = Writable(bool, True, then="_release_all")
    #: The keys that are held down now.
    held = ReadOnly(list, [])

    _held: list[int]

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._window: Any = None
        #: See :func:`find_item`.
        self._kept: list[Any] = []
        #: Keys whose release may be one of a repeat -> ticks until it counts.
        self._leaving: dict[int, int] = {}
        #: Scan codes of the keys that are held down -> what they meant when they were pressed.
        #: With Num Lock, AltGr or another layout since, their release has another meaning.
        self._codes: dict[int, int] = {}
        self._focus = FocusWatch(weak_callback(self._on_focus_lost))
        kinds = QtCore.QEvent.Type
        self._press, self._release = kinds.KeyPress, kinds.KeyRelease
        self._timer = QtCore.QTimer(self)
        self._timer.setInterval(_TICK_MS)
        self._timer.timeout.connect(self._tick)
        app: Any = QtCore.QCoreApplication.instance()
        if isinstance(app, QtGui.QGuiApplication):
            app.focusWindowChanged.connect(self._release_all)
        # QML sets the parent after the construction.
        QtCore.QTimer.singleShot(0, self._find_window)

    @Slot(int, result=str)
    def label(self, key: int) -> str:
        """Return what is written on a key."""
        return str(QtGui.QKeySequence(key).toString(QtGui.QKeySequence.SequenceFormat.NativeText))

    @Slot()
    def _find_window(self) -> None:
        if not is_alive(self):
            return
        item: Any = find_item(self, self._kept)
        window = window_of(item) if isinstance(item, QtQuick.QQuickItem) else item
        if isinstance(item, QtQuick.QQuickItem) and self._window is None:
            item.windowChanged.connect(self._find_window)
        if window is self._window:
            return
        if is_alive(self._window):
            self._window.removeEventFilter(self)
        self._release_all()
        self._window = window
        if window is not None:
            window.installEventFilter(self)
            window.activeFocusItemChanged.connect(self._on_focus_item)

    def _is_text(self) -> bool:
        """Return whether a text field has the focus."""
        item = self._window.activeFocusItem() if is_alive(self._window) else None
        if item is None:
            return False
        return bool(item.flags() & QtQuick.QQuickItem.Flag.ItemAcceptsInputMethod)

    def eventFilter(self, watched: QtCore.QObject, event: Any) -> bool:
        """Take the events of the keys; Qt calls this before each event of the window."""
        kind = event.type()
        if kind not in (self._press, self._release) or watched is not self._window:
            return False
        code = int(event.nativeScanCode())
        key = self._codes.get(code, int(event.key()))
        if key not in self.keys:
            return False
        if kind == self._release:
            if not event.isAutoRepeat():
                self._leaving[key] = _TICKS
                if not self._timer.isActive():
                    self._timer.setTimerType(QtCore.Qt.TimerType.PreciseTimer)
                    self._timer.start()
            return key in self._held
        repeats = self._leaving.pop(key, None) is not None or event.isAutoRepeat()
        if key in self._held:
            return True
        # A repeat of a key that is not held: it was pressed in another window, or a text field.
        if repeats or not self.enabled or _is_shortcut(event) or self._is_text():
            return False
        if code:  # none in events that were made by a program
            self._codes[code] = key
        self._focus.start()
        report(self, held=[*self._held, key])
        self.pressed.emit(key)
        return True

    @Slot()
    def _tick(self) -> None:
        gone = [key for key, ticks in self._leaving.items() if ticks == 1]
        self._leaving = {key: ticks - 1 for key, ticks in self._leaving.items() if ticks > 1}
        if not self._leaving:
            self._timer.stop()
        self._lift([key for key in gone if key in self._held])

    @Slot()
    def _on_focus_item(self) -> None:
        if is_alive(self) and self._is_text():
            self._release_all()

    def _on_focus_lost(self) -> None:
        if is_alive(self):
            # Not now: the watch cannot be stopped from its own call.
            QtCore.QTimer.singleShot(0, self._release_all)

    @Slot()
    def _release_all(self) -> None:
        """Let go of all keys: their release may go elsewhere."""
        if is_alive(self):
            self._lift(list(self._held))

    def _lift(self, gone: list[int]) -> None:
        self._codes = {code: key for code, key in self._codes.items() if key not in gone}
        if not gone or not report(self, held=[key for key in self._held if key not in gone]):
            return
        if not self._held:
            self._focus.stop()
        for key in gone:
            if is_alive(self):
                self.released.emit(key)


def _is_shortcut(event: Any) -> bool:
    # Not earlier: PySide creates all of Qt's enumerations with the first one, in 11 ms.
    kinds = QtCore.Qt.KeyboardModifier
    shortcuts = kinds.ControlModifier | kinds.AltModifier | kinds.MetaModifier
    return bool(event.modifiers() & shortcuts)

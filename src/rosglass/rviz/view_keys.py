"""Keys that move RViz's camera while its 3D view has them."""

from __future__ import annotations

import logging
import math
import time
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qt import QtCore, is_alive
from rosglass.rviz.qt5 import QtCore as Qt5Core
from rosglass.rviz.view import ViewMode

if TYPE_CHECKING:
    from rosglass.rviz.stack import Stack
    from rosglass.rviz.view import View
    from rosglass.rviz.window import Window

__all__ = ["ViewKeys"]

_log = logging.getLogger("rosglass.rviz")
_E, _Qt = Qt5Core.QEvent, Qt5Core.Qt
#: How far ahead and to the left each key leads.
_ARROWS = {
    _Qt.Key_Up: (1, 0),
    _Qt.Key_Down: (-1, 0),
    _Qt.Key_Left: (0, 1),
    _Qt.Key_Right: (0, -1),
}
#: Seconds; a frame that takes longer moves the camera no farther.
_LONGEST_STEP = 0.2


class ViewKeys(QtCore.QObject):
    """Arrow keys shift the view, twice as fast with Shift; Ctrl+D switches between 2D and 3D.

    Only while the 3D view has the focus, and no overlay has the keys.

    Args:
        window: RViz.
        view: What they move.
        overlays: Who else may have the keys.
    """

    def __init__(self, window: Window, view: View, overlays: Stack) -> None:
        super().__init__()
        self._window, self._view, self._overlays = window, view, overlays
        self._panel = window.panel
        self._settings = view.settings
        self._held: set[int] = set()
        self._twice = False
        self._last_step = 0.0
        self._panel.installEventFilter(self)
        window.before_frame.connect(self._step)
        window.closing.connect(self.close)

    def close(self) -> None:
        """Leave the keys to RViz; safe to call twice."""
        self._held.clear()
        if is_alive(self._panel):
            self._panel.removeEventFilter(self)

    def eventFilter(self, watched: Any, event: Any) -> bool:  # noqa: N802 - Qt's name
        """Return whether a key is ours, and RViz is to hear nothing of it."""
        del watched
        kind = event.type()
        if kind in (_E.FocusOut, _E.Hide, _E.WindowDeactivate):
            self._held.clear()
        if kind not in (_E.KeyPress, _E.KeyRelease, _E.ShortcutOverride) or not self._settings.keys:
            return False
        if self._is_elsewhere():
            self._held.clear()
            return False
        if _is_toggle(event):
            if kind == _E.ShortcutOverride:
                # RViz's Displays panel would take it as its own shortcut otherwise.
                event.accept()
            elif kind == _E.KeyPress and not event.isAutoRepeat():
                self._toggle()
            return True
        return self._arrow(event)

    def _arrow(self, event: Any) -> bool:
        kind, key = event.type(), event.key()
        if kind == _E.ShortcutOverride:
            return False
        pressed = kind == _E.KeyPress
        if key == _Qt.Key_Shift:
            self._twice = pressed
            return False
        if key not in _ARROWS:
            return False
        if not pressed:
            ours = key in self._held
            if not event.isAutoRepeat():
                self._held.discard(key)
            return ours
        if event.modifiers() & ~(_Qt.ShiftModifier | _Qt.KeypadModifier):
            return False
        self._twice = bool(event.modifiers() & _Qt.ShiftModifier)
        if not self._held:
            self._last_step = time.monotonic()
        self._held.add(key)
        return True

    def _is_elsewhere(self) -> bool:
        shown = self._overlays.topmost_first()
        return self._overlays.input.focused is not None or any(o.is_modal for o in shown)

    def _toggle(self) -> None:
        flat = self._view.mode is ViewMode.MODE_2D
        self._view.set_mode(ViewMode.MODE_3D if flat else ViewMode.MODE_2D)

    def _step(self) -> None:
        if not self._held:
            return
        now = time.monotonic()
        passed, self._last_step = min(now - self._last_step, _LONGEST_STEP), now
        if self._is_elsewhere() or not self._settings.keys:
            # Who has the keys now gets to know when they are released.
            self._held.clear()
            return
        ahead = sum(_ARROWS[key][0] for key in self._held)
        left = sum(_ARROWS[key][1] for key in self._held)
        length = math.hypot(ahead, left)
        if not length or not passed:
            return
        metres = self._settings.speed * (2 if self._twice else 1) * passed / length
        try:
            self._view.nudge(ahead * metres, left * metres)
        except Error as error:
            self._held.clear()
            _log.warning("%s", error)


def _is_toggle(event: Any) -> bool:
    return bool(event.key() == _Qt.Key_D and event.modifiers() == _Qt.ControlModifier)

"""The mouse, fingers and keys over a view, given to its tools."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

from PySide6.QtGui import QEventPoint, QGuiApplication

from rosglass.qt import QtCore, Slot, is_alive
from rosglass.scene.tools.pointer_event import PointerEvent
from rosglass.scene.view_controllers.events import Button, Modifier, Touch, Wheel

if TYPE_CHECKING:
    from rosglass.scene.tools.tool_manager import Tools

__all__ = ["PointerInput"]

#: Milliseconds from a change of the scene to a look at what is under the mouse now: RViz's.
_HOVER_MS = 33
#: With these, a key is a command of the program and no tool's.
_COMMAND_KEYS = int(Modifier.CTRL | Modifier.ALT | Modifier.META)
_BUTTONS = int(Button.LEFT | Button.RIGHT | Button.MIDDLE)
_MODIFIERS = int(Modifier.SHIFT | Modifier.CTRL | Modifier.ALT)


class PointerInput(QtCore.QObject):
    """Gives the events of a view to its tools.

    Attributes:
        touched_at: When the wheel or a finger has last moved the camera, by the clock of
            :func:`time.monotonic`.

    Args:
        view: The ``SceneView``.
        tools: Its tools.
    """

    def __init__(self, view: Any, tools: Tools) -> None:
        super().__init__(view)
        self._view, self._tools = view, tools
        self.touched_at = -math.inf
        self._pointed = QtCore.QPointF()
        self._fingers: dict[int, QtCore.QPointF] = {}
        #: Whether a finger is the left button of a tool.
        self._finger_is_button = False
        #: Whether the mouse is in the view, and when something has moved under it.
        self._is_hovered = False
        self._hover = QtCore.QTimer(self)
        self._hover.setSingleShot(True)
        self._hover.setInterval(_HOVER_MS)
        self._hover.timeout.connect(self._hover_again)

    def _event(self, event: Any) -> PointerEvent:
        """Return an event of the mouse, and remember where it is."""
        at, before = event.position(), self._pointed
        self._pointed = at
        return PointerEvent(
            self._view,
            (at.x(), at.y()),
            (at.x() - before.x(), at.y() - before.y()),
            Button(event.button().value & _BUTTONS),
            Button(event.buttons().value & _BUTTONS),
            Modifier(event.modifiers().value & _MODIFIERS),
        )

    def _event_at(self, at: QtCore.QPointF, event: Any, *, finger: bool = False) -> PointerEvent:
        """Return an event that is none of the mouse's."""
        held = Modifier(event.modifiers().value & _MODIFIERS)
        before, self._pointed = self._pointed, at
        moved = (at.x() - before.x(), at.y() - before.y()) if finger else (0.0, 0.0)
        return PointerEvent(self._view, (at.x(), at.y()), moved, modifiers=held)

    def press(self, event: Any) -> None:
        """Pass a press to the tool, or start to drag the camera."""
        if self._view.focusOnClick:
            self._view.forceActiveFocus(QtCore.Qt.FocusReason.MouseFocusReason)
        self._view.stop_turning()
        event.accept()
        self._tools.on_press(self._event(event))
        if is_alive(self._view):
            self._view.show_focal_shape()

    def move(self, event: Any) -> None:
        """Pass a drag to the tool, or drag the camera."""
        self._tools.on_move(self._event(event))
        event.accept()

    def release(self, event: Any) -> None:
        """End a drag."""
        event.accept()
        self._tools.on_release(self._event(event))
        if is_alive(self._view):
            self._view.show_focal_shape()

    def ungrab(self) -> None:
        """Drop a drag that another item has taken over."""
        if is_alive(self._view):
            self._tools.cancel()
            self._view.show_focal_shape()

    def hover(self, event: Any) -> None:
        """Show the object under the mouse."""
        self._is_hovered = True
        self._tools.on_move(self._event_at(event.position(), event))

    def leave(self) -> None:
        """Show nothing any more of what was under the mouse."""
        self._is_hovered = False
        self._tools.on_leave()

    @Slot()
    def hover_later(self) -> None:
        """Show soon what is under the mouse now: something has moved."""
        if self._is_hovered and not self._hover.isActive():
            self._hover.start()

    @Slot()
    def _hover_again(self) -> None:
        """Show the object under the resting mouse."""
        if self._is_hovered and not self._tools.holds_mouse:
            modifiers = Modifier(QGuiApplication.keyboardModifiers().value & _MODIFIERS)
            at = (self._pointed.x(), self._pointed.y())
            self._tools.on_move(PointerEvent(self._view, at, modifiers=modifiers))
            if is_alive(self._view):
                # A tool's own feedback does not require another look.
                self._hover.stop()

    def wheel(self, event: Any) -> None:
        """Zoom."""
        self._view.stop_turning()
        self.touched_at = time.monotonic()
        at = self._event_at(event.position(), event)
        self._tools.on_wheel(at, Wheel(event.angleDelta().y() / 120, at.modifiers))
        event.accept()

    def touch(self, event: Any) -> None:
        """Treat one finger as the tool's left button; else rotate, move and zoom by fingers."""
        event.accept()
        self._view.stop_turning()
        self.touched_at = time.monotonic()
        points = event.points()
        now = {point.id(): point.position() for point in points}
        held = {p.id(): p.position() for p in points if p.state() != QEventPoint.State.Released}
        if self._finger_is_button and len(now) > 1:
            self._finger_is_button = False
            self._tools.cancel()
        elif len(now) == 1:
            (point,) = points
            pointer = self._event_at(point.position(), event, finger=True)
            # Not a finger that has stayed after a pinch: its release would send a goal.
            if not self._fingers and point.state() == QEventPoint.State.Pressed:
                pointer.button = pointer.buttons = Button.LEFT
                self._finger_is_button = self._tools.on_press(pointer)
                if not self._finger_is_button:
                    self._tools.cancel()
            elif self._finger_is_button:
                if not held:
                    pointer.button = Button.LEFT
                    self._tools.on_release(pointer)
                    self._finger_is_button = False
                else:
                    pointer.buttons = Button.LEFT
                    self._tools.on_move(pointer)
                self._fingers = held
                return
        self._drag_by_fingers(now)
        self._fingers = held

    def _drag_by_fingers(self, now: dict[int, QtCore.QPointF]) -> None:
        ids = [one for one in now if one in self._fingers]
        if ids and len(now) == len(self._fingers):
            before = [(self._fingers[one].x(), self._fingers[one].y()) for one in ids]
            after = [(now[one].x(), now[one].y()) for one in ids]
            self._tools.on_touch(
                Touch.between(before, after, (self._view.width(), self._view.height()))
            )

    def ungrab_touch(self) -> None:
        """Cancel a drag that another item has taken over."""
        if is_alive(self._view):
            self._fingers, self._finger_is_button = {}, False
            self._tools.cancel()

    def press_key(self, event: Any) -> None:
        """Handle the keys of tools, F and Z, and Escape."""
        self._tools.on_modifiers(Modifier(event.modifiers().value & _MODIFIERS))
        used = False
        if event.key() == QtCore.Qt.Key.Key_Escape:
            used = self._tools.on_escape()
        elif event.text() and not (event.isAutoRepeat() or event.modifiers().value & _COMMAND_KEYS):
            used = self._tools.on_key(event.text(), self._event_at(self._pointed, event))
        event.setAccepted(used)

    def release_key(self, event: Any) -> None:
        """Follow keys like Shift."""
        self._tools.on_modifiers(Modifier(event.modifiers().value & _MODIFIERS))
        event.ignore()

"""Routing of mouse, touch and keyboard events of RViz's 3D view to the overlays."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Any

from rosglass.qt import is_alive
from rosglass.rviz.overlay import guarded
from rosglass.rviz.qt5 import QtCore, QtGui, QtWidgets

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.overlay.overlay import Overlay
    from rosglass.rviz.window import Window

__all__ = [
    "DRAG",
    "FAR_OUTSIDE",
    "KEYS",
    "MOUSE",
    "PRESS",
    "TOUCH",
    "Input",
    "mouse_event",
    "position",
    "releases",
    "scaled",
]


_E = QtCore.QEvent
#: Presses of a mouse button.
PRESS = frozenset({_E.MouseButtonPress, _E.MouseButtonDblClick})
#: Mouse events with a position and buttons.
MOUSE = PRESS | {_E.MouseButtonRelease, _E.MouseMove}
#: Touch events.
TOUCH = frozenset({_E.TouchBegin, _E.TouchUpdate, _E.TouchEnd, _E.TouchCancel})
#: Key events, including Qt's question whether a key is a shortcut.
KEYS = frozenset({_E.KeyPress, _E.KeyRelease, _E.ShortcutOverride})
#: Drag and drop events.
DRAG = frozenset({_E.DragEnter, _E.DragMove, _E.Drop})

#: All mouse buttons that Qt knows.
_BUTTONS = [QtCore.Qt.MouseButton(1 << bit) for bit in range(27)]
#: A position outside of all widgets and items.
FAR_OUTSIDE = QtCore.QPointF(-1e5, -1e5)


def releases(held: Any) -> Iterator[Any]:
    """Iterate over mouse events that release all held buttons, outside of all widgets and items."""
    none = QtCore.Qt.NoModifier
    for button in _BUTTONS:
        if int(held) & int(button):
            held &= ~button
            yield QtGui.QMouseEvent(_E.MouseButtonRelease, FAR_OUTSIDE, button, held, none)


def position(event: Any) -> Any:
    """Return an event's position, a QPointF; None for events without a position."""
    kind = event.type()
    if kind in MOUSE:
        return event.localPos()
    if kind == _E.Wheel:
        return event.position()
    if kind in TOUCH:
        points = event.touchPoints()
        return points[0].pos() if points else None
    if kind == _E.Drop:
        return event.posF()
    if kind in DRAG or kind in (_E.ContextMenu, _E.ToolTip):
        return QtCore.QPointF(event.pos())
    return None


def scaled(event: Any, factor: float) -> Any:
    """Return a copy of an event with scaled positions; the event itself if it has none."""
    make = _COPIERS.get(event.type())
    if make is None:
        return event
    made = make(event, factor)
    if isinstance(event, QtGui.QInputEvent):
        # QML computes the speed of a flick from the timestamp.
        made.setTimestamp(event.timestamp())
    return made


def mouse_event(event: Any, kind: Any, factor: float = 1.0) -> Any:
    """Return a copy of a mouse event with another type, and with scaled positions."""
    at = event.localPos() * factor
    made = QtGui.QMouseEvent(
        kind,
        at,
        at,
        event.screenPos(),
        event.button(),
        event.buttons(),
        event.modifiers(),
        event.source(),
    )
    made.setTimestamp(event.timestamp())
    return made


def _mouse(event: Any, factor: float) -> Any:
    return mouse_event(event, event.type(), factor)


def _wheel(event: Any, factor: float) -> Any:
    return QtGui.QWheelEvent(
        event.position() * factor,
        event.globalPosition(),
        event.pixelDelta(),
        event.angleDelta(),
        event.buttons(),
        event.modifiers(),
        event.phase(),
        event.inverted(),
        event.source(),
    )


def _touch(event: Any, factor: float) -> Any:
    points = [_touch_point(point, factor) for point in event.touchPoints()]
    return QtGui.QTouchEvent(
        event.type(), event.device(), event.modifiers(), event.touchPointStates(), points
    )


def _touch_point(point: Any, factor: float) -> Any:
    made = QtGui.QTouchEvent.TouchPoint(point)
    for now, setters in (
        (point.pos(), (made.setPos, made.setScenePos)),
        (point.startPos(), (made.setStartPos, made.setStartScenePos)),
        (point.lastPos(), (made.setLastPos, made.setLastScenePos)),
    ):
        for put in setters:
            put(now * factor)
    return made


def _drag(event: Any, factor: float) -> Any:
    kind = {_E.DragEnter: QtGui.QDragEnterEvent, _E.DragMove: QtGui.QDragMoveEvent}
    make = kind.get(event.type(), QtGui.QDropEvent)
    at = position(event) * factor
    if make is not QtGui.QDropEvent:
        at = at.toPoint()
    made = make(
        at,
        event.possibleActions(),
        event.mimeData(),
        event.mouseButtons(),
        event.keyboardModifiers(),
    )
    made.setDropAction(event.dropAction())
    return made


def _context_menu(event: Any, factor: float) -> Any:
    at = (position(event) * factor).toPoint()
    return QtGui.QContextMenuEvent(event.reason(), at, event.globalPos(), event.modifiers())


def _help(event: Any, factor: float) -> Any:
    at = (position(event) * factor).toPoint()
    return QtGui.QHelpEvent(event.type(), at, event.globalPos())


_COPIERS: dict[Any, Callable[[Any, float], Any]] = {
    **dict.fromkeys(MOUSE, _mouse),
    **dict.fromkeys(TOUCH, _touch),
    **dict.fromkeys(DRAG, _drag),
    _E.Wheel: _wheel,
    _E.ContextMenu: _context_menu,
    _E.ToolTip: _help,
}


_NONE = QtCore.Qt.NoButton
#: Events of RViz's window after which it may miss the release of buttons and fingers.
_INPUT_LOSS_EVENTS = frozenset({_E.WindowDeactivate, _E.WindowBlocked, _E.Hide})
#: Milliseconds between checks whether the mouse has left the view without an event.
_HOVER_CHECK_PERIOD_MS = 100


class Owner(enum.Enum):
    """Owner of the mouse that is not an overlay, until all buttons are released."""

    RVIZ = 1
    #: No receiver: the overlay was removed, or a modal popup blocks the press.
    NONE = 2


class Input(QtCore.QObject):  # type: ignore[misc]
    """Routes the events of RViz's 3D view to the overlays and to RViz.

    It offers an event to the overlays from the top, popups first. The overlay that accepts a press
    grabs the mouse until all buttons are released, and gets the keyboard focus. RViz gets events
    that no overlay accepts, unless a modal popup is shown.

    Args:
        window: RViz's window.
        topmost_first: Returns the visible overlays, topmost first.
        raise_popup: Raises a popup above all others; does nothing for other overlays.
    """

    def __init__(
        self,
        window: Window,
        topmost_first: Callable[[], list[Overlay]],
        raise_popup: Callable[[Overlay], None],
    ) -> None:
        super().__init__()
        self._window, self._topmost_first, self._raise_popup = window, topmost_first, raise_popup
        self._panel = window.panel
        self._mouse_owner: Overlay | Owner | None = None
        self._touch_target: Overlay | None = None
        self._hovered: Overlay | None = None
        self._drag_target: Overlay | None = None
        self._focused: Overlay | None = None
        self._depth = 0
        self._deferred: list[Callable[[], None]] = []
        #: Handlers by event type; each returns whether it accepts the event.
        self.routes: dict[Any, Callable[[Any], bool]] = {
            **dict.fromkeys(KEYS | {_E.InputMethod, _E.InputMethodQuery}, self._key),
            **dict.fromkeys(TOUCH, self._touch),
            **dict.fromkeys(DRAG | {_E.DragLeave}, self._drag),
            **dict.fromkeys(PRESS, self._press),
            _E.MouseMove: self._move,
            _E.MouseButtonRelease: self._release,
            _E.Wheel: self._wheel,
            _E.ContextMenu: self._deliver_to_owner,
            _E.ToolTip: self._deliver_to_owner,
            _E.Leave: self._on_leave,
            _E.FocusIn: self._focus_event,
            _E.FocusOut: self._focus_event,
        }
        self._panel.setAttribute(QtCore.Qt.WA_AcceptTouchEvents)
        self._panel.setAcceptDrops(True)
        self._panel.installEventFilter(self)
        window.widget.installEventFilter(self)
        self._hover_timer = QtCore.QTimer()
        self._hover_timer.setInterval(_HOVER_CHECK_PERIOD_MS)
        self._hover_timer.timeout.connect(self._update_hover)

    @property
    def focused(self) -> Overlay | None:
        """The overlay with the keyboard focus; None if RViz has it."""
        return self._focused

    def focus(self, overlay: Overlay | None) -> None:
        """Give the keyboard focus to an overlay, or to RViz with None."""
        before, self._focused = self._focused, overlay
        self._panel.setAttribute(QtCore.Qt.WA_InputMethodEnabled, overlay is not None)
        if overlay is not None and not self._panel.hasFocus():
            self._panel.setFocus(QtCore.Qt.MouseFocusReason)
        if before is overlay:
            return
        for which in (before, overlay):
            if which is not None:
                with guarded(which, "changing the keyboard focus"):
                    which.set_focus(which is overlay)

    def forget(self, overlay: Overlay) -> None:
        """Take mouse, touch and keyboard focus away from an overlay."""
        if self._mouse_owner is overlay:
            self._mouse_owner = Owner.NONE
            self._leave(overlay)
        if self._touch_target is overlay:
            self._touch_target = None
            self._leave(overlay)
        if self._hovered is overlay:
            self._hovered = None
            self._leave(overlay)
            self._panel.unsetCursor()
        if self._drag_target is overlay:
            self._drag_target = None
        if self._focused is overlay:
            self.focus(None)

    def after_event(self, call: Callable[[], None]) -> None:
        """Call a function when no overlay is handling an event."""
        if self._depth:
            self._deferred.append(call)
        else:
            call()

    def close(self) -> None:
        """Stop filtering RViz's events."""
        self._hover_timer.stop()
        for watched in (self._panel, self._window.widget):
            if is_alive(watched):
                watched.removeEventFilter(self)

    def eventFilter(self, watched: Any, event: Any) -> bool:  # noqa: N802 - Qt's name
        """Return whether an overlay accepts an event, so that RViz must not get it."""
        if not is_alive(self._panel):
            return False
        if watched is not self._panel:
            minimized = event.type() == _E.WindowStateChange and watched.isMinimized()
            if event.type() in _INPUT_LOSS_EVENTS or minimized:
                self._cancel_input()
            return False
        route = self.routes.get(event.type())
        # Without visible overlays, RViz gets its events unchanged.
        if route is None or not (self._mouse_owner or self._topmost_first()):
            return False
        accepted = event.isAccepted()
        self._depth += 1
        try:
            taken = route(event)
        finally:
            self._depth -= 1
            if not self._depth:
                later, self._deferred = self._deferred, []
                for call in later:
                    call()
        if event.type() not in DRAG:
            # RViz gets an event with its original flag, except for touch: it must ignore touch, so
            # that Qt sends mouse events for it.
            event.setAccepted(taken or (accepted and event.type() not in TOUCH))
        return taken

    # Delivery

    def _offer(self, event: Any) -> tuple[Overlay | None, bool]:
        """Return the overlay that accepts an event, or None and whether RViz may get it."""
        for overlay in self._topmost_first():
            if self._deliver(overlay, event):
                return overlay, False
            if overlay.is_modal:
                return None, False
        return None, True

    def _deliver(self, overlay: Overlay, event: Any) -> bool:
        with guarded(overlay, "handling input"):
            return overlay.deliver(scaled(event, 1 / overlay.scale))
        return False

    @staticmethod
    def _leave(overlay: Overlay) -> None:
        with guarded(overlay, "handling that the mouse has left"):
            overlay.leave()

    # Mouse

    def _press(self, event: Any) -> bool:
        if event.buttons() == event.button():
            # The release of the previous press may have gone to another window.
            self._end_capture()
        if self._mouse_owner is None:
            overlay, for_rviz = self._offer(event)
            if overlay is not None and overlay not in self._topmost_first():
                self._mouse_owner = Owner.NONE
            elif overlay is not None:
                self._mouse_owner = overlay
                self._raise_popup(overlay)
                self.focus(overlay)
            else:
                self._mouse_owner = Owner.RVIZ if for_rviz else Owner.NONE
                if for_rviz:
                    self.focus(None)
                    self.hover(None)
        elif not isinstance(self._mouse_owner, Owner):
            self._deliver(self._mouse_owner, event)
        return self._mouse_owner is not Owner.RVIZ

    def _release(self, event: Any) -> bool:
        owner = self._mouse_owner
        if owner is None:
            return False
        if not isinstance(owner, Owner):
            self._deliver(owner, event)
        if event.buttons() == _NONE:
            self._mouse_owner = None
            if owner is not Owner.RVIZ:
                self._move(_hover_move(event))
        return owner is not Owner.RVIZ

    def _move(self, event: Any) -> bool:
        if event.buttons() == _NONE:
            self._end_capture()
        elif self._mouse_owner is None:
            return False
        if self._mouse_owner is None:
            overlay, for_rviz = self._offer(event)
            self.hover(overlay)
            if overlay is None and not for_rviz:
                self._panel.setCursor(QtCore.Qt.ArrowCursor)
            return not (overlay is None and for_rviz)
        if not isinstance(self._mouse_owner, Owner):
            self._deliver(self._mouse_owner, event)
            if not isinstance(self._mouse_owner, Owner):
                self._show_cursor(self._mouse_owner)
        return self._mouse_owner is not Owner.RVIZ

    def _end_capture(self) -> None:
        owner, self._mouse_owner = self._mouse_owner, None
        if owner is not None and not isinstance(owner, Owner):
            self._leave(owner)

    def hover(self, overlay: Overlay | None) -> None:
        """Set the overlay under the mouse, and end hovering over the previous one."""
        before, self._hovered = self._hovered, overlay
        if before is not None and before is not overlay:
            self._leave(before)
            # RViz sets its tool's cursor again on its next event.
            self._panel.unsetCursor()
        if overlay is not None:
            self._show_cursor(overlay)
            self._hover_timer.start()
        else:
            self._hover_timer.stop()

    def _update_hover(self) -> None:
        """End hovering if the mouse has left RViz's view, which may get no event for it."""
        over = QtWidgets.QApplication.widgetAt(QtGui.QCursor.pos())
        if self._mouse_owner is None and over is not self._panel:
            self.hover(None)

    def _show_cursor(self, overlay: Overlay) -> None:
        with guarded(overlay, "choosing the cursor"):
            self._panel.setCursor(overlay.cursor() or QtGui.QCursor(QtCore.Qt.ArrowCursor))

    def _on_leave(self, event: Any) -> bool:
        del event
        if self._mouse_owner is None:
            self.hover(None)
        return False

    def _wheel(self, event: Any) -> bool:
        if self._mouse_owner is None:
            overlay, for_rviz = self._offer(event)
            return overlay is not None or not for_rviz
        if not isinstance(self._mouse_owner, Owner):
            self._deliver(self._mouse_owner, event)
        return self._mouse_owner is not Owner.RVIZ

    def _deliver_to_owner(self, event: Any) -> bool:
        """Send an event to the overlay under the mouse, or to the one with the keyboard focus."""
        if event.type() == _E.ContextMenu and event.reason() == QtGui.QContextMenuEvent.Keyboard:
            return self._key(event)
        if self._mouse_owner is Owner.RVIZ:
            return False
        which = self._mouse_owner or self._hovered
        if which is not None and not isinstance(which, Owner):
            self._deliver(which, event)
        return which is not None

    # Touch and drags

    def _touch(self, event: Any) -> bool:
        if event.type() == _E.TouchBegin:
            overlay, for_rviz = self._offer(event)
            self._touch_target = overlay if overlay in self._topmost_first() else None
            if self._touch_target is not None:
                self._raise_popup(self._touch_target)
                self.focus(self._touch_target)
            # Qt sends mouse events for a touch that is not accepted.
            return overlay is not None or not for_rviz
        touched = self._touch_target
        if touched is None:
            return False
        if event.type() in (_E.TouchEnd, _E.TouchCancel):
            self._touch_target = None
        self._deliver(touched, event)
        return True

    def _drag(self, event: Any) -> bool:
        before, over = self._drag_target, None
        for overlay in [] if event.type() == _E.DragLeave else self._topmost_first():
            sent = scaled(event, 1 / overlay.scale)
            taken = False
            with guarded(overlay, "handling a drag"):
                taken = overlay.deliver(sent)
            if taken:
                over = overlay
                event.setDropAction(sent.dropAction())
            if taken or overlay.is_modal:
                break
        self._drag_target = None if event.type() == _E.Drop else over
        if before is not None and before is not over:
            self._deliver(before, QtGui.QDragLeaveEvent())
        # Qt sends DragMove only to a widget that has accepted DragEnter.
        event.setAccepted(over is not None or event.type() in (_E.DragEnter, _E.DragLeave))
        return True

    # Keys

    def _key(self, event: Any) -> bool:
        focused = self._focused
        if focused is None:
            return any(overlay.is_modal for overlay in self._topmost_first())
        if self._deliver(focused, event):
            return True
        if event.type() == _E.KeyPress and event.key() == QtCore.Qt.Key_Escape:
            self.focus(None)
        return focused.is_modal

    def _focus_event(self, event: Any) -> bool:
        changes = [event.type() == _E.FocusIn]
        if event.reason() == QtCore.Qt.PopupFocusReason:
            # An open menu grabs mouse and keyboard, so presses must be cancelled. Overlays regain
            # the focus at once, because Qt Quick does not get it back when the menu closes.
            changes = [] if changes[0] else [False, True]
            if changes:
                self._cancel_input()
        for focus in changes:
            if self._focused is not None:
                with guarded(self._focused, "changing the keyboard focus"):
                    self._focused.set_focus(focus)
        return False

    # Window and overlay changes

    def _cancel_input(self) -> None:
        """Cancel presses and touches, because their release may never arrive."""
        if self._mouse_owner is not None and not isinstance(self._mouse_owner, Owner):
            owner, self._mouse_owner = self._mouse_owner, Owner.NONE
            self._leave(owner)
        touched, self._touch_target = self._touch_target, None
        if touched is not None:
            self._leave(touched)
        self.hover(None)

    def on_stack_changed(self) -> None:
        """Drop what belongs to overlays that are not shown any more."""
        shown = self._topmost_first()
        for which in (self._mouse_owner, self._touch_target, self._hovered, self._focused):
            if which is not None and not isinstance(which, Owner) and which not in shown:
                self.forget(which)
        modal = next((number for number, o in enumerate(shown) if o.is_modal), None)
        if modal is not None and self._focused not in shown[: modal + 1]:
            self.focus(shown[modal])


def _hover_move(event: Any) -> Any:
    """Return a mouse move at the position of a release, to update hovering."""
    made = QtGui.QMouseEvent(
        _E.MouseMove,
        event.localPos(),
        event.windowPos(),
        event.screenPos(),
        _NONE,
        _NONE,
        event.modifiers(),
    )
    made.setTimestamp(event.timestamp())
    return made

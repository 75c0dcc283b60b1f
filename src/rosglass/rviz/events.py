"""Events of one widget as another one gets them, whose units have another size."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.rviz.qt5 import QtCore, QtGui

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = [
    "BUTTONS",
    "DRAG",
    "FAR_OUTSIDE",
    "KEYS",
    "MOUSE",
    "PRESS",
    "TOUCH",
    "position",
    "release_outside",
    "scaled",
]

_E = QtCore.QEvent
#: A button of the mouse went down.
PRESS = frozenset({_E.MouseButtonPress, _E.MouseButtonDblClick})
#: Mouse events with a position and buttons.
MOUSE = PRESS | {_E.MouseButtonRelease, _E.MouseMove}
#: Touch screens.
TOUCH = frozenset({_E.TouchBegin, _E.TouchUpdate, _E.TouchEnd, _E.TouchCancel})
#: Keys, and whether one is a shortcut of the window.
KEYS = frozenset({_E.KeyPress, _E.KeyRelease, _E.ShortcutOverride})
#: Something is dragged here from elsewhere.
DRAG = frozenset({_E.DragEnter, _E.DragMove, _E.Drop})

#: Every button that a mouse may have.
BUTTONS = [QtCore.Qt.MouseButton(1 << bit) for bit in range(27)]
#: A place that is in no widget and no item.
FAR_OUTSIDE = QtCore.QPointF(-1e5, -1e5)


def release_outside(button: Any, left: Any) -> Any:
    """Return a release for nothing.

    Args:
        button: What goes up.
        left: The buttons that are still down.
    """
    none = QtCore.Qt.NoModifier
    return QtGui.QMouseEvent(_E.MouseButtonRelease, FAR_OUTSIDE, button, left, none)


def position(event: Any) -> Any:
    """Return where an event happened, a QPointF; None for one that has no place."""
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
    """Return a copy of an event with its positions multiplied; itself when it has none."""
    make = _MAKERS.get(event.type())
    if make is None:
        return event
    made = make(event, factor)
    if isinstance(event, QtGui.QInputEvent):
        # QML tells from it how fast something is flicked.
        made.setTimestamp(event.timestamp())
    return made


def _mouse(event: Any, factor: float) -> Any:
    at = event.localPos() * factor
    return QtGui.QMouseEvent(
        event.type(),
        at,
        at,
        event.screenPos(),
        event.button(),
        event.buttons(),
        event.modifiers(),
        event.source(),
    )


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


_MAKERS: dict[Any, Callable[[Any, float], Any]] = {
    **dict.fromkeys(MOUSE, _mouse),
    **dict.fromkeys(TOUCH, _touch),
    **dict.fromkeys(DRAG, _drag),
    _E.Wheel: _wheel,
    _E.ContextMenu: _context_menu,
    _E.ToolTip: _help,
}

"""How a scene of QML, which no window of its own shows, gets its mouse, touch and keys."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.qt import is_alive
from rosglass.rviz.events import (
    BUTTONS,
    DRAG,
    FAR_OUTSIDE,
    KEYS,
    PRESS,
    TOUCH,
    position,
    release_outside,
    scaled,
)
from rosglass.rviz.qt5 import QtCore, QtGui, shiboken

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

__all__ = ["QmlInput"]

_E = QtCore.QEvent
_TAKING = ("QQuickTapHandler", "QQuickDragHandler", "QQuickPointHandler", "QQuickPinchHandler")
_INPUT_METHOD = frozenset({_E.InputMethod, _E.InputMethodQuery})
_FOR_SCENE = PRESS | TOUCH | DRAG | KEYS | _INPUT_METHOD
_FOR_SCENE |= {_E.MouseMove, _E.MouseButtonRelease, _E.Wheel, _E.DragLeave}
_TOUCH_ENDS = frozenset({_E.TouchEnd, _E.TouchCancel})
#: Seconds for which the list of items that take note of the mouse is kept.
_KEPT = 0.25


class QmlInput:
    """Input of a QQuickWindow, for the class that has ``_window`` and ``_ratio``.

    Qt tells by ``accepted`` whether an item took a button, a key or the wheel. It does not for
    hovering, for what pointer handlers wait for, and for touch, so the items are asked.
    """

    _window: Any
    #: The widget that shows it; Qt Quick sets the mouse's shape on the window of that.
    _panel: Any = None
    #: Units of the window for one of the overlay.
    _ratio = 1.0
    #: The buttons that went down on an item and are not up yet.
    _held = QtCore.Qt.NoButton
    #: Where the fingers are that went down on an item, for the window's events.
    _touch: _Touch | None = None
    _hoverable: Sequence[_Shown] = ()
    _listed = 0.0

    def deliver(self, event: Any) -> bool:
        """Give the event to the item it is for."""
        window, kind = self._window, event.type()
        if kind not in _FOR_SCENE or not is_alive(window):
            return False
        if kind in _INPUT_METHOD:
            return _send(window.focusObject() or window, event)
        at = position(event)
        at = None if at is None else at * self._ratio
        if kind == _E.TouchBegin and not _takes_touch(window, at):
            return False
        if kind == _E.MouseButtonDblClick:
            # A window gets the second press as such before it hears that it is a double click.
            taken = self._deliver(_pressing(event), at)
            return self._deliver(event, at) or taken if taken else False
        return self._deliver(event, at)

    def _deliver(self, event: Any, at: Any) -> bool:
        window, kind = self._window, event.type()
        sent = scaled(event, self._ratio)
        if kind in TOUCH:
            self._touch = None if kind in _TOUCH_ENDS else _Touch.of(sent)
        elif kind == _E.MouseButtonRelease:
            self._held = event.buttons()
        taken = _send(window, sent)
        if not is_alive(window):
            return taken
        if kind in PRESS:
            taken = taken or any(_takes_press(h, event.button()) for h in _handlers(window, at))
            if taken:
                self._held = event.buttons()
        elif kind == _E.MouseMove:
            taken = taken or self._is_hovered(at) or self.cursor() is not None
        elif kind == _E.Wheel and not taken:
            taken = any(
                h.metaObject().className() == "QQuickWheelHandler" and h.property("active")
                for h in _handlers(window, at)
            )
        return taken

    def leave(self) -> None:
        """End hovering, and let go without effect of what is pressed."""
        window = self._window
        if not is_alive(window):
            return
        if self._held or self._touch is not None:
            self._let_go()
        if not is_alive(window):
            return
        QtCore.QCoreApplication.sendEvent(window, QtCore.QEvent(_E.Leave))
        if self._shown_in() is not None:
            self._shown_in().unsetCursor()

    def _let_go(self) -> None:
        """Have nothing pressed any more: items hear that it was cancelled."""
        window, content = self._window, self._window.contentItem()
        held, self._held = self._held, QtCore.Qt.NoButton
        touch, self._touch = self._touch, None
        # Handlers do not mind whether their item is enabled. A TapHandler lets go of what is
        # released elsewhere, any other one of an event that comes while it is disabled itself.
        disabled = [h for h in _all_handlers(content) if not _is_tap(h) and h.property("enabled")]
        content.setEnabled(False)
        for handler in filter(is_alive, disabled):
            handler.setProperty("enabled", False)
        for button in BUTTONS:
            if int(held) & int(button) and is_alive(window):
                held &= ~button
                _send(window, release_outside(button, held))
        if touch is not None and is_alive(window):
            for event in touch.ended():
                _send(window, event)
        for handler in filter(is_alive, disabled):
            handler.setProperty("enabled", True)
        if is_alive(content):
            content.setEnabled(True)

    def set_focus(self, focus: bool) -> None:
        """Give keys to the item that has the focus in its scope, or take them away."""
        if is_alive(self._window):
            event = QtGui.QFocusEvent(_E.FocusIn if focus else _E.FocusOut)
            QtCore.QCoreApplication.sendEvent(self._window, event)

    def cursor(self) -> Any:
        """Return the shape that the item under the mouse wants; None for none in particular."""
        shown_in = self._shown_in()
        if shown_in is None or shown_in.cursor().shape() == QtCore.Qt.ArrowCursor:
            return None
        return shown_in.cursor()

    def _shown_in(self) -> Any:
        return self._panel.window().windowHandle() if is_alive(self._panel) else None

    def _is_hovered(self, at: Any) -> bool:
        now = time.monotonic()
        if now - self._listed > _KEPT:
            self._listed = now
            self._hoverable = [s for s in _shown(self._window) if s.item.acceptHoverEvents()]
        return any(shown.has(at) for shown in self._hoverable)


class _Shown(NamedTuple):
    """An item, and those around it beyond which it is not seen."""

    item: Any
    clips: tuple[Any, ...]

    def has(self, at: Any) -> bool:
        """Return whether a place of the window is in it, and it may get what happens there."""
        if not all(is_alive(item) for item in (self.item, *self.clips)):
            return False
        return bool(
            self.item.isVisible()
            and self.item.isEnabled()
            and all(item.contains(item.mapFromScene(at)) for item in (self.item, *self.clips))
        )


class _Touch(NamedTuple):
    """Fingers, as they were last heard of."""

    #: Of the QTouchDevice; PySide2's object for it ends with the event.
    device: int
    points: list[Any]

    @classmethod
    def of(cls, event: Any) -> _Touch:
        """Remember an event."""
        device = shiboken.getCppPointer(event.device())[0]
        return cls(device, [QtGui.QTouchEvent.TouchPoint(p) for p in event.touchPoints()])

    def ended(self) -> Iterator[Any]:
        """Iterate over the events by which all of them go up far outside, for nothing."""
        device = shiboken.wrapInstance(self.device, QtGui.QTouchDevice)
        for point in self.points:
            point.setState(QtCore.Qt.TouchPointReleased)
            for put in (point.setPos, point.setScenePos):
                put(FAR_OUTSIDE)
        none = QtCore.Qt.NoModifier
        yield QtGui.QTouchEvent(_E.TouchCancel, device, none)
        yield QtGui.QTouchEvent(
            _E.TouchEnd, device, none, QtCore.Qt.TouchPointReleased, self.points
        )


def _send(receiver: Any, event: Any) -> bool:
    event.setAccepted(False)
    QtCore.QCoreApplication.sendEvent(receiver, event)
    return bool(event.isAccepted())


def _pressing(event: Any) -> Any:
    made = QtGui.QMouseEvent(
        _E.MouseButtonPress,
        event.localPos(),
        event.windowPos(),
        event.screenPos(),
        event.button(),
        event.buttons(),
        event.modifiers(),
        event.source(),
    )
    made.setTimestamp(event.timestamp())
    return made


def _shown(window: Any) -> Iterator[_Shown]:
    """Iterate over all items that are shown."""
    waiting = [_Shown(item, ()) for item in window.contentItem().childItems()]
    while waiting:
        shown = waiting.pop()
        item, clips = shown
        if item.isVisible():
            yield shown
            inside = (*clips, item) if item.clip() else clips
            waiting += [_Shown(child, inside) for child in item.childItems()]


def _all_handlers(item: Any) -> Iterator[Any]:
    """Iterate over the pointer handlers of an item and all in it."""
    yield from (c for c in item.children() if c.metaObject().className().endswith("Handler"))
    for child in item.childItems():
        yield from _all_handlers(child)


def _is_tap(handler: Any) -> bool:
    return bool(handler.metaObject().className() == "QQuickTapHandler")


def _handlers(window: Any, at: Any) -> Iterator[Any]:
    """Iterate over the enabled pointer handlers of the items at a place."""
    for shown in _shown(window):
        children = shown.item.children()
        found = [c for c in children if c.metaObject().className().endswith("Handler")]
        if found and shown.has(at):
            yield from (handler for handler in found if handler.property("enabled"))


def _takes_press(handler: Any, button: Any) -> bool:
    name = handler.metaObject().className()
    buttons = handler.property("acceptedButtons")
    return name in _TAKING and bool(int(buttons) & int(button))


def _is_for_touch(item: Any) -> bool:
    # Every item says that it accepts touch, until it gets some.
    return item.metaObject().className() in ("QQuickMultiPointTouchArea", "QQuickPinchArea")


def _takes_touch(window: Any, at: Any) -> bool:
    left = QtCore.Qt.LeftButton
    return any(
        (_is_for_touch(shown.item) or int(shown.item.acceptedMouseButtons()) & int(left))
        and shown.has(at)
        for shown in _shown(window)
    ) or any(_takes_press(handler, left) for handler in _handlers(window, at))

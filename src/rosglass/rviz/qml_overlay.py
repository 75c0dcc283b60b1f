"""QML files as overlays on RViz's 3D view."""

from __future__ import annotations

import logging
import time
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.overlay.live_overlay import LiveOverlay
from rosglass.qml.run.renderer_choice import need_in_file, need_in_items
from rosglass.qt import QtCore, Signal, is_alive
from rosglass.rviz.input import (
    DRAG,
    FAR_OUTSIDE,
    KEYS,
    PRESS,
    TOUCH,
    mouse_event,
    position,
    releases,
    scaled,
)
from rosglass.rviz.qt5 import QtCore as Qt5Core
from rosglass.rviz.qt5 import QtGui, QtQuick, shiboken
from rosglass.rviz.rendering import choice

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from rosglass.qml.engine.session import Session
    from rosglass.rviz.rendering import Renderer
    from rosglass.rviz.window import Window

__all__ = ["QmlInput", "QmlOverlay", "Scene"]


class _Control(QtQuick.QQuickRenderControl):  # type: ignore[misc]
    """A render control that returns RViz's window, without which items get no keyboard focus."""

    panel: Any = None
    _without_window = False

    @contextmanager
    def without_window(self) -> Iterator[None]:
        """Return no window while rendering, so that the scene is drawn in pixels, not in units."""
        self._without_window = True
        try:
            yield
        finally:
            self._without_window = False

    def renderWindow(self, offset: Any) -> Any:  # noqa: N802 - Qt's
        if self._without_window or not is_alive(self.panel):
            return None
        window = self.panel.window()
        if offset is not None:
            # Items need it to compute their position on the screen.
            at = self.panel.mapTo(window, Qt5Core.QPoint(0, 0))
            offset.setX(at.x())
            offset.setY(at.y())
        return window.windowHandle()


class Scene(QtCore.QObject):
    """An offscreen Qt Quick window, drawn on request.

    The window's size is in units of the interface, so that popups and `Window` know the available
    space. The scene is scaled rather than its frame, so that text is sharp at any scale.
    """

    #: The scene has to be drawn again.
    changed = Signal()

    def __init__(self, renderer: Renderer) -> None:
        super().__init__()
        self._control = _Control()
        #: The window; its events have positions in units times `factor`.
        self.window: Any = QtQuick.QQuickWindow(self._control)
        self.window.setColor(QtGui.QColor(0, 0, 0, 0))
        #: Ratio of the window's event coordinates to units.
        self.factor = 1.0
        #: Draws the window.
        self.renderer = renderer
        self._item: Any = None
        self._units = Qt5Core.QSizeF(0, 0)
        self._closed = False
        self._control.sceneChanged.connect(self.changed)
        self._control.renderRequested.connect(self.changed)
        renderer.start(self._control, self.window)

    def set_panel(self, panel: Any) -> None:
        """Set the widget that shows the scene; its window provides focus, shortcuts and cursor."""
        self._control.panel = panel

    def show_item(self, item: Any) -> None:
        """Replace the root item, and give it the window's size."""
        if is_alive(self._item):
            self._item.setParentItem(None)
        self._item = item
        # PySide2 deletes the item when Python has no reference to its parent item.
        self._content = self.window.contentItem()
        item.setParentItem(self._content)
        item.setSize(self._units)
        self.changed.emit()

    def resize(self, width: int, height: int, ratio: float) -> None:
        """Set the size.

        Args:
            width: Width of the frame in pixels.
            height: Its height in pixels.
            ratio: Pixels per unit.
        """
        self._units = Qt5Core.QSizeF(width / ratio, height / ratio)
        self.factor = self.renderer.fit(width, height, ratio)
        content = self.window.contentItem()
        content.setTransformOrigin(QtQuick.QQuickItem.TopLeft)
        content.setScale(self.factor)
        # Popups of Qt Quick Controls use this item's size, which Qt does not set here.
        content.setSize(self._units)
        if is_alive(self._item):
            self._item.setSize(self._units)

    def draw(self) -> NDArray[np.uint32]:
        """Return the rendered frame.

        Returns:
            Array of shape (height, width), each pixel 0xAARRGGBB with premultiplied colours; valid
            until the next call or event.
        """
        return self.renderer.draw()

    def release_frame(self) -> None:
        """Release the memory of the last frame."""
        self.renderer.release_frame()

    def close(self) -> None:
        """Delete the window after the current event; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._control.sceneChanged.disconnect(self.changed)
        self._control.renderRequested.disconnect(self.changed)
        self.renderer.stop()
        for item in (self._control, self.window):
            item.deleteLater()


_E = Qt5Core.QEvent
_PRESS_HANDLERS = (
    "QQuickTapHandler",
    "QQuickDragHandler",
    "QQuickPointHandler",
    "QQuickPinchHandler",
)
_INPUT_METHOD = frozenset({_E.InputMethod, _E.InputMethodQuery})
_SCENE_EVENTS = PRESS | TOUCH | DRAG | KEYS | _INPUT_METHOD
_SCENE_EVENTS |= {_E.MouseMove, _E.MouseButtonRelease, _E.Wheel, _E.DragLeave}
_TOUCH_ENDS = frozenset({_E.TouchEnd, _E.TouchCancel})
#: Lifetime in seconds of the cached list of hoverable items.
_ITEMS_MAX_AGE_S = 0.25


class QmlInput:
    """Mixin that sends input to a QQuickWindow, ``_window``.

    Qt reports by ``accepted`` whether an item accepts a press, a key or the wheel, but not for
    hovering, pointer handlers and touch; for these, this class inspects the items.
    """

    _window: Any
    #: The widget that shows the scene; Qt Quick sets the cursor of its window.
    _panel: Any = None
    #: Ratio of the window's event coordinates to units of the overlay.
    _ratio = 1.0
    #: The buttons pressed on an item.
    _pressed_buttons = Qt5Core.Qt.NoButton
    #: The last touch event sent to an item, if a finger is still down.
    _touch: _Touch | None = None
    _hoverable: Sequence[_VisibleItem] = ()
    _listed_at = 0.0

    def deliver(self, event: Any) -> bool:
        """Send an event to the items; return whether one accepts it."""
        window, kind = self._window, event.type()
        if kind not in _SCENE_EVENTS or not is_alive(window):
            return False
        if kind in _INPUT_METHOD:
            return _send(window.focusObject() or window, event)
        at = position(event)
        at = None if at is None else at * self._ratio
        if kind == _E.TouchBegin and not _accepts_touch(window, at):
            return False
        if kind == _E.MouseButtonDblClick:
            # Qt sends the second press of a double click twice: as press and as double click.
            taken = self._deliver(mouse_event(event, _E.MouseButtonPress), at)
            return self._deliver(event, at) or taken if taken else False
        return self._deliver(event, at)

    def _deliver(self, event: Any, at: Any) -> bool:
        window, kind = self._window, event.type()
        sent = scaled(event, self._ratio)
        if kind in TOUCH:
            self._touch = None if kind in _TOUCH_ENDS else _Touch.of(sent)
        elif kind == _E.MouseButtonRelease:
            self._pressed_buttons = event.buttons()
        taken = _send(window, sent)
        if not is_alive(window):
            return taken
        if kind in PRESS:
            taken = taken or any(_accepts_press(h, event.button()) for h in _handlers(window, at))
            if taken:
                self._pressed_buttons = event.buttons()
        elif kind == _E.MouseMove:
            taken = taken or self._is_hovered(at) or self.cursor() is not None
        elif kind == _E.Wheel and not taken:
            taken = any(
                h.metaObject().className() == "QQuickWheelHandler" and h.property("active")
                for h in _handlers(window, at)
            )
        return taken

    def leave(self) -> None:
        """End hovering, and cancel presses."""
        window = self._window
        if not is_alive(window):
            return
        if self._pressed_buttons or self._touch is not None:
            self._cancel()
        if not is_alive(window):
            return
        Qt5Core.QCoreApplication.sendEvent(window, Qt5Core.QEvent(_E.Leave))
        if self._panel_window() is not None:
            self._panel_window().unsetCursor()

    def _cancel(self) -> None:
        """Release buttons and fingers so that items see a cancelled press."""
        window, content = self._window, self._window.contentItem()
        held, self._pressed_buttons = self._pressed_buttons, Qt5Core.Qt.NoButton
        touch, self._touch = self._touch, None
        # Handlers ignore whether their item is enabled. A TapHandler cancels on a release
        # elsewhere, the others on an event while they themselves are disabled.
        disabled = [h for h in _all_handlers(content) if not _is_tap(h) and h.property("enabled")]
        content.setEnabled(False)
        for handler in filter(is_alive, disabled):
            handler.setProperty("enabled", False)
        for event in releases(held):
            if is_alive(window):
                _send(window, event)
        if touch is not None and is_alive(window):
            for event in touch.release_events():
                _send(window, event)
        for handler in filter(is_alive, disabled):
            handler.setProperty("enabled", True)
        if is_alive(content):
            content.setEnabled(True)

    def set_focus(self, focus: bool) -> None:
        """Give the focus to the scene, or take it away."""
        if is_alive(self._window):
            event = QtGui.QFocusEvent(_E.FocusIn if focus else _E.FocusOut)
            Qt5Core.QCoreApplication.sendEvent(self._window, event)

    def cursor(self) -> Any:
        """Return the cursor that the item under the mouse sets; None for the default one."""
        shown_in = self._panel_window()
        if shown_in is None or shown_in.cursor().shape() == Qt5Core.Qt.ArrowCursor:
            return None
        return shown_in.cursor()

    def _panel_window(self) -> Any:
        return self._panel.window().windowHandle() if is_alive(self._panel) else None

    def _is_hovered(self, at: Any) -> bool:
        now = time.monotonic()
        if now - self._listed_at > _ITEMS_MAX_AGE_S:
            self._listed_at = now
            self._hoverable = [
                s for s in _visible_items(self._window) if s.item.acceptHoverEvents()
            ]
        return any(shown.has(at) for shown in self._hoverable)


class _VisibleItem(NamedTuple):
    """A visible item with the items that clip it."""

    item: Any
    clips: tuple[Any, ...]

    def has(self, at: Any) -> bool:
        """Return whether a position in the window is inside the item's visible part."""
        if not all(is_alive(item) for item in (self.item, *self.clips)):
            return False
        return bool(
            self.item.isVisible()
            and self.item.isEnabled()
            and all(item.contains(item.mapFromScene(at)) for item in (self.item, *self.clips))
        )


class _Touch(NamedTuple):
    """The last touch event."""

    #: Address of the QTouchDevice, because PySide2's wrapper ends with the event.
    device: int
    points: list[Any]

    @classmethod
    def of(cls, event: Any) -> _Touch:
        """Copy the touch points of an event."""
        device = shiboken.getCppPointer(event.device())[0]
        return cls(device, [QtGui.QTouchEvent.TouchPoint(p) for p in event.touchPoints()])

    def release_events(self) -> Iterator[Any]:
        """Iterate over events that release all fingers outside of all items."""
        device = shiboken.wrapInstance(self.device, QtGui.QTouchDevice)
        for point in self.points:
            point.setState(Qt5Core.Qt.TouchPointReleased)
            for put in (point.setPos, point.setScenePos):
                put(FAR_OUTSIDE)
        none = Qt5Core.Qt.NoModifier
        yield QtGui.QTouchEvent(_E.TouchCancel, device, none)
        yield QtGui.QTouchEvent(
            _E.TouchEnd, device, none, Qt5Core.Qt.TouchPointReleased, self.points
        )


def _send(receiver: Any, event: Any) -> bool:
    event.setAccepted(False)
    Qt5Core.QCoreApplication.sendEvent(receiver, event)
    return bool(event.isAccepted())


def _visible_items(window: Any) -> Iterator[_VisibleItem]:
    """Iterate over all visible items."""
    waiting = [_VisibleItem(item, ()) for item in window.contentItem().childItems()]
    while waiting:
        shown = waiting.pop()
        item, clips = shown
        if item.isVisible():
            yield shown
            inside = (*clips, item) if item.clip() else clips
            waiting += [_VisibleItem(child, inside) for child in item.childItems()]


def _all_handlers(item: Any) -> Iterator[Any]:
    """Iterate over the pointer handlers of an item and of its descendants."""
    yield from (c for c in item.children() if c.metaObject().className().endswith("Handler"))
    for child in item.childItems():
        yield from _all_handlers(child)


def _is_tap(handler: Any) -> bool:
    return bool(handler.metaObject().className() == "QQuickTapHandler")


def _handlers(window: Any, at: Any) -> Iterator[Any]:
    """Iterate over the enabled pointer handlers of the items at a position."""
    for shown in _visible_items(window):
        children = shown.item.children()
        found = [c for c in children if c.metaObject().className().endswith("Handler")]
        if found and shown.has(at):
            yield from (handler for handler in found if handler.property("enabled"))


def _accepts_press(handler: Any, button: Any) -> bool:
    name = handler.metaObject().className()
    buttons = handler.property("acceptedButtons")
    return name in _PRESS_HANDLERS and bool(int(buttons) & int(button))


def _is_touch_item(item: Any) -> bool:
    # acceptTouchEvents() is true for every item until it gets a touch event.
    return item.metaObject().className() in ("QQuickMultiPointTouchArea", "QQuickPinchArea")


def _accepts_touch(window: Any, at: Any) -> bool:
    left = Qt5Core.Qt.LeftButton
    return any(
        (_is_touch_item(shown.item) or int(shown.item.acceptedMouseButtons()) & int(left))
        and shown.has(at)
        for shown in _visible_items(window)
    ) or any(_accepts_press(handler, left) for handler in _handlers(window, at))


_log = logging.getLogger("rosglass.rviz")
#: Key in `Session.shared` of the list of overlays that use the session.
_OVERLAYS = "overlays"
#: Milliseconds between drawing and :meth:`QmlOverlay._on_idle`.
_IDLE_DELAY_MS = 1000


class QmlOverlay(QmlInput, LiveOverlay):
    """A QML file shown over RViz's 3D view.

    Args:
        file: The QML file; its root must be an Item.
        session: The session that its QML uses.
        name: Its name; by default that of the file.
        options: Options of :class:`LiveOverlay`.

    Raises:
        QmlError: A file or folder does not exist.
        UnsupportedError: Neither OpenGL nor Qt's software renderer is available.
    """

    #: The warning about a part of the file that the renderer cannot draw.
    _undrawable = ""

    def __init__(
        self, file: str | os.PathLike[str], session: Session, name: str = "", **options: Any
    ) -> None:
        super().__init__(file, session, name, **options)
        choice.expect(self.file)
        with ExitStack() as on_failure:
            on_failure.callback(super().close)
            self._scene = Scene(choice.make(self.engine.importPathList()))
            on_failure.pop_all()
        self._window = self._scene.window
        self._scene.changed.connect(self.changed)
        self._rviz_window: Window | None = None
        self._idle_timer = Qt5Core.QTimer()
        self._idle_timer.setSingleShot(True)
        self._idle_timer.setInterval(_IDLE_DELAY_MS)
        self._idle_timer.timeout.connect(self._on_idle)
        self.arranged.connect(self._fit_errors)
        self._session_overlays: list[QmlOverlay] = session.shared.setdefault(_OVERLAYS, [])
        self._session_overlays.append(self)

    def _place(self, root: Any) -> None:
        self._scene.show_item(root)
        self._undrawable = ""
        # MediaPlayer and ImagePublisher are not items, so look for them in the file.
        self._warn_not_drawn(root, lambda: need_in_file(self.file, self.engine.importPathList()))

    def _windows(self) -> list[Any]:
        return [self._window]

    def _standing_problem(self) -> str:
        return self._undrawable

    def _on_idle(self) -> None:
        """Release the frame, and warn of items created since that the renderer cannot draw."""
        self._scene.release_frame()
        if not self._undrawable and is_alive(self._window):
            self._warn_not_drawn(self._window.contentItem())

    def _warn_not_drawn(self, item: Any, otherwise: Callable[[], str] = str) -> None:
        if choice.renderer != "software":
            return
        need = need_in_items(item, self.file) or otherwise()
        if need:
            self._undrawable = choice.missing_warning(need)
            _log.warning("overlay %s: %s", self.name, self._undrawable)
            self.show_problem(self.problem)

    def _fit_errors(self) -> None:
        for item in self._errors.items:
            item.setProperty("unit", 1 / self.scale)

    def _close_view(self) -> None:
        window = self._rviz_window
        if window is not None and is_alive(window.widget):
            window.widget.close()

    def attach(self, window: Window) -> None:
        """Connect to RViz's window."""
        self._panel = window.panel
        self._rviz_window = window
        self._scene.set_panel(window.panel)

    def resize(self, width: int, height: int, ratio: float) -> None:
        """Set the size of the scene."""
        self._scene.resize(width, height, ratio)
        self._ratio = self._scene.factor

    def draw(self) -> NDArray[np.uint32] | None:
        """Render the scene."""
        self.session.go_on()
        pixels = self._scene.draw()
        self.read_back = self._scene.renderer.read_back
        if not self._idle_timer.isActive():
            self._idle_timer.start()
        return pixels

    def close(self, *, hold: bool = False) -> None:
        """Delete the scene and the QML engine; safe to call twice."""
        if self._closed:
            return
        self._idle_timer.stop()
        self._scene.changed.disconnect(self.changed)
        self._session_overlays.remove(self)
        # Only the last overlay of the session may shut its node down.
        super().close(hold=hold or bool(self._session_overlays))
        self._scene.close()

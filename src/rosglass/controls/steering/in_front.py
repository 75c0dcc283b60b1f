"""Checks that the operator sees a control, and has its window in front."""

from __future__ import annotations

import ctypes
import sys
from typing import TYPE_CHECKING, Any

from rosglass.qml.elements.image_sinks import window_of
from rosglass.qt import QtCore, QtGui, QtQuick, address

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["FocusWatch", "find_item", "obstruction", "popup_layer"]

#: X11's FocusOut events: the type, the modes in which keys go elsewhere (NotifyNormal, NotifyGrab
#: and NotifyWhileGrabbed), and the details by which it stays in the window (NotifyInferior), or is
#: not the keyboard's (NotifyPointer). A grab, as of a volume key or a screen lock, may be over
#: before Qt reports it; a key that was let go in it is never released.
_FOCUS_OUT, _MODES, _NOT_LEFT = 10, (0, 1, 3), (2, 5)


class FocusWatch(QtCore.QAbstractNativeEventFilter):
    """Notices on X11 at once that a window loses the keyboard; Qt waits 0.1 s for another one.

    It costs 8 us for each event of the X server while it is used.

    Args:
        on_lost: Called on the GUI thread.
    """

    def __init__(self, on_lost: Callable[[], None]) -> None:
        super().__init__()
        self._on_lost, self._window = on_lost, 0

    def start(self) -> None:
        """Watch the window that has the focus; safe to call twice."""
        focus = QtGui.QGuiApplication.focusWindow()
        if focus is None or QtGui.QGuiApplication.platformName() != "xcb":
            return
        app = QtCore.QCoreApplication.instance()
        if not self._window and app is not None:
            app.installNativeEventFilter(self)
        self._window = int(focus.winId())

    def stop(self) -> None:
        """Stop watching; safe to call twice, but not from `on_lost`."""
        app = QtCore.QCoreApplication.instance()
        if self._window and app is not None:
            app.removeNativeEventFilter(self)
        self._window = 0

    def nativeEventFilter(self, kind: Any, message: Any) -> Any:  # noqa: N802
        """Look at an event of the X server; Qt calls this before each one is handled."""
        if bytes(kind) == b"xcb_generic_event_t":
            # xcb_focus_out_event_t: type, detail, sequence, window, mode.
            raw = ctypes.string_at(int(message), 9)
            leaves = raw[0] & 0x7F == _FOCUS_OUT and raw[8] in _MODES and raw[1] not in _NOT_LEFT
            if leaves and int.from_bytes(raw[4:8], sys.byteorder) == self._window:
                self._on_lost()
        return False, 0


def find_item(thing: Any, kept: list[Any]) -> QtQuick.QQuickItem | QtGui.QWindow | None:
    """Return a QML object, or the next one around it, that is an item or a window.

    Args:
        thing: The object.
        kept: Receives the objects around it, to be kept for as long as it is used: PySide 2 takes
            an object for deleted when Python has no reference to its parent any more.
    """
    while thing is not None and not isinstance(thing, (QtQuick.QQuickItem, QtGui.QWindow)):
        thing = thing.parent()
        kept.append(thing)
    return thing


def obstruction(item: QtQuick.QQuickItem | QtGui.QWindow | None) -> str:
    """Return why the operator cannot use a control now, in words; empty without a reason.

    Args:
        item: The control, or its window; None for one that has neither.
    """
    if item is None or not isinstance(QtCore.QCoreApplication.instance(), QtGui.QGuiApplication):
        return ""
    window: Any = item
    if isinstance(item, QtQuick.QQuickItem):
        window = window_of(item)
        if window is None or not item.isVisible() or _is_unseen(item, window):
            return "the control is not visible"
        if not item.isEnabled():
            return "the control is disabled"
        if _has_modal_popup(window):
            return "a dialog is open"
        # Overlays are drawn in an offscreen window for RViz's.
        window = QtQuick.QQuickRenderControl.renderWindowFor(window) or window
    # The state as well: without a window manager, a minimised window stays exposed.
    minimised = window.windowState() == QtCore.Qt.WindowState.WindowMinimized
    if minimised or not window.isExposed():
        return "the window is not visible"
    focus = QtGui.QGuiApplication.focusWindow()
    # Not isActive(), which is also true behind a dialog of the window.
    if focus is None or not (_contains(focus, window) or _contains(window, focus)):
        return "the window is not in front"
    return ""


def _contains(outer: Any, inner: Any) -> bool:
    """Return whether a window is another one, or around it.

    Not by their parent(): PySide 2 takes a window without a parent for its own, and deletes it.
    """
    if address(outer) == address(inner):
        return True
    return bool(outer.isAncestorOf(inner, QtGui.QWindow.AncestorMode.ExcludeTransients))


def _is_unseen(item: QtQuick.QQuickItem, window: QtQuick.QQuickWindow) -> bool:
    """Return whether an item is transparent, cut off or outside, as on a SwipeView's other page.

    An item without a size is where the next one around it is that has one.
    """
    shown, seen = None, QtCore.QRectF(0, 0, window.width(), window.height())
    one: Any = item
    while one is not None:
        if one.opacity() == 0:
            return True
        box = one.boundingRect()
        if shown is None and not box.isEmpty():
            shown = one.mapRectToScene(box)
        elif one.clip():
            seen &= one.mapRectToScene(one.clipRect())
        one = one.parentItem()
    return shown is not None and not shown.intersects(seen)


def _has_modal_popup(window: Any) -> bool:
    """Return whether a modal popup of Qt Quick is open in a window."""
    overlay = popup_layer(window)
    for shown in overlay.childItems() if overlay is not None and overlay.isVisible() else ():
        is_popup = shown.isVisible() and shown.inherits("QQuickPopupItem")
        if is_popup and shown.parent().property("modal"):
            return True
    return False


def popup_layer(window: Any) -> Any:
    """Return the item of a window that holds its open popups; None while there are no popups."""
    for item in window.contentItem().childItems():
        # Not by metaObject(), whose wrapper outlives the object: PySide takes the next one at its
        # address for it.
        if item.inherits("QQuickOverlay"):
            return item
    return None

"""Checks that the operator sees a control, and has its window in front."""

from __future__ import annotations

from typing import Any

from rosglass.qml.elements.image_sinks import window_of
from rosglass.qt import QtCore, QtGui, QtQuick, address

__all__ = ["find_item", "obstruction"]


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
        if window is None or not item.isVisible() or _is_outside(item, window):
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
    if focus is None or address(_outermost(focus)) != address(_outermost(window)):
        return "the window is not in front"
    return ""


def _is_outside(item: QtQuick.QQuickItem, window: QtQuick.QQuickWindow) -> bool:
    """Return whether an item is outside its window, as the hidden pages of a SwipeView are."""
    shown = item.mapRectToScene(item.boundingRect())
    return not shown.isEmpty() and not shown.intersects(
        QtCore.QRectF(0, 0, window.width(), window.height())
    )


def _has_modal_popup(window: Any) -> bool:
    """Return whether a modal popup of Qt Quick is open in a window."""
    for item in window.contentItem().childItems():
        if not item.metaObject().className().startswith("QQuickOverlay") or not item.isVisible():
            continue
        for shown in item.childItems():
            popup = shown.parent()
            if popup is not None and popup.property("modal") and popup.property("visible"):
                return True
    return False


def _outermost(window: Any) -> Any:
    while (above := window.parent()) is not None and isinstance(above, QtGui.QWindow):
        window = above
    return window

"""The window that an item is in, and what draws it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.qt import QtGui, QtQuick

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["all_items", "is_painted", "window_of"]


def window_of(item: QtQuick.QQuickItem) -> QtQuick.QQuickWindow | None:
    """Return the window that an item is in, None when it is in none.

    PySide takes an item for the owner of what ``item.window()`` gives: with the item's wrapper that
    of the window would end, whoever holds it.
    """
    for window in QtGui.QGuiApplication.allWindows():
        if isinstance(window, QtQuick.QQuickWindow):
            content = window.contentItem()
            if content is item or content.isAncestorOf(item):
                return window
    return None


def all_items() -> Iterator[QtQuick.QQuickItem]:
    """Iterate over the items of all windows."""
    for window in QtGui.QGuiApplication.allWindows():
        items = [window.contentItem()] if isinstance(window, QtQuick.QQuickWindow) else []
        while items:
            item = items.pop()
            yield item
            items += item.childItems()


def is_painted(window: QtQuick.QQuickWindow) -> bool:
    """Return whether Qt's software renderer draws a window, which draws no video and no shaders."""
    kinds = QtQuick.QSGRendererInterface.GraphicsApi
    return window.rendererInterface().graphicsApi() in (kinds.Software, kinds.OpenVG)

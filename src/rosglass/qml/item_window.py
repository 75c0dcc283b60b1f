"""The window that an item is in."""

from __future__ import annotations

from rosglass.qt import QtGui, QtQuick

__all__ = ["window_of"]


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

"""Mouse and keyboard on a control of a bench."""

from __future__ import annotations

from typing import Any

from rosglass.qt import QtCore, optional

LEFT = QtCore.Qt.MouseButton.LeftButton
NONE = QtCore.Qt.KeyboardModifier.NoModifier


def centre(item: Any) -> QtCore.QPoint:
    """Return the centre of an item in its window."""
    return item.mapToScene(QtCore.QPointF(item.width() / 2, item.height() / 2)).toPoint()


def click(bench: Any, name: str) -> None:
    """Click on the item with an ``objectName``."""
    test: Any = optional("QtTest")
    test.QTest.mouseClick(bench.window, LEFT, NONE, centre(bench.find(name)))


def press(bench: Any, name: str) -> None:
    """Press the mouse on an item."""
    test: Any = optional("QtTest")
    test.QTest.mousePress(bench.window, LEFT, NONE, centre(bench.find(name)))


def release(bench: Any, name: str) -> None:
    """Release the mouse on an item."""
    test: Any = optional("QtTest")
    test.QTest.mouseRelease(bench.window, LEFT, NONE, centre(bench.find(name)))


def key(bench: Any, *keys: str) -> None:
    """Press and release keys, by Qt's names without ``Key_``."""
    test: Any = optional("QtTest")
    for name in keys:
        test.QTest.keyClick(bench.window, getattr(QtCore.Qt.Key, f"Key_{name}"))


def write(bench: Any, name: str, text: str) -> None:
    """Replace the text of a field as an operator does, and press Enter."""
    field = bench.find(name)
    field.forceActiveFocus()
    field.setProperty("text", text)
    QtCore.QMetaObject.invokeMethod(field, "textEdited")
    key(bench, "Return")

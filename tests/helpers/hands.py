"""Mouse and keyboard on a control of a bench."""

from __future__ import annotations

from typing import Any

from rosglass.qt import QtCore, QtGui, optional

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


def key(bench: Any, *keys: str, control: bool = False) -> None:
    """Press and release keys, by Qt's names without ``Key_``."""
    test: Any = optional("QtTest")
    held = QtCore.Qt.KeyboardModifier.ControlModifier if control else NONE
    for name in keys:
        test.QTest.keyClick(bench.window, getattr(QtCore.Qt.Key, f"Key_{name}"), held)


def write(bench: Any, name: str, text: str) -> None:
    """Replace the text of a field as an operator does, and press Enter."""
    field = bench.find(name)
    field.forceActiveFocus()
    field.setProperty("text", text)
    QtCore.QMetaObject.invokeMethod(field, "textEdited")
    key(bench, "Return")


def drag(bench: Any, item: Any, target: Any) -> None:
    """Press the left button on the middle of an item, and release it on that of another."""
    kinds, no_button = QtCore.QEvent.Type, QtCore.Qt.MouseButton.NoButton
    start, stop = (QtCore.QPointF(centre(one)) for one in (item, target))
    _mouse(bench, kinds.MouseButtonPress, start, LEFT, LEFT)
    for step in range(9):
        _mouse(bench, kinds.MouseMove, start + (stop - start) * (step / 8), no_button, LEFT)
    _mouse(bench, kinds.MouseButtonRelease, stop, LEFT, no_button)


def _mouse(bench: Any, kind: Any, point: Any, button: Any, buttons: Any) -> None:
    at = QtCore.QPointF(bench.window.mapToGlobal(point.toPoint()))
    event = QtGui.QMouseEvent(kind, point, at, button, buttons, NONE)
    QtCore.QCoreApplication.sendEvent(bench.window, event)


def clipboard() -> str:
    """Return the text in the clipboard."""
    return str(QtGui.QGuiApplication.clipboard().text())

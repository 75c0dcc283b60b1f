"""Reading and operating the trees of controls in tests."""

from __future__ import annotations

from typing import Any


def rows(controls: Any, *roles: str) -> list[Any]:
    """Return a role, or several, of all rows of the tree that is shown."""
    model = controls.find("tree").property("model")
    found = []
    for row in range(model.rowCount()):
        values = [model.value(row, role) for role in roles]
        found.append(values[0] if len(roles) == 1 else tuple(values))
    return found


def press(controls: Any, key: str, times: int = 1, *, control: bool = False) -> None:
    """Press a key in the window, such as ``Right``."""
    from rosglass.qt import QtCore, QtGui

    kinds, qt = QtCore.QEvent.Type, QtCore.Qt
    held = qt.KeyboardModifier.ControlModifier if control else qt.KeyboardModifier.NoModifier
    text = key.lower() if len(key) == 1 and not control else ""
    for _ in range(times):
        for kind in (kinds.KeyPress, kinds.KeyRelease):
            event = QtGui.QKeyEvent(kind, getattr(qt.Key, f"Key_{key}"), held, text)
            QtCore.QCoreApplication.sendEvent(controls.window, event)


def drag(controls: Any, item: Any, target: Any) -> None:
    """Press the left button on the middle of an item, and release it on that of another."""
    from rosglass.qt import QtCore

    kinds, buttons = QtCore.QEvent.Type, QtCore.Qt.MouseButton
    start, stop = (
        one.mapToScene(QtCore.QPointF(one.width() / 2, one.height() / 2)) for one in (item, target)
    )
    _mouse(controls, kinds.MouseButtonPress, start, buttons.LeftButton, buttons.LeftButton)
    for step in range(9):
        point = start + (stop - start) * (step / 8)
        _mouse(controls, kinds.MouseMove, point, buttons.NoButton, buttons.LeftButton)
    _mouse(controls, kinds.MouseButtonRelease, stop, buttons.LeftButton, buttons.NoButton)


def clipboard() -> str:
    """Return the text in the clipboard."""
    from rosglass.qt import QtGui

    return str(QtGui.QGuiApplication.clipboard().text())


def _mouse(controls: Any, kind: Any, point: Any, button: Any, buttons: Any) -> None:
    from rosglass.qt import QtCore, QtGui

    none = QtCore.Qt.KeyboardModifier.NoModifier
    at = controls.window.mapToGlobal(point.toPoint())
    event = QtGui.QMouseEvent(kind, point, QtCore.QPointF(at), button, buttons, none)
    QtCore.QCoreApplication.sendEvent(controls.window, event)

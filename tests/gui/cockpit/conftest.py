"""A bench that shows layouts of ``RosCockpit 1.0``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable


class LayoutBench:
    """A layout in a window, on a robot made of memory.

    Attributes:
        window: The main window.
        root: The layout's Cockpit.
        bench: The bench with the engine, its session, and the nodes in memory.
    """

    def __init__(self, running: Any, wait: Any) -> None:
        self.bench, self.wait = running, wait
        self.robot, self.window, self.root = running.robot, None, None

    def show(self, body: str, width: int = 800, height: int = 600, imports: str = "") -> Any:
        """Show a Cockpit with members, such as ``Page { Panel {} }``; return it."""
        self.window = self.bench.load(
            f"Window {{ width: {width}; height: {height}; visible: true\n"
            f"property Item cockpit: made\n"
            f'Cockpit {{ id: made; nodeName: "ui"; anchors.fill: parent\n{body} }} }}',
            "import QtQuick 2.15\nimport QtQuick.Window 2.15\nimport RosControls 1.0\n"
            f"import RosCockpit 1.0\n{imports}",
        )
        self.wait(self.window.isExposed)
        self.root = self.window.property("cockpit")
        self.window.requestActivate()
        self.wait(self.window.isActive)
        return self.root

    def find(self, name: str, item: Any = None) -> Any:
        """Return the visual item with an ``objectName``."""
        found = self.search(name, item)
        assert found is not None, f"no item {name!r}"
        return found

    def search(self, name: str, item: Any = None) -> Any:
        """Return the visual item with an ``objectName``; None if there is none."""
        waiting = [item or self.window.contentItem()]
        while waiting:
            one = waiting.pop()
            if one.objectName() == name:
                return one
            waiting += one.childItems()
        return None

    def place(self, item: Any) -> tuple[int, int, int, int]:
        """Return x, y, width and height of an item, or the one with a name, in its window."""
        from rosglass.qt import QtCore

        item = self.find(item) if isinstance(item, str) else item
        at = item.mapToScene(QtCore.QPointF(0, 0))
        return round(at.x()), round(at.y()), round(item.width()), round(item.height())

    def point(self, item: Any, across: float = 0.5, down: float = 0.5) -> Any:
        """Return a point of an item, in its window."""
        from rosglass.qt import QtCore

        item = self.find(item) if isinstance(item, str) else item
        return item.mapToScene(
            QtCore.QPointF(item.width() * across, item.height() * down)
        ).toPoint()

    def key(self, text: str, window: Any = None) -> None:
        """Press keys, such as ``Ctrl+2``."""
        from rosglass.qt import QtCore, QtGui, optional

        pressed = QtGui.QKeySequence(text)[0]
        if hasattr(pressed, "key"):
            key, modifiers = pressed.key(), pressed.keyboardModifiers()
        else:
            mask = int(QtCore.Qt.KeyboardModifierMask)
            key = QtCore.Qt.Key(int(pressed) & ~mask)
            modifiers = QtCore.Qt.KeyboardModifiers(int(pressed) & mask)
        optional("QtTest").QTest.keyClick(window or self.window, key, modifiers)

    def click(self, item: Any, across: float = 0.5, down: float = 0.5, window: Any = None) -> None:
        """Click on an item."""
        from rosglass.qt import QtCore, optional

        optional("QtTest").QTest.mouseClick(
            window or self.window,
            QtCore.Qt.MouseButton.LeftButton,
            QtCore.Qt.KeyboardModifier.NoModifier,
            self.point(item, across, down),
        )


@pytest.fixture
def layouts(running: Any, wait: Callable[..., None]) -> LayoutBench:
    """A bench to show layouts on, connected to the robot."""
    from rosglass.cockpit.modules import register

    register()
    return LayoutBench(running, wait)

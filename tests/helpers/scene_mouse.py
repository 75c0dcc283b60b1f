"""A hand that moves the mouse in a view, by events that Qt gets; and what colours are seen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from conftest import SceneBench


class Hand:
    """Moves the mouse in the window of a bench, by events that Qt gets."""

    def __init__(self, bench: SceneBench) -> None:
        from PySide6.QtCore import QPoint, Qt
        from PySide6.QtTest import QTest

        self.bench, self.window = bench, bench.window
        self._test, self._point = QTest, QPoint
        self.LEFT, self.RIGHT = Qt.MouseButton.LeftButton, Qt.MouseButton.RightButton
        self.SHIFT, self.CTRL = (
            Qt.KeyboardModifier.ShiftModifier,
            Qt.KeyboardModifier.ControlModifier,
        )
        self.NONE = Qt.KeyboardModifier.NoModifier
        self.keys = Qt.Key

    def at(self, point: Any) -> tuple[int, int]:
        """Return the pixel of a point of the fixed frame."""
        seen = self.bench.view.camera().project(point)
        return round(seen.x), round(seen.y)

    def press(self, at: Any, button: Any = None, keys: Any = None) -> None:
        self._test.mousePress(self.window, button or self.LEFT, keys or self.NONE, self._point(*at))

    def move(self, at: Any, keys: Any = None) -> None:
        if keys is None:
            self._test.mouseMove(self.window, self._point(*at))
            return
        # QTest moves without keys, and holds the left button here.
        from PySide6.QtCore import QCoreApplication, QEvent, QPointF, Qt
        from PySide6.QtGui import QMouseEvent

        point, button = QPointF(*at), Qt.MouseButton.NoButton
        event = QMouseEvent(QEvent.Type.MouseMove, point, point, button, self.LEFT, keys)
        QCoreApplication.sendEvent(self.window, event)

    def release(self, at: Any, button: Any = None, keys: Any = None) -> None:
        self._test.mouseRelease(
            self.window, button or self.LEFT, keys or self.NONE, self._point(*at)
        )

    def click(self, at: Any, button: Any = None, keys: Any = None) -> None:
        self.move(at)
        self.press(at, button, keys)
        self.release(at, button, keys)

    def drag(self, start: Any, end: Any, button: Any = None, keys: Any = None) -> None:
        self.press(start, button, keys)
        self.move(((start[0] + end[0]) // 2, (start[1] + end[1]) // 2), keys)
        self.move(end, keys)
        self.release(end, button, keys)

    def wheel(self, at: Any, steps: int) -> None:
        from PySide6.QtCore import QCoreApplication, QPointF, Qt
        from PySide6.QtGui import QWheelEvent

        point, turn = QPointF(*at), self._point(0, 120 * steps)
        event = QWheelEvent(
            point, point, self._point(), turn, Qt.MouseButton.NoButton, self.NONE,
            Qt.ScrollPhase.NoScrollPhase, False,
        )  # fmt: skip
        QCoreApplication.sendEvent(self.window, event)

    def key(self, key: Any, keys: Any = None) -> None:
        self._test.keyClick(self.window, key, keys or self.NONE)


def has_color(picture: Any, red: int, green: int, blue: int, tolerance: int = 60) -> int:
    off = np.abs(picture.astype(int) - (red, green, blue)).max(axis=2)
    return int((off <= tolerance).sum())

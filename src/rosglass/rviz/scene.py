"""A scene of QML that no window shows: what it looks like is read into memory."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, Signal, is_alive
from rosglass.rviz.qt5 import QtCore as Qt5Core
from rosglass.rviz.qt5 import QtGui, QtQuick

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import NDArray

    from rosglass.rviz.renderers import Renderer

__all__ = ["Scene"]


class _Control(QtQuick.QQuickRenderControl):  # type: ignore[misc]
    """Tells Qt Quick which window its scene is seen in: only there, items get keys."""

    panel: Any = None
    _apart = False

    @contextmanager
    def apart(self) -> Iterator[None]:
        """Be seen nowhere meanwhile: a scene would be drawn in units of a window, not in pixels."""
        self._apart = True
        try:
            yield
        finally:
            self._apart = False

    def renderWindow(self, offset: Any) -> Any:  # noqa: N802 - Qt's
        if self._apart or not is_alive(self.panel):
            return None
        window = self.panel.window()
        if offset is not None:
            # By it, items find their place on the screen.
            at = self.panel.mapTo(window, Qt5Core.QPoint(0, 0))
            offset.setX(at.x())
            offset.setY(at.y())
        return window.windowHandle()


class Scene(QtCore.QObject):
    """A window of Qt Quick that is drawn when it is asked for.

    A unit of the window's size is one of the interface, so that popups and `Window` know how much
    room there is. Its content is scaled instead: texts are drawn sharp at any scale, as they would
    not be if the picture were.

    Args:
        renderer: What draws it.
    """

    #: Something in it looks another way now.
    changed = Signal()

    def __init__(self, renderer: Renderer) -> None:
        super().__init__()
        self._control = _Control()
        #: The window; its coordinates, and so those of its events, are units times `factor`.
        self.window: Any = QtQuick.QQuickWindow(self._control)
        self.window.setColor(QtGui.QColor(0, 0, 0, 0))
        #: What to multiply units with for the window's events.
        self.factor = 1.0
        #: What draws it.
        self.renderer = renderer
        self._item: Any = None
        self._units = Qt5Core.QSizeF(0, 0)
        self._closed = False
        self._control.sceneChanged.connect(self.changed)
        self._control.renderRequested.connect(self.changed)
        renderer.start(self._control, self.window)

    def show_in(self, panel: Any) -> None:
        """Say which widget shows it: keys, shortcuts and the mouse's shape are its window's."""
        self._control.panel = panel

    def show_item(self, item: Any) -> None:
        """Show a root item in place of the one before; it gets the window's size."""
        if is_alive(self._item):
            self._item.setParentItem(None)
        self._item = item
        # PySide2 takes it for gone as soon as nobody in Python knows what it was put into.
        self._content = self.window.contentItem()
        item.setParentItem(self._content)
        item.setSize(self._units)
        self.changed.emit()

    def resize(self, width: int, height: int, ratio: float) -> None:
        """Set the size.

        Args:
            width: Pixels of the picture.
            height: Pixels.
            ratio: Pixels for one unit.
        """
        self._units = Qt5Core.QSizeF(width / ratio, height / ratio)
        self.factor = self.renderer.fit(width, height, ratio)
        content = self.window.contentItem()
        content.setTransformOrigin(QtQuick.QQuickItem.TopLeft)
        content.setScale(self.factor)
        # No window system tells the window its size, of which the popups of Controls ask this item.
        content.setSize(self._units)
        if is_alive(self._item):
            self._item.setSize(self._units)

    def draw(self) -> NDArray[np.uint32]:
        """Return how it looks now.

        Returns:
            Shape (height, width), each pixel 0xAARRGGBB with premultiplied colours; valid until
            the next call, or event.
        """
        return self.renderer.draw()

    def rest(self) -> None:
        """Let the last picture go: it may be long until the next one."""
        self.renderer.rest()

    def close(self) -> None:
        """Let the window go as soon as no event is handled any more; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._control.sceneChanged.disconnect(self.changed)
        self._control.renderRequested.disconnect(self.changed)
        self.renderer.stop()
        for item in (self._control, self.window):
            item.deleteLater()

"""The element ``PlotLines``: shows the image of a plot's lines."""
# ruff: noqa: N802 - the names of slots are Qt's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.qml.elements.image_sinks import window_of
from rosglass.qml.engine.properties import Writable
from rosglass.qt import QtCore, QtGui, QtQuick, is_alive

if TYPE_CHECKING:
    from types import ModuleType

    import numpy as np
    from numpy.typing import NDArray

    from rosglass.controls.plots.raster import Curve, Outline, Raster

__all__ = ["PlotLines"]


def _image(raster: Raster) -> QtGui.QImage:
    """Return an image that shares the memory of a raster."""
    kind = QtGui.QImage.Format.Format_RGB32
    return QtGui.QImage(raster.memory.data, raster.width, raster.height, 8 * raster.width, kind)


class PlotLines(QtQuick.QQuickItem):
    """The item that draws the lines of a ``PlotData``."""

    source = Writable(QtCore.QObject, read=lambda self: self._source, write="_set_source")
    background = Writable(QtGui.QColor, QtGui.QColor(0, 0, 0), then="_on_background")
    grid = Writable(QtGui.QColor, QtGui.QColor(0, 0, 0), then="_on_background")

    _background: QtGui.QColor
    _grid: QtGui.QColor

    def __init__(self, parent: QtQuick.QQuickItem | None = None) -> None:
        super().__init__(parent)
        self.setFlag(QtQuick.QQuickItem.Flag.ItemHasContents, True)
        self._source: Any = None
        self._node: Any = None
        self._raster: Raster | None = None
        self._ratio = 1.0
        #: How the image was drawn last, and whether it has changed.
        self._drawn: Any = None
        self._is_changed = False
        self.widthChanged.connect(self._on_size)
        self.heightChanged.connect(self._on_size)
        self.visibleChanged.connect(self._on_size)
        self.windowChanged.connect(self._on_size)
        state = self.__dict__
        # PySide 6.11 never frees the Python half of an object created by QML.
        self.destroyed.connect(lambda: state.update(_source=None, _raster=None, _node=None))

    @property
    def ratio(self) -> float:
        """Pixels on the screen for one of Qt's."""
        return self._ratio

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height on the screen; 0 while it is not shown."""
        window = window_of(self) if self.isVisible() else None
        if window is None:
            return 0, 0
        self._ratio = window.effectiveDevicePixelRatio()
        return max(0, round(self.width() * self._ratio)), max(0, round(self.height() * self._ratio))

    def show(
        self,
        kit: ModuleType,
        shown: Outline,
        colors: NDArray[np.uint32],
        curves: list[Curve],
        view: Any,
    ) -> None:
        """Draw the lines with the next frame.

        Args:
            kit: The module `plot_raster`.
            shown: Their extents.
            colors: Their colours as 0xAARRGGBB.
            curves: Lines of points.
            view: ``(key, first, start, rows)``: what else determines the image, the number of the
                first column, the first column that has changed, and the rows of the grid.
        """
        width, height = self.pixels
        if not width or not height:
            return
        key, first, start, rows = view
        colours = (self._background.rgb() & 0xFFFFFFFF, self._grid.rgb() & 0xFFFFFFFF)
        background = kit.Background(*colours, tuple(rows))
        key = (key, width, height, background, colors.tobytes())
        if self._raster is None or (self._raster.width, self._raster.height) != (width, height):
            self._raster = kit.Raster(width, height)
        if key != self._drawn or curves:
            start = 0
        self._drawn = key
        self._raster.draw(shown, colors, curves, background, first, start)
        self._is_changed = True
        self.update()

    def updatePaintNode(self, old: Any, data: Any) -> Any:  # noqa: ARG002 - Qt's signature
        """Hand the image to the renderer; Qt calls it while the GUI thread waits."""
        raster, window = self._raster, window_of(self)
        if raster is None or window is None:
            return None
        if old is None or self._node is None:
            self._node = QtQuick.QSGSimpleTextureNode()
            self._node.setOwnsTexture(True)
            self._is_changed = True
        if self._is_changed:
            option = QtQuick.QQuickWindow.CreateTextureOption.TextureIsOpaque
            image = _image(raster)
            if QtCore.QThread.currentThread() != self.thread():
                # It is uploaded by the render thread later, when this one may draw or resize.
                image = image.copy()
            self._node.setTexture(window.createTextureFromImage(image, option))
            self._is_changed = False
        size = QtCore.QSizeF(raster.width / self._ratio, raster.height / self._ratio)
        self._node.setRect(QtCore.QRectF(QtCore.QPointF(0, 0), size))
        return self._node

    def _set_source(self, source: Any) -> None:
        before = self._source
        if source is before:
            return
        if is_alive(before):
            before.detach(self)
        self._source = source
        if is_alive(source):
            source.attach(self)
        self.sourceChanged.emit()  # type: ignore[attr-defined]

    def updatePolish(self) -> None:
        """Draw before the next frame of the window; called by Qt."""
        if is_alive(self._source):
            self._source.draw()

    @QtCore.Slot()
    def _on_size(self) -> None:
        if is_alive(self._source):
            self._source.redraw()
            # No frame in which the rest of the window has another size or theme.
            self.polish()

    def _on_background(self) -> None:
        self._drawn = None
        self._on_size()

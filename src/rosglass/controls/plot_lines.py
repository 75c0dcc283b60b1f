"""The element ``PlotLines``: draws the lines of a plot by the renderer of its window."""
# ruff: noqa: N802 - the names of slots are Qt's

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any

from rosglass.qml.elements.image_sinks import is_painted, window_of
from rosglass.qml.engine.properties import Writable
from rosglass.qt import QT6, QtCore, QtGui, QtQuick, is_alive

if TYPE_CHECKING:
    from types import ModuleType

    import numpy as np
    from numpy.typing import NDArray

    from rosglass.controls.plot_raster import Curve, Outline, Raster

__all__ = ["PlotLines"]

#: Qt keeps a reference to the set: a temporary one would be freed.
_ATTRIBUTES = QtQuick.QSGGeometry.defaultAttributes_ColoredPoint2D()


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
        self._parts: list[Any] = []
        self._raster: Raster | None = None
        self._vertices: NDArray[Any] | None = None
        self._ratio = 1.0
        self._is_painted = True
        #: How the image was drawn last, and whether it has changed.
        self._drawn: Any = None
        self._is_changed = False
        self.widthChanged.connect(self._on_size)
        self.heightChanged.connect(self._on_size)
        self.visibleChanged.connect(self._on_size)
        self.windowChanged.connect(self._on_size)
        state = self.__dict__
        # PySide 6.11 never frees the Python half of an object created by QML.
        self.destroyed.connect(
            lambda: state.update(_source=None, _raster=None, _vertices=None, _parts=[], _node=None)
        )

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
        self._is_painted = not QT6 or is_painted(window)
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
        if not self._is_painted:
            self._raster, self._drawn = None, None
            self._vertices = kit.scaled(kit.vertices(shown, colors, curves), 1 / self._ratio)
        else:
            self._paint(kit, width, height, shown, colors, curves, view)
        self._is_changed = True
        self.update()

    def _paint(
        self,
        kit: ModuleType,
        width: int,
        height: int,
        shown: Outline,
        colors: NDArray[np.uint32],
        curves: list[Curve],
        view: Any,
    ) -> None:
        key, first, start, rows = view
        colours = (self._background.rgb() & 0xFFFFFFFF, self._grid.rgb() & 0xFFFFFFFF)
        background = kit.background(height, *colours, rows)
        key = (key, width, height, background.tobytes(), colors.tobytes())
        if self._raster is None or (self._raster.width, self._raster.height) != (width, height):
            self._raster = kit.Raster(width, height, background)
        if key != self._drawn or curves:
            self._raster.background = background
            start = 0
        self._drawn = key
        self._raster.draw(shown, colors, curves, first, start)

    def updatePaintNode(self, old: Any, data: Any) -> Any:  # noqa: ARG002 - Qt's signature
        """Hand the lines to the renderer; Qt calls it while the GUI thread waits."""
        if self._is_painted:
            return self._update_image(old)
        return self._update_geometry(old)

    def _update_image(self, old: Any) -> Any:
        raster, window = self._raster, window_of(self)
        if raster is None or window is None:
            return None
        node = self._node if old is not None and self._parts == [] else None
        if node is None:
            node = self._node = QtQuick.QSGSimpleTextureNode()
            node.setOwnsTexture(True)
            self._parts, self._is_changed = [], True
        if self._is_changed:
            option = QtQuick.QQuickWindow.CreateTextureOption.TextureIsOpaque
            node.setTexture(window.createTextureFromImage(raster.image(), option))
            self._is_changed = False
        node.setRect(QtCore.QRectF(0, 0, raster.width / self._ratio, raster.height / self._ratio))
        return node

    def _update_geometry(self, old: Any) -> Any:
        lines = self._vertices
        if lines is None:
            return None
        node = self._node if old is not None and self._parts else None
        if node is None:
            node = self._node = QtQuick.QSGGeometryNode()
            geometry = QtQuick.QSGGeometry(_ATTRIBUTES, len(lines))
            geometry.setDrawingMode(QtQuick.QSGGeometry.DrawingMode.DrawLines.value)
            material = QtQuick.QSGVertexColorMaterial()
            node.setGeometry(geometry)
            node.setMaterial(material)
            self._parts, self._is_changed = [geometry, material], True
        if self._is_changed:
            geometry = self._parts[0]
            geometry.allocate(len(lines))
            if len(lines):
                ctypes.memmove(int(geometry.vertexData()), lines.ctypes.data, lines.nbytes)
            node.markDirty(QtQuick.QSGNode.DirtyStateBit.DirtyGeometry)
            self._is_changed = False
        return node

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

    @QtCore.Slot()
    def _on_size(self) -> None:
        if is_alive(self._source):
            self._source.redraw()

    def _on_background(self) -> None:
        self._drawn = None
        self._on_size()

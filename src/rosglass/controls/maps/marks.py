"""Painted items of maps: the layers of points and lines, and the marks of robots and goals."""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rosglass.qml.engine.properties import Writable
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QtCore, QtGui, QtQuick, is_alive

if TYPE_CHECKING:
    from rosglass.controls.maps.layers import Canvas

__all__ = ["MapArrow", "MapMarks"]


def _color(name: str) -> Any:
    return Writable(QtGui.QColor, QtGui.QColor(name), then="update")


class MapMarks(QtQuick.QQuickPaintedItem):
    """Paints scans, paths, outlines, particles and the track of a ``MapScene`` or ``GeoScene``."""

    scene = Writable(QtCore.QObject, None, then="_on_scene")
    scanColor = _color("red")
    pathColor = _color("green")
    footprintColor = _color("orange")
    particleColor = _color("blue")
    trackColor = _color("gray")
    #: Whether the track is painted.
    track = Writable(bool, True, then="update")
    gridColor = _color("gray")
    #: Height of the grid's texts in pixels.
    gridSize = Writable(float, 12.0, then="update")

    def __init__(self, parent: QtQuick.QQuickItem | None = None) -> None:
        super().__init__(parent)
        self._canvas: Canvas | None = None
        #: The points of the track, and its line.
        self._points: list[tuple[float, float]] = []
        self._line = QtGui.QPolygonF()
        # PySide 6.11 never frees the Python half of an object created by QML.
        state = self.__dict__
        self.destroyed.connect(lambda: state.update(_canvas=None, _scene=None))

    def _on_scene(self) -> None:
        if self.scene is not None and hasattr(self.scene, "repaint"):
            self.scene.repaint.connect(weak_callback(self._on_repaint))
        self.update()

    def _on_repaint(self) -> None:
        if is_alive(self):
            self.update()

    def paint(self, painter: QtGui.QPainter) -> None:
        """Paint the layers; Qt calls it on the render thread while the GUI thread waits."""
        scene: Any = self.scene
        camera = scene.camera if scene is not None and is_alive(scene) else None
        if camera is None:
            return
        # Not before the first map: numpy takes 70 ms.
        from rosglass.controls.maps.layers import Canvas, VectorLayer, paint_line  # noqa: PLC0415

        view = camera.to_screen()
        painter.setRenderHint(QtGui.QPainter.RenderHint.Antialiasing)
        if hasattr(scene, "paint_under"):
            scene.paint_under(painter, self.gridColor, self.gridSize)
        if self.track and len(scene.track.points) > 1:
            paint_line(painter, self._way(scene.track.points), view, self.trackColor)
        if self._canvas is None:
            self._canvas = Canvas()
        canvas = self._canvas
        canvas.begin(max(1, math.ceil(self.width())), max(1, math.ceil(self.height())))
        for layer in scene.layers:
            if isinstance(layer, VectorLayer):
                layer.paint(painter, canvas, view, getattr(self, layer.COLOR))
        canvas.show(painter)

    def _way(self, points: list[tuple[float, float]]) -> QtGui.QPolygonF:
        """Return the track, to which only new points are added."""
        if points is not self._points:
            self._points, self._line = points, QtGui.QPolygonF()
        for x, y in points[self._line.size() :]:
            self._line.append(QtCore.QPointF(x, y))
        return self._line


class MapArrow(QtQuick.QQuickPaintedItem):
    """An arrow to the right around its middle: the mark of a robot or a goal."""

    color = _color("orange")
    edgeColor = _color("white")
    #: Whether it is a dot instead, without a heading.
    round = Writable(bool, False, then="update")

    def paint(self, painter: QtGui.QPainter) -> None:
        """Paint it."""
        painter.setRenderHint(QtGui.QPainter.RenderHint.Antialiasing)
        half = min(self.width(), self.height()) / 2 - 1
        middle = QtCore.QPointF(self.width() / 2, self.height() / 2)
        painter.setPen(QtGui.QPen(self.edgeColor, 1.2))
        painter.setBrush(self.color)
        if self.round:
            painter.drawEllipse(middle, half * 0.6, half * 0.6)
            return
        corners = ((1.0, 0.0), (-0.75, 0.7), (-0.4, 0.0), (-0.75, -0.7))
        points = [QtCore.QPointF(x * half, y * half) + middle for x, y in corners]
        painter.drawPolygon(QtGui.QPolygonF(points))

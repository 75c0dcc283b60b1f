"""``ImageItem``: shows pictures without QtMultimedia and without a graphics card."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

from enum import IntEnum

from rosglass.qt import Property, QtCore, QtGui, QtQuick, Signal, is_alive

__all__ = ["ImageItem"]


class ImageItem(QtQuick.QQuickPaintedItem):
    """An item that paints the newest picture it was given.

    Stands in for a VideoOutput where that shows nothing: software rendering, offscreen, overlays,
    installations without QtMultimedia. It is its own ``videoSink``.
    """

    sourceChanged = Signal()
    fillModeChanged = Signal()
    hasFrameChanged = Signal()

    @QtCore.QEnum
    class FillMode(IntEnum):
        """How a picture of another shape fills the item; VideoOutput's names and numbers."""

        Stretch = 0
        PreserveAspectFit = 1
        PreserveAspectCrop = 2

    def __init__(self, parent: QtQuick.QQuickItem | None = None) -> None:
        super().__init__(parent)
        self._image: QtGui.QImage | None = None
        self._fill = int(self.FillMode.PreserveAspectFit)
        self._source: QtCore.QObject | None = None
        # PySide 6.11 never frees the Python half of what QML has made.
        state = self.__dict__
        self.destroyed.connect(lambda: state.update(_image=None, _source=None))

    def present(self, image: QtGui.QImage | None) -> None:
        """Show an image; None clears the item. On the GUI thread only."""
        had = self._image is not None
        self._image = image
        if had != (image is not None):
            self.hasFrameChanged.emit()
        self.update()

    def paint(self, painter: QtGui.QPainter) -> None:
        """Paint the picture; Qt calls it on the render thread while the GUI thread waits."""
        image = self._image
        if image is None:
            return
        painter.setRenderHint(QtGui.QPainter.RenderHint.SmoothPixmapTransform, self.smooth())
        target, source = self._place(image)
        painter.drawImage(target, image, source)

    def _place(self, image: QtGui.QImage) -> tuple[QtCore.QRectF, QtCore.QRectF]:
        """Return where the picture goes, and which part of it."""
        width, height = self.width(), self.height()
        whole = QtCore.QRectF(0, 0, image.width(), image.height())
        target = QtCore.QRectF(0, 0, width, height)
        if self._fill == self.FillMode.Stretch or not width or not height:
            return target, whole
        ratios = (width / image.width(), height / image.height())
        scale = min(ratios) if self._fill == self.FillMode.PreserveAspectFit else max(ratios)
        shown = QtCore.QSizeF(
            min(width, image.width() * scale), min(height, image.height() * scale)
        )
        target = QtCore.QRectF(QtCore.QPointF(0, 0), shown)
        target.moveCenter(QtCore.QPointF(width / 2, height / 2))
        part = QtCore.QRectF(QtCore.QPointF(0, 0), shown / scale)
        part.moveCenter(whole.center())
        return target, part

    def _get_sink(self) -> QtCore.QObject:
        return self

    def _get_source(self) -> QtCore.QObject | None:
        return self._source

    def _set_source(self, source: QtCore.QObject | None) -> None:
        if source is self._source:
            return
        before = self._source
        # At the end of an interface, QML may take the source away before this.
        if before is not None and is_alive(before) and before.property("videoSink") is self:
            before.setProperty("videoSink", None)
        self._source = source
        if source is not None:
            source.setProperty("videoSink", self)
        self.sourceChanged.emit()

    def _set_fill(self, mode: int) -> None:
        if mode != self._fill:
            self._fill = mode
            self.fillModeChanged.emit()
            self.update()

    videoSink = Property(QtCore.QObject, _get_sink, constant=True)
    source = Property(QtCore.QObject, _get_source, _set_source, notify=sourceChanged)
    fillMode = Property(int, lambda self: self._fill, _set_fill, notify=fillModeChanged)
    hasFrame = Property(bool, lambda self: self._image is not None, notify=hasFrameChanged)

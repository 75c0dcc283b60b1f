"""The element ``DepthImageProcessor`` that RQml's Image View needs: shows depths up to a limit."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
from functools import cache
from importlib.util import find_spec
from typing import Any

from rosglass.qml.engine.log import log_from_qml
from rosglass.qml.engine.properties import Writable, within
from rosglass.qml.engine.runtime import runtime_of
from rosglass.qt import QT6, Property, QtCore, Slot, is_alive, optional

__all__ = ["DepthImageProcessor", "has_multimedia"]

#: Depths in metres up to this are taken for "no limit".
_NO_LIMIT = 0.001


def has_multimedia() -> bool:
    """Return whether QtMultimedia of Qt 6 is installed; it is not loaded, which takes long."""
    return QT6 and find_spec("PySide6.QtMultimedia") is not None


@cache
def _multimedia() -> Any:
    return optional("QtMultimedia")


class DepthImageProcessor(QtCore.QObject):
    """Passes video frames on; depths (16 bits, in millimetres) as greys.

    Black is an unknown depth, and white is :attr:`maxDepth` or more; the grey next to black is the
    least depth.
    """

    #: Metres shown as white; 0 to pass depths on unchanged.
    maxDepth = Writable(float, 3.0, within(0, 1e6, "metres"), then="_show")
    #: The video sink that shows the frames.
    outputVideoSink = Writable(QtCore.QObject, None, then="_show")

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._sink: Any = _multimedia().QVideoSink(self)
        self._sink.videoFrameChanged.connect(self._show)
        self._grabbed: Any = None
        state = self.__dict__
        # PySide 6.11 never frees the Python half of an object created by QML.
        self.destroyed.connect(lambda: state.update(_sink=None, _grabbed=None))

    #: The video sink that receives frames.
    videoSink = Property(QtCore.QObject, lambda self: self._sink, constant=True)

    @Slot()
    def grabFrame(self) -> None:
        """Keep the frame that is shown, for :meth:`saveGrabbedFrame`."""
        output: Any = self.outputVideoSink
        self._grabbed = output.videoFrame() if is_alive(output) else None

    @Slot()
    def clearGrabbedFrame(self) -> None:
        """Forget the frame that was kept."""
        self._grabbed = None

    @Slot(str, result=bool)
    def saveGrabbedFrame(self, path: str) -> bool:
        """Save the frame that was kept; return False, with the reason in the log, if it cannot."""
        if self._grabbed is None or not self._grabbed.isValid():
            self._refuse("no image was grabbed")
            return False
        image = self._grabbed.toImage()
        if image.isNull() or not image.save(path):
            self._refuse(f"{path}: the image cannot be saved there")
            return False
        return True

    @Slot()
    def _show(self, *_: Any) -> None:
        output: Any = self.outputVideoSink
        if not is_alive(output) or not is_alive(self._sink):
            return
        frame = self._sink.videoFrame()
        depths = _multimedia().QVideoFrameFormat.PixelFormat.Format_Y16
        if frame.isValid() and frame.pixelFormat() == depths and self.maxDepth > _NO_LIMIT:
            frame = _greys(frame, self.maxDepth)
        output.setVideoFrame(frame)

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return "DepthImageProcessor"

    def _refuse(self, text: str) -> None:
        runtime = runtime_of(self)
        if runtime is not None:
            log_from_qml("", logging.WARNING, f"{self.label}: {text}", runtime.caller())


def _greys(frame: Any, most: float) -> Any:
    """Return a frame of depths in millimetres as one of greys, with white for `most` metres."""
    import numpy as np  # noqa: PLC0415 - slow to import

    multimedia = _multimedia()
    modes, formats = multimedia.QVideoFrame.MapMode, multimedia.QVideoFrameFormat
    if not frame.map(modes.ReadOnly):
        return frame
    try:
        size = frame.size()
        shape = size.height(), size.width()
        depths = np.ndarray(shape, np.uint16, frame.bits(0), 0, (frame.bytesPerLine(0), 2))
        # By a table: an image has more pixels than there are depths.
        levels = np.minimum(255, 1 + np.arange(65536) * (254 / (most * 1000))).astype(np.uint8)
        levels[0] = 0
        made = multimedia.QVideoFrame(formats(size, formats.PixelFormat.Format_Y8))
        if not made.map(modes.WriteOnly):
            return frame
        try:
            grey = np.ndarray(shape, np.uint8, made.bits(0), 0, (made.bytesPerLine(0), 1))
            np.take(levels, depths, out=grey)
        finally:
            made.unmap()
    finally:
        frame.unmap()
    return made

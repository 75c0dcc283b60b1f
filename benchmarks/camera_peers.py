"""The other processes of ``camera_latency.py``: a camera, and a viewer without rosglass.

    python benchmarks/camera_peers.py camera URL WIDTH HEIGHT
    python benchmarks/camera_peers.py plain WIDTH HEIGHT QML_FILE

Both make the same images at 30 Hz: a pattern, with the moment and the number in a line of
squares.
"""

from __future__ import annotations

import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.demo import framecode

if TYPE_CHECKING:
    from collections.abc import Callable

RATE = 30.0
TOPIC = "/camera/image_raw"


def code_place(width: int, height: int) -> tuple[int, int, int]:
    """Return where the line of squares is in an image, and the size of a square."""
    square = framecode.SQUARE * max(1, width // 640)
    return width - (framecode.BITS + 1) * square, height - 2 * square, square


class Film:
    """Calls `show` with an image and its stamp, ns, at 30 Hz; the memory is used again."""

    def __init__(self, width: int, height: int, show: Callable[[np.ndarray, int], None]) -> None:
        rows, columns = np.mgrid[:height, :width]
        self.picture = np.stack([columns, rows, columns + rows], 2).astype(np.uint8)
        self._line = np.empty((framecode.SQUARE, framecode.BITS * framecode.SQUARE, 3), np.uint8)
        self._show = show
        self._end = threading.Event()

    def run(self) -> None:
        """Film until :meth:`stop`."""
        height, width = self.picture.shape[:2]
        x, y, square = code_place(width, height)
        scale = square // framecode.SQUARE
        due, number = time.monotonic(), 0
        while not self._end.wait(max(0.0, due - time.monotonic())):
            now = time.time_ns()
            framecode.draw(self._line, framecode.FrameCode.at(now, number), 0, 0)
            line = self._line.repeat(scale, 0).repeat(scale, 1)
            self.picture[y : y + square, x : x + line.shape[1]] = line
            self._show(self.picture, now)
            number += 1
            due += 1 / RATE

    def stop(self) -> None:
        """End :meth:`run`."""
        self._end.set()


def camera(url: str, width: int, height: int) -> None:
    import rosglass
    from rosglass.comm import Time

    node = rosglass.connect(url, "camera")
    publisher = node.create_publisher(TOPIC, "sensor_msgs/msg/Image", 1)

    def show(picture: np.ndarray, now: int) -> None:
        publisher.publish(
            header={"stamp": Time(now)},
            width=width,
            height=height,
            encoding="rgb8",
            step=3 * width,
            data=picture.reshape(-1),
        )

    Film(width, height, show).run()


def plain(width: int, height: int, file: str) -> None:
    """Show the images as Qt's documentation suggests, converted in a thread of their own."""
    import cv2
    from PySide6.QtCore import QObject, QSize, QUrl, Signal
    from PySide6.QtGui import QGuiApplication
    from PySide6.QtMultimedia import QVideoFrame, QVideoFrameFormat
    from PySide6.QtQuick import QQuickView

    class Bridge(QObject):
        ready = Signal(object)

    app = QGuiApplication([])
    view = QQuickView()
    view.setResizeMode(QQuickView.ResizeMode.SizeRootObjectToView)
    view.setSource(QUrl.fromLocalFile(file))
    root: Any = view.rootObject()
    sink = root.property("sink")
    layout = QVideoFrameFormat(QSize(width, height), QVideoFrameFormat.PixelFormat.Format_RGBX8888)
    bridge = Bridge()
    bridge.ready.connect(sink.setVideoFrame)

    def show(picture: np.ndarray, _: int) -> None:
        frame = QVideoFrame(layout)
        frame.map(QVideoFrame.MapMode.WriteOnly)
        pixels = np.ndarray(
            (height, width, 4), np.uint8, frame.bits(0), 0, (frame.bytesPerLine(0), 4, 1)
        )
        cv2.cvtColor(picture, cv2.COLOR_RGB2RGBA, dst=pixels)
        frame.unmap()
        bridge.ready.emit(frame)

    film = Film(width, height, show)
    thread = threading.Thread(target=film.run, daemon=True)
    view.show()
    thread.start()
    app.exec()
    film.stop()


if __name__ == "__main__":
    if sys.argv[1] == "camera":
        camera(sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
    else:
        plain(int(sys.argv[2]), int(sys.argv[3]), sys.argv[4])

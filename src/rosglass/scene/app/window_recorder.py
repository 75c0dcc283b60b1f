"""Records a window as a video: each frame that it shows, read back from the GPU."""

from __future__ import annotations

import contextlib
import logging
import time
from typing import TYPE_CHECKING, Any

import numpy as np
from PySide6.QtGui import QRhiReadbackDescription, QRhiReadbackResult, QRhiTexture

from rosglass.images.video_writer import VideoWriter
from rosglass.qt import QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from PySide6.QtQuick import QQuickWindow

    from rosglass.images.video_writer import VideoStatus

__all__ = ["WindowRecorder"]

_log = logging.getLogger("rosglass.scene")
#: Maximum frames per second, and how much earlier than planned a frame may be: windows are drawn in
#: steps of the screen's own rate.
_MAX_RATE_HZ, _EARLY_S = 30.0, 0.005
_FORMATS = {QRhiTexture.Format.RGBA8: "rgba", QRhiTexture.Format.BGRA8: "bgra"}


class WindowRecorder(QtCore.QObject):
    """Records a window from :meth:`start` to :meth:`close`; a window at rest costs nothing.

    It needs Qt's basic render loop, which draws in the GUI thread.

    Args:
        path: The file; see :class:`VideoWriter`.

    Raises:
        Error: It cannot be written, or its suffix is unknown.
        UnsupportedError: PyAV is missing.
    """

    #: The recording has ended early. Argument: why.
    failed = Signal(str)

    def __init__(self, path: str | os.PathLike[str]) -> None:
        super().__init__()
        self._writer = VideoWriter(path)
        self.path = self._writer.path
        self._window: Any = None
        self._started = 0.0
        #: When a frame was last taken or dropped, by :func:`time.monotonic`.
        self._taken = -1.0
        #: The frame that the GPU is reading back.
        self._reading: QRhiReadbackResult | None = None
        self._problem = ""
        #: Draws once more after a skipped frame, which might have been the last one.
        self._later = QtCore.QTimer(self)
        self._later.setSingleShot(True)
        self._later.timeout.connect(self._draw)

    @property
    def text(self) -> str:
        """The text for a status bar; empty while nothing is recorded."""
        if self._window is None or self._problem:
            return ""
        seconds = int(time.monotonic() - self._started)
        return f"recording {seconds // 60}:{seconds % 60:02}"

    def status(self) -> VideoStatus:
        """Return the present state of the recording."""
        return self._writer.status()

    def start(self, window: QQuickWindow) -> None:
        """Record a window from now on."""
        self._window, self._started = window, time.monotonic()
        window.afterRendering.connect(self._on_rendered)
        window.frameSwapped.connect(self._on_swapped)
        window.update()

    @Slot()
    def close(self) -> VideoStatus:
        """End the recording; safe to call twice."""
        window, self._window = self._window, None
        self._later.stop()
        if window is not None and is_alive(window):
            window.afterRendering.disconnect(self._on_rendered)
            window.frameSwapped.disconnect(self._on_swapped)
        return self._writer.close(time.monotonic())

    @Slot()
    def _draw(self) -> None:
        if self._window is not None and is_alive(self._window):
            self._window.update()

    @Slot()
    def _on_rendered(self) -> None:
        """Start reading back the frame that the window is about to show."""
        self._take()  # of a window that was grabbed, and not shown
        now = time.monotonic()
        wait = self._taken + 1 / _MAX_RATE_HZ - now
        if wait <= _EARLY_S and self._writer.is_full:
            self._writer.count_dropped()
            self._taken, wait = now, 1 / _MAX_RATE_HZ
        if wait > _EARLY_S:
            if not self._later.isActive():
                self._later.start(max(int(wait * 1000), 1))
            return
        with self._ending_on_errors():
            rhi, chain = self._window.rhi(), self._window.swapChain()
            if rhi is None or chain is None:
                self._fail("the window is drawn without a graphics interface")
                return
            batch = rhi.nextResourceUpdateBatch()
            self._reading = QRhiReadbackResult()
            batch.readBackTexture(QRhiReadbackDescription(), self._reading)
            chain.currentFrameCommandBuffer().resourceUpdate(batch)
        self._taken = now

    @Slot()
    def _on_swapped(self) -> None:
        self._take()

    def _take(self) -> None:
        """Pass the frame that was read back to the encoder."""
        reading, self._reading = self._reading, None
        if reading is None:
            return
        with self._ending_on_errors():
            rhi = self._window.rhi()
            if reading.data.isEmpty():
                rhi.finish()
            # A copy: numpy does not keep Qt's memory alive.
            data, size = reading.data.data(), reading.pixelSize
            pixels = np.frombuffer(data, np.uint8).reshape(size.height(), size.width(), 4)
            if rhi.isYUpInFramebuffer():
                pixels = pixels[::-1]
            self._writer.add(pixels, self._taken, _FORMATS[QRhiTexture.Format(reading.format)])
        problem = self.status().problem
        if problem:
            self._fail(problem)

    @contextlib.contextmanager
    def _ending_on_errors(self) -> Iterator[None]:
        try:
            yield
        except Exception as error:  # of QRhi, whose interface changes: the window itself goes on
            _log.exception("the window cannot be recorded")
            self._fail(repr(error))

    def _fail(self, problem: str) -> None:
        if not self._problem:
            self._problem = problem
            _log.error("the recording has ended: %s", problem)
            self.failed.emit(problem)
            QtCore.QTimer.singleShot(0, self, self.close)

"""The figures that the demo measures, and the table that it prints."""

from __future__ import annotations

import math
import os
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.demo import framecode
from rosglass.demo.camera import CODE_POSITION
from rosglass.qt import QtCore, optional

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.qt import QtQuick

# Imported before QML creates a video sink: PySide supports only types of imported modules.
_MULTIMEDIA: Any = optional("QtMultimedia")

__all__ = ["CameraFigures", "Latency", "ProcessFigures", "table"]

#: Number of pictures whose latency is kept, for five minutes: a cockpit may run for days.
_NEWEST = 9000


@dataclass(frozen=True)
class Latency:
    """Milliseconds from a picture's stamp to its display.

    Attributes:
        count: Number of pictures.
        median: Half of them were faster.
        p95: 95 % were faster.
        worst: The slowest.
    """

    count: int
    median: float
    p95: float
    worst: float

    @classmethod
    def of(cls, seconds: Sequence[float]) -> Latency:
        """Return the figures of some latencies."""
        if not seconds:
            return cls(0, math.nan, math.nan, math.nan)
        milliseconds = 1000 * np.asarray(seconds)
        median, p95 = np.percentile(milliseconds, [50, 95])
        return cls(len(seconds), float(median), float(p95), float(milliseconds.max()))


class CameraFigures(QtCore.QObject):
    """Follows the pictures of the simulated camera onto the screen.

    Reads the frame code of each picture that reaches the video sink; the picture counts as
    displayed at the window's next buffer swap.

    Args:
        sink: The ``QVideoSink`` that shows the camera.
        window: Window with the sink.
    """

    def __init__(self, sink: Any, window: QtQuick.QQuickWindow) -> None:
        super().__init__()
        self._sink = sink
        self._waiting: framecode.FrameCode | None = None
        self._last = -1
        #: Seconds from stamp to screen of the newest pictures.
        self.latencies: deque[float] = deque(maxlen=_NEWEST)
        #: Pictures that reached the screen's video sink.
        self.frames = 0
        #: Pictures missing between the first and the last, by their sequence numbers.
        self.missing = 0
        self._sink.videoFrameChanged.connect(self._on_frame)
        # Queued: no Python code may run on the render thread.
        window.frameSwapped.connect(self._on_swap, QtCore.Qt.ConnectionType.QueuedConnection)

    def forget(self) -> None:
        """Reset the counts."""
        self.latencies.clear()
        self.frames = self.missing = 0
        self._last = -1

    def _on_frame(self, frame: Any) -> None:
        if not frame.isValid():
            return
        self.frames += 1
        code = self._code(frame)
        if code is None:
            return
        if self._last >= 0:
            gap = (code.number - self._last) % 65536
            # A restarted robot counts from the beginning.
            self.missing += gap - 1 if 0 < gap < 1000 else 0
        self._last, self._waiting = code.number, code

    def _on_swap(self) -> None:
        if self._waiting is not None:
            self.latencies.append(self._waiting.age(time.time_ns()))
            self._waiting = None

    def _code(self, frame: Any) -> framecode.FrameCode | None:
        if not frame.map(_MULTIMEDIA.QVideoFrame.MapMode.ReadOnly):
            return None
        try:
            pixels = frame.bytesPerLine(0) // max(1, frame.width())
            x, y = CODE_POSITION
            start = (y + framecode.SQUARE // 2) * frame.bytesPerLine(0) + x * pixels
            length = framecode.BITS * framecode.SQUARE * pixels
            row = np.frombuffer(frame.bits(0), np.uint8)[start : start + length]
            return framecode.read(row[1 if pixels > 1 else 0 :: pixels].copy())
        except framecode.FrameCodeError:
            return None  # another camera than the simulated one
        finally:
            frame.unmap()


class ProcessFigures:
    """CPU time and memory of this process, from creation on."""

    def __init__(self) -> None:
        self._wall, self._cpu = time.monotonic(), time.process_time()

    def cpu(self) -> float:
        """Return the share of one core used since creation, 1.0 for all of it."""
        wall = time.monotonic() - self._wall
        return (time.process_time() - self._cpu) / wall if wall > 0 else 0.0

    @staticmethod
    def memory() -> float:
        """Return the resident memory in MiB; NaN if the system does not report it."""
        try:
            pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        except OSError:
            return math.nan
        return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows as text in columns; the first row is the heading."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    lines.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(lines)

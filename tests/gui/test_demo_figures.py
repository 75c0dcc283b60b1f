"""The figures that the demo prints."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the simulated camera needs the extra `camera`")
multimedia = pytest.importorskip("PySide6.QtMultimedia", reason="needs the extra `camera`")

from PySide6.QtCore import Qt  # noqa: E402
from PySide6.QtGui import QColor, QImage  # noqa: E402

from rosglass.demo import framecode  # noqa: E402
from rosglass.demo.app import CameraFigures, Latency, table  # noqa: E402
from rosglass.demo.camera import CODE_POSITION, HEIGHT, WIDTH  # noqa: E402

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.usefixtures("app")


class Window:
    """As much of a window as the figures need."""

    def __init__(self) -> None:
        from PySide6.QtCore import QObject, Signal

        class Swapping(QObject):
            frameSwapped = Signal()  # noqa: N815 - Qt's

        self.item = Swapping()


def frame(number: int, age: float = 0.0) -> Any:
    """Return a video frame with a frame code in it."""
    picture = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
    code = framecode.FrameCode.at(time.time_ns() - round(age * 1e9), number)
    framecode.draw(picture, code, *CODE_POSITION)
    image = QImage(picture.data, WIDTH, HEIGHT, 4 * WIDTH, QImage.Format.Format_RGBX8888).copy()
    return multimedia.QVideoFrame(image)


def test_images_are_counted_and_timed(wait: Callable[..., None]) -> None:
    sink, window = multimedia.QVideoSink(), Window()
    figures = CameraFigures(sink, window.item)  # type: ignore[arg-type]
    for count, number in enumerate((65_534, 65_535, 0, 3, 4, 1), start=1):
        sink.setVideoFrame(frame(number, 0.05))
        window.item.frameSwapped.emit()
        wait(lambda count=count: len(figures.latencies) == count)
    assert figures.frames == 6
    assert figures.missing == 2, "1 and 2; then the robot was restarted"
    assert list(figures.latencies) == pytest.approx([0.05] * 6, abs=0.04)


def test_images_of_other_cameras_are_only_counted() -> None:
    sink, window = multimedia.QVideoSink(), Window()
    figures = CameraFigures(sink, window.item)  # type: ignore[arg-type]
    plain = QImage(320, 240, QImage.Format.Format_RGBX8888)
    plain.fill(QColor(Qt.GlobalColor.red))
    sink.setVideoFrame(multimedia.QVideoFrame(plain))
    assert (figures.frames, figures.missing, list(figures.latencies)) == (1, 0, [])


def test_latency_without_samples_is_nan() -> None:
    assert math.isnan(Latency.of([]).median)
    assert Latency.of([0.01, 0.02, 0.03]) == Latency(3, 20.0, pytest.approx(29.0), 30.0)


def test_tables_line_up() -> None:
    text = table([["topic", "Hz"], ["/a", "30.0"], ["/long/name", ""]])
    assert text.splitlines() == [
        "topic       Hz",
        "----------  ----",
        "/a          30.0",
        "/long/name",
    ]

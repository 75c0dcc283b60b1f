"""The cockpit as a program: window, node, and the figures it prints when it ends."""

from __future__ import annotations

import gc
import math
import os
import sys
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.demo import framecode
from rosglass.demo.camera import CODE_POSITION
from rosglass.errors import Error, QmlError
from rosglass.qml import Session
from rosglass.qml.elements.subscription import Subscription
from rosglass.qml.engine.log import install_message_handler
from rosglass.qml.engine.process import QuitOnSignal, close_network, quiet_qt, require_display
from rosglass.qml.run.runner import Runner
from rosglass.qt import QtCore, QtGui, QtQuick, optional

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["AUTOPILOT", "CameraFigures", "Cockpit", "Latency", "ProcessFigures", "table"]

_QML = Path(__file__).with_name("cockpit") / "main.qml"
#: Movements of the stick without an operator: start in seconds, right, down.
AUTOPILOT = (
    (2.5, -0.32, -0.45),
    (5.0, 0.0, -0.62),
    (10.6, 0.3, -0.5),
    (12.6, 0.42, -0.14),
    (14.6, 0.0, -0.15),
    (16.2, 0.1, -0.18),
    (17.2, -0.09, -0.2),
)


class Cockpit:
    """The cockpit's window in this process.

    Args:
        url: URL of the robot's graph.
        size: Size of the window in pixels; None for its own.

    Raises:
        UnsupportedError: There is no display.
        QmlError: The interface cannot be loaded; the message lists why.
    """

    def __init__(self, url: str, size: tuple[int, int] | None = None) -> None:
        quiet_qt()
        connected = require_display()
        install_message_handler()
        self.app = QtGui.QGuiApplication.instance() or QtGui.QGuiApplication(sys.argv[:1])
        connected()
        # Native text is sharper, and costs half of distance fields without a graphics card. Where
        # the cockpit is magnified (main.qml), it would be cut.
        if QtGui.QGuiApplication.primaryScreen().size().width() <= 1920:
            QtQuick.QQuickWindow.setTextRenderType(
                QtQuick.QQuickWindow.TextRenderType.NativeTextRendering
            )
        close_network()
        self.session = Session(url)
        self._closed = False
        #: The stick's position without an operator: right, down.
        self._pulled: tuple[float, float] | None = None
        self._runner = Runner(_QML, self.session)
        try:
            self._runner.load()
        except QmlError:
            self._runner.close()
            self.session.close()
            raise
        assert self._runner.window is not None
        self.window = self._runner.window
        if size is not None:
            self.window.resize(*size)
        self.window.requestActivate()
        self.process = ProcessFigures()
        self.camera = CameraFigures(self.item("picture").property("videoSink"), self.window)

    def at(self, seconds: float, job: Callable[[], None]) -> None:
        """Run a job after some seconds."""
        QtCore.QTimer.singleShot(round(seconds * 1000), job)

    def fly(self, plan: Sequence[tuple[float, float, float]] = AUTOPILOT) -> None:
        """Move the stick automatically by the mouse, as an operator would."""
        for begin, x, y in plan:
            self.at(begin, lambda x=x, y=y: self._pull(x, y))  # type: ignore[misc]
        if plan:
            self._grip = QtCore.QTimer(self.window, interval=500)
            self._grip.timeout.connect(lambda: self._pull(*self._pulled) if self._pulled else None)
            self._grip.start()

    def _pull(self, x: float, y: float) -> None:
        """Pull the stick; press it again if a busy machine has halted it."""
        self._pulled = (x, y)
        stick, mouse = self.item("stick"), _TEST.QTest
        middle, reach = stick.width() / 2, stick.width() * 0.31
        left, none = QtCore.Qt.MouseButton.LeftButton, QtCore.Qt.KeyboardModifier.NoModifier
        if not stick.property("active"):
            center = stick.mapToScene(QtCore.QPointF(middle, middle)).toPoint()
            mouse.mouseRelease(self.window, left, none, center)
            mouse.mousePress(self.window, left, none, center)
        point = stick.mapToScene(QtCore.QPointF(middle + x * reach, middle + y * reach))
        mouse.mouseMove(self.window, point.toPoint())

    def screenshot(self, path: Path) -> None:
        """Save a screenshot of the window.

        Raises:
            Error: The file cannot be written.
        """
        if not self.window.grabWindow().save(str(path)):
            raise Error(f"the screenshot cannot be written to {path.resolve()}")

    def run(self, seconds: float | None = None) -> int:
        """Show the window until it is closed, Ctrl-C is pressed, or the time is up.

        Returns:
            0, or 128 and the number of the signal that ended it.
        """
        loop = QtCore.QEventLoop()
        # Not the application's own loop, which would close the node before the figures are read.
        self.window.visibleChanged.connect(lambda shown: None if shown else loop.quit())
        signals: list[int] = []

        def interrupted(number: int) -> None:
            signals.append(number)
            self.session.executor.post(loop.quit)

        if seconds is not None:
            QtCore.QTimer.singleShot(round(seconds * 1000), loop.quit)
        with QuitOnSignal(interrupted):
            loop.exec()
            self._let_go()
        return 128 + signals[0] if signals else 0

    def _let_go(self) -> None:
        """Halt the robot, and wait until the zeros were sent."""
        self._pulled = None
        self.item("drive").halt()
        loop = QtCore.QEventLoop()
        QtCore.QTimer.singleShot(200, loop.quit)
        loop.exec()

    def close(self) -> None:
        """Close the window and leave the graph; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        # Elements unregister from the session, so that they have to be deleted first.
        self._runner.close()
        self.session.close()
        # At the end of the program, PySide deletes remaining objects in any order, and may crash.
        gc.collect()

    def topics(self) -> list[Any]:
        """Return the interface's subscriptions, one for each topic, by topic."""
        found = {item.property("topic"): item for item in self.window.findChildren(Subscription)}
        return [found[topic] for topic in sorted(found) if topic]

    def received(self, topic: str) -> bool:
        """Return whether a message of the topic was ever received."""
        return any(
            item.property("topic") == topic and item.property("age") >= 0 for item in self.topics()
        )

    def report(self) -> str:
        """Return the figures as text."""
        rows = [["topic", "type", "Hz", "newest"]]
        for item in self.topics():
            age = item.property("age")
            rows.append(
                [
                    item.property("topic"),
                    item.property("messageType"),
                    f"{item.property('frequency'):.1f}" if item.property("frequency") else "",
                    "never" if age < 0 else f"{age * 1000:.0f} ms ago",
                ]
            )
        stream = self.item("cameraStream")
        latency = Latency.of(self.camera.latencies)
        measured = (
            f"median {latency.median:.1f} ms, 95 % within {latency.p95:.1f} ms, "
            f"worst {latency.worst:.1f} ms ({latency.count} images)"
            if latency.count
            else "not measured, no image of the simulated camera was shown"
        )
        rows.append(
            [
                "/camera/image_raw",
                f"sensor_msgs/msg/Image {stream.property('encoding')}",
                f"{stream.property('framerate'):.1f}",
                f"{self.camera.frames} shown",
            ]
        )
        driven = self.item("map").property("driven")
        shown = f"camera, from the robot's stamp to the screen: {measured}"
        cost = (
            f"cockpit: {100 * self.process.cpu():.0f} % of a core, "
            f"{self.process.memory():.0f} MiB; robot: {driven:.1f} m driven"
        )
        lines = (table(rows), "", shown, f"dropped images: {self.camera.missing}", cost)
        return "\n".join(lines)

    def item(self, name: str) -> Any:
        """Return a part of the interface by its objectName.

        Raises:
            Error: There is no part of that name.
        """
        found = self.window.findChild(QtCore.QObject, name)
        if found is None:
            raise Error(f"the cockpit has no part called {name!r}")
        return found


# Imported before QML creates a video sink: PySide supports only types of imported modules.
_MULTIMEDIA: Any = optional("QtMultimedia")
_TEST: Any = optional("QtTest")

#: Number of images whose latency is kept, for five minutes: a cockpit may run for days.
_NEWEST = 9000


@dataclass(frozen=True)
class Latency:
    """Milliseconds from an image's stamp to its display.

    Attributes:
        count: Number of images.
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
    """Follows the images of the simulated camera onto the screen.

    Reads the frame code of each image that reaches the video sink; the image counts as
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
        #: Seconds from stamp to screen of the newest images.
        self.latencies: deque[float] = deque(maxlen=_NEWEST)
        #: Images that reached the screen's video sink.
        self.frames = 0
        #: Images missing between the first and the last, by their sequence numbers.
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

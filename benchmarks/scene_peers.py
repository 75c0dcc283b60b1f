"""The processes that benchmarks/scene.py measures: RViz, a view of rosglass, and small programs.

Each takes JSON objects, a line each, and answers each with a line of JSON. ``rviz`` runs in
.venv-system, all others in .venv.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import statistics
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

VIEW = (1280, 800)
_ROBOT_TIMEOUT_S = 60
#: Degrees that the camera turns with each frame.
_STEP_RAD = 0.02
#: The interface above the 3D view.
_QML = """
import QtQuick
import RosScene 1.0
Item {
    property bool animated: false
    SceneView { id: scene; objectName: "scene"; anchors.fill: parent }
    Rectangle {
        x: 20; y: 20; width: 320; height: 120; radius: 8; color: "#c0202020"
        Text { x: 12; y: 12; color: "white"; text: "battery 87 %"; font.pixelSize: 22 }
        Rectangle { x: 12; y: 60; width: 140; height: 40; radius: 4; color: "#406090" }
    }
    Rectangle {
        x: 1100; y: 60; width: 100; height: 100; color: "#40c060"
        NumberAnimation on rotation {
            running: animated; loops: Animation.Infinite; from: 0; to: 360; duration: 2000
        }
    }
}
"""
_BARE = "import QtQuick\nimport Bare 1.0\nBareItem { width: 1280; height: 800 }"
_CYCLES = """
import QtQuick
import RosScene 1.0
Item {
    property bool shown: false
    Loader {
        anchors.fill: parent
        active: shown
        sourceComponent: Component { SceneView { GridDisplay {} AxesDisplay {} } }
    }
}
"""


def memory() -> float:
    """Return the resident memory of this process in MiB."""
    text = Path("/proc/self/smaps_rollup").read_text(encoding="ascii")
    return int(text.split("Rss:")[1].split()[0]) / 1024


def run_for(seconds: float) -> None:
    """Run the event loop."""
    from rosglass.qt import QtCore, run_event_loop

    loop = QtCore.QEventLoop()
    QtCore.QTimer.singleShot(round(seconds * 1000), loop.quit)
    run_event_loop(loop)


def rasterizing() -> float:
    """Return the seconds of CPU that Mesa's own threads have taken, which fill in pixels."""
    seconds = 0.0
    for task in Path("/proc/self/task").iterdir():
        with contextlib.suppress(OSError):
            if (task / "comm").read_text().startswith("llvmpipe"):
                seconds += int((task / "schedstat").read_text().split()[0]) / 1e9
    return seconds


def measured(frames: Callable[[], int], run: Callable[[], None]) -> dict[str, float]:
    """Return the frames, and CPU milliseconds of all threads, while something runs."""
    filling = rasterizing()
    count, cpu, started = frames(), time.process_time(), time.perf_counter()
    run()
    count, cpu = frames() - count, time.process_time() - cpu
    took = time.perf_counter() - started
    filling = rasterizing() - filling
    return {
        "frames": count,
        "ms": 1000 * cpu / max(count, 1),
        "fps": count / took,
        "percent": 100 * cpu / took,
        "filling_percent": 100 * filling / took,
    }


class Blocks:
    """The times for which the event loop handles nothing, while a ``with`` block runs."""

    def __init__(self) -> None:
        from rosglass.qt import QtCore

        self._timer = QtCore.QTimer()
        self._timer.setTimerType(QtCore.Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._end)
        self._last = self._last_cpu = 0.0
        #: The longest one, in seconds, and the longest by the CPU that it took.
        self.longest = self.longest_cpu = 0.0

    def _end(self) -> None:
        now, cpu = time.perf_counter(), time.thread_time()
        self.longest = max(self.longest, now - self._last)
        self.longest_cpu = max(self.longest_cpu, cpu - self._last_cpu)
        self._last, self._last_cpu = now, cpu

    def __enter__(self) -> Blocks:
        self._last, self._last_cpu = time.perf_counter(), time.thread_time()
        self._started, self._cpu = self._last, time.process_time()
        self._timer.start(1)
        return self

    def __exit__(self, *_: object) -> None:
        self._end()
        self._timer.stop()
        self.seconds = time.perf_counter() - self._started
        self.cpu = time.process_time() - self._cpu

    def figures(self) -> dict[str, float]:
        """Return what was measured, in seconds."""
        return {
            "seconds": self.seconds,
            "cpu": self.cpu,
            "blocked": self.longest,
            "blocked_cpu": self.longest_cpu,
        }


class Rviz:
    """RViz, its 3D view alone, with hard edges."""

    def __init__(self, url: str) -> None:
        from rosglass.rviz import Application

        self._app = Application(url=url, anti_aliasing=False, bare=True)
        self._app.window.widget.setGeometry(0, 0, *VIEW)
        self._app.window.widget.show()
        self._count = 0
        self._app.window.before_frame.connect(self._on_frame)

    def _on_frame(self) -> None:
        self._count += 1

    def load(self, config: str) -> None:
        """Open a config."""
        self._app.load_config(config)
        for _ in range(4):
            panel, widget = self._app.window.panel, self._app.window.widget
            widget.resize(
                widget.width() + VIEW[0] - panel.width(),
                widget.height() + VIEW[1] - panel.height(),
            )
            self._app.qt.processEvents()

    def overlay(self, file: str) -> None:
        """Show a QML file over it."""
        self._app.add_qml(Path(file))

    def open_robot(self, config: str) -> dict[str, float]:
        """Open a config with a robot, and return how long it takes until that is shown."""
        with Blocks() as blocks:
            self.load(config)
            before = self._count
            # The first frame may begin before the robot is there.
            while self._count < before + 2:
                run_for(0.001)
        return blocks.figures()

    def wait(self, seconds: float) -> dict[str, float]:
        """Let it draw as it does by itself."""
        return measured(lambda: self._count, lambda: run_for(seconds))

    def move(self, seconds: float, all: bool = True) -> dict[str, float]:  # noqa: ARG002
        """Turn the camera with each frame, drawing as fast as it can."""
        from rosglass.qt import QtCore
        from rosglass.rviz.host import pyqt

        core, manager = pyqt(), self._app.window.manager
        yaw = manager.getViewManager().getCurrent().subProp("Yaw")
        manager.stopUpdate()

        def draw() -> None:
            yaw.setValue(yaw.getValue() + _STEP_RAD)
            core.QMetaObject.invokeMethod(manager, "onUpdate", core.Qt.DirectConnection)

        timer = QtCore.QTimer()
        timer.timeout.connect(draw)
        timer.start(0)
        found = measured(lambda: self._count, lambda: run_for(seconds))
        timer.stop()
        manager.startUpdate()
        return found


class Costs:
    """Seconds of CPU that messages take, in the thread that each function runs in."""

    def __init__(self) -> None:
        self.seconds = {"node": 0.0, "gui": 0.0}
        self.longest = 0.0

    def watch(self, owner: Any, name: str, thread: str) -> None:
        """Count a method's time."""
        method = getattr(owner, name)

        def timed(*args: Any) -> Any:
            started = time.thread_time()
            try:
                return method(*args)
            finally:
                took = time.thread_time() - started
                self.seconds[thread] += took
                if thread == "gui":
                    self.longest = max(self.longest, took)

        setattr(owner, name, timed)


class Frames:
    """The frames of a window, and how much of the time the 3D view takes of them.

    Args:
        window: The window.
        drawn: Returns how many frames of the 3D view were drawn.
    """

    def __init__(self, window: Any, drawn: Callable[[], int]) -> None:
        self._drawn, self._before, self._since = drawn, 0, 0.0
        #: Seconds of each frame, with and without a new frame of the 3D view.
        self.seconds: dict[bool, list[float]] = {True: [], False: []}
        window.afterAnimating.connect(self._begin)
        window.frameSwapped.connect(self._end)

    def _begin(self) -> None:
        self._before, self._since = self._drawn(), time.perf_counter()

    def _end(self) -> None:
        self.seconds[self._drawn() > self._before].append(time.perf_counter() - self._since)

    def clear(self) -> None:
        """Forget all."""
        for frames in self.seconds.values():
            frames.clear()

    def shares(self, seconds: float) -> dict[str, float]:
        """Return the window's frames per second, and the percentage of the time left to QML."""
        both, alone = self.seconds[True], self.seconds[False]
        plain = statistics.median(alone) if alone else 0.0
        taken = sum(max(one - plain, 0.0) for one in both)
        return {
            "window_fps": (len(both) + len(alone)) / seconds,
            "qml_percent": 100 * (1 - taken / seconds),
            "plain_ms": 1000 * plain,
            "both_ms": 1000 * statistics.median(both) if both else 0.0,
        }


class View:
    """A SceneView below some QML, in a window."""

    def __init__(self, url: str) -> None:
        from PySide6.QtGui import QGuiApplication
        from PySide6.QtQuick import QQuickView

        import rosglass.scene
        from rosglass.qml import Session, install
        from rosglass.scene.displays import marker, message_queue, topic_display
        from rosglass.scene.render import renderer

        self.costs = Costs()
        self.costs.watch(message_queue.MessageQueue, "receive", "node")
        self.costs.watch(topic_display.TopicDisplay, "_on_items", "gui")
        self.costs.watch(marker.MarkerGroup, "flush", "gui")
        for kind in renderer._KINDS.values():
            self.costs.watch(kind, "upload", "gui")
        self._renderer = renderer
        self._limit = renderer.MOVING_POINTS
        self._app = QGuiApplication(["scene"])
        rosglass.scene.register()
        self._window = QQuickView()
        self._session = Session(url)
        install(self._window.engine(), self._session)
        self._session.init(f"scene_view_{os.getpid()}")
        file = Path(os.environ["HOME"], "View.qml")
        file.write_text(_QML)
        self._window.setResizeMode(QQuickView.ResizeMode.SizeRootObjectToView)
        self._window.resize(*VIEW)
        self._window.setSource(file.as_uri())
        self._root = self._window.rootObject()
        self._view = self._root.findChild(rosglass.scene.SceneView, "scene")
        self._frames = Frames(self._window, self._view.pictures_drawn)
        self._window.show()

    def load(self, config: str) -> None:
        """Open a config."""
        self._view.load_config(config)

    def overlay(self, file: str) -> None:
        """Show a QML file over it."""
        from rosglass.scene import add_overlay

        add_overlay(self._view, file)

    def open_robot(self, config: str) -> dict[str, float]:
        """Open a config with a robot, and return how long it takes until that is shown."""
        with Blocks() as blocks:
            self.load(config)
            (robot,) = (one for one in self._view.scene.displays if one.TYPE == "RobotModel")
            drawn = self._view.pictures_drawn
            loaded: list[int] = []
            count = lambda: loaded.append(drawn())  # noqa: E731 - methods change metaobjects
            robot.robotChanged.connect(count)
            until = time.perf_counter() + _ROBOT_TIMEOUT_S
            while not (loaded and drawn() > loaded[0]) and time.perf_counter() < until:
                run_for(0.001)
            robot.robotChanged.disconnect(count)
        if not loaded:
            raise SystemExit(robot.statusText)
        return blocks.figures()

    def received(self) -> int:
        """Return how many displays have got a message."""
        return sum(getattr(one, "received", 1) > 0 for one in self._view.scene.displays)

    def points(self) -> int:
        """Return how many points of clouds are shown."""
        return sum(getattr(one, "points", 0) for one in self._view.scene.displays)

    def device(self) -> str:
        """Return the name of what draws, and by which graphics interface."""
        driver = self._window.rhi().driverInfo()  # its name lives no longer than it
        name = bytes(driver.deviceName.data()).decode(errors="replace")
        return f"{name}, by {self._window.rendererInterface().graphicsApi().name}"

    def wait(self, seconds: float) -> dict[str, float]:
        """Let it draw as it does by itself, and count what messages cost."""
        costs = self.costs
        costs.seconds, costs.longest = {"node": 0.0, "gui": 0.0}, 0.0
        before = self._messages()
        self._frames.clear()
        found = measured(self._view.pictures_drawn, lambda: run_for(seconds))
        found |= self._frames.shares(seconds)
        found["messages"] = count = self._messages() - before
        found |= {f"{k}_ms": 1000 * v / max(count, 1) for k, v in costs.seconds.items()}
        return found | {"longest_ms": 1000 * costs.longest}

    def _messages(self) -> int:
        displays = self._view.scene.displays
        return sum(one._queue.received for one in displays if getattr(one, "_queue", None))

    def move(self, seconds: float, all: bool = True) -> dict[str, float]:
        """Turn the camera with each frame, drawing as fast as it can."""
        self._renderer.MOVING_POINTS = 10**9 if all else self._limit
        view, controller = self._view, self._view.controller

        def turn() -> None:
            controller.set("Yaw", (controller.get("Yaw") + _STEP_RAD) % 6.28)
            view.camera_moved()
            view.update()  # at once, as when the user drags it

        self._window.frameSwapped.connect(turn)
        self._frames.clear()
        turn()
        found = measured(view.pictures_drawn, lambda: run_for(seconds))
        found |= self._frames.shares(seconds)
        self._window.frameSwapped.disconnect(turn)
        return found

    def animate(self, seconds: float) -> dict[str, float]:
        """Animate QML above the scene, which is still."""
        frames: list[None] = []
        count = lambda: frames.append(None)  # noqa: E731 - methods change metaobjects
        self._window.frameSwapped.connect(count)
        self._root.setProperty("animated", True)
        before = self._view.pictures_drawn()
        found = measured(lambda: len(frames), lambda: run_for(seconds))
        self._root.setProperty("animated", False)
        self._window.frameSwapped.disconnect(count)
        return found | {"redrawn": self._view.pictures_drawn() - before}

    def pick(self, times: int) -> dict[str, float]:
        """Pick again and again, at several places and in the middle of what is drawn."""
        drawn = [one for one in self._view._drawables() if one[0].owner is not None]
        camera, took, hits = self._view.camera(), [], 0
        for number in range(times):
            x, y = 300 + 37 * number % 700, 200 + 53 * number % 400
            if number % 2:
                drawable, pose, _ = drawn[number * 7 % len(drawn)]
                low, high = drawable.bounds()
                seen = camera.project(tuple((pose @ [*(low + high) / 2, 1])[:3]))
                x, y = seen.x, seen.y
            started = time.thread_time()
            hits += self._view.pick(x, y) is not None
            took.append(1000 * (time.thread_time() - started))
        return {"ms": statistics.median(took), "longest": max(took), "hits": hits}

    def click(self, times: int) -> dict[str, float]:
        """Click while the camera moves; return the frames until a tool has the clicked point."""
        from PySide6.QtCore import QEvent, QPointF, Qt
        from PySide6.QtGui import QMouseEvent

        from rosglass.qt import QtCore
        from rosglass.scene import Tool

        tool = Tool()
        self._view.tools.add(tool)
        tool.select()
        answers: list[int] = []
        tool.pressed.connect(lambda _: answers.append(self._view.pictures_drawn()))
        asked: list[int] = []
        button, none = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton

        def click() -> None:
            asked.append(self._view.pictures_drawn())
            at = QPointF(300 + 37 * len(asked) % 700, 200 + 53 * len(asked) % 400)
            for kind, held in (
                (QEvent.Type.MouseButtonPress, button),
                (QEvent.Type.MouseButtonRelease, none),
            ):
                event = QMouseEvent(kind, at, at, button, held, Qt.KeyboardModifier.NoModifier)
                QtCore.QCoreApplication.postEvent(self._window, event)

        timer = QtCore.QTimer()
        timer.timeout.connect(click)
        timer.start(100)
        self.move(times / 10)
        timer.stop()
        run_for(0.2)
        waited = [after - before for before, after in zip(asked, answers, strict=True)]
        self._view.tools.select("MoveCamera")
        return {"pictures": max(waited), "clicks": len(waited)}

    def profile(self, seconds: float) -> dict[str, float]:
        """Return Python's functions by their own time while data arrives, for a look by hand."""
        import cProfile
        import pstats

        profiler = cProfile.Profile()
        profiler.enable()
        run_for(seconds)
        profiler.disable()
        pstats.Stats(profiler, stream=sys.stderr).sort_stats("tottime").print_stats(25)
        return {}


class Cycles:
    """A window in which a SceneView is made and destroyed."""

    def __init__(self, url: str) -> None:
        from PySide6.QtGui import QGuiApplication
        from PySide6.QtQuick import QQuickView

        import rosglass.scene
        from rosglass.qml import Session, install

        self._app = QGuiApplication(["scene"])
        rosglass.scene.register()
        self._window = QQuickView()
        self._session = Session(url)
        install(self._window.engine(), self._session)
        file = Path(os.environ["HOME"], "Cycles.qml")
        file.write_text(_CYCLES)
        self._window.setResizeMode(QQuickView.ResizeMode.SizeRootObjectToView)
        self._window.resize(400, 300)
        self._window.setSource(file.as_uri())
        self._window.show()

    def repeat(self, times: int) -> dict[str, float]:
        """Make and destroy it so many times, and say what it holds afterwards."""
        from rosglass.qt import send_deferred_deletes

        root = self._window.rootObject()
        before, started = memory(), time.perf_counter()
        for _ in range(times):
            root.setProperty("shown", True)
            self._window.grabWindow()
            run_for(0.01)
            root.setProperty("shown", False)
            self._window.grabWindow()
            run_for(0.01)
            send_deferred_deletes()
        gc.collect()
        run_for(0.2)
        took = 1000 * (time.perf_counter() - started) / times
        return {"memory": memory(), "grown": memory() - before, "ms": took}


def first_frame(what: str) -> None:
    """Show a window, print FIRST FRAME once it is on the screen, and end."""

    def shown() -> None:
        print("FIRST FRAME", flush=True)
        os._exit(0)

    if what == "bare":
        os.environ["QSG_RENDER_LOOP"] = "basic"
        from PySide6.QtGui import QColor, QGuiApplication, QRhiDepthStencilClearValue
        from PySide6.QtQml import qmlRegisterType
        from PySide6.QtQuick import QQuickRhiItem, QQuickRhiItemRenderer, QQuickView

        class Renderer(QQuickRhiItemRenderer):
            def initialize(self, commands: Any) -> None: ...
            def synchronize(self, item: Any) -> None: ...
            def render(self, commands: Any) -> None:
                depth = QRhiDepthStencilClearValue(1.0, 0)
                commands.beginPass(self.renderTarget(), QColor("#303030"), depth, None)
                commands.endPass()

        class BareItem(QQuickRhiItem):
            def createRenderer(self) -> Any:  # noqa: N802 - Qt's name
                self.renderer = Renderer()
                return self.renderer

        app = QGuiApplication(["bare"])
        qmlRegisterType(BareItem, "Bare", 1, 0, "BareItem")
        window = QQuickView()
        window.frameSwapped.connect(shown)
        file = Path(os.environ["HOME"], "Bare.qml")
        file.write_text(_BARE)
        window.setSource(file.as_uri())
        window.show()
        app.exec()
        return
    # In the order of the installed command.
    from rosglass.cli import main, view

    show = view.show_interface

    def watched(*args: Any, **options: Any) -> int:
        program = type(options["context"]["program"])
        begin = program.begin

        def watch(self: Any, view: Any, *others: Any) -> None:
            begin(self, view, *others)
            view.window().frameSwapped.connect(lambda: view.pictures_drawn() and shown())

        program.begin = watch
        return show(*args, **options)

    view.show_interface = watched
    sys.exit(main(["view", "--url", "local://benchmark"]))


def main() -> None:
    what, url = sys.argv[1:3]
    del sys.argv[1:]
    if what in ("bare", "program"):
        first_frame(what)
        return
    peer: Any = {"rviz": Rviz, "view": View, "cycles": Cycles}[what](url)
    run_for(1.0)
    print(json.dumps({}), flush=True)
    for line in sys.stdin:
        order = json.loads(line)
        print(json.dumps(getattr(peer, order.pop("do"))(**order)), flush=True)
    os._exit(0)


if __name__ == "__main__":
    main()

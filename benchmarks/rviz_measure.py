"""Measures an RViz with overlays for the benchmarks of rosglass.rviz, in RViz's own process.

A measured process gets its orders as JSON in its arguments and prints its figures as JSON.
"""

from __future__ import annotations

import ctypes
import gc
import itertools
import json
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["fit_view", "memory", "processor", "run_for", "uncapped", "works_during"]

VIEW = (1280, 800)
QML = Path(__file__).with_name("rviz_overlay.qml")
#: Uses everything that an interface can have of RViz.
EVERYTHING = Path(__file__).with_name("rviz_cycles.qml")
DASHBOARD = Path(__file__).parents[1] / "examples/rviz"


def memory(pid: int | str = "self", *, own: bool = False) -> float:
    """Return the resident memory of a process in MiB.

    Args:
        pid: The process.
        own: What it has written itself alone: without the code of libraries, for instance.
    """
    sizes = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii")
    return int(sizes.split("Private_Dirty:" if own else "Rss:")[1].split()[0]) / 1024


def processor(seconds: float, run: Callable[[float], None]) -> float:
    """Return the percentage of a core that this process takes while something runs."""
    before, started = time.process_time(), time.perf_counter()
    run(seconds)
    return 100 * (time.process_time() - before) / (time.perf_counter() - started)


def run_for(seconds: float, app: Any) -> None:
    """Run the event loop."""
    from rosglass.qt import QtCore, run_event_loop

    loop = QtCore.QEventLoop()
    QtCore.QTimer.singleShot(round(seconds * 1000), loop.quit)
    run_event_loop(loop)
    del app


def fit_view(app: Any, width: int = VIEW[0], height: int = VIEW[1]) -> None:
    """Leave RViz nothing but its 3D view, of a size in pixels."""
    from rosglass.rviz.qt5 import QtWidgets

    widget = app.window.widget
    for kind in (QtWidgets.QDockWidget, QtWidgets.QToolBar):
        for child in widget.findChildren(kind):
            child.hide()
    widget.menuBar().hide()
    widget.statusBar().hide()
    for _ in range(4):
        panel = app.window.panel
        widget.resize(
            widget.width() + width - panel.width(), widget.height() + height - panel.height()
        )
        app.qt.processEvents()


def uncapped(app: Any, seconds: float) -> tuple[float, float]:
    """Have RViz draw as fast as it can; returns frames per second and a frame's median in ms."""
    from rosglass.qt import QtCore
    from rosglass.rviz.host import pyqt

    core = pyqt()
    manager = app.window.manager
    manager.stopUpdate()
    ends: list[float] = [time.perf_counter()]

    def draw() -> None:
        core.QMetaObject.invokeMethod(manager, "onUpdate", core.Qt.DirectConnection)
        ends.append(time.perf_counter())

    timer = QtCore.QTimer()
    timer.timeout.connect(draw)
    timer.start(0)
    run_for(seconds, app)
    timer.stop()
    manager.startUpdate()
    frames = [after - before for before, after in itertools.pairwise(ends)]
    return len(frames) / (ends[-1] - ends[0]), 1000 * statistics.median(frames)


def works_during(app: Any, run: Callable[[], Any]) -> list[Any]:
    """Return what overlays took before each frame in which any was drawn, while something runs."""
    works: list[Any] = []
    app.overlays.drawn.connect(works.append)
    run()
    app.overlays.drawn.disconnect(works.append)
    return works


def medians(works: list[Any]) -> dict[str, float]:
    """Return the medians of each part in ms; empty when nothing was drawn."""
    if not works:
        return {}
    parts = {name: statistics.median(getattr(w, name) for w in works) for name in works[0]._fields}
    return {**parts, "total": statistics.median(work.total for work in works)}


def measure(order: dict[str, Any]) -> dict[str, Any]:
    """Measure start and memory of RViz without overlay, with a static or with an animated one."""
    from rosglass.qt import QtCore
    from rosglass.rviz import Application

    app = Application(renderer=order["renderer"], anti_aliasing=order["anti_aliasing"])
    app.window.widget.setGeometry(0, 0, *VIEW)
    overlay = app.add_qml(QML) if order["what"] != "without" else None
    frames: list[float] = []
    first: list[float] = []

    def drawn() -> None:
        frames.append(time.time())
        if overlay is None or app.overlays.covered:
            first.append(time.time())

    def before() -> None:
        # Comes when RViz has drawn the frame that it is about to draw now.
        QtCore.QTimer.singleShot(0, drawn)

    app.window.before_frame.connect(before)
    app.window.widget.show()
    fit_view(app)
    run_for(2.0, app)
    if order["what"] == "animated":
        overlay._root.setProperty("animated", True)
    uncapped(app, order["seconds"])
    figures: dict[str, Any] = {
        "start": 1000 * (first[0] - order["started"]),
        "later": first[0] - frames[0],
    }
    gc.collect()
    figures["memory"], figures["own"] = memory(), memory(own=True)
    app.close()
    return figures


def turns(order: dict[str, Any]) -> dict[str, Any]:
    """Measure one RViz without overlay, with a static and an animated one by turns.

    Returns:
        By contender, what was measured in each turn but for the first, which warms up.
    """
    from rosglass.rviz import Application
    from rosglass.rviz.rendering import choice

    app = Application(renderer=order["renderer"], anti_aliasing=order["anti_aliasing"])
    app.window.widget.setGeometry(0, 0, *VIEW)
    app.window.widget.show()
    fit_view(app)
    run_for(2.0, app)
    seconds, contenders = order["seconds"], list(order["contenders"])
    found: dict[str, list[dict[str, Any]]] = {what: [] for what in contenders}
    for number in range(order["turns"] + 1):
        for what in contenders:
            overlay = app.add_qml(QML) if what != "without" else None
            # Memory of overlays that went is given back in the first three seconds.
            run_for(3.5, app)
            if what == "animated":
                overlay._root.setProperty("animated", True)
                run_for(0.3, app)
            figures: dict[str, Any] = {"cpu": processor(seconds, lambda s: run_for(s, app))}
            done: list[tuple[float, float]] = []
            works = works_during(app, lambda done=done: done.append(uncapped(app, seconds)))
            figures["fps"], figures["frame"] = done[0]
            figures |= {"work": medians(works), "covered": app.overlays.covered}
            figures["renderer"] = choice.renderer if overlay else None
            if overlay:
                app.overlays.remove(overlay)
            if number:
                found[what].append(figures)
        # Whatever follows another is measured after it as often as before it.
        contenders.reverse()
    return found


def save_bare(order: dict[str, Any]) -> dict[str, Any]:
    """Save a config with which RViz's own program shows as large a 3D view, and little else."""
    from rosglass.rviz import Application

    app = Application()
    app.window.widget.show()
    fit_view(app)
    # RViz shows its menu and the handles of its docks all the same, 51 and twice 16 pixels large.
    app.window.widget.resize(VIEW[0] + 32, VIEW[1] + 51)
    run_for(0.5, app)
    app.save_config(order["config"])
    return {}


def dashboard(order: dict[str, Any]) -> dict[str, Any]:
    """Measure the dashboard of examples/rviz beside a live robot."""
    from rosglass.rviz import Application
    from rosglass.rviz.rendering import choice

    config = DASHBOARD / "figure1.rviz"
    app = Application(config, url=order["url"], renderer=order["renderer"])
    app.add_qml(DASHBOARD / "Dashboard.qml")
    app.window.widget.setGeometry(0, 0, *VIEW)
    app.window.widget.show()
    fit_view(app)
    run_for(5.0, app)
    frames: list[None] = []
    app.window.before_frame.connect(lambda: frames.append(None))
    used: list[float] = []

    def run() -> None:
        used.append(processor(order["seconds"], lambda s: run_for(s, app)))

    works = works_during(app, run)
    figures: dict[str, Any] = {"cpu": used[0], "frames": len(frames)}
    figures["renderer"] = choice.renderer
    figures["works"] = [{**work._asdict(), "total": work.total} for work in works]
    return figures


def frames(app: Any, count: int = 1) -> None:
    """Have RViz draw now, and Qt carry out what it was asked to do later."""
    from rosglass.rviz.host import pyqt

    core = pyqt()
    for _ in range(count):
        core.QMetaObject.invokeMethod(app.window.manager, "onUpdate", core.Qt.DirectConnection)
        run_for(0.0, app)


def collect_javascript(app: Any) -> None:
    """Have JavaScript let go of what it has known; otherwise it does so when it likes."""
    for overlay in app.overlays:
        overlay.engine.collectGarbage()


def left_over(app: Any) -> dict[str, float]:
    """Return what a process holds: MiB without what malloc keeps for later, objects, files."""
    collect_javascript(app)
    frames(app, 3)
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    return {
        "memory": memory(),
        "objects": len(gc.get_objects()),
        "files": sum(1 for _ in Path("/proc/self/fd").iterdir()),
        "threads": sum(1 for _ in Path("/proc/self/task").iterdir()),
    }


def steps(app: Any) -> dict[str, Callable[[int], None]]:
    """Return what is done again and again, by name."""
    from rosglass.rviz import Popup, WidgetOverlay
    from rosglass.rviz.qt5 import QtWidgets

    steady = app.add_qml(EVERYTHING, "steady")

    def overlay(_number: int) -> None:
        made = app.add_qml(EVERYTHING, "passing")
        frames(app)
        app.overlays.remove(made)
        frames(app)

    def widget(number: int) -> None:
        made = app.add(WidgetOverlay(controls(QtWidgets), "passing"))
        frames(app)
        made.scale = 0.5 + number % 3
        frames(app)
        app.overlays.remove(made)
        frames(app)

    def popup(_number: int) -> None:
        made = app.add(Popup(controls(QtWidgets), "passing"))
        frames(app)
        app.overlays.remove(made)
        frames(app)

    def entry(_number: int) -> None:
        made = app.entries.add_qml(str(EVERYTHING), "passing")
        frames(app)
        app.entries.remove(made)
        frames(app)

    def reload(_number: int) -> None:
        assert steady.reload()
        frames(app)

    def scale(number: int) -> None:
        steady.scale = 0.5 + number % 3
        frames(app)

    def resize(number: int) -> None:
        app.window.widget.resize(640 + number % 7 * 8, 480 + number % 5 * 8)
        frames(app)

    def resize_alone(number: int) -> None:
        steady.visible = False
        resize(number)

    return {
        "QML added, removed": overlay,
        "widgets added, scaled, removed": widget,
        "popup added, removed": popup,
        "entry added, removed": entry,
        "QML reloaded": reload,
        "QML scaled": scale,
        "window resized": resize,
        "window resized, nothing shown": resize_alone,
    }


def controls(widgets: Any) -> Any:
    """Return a widget with some others in it."""
    box = widgets.QWidget()
    layout = widgets.QVBoxLayout(box)
    for part in (widgets.QPushButton("x"), widgets.QComboBox(), widgets.QLineEdit()):
        layout.addWidget(part)
    return box


def cycles(order: dict[str, Any]) -> dict[str, Any]:
    """Have overlays come, change and go again and again; return what each kind leaves behind."""
    from rosglass.rviz import Application

    app = Application()
    app.window.widget.setGeometry(0, 0, 640, 480)
    app.window.widget.show()
    run_for(1.0, app)
    found: dict[str, Any] = {}
    for name, step in steps(app).items():
        for number in range(order["warm_up"]):
            step(number)
        before, started = left_over(app), time.perf_counter()
        for number in range(order["cycles"]):
            step(number)
            if number % 100 == 99:
                # JavaScript never gives back what it has once needed.
                collect_javascript(app)
        took = time.perf_counter() - started
        after = left_over(app)
        found[name] = {key: after[key] - before[key] for key in before}
        found[name]["ms"] = 1000 * took / order["cycles"]
        print(name, found[name], flush=True)
    app.close()
    return found


def main() -> None:
    order = json.loads(sys.argv[1])
    sys.argv[1:] = []
    with tempfile.TemporaryDirectory() as home:
        os.environ.update(HOME=home, XDG_RUNTIME_DIR=home)
        others = {"turns": turns, "cycles": cycles, "dashboard": dashboard, "bare": save_bare}
        figures = others.get(order["what"], measure)(order)
        Path(order["into"]).write_text(json.dumps(figures), encoding="utf-8")
    # What is measured is over; how a process ends is for others to test.
    os._exit(0)


if __name__ == "__main__":
    main()

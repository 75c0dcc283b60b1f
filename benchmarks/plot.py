"""Measures the control Plot against pyqtgraph, in one run.

    python benchmarks/plot.py [--seconds N] [--only frames|zoom|receive] [--way NAME] [--json FILE]

Frames: 20 series of 600,000 samples (1 kHz for ten minutes: a sine of 0.01 to 1 Hz with noise), to
which 33 samples come each thirtieth of a second, are shown in a window of 800x600 and 1920x1080,
all ten minutes or ten seconds of them, drawn by OpenGL (llvmpipe on a virtual X server) and by Qt's
software renderer, both on the GUI thread. The figure is the processor time of the GUI thread for
each frame, and the longest that it computed without getting back to its event loop. pyqtgraph draws
the same offscreen: "peak" downsamples by itself (autoDownsample, clipToView), "reduced" is given
the extremes of each column, as our store computes them. Zoomed: the visible time changes in each
frame, so that all of the plot is computed and painted again; also in 3840x2160.

Zoom: such a step at 3840 columns, reading the store alone. Memory: bytes of the store for each byte
of times and values. Receive: 20 topics of geometry_msgs/PoseStamped at 1 kHz from other processes,
one path each: share of a core of the whole process, over Zenoh (robots of
benchmarks/many_topics.py) and DDS, beside a callback for each message. Each runs in a process of
its own. Exits 1 when a target is missed.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
from publishing import finish

SERIES, HZ, HISTORY_S, FRAME_S = 20, 1000, 600, 1 / 30
POSE = "geometry_msgs/msg/PoseStamped"
SIZES = ((800, 600), (1920, 1080))
WINDOWS = (600.0, 10.0)
ZOOMED_SIZES = (*SIZES, (3840, 2160))
#: Milliseconds of the GUI thread for a frame by its height, for the longest one, and for a step of
#: zoom; bytes of the store for each byte; share of a core for receiving.
FRAME_MS, LONGEST_MS, ZOOM_MS = {600: 5.0, 1080: 8.0}, 20.0, 10.0
MEMORY, RECEIVE = 1.2, 0.30
#: Seconds before anything is measured.
_SETTLE_S = 3.0


def signal(series: int, first: int, count: int) -> Any:
    """Return samples of a series: a sine with noise."""
    import numpy as np

    at = (first + np.arange(count)) / HZ
    noise = np.random.default_rng((series, first)).normal(scale=0.05, size=count)
    frequency = 0.01 * 100 ** (series / (SERIES - 1))
    return np.sin(2 * np.pi * frequency * at + series) * (1 + series / 10) + noise


class Frames:
    """Measures the GUI thread for some seconds, then ends the program."""

    def __init__(self, app: Any, seconds: float) -> None:
        from rosglass.qt import QtCore

        self._app, self._seconds, self.count = app, seconds, 0
        self._cpu = self._start = self._work = 0.0
        self.longest = 0.0
        dispatcher = QtCore.QAbstractEventDispatcher.instance()
        dispatcher.aboutToBlock.connect(self._on_block)
        QtCore.QTimer.singleShot(int(_SETTLE_S * 1000), self._begin)

    def _begin(self) -> None:
        from rosglass.qt import QtCore

        self.count, self.longest = 0, 0.0
        self._cpu, self._start = time.thread_time(), time.monotonic()
        QtCore.QTimer.singleShot(int(self._seconds * 1000), self._end)

    def _on_block(self) -> None:
        # What was computed since the thread went to sleep before is the work of one turn.
        now = time.thread_time()
        if self.count:
            self.longest = max(self.longest, now - self._work)
        self._work = now

    def _end(self) -> None:
        cpu, span = time.thread_time() - self._cpu, time.monotonic() - self._start
        figures = {
            "ms": cpu / max(1, self.count) * 1000,
            "longest": self.longest * 1000,
            "rate": self.count / span,
            "share": cpu / span,
        }
        print(json.dumps(figures), flush=True)
        os._exit(0)


def ours(plan: dict[str, Any]) -> None:
    """Show a Plot whose store is filled, and live data."""
    import threading

    import numpy as np

    import rosglass
    from rosglass.controls import register
    from rosglass.qml import Session, install
    from rosglass.qt import QtCore, QtGui, QtQml, run_event_loop

    app = QtGui.QGuiApplication(["plot"])
    register()
    robot = rosglass.connect("local://plot", name="robot")
    session, engine = Session("local://plot"), QtQml.QQmlEngine()
    install(engine, session)
    session.init("plot")
    paths = json.dumps([f"/t{number}:data" for number in range(SERIES)])
    component = QtQml.QQmlComponent(engine)
    component.setData(
        f"""
        import QtQuick 2.15
        import QtQuick.Window 2.15
        import RosControls 1.0
        Window {{
            width: {plan["width"]}; height: {plan["height"]}; visible: true; color: Theme.background
            Plot {{ anchors.fill: parent; paths: {paths}; window: {plan["window"]}; history: 0
                    timeout: 0 }}
        }}""".encode(),
        QtCore.QUrl.fromLocalFile(str(Path(__file__).with_name("plot.qml"))),
    )
    window: Any = component.create()
    assert window is not None, component.errorString()
    data: Any = window.findChild(QtCore.QObject, "plotData")
    while len(data._feeds) < SERIES or not all(f.subscription for f in data._feeds.values()):
        app.processEvents()
    now = time.time_ns()
    count = HISTORY_S * HZ
    feeds = [data._feeds[f"/t{number}"] for number in range(SERIES)]
    period = 1_000_000_000 // HZ
    for number, feed in enumerate(feeds):
        times = now + (np.arange(count, dtype=np.int64) - count) * period
        feed.fields[0].add(times, signal(number, 0, count), None)
        feed.arrived = robot.steady()
    start = time.monotonic()

    def live() -> None:
        # As the receiver's thread does, without the receiving.
        done = 0
        while True:
            time.sleep(FRAME_S)
            due = int((time.monotonic() - start) * HZ)
            times = now + np.arange(done, due, dtype=np.int64) * period
            for number, feed in enumerate(feeds):
                feed.fields[0].add(times, signal(number, count + done, due - done), None)
                feed.arrived = robot.steady()
            done = due

    frames = Frames(app, plan["seconds"])

    def drawn() -> None:
        frames.count += 1
        if plan["zoomed"]:
            data.zoom(1 / 0.98 if frames.count // 50 % 2 else 0.98, 1.0)

    window.frameSwapped.connect(drawn)
    threading.Thread(target=live, daemon=True).start()
    run_event_loop(app)


def pyqtgraph(plan: dict[str, Any]) -> None:
    """Show the same in a PlotWidget."""
    import numpy as np
    import pyqtgraph as pg

    from rosglass.controls.plots.samples import Samples
    from rosglass.qt import QtCore

    app = pg.mkQApp()
    widget = pg.PlotWidget()
    widget.resize(plan["width"], plan["height"])
    widget.addLegend()
    widget.setYRange(-3, 3)
    count, window = HISTORY_S * HZ, plan["window"]
    lines = [widget.plot(pen=pg.intColor(number, SERIES)) for number in range(SERIES)]
    room = count + int((_SETTLE_S + plan["seconds"] + 5) * HZ)
    values = [signal(number, 0, room) for number in range(SERIES)]
    times = (np.arange(room) - count) / HZ
    stores = []
    if plan["way"] == "reduced":
        for number in range(SERIES):
            stores.append(Samples())
            stores[-1].add((np.arange(room) * 1_000_000).astype(np.int64), values[number])
    else:
        for line in lines:
            line.setDownsampling(auto=True, method="peak")
            line.setClipToView(True)
    widget.show()
    frames = Frames(app, plan["seconds"])
    start = time.monotonic()
    columns = plan["width"]
    low, high = np.empty((2, columns))
    xs = np.repeat(np.arange(columns) / columns * window - window, 2)

    def frame() -> None:
        end = count + int((time.monotonic() - start) * HZ)
        if stores:
            step = int(window * 1e9 / columns)
            first = (end * 1_000_000 // step - columns + 1) * step
            for line, store in zip(lines, stores, strict=True):
                store.reduce(low, high, first, step)
                ys = np.column_stack((low, high)).ravel()
                ys[~np.isfinite(ys)] = np.nan
                line.setData(xs, ys, connect="all", skipFiniteCheck=False)
        else:
            for line, ys in zip(lines, values, strict=True):
                line.setData(times[:end], ys[:end])
            now = times[end - 1]
            widget.setXRange(now - window, now, padding=0)
        frames.count += 1

    timer = QtCore.QTimer()
    timer.timeout.connect(frame)
    timer.start(33)
    app.exec()


def zoom(_plan: dict[str, Any]) -> None:
    """Recompute all columns at 3840 pixels, and weigh the store."""
    import numpy as np

    from rosglass.controls.plots.samples import Columns, Samples

    count = HISTORY_S * HZ
    times = np.arange(count, dtype=np.int64) * 1_000_000
    lines = []
    for number in range(SERIES):
        lines.append(Samples())
        values = signal(number, 0, count)
        for at in range(0, count, 33):
            lines[-1].add(times[at : at + 33], values[at : at + 33])
    columns, found = Columns(), []
    for turn in range(40):
        step = int(HISTORY_S * 1e9 * 0.98**turn / 3840)
        begin = time.thread_time()
        columns.update(lines, count * 1_000_000 // step - 3839, step, 3840)
        found.append((time.thread_time() - begin) * 1000)
    memory = sum(line.nbytes for line in lines) / (SERIES * count * 16)
    found.sort()
    print(json.dumps({"ms": found[20], "longest": found[-1], "memory": memory}), flush=True)


def receive(plan: dict[str, Any]) -> None:
    """Receive 20 topics, by a plot's receiver or by callbacks."""
    import rosglass
    from rosglass.controls.plots.series import FieldFeed, PlotReceiver, TopicFeed

    node = rosglass.connect(plan["url"], "screen")
    names = plan["topics"]
    while len(set(node.topics()) & set(names)) < len(names):
        time.sleep(0.05)
    time.sleep(1.0)
    counts = [0]
    feeds = {}
    receiver = PlotReceiver(node)
    if plan["way"] == "plot":
        for name in names:
            feeds[name] = TopicFeed(name)
            feeds[name].set_fields((FieldFeed("pose.position.x"),), use_stamps=True)
        receiver.set_feeds(feeds)
    else:

        def callback(message: Any) -> None:
            _ = message.pose.position.x
            counts[0] += 1

        for name in names:
            node.create_subscription(name, POSE, callback)

    def received() -> int:
        return counts[0] + sum(feed.received for feed in feeds.values())

    time.sleep(_SETTLE_S)
    before, cpu, start = received(), time.process_time(), time.monotonic()
    time.sleep(plan["seconds"])
    span, used, count = time.monotonic() - start, time.process_time() - cpu, received() - before
    lost = sum(
        feed.subscription.statistics().dropped + feed.subscription.statistics().lost
        for feed in feeds.values()
    )
    kept = sum(len(feed.fields[0].lines[0]) for feed in feeds.values() if feed.fields[0].lines)
    total = sum(feed.received for feed in feeds.values())
    figures = {
        "share": used / span,
        "us": used / max(1, count) * 1e6,
        "received": count / (span * HZ * len(names)),
        "lost": lost,
        "kept": kept / total if total else 1.0,
    }
    print(json.dumps(figures), flush=True)
    os._exit(0)


def publish(plan: dict[str, Any]) -> None:
    """Publish over DDS until killed."""
    import rosglass

    node = rosglass.connect(plan["url"], "robot")
    made = [node.create_publisher(name, POSE, 10) for name in plan["topics"]]
    data = {"header": {"frame_id": "map"}}
    print("ready", flush=True)
    due, parent = time.monotonic(), os.getppid()
    while os.getppid() == parent:
        for publisher in made:
            publisher.publish(data)
        due += 1 / HZ
        time.sleep(max(0.0, due - time.monotonic()))


ROLES = {
    "ours": ours, "pyqtgraph": pyqtgraph, "zoom": zoom, "receive": receive, "publish": publish,
}  # fmt: skip


def run(role: str, plan: dict[str, Any], environment: dict[str, str], prefix: list[str]) -> Any:
    """Run a role in a process of its own; returns its figures, or None with the reason printed."""
    command = [*prefix, sys.executable, "-W", "ignore", __file__, "--role", role]
    done = subprocess.run(
        [*command, "--plan", json.dumps(plan)],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=180 + plan.get("seconds", 0),
        check=False,
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if not lines:
        last = (done.stderr.strip().splitlines() or ["nothing was printed"])[-1]
        print(f"  {role} {plan}: not measured: {last}", flush=True)
        return None
    return json.loads(lines[-1])


def frames(seconds: float, wanted: str, missed: list[str]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    software = {"QT_QPA_PLATFORM": "offscreen", "QT_QUICK_BACKEND": "software"}
    opengl = {"QT_QPA_PLATFORM": "xcb", "LIBGL_ALWAYS_SOFTWARE": "1"}
    basic = {"QSG_RENDER_LOOP": "basic", "QT_QUICK_BACKEND": ""}
    screen = ["xvfb-run", "-a", "-s", "-screen 0 3840x2160x24"]
    ways: list[tuple[str, str, dict[str, str], list[str]]] = [
        ("ours, software", "ours", basic | software, []),
        ("ours, OpenGL", "ours", basic | opengl, screen),
        ("pyqtgraph, reduced", "pyqtgraph", {"QT_QPA_PLATFORM": "offscreen"}, []),
        ("pyqtgraph, peak", "pyqtgraph", {"QT_QPA_PLATFORM": "offscreen"}, []),
    ]
    cases = [(size, window, False) for size in SIZES for window in WINDOWS]
    cases += [(size, WINDOWS[0], True) for size in ZOOMED_SIZES]
    for (width, height), window, zoomed in cases:
        what = f"{width}x{height}, {window:g} s{', zoomed' * zoomed}"
        print(f"{SERIES} series, {what}", flush=True)
        for name, role, environment, prefix in ways:
            if wanted not in name or (zoomed and role != "ours"):
                continue
            plan = {"width": width, "height": height, "window": window, "seconds": seconds}
            plan |= {"way": name.rpartition(" ")[2], "zoomed": zoomed}
            figures = run(role, plan, environment, prefix)
            if figures is None:
                continue
            found[f"{name} {what}"] = figures
            line = f"  {name:20} {figures['ms']:7.2f} ms a frame, longest "
            line += f"{figures['longest']:6.1f} ms, {figures['rate']:.0f} frames/s, "
            print(f"{line}{figures['share']:.0%} of a core", flush=True)
            if role != "ours":
                continue
            if figures["ms"] > (ZOOM_MS if zoomed else FRAME_MS[height]):
                missed.append(f"{name}, {what}: {figures['ms']:.1f} ms")
            if figures["longest"] > LONGEST_MS:
                missed.append(f"{name}, {what}: {figures['longest']:.1f} ms once")
    return found


def receiving(seconds: float, missed: list[str]) -> dict[str, Any]:
    import many_topics
    from rosglass.wires.zenoh.router import Router

    found: dict[str, Any] = {}
    print(f"{SERIES} topics at {HZ} Hz")
    for wire in ("zenoh", "dds"):
        for way in ("plot", "callbacks"):
            with Router("tcp/127.0.0.1:0") as router:
                port = int(router.listen.rpartition(":")[2])
                if wire == "zenoh":
                    plan = {"robots": 2, "topics": SERIES // 2, "hz": HZ, "port": port}
                    plan |= {"mode": "peer", "shm": False}
                    names = many_topics.names(plan)
                    url = f"zenoh://127.0.0.1:{port}?domain=0"
                    script = str(Path(many_topics.__file__))
                else:
                    names = [f"/t{number}" for number in range(SERIES)]
                    url = "dds://?domain=77&range=localhost"
                    plan = {"topics": names, "url": url}
                    script = __file__
                role = "publisher" if wire == "zenoh" else "publish"
                command = [sys.executable, "-W", "ignore", script, "--role", role]
                robots = subprocess.Popen(
                    [*command, "--plan", json.dumps(plan)], stdout=subprocess.PIPE, text=True
                )
                try:
                    assert robots.stdout is not None
                    robots.stdout.readline()
                    own = {"url": url, "topics": names, "way": way, "seconds": seconds}
                    figures = run("receive", own, {}, [])
                finally:
                    robots.kill()
                    robots.wait()
            if figures is None:
                continue
            found[f"{wire} {way}"] = figures
            print(
                f"  {wire:5} {way:9} {figures['share']:6.1%} of a core, {figures['us']:.1f} us a "
                f"message, received {figures['received']:.1%}, lost {figures['lost']}, kept "
                f"{figures['kept']:.1%}",
                flush=True,
            )
            if way == "plot" and figures["share"] > RECEIVE:
                missed.append(f"receiving over {wire}: {figures['share']:.0%} of a core")
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=10.0, help="of each measurement")
    parser.add_argument("--only", choices=["frames", "zoom", "receive"])
    parser.add_argument("--way", default="", help="only ways of drawing with this in their names")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--role", choices=sorted(ROLES), help=argparse.SUPPRESS)
    parser.add_argument("--plan", type=json.loads, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.role:
        ROLES[args.role](args.plan)
        return 0
    results: dict[str, Any] = {}
    missed: list[str] = []
    if args.only in (None, "zoom"):
        figures = results["zoom"] = run("zoom", {}, {}, [])
        if figures:
            print(
                f"zoom of {SERIES} series at 3840 columns: {figures['ms']:.1f} ms, longest "
                f"{figures['longest']:.1f} ms; store {figures['memory']:.3f} x times and values"
            )
            if figures["ms"] > ZOOM_MS:
                missed.append(f"zoom: {figures['ms']:.1f} ms")
            if figures["memory"] > MEMORY:
                missed.append(f"memory: {figures['memory']:.2f}")
    if args.only in (None, "frames"):
        results["frames"] = frames(args.seconds, args.way, missed)
    if args.only in (None, "receive"):
        results["receive"] = receiving(args.seconds, missed)
    return finish(results, missed, args.json)


if __name__ == "__main__":
    sys.exit(main())

"""Measures the cost of showing a fast topic in QML, and of long arrays in JavaScript.

    python benchmarks/qml_values.py [seconds] [--rounds N]

A robot in a process of its own publishes a message of 100 numbers at 1 kHz over Zenoh. Ours shows
five of them by bindings to a Subscription at its default 20 Hz; the peer does the same in plain
PySide6: bare zenoh keeps the newest bytes, a timer decodes them 20 times a second and puts a dict
into a property of type QVariant, to which the same five bindings are bound. Each runs alone, in
turns, without a screen. "Zenoh alone" receives as the peer does and shows nothing.

The share of a core is that of the whole process, all threads; of these, those of Zenoh's runtime
are listed separately: what reading 1000 messages a second from a socket costs there is the same for
everybody, and more than the target. What is left is Python's and Qt's. Work is the longest that the
GUI thread computed without getting back to its event loop; the pause is the same by the clock,
other programs of the machine included.

The second part makes a Float32Array of 10,000 numbers of a message that has just been decoded.
Exits 1 when a target is missed.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import statistics
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

#: At most this share of a core without Zenoh's own threads, and with them this much more than Zenoh
#: alone takes.
CPU, EXTRA = 0.05, 0.04
#: How the names of the threads of Zenoh's runtime begin.
_ZENOH = ("rx-", "tx-", "acc-", "net-", "app-")
#: Milliseconds of the GUI thread's longest work, and for 10,000 numbers.
WORK, ARRAY = 5.0, 0.3
TYPE, TOPIC = "bench_msgs/msg/Hundred", "/bench"
_GROUP = "".join(f"float64 f{i}\n" for i in range(10))
_TEXT = "".join(f"Group g{i}\n" for i in range(10)) + f"{'=' * 80}\nMSG: bench_msgs/Group\n{_GROUP}"
_SETTLE, _TICK = 3.0, 2
INTERFACE = """import QtQml
IMPORT
QtObject {
    property var source: SOURCE
    property real a: source.message ? source.message.g0.f0 : 0
    property real b: source.message ? source.message.g3.f1 : 0
    property real c: source.message ? source.message.g5.f5 : 0
    property real d: source.message ? source.message.g7.f9 : 0
    property real e: source.message ? source.message.g9.f9 : 0
    property int changes: 0
    onEChanged: changes += 1
}
"""


def load() -> Any:
    import rosglass
    from rosglass.messages.types import default_library

    default_library().add_text(TYPE, _TEXT)
    return rosglass.load(TYPE)


def publish(port: int) -> None:
    """Publish at 1 kHz until standard input closes."""
    import rosglass

    kind = load()
    groups = {f"g{i}": {f"f{j}": i + j / 10 for j in range(10)} for i in range(10)}
    datas = []
    for number in range(50):
        groups["g9"]["f9"] = float(number)
        datas.append(kind.encode(groups))
    node = rosglass.connect(f"zenoh://127.0.0.1:{port}?domain=0", "robot")
    publisher = node.create_publisher(TOPIC, TYPE)
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    due = time.monotonic()
    number = 0
    while not ended.is_set():
        number += 1
        publisher.publish_serialized(datas[number // 20 % 50])
        due += 0.001
        wait = due - time.monotonic()
        if wait > 0:
            time.sleep(wait)


def show(way: str, port: int, seconds: float) -> None:
    """Show the topic in one way; print what it cost."""
    from PySide6.QtCore import Property as QtProperty
    from PySide6.QtCore import QEventLoop, QObject, QTimer, QUrl, Signal
    from PySide6.QtCore import Qt as QtNames
    from PySide6.QtGui import QGuiApplication
    from PySide6.QtQml import QQmlComponent, QQmlEngine

    kept: list[Any] = [QGuiApplication([])]
    engine = QQmlEngine()
    if way == "ours":
        load()
        from rosglass.qml import Session, install

        session = install(engine, Session(f"zenoh://127.0.0.1:{port}?domain=0"))
        session.init("bench")
        source, imported = f'Subscription {{ topic: "{TOPIC}" }}', "import Ros2 1.0"
    else:
        import zenoh

        import zenoh_peers as peers

        kind = load()
        newest: list[bytes] = [b""]

        class Plain(QObject):
            messageChanged = Signal()  # noqa: N815 - QML's name

            def __init__(self) -> None:
                super().__init__()
                self._message: Any = None
                self._timer = QTimer(self)
                self._timer.timeout.connect(self._take)
                if way == "plain":
                    self._timer.start(50)

            def _take(self) -> None:
                if newest[0]:
                    self._message = kind.decode(newest[0]).to_dict()
                    self.messageChanged.emit()

            message = QtProperty("QVariant", lambda self: self._message, notify=messageChanged)

        def receive(sample: Any) -> None:
            newest[0] = sample.payload.to_bytes()

        plan = {"port": port, "shm": False, "type": TYPE}
        opened = peers.session(plan)
        handler = zenoh.handlers.Callback(receive, indirect=False)
        plain = Plain()
        kept += [opened, opened.declare_subscriber(peers.key(plan), handler), plain]
        engine.rootContext().setContextProperty("plain", plain)
        source, imported = "plain", ""
    component = QQmlComponent(engine)
    text = INTERFACE.replace("IMPORT", imported).replace("SOURCE", source)
    component.setData(text.encode(), QUrl("file:///bench.qml"))
    root = component.create()
    if root is None:
        sys.exit(component.errorString())

    def run(length: float) -> None:
        loop = QEventLoop()
        QTimer.singleShot(int(length * 1000), loop.quit)
        loop.exec()

    run(_SETTLE)
    changes = root.property("changes")
    before, before_zenoh, began = time.process_time(), zenoh_seconds(), time.monotonic()
    run(seconds)
    taken = time.monotonic() - began
    cpu, native = (time.process_time() - before) / taken, (zenoh_seconds() - before_zenoh) / taken
    shown = (root.property("changes") - changes) / seconds

    ticks: list[tuple[float, float]] = []
    timer = QTimer()
    timer.setTimerType(QtNames.TimerType.PreciseTimer)
    timer.timeout.connect(lambda: ticks.append((time.monotonic(), time.thread_time())))
    timer.start(_TICK)
    run(seconds)
    timer.stop()
    pairs = list(itertools.pairwise(ticks))
    pause = 1000 * max(b[0] - a[0] for a, b in pairs)
    work = 1000 * max(b[1] - a[1] for a, b in pairs)
    figures = {"cpu": cpu, "rest": cpu - native, "shown": shown, "pause": pause, "work": work}
    print(json.dumps(figures), flush=True)
    os._exit(0)


def zenoh_seconds() -> float:
    """Return the processor time that the threads of Zenoh's runtime took so far."""
    total = 0
    for task in Path("/proc/self/task").iterdir():
        if (task / "comm").read_text().startswith(_ZENOH):
            total += int((task / "schedstat").read_text().split()[0])
    return total / 1e9


def arrays() -> tuple[float, float, float]:
    """Return the milliseconds for 10,000 numbers: ours, a dict with a list, bare bytes."""
    from PySide6.QtCore import QByteArray, QCoreApplication
    from PySide6.QtQml import QQmlEngine

    import rosglass
    from rosglass.qml import Session, install
    from rosglass.qml.engine.runtime import runtime_of

    app = QCoreApplication.instance() or QCoreApplication([])
    engine = QQmlEngine()
    install(engine, Session())
    runtime = runtime_of(engine)
    assert runtime is not None
    kind = rosglass.load("sensor_msgs/msg/LaserScan")
    data = kind.encode(ranges=[0.5 * i for i in range(10_000)])
    function = "(function(m) { return new Float32Array(m.ranges.buffer()).length })"
    listed = "(function(m) { return Float32Array.from(m.ranges).length })"
    bare = "(function(b) { return new Float32Array(b).length })"
    ways = []
    makers: list[Any] = [
        lambda: runtime.message(kind.decode(data)),
        lambda: engine.toScriptValue({"ranges": kind.decode(data).ranges.tolist()}),
        lambda: engine.toScriptValue(QByteArray(kind.decode(data).ranges.tobytes())),
    ]
    for script, make in zip((function, listed, bare), makers, strict=True):
        call = engine.evaluate(script)
        times = []
        for _ in range(200):
            began = time.perf_counter()
            found = call.call([make()])
            times.append(1000 * (time.perf_counter() - began))
            assert found.toInt() == 10_000, found.toString()
        engine.collectGarbage()
        ways.append(statistics.median(times))
    del app
    return ways[0], ways[1], ways[2]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("seconds", type=float, nargs="?", default=6.0, help="default: 6")
    parser.add_argument("--rounds", type=int, default=3, help="default: 3")
    args = parser.parse_args()
    seconds = args.seconds
    from rosglass.wires.zenoh.router import Router

    found: dict[str, list[dict[str, float]]] = {"native": [], "plain": [], "ours": []}
    environment = os.environ | {"QT_QPA_PLATFORM": "offscreen"}
    with Router("tcp/127.0.0.1:0") as router:
        port = router.listen.rpartition(":")[2]
        robot = subprocess.Popen([sys.executable, __file__, "publish", port], stdin=subprocess.PIPE)
        try:
            for _ in range(args.rounds):
                for way, results in found.items():
                    command = [sys.executable, __file__, "show", way, port, str(seconds)]
                    done = subprocess.run(
                        command,
                        check=False,
                        env=environment,
                        capture_output=True,
                        text=True,
                        timeout=120,
                    )
                    if done.returncode or not done.stdout:
                        sys.exit(f"{way}: {done.stdout}{done.stderr}")
                    results.append(json.loads(done.stdout.splitlines()[-1]))
        finally:
            robot.kill()
            robot.wait(10)
    best = {
        way: {
            name: (max if name == "shown" else min)(result[name] for result in results)
            for name in results[0]
        }
        for way, results in found.items()
    }
    names = {"native": "Zenoh alone", "plain": "plain PySide6", "ours": "ours"}
    print(f"100 numbers at 1 kHz, five bindings, {seconds:g} s, best of {args.rounds}")
    print(f"{'':14}{'of a core':>10}{'no Zenoh':>10}{'shown/s':>9}{'work ms':>9}{'pause ms':>10}")
    for way, figures in best.items():
        print(
            f"{names[way]:14}{figures['cpu']:10.1%}{figures['rest']:10.1%}{figures['shown']:9.1f}"
            f"{figures['work']:9.2f}{figures['pause']:10.2f}"
        )
    ours, listed, bare = arrays()
    print(f"10,000 numbers to a Float32Array: {ours:.3f} ms; a dict with a list {listed:.3f} ms")
    print(f"({listed / ours:.1f} times as long), bare bytes {bare:.3f} ms")
    mine, plain, alone = best["ours"], best["plain"], 100 * best["native"]["cpu"]
    if alone > 100 * CPU:
        print(f"the whole process cannot stay below {CPU:.0%} of a core: Zenoh takes {alone:.1f} %")
    print()
    met = [
        judge("Python and Qt", 100 * mine["rest"], 100 * CPU, " %", 100 * plain["rest"]),
        judge(
            "the whole process",
            100 * mine["cpu"],
            max(100 * CPU, alone + 100 * EXTRA),
            " %",
            100 * plain["cpu"],
        ),
        judge("longest work", mine["work"], WORK, " ms", plain["work"]),
        judge("10,000 numbers", ours, ARRAY, " ms", listed),
    ]
    if mine["shown"] < 15:
        met.append(False)
        print(f"shown per second: {mine['shown']:.1f}, target 20: MISSED")
    return int(not all(met))


def judge(what: str, figure: float, target: float, unit: str, plain: float) -> bool:
    """Print a figure, its ratio to the peer's and its target; returns whether it is met."""
    met = figure <= target
    ratio = f"{figure / plain:.2f}x plain PySide6" if plain > 0 else "plain PySide6 0"
    verdict = "met" if met else "MISSED"
    print(f"{what:18}{figure:6.2f}{unit:3}  {ratio}, target {target:.2f}{unit}: {verdict}")
    return met


if __name__ == "__main__":
    if sys.argv[1:2] == ["publish"]:
        publish(int(sys.argv[2]))
    elif sys.argv[1:2] == ["show"]:
        show(sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
    else:
        sys.exit(main())

"""Measure how long an interface takes from process start to its first frame on the screen.

    python benchmarks/first_frame.py [rounds]

`rosglass run` against plain PySide6 (PySide2 where ROSGLASS_QT says so), on a virtual screen of
its own (Xvfb) with software OpenGL. `trivial` is a coloured rectangle, the same file for both.
`robot` shows a camera, a text from a topic and a button: `rosglass run` makes the node, the
subscriptions and the publisher besides, and knocks on a router that is not there; the plain program
shows the same items with nothing behind them. Contenders take turns; the first round, in which
Python compiles what is not installed, is not counted. Exits 1 when a ratio of the medians exceeds
the target.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from rosglass.qt import BINDING, QT6

TARGET = 1.5
_REPORT = """
    property bool seen: false
    function shown() {
        if (seen)
            return
        seen = true
        console.log("FIRST FRAME")
        Qt.quit()
    }
    Window.onWindowChanged: if (Window.window) Window.window.frameSwapped.connect(shown)
"""
_TRIVIAL = f"""import QtQuick 2.15
import QtQuick.Window 2.15
Rectangle {{
    width: 640; height: 480; color: "steelblue"
    {_REPORT}
}}
"""
#: Filled with what is behind the items: imports, elements, and bindings of the three items.
_ITEMS = f"""import QtQuick 2.15
import QtQuick.Window 2.15
import QtQuick.Controls {"" if QT6 else "2.15"}
import QtMultimedia {"" if QT6 else "5.15"}
%s
Rectangle {{
    width: 640; height: 480; color: "steelblue"
    {_REPORT}
    %s
    VideoOutput {{ anchors.fill: parent; %s }}
    Text {{ anchors.centerIn: parent; text: %s }}
    Button {{ text: "stop"; %s }}
}}
"""
_ROBOT = (
    "import Ros2 1.0",
    """Subscription { id: chatter; topic: "/chatter"; messageType: "std_msgs/msg/String" }
    ImageTransportSubscription { id: camera; topic: "/camera/image" }
    property var stop: Ros2.createPublisher("/stop", "std_msgs/msg/Bool", 1)
    Component.onCompleted: Ros2.init("cockpit")""",
    "source: camera",
    'chatter.message ? chatter.message.data : "waiting"',
    "onClicked: stop.publish({data: true})",
)
#: The file that `rosglass run` shows, and the one of the plain program, by interface.
INTERFACES = {
    "trivial": (_TRIVIAL, _TRIVIAL),
    "robot": (_ITEMS % _ROBOT, _ITEMS % ("", "", "", '"waiting"', "")),
}
PLAIN = f"""
import sys
from {BINDING}.QtCore import QUrl
from {BINDING}.QtGui import QGuiApplication
from {BINDING}.QtQuick import QQuickView
app = QGuiApplication(sys.argv)
view = QQuickView()
view.engine().quit.connect(app.quit)
view.setSource(QUrl.fromLocalFile(sys.argv[1]))
view.show()
app.exec_() if hasattr(app, "exec_") else app.exec()
"""


def milliseconds(command: list[str], environment: dict[str, str]) -> float:
    """Start a program and return the time until it reports its first frame."""
    started = time.perf_counter()
    process = subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert process.stdout is not None
    taken, output = 0.0, ""
    timer = threading.Timer(30, process.kill)
    timer.start()
    for line in process.stdout:
        output += line
        if "FIRST FRAME" in line and not taken:
            taken = 1000 * (time.perf_counter() - started)
    timer.cancel()
    if process.wait(30) or not taken:
        sys.exit(f"{command} showed nothing:\n{output}")
    return taken


def main() -> int:
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 9
    reader, writer = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writer), "-screen", "0", "1280x800x24", "-nolisten", "tcp"],
        pass_fds=[writer],
        stderr=subprocess.DEVNULL,
    )
    os.close(writer)
    try:
        with os.fdopen(reader) as ready:
            display = f":{ready.readline().strip()}"
        environment = {k: v for k, v in os.environ.items() if k != "QT_QPA_PLATFORM"}
        # Byte code as every installation has it, also where none is written beside the sources.
        environment |= {"DISPLAY": display, "PYTHONDONTWRITEBYTECODE": ""}
        environment["ROSGLASS_URL"] = "zenoh://127.0.0.1:9"
        with tempfile.TemporaryDirectory() as folder:
            environment["PYTHONPYCACHEPREFIX"] = folder
            ratios = [_compare(name, Path(folder), environment, rounds) for name in INTERFACES]
    finally:
        server.terminate()
        server.wait(10)
    return int(max(ratios) > TARGET)


def _compare(name: str, folder: Path, environment: dict[str, str], rounds: int) -> float:
    """Measure an interface, print the figures, and return the ratio of the medians."""
    files = [folder / f"{who}_{name}.qml" for who in ("ours", "plain")]
    for file, text in zip(files, INTERFACES[name], strict=True):
        file.write_text(text, encoding="utf-8")
    commands = {
        BINDING: [sys.executable, "-c", PLAIN, str(files[1])],
        "rosglass run": [sys.executable, "-m", "rosglass.cli", "run", str(files[0])],
    }
    times: dict[str, list[float]] = {who: [] for who in commands}
    for round_ in range(rounds + 1):
        for who, command in commands.items():
            taken = milliseconds(command, environment)
            if round_:
                times[who].append(taken)
    for who, values in times.items():
        median, best, worst = statistics.median(values), min(values), max(values)
        print(f"{name:8} {who:13} {median:6.0f} ms  (best {best:.0f}, worst {worst:.0f})")
    ratio = statistics.median(times["rosglass run"]) / statistics.median(times[BINDING])
    print(f"{name:8} ratio {ratio:.2f}, target {TARGET}")
    return ratio


if __name__ == "__main__":
    sys.exit(main())

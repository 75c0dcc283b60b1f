"""How long a trivial interface takes from process start to its first frame on the screen.

`rosglass run` against plain PySide6 showing the same file, alternating, on a virtual screen of its
own (Xvfb) with software OpenGL. Run: ``python benchmarks/first_frame.py [rounds]``; exits 1 when
the ratio of the medians exceeds the target.
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

TARGET = 1.5
INTERFACE = """import QtQuick
Rectangle {
    id: root
    width: 640; height: 480; color: "steelblue"
    property bool seen: false
    function shown() {
        if (seen)
            return
        seen = true
        console.log("FIRST FRAME")
        Qt.quit()
    }
    Window.onWindowChanged: if (Window.window) Window.window.frameSwapped.connect(shown)
}
"""
PLAIN = """
import sys
from PySide6.QtCore import QUrl
from PySide6.QtGui import QGuiApplication
from PySide6.QtQuick import QQuickView
app = QGuiApplication(sys.argv)
view = QQuickView()
view.engine().quit.connect(app.quit)
view.setSource(QUrl.fromLocalFile(sys.argv[1]))
view.show()
app.exec()
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
        with os.fdopen(reader) as told:
            display = f":{told.readline().strip()}"
        environment = {k: v for k, v in os.environ.items() if k != "QT_QPA_PLATFORM"}
        environment["DISPLAY"] = display
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "Trivial.qml")
            file.write_text(INTERFACE, encoding="utf-8")
            plain = [sys.executable, "-c", PLAIN, str(file)]
            ours = [sys.executable, "-m", "rosglass.cli", "run", str(file)]
            times: dict[str, list[float]] = {"PySide6": [], "rosglass run": []}
            for round_ in range(rounds + 1):
                for name, command in (("PySide6", plain), ("rosglass run", ours)):
                    taken = milliseconds(command, environment)
                    if round_:
                        times[name].append(taken)
    finally:
        server.terminate()
        server.wait(10)
    medians = {name: statistics.median(values) for name, values in times.items()}
    for name, values in times.items():
        print(
            f"{name:13} {medians[name]:6.0f} ms  (best {min(values):.0f}, worst {max(values):.0f})"
        )
    ratio = medians["rosglass run"] / medians["PySide6"]
    print(f"ratio {ratio:.2f}, target {TARGET}")
    return int(ratio > TARGET)


if __name__ == "__main__":
    sys.exit(main())

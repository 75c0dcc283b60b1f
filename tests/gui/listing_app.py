"""Run by test_listing1.py on a virtual screen: shows a QML file, drags and clicks on request.

Arguments: a QML file and a URL. Reads a command a line: ``drag X Y X Y``, ``click X Y``,
``pixel X Y``, ``save FILE``, ``end``; answers each with a line.
"""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path
from queue import SimpleQueue

os.environ["QSG_RENDER_LOOP"] = "basic"
os.environ["QT_LOGGING_RULES"] = "qt.multimedia.*=false"

from rosglass.qml import Session
from rosglass.qml.engine.log import install_message_handler
from rosglass.qml.run.runner import Runner
from rosglass.qt import QtCore, QtGui, optional

app = QtGui.QGuiApplication([])
install_message_handler()
session = Session(sys.argv[2])
runner = Runner(Path(sys.argv[1]), session)
runner.load()
window = runner.window
window.resize(400, 300)
test = optional("QtTest").QTest
LEFT = QtCore.Qt.MouseButton.LeftButton
NONE = QtCore.Qt.KeyboardModifier.NoModifier
lines: SimpleQueue[str] = SimpleQueue()


def read() -> None:
    for line in sys.stdin:
        lines.put(line)
    lines.put("end")


def obey() -> None:
    if lines.empty():
        return
    word, *rest = lines.get().split()
    if word == "end":
        app.quit()
        return
    if word == "save":
        print(window.grabWindow().save(rest[0]), flush=True)
        return
    points = [QtCore.QPoint(*map(int, rest[i : i + 2])) for i in range(0, len(rest), 2)]
    if word == "pixel":
        print(window.grabWindow().pixelColor(points[0]).name(), flush=True)
    elif word == "click":
        test.mouseClick(window, LEFT, NONE, points[0])
        print("clicked", flush=True)
    elif word == "drag":
        test.mousePress(window, LEFT, NONE, points[0])
        test.mouseMove(window, points[1])
        test.mouseRelease(window, LEFT, NONE, points[1])
        print("dragged", flush=True)


threading.Thread(target=read, daemon=True).start()
timer = QtCore.QTimer()
timer.timeout.connect(obey)
timer.start(20)
code = app.exec() if hasattr(app, "exec") else app.exec_()
runner.close()
session.close()
sys.exit(code)

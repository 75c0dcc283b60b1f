"""Show an overlay over a separate RViz, and print measured pixels; for test_screens.py."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

QML = """import QtQuick 2.15
Item {
    Rectangle { x: 40; y: 30; width: 100; height: 60; color: "#0080ff" }
    Rectangle { width: 10; height: 10; color: "red"
        anchors { right: parent.right; bottom: parent.bottom } }
}
"""


def main() -> None:
    file, renderer = Path(sys.argv[1]), sys.argv[2]
    sys.argv[1:] = []
    file.write_text(QML, encoding="utf-8")
    from rosglass.qt import QtCore
    from rosglass.rviz import Application, WidgetOverlay
    from rosglass.rviz.qt5 import QtWidgets
    from rosglass.rviz.rendering import choice

    app = Application(renderer=renderer)
    app.window.widget.setGeometry(0, 0, 600, 450)
    app.window.widget.show()
    overlay = app.add_qml(file)
    square = QtWidgets.QLabel()
    square.setStyleSheet("background: #00ff00")
    root = QtWidgets.QWidget()
    square.setParent(root)
    square.setGeometry(20, 120, 41, 31)
    app.add(WidgetOverlay(root))
    frames: list[int] = []
    app.window.before_frame.connect(lambda: frames.append(1))
    while len(frames) < 8:
        app.qt.processEvents(QtCore.QEventLoop.AllEvents, 20)
    width, height, ratio = app.window.view_size()
    picture = app.qt.primaryScreen().grabWindow(app.window.panel.winId()).toImage()

    def colour(x: float, y: float) -> str:
        return str(picture.pixelColor(int(x * ratio), int(y * ratio)).name())

    right, bottom = picture.width() / ratio, picture.height() / ratio
    seen = {
        "ratio": ratio,
        "stretched": (width, height) != (picture.width(), picture.height()),
        "units": [overlay.root.width() * ratio == width, overlay.root.height() * ratio == height],
        "inside": [colour(41, 31), colour(138, 88), colour(right - 9, bottom - 9)],
        "outside": [colour(38, 60), colour(142, 60), colour(right - 12, bottom - 2)],
        "widget": [colour(21, 121), colour(59, 149)],
        "beside": [colour(18, 130), colour(63, 130), colour(40, 118), colour(40, 153)],
        "problem": overlay.problem,
        "renderer": choice.renderer,
    }
    app.close()
    print("SEEN", json.dumps(seen), flush=True)
    os._exit(0)


if __name__ == "__main__":
    main()

"""Steer a robot by controls in an overlay over a separate RViz, and print what it received."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

QML = """import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
Item {
    property QtObject command: drive
    Component.onCompleted: Ros2.init("panel")
    TwistCommand { id: drive; topic: "/cmd_vel"; acceleration: 0 }
    DriveStick { x: 20; y: 20; width: 200; height: 200; command: drive }
    DriveKeys { x: 20; y: 260; command: drive }
}
"""


def main() -> None:
    file, renderer = Path(sys.argv[1]), sys.argv[2]
    sys.argv[1:] = []
    file.write_text(QML, encoding="utf-8")
    import rosglass
    from rosglass.qml import Session
    from rosglass.qt import QtCore
    from rosglass.rviz import Application
    from rosglass.rviz.qt5 import QtCore as Qt5Core
    from rosglass.rviz.qt5 import QtWidgets

    speeds: list[float] = []
    robot = rosglass.connect("local://drive", "robot")
    robot.create_subscription(
        "/cmd_vel", "geometry_msgs/msg/Twist", lambda m: speeds.append(m.linear.x)
    )
    app = Application(renderer=renderer, session=Session("local://drive"))
    app.window.widget.setGeometry(0, 0, 900, 700)
    app.window.widget.show()
    panel = app.window.panel
    overlay = app.add_qml(file, name="Drive")

    def until(condition: Any) -> bool:
        deadline = time.monotonic() + 20
        while not condition() and time.monotonic() < deadline:
            app.qt.processEvents(QtCore.QEventLoop.AllEvents, 20)
        return bool(condition())

    def xdotool(*words: object) -> None:
        subprocess.run(["xdotool", *map(str, words)], check=True)

    def moves() -> bool:
        return bool(speeds) and speeds[-1] > 0

    def stands() -> bool:
        return len(speeds) > 3 and not any(speeds[-3:])

    root: Any = overlay.root
    command = root.property("command")
    until(lambda: command._endpoint is not None)
    app.window.widget.activateWindow()
    until(app.window.widget.isActiveWindow)
    at = panel.mapTo(panel.window(), Qt5Core.QPoint(0, 0))
    x, y = at.x() + 120, at.y() + 120
    seen = []
    xdotool("mousemove", x, y, "mousedown", 1, "mousemove", x, y - 60)
    seen.append(until(moves))
    xdotool("mouseup", 1)
    seen.append(until(stands))
    xdotool("keydown", "w")
    seen.append(until(moves))
    xdotool("keyup", "w")
    seen.append(until(stands))
    xdotool("mousemove", x, y, "mousedown", 1, "mousemove", x, y - 60)
    seen.append(until(moves))
    dialog = QtWidgets.QDialog(app.window.widget)
    dialog.setModal(True)
    dialog.show()
    seen.append(until(stands))
    app.close()
    print("SEEN", json.dumps(seen), flush=True)
    os._exit(0)


if __name__ == "__main__":
    main()

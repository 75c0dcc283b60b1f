"""Operate overlays over a separate RViz, and print the results; for test_screens.py."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

QML = """import QtQuick 2.15
Item {
    property var places: []
    property point onScreen: area.mapToGlobal(7, 9)
    function measure() { onScreen = area.mapToGlobal(7, 9) }
    MouseArea {
        id: area; x: 40; y: 30; width: 100; height: 60
        onClicked: parent.places = parent.places.concat([mouse.x, mouse.y])
    }
}
"""


def as_list(value: Any) -> Any:
    return value.toVariant() if hasattr(value, "toVariant") else value


def main() -> None:
    file, renderer = Path(sys.argv[1]), sys.argv[2]
    sys.argv[1:] = []
    file.write_text(QML, encoding="utf-8")
    from rosglass.qt import QtCore
    from rosglass.rviz import Application, WidgetOverlay
    from rosglass.rviz.qt5 import QtCore as Qt5Core
    from rosglass.rviz.qt5 import QtWidgets

    class Target(QtWidgets.QWidget):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.places: list[float] = []
            self.on_screen: list[bool] = []

        def mousePressEvent(self, event: Any) -> None:  # noqa: N802
            at = event.pos()
            self.places += [at.x(), at.y()]
            self.on_screen.append((self.mapToGlobal(at) - event.globalPos()).manhattanLength() <= 1)

    class Panel(WidgetOverlay):
        def setup(self, root: Any) -> None:
            self.target = Target()
            self.target.setParent(root)
            self.target.setGeometry(40, 120, 100, 60)

    app = Application(renderer=renderer)
    app.window.widget.setGeometry(0, 0, 900, 700)
    app.window.widget.show()
    seen: dict[str, Any] = {"screen": [], "item": [], "widget": [], "global": []}
    panel = app.window.panel

    def run(seconds: float) -> None:
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            app.qt.processEvents(QtCore.QEventLoop.AllEvents, 20)

    def click(x: float, y: float) -> None:
        at = panel.mapTo(panel.window(), Qt5Core.QPoint(0, 0))
        ratio = panel.devicePixelRatioF()
        # The window is at the screen's upper left corner; X knows pixels only.
        where = [round((at.x() + x) * ratio), round((at.y() + y) * ratio)]
        words = ["mousemove", *where, "mousedown", 1, "mouseup", 1]
        subprocess.run(["xdotool", *map(str, words)], check=True)
        run(0.5)

    for scale in (1.0, 1.5):
        overlay = app.add_qml(file, name="Items", scale=scale)
        widgets = app.add(Panel(name="Widgets", scale=scale))
        run(1.0)
        click((40 + 7) * scale, (30 + 9) * scale)
        click((40 + 93) * scale, (120 + 51) * scale)
        root = overlay.root
        seen["item"].append(as_list(root.property("places")))
        seen["widget"].append(widgets.target.places)
        seen["screen"].append(widgets.target.on_screen)
        Qt5Core.QMetaObject.invokeMethod(root, "measure")
        at = root.property("onScreen")
        right = panel.mapToGlobal(Qt5Core.QPoint(round(47 * scale), round(39 * scale)))
        seen["global"].append([at.x() - right.x(), at.y() - right.y()])
        app.overlays.remove(overlay)
        app.overlays.remove(widgets)
    app.close()
    print("SEEN", json.dumps(seen), flush=True)
    os._exit(0)


if __name__ == "__main__":
    main()

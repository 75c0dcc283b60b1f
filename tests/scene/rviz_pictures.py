"""An RViz that takes screenshots of its 3D view, for test_against_rviz.py; runs in .venv-system.

Takes one JSON object per line and answers with a line once it is done: {"config": FILE, "panel":
NAME} opens a config, of which the panel of a display is shown instead of the view if NAME is not
empty; {"into": FILE} saves a screenshot. Its arguments are the width and height of the view.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from rosglass.qt import QtCore, run_event_loop
from rosglass.rviz import Application
from rosglass.rviz.qt5 import QtWidgets


def run_for(milliseconds: int) -> None:
    loop = QtCore.QEventLoop()
    QtCore.QTimer.singleShot(milliseconds, loop.quit)
    run_event_loop(loop)


def fit_view(app: Any, width: int, height: int) -> None:
    for _ in range(5):
        panel, widget = app.window.panel, app.window.widget
        if (panel.width(), panel.height()) == (width, height):
            return
        widget.resize(
            widget.width() + width - panel.width(), widget.height() + height - panel.height()
        )
        app.qt.processEvents()


def float_panel(app: Any, name: str, width: int, height: int) -> Any:
    """Show the panel of a display in a window of its own, and return what it draws into."""
    for dock in app.window.widget.findChildren(QtWidgets.QDockWidget):
        if dock.windowTitle() == name:
            dock.setFloating(True)
            dock.show()
            dock.raise_()
            found = dock.findChildren(QtWidgets.QWidget)
            panel = next(w for w in found if w.metaObject().className() == "rviz::RenderPanel")
            for _ in range(5):
                app.qt.processEvents()
                dock.resize(
                    dock.width() + width - panel.width(), dock.height() + height - panel.height()
                )
            return panel
    raise ValueError(f"there is no panel {name}")


def main() -> None:
    width, height = int(sys.argv[1]), int(sys.argv[2])
    del sys.argv[1:]
    # The scene draws hard edges in software, too.
    app = Application(anti_aliasing=False, bare=True)
    app.window.widget.setGeometry(0, 0, width, height)
    app.window.widget.show()
    print("READY", flush=True)
    panel = app.window.panel
    for line in sys.stdin:
        order = json.loads(line)
        if "config" in order:
            app.load_config(Path(order["config"]))
            name, panel = order["panel"], app.window.panel
            if name:
                run_for(0)
                panel = float_panel(app, name, width, height)
        else:
            fit_view(app, width, height)
            run_for(200)
            image = app.qt.primaryScreen().grabWindow(panel.winId())
            assert image.save(order["into"])
        print("DONE", flush=True)
    app.close()


main()

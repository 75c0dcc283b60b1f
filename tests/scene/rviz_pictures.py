"""An RViz that takes pictures of its 3D view, for test_against_rviz.py; runs in .venv-system.

Takes one JSON object per line, {"config": FILE or "", "into": FILE}, and answers with a line once
the picture is saved. Its arguments are the width and height of the view.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from rosglass.qt import QtCore, run_event_loop
from rosglass.rviz import Application


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


def main() -> None:
    width, height = int(sys.argv[1]), int(sys.argv[2])
    del sys.argv[1:]
    # The scene draws hard edges in software, too.
    app = Application(anti_aliasing=False, bare=True)
    app.window.widget.setGeometry(0, 0, width, height)
    app.window.widget.show()
    print("READY", flush=True)
    for line in sys.stdin:
        order = json.loads(line)
        if order["config"]:
            app.load_config(Path(order["config"]))
        fit_view(app, width, height)
        run_for(200)
        image = app.qt.primaryScreen().grabWindow(app.window.panel.winId())
        assert image.save(order["into"])
        print("DONE", flush=True)
    app.close()


main()

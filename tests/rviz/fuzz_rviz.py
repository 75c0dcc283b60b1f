"""Drives every member of the object ``rviz`` with values made to hurt; RViz must survive.

Run by test_rviz_object.py with a file in which the last thing tried is found after a crash.
"""

from __future__ import annotations

import faulthandler
import os
import sys
import time
from itertools import count
from pathlib import Path
from typing import Any

from rosglass.qml.engine import from_js
from rosglass.qt import QtCore, Slot, send_deferred_deletes
from rosglass.rviz import Application

SCRIPT = Path(__file__).parents[1] / "gui" / "fuzz.js"
#: Seconds that one call may take.
LIMIT = 20
#: Values that are read of one, instead of 2^18 (which tests/gui reads): a second for each member.
MOST_VALUES = 1 << 14
#: Driven objects, and their members that are left out: those that wait for the operator.
OBJECTS = {
    "tool": ("rviz.toolManager.tools[0]", []),
    "display": ("rviz.display('Grid') || rviz.addDisplay('rviz/Grid')", []),
    "tracker": ("rviz.createPositionTracker(0, 0, 0)", []),
    "property": ("rviz.registerFloatProperty('Speed', 1)", []),
    "tools": ("rviz.toolManager", ["addTool"]),
    "view": ("rviz.view", []),
    "rviz": ("rviz", []),
}


class Host(QtCore.QObject):
    """The object that the JavaScript side gets."""

    def __init__(self, last: str) -> None:
        super().__init__()
        self._last = os.open(last, os.O_CREAT | os.O_WRONLY)
        self._count = count()

    @Slot(str)
    def note(self, text: str) -> None:
        """Record the next attempt, for a report after a crash; a hang ends the process."""
        os.pwrite(self._last, text.encode("utf-8", "replace").ljust(300), 0)
        faulthandler.dump_traceback_later(LIMIT, exit=True)
        if next(self._count) % 300 == 0:
            spin(0.02)


def spin(seconds: float) -> None:
    """Let RViz draw for a while."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        QtCore.QCoreApplication.processEvents(QtCore.QEventLoop.ProcessEventsFlag.AllEvents, 10)
        send_deferred_deletes()


def main(last: str, folder: str) -> None:
    """Drive everything once."""
    faulthandler.enable()
    os.chdir(folder)
    from_js._MOST = MOST_VALUES
    app = Application()
    # All members of an object are driven by one call from JavaScript, which may take a minute.
    app.session.longest_script = 0
    app.window.widget.show()
    spin(0.5)
    file = Path(folder, "Fuzz.qml")
    text = f'import QtQuick 2.15\nimport "{SCRIPT.as_uri()}" as Fuzz\n'
    text += """Item {
        function run(host, object, name, left) {
            const members = Fuzz.members(object).filter(m => left.indexOf(m) < 0)
            Fuzz.drive(host, object, null, [name, members, true])
        }
    }"""
    file.write_text(text)
    overlay = app.add_qml(file)
    engine: Any = overlay.engine
    host = Host(last)
    scope = engine.globalObject()
    scope.setProperty("root", engine.newQObject(overlay.root))
    scope.setProperty("rviz", engine.newQObject(overlay.properties))
    scope.setProperty("host", engine.newQObject(host))
    for name, (made, left) in OBJECTS.items():
        result: Any = engine.evaluate(f"root.run(host, {made}, '{name}', {left})")
        assert not result.isError(), f"{name}: {result.toString()}"
        spin(0.3)
        assert app.window.frame is not None
        print(name, "survived", flush=True)
    faulthandler.cancel_dump_traceback_later()
    app.close()
    print("came to the end", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])

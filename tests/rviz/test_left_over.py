"""Overlays that come and go leave nothing behind, and RViz loads no more than it uses."""

from __future__ import annotations

import gc
import subprocess
import sys
import time
import weakref
from collections import Counter
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.errors import Error, UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

QML = """import QtQuick 2.15
Item {
    property var speed: rviz.registerFloatProperty("Speed", 1, "m/s", {min: 0, max: 2})
    Rectangle { x: 40; y: 30; width: 100; height: 60; color: "#0080ff" }
}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    file = tmp_path / "Passing.qml"
    file.write_text(QML)
    return file


def add_qml(app: Any, file: Path, wait: Callable[..., None]) -> None:
    overlay = app.add_qml(file)
    wait(lambda: app.entries.of(overlay))
    app.overlays.remove(overlay)
    wait(lambda: not list(app.entries))


def add_entry(app: Any, file: Path, wait: Callable[..., None]) -> None:
    entry = app.entries.add_qml(str(file), "Passing")
    wait(lambda: entry.overlay is not None)
    app.entries.remove(entry)
    wait(lambda: not list(app.overlays))


def add_widget(app: Any, file: Path, wait: Callable[..., None]) -> None:
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtWidgets

    del file
    overlay = app.add(WidgetOverlay(QtWidgets.QPushButton("stop"), "Passing"))
    wait(lambda: app.entries.of(overlay))
    app.overlays.remove(overlay)
    wait(lambda: not list(app.entries))


def refuse_qml(app: Any, file: Path, wait: Callable[..., None]) -> None:
    from rosglass.rviz import QmlOverlay

    del wait
    with pytest.raises(Error, match="z must be a whole number"):
        QmlOverlay(file, app.session, z="high")


def fail_to_draw(app: Any, file: Path, wait: Callable[..., None]) -> None:
    from rosglass.rviz import QmlOverlay
    from rosglass.rviz.rendering import choice

    del wait
    with pytest.MonkeyPatch.context() as patch:
        # As on a screen without OpenGL.
        patch.setattr(choice, "make", _draw_nothing)
        with pytest.raises(UnsupportedError, match="cannot draw"):
            QmlOverlay(file, app.session, watch=True)


def _draw_nothing(import_paths: object) -> None:
    raise UnsupportedError(f"cannot draw what is in {import_paths}")


def left(wait: Callable[..., None], before: Counter[str]) -> dict[str, int]:
    """Return the objects created since that stay; fired timers are collected later."""
    until = time.monotonic() + 20
    while True:
        more = {n: c for n, c in (counted(wait) - before).items() if c >= 5}
        if not more or time.monotonic() > until:
            return more


def counted(wait: Callable[..., None]) -> Counter[str]:
    """Return how many objects of our own classes, and of Qt's, there are."""
    wait.frames(3)
    gc.collect()
    names = (f"{type(item).__module__}.{type(item).__name__}" for item in gc.get_objects())
    return Counter(name for name in names if name.startswith(("rosglass.", "PySide2.")))


@pytest.mark.parametrize("step", [add_qml, add_entry, add_widget, refuse_qml, fail_to_draw])
def test_overlays_that_go_leave_no_object(
    app: Any, file: Path, wait: Callable[..., None], step: Callable[..., None]
) -> None:
    for _ in range(3):
        step(app, file, wait)
    before = counted(wait)
    for _ in range(10):
        step(app, file, wait)
    assert left(wait, before) == {}


def test_memory_of_a_removed_overlay_is_collected_soon(
    app: Any, file: Path, wait: Callable[..., None]
) -> None:
    overlay = app.add_qml(file)
    wait(lambda: list(app.entries))
    left = weakref.ref(overlay)
    # Python itself looks now and then, at what it finds worth it.
    gc.disable()
    try:
        app.overlays.remove(overlay)
        del overlay
        wait(lambda: left() is None)
    finally:
        gc.enable()


def test_reloads_leave_no_object(app: Any, file: Path, wait: Callable[..., None]) -> None:
    overlay = app.add_qml(file)
    for _ in range(3):
        assert overlay.reload()
        wait.frames(1)
    before = counted(wait)
    for _ in range(10):
        assert overlay.reload()
        wait.frames(1)
    assert left(wait, before) == {}


def test_modules_that_rviz_does_not_use_are_not_loaded(app: Any) -> None:
    del app
    program = """
import sys
from rosglass.rviz import Application, QmlOverlay
from rosglass.rviz.host import require_rviz, rviz
from rosglass.rviz.properties import log_errors
from rosglass.qt import QtCore, Signal

class Sender(QtCore.QObject):
    sent = Signal()

require_rviz()
sender = Sender()
log_errors()(sender.sent.emit)()
kinds = ("PyQt5.", "PySide2.Qt", "python_qt")
print(*sorted(name for name in sys.modules if name.startswith(kinds)))
bindings = rviz()
import rviz
assert rviz.bindings is bindings
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [
        *(f"PyQt5.{name}" for name in ("QtCore", "QtGui", "QtWidgets", "sip")),
        *(f"PySide2.Qt{name}" for name in ("Core", "Gui", "Network", "Qml", "Quick", "Widgets")),
    ]

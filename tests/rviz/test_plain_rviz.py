"""A plain RViz, without us, opens a file with overlays, and keeps them when it saves."""

from __future__ import annotations

import contextlib
import subprocess
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.demo.processes import VirtualScreen

if TYPE_CHECKING:
    from collections.abc import Callable

RVIZ = Path("/usr/bin/rviz")
QML = """import QtQuick 2.15
Item {
    property var speed: rviz.registerFloatProperty("Speed", 1, "m/s")
    property var box: rviz.registerPropertyContainer("Box")
    property var tint: rviz.registerColorProperty(box, "Tint", "orange")
    property var at: rviz.registerVectorProperty(box, "At", Qt.vector3d(1, 2, 3))
}
"""
CONFIG = {"tabs": ["a", 1, None, True, {"deep: er": "- # x"}], "text": '"true"', "none": {}}


def saved_by_rviz(file: Path, master: str, home: Path) -> None:
    """Open a file in a plain RViz, and save it there by its key."""
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(home), "ROS_IP": "127.0.0.1"}
    environment |= {"ROS_MASTER_URI": master, "XDG_RUNTIME_DIR": str(home)}
    before = file.stat().st_mtime_ns
    with contextlib.closing(VirtualScreen(1000, 800)) as screen:
        environment["DISPLAY"] = screen.display
        with (home / "log").open("wb") as log:
            rviz = subprocess.Popen(
                [RVIZ, "-d", file], env=environment, stdout=log, stderr=subprocess.STDOUT
            )
        try:
            until = time.monotonic() + 60
            while file.stat().st_mtime_ns == before:
                assert rviz.poll() is None, (home / "log").read_text(errors="replace")
                assert time.monotonic() < until, (home / "log").read_text(errors="replace")
                time.sleep(0.3)
                # The screen would end with its only client, if xdotool came before RViz, which has
                # made its windows when it complains of what it does not know.
                if b"PluginlibFactory" not in (home / "log").read_bytes():
                    continue
                # Where there is no window manager, no window has the keys by itself.
                search = ["search", "--onlyvisible", "--name", "saved.rviz"]
                keys = ["windowfocus", "%@", "key", "ctrl+s"]
                subprocess.run(
                    ["xdotool", *search, *keys], env=environment, capture_output=True, check=False
                )
            time.sleep(0.5)
        finally:
            rviz.kill()
            rviz.wait()


@pytest.mark.skipif(not RVIZ.exists(), reason="Debian's package rviz has the plain program")
def test_a_plain_rviz_keeps_overlays(
    app: Any, wait: Callable[..., None], master: str, tmp_path: Path
) -> None:
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtWidgets

    interface, file = tmp_path / "Dashboard.qml", tmp_path / "saved.rviz"
    interface.write_text(QML)
    overlay = app.add_qml(interface, z=3, scale=1.5, opacity=0.5)
    legend = app.add(WidgetOverlay(QtWidgets.QFrame(), "Legend", style_sheet="* { color: red; }"))
    wait(lambda: len(list(app.entries)) == 2)
    properties = overlay.properties
    properties.properties["Speed"].set(2.5)
    properties.properties["Box"].properties["Tint"].set("#80112233")
    properties.set_config(CONFIG)
    app.save_config(file)
    ours = file.read_text()
    saved_by_rviz(file, master, tmp_path)
    theirs = file.read_text()
    assert displays(theirs) == displays(ours)
    app.overlays.remove(overlay)
    legend.style_sheet = ""
    app.load_config(file)
    wait(lambda: len(list(app.overlays)) == 2)
    restored = app.overlays.find("Dashboard")
    assert (restored.z, restored.scale, restored.opacity) == (3, 1.5, 0.5)
    values = restored.properties.properties
    assert values["Speed"].get() == 2.5
    assert values["Box"].properties["Tint"].get().name(restored_colour()) == "#80112233"
    at = values["Box"].properties["At"].get()
    assert (at.x(), at.y(), at.z()) == (1, 2, 3)
    assert restored.properties.get_config() == CONFIG
    assert app.overlays.find("Legend") is legend
    assert legend.style_sheet == "* { color: red; }"


def restored_colour() -> Any:
    from rosglass.rviz.qt5 import QtGui

    return QtGui.QColor.HexArgb


def displays(text: str) -> str:
    return text[text.index("  Displays:") : text.index("  Enabled: true\n  Global Options")]

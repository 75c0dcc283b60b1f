"""The colours of all controls."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

import pytest

pytestmark = pytest.mark.both_qt


def test_every_colour_follows_the_mode(controls: Any) -> None:
    probe = controls.show(
        """Item {
        property color shown
        function use(mode) { Theme.mode = mode }
        function text(color) { shown = color; return shown.toString() }
        function wrong() {
            return Object.keys(Theme.colors)
                .filter(name => typeof Theme.colors[name] === "string" && name in Theme)
                .filter(name => text(Theme[name]) !== text(Theme.colors[name])).join(" ")
        } }"""
    )
    for mode in ("bright", "contrast", "dark"):
        probe.use(mode)
        assert probe.wrong() == ""


@pytest.mark.parametrize(
    ("width", "height", "dpi", "scale"),
    [
        (1280, 800, 96, 1),
        (1920, 1080, 92, 1),
        # The desktop scales a 4K screen: Qt counts half of its pixels.
        (1920, 1080, 82, 1),
        (3840, 2160, 96, 2),
        (3840, 2160, 163, 2),
        # A tablet, on which a finger needs the same millimetres; and one with few pixels.
        (1920, 1200, 226, 2),
        (1024, 600, 170, 1.25),
        (800, 480, 133, 1),
        # Projectors and remote screens, which know no size or a wrong one.
        (1920, 1080, 0, 1),
        (1920, 1080, 3000, 1),
        (1920, 1080, float("nan"), 1),
        (0, 0, 96, 1),
        (15360, 8640, 96, 4),
    ],
)
def test_scale_suits_the_screen(
    controls: Any, width: int, height: int, dpi: float, scale: float
) -> None:
    probe = controls.show(
        "Item { function scaleOf(w, h, dpi) { return Theme.scaleFor_(w, h, dpi / 25.4) } }"
    )
    assert probe.scaleOf(width, height, dpi) == scale


def test_own_scale_takes_precedence(controls: Any) -> None:
    probe = controls.show(
        """Item { property real size: Theme.size
        function use(scale) { Theme.scale = scale === undefined
            ? Qt.binding(() => Theme.automaticScale) : scale } }"""
    )
    probe.use(1.5)
    assert probe.property("size") == 1.5
    probe.use(None)
    assert probe.property("size") == 1


SHOWN = """
import QtQuick 2.15
import QtQuick.Window 2.15
import RosControls 1.0
Window {
    width: 300; height: 200; visible: true
    Component.onCompleted: { OWN; console.info("SIZE", Theme.size); Qt.quit() }
}
"""


@pytest.mark.xvfb
@pytest.mark.parametrize(
    ("screen", "own", "size"),
    [("3840x2160", "", 2), ("1920x1080", "", 1), ("3840x2160", "Theme.scale = 1", 1)],
)
def test_scale_of_real_screens(screen: str, own: str, size: float, tmp_path: Any) -> None:
    file = tmp_path / "Shown.qml"
    file.write_text(SHOWN.replace("OWN", own))
    gone = {"QT_QPA_PLATFORM", "WAYLAND_DISPLAY", "DISPLAY", "ROSGLASS_URL"}
    environment = {k: v for k, v in os.environ.items() if k not in gone}
    done = subprocess.run(
        ["xvfb-run", "-a", "-s", f"-screen 0 {screen}x24", sys.executable,
         "-m", "rosglass.cli", "run", str(file), "--url", "local://theme"],
        env=environment, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert f"SIZE {size}" in done.stderr + done.stdout

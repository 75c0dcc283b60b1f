"""The demo's cockpit grows with the screen."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import rosglass.demo
from rosglass.qt import QT6, QtCore

if TYPE_CHECKING:
    from collections.abc import Callable

COCKPIT = Path(rosglass.demo.__file__).with_name("cockpit")
pytestmark = pytest.mark.skipif(not QT6, reason="the demo's cockpit is for Qt 6")


@pytest.mark.parametrize(("width", "height", "zoom"), [(1340, 752, 1), (3840, 2160, 2)])
def test_the_cockpit_grows_with_screens_that_report_no_resolution(
    running: Any, wait: Callable[..., None], width: int, height: int, zoom: float
) -> None:
    pytest.importorskip("PySide6.QtMultimedia", reason="the cockpit needs the extra `camera`")
    from rosglass.controls import register

    register()
    window = running.load(
        (COCKPIT / "main.qml").read_text().partition("\nWindow {")[2].join(["Window {", ""]),
        f'import QtQuick\nimport Ros2 1.0\nimport RosControls 1.0\nimport "{COCKPIT.as_uri()}"',
    )
    window.setProperty("width", width)
    window.setProperty("height", height)
    wait(lambda: window.property("zoom") == zoom)
    cockpit = window.findChild(QtCore.QObject, "cockpit")
    wait(lambda: (cockpit.width(), cockpit.height()) == (width / zoom, height / zoom))

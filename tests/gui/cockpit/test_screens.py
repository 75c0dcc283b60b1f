"""Windows of a layout on two screens, and on one that is missing, by ``rosglass run``."""

from __future__ import annotations

import json
import signal
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pathlib import Path

pytest.importorskip("PySide6", reason="Qt 5's offscreen platform has one screen")

LAYOUT = """import QtQuick 2.15
import QtQuick.Window 2.15
import RosCockpit 1.0

Cockpit {
    Page { Panel { Item {} } }
    PanelWindow {
        id: placed; title: "placed"; screenName: "RIGHT"; x: 100; y: 50; width: 400; height: 300
        Panel { Item {} }
    }
    PanelWindow { id: full; title: "full"; screenName: "RIGHT"; fullScreen: true; Panel {} }
    PanelWindow { id: large; title: "large"; screenName: "RIGHT"; width: 5000; Panel { Item {} } }
    PanelWindow {
        id: gone; title: "gone"; screenName: "HDMI-7"; width: 300; height: 200
        Panel { Item {} }
    }
    function report(window) {
        const shown = window.holder_.Window.window
        return [shown.screen.name, shown.x - shown.screen.virtualX, shown.width, shown.height]
    }
    Timer {
        interval: 50; repeat: true
        running: true
        onTriggered: {
            if ([placed, full, large, gone].every(one => one.holder_.Window.window.visible)) {
                console.log("WINDOWS", JSON.stringify([placed, full, large, gone].map(report)))
                running = false
            }
        }
    }
}
"""


@pytest.mark.parametrize("words", [[], ["--kiosk"]])
def test_windows_are_on_their_screens(start: Any, tmp_path: Path, words: list[str]) -> None:
    screens = [
        {"name": "LEFT", "x": 0, "y": 0, "width": 1000, "height": 700},
        {"name": "RIGHT", "x": 1000, "y": 0, "width": 800, "height": 600},
    ]
    for one in screens:
        one |= {"logicalDpi": 96, "logicalBaseDpi": 96, "dpr": 1}
    config = tmp_path / "screens.json"
    config.write_text(json.dumps({"screens": screens}))
    file = tmp_path / "layout.qml"
    file.write_text(LAYOUT)
    program = start(
        "run", file, "--url", "local://x", *words, QT_QPA_PLATFORM=f"offscreen:configfile={config}"
    )
    program.until("PanelWindow gone: The screen HDMI-7 is not there: shown on LEFT")
    found = json.loads(program.until("WINDOWS").partition("WINDOWS ")[2])
    placed, full, large, gone = found
    assert placed == ["RIGHT", 100, 400, 300]
    assert full == ["RIGHT", 0, 800, 600]
    assert large[0] == "RIGHT"
    assert large[2] == 800
    assert (gone[0], gone[2:]) == ("LEFT", [300, 200])
    program.kill(signal.SIGTERM)
    program.end()

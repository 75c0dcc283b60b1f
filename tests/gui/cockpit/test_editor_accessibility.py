"""The names and roles of the editor's window, read as screen readers do: over AT-SPI."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

pytest.importorskip("PySide6", reason="the editor needs Qt 6")

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = [pytest.mark.xvfb]

READER = Path(__file__).parents[1] / "controls" / "accessible_reader.py"
#: Debian's Python has pyatspi.
PYTHON = "/usr/bin/python3"
LAYOUT = """import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import RosCockpit 1.0

Cockpit {
    title: "Test"
    nodeName: "ui"
    Page {
        title: "One"
        Panel { title: "Power"; Battery { topic: "/battery" } }
        Panel { title: "Lean"; Attitude {} }
    }
}
"""
USED = {"push button", "check box", "radio button", "slider", "combo box", "text", "list", "tree"}


@pytest.fixture
def ask(screen: str, tmp_path: Path) -> Iterator[Any]:
    """Reads the objects of the cockpit, or presses one by its name."""
    checked = subprocess.run([PYTHON, "-c", "import pyatspi"], capture_output=True, check=False)
    if checked.returncode or shutil.which("dbus-run-session") is None:
        pytest.skip("needs sudo apt-get install python3-pyatspi at-spi2-core dbus-daemon")
    file = tmp_path / "drive.qml"
    file.write_text(LAYOUT)
    gone = {"QT_QPA_PLATFORM", "WAYLAND_DISPLAY", "ROSGLASS_URL", "DBUS_SESSION_BUS_ADDRESS"}
    gone |= {"PYTHONPATH", "AT_SPI_BUS_ADDRESS"}
    environment = {k: v for k, v in os.environ.items() if k not in gone}
    environment |= {"DISPLAY": screen, "QT_LINUX_ACCESSIBILITY_ALWAYS_ON": "1"}
    run = '"$1" -m rosglass.cli cockpit "$2" --url local://a >&2 & "$3" "$4" Editor; kill $!'
    programs = [sys.executable, str(file), PYTHON, str(READER)]
    with (tmp_path / "log").open("w") as log:
        process = subprocess.Popen(
            ["dbus-run-session", "--", "sh", "-c", run, "sh", *programs],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        )

    def request(words: str) -> list[dict[str, Any]]:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(f"{words}\n")
        process.stdin.flush()
        answer = next((line for line in process.stdout if line.startswith("[")), "")
        assert answer, (tmp_path / "log").read_text()
        found: list[dict[str, Any]] = json.loads(answer)
        return found

    yield request
    assert process.stdin is not None
    process.stdin.close()
    process.wait(20)


def test_editor_is_read_and_pressed(ask: Any) -> None:
    def there() -> set[tuple[str, str]]:
        return {(one["role"], one["name"]) for one in ask("all")}

    def shown(*wanted: tuple[str, str]) -> bool:
        return there() >= set(wanted)

    eventually(lambda: shown(("push button", "Edit"), ("push button", "Commands …")), there)
    ask("press Edit")
    eventually(
        lambda: shown(
            ("push button", "Done"),
            ("push button", "Undo"),
            ("text", "Search panels"),
            ("list", "Panels"),
            ("page tab", "One"),
            ("page tab", "Add a page"),
        ),
        there,
    )
    names = {one["name"] for one in ask("all")}
    assert {"Panels to add", "Power", "Lean", "Edge, moved by the left and right keys"} <= names
    unnamed = [one for one in ask("all") if one["role"] in USED and not one["name"]]
    assert unnamed == []
    ask("press Commands …")
    eventually(lambda: shown(("text", "Type a command"), ("list", "Commands")), there)

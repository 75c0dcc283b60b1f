"""Each template of ``rosglass new`` starts, with and without a robot, and says nothing is wrong."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import rosglass.controls
import rosglass.controls.modules
from rosglass.cli.arguments import TEMPLATES
from rosglass.qt import QtCore

pytestmark = pytest.mark.both_qt
FOLDER = Path(rosglass.controls.__file__).parent / "templates"
FILES = {file.stem for file in FOLDER.parent.glob("imports/RosControls/*.qml")}


def test_templates_are_those_of_the_command() -> None:
    assert {file.stem for file in FOLDER.glob("*.qml")} == TEMPLATES.keys()


@pytest.mark.parametrize("name", sorted(TEMPLATES))
def test_template_starts(name: str, start: Any, tmp_path: Path) -> None:
    shot, file = tmp_path / "shot.png", tmp_path / f"{name}.qml"
    assert start("new", file, "--template", name).end(30) == 0
    arguments = ["--url", "local://no_robot", "--screenshot", shot, "--after", "1"]
    program = start("run", file, *arguments)
    assert program.end(60) == 0, program.text
    assert shot.stat().st_size > 0
    wrong = [line for line in program.lines if re.search(r"WARNING|ERROR|Error", line)]
    assert [line for line in wrong if "still closing" not in line] == []


@pytest.mark.parametrize("name", sorted(TEMPLATES))
@pytest.mark.parametrize(("width", "height"), [(800, 480), (1920, 1080)])
def test_template_fits_the_screen(
    name: str, width: int, height: int, running: Any, wait: Any
) -> None:
    rosglass.controls.register()
    window: Any = running.load((FOLDER / f"{name}.qml").read_text().replace("Ros2.init", "void"))
    wait(window.isExposed)
    # As in a kiosk: it fills the screen after it was shown.
    window.resize(width, height)
    wait(lambda: (window.width(), window.height()) == (width, height))
    controls = rosglass.controls.modules.TYPES.keys() | FILES

    def beyond() -> list[str]:
        waiting, found = list(window.contentItem().childItems()), []
        while waiting:
            item = waiting.pop()
            kind = item.metaObject().className().partition("_QML")[0]
            if not item.isVisible() or item.width() * item.height() == 0:
                continue
            if kind not in controls:
                waiting += item.childItems()
                continue
            at = item.mapToScene(QtCore.QPointF(0, 0))
            right, bottom = at.x() + item.width(), at.y() + item.height()
            if min(at.x(), at.y()) < 0 or right > width or bottom > height:
                found.append(f"{kind} at {at.x():g}, {at.y():g} to {right:g}, {bottom:g}")
        return found

    wait(lambda: not beyond())

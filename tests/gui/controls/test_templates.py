"""Each template of ``rosglass new`` starts, with and without a robot, and says nothing is wrong."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import rosglass.controls
from rosglass.cli.arguments import TEMPLATES

pytestmark = pytest.mark.both_qt
FOLDER = Path(rosglass.controls.__file__).parent / "templates"


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

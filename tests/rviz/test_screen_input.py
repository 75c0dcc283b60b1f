"""Clicks hit what is seen, on screens with more pixels than units and at any scale."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from rosglass.demo.processes import VirtualScreen

PROGRAM = Path(__file__).with_name("screen_input_program.py")


@pytest.mark.parametrize(
    ("factor", "renderer"),
    [("1", "opengl"), ("2", "opengl"), ("1.5", "opengl"), ("2", "software"), ("1.5", "software")],
)
def test_clicks_hit_what_is_seen(factor: str, renderer: str, master: str, tmp_path: Path) -> None:
    environment = {k: v for k, v in os.environ.items() if k not in ("QT_QPA_PLATFORM", "DISPLAY")}
    environment |= {"HOME": str(tmp_path), "XDG_RUNTIME_DIR": str(tmp_path), "ROS_IP": "127.0.0.1"}
    environment |= {"ROS_MASTER_URI": master, "ROSGLASS_QT": "pyside2", "QT_SCALE_FACTOR": factor}
    with contextlib.closing(VirtualScreen(1800, 1400)) as screen:
        done = subprocess.run(
            [sys.executable, str(PROGRAM), str(tmp_path / "Test.qml"), renderer],
            env=environment | {"DISPLAY": screen.display},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=90,
            check=False,
        )
    lines = [line for line in done.stdout.splitlines() if line.startswith("SEEN ")]
    assert lines, done.stdout[-3000:]
    seen = json.loads(lines[0].removeprefix("SEEN "))
    for place in seen["item"]:
        assert place == pytest.approx([7, 9], abs=1)
    for place in seen["widget"]:
        assert place == pytest.approx([93, 51], abs=1)
    # Where Qt says that they are on the screen; in QML drawn by OpenGL, Qt takes pixels for units.
    assert seen["screen"] == [[True], [True]]
    for off in seen["global"] if factor == "1" or renderer == "software" else []:
        assert off == pytest.approx([0, 0], abs=1)

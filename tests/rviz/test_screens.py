"""Overlays on screens with more pixels than units, and where there is no OpenGL for Qt."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from rosglass.demo.processes import VirtualScreen

PROGRAM = Path(__file__).with_name("hidpi_program.py")


@pytest.mark.parametrize(
    ("factor", "renderer"),
    [("2", "opengl"), ("1.5", "opengl"), ("2", "software"), ("1.5", "auto")],
)
def test_overlays_have_every_pixel_of_the_screen(
    factor: str, renderer: str, master: str, tmp_path: Path
) -> None:
    environment = {k: v for k, v in os.environ.items() if k not in ("QT_QPA_PLATFORM", "DISPLAY")}
    environment |= {"HOME": str(tmp_path), "XDG_RUNTIME_DIR": str(tmp_path), "ROS_IP": "127.0.0.1"}
    environment |= {"ROS_MASTER_URI": master, "ROSGLASS_QT": "pyside2"}
    environment |= {"QT_SCALE_FACTOR": factor}
    with contextlib.closing(VirtualScreen(1400, 1000)) as screen:
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
    assert seen["ratio"] == float(factor)
    assert seen["renderer"] == ("opengl" if renderer == "opengl" else "software")
    assert not seen["stretched"]
    assert seen["units"] == [True, True]
    assert seen["inside"] == ["#0080ff", "#0080ff", "#ff0000"]
    assert not {"#0080ff", "#ff0000"} & set(seen["outside"])
    assert seen["widget"] == ["#00ff00", "#00ff00"]
    assert "#00ff00" not in seen["beside"]
    assert seen["problem"] == ""

"""``make view-demo``: the paper's dashboard over the 3D view of a simulated ROS 2 robot."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import threading
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest
from ports import free_port
from waiting import eventually

from rosglass.wires.zenoh.router import Router

ROOT = Path(__file__).parents[2]
#: Seconds for a busy machine to show the robot, and until the screenshot.
_SHOWN_S = "12"
#: Debian's Python, with RViz.
RVIZ_PYTHON = ROOT / ".venv-system/bin/python"
#: The panels of the dashboard, the last of which has three pages.
PANELS = {
    *("View", "Posture", "Mode", "Battery", "Front camera", "Rear camera"),
    *("Mission", "Behaviours", "Settings"),
}


def test_it_shows_the_dashboard_over_the_robot_without_warnings(app: Any, tmp_path: Path) -> None:
    from PySide6.QtGui import QImage

    picture = tmp_path / "view-demo.png"
    code = f"from rosglass.demo.view import main; main({_SHOWN_S}, {str(picture)!r})"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={name: value for name, value in os.environ.items() if name != "DISPLAY"},
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    image = QImage(str(picture))
    assert (image.width(), image.height()) == (1280, 800)

    def count(is_wanted: Any, left: int, top: int, right: int, bottom: int) -> int:
        places = ((x, y) for x in range(left, right, 4) for y in range(top, bottom, 4))
        return sum(1 for x, y in places if is_wanted(*image.pixelColor(x, y).getRgb()[:3]))

    def is_red(r: int, g: int, b: int) -> bool:
        return r > 180 and g < 60 and b < 80

    # The stop button, which is red only while the robot's state is known.
    assert count(is_red, 10, 640, 165, 770) > 500
    # The robot's orange body, in the middle of the 3D view.
    assert count(lambda r, g, b: r > 110 and 30 < g < 110 and b < 40, 400, 100, 900, 520) > 100
    assert "WARNING" not in done.stderr, done.stderr


def test_the_example_in_python_shows_a_robot(app: Any) -> None:
    with Router(f"tcp/127.0.0.1:{free_port()}") as router:
        robot = subprocess.Popen(
            [sys.executable, "-m", "rosglass", "robot", "--equipped", "--url", router.url],
            stdout=subprocess.DEVNULL,
        )
        example = subprocess.Popen(
            [sys.executable, str(ROOT / "examples/view/scene.py"), router.url],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        try:
            assert example.stdout is not None
            lines = []
            for line in example.stdout:
                lines.append(line)
                if line == "Front laser: ok\n":
                    break
            assert lines[-1:] == ["Front laser: ok\n"], lines
            assert not [line for line in lines if "WARNING" in line or "ERROR" in line]
        finally:
            for process in (example, robot):
                process.kill()
                process.wait()


class Demo:
    """One of the two demos, and all that the panels of its dashboard have shown.

    Attributes:
        shown: The texts of each panel by its title, with ``#`` in place of numbers.
    """

    def __init__(self, python: str, program: str, folder: Path) -> None:
        start, module = {
            "view": ("_start_router", "rosglass.demo.view"),
            "rviz": ("_start_master", "rosglass.demo.rviz"),
        }[program]
        overlay, config = ROOT / "tests/scene/DashboardPanels.qml", ROOT / "examples/rviz"
        command = [program, str(config / "figure1.rviz"), "--overlay", str(overlay)]
        code = f"""
import sys
from pathlib import Path
from rosglass.demo.rviz import run_station
from {module} import {start}
sys.exit(run_station({program!r}, {command!r}, {start}, 600, None, Path("never.png")))
"""
        environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "ROS_IP")}
        environment |= {"HOME": str(folder), "XDG_RUNTIME_DIR": str(folder)}
        environment["ROSGLASS_QT"] = "pyside2" if program == "rviz" else ""
        self.shown: dict[str, set[tuple[str, ...]]] = defaultdict(set)
        self.lines: list[str] = []
        self._process = subprocess.Popen(
            [python, "-c", code],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            _, found, panels = line.partition("PANELS ")
            if not found:
                self.lines.append(line)
                continue
            for title, texts in json.loads(panels).items():
                self.shown[title].add(tuple(re.sub(r"-?[0-9]+(\.[0-9]+)?", "#", t) for t in texts))

    def close(self) -> None:
        """End the demo, and all that it has started."""
        self._process.terminate()
        self._process.wait(60)


@pytest.mark.skipif(not RVIZ_PYTHON.exists(), reason="RViz's Python is set up by make test")
def test_each_panel_shows_what_it_shows_over_rviz(tmp_path: Path) -> None:
    """The same dashboard, of a ROS 1 robot over RViz and of a ROS 2 robot over the 3D view."""
    folders = [tmp_path / name for name in ("view", "rviz")]
    for folder in folders:
        folder.mkdir(mode=0o700)
    demos = [Demo(sys.executable, "view", folders[0]), Demo(str(RVIZ_PYTHON), "rviz", folders[1])]
    view, rviz = demos

    def differing() -> list[str]:
        return [p for p in sorted(PANELS) if not view.shown[p] & rviz.shown[p]]

    def complete() -> bool:
        mission = view.shown["Mission"] & rviz.shown["Mission"]
        # Its five waypoints are numbered.
        return not differing() and any(texts.count("#") == 5 for texts in mission)

    try:
        eventually(
            complete,
            lambda: str([(p, view.shown[p], rviz.shown[p]) for p in differing() or ["Mission"]]),
            timeout=100,
        )
        assert view.shown.keys() == rviz.shown.keys() == PANELS
        for demo in demos:
            assert not [line for line in demo.lines if "WARNING rosglass.qml" in line], demo.lines
    finally:
        for demo in demos:
            demo.close()


def test_module_answers_help_and_refuses_options() -> None:
    command = [sys.executable, "-m", "rosglass.demo.view"]
    shown = subprocess.run([*command, "--help"], capture_output=True, text=True, check=True)
    assert "rosglass view" in shown.stdout
    refused = subprocess.run(
        [*command, "--seconds", "5"], capture_output=True, text=True, check=False
    )
    assert refused.returncode == 2
    assert "unrecognized arguments" in refused.stderr

"""``make view-demo``: the paper's dashboard over the 3D view of a simulated ROS 2 robot."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from ports import free_port

from rosglass.wires.zenoh.router import Router

ROOT = Path(__file__).parents[2]
#: Seconds for a busy machine to show the robot, and until the picture.
_SHOWN_S = "12"


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
        timeout=120,
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

"""``make rviz-demo`` without a display: a screenshot, and nothing left behind."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PATIENCE = 60.0
PROGRAM = """
import sys
from pathlib import Path
from rosglass.demo.rviz import main
sys.exit(main(float(sys.argv[1]), Path(sys.argv[2])))
"""


def children(pid: int) -> set[int]:
    """Return the ids of all child processes of a program, and of theirs."""
    parents = {}
    for entry in Path("/proc").glob("[0-9]*"):
        # It may be gone by now.
        with suppress(OSError):
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            parents[int(entry.name)] = int(fields[1])
    found = {pid}
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return found - {pid}


def gone(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[Callable[[float], subprocess.Popen[str]]]:
    started: list[subprocess.Popen[str]] = []
    env = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "ROS_IP")}
    env |= {"HOME": str(tmp_path), "XDG_RUNTIME_DIR": str(tmp_path), "ROSGLASS_QT": "pyside2"}

    def start(seconds: float) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", PROGRAM, str(seconds), str(tmp_path / "seen.png")]
        pipe = subprocess.PIPE
        started.append(subprocess.Popen(command, env=env, stdout=pipe, text=True))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()


def test_it_takes_a_screenshot_and_ends(demo: Any, tmp_path: Path) -> None:
    process = demo(6)
    output, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, output
    assert "no display: RViz runs 6 s on a virtual screen" in output
    assert f"screenshot of RViz: {tmp_path / 'seen.png'}" in output
    from rosglass.rviz.qt5 import QtGui

    picture = QtGui.QImage(str(tmp_path / "seen.png"))
    assert (picture.width(), picture.height()) == (1280, 800)
    # The dashboard is at the left bottom, without RViz's frame around it: the stop's edge.
    stop = QtGui.QColor(picture.pixel(90, 768))
    assert max(stop.red(), stop.green()) > 60
    assert stop.blue() < 60


@pytest.mark.parametrize(
    ("number", "programs"),
    # One of them is the screen; all are screen, master, robot, RViz.
    [*itertools.product([signal.SIGINT, signal.SIGTERM], [1, 4]), (signal.SIGKILL, 4)],
)
def test_nothing_outlives_it(demo: Any, number: signal.Signals, programs: int) -> None:
    process = demo(600)
    eventually(
        lambda: len(children(process.pid)) >= programs,
        f"it starts {programs} programs",
        timeout=PATIENCE,
    )
    started = children(process.pid)
    process.send_signal(number)
    expected = -number if number is signal.SIGKILL else 128 + number
    assert process.wait(PATIENCE) == expected
    eventually(lambda: all(map(gone, started)), "programs are left behind", timeout=PATIENCE)


def test_without_a_master_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    from rosglass.demo import rviz

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(rviz.shutil, "which", lambda *_, **__: None)
    with pytest.raises(Error, match="apt install python3-rosmaster"):
        rviz.main()

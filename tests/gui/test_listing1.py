"""The paper's Listing 1, word for word, on a robot of rospy: image, driving, flashlight."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

pytestmark = [
    pytest.mark.xvfb,
    pytest.mark.parametrize("url", ["ros1"], indirect=True, scope="module"),
]

LISTING = Path(__file__).parents[2] / "examples" / "paper" / "listing1.qml"
HERE = Path(__file__).parent


class Talk:
    """A program that is written lines to and read lines from."""

    def __init__(self, command: list[str], env: dict[str, str]) -> None:
        self.process = subprocess.Popen(
            command,
            env=env,
            text=True,
            bufsize=1,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        self.lines: list[str] = []
        self.errors: list[str] = []
        for stream, into in (
            (self.process.stdout, self.lines),
            (self.process.stderr, self.errors),
        ):
            threading.Thread(target=into.extend, args=[stream], daemon=True).start()

    def ask(self, command: str) -> str:
        assert self.process.stdin is not None
        count = len(self.lines)
        self.process.stdin.write(f"{command}\n")
        until(lambda: len(self.lines) > count, self)
        return self.lines[-1].strip()

    def close(self) -> None:
        self.process.kill()
        self.process.wait(10)


def until(condition: Callable[[], Any], *programs: Talk) -> None:
    def is_true() -> bool:
        assert all(program.process.poll() is None for program in programs), said()
        return condition()

    def said() -> list[list[str]]:
        return [program.errors[-20:] for program in programs]

    eventually(is_true, said, timeout=40)


@pytest.fixture
def robot(url: str, tmp_path: Path) -> Iterator[Talk]:
    port = url.rpartition(":")[2].partition("?")[0]
    env = {
        "PATH": "/usr/bin:/bin",
        "HOME": str(tmp_path),
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
        "ROS_IP": "127.0.0.1",
    }
    made = Talk(["/usr/bin/python3", str(HERE / "rospy_robot.py")], env)
    until(lambda: made.lines, made)
    yield made
    made.close()


@pytest.fixture
def panel(url: str, screen: str, robot: Talk) -> Iterator[Talk]:
    # What draws in software, as other tests do, shows no video.
    gone = {"QT_QPA_PLATFORM", "QT_QUICK_BACKEND"}
    env = {k: v for k, v in os.environ.items() if k not in gone} | {"DISPLAY": screen}
    made = Talk([sys.executable, str(HERE / "listing_app.py"), str(LISTING), url], env)
    yield made
    made.close()


def received(robot: Talk, what: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in robot.lines if what in line]


@pytest.mark.both_qt
def test_listing1(panel: Talk, robot: Talk, tmp_path: Path) -> None:
    # The camera's orange fills the window; the joystick lies over it.
    until(lambda: panel.ask("pixel 30 60") in {"#e67814", "#e57814", "#e67813"}, panel, robot)
    assert panel.ask("pixel 200 240") == "#aaaaaa"
    until(lambda: panel.ask("drag 200 240 200 210") and received(robot, "speed"), panel, robot)
    speed = received(robot, "speed")[-1]
    assert speed["speed"] == pytest.approx(0.5, abs=0.05)
    assert speed["turn"] == pytest.approx(0.0, abs=0.05)
    panel.ask("click 40 285")
    until(lambda: received(robot, "lamp") == [{"lamp": False}], panel, robot)
    panel.ask("click 40 285")
    until(lambda: received(robot, "lamp") == [{"lamp": False}, {"lamp": True}], panel, robot)
    assert panel.ask(f"save {tmp_path / 'listing1.png'}") == "True"
    assert not [line for line in panel.errors if "Error" in line]

"""The element Parameter on real ROS 2 nodes that declare late and are restarted."""

from __future__ import annotations

import json
import random
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable, Iterator

RESTARTS = 10
#: As examples/parameters.qml shows a parameter.
SLIDER = """
    Item {
        property var shown: []
        property Parameter p: Parameter {
            nodeName: "/robot"; name: "max_speed"
            onReadyChanged: if (ready) shown.push([value, maximum, slider.value])
        }
        Slider {
            id: slider
            from: p.minimum || 0; to: p.maximum || 1; value: p.value || 0
        }
        function seen() { return JSON.stringify([p.ready, p.value, p.maximum, slider.value]) }
        function history() { return JSON.stringify(shown) }
        function problem() { return p.problem }
    }
"""


class Robot:
    """A program of rclpy with the node ``/robot``."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        self.lines.extend(line.strip() for line in iter(self._process.stdout.readline, ""))

    def command(self, line: str) -> None:
        assert self._process.stdin is not None
        print(line, file=self._process.stdin, flush=True)

    def kill(self) -> None:
        self._process.kill()
        self._process.communicate()
        self._reader.join(10)


@pytest.fixture
def start(start_rclpy_at: Any, ros_domains: list[int]) -> Iterator[Callable[[float, float], Robot]]:
    started: list[Robot] = []

    def start(value: float, highest: float) -> Robot:
        script = Path(__file__).with_name("rclpy_parameters.py")
        started.append(Robot(start_rclpy_at(ros_domains[0], script, str(value), str(highest))))
        return started[-1]

    yield start
    for robot in started:
        robot.kill()


@pytest.fixture
def screen_over_dds(
    app: Any, ros_domains: list[int], tmp_path: Path, wait: Any
) -> Iterator[Callable[[str], Any]]:
    """Load QML whose session is a node over DDS."""
    pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
    from conftest import Bench, RealWorld
    from rosglass.qml import Session, install
    from rosglass.qt import QtQml, send_deferred_deletes

    url = f"dds://?domain={ros_domains[0]}"
    session, engine = Session(url), QtQml.QQmlEngine()
    install(engine, session)
    made = Bench(session, engine, RealWorld(url), tmp_path)
    made.robot.close()
    session.init("ui")
    wait(lambda: session.node is not None)
    yield lambda body: made.load(body, "import QtQuick 2.15\nimport QtQuick.Controls 2.15")
    made.close()
    send_deferred_deletes()
    engine.deleteLater()
    send_deferred_deletes()


@pytest.mark.parametrize("killed", [False, True], ids=["ended", "killed"])
def test_no_restart_of_a_robot_leaves_a_wrong_value(
    screen_over_dds: Any, start: Any, wait: Any, killed: bool
) -> None:
    """Neither the value of before, nor one clamped to another range, nor none as if it were one."""
    root = screen_over_dds(SLIDER)
    for count in range(RESTARTS):
        value, highest = 1.5 + count, 2.0 + 2 * count
        robot = start(value, highest)
        wait(lambda robot=robot: "ready" in robot.lines)
        if count % 2:
            # Its services answer before it has declared anything.
            wait(lambda: "has no parameter 'max_speed'" in root.problem())
            assert root.seen().startswith("[false,null"), root.seen()
        else:
            wait.nothing_happens(random.Random(count).random())
        robot.command("declare")
        expected = f"[true,{value:g},{highest:g},{value:g}]"
        wait(lambda expected=expected: root.seen() == expected, timeout=60)
        assert root.problem() == ""
        if killed:
            robot.kill()
        else:
            robot.command("end")
            wait(lambda: root.seen().startswith("[false"), timeout=60)
            robot.kill()
    for value, highest, slider in json.loads(root.history()):
        assert value == slider <= highest

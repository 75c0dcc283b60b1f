"""The example over RViz as its user has it: master, robot and RViz in processes of their own."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually, nothing_happens

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

FOLDER = Path(__file__).parents[2] / "examples/rviz"
PATIENCE = 60.0
#: Seconds that RViz may take to end beside other programs: after 1.7 s it ends in any case.
ENDING = 10.0
#: Positions on a screen of 1280x800.
STOP, UNLOCK = (90, 720), (90, 608)
BEHAVIOURS, FLIPPERS_UP = (1140, 557), (1085, 652)
PICTURES = {"front camera": (462, 560, 256, 180), "rear camera": (746, 560, 256, 180)}
GRAB = """
import sys
from rosglass.rviz.qt5 import QtGui
app = QtGui.QGuiApplication([])
app.primaryScreen().grabWindow(0).save(sys.argv[1])
"""


class Robot:
    """The robot's messages, by topic."""

    TOPICS = (
        ("/emergency_stop/state", "std_msgs/msg/Bool"),
        ("/odom", "nav_msgs/msg/Odometry"),
        ("/joint_states", "sensor_msgs/msg/JointState"),
    )

    def __init__(self, node: Any) -> None:
        self.messages: dict[str, Any] = {}
        for topic, kind in self.TOPICS:
            node.create_subscription(topic, kind, lambda m, topic=topic: self._hear(topic, m), 1)

    def _hear(self, topic: str, message: Any) -> None:
        self.messages[topic] = message

    @property
    def stopped(self) -> bool | None:
        message = self.messages.get("/emergency_stop/state")
        return None if message is None else bool(message.data)

    @property
    def speed(self) -> float:
        message = self.messages.get("/odom")
        if message is None:
            return 0.0
        twist = message.twist.twist
        return math.hypot(twist.linear.x, twist.angular.z)

    @property
    def flippers(self) -> list[float]:
        message = self.messages["/joint_states"]
        named = zip(message.name, message.position, strict=True)
        return [angle for name, angle in named if "flipper" in name]


@pytest.fixture
def env(screen: str, master: str, tmp_path: Path) -> dict[str, str]:
    home = tmp_path / "home"
    home.mkdir(mode=0o700)
    return {
        "PATH": os.environ["PATH"],
        "HOME": str(home),
        "XDG_RUNTIME_DIR": str(home),
        "DISPLAY": screen,
        "QT_QPA_PLATFORM": "xcb",
        "ROSGLASS_QT": "pyside2",
        "ROS_MASTER_URI": master,
        "ROS_IP": "127.0.0.1",
    }


@pytest.fixture
def robot(env: dict[str, str]) -> Iterator[Robot]:
    """The robot on its mission, driving by itself."""
    import rosglass

    url = env["ROS_MASTER_URI"].replace("http:", "ros1:")
    options = ["--equipped", "--mode", "autonomous", "--fps", "10", "--url", url, "--leash"]
    program = subprocess.Popen(
        [sys.executable, "-m", "rosglass.cli", "robot", *options],
        env=env,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
    )
    try:
        with closing(rosglass.connect(url, name="test_examples")) as node:
            yield Robot(node)
    finally:
        program.kill()
        program.wait(PATIENCE)


class Rviz:
    """RViz with the dashboard."""

    def __init__(self, process: subprocess.Popen[bytes], env: dict[str, str], folder: Path) -> None:
        self.process, self._env, self._folder = process, env, folder

    @property
    def output(self) -> str:
        return (self._folder / "log").read_text()

    def picture(self) -> Any:
        from rosglass.qt import QtGui

        file = str(self._folder / "picture.png")
        subprocess.run([sys.executable, "-c", GRAB, file], env=self._env, check=True, timeout=60)
        return QtGui.QImage(file)

    def evidence(self, robot: Robot) -> Callable[[], str]:
        """Return the report of a failure: the robot's messages, and the path of the screenshot."""

        def report() -> str:
            self.picture()
            return f"{robot.messages}; see {self._folder / 'picture.png'}; {self.output}"

        return report

    def press(self, place: tuple[int, int]) -> None:
        self._do("mousemove", *place, "mousedown", 1)

    def release(self) -> None:
        self._do("mouseup", 1)

    def click(self, place: tuple[int, int]) -> None:
        self.press(place)
        self.release()

    def _do(self, *words: object) -> None:
        subprocess.run(["xdotool", *map(str, words)], env=self._env, check=True, timeout=60)


@pytest.fixture
def rviz(env: dict[str, str], robot: Robot, tmp_path: Path) -> Iterator[Rviz]:
    files = [str(FOLDER / "figure1.rviz"), "--overlay", str(FOLDER / "Dashboard.qml")]
    with (tmp_path / "log").open("w") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "rosglass.cli", "rviz", *files, "--fullscreen"],
            env=env,
            stdout=log,
            stderr=log,
        )
    rviz = Rviz(process, env, tmp_path)
    # A button that a test has left pressed would not be pressed again.
    rviz.release()
    yield rviz
    rviz.release()
    if process.poll() is None:
        process.kill()
        process.wait(PATIENCE)


def colours(image: Any, area: tuple[int, int, int, int]) -> list[int]:
    left, top, width, height = area
    return [
        image.pixel(x, y) for x in range(left, left + width, 8) for y in range(top, top + height, 8)
    ]


def test_an_operator_sees_stops_and_commands_the_robot(robot: Robot, rviz: Rviz) -> None:
    before: dict[str, list[int]] = {}
    live: set[str] = set()

    def look() -> bool:
        assert rviz.process.poll() is None, rviz.output
        seen = rviz.picture()
        for name, area in PICTURES.items():
            now = colours(seen, area)
            if len(set(now)) > 50 and name in before and now != before[name]:
                live.add(name)
            if len(set(now)) > 50:
                before[name] = now
        return live == set(PICTURES)

    eventually(look, lambda: f"live: {live}; {rviz.output}", timeout=PATIENCE)
    eventually(
        lambda: robot.stopped is False and robot.speed > 0.1,
        lambda: robot.messages,
        timeout=PATIENCE,
    )

    rviz.click(STOP)
    eventually(lambda: robot.stopped and robot.speed < 0.01, rviz.evidence(robot), timeout=PATIENCE)
    # A click does not release it, a long press does.
    rviz.click(STOP)
    rviz.click(UNLOCK)
    nothing_happens(1.0)
    assert robot.stopped

    def released() -> bool:
        """Press long, and again: it is not released when its counter has just not been received."""
        rviz.press(UNLOCK)
        time.sleep(1.5)
        rviz.release()
        time.sleep(2.0)
        return robot.stopped is False

    eventually(released, rviz.evidence(robot), timeout=PATIENCE)

    rviz.click(BEHAVIOURS)
    rviz.click(FLIPPERS_UP)
    eventually(lambda: min(robot.flippers) > 1.0, lambda: robot.flippers, timeout=PATIENCE)

    started = time.monotonic()
    rviz.process.send_signal(signal.SIGINT)
    assert rviz.process.wait(PATIENCE) == 130, rviz.output
    assert time.monotonic() - started < ENDING, rviz.output
    errors = [
        line
        for line in rviz.output.splitlines()
        if any(word in line for word in ("Error:", "Traceback"))
    ]
    assert errors == [], rviz.output

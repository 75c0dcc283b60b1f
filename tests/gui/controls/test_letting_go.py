"""Every way to let go of a robot: zeros at once, and then nothing; with real windows and input."""

from __future__ import annotations

import shutil
import signal
import subprocess
import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import pytest
from ports import free_port
from relay import Relay
from rosmaster import RosMaster
from waiting import eventually, nothing_happens

import rosglass
from letting_go import WAYS, Robot, Screen, drag, let_go, press, stays_connected
from rosglass.demo.processes import VirtualScreen
from rosglass.qt import QT6
from rosglass.wires.zenoh.router import Router

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

pytestmark = [
    pytest.mark.both_qt,
    pytest.mark.skipif(
        shutil.which("xdotool") is None, reason="needs sudo apt-get install xdotool"
    ),
]


class Screens:
    """Starts a screen, and another one when that has ended."""

    def __init__(self, url: str, display: str, folder: Path) -> None:
        self._given = url, display, folder
        self._screen: Screen | None = None

    def get(self) -> Screen:
        if self._screen is None or not self._screen.is_running():
            self.close()
            self._screen = Screen(*self._given)
        return self._screen

    def close(self) -> None:
        if self._screen is not None:
            self._screen.close()
            self._screen = None


@pytest.fixture(scope="module")
def robot(url: str) -> Iterator[Robot]:
    node = rosglass.connect(url, "robot")
    yield Robot(node)
    node.close()


@pytest.fixture(scope="module")
def screens(
    url: str, robot: Robot, screen: str, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Screens]:
    made = Screens(url, screen, tmp_path_factory.mktemp("screen"))
    with stays_connected(screen):
        yield made
        made.close()


@pytest.mark.parametrize("name", WAYS)
def test_letting_go(name: str, screens: Any, robot: Robot) -> None:
    """How long it takes is measured by benchmarks/letting_go.py."""
    if name == "touch cancelled" and not QT6:
        pytest.skip("PySide 2 cannot make the event of a touch that is cancelled")
    if "gamepad" in name:
        pytest.importorskip("sdl2", reason='needs pip install "rosglass[gamepad]"')
    screen, way = screens.get(), WAYS[name]
    since = len(screen.lines)
    outcome = let_go(screen, robot, way)
    assert outcome.zeros >= 3
    assert outcome.moved_after == 0
    assert outcome.late_s < 2
    text = "\n".join(screen.lines[since:])
    assert "Traceback" not in text
    assert "internal error" not in text
    if way.ends:
        screens.close()


@pytest.mark.skipif(not QT6, reason="Qt 5 ends the process at once, without any code of ours")
def test_losing_the_display(url: str, robot: Robot, tmp_path: Path) -> None:
    """The X server ends, or the connection of ssh -X is lost: Qt ends the program."""
    with VirtualScreen() as display:
        program = Screen(url, display.display, tmp_path)
        try:
            program.reset()
            drag(program)
            eventually(lambda: robot.moves)
            robot.received.clear()
            display.close()
            eventually(lambda: not program.is_running())
            eventually(lambda: robot.zeros >= 3)
        finally:
            program.close()


@contextmanager
def driving_over_a_stalled_link(screen: str, folder: Path) -> Iterator[tuple[Robot, Relay, Screen]]:
    """A screen whose stick is dragged, over a link that delivers nothing until it is resumed."""
    port = free_port()
    with Router(f"tcp/127.0.0.1:{port}") as router, Relay(port) as relay, stays_connected(screen):
        node = rosglass.connect(router.url, "robot")
        robot = Robot(node)
        program = Screen(f"zenoh://127.0.0.1:{relay.port}?mode=client", screen, folder)
        try:
            program.reset()
            drag(program)
            eventually(lambda: robot.moves)
            relay.stall()
            yield robot, relay, program
        finally:
            relay.resume()
            program.signal(signal.SIGCONT)
            program.close()
            node.close()


@pytest.mark.skipif(not QT6, reason="the wire, not Qt, is what matters")
@pytest.mark.parametrize("outage_s", [0.5, 3.0])
def test_letting_go_during_an_outage(outage_s: float, screen: str, tmp_path: Path) -> None:
    """The link stalls, and delivers later what was sent: the last of it is a zero."""
    with driving_over_a_stalled_link(screen, tmp_path) as (robot, relay, program):
        nothing_happens(0.1)
        program.x11("mouseup", 1)
        nothing_happens(outage_s)
        robot.received.clear()
        relay.resume()
        eventually(lambda: robot.zeros >= 3, lambda: (robot.received, program.text))
        nothing_happens(1.5)
        assert robot.zeros >= 3
        moving = sum(speed > 0 for _, speed in robot.received)
        assert moving < 15, "what was sent before the outage was noticed; 20 a second"


@pytest.mark.skipif(not QT6, reason="the wire, not Qt, is what matters")
@pytest.mark.parametrize("first", ["screen", "link"])
def test_letting_go_while_link_and_screen_stand_still(
    first: str, screen: str, tmp_path: Path
) -> None:
    """Both go on later, one before the other: nothing old is repeated, and zeros follow."""
    with driving_over_a_stalled_link(screen, tmp_path) as (robot, relay, program):
        program.signal(signal.SIGSTOP)
        program.x11("mouseup", 1)
        nothing_happens(1.0)
        robot.received.clear()
        steps = [relay.resume, lambda: program.signal(signal.SIGCONT)]
        for step in steps if first == "link" else reversed(steps):
            step()
            nothing_happens(0.3)
        eventually(lambda: robot.zeros >= 3, lambda: program.text)
        nothing_happens(1.5)
        assert robot.zeros >= 3
        moving = sum(speed > 0 for _, speed in robot.received)
        assert moving <= 3, "what was sent before both stood still"


@pytest.mark.skipif(not QT6, reason="the wire, not Qt, is what matters")
def test_one_of_two_operators_lets_go(screen: str, tmp_path: Path) -> None:
    """Its zeros arrive, it is silent then, and the other one goes on and halts in its turn."""
    with (
        Router(f"tcp/127.0.0.1:{free_port()}") as router,
        VirtualScreen() as second,
        stays_connected(screen),
        stays_connected(second.display),
    ):
        node = rosglass.connect(router.url, "robot")
        robot = Robot(node)
        programs = []
        try:
            for display in (screen, second.display):
                folder = tmp_path / str(len(programs))
                folder.mkdir()
                programs.append(Screen(router.url, display, folder))
                programs[-1].reset()
            one, other = programs
            drag(one)
            eventually(lambda: robot.moves)
            press(other)

            def speeds() -> set[float]:
                return {round(speed, 3) for _, speed in robot.received[-10:]}

            eventually(lambda: len(speeds()) == 2 and 0 not in speeds())
            (slow, fast) = sorted(speeds())
            robot.received.clear()
            one.x11("mouseup", 1)
            eventually(lambda: sum(not speed for _, speed in robot.received) >= 3)
            robot.received.clear()
            # The zeros end a second after the last one that was dropped, as on a busy machine.
            eventually(lambda: len(robot.received) > 10 and speeds() == {slow})
            assert all(speed < fast - 0.01 for _, speed in robot.received), "who let go moves it"
            other.x11("keyup w")
            eventually(lambda: robot.zeros >= 3)
            eventually(lambda: time.monotonic() - robot.received[-1][0] > 0.5)
            assert robot.zeros >= 3
        finally:
            for program in programs:
                program.close()
            node.close()


ROSPY = """
import rospy
from geometry_msgs.msg import Twist
rospy.init_node("robot")
rospy.Subscriber("/cmd_vel", Twist, lambda m: print("speed", m.linear.x, flush=True))
print("ready", flush=True)
rospy.spin()
"""


class RospyRobot:
    """A robot of rospy; keeps the speeds that it receives."""

    def __init__(self, master: RosMaster) -> None:
        self.speeds: list[float] = []
        self.process = subprocess.Popen(
            ["/usr/bin/python3", "-c", ROSPY],
            env=master.env(),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self.ready = threading.Event()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        assert self.ready.wait(30)

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith("ready"):
                self.ready.set()
            elif line.startswith("speed "):
                self.speeds.append(float(line.split()[1]))

    def end(self, number: int) -> None:
        self.process.send_signal(number)
        self.process.wait(30)
        self._reader.join(10)


@pytest.mark.skipif(not QT6, reason="the wire, not Qt, is what matters")
@pytest.mark.parametrize("way", ["killed", "shut down", "replaced"])
def test_robot_that_restarts_waits_until_the_hand_lets_go(
    way: str, screen: str, tmp_path: Path
) -> None:
    with RosMaster(tmp_path / "ros") as master, stays_connected(screen):
        robots = [RospyRobot(master)]
        program = Screen(master.url, screen, tmp_path)
        try:
            program.reset()
            drag(program)
            eventually(lambda: robots[0].speeds and robots[0].speeds[-1] > 0, lambda: program.text)
            if way == "replaced":
                # The master ends a node when another one has its name.
                robots.append(RospyRobot(master))
                robots[0].process.wait(30)
            else:
                robots[0].end(signal.SIGKILL if way == "killed" else signal.SIGTERM)
                robots.append(RospyRobot(master))
            new = robots[1]
            eventually(lambda: new.speeds[-3:] == [0.0] * 3, lambda: (program.text, new.speeds))
            nothing_happens(2.0)
            assert new.speeds[-1] == 0
            assert way == "replaced" or not any(new.speeds), "it is still held"
            program.x11("mouseup", 1)
            nothing_happens(0.2)
            drag(program)
            eventually(lambda: new.speeds[-1] > 0, lambda: program.text)
            program.x11("mouseup", 1)
            eventually(lambda: new.speeds[-3:] == [0.0] * 3)
        finally:
            program.close()
            for robot in robots:
                robot.end(signal.SIGKILL)

"""Every way to let go of a robot: zeros at once, and then nothing; with real windows and input."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Any

import pytest
from ports import free_port
from relay import Relay
from waiting import eventually, nothing_happens

import rosglass
from letting_go import WAYS, Robot, Screen, drag, let_go, stays_connected
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


@pytest.mark.skipif(not QT6, reason="the wire, not Qt, is what matters")
@pytest.mark.parametrize("outage_s", [0.5, 3.0])
def test_letting_go_during_an_outage(outage_s: float, screen: str, tmp_path: Path) -> None:
    """The link stalls, and delivers later what was sent: the last of it is a zero."""
    port = free_port()
    with Router(f"tcp/127.0.0.1:{port}") as router, Relay(port) as relay, stays_connected(screen):
        node = rosglass.connect(router.url, "robot")
        robot = Robot(node)
        program = Screen(f"zenoh://127.0.0.1:{relay.port}?mode=client", screen, tmp_path)
        try:
            program.reset()
            drag(program)
            eventually(lambda: robot.moves)
            relay.stall()
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
        finally:
            relay.resume()
            program.close()
            node.close()

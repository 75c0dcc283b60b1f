"""The cockpit behind a link that stalls, and delivers later what was sent: what the robot does."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

import pytest
from demo_driver import CockpitProcess
from ports import free_port
from relay import Relay
from waiting import eventually, nothing_happens

pytest.importorskip("cv2", reason="the simulated robot and the cockpit need the extra `cockpit`")

import rosglass
from rosglass.demo.processes import VirtualScreen, start_robot
from rosglass.qt import QT6
from rosglass.wires.zenoh.router import Router

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = [
    pytest.mark.xvfb,
    pytest.mark.skipif(not QT6, reason="the demo's cockpit needs Qt 6"),
]


class Side:
    """The robot, and another operator beside it, whose link does not stall."""

    def __init__(self, url: str) -> None:
        self._robot = start_robot(url)
        self.node = rosglass.connect(url, "another_operator")
        self.states: list[bool] = []
        #: The received commands: speed, and when.
        self.commands: list[tuple[float, float]] = []
        self._lock = threading.Lock()
        self.node.create_subscription(
            "/emergency_stop/state", "std_msgs/msg/Bool", lambda m: self.states.append(m.data)
        )
        self.node.create_subscription(
            "/cmd_vel",
            "geometry_msgs/msg/Twist",
            lambda m: self.commands.append((m.linear.x, time.monotonic())),
            1000,
        )
        self._stop = self.node.create_publisher("/emergency_stop", "std_msgs/msg/Bool")
        eventually(self._stop.subscription_count)

    def stop(self) -> None:
        self._stop.publish(data=True)

    def close(self) -> None:
        self.node.close()
        self._robot.close()


@pytest.fixture(scope="module")
def setup() -> Iterator[tuple[Side, Relay, CockpitProcess]]:
    port = free_port()
    with Router(f"tcp/127.0.0.1:{port}") as router, Relay(port) as relay:
        side = Side(router.url)
        with VirtualScreen(1024, 700) as screen:
            process = CockpitProcess(f"zenoh://127.0.0.1:{relay.port}?mode=client", screen.display)
            yield side, relay, process
            relay.resume()
            process.close()
        side.close()


def test_a_release_that_comes_late_does_not_undo_another_operators_stop(setup: Any) -> None:
    side, relay, cockpit = setup
    cockpit.until("camera", "live", timeout=30)
    cockpit.until("stop", "known", timeout=30)
    cockpit.call("stop", "press")
    cockpit.until("stop", "stopped")
    relay.stall()
    time.sleep(0.3)
    cockpit.call("stop", "release")
    side.stop()
    time.sleep(1.0)
    side.states.clear()
    relay.resume()
    cockpit.until("camera", "live", timeout=60)
    cockpit.until("stop", "known", timeout=60)
    nothing_happens(1.0)
    assert side.states
    assert all(side.states), "the other operator's stop stays latched"
    cockpit.call("stop", "release")
    eventually(lambda: not side.states[-1])


@pytest.mark.parametrize("noticed", [False, True])
def test_an_outage_while_driving_ends_with_a_stop(setup: Any, noticed: bool) -> None:
    side, relay, cockpit = setup
    cockpit.until("camera", "live", timeout=60)
    cockpit.until("drive", "obstacle", "", timeout=60)
    cockpit.key("press", "Key_W")
    eventually(lambda: len(side.commands) > 10)
    relay.stall()
    if noticed:
        cockpit.until("camera", "live", False)
    cockpit.key("release", "Key_W")
    time.sleep(2.0)
    back = time.monotonic()
    side.commands.clear()
    relay.resume()
    eventually(lambda: side.commands and side.commands[-1][0] == 0.0)
    nothing_happens(1.0)
    moving = [at for speed, at in side.commands if speed]
    assert len(moving) < 15, "what was sent before the outage was noticed; 20 a second"
    assert all(at - back < 5.0 for at in moving)
    assert side.commands[-1][0] == 0.0, "the stop is repeated until the robot is back"

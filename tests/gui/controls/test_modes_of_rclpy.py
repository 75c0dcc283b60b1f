"""ModeSwitch, EmergencyStop and WhoSteers on real ROS 2 nodes."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[3]


@pytest.fixture
def robot(ros_domains: list[int]) -> Any:
    """A program of rclpy, see ``rclpy_lifecycle.py``."""
    python = ROOT / ".venv-rclpy/bin/python"
    if not python.exists():
        pytest.skip("rclpy is not installed: scripts/setup.sh test")
    script = Path(__file__).with_name("rclpy_lifecycle.py")
    environment = os.environ | {"ROS_DOMAIN_ID": str(ros_domains[0])}
    process = subprocess.Popen([python, script], env=environment, stdin=subprocess.PIPE, text=True)
    yield process
    process.kill()
    process.communicate()


@pytest.mark.parametrize("url", ["dds"], indirect=True, scope="module")
def test_lifecycle_stop_and_publishers_of_rclpy(live_controls: Any, robot: Any, wait: Any) -> None:
    live_controls.show(
        """Column {
            ModeSwitch { objectName: "modes"; nodeName: "/lidar"; width: 400; timeout: 10000 }
            EmergencyStop { objectName: "stop"; service: "/halt" }
            WhoSteers { objectName: "who"; width: 400 }
        }""",
        500,
        500,
    )
    modes, stop, who = map(live_controls.find, ("modes", "stop", "who"))
    wait(lambda: modes.property("note") == "unconfigured")
    modes.request("active")
    wait(lambda: modes.property("refusal") == "refused: /lidar did not become active")
    wait(lambda: modes.property("note") == "inactive", "what the node confirms")
    modes.request("active")
    wait(lambda: modes.property("note") == "active" and not modes.property("pending"))
    stop.press()
    wait(lambda: stop.property("stopped"))

    def findings() -> list[str]:
        return [one["text"] for one in who.property("findings").toVariant()]

    wait(lambda: "/navigation also publishes /cmd_vel" in findings(), findings)
    robot.kill()
    wait(lambda: not stop.property("known"))
    wait(lambda: modes.property("stale"))

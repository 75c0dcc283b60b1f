"""ModeSwitch, EmergencyStop and WhoSteers on real ROS 2 nodes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def robot(start_rclpy_at: Any, ros_domains: list[int]) -> Any:
    return start_rclpy_at(ros_domains[0], Path(__file__).with_name("rclpy_lifecycle.py"))


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

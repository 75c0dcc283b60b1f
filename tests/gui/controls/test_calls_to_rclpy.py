"""ServiceButton, ActionPanel and ParameterForm on a real ROS 2 node."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def robot(start_rclpy_at: Any, ros_domains: list[int]) -> Any:
    return start_rclpy_at(ros_domains[0], Path(__file__).with_name("rclpy_robot.py"))


@pytest.mark.parametrize("url", ["dds"], indirect=True, scope="module")
def test_controls_on_a_node_of_rclpy(live_controls: Any, robot: Any, wait: Any) -> None:
    live_controls.show(
        """Column {
            ServiceButton { objectName: "lamp"; service: "/lamp"; request: ({data: true}) }
            ServiceButton { objectName: "silent"; service: "/silent"; timeout: 500 }
            ActionPanel { objectName: "count"; action: "/count"; goal: ({order: 3}); width: 300 }
            ParameterForm { objectName: "form"; nodeName: "/arm"; width: 400; height: 300 }
        }""",
        500,
        700,
    )
    lamp, silent, count, form = map(live_controls.find, ("lamp", "silent", "count", "form"))
    wait(lambda: lamp.property("ready") and silent.property("ready"))
    lamp.call()
    silent.call()
    wait(lambda: lamp.property("status") == "done: <b>as you say</b>")
    wait(lambda: "no answer within 0.5 s" in silent.property("status"))
    wait(lambda: "test_msgs/action/Fibonacci, which cannot be used" in count.property("status"))
    assert not count.property("ready")

    wait(lambda: form.property("ready"))
    speed, mode = (live_controls.find(f"row_{name}") for name in ("speed", "mode"))
    wait(lambda: speed.property("value") == 0.5)
    assert [speed.property(name) for name in ("low", "high", "step")] == [0, 2, 0.25]
    assert live_controls.find("editor", mode).property("count") == 2
    assert live_controls.find("row_serial").property("locked")
    form.setValue("speed", 1)
    wait(lambda: speed.property("value") == 1 and form.property("undoText") == "speed: 0.5")
    form.setValue("speed", 2)
    wait(lambda: "too fast" in speed.property("problem"))
    assert speed.property("value") == 1
    form.undo()
    wait(lambda: speed.property("value") == 0.5)

    robot.kill()
    wait(lambda: not form.property("ready") and not lamp.property("ready"))
    assert form.property("stale")
    assert lamp.property("status").startswith("NOT AVAILABLE")

"""Empty messages, constants and documentation, in both modules."""

from __future__ import annotations

import logging
from typing import Any

import pytest
from values import caught


@pytest.mark.both_qt
def test_empty_messages_have_every_field(bench: Any) -> None:
    script = """const m = Ros2.createEmptyMessage('geometry_msgs/TransformStamped');
        return [m, m['#messageType'], m.header.stamp.isZero()]"""
    message, name, zero = bench.run(script)
    assert message["transform"]["rotation"] == {"x": 0, "y": 0, "z": 0, "w": 1}
    assert (name, zero) == ("geometry_msgs/msg/TransformStamped", True)


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("module", "call", "expected"),
    [
        ("Ros2", "createEmptyServiceRequest('std_srvs/srv/SetBool')", {"data": False}),
        ("Ros2", "createEmptyServiceRequest('std_srvs/SetBool')", {"data": False}),
        ("Ros2", "createEmptyActionGoal('example_interfaces/action/Fibonacci')", {"order": 0}),
        ("Ros", "createEmptyServiceRequest('std_srvs/SetBool')", {"data": False}),
        ("Ros", "createEmptyActionGoal('actionlib_tutorials/FibonacciAction')", {"order": 0}),
        (
            "Ros",
            "createEmptyMessage('std_msgs/Header')",
            {"seq": 0, "stamp": {"sec": 0, "nsec": 0}, "frame_id": ""},
        ),
        # Known to ROS 2 only.
        ("Ros", "createEmptyMessage('example_interfaces/Bool')", {"data": False}),
    ],
)
def test_empty_values(bench: Any, module: str, call: str, expected: dict) -> None:
    bench.module = f"{module} 1.0"
    assert bench.run(f"return {module}.{call}") == expected


@pytest.mark.parametrize(
    "call",
    [
        "createEmptyMessage('nope/msg/X')",
        "createEmptyMessage('std_srvs/srv/SetBool')",
        "createEmptyMessage('')",
        "createEmptyServiceRequest('std_msgs/msg/Bool')",
        "createEmptyActionGoal('std_srvs/srv/SetBool')",
    ],
)
def test_unknown_types_give_undefined_and_a_warning(bench: Any, caplog: Any, call: str) -> None:
    assert bench.run(f"return Ros2.{call} === undefined") is True
    found = [r for r in caplog.records if r.levelno == logging.WARNING]
    assert [
        r.getMessage().startswith(f"Ros2.{call.split('(', maxsplit=1)[0]}: ") for r in found
    ] == [True]


@pytest.mark.both_qt
def test_constants(bench: Any) -> None:
    script = "return Ros2.constants('action_msgs/msg/GoalStatus').STATUS_EXECUTING"
    assert bench.run(script) == 2
    assert bench.run("return Ros2.constants('std_msgs/msg/Empty')") == {}
    shown = bench.run("return Object.keys(Ros2.constants('std_srvs/srv/SetBool'))")
    assert shown == ["request", "response"]
    bench.module = "Ros 1.0"
    assert bench.run("return Ros.constants('actionlib_msgs/GoalStatus').SUCCEEDED") == 3


def test_documentation(bench: Any) -> None:
    shown = bench.run("return Ros2.documentation('sensor_msgs/msg/BatteryState')")
    assert shown["type"] == "sensor_msgs/msg/BatteryState"
    assert shown["fields"]["voltage"]["type"] == "float32"
    assert shown["fields"]["voltage"]["unit"] == "V"
    assert "discharging" in shown["fields"]["current"]["comment"]
    assert shown["constants"]["POWER_SUPPLY_STATUS_FULL"]["value"] == 4
    action = bench.run("return Ros2.documentation('example_interfaces/action/Fibonacci')")
    assert list(action) == ["goal", "result", "feedback"]
    assert list(action["goal"]["fields"]) == ["order"]


@pytest.mark.parametrize("call", ["constants('nope/msg/X')", "documentation('')"])
def test_unknown_types_throw(bench: Any, call: str) -> None:
    assert caught(bench, f"Ros2.{call}").startswith(
        f"Error: Ros2.{call.split('(', maxsplit=1)[0]}: "
    )

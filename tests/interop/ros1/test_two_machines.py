"""A robot on another machine, and the cable to it: what the robot does after an outage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rosglass.comm import ConnectionState

SCRIPT = Path(__file__).parent / "peers" / "two_machines_ros1.py"


@pytest.fixture
def outage(on_two_machines: Any, tmp_path: Path) -> Any:
    """Cut the cable; return what the operator and the robot have seen."""
    for program in ("/usr/bin/rosmaster", "/usr/lib/python3/dist-packages/rospy"):
        if not Path(program).exists():
            pytest.skip("ROS 1 is missing: sudo apt-get install python3-rosmaster python3-rospy")
    return lambda what, seconds: on_two_machines(
        SCRIPT, what, str(seconds), str(tmp_path), timeout=90
    )


def check(seen: dict[str, Any]) -> None:
    """See that all is well again."""
    assert seen["last"] == 0.0, "the robot stands"
    assert seen["stopped"] < 10, "a second is usual"
    assert seen["subscribers"] == 1, "the connection is kept: the robot would not make another"
    assert seen["fresh"] is seen["call"] is True
    assert seen["problems"] == ["", ""]


def test_driving_operator_can_stop_the_robot_after_an_outage(outage: Any) -> None:
    seen = outage("teleop", 6)
    check(seen)
    # What was sent within half a second was under way; what came after made room for the stop.
    assert seen["sent"] > 40
    assert seen["old"] < 25
    assert seen["states"][-1] == ConnectionState.CONNECTED.name
    assert ConnectionState.LOST.name in seen["states"]


def test_commands_of_an_outage_are_dropped_and_a_repeated_stop_arrives(outage: Any) -> None:
    seen = outage("command", 6)
    check(seen)
    assert seen["old"] < 10, "2 where nothing else runs: those of the first 0.1 s"
    assert seen["dropped"] > seen["sent"] - 10


def test_the_first_word_after_a_silent_outage_stops_the_robot(outage: Any) -> None:
    seen = outage("idle", 5)
    check(seen)
    assert seen["old"] == 0

"""Two robots of one name are reported by every observer, as only the name identifies them."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

import rosglass

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.comm import Node

COMMAND = (sys.executable, "-m", "rosglass")
pytestmark = pytest.mark.parametrize("url", ["zenoh", "dds"], indirect=True)


@pytest.fixture
def url(request: pytest.FixtureRequest) -> str:
    if request.param == "zenoh":
        return str(request.getfixturevalue("router").url)
    pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
    return f"dds://?domain={request.getfixturevalue('dds_domain')}"


@pytest.fixture
def join(url: str) -> Iterator[Callable[[str], Node]]:
    nodes: list[Node] = []

    def join(name: str) -> Node:
        nodes.append(rosglass.connect(url, name))
        return nodes[-1]

    yield join
    for node in nodes:
        node.close()


def test_the_graph_counts_nodes_of_one_name(join: Callable[[str], Node]) -> None:
    me, robot, twin = join("me"), join("robot"), join("robot")
    eventually(lambda: me.duplicate_nodes() == {"/robot": 2})
    assert [str(node) for node in me.nodes()].count("/robot") == 1
    eventually(lambda: robot.duplicate_nodes() == {"/robot": 2})
    twin.close()
    eventually(lambda: me.duplicate_nodes() == {})


def test_commands_warn(url: str, join: Callable[[str], Node], run_command: Any) -> None:
    join("robot"), join("robot")
    code, names, warning = run_command("node", "list", "--url", url)
    assert (code, names) == (0, "/robot\n")
    assert "2 nodes are called /robot" in warning
    _, found, _ = run_command("doctor", "--url", url)
    assert "warning" in found
    assert "2 nodes are called /robot" in found
    assert "namespace" in found


def test_a_second_robot_leaves_and_says_why(url: str) -> None:
    environment = os.environ | {"PYTHONUNBUFFERED": "1"}
    first = subprocess.Popen(
        [*COMMAND, "robot", "--url", url, "--fps", "5", "--leash"],
        env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        with rosglass.connect(url, "me") as me:
            eventually(lambda: me.publishers("/odom"))
            # By then, the first is here to stay.
            came: list[float] = []
            me.create_subscription(
                "/odom", "nav_msgs/msg/Odometry", lambda _: came.append(time.monotonic())
            )
            eventually(lambda: came and came[-1] - came[0] > 6, timeout=60)
            second = subprocess.run(
                [*COMMAND, "robot", "--url", url, "--fps", "5"],
                env=environment, capture_output=True, text=True, timeout=90, check=False,
            )  # fmt: skip
            assert second.returncode == 3, second.stderr
            assert "a robot called /robot is on" in second.stderr
            assert "rosglass demo --no-robot" in second.stderr
            eventually(lambda: me.duplicate_nodes() == {})
            assert first.poll() is None
    finally:
        first.kill()
        first.communicate()


def test_one_of_two_robots_that_start_together_stays(url: str) -> None:
    robots = [
        subprocess.Popen(
            [*COMMAND, "robot", "--url", url, "--fps", "5", "--leash"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )
        for _ in range(2)
    ]  # fmt: skip
    try:
        eventually(lambda: any(robot.poll() is not None for robot in robots), timeout=60)
        with rosglass.connect(url, "me") as me:
            came: list[float] = []
            me.create_subscription(
                "/odom", "nav_msgs/msg/Odometry", lambda _: came.append(time.monotonic())
            )
            # Longer than either watches for the other.
            eventually(lambda: came and came[-1] - came[0] > 9, timeout=60)
        assert sorted(robot.poll() or 0 for robot in robots) == [0, 3]
    finally:
        for robot in robots:
            robot.kill()
            robot.communicate()

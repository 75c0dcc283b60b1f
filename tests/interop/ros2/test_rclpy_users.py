"""Calls and commands of users who know rclpy, against rclpy itself."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.comm import Node
from rosglass.comm.rclpy_names import MEMBERS

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable

pytestmark = pytest.mark.peers

#: Members of rclpy's Node that nothing stands for here: its executors, wait sets and C objects.
NOT_HERE = {
    "PARAM_REL_TOL", "add_pre_set_parameters_callback", "add_waitable", "clients", "context",
    "create_guard_condition", "default_callback_group", "destroy_guard_condition", "destroy_rate",
    "get_node_names_and_namespaces_with_enclaves", "get_parameter_type", "get_parameter_types",
    "get_parameters_by_prefix", "guards", "handle", "remove_on_set_parameters_callback",
    "remove_post_set_parameters_callback", "remove_pre_set_parameters_callback",
    "remove_waitable", "set_descriptor", "timers", "waitables",
}  # fmt: skip


@pytest.fixture
def robot(start_rclpy: Callable[..., subprocess.Popen[str]]) -> tuple[Any, list[str]]:
    """The peer, and the members of rclpy's Node."""
    peer = start_rclpy("rclpy_users")
    return peer, json.loads(peer.stdout.readline())


def test_every_member_of_rclpy_is_here_or_named(robot: Any) -> None:
    unknown = {
        name
        for name in robot[1]
        if not hasattr(Node, name) and name not in MEMBERS["Node"] and name not in NOT_HERE
    }
    assert unknown == set()


@pytest.mark.parametrize(
    ("name", "text", "value", "message"),
    [
        ("gain", "5", 5.0, "gain is declared otherwise: it is set to 5.0"),
        ("gain", "2.5", 2.5, ""),
        ("gains", "[1, 2]", [1.0, 2.0], "gains is declared otherwise: it is set to [1.0, 2.0]"),
        ("label", "5", "5", "label is declared otherwise: it is set to '5'"),
        ("label", "yes", "yes", "label is declared otherwise: it is set to 'yes'"),
        ("any", "5", 5, ""),
        ("count", "7", 7, ""),
    ],
)
def test_values_are_set_as_the_parameter_is_declared(
    robot: Any, run_command: Any, dds_domain: int, name: str, text: str, value: Any, message: str
) -> None:
    url = f"dds://?domain={dds_domain}"
    code, _, err = run_command("param", "set", "/robot", name, text, "--url", url)
    assert code == 0, err
    heard = json.loads(robot[0].stdout.readline())
    assert heard == [name, value]
    assert type(heard[1]) is type(value)
    assert message in err
    assert ("declared otherwise" in err) == bool(message)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("gain", "9007199254740993", "is not a double: the nearest one is 9007199254740992.0"),
        ("gain", "fast", "refuses to set gain"),
        ("count", "5.5", "refuses to set count"),
    ],
)
def test_values_that_do_not_fit_are_refused(
    robot: Any, run_command: Any, dds_domain: int, name: str, text: str, message: str
) -> None:
    url = f"dds://?domain={dds_domain}"
    code, _, err = run_command("param", "set", "/robot", name, text, "--url", url)
    assert code == 1
    assert message in err

"""``rosglass lifecycle`` with lifecycle nodes of rclpy."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable


@pytest.fixture
def run(dds_domain: int) -> Callable[..., tuple[int, str, str]]:
    """Run ``rosglass lifecycle``; return its exit code, output and errors."""
    pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')

    def run(*arguments: str) -> tuple[int, str, str]:
        url = f"dds://?domain={dds_domain}&range=localhost"
        command = [sys.executable, "-W", "ignore", "-m", "rosglass", "lifecycle", *arguments]
        done = subprocess.run(
            [*command, "--url", url],
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
            env={**os.environ, "NO_COLOR": "1"},
        )
        return done.returncode, done.stdout, done.stderr

    return run


@pytest.fixture
def camera(start_rclpy: Callable[..., Any]) -> Any:
    peer = start_rclpy("rclpy_lifecycle", "camera")
    assert peer.stdout.readline() == "ready\n"
    return peer


def test_a_node_is_taken_through_its_states(
    camera: Any, run: Callable[..., tuple[int, str, str]]
) -> None:
    assert run("nodes")[:2] == (0, "/camera\n")
    assert run("nodes", "--count")[:2] == (0, "1\n")
    assert run("get", "/camera")[:2] == (0, "unconfigured [1]\n")
    assert run("get")[:2] == (0, "/camera: unconfigured [1]\n")
    code, out, _ = run("list", "camera")
    assert code == 0
    assert out.startswith(
        "- configure [1]\n\tStart: unconfigured [1]\n\tGoal: configuring [10]\n- shutdown [5]\n"
    )
    assert len(run("list", "/camera", "-a")[1].splitlines()) > len(out.splitlines())

    code, out, error = run("set", "/camera", "activate")
    assert (code, out) == (1, "")
    assert "cannot 'activate' now: it is unconfigured [1]; possible are: configure [1]" in error
    assert run("set", "/camera", "configure")[:2] == (
        0,
        "Transitioning successful: /camera is inactive [2]\n",
    )
    code, out, error = run("set", "/camera", "3")
    assert (code, out) == (1, "")
    assert "/camera failed to activate, and is inactive [2] now" in error
    code, out, _ = run("set", "/camera", "activate", "--json")
    assert (code, json.loads(out)) == (0, {"id": 3, "label": "active"})
    assert json.loads(run("get", "--json")[1]) == {"/camera": {"id": 3, "label": "active"}}
    assert "deactivate" in [one["label"] for one in json.loads(run("list", "/camera", "--json")[1])]
    assert run("set", "/camera", "shutdown")[:2] == (
        0,
        "Transitioning successful: /camera is finalized [4]\n",
    )


def test_other_nodes_are_named(camera: Any, run: Callable[..., tuple[int, str, str]]) -> None:
    code, out, error = run("get", "/camra", "--timeout", "5")
    assert (code, out) == (1, "")
    assert "/camra is not a lifecycle node here; lifecycle nodes are: /camera" in error

"""``rosglass node ping``, ``kill`` and ``cleanup``, and what ``topic info`` cannot know."""

from __future__ import annotations

import io
import json
from typing import Any

import pytest
from waiting import eventually


@pytest.fixture(scope="module")
def robot(start_rospy) -> Any:
    """A rospy node that publishes."""
    peer = start_rospy("robot")
    peer.call("publish", topic="/word", type="std_msgs/String")
    return peer


@pytest.fixture
def run(robot: Any, master: Any, monkeypatch: pytest.MonkeyPatch, run_command: Any) -> Any:
    """Run a command that looks at the robot."""
    monkeypatch.setenv("ROSGLASS_URL", master.url)
    return run_command


def test_topic_info_says_what_it_cannot_know(run, master, connect, free_port):
    connect("listener").create_subscription("/never")
    eventually(lambda: ["/never", ["/listener"]] in master.call("getSystemState")[1])
    code, out, _ = run("topic", "info", "/never")
    assert (code, out.splitlines()[0]) == (0, "/never [unknown (no publisher)]")
    assert "/never [unknown]" in run("topic", "list", "-t")[1].splitlines()
    gone = f"http://127.0.0.1:{free_port}/"
    master.call("registerPublisher", "/stale", "std_msgs/String", gone, caller="/dead")
    code, out, _ = run("topic", "info", "/stale")
    assert "    does not answer: its md5 sum, and whether it latches, is not known" in out
    master.call("unregisterPublisher", "/stale", gone, caller="/dead")


def test_ping(run):
    code, out, err = run("node", "ping", "robot", "-c", "1")
    assert (code, err) == (0, "")
    first, last = out.splitlines()
    assert first.startswith("/robot answers at http://127.0.0.1:")
    assert first.endswith(" ms")
    assert last.startswith("1 of 1 answered, ")
    code, out, _ = run("node", "ping", "/robot", "-c", "2", "--json")
    assert [json.loads(line)["problem"] for line in out.splitlines()] == ["", ""]
    code, _, err = run("node", "ping", "/robbot")
    assert code == 1
    assert "there is no node /robbot on http://127.0.0.1:" in err
    assert "did you mean /robot?" in err


def test_pinging_what_does_not_answer(run, master, free_port):
    gone = f"http://127.0.0.1:{free_port}/"
    master.call("registerPublisher", "/stale", "std_msgs/String", gone, caller="/dead")
    code, out, err = run("node", "ping", "/dead", "-c", "1")
    assert (code, out) == (1, "")
    assert f"/dead: {gone} does not answer: Connection refused" in err
    code, _, err = run("node", "kill", "/dead")
    assert code == 1
    assert "Connection refused; if it runs no more, rosglass node cleanup removes it" in err
    master.call("unregisterPublisher", "/stale", gone, caller="/dead")


def test_kill(run, start_rospy, connect):
    start_rospy("victim").call("publish", topic="/left", type="std_msgs/Empty")
    ours = connect("ours")
    ours.create_publisher("/ours/left", "std_msgs/Empty")
    eventually(lambda: "/ours/left" in ours.topics() and "/left" in ours.topics())
    code, out, err = run("node", "kill", "/victim", "ours")
    assert (code, out, err) == (0, "/victim has ended\n/ours has ended\n", "")
    eventually(lambda: ours.status().state.value == "closed")
    code, out, err = run("node", "kill", "/victim", "--json")
    assert (code, json.loads(out)) == (1, {"killed": [], "failed": ["/victim"]})
    assert "there is no node /victim" in err


def test_cleanup(run, master, monkeypatch, free_port):
    api, service = f"http://127.0.0.1:{free_port}/", f"rosrpc://127.0.0.1:{free_port}"

    def leave_behind():
        master.call("registerPublisher", "/dead/a", "std_msgs/String", api, caller="/dead")
        master.call("registerSubscriber", "/dead/b", "std_msgs/String", api, caller="/dead")
        master.call("registerService", "/dead/c", service, api, caller="/dead")

    def listed():
        return any("/dead" in nodes for part in master.call("getSystemState") for _, nodes in part)

    leave_behind()
    for said in ("no\n", ""):
        monkeypatch.setattr("sys.stdin", io.StringIO(said))
        code, out, err = run("node", "cleanup")
        assert (code, listed()) == (1, True)
        assert out.startswith(f"/dead: {api} does not answer")
        assert "/robot" not in out
        assert "nothing was changed" in err
    unchanged = {"unreachable": ["/dead"], "removed": []}
    assert json.loads(run("node", "cleanup", "--json")[1]) == unchanged
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    code, out, _ = run("node", "cleanup")
    assert (code, out.splitlines()[-1]) == (0, f"{master.uri} has forgotten /dead")
    assert not listed()
    leave_behind()
    code, out, _ = run("node", "cleanup", "--yes", "--json")
    assert (code, json.loads(out)["removed"], listed()) == (0, ["/dead"], False)
    code, _, err = run("node", "cleanup")
    assert (code, "all nodes can be reached" in err) == (0, True)


@pytest.mark.parametrize("what", [["ping", "/a"], ["kill", "/a"], ["cleanup"]])
def test_ros_1_commands_are_refused_for_ros_2(run, what):
    code, _, err = run("node", *what, "--url", "dds://?domain=7")
    assert (code, err.count("\n")) == (1, 1)
    assert f"rosglass node {what[0]} is for ROS 1: say --url ros1://robot:11311" in err

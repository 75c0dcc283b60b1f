"""Programs over DDS that never say which nodes they have: commands wait no longer than a limit."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.peers

LIMIT_S = 3.0
#: A participant of Cyclone DDS with a writer and no ros_discovery_info, until its input ends.
PEER = """
import sys
from dataclasses import dataclass
from cyclonedds.core import Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.topic import Topic

@dataclass
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str

participant = DomainParticipant(int(sys.argv[1]), Qos(Policy.Userdata(sys.argv[2].encode())))
writer = DataWriter(participant, Topic(participant, "rt/word", String))
print('{"ready": true}', flush=True)
sys.stdin.read()
"""
NOTE = "1 program has not named its nodes yet; there may be more than is shown"


@pytest.fixture
def run(run_command: Any, dds_connect: Any, dds_domain: int) -> Callable[..., Any]:
    """Run a command where a rosglass node is, too; returns what it printed, and its seconds."""
    dds_connect("robot")

    def run(*arguments: str) -> tuple[int, str, str, float]:
        began = time.monotonic()
        found = run_command(*arguments, "--url", f"dds://?domain={dds_domain}")
        return *found, time.monotonic() - began

    return run


@pytest.fixture
def start_peer(start: Any, dds_domain: int) -> Any:
    """Start a participant with this user data; ended after the test."""
    started = []

    def start_peer(user_data: str) -> None:
        started.append(start("-c", PEER, str(dds_domain), user_data))
        started[-1].event("ready")

    yield start_peer
    for process in started:
        process.end()


def test_commands_wait_for_its_nodes_up_to_the_limit_and_say_so(
    run: Any, start_peer: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosglass.cli.connecting._INTRODUCTION_S", {"dds": LIMIT_S}, raising=False)
    start_peer("enclave=/;")  # as every participant of ROS 2
    for command, shown in ((("node", "list"), "/robot"), (("topic", "list"), "/word")):
        code, out, err, seconds = run(*command)
        assert code == 0, err
        assert shown in out.splitlines()
        assert NOTE in err
        assert seconds >= LIMIT_S


def test_a_program_that_is_not_of_ros_is_not_waited_for(run: Any, start_peer: Any) -> None:
    start_peer("")
    code, out, err, _ = run("topic", "list")
    assert code == 0, err
    assert "/word" in out.splitlines()
    assert NOTE not in err

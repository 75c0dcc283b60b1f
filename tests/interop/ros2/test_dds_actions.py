"""Actions over DDS with dora-rs, which speaks another implementation of DDS (RustDDS)."""

from __future__ import annotations

import importlib.util
import json
import os
from pathlib import Path

import pytest
from waiting import eventually

from rosglass.comm import GoalStatus

PEERS = Path(__file__).parent / "peers"
FIBONACCI = "example_interfaces/action/Fibonacci"

pytestmark = [
    pytest.mark.peers,
    pytest.mark.skipif(importlib.util.find_spec("dora") is None, reason="dora-rs is not installed"),
]


@pytest.fixture
def run_dora(start, dds_domain, service_interfaces):
    def run_dora(**plan):
        plan |= {"domain": dds_domain, "interfaces": str(service_interfaces), "profile": "dds"}
        env = os.environ | {
            "ROS_DOMAIN_ID": str(dds_domain),
            "AMENT_PREFIX_PATH": str(service_interfaces),
        }
        process = start(str(PEERS / "dora_services_peer.py"), json.dumps(plan), env=env)
        process.event("ready")
        return process

    return run_dora


def test_we_send_goals_to_dora(dds_connect, run_dora):
    node = dds_connect("cockpit")
    process = run_dora(do="serve action")
    client = node.create_action_client("/count", FIBONACCI)
    assert client.wait_for_server(30), client.problem
    feedback = []
    goal = client.send_goal({"order": 5}, on_feedback=lambda m: feedback.append(len(m.sequence)))
    status, result = goal.result(30)
    assert status is GoalStatus.SUCCEEDED
    assert list(result.sequence) == [0, 1, 2, 3, 4]
    assert feedback == [2, 3, 4, 5]
    goal = client.send_goal({"order": 100})
    goal.cancel()
    status, result = goal.result(30)
    assert status is GoalStatus.CANCELED
    assert 0 < len(result.sequence) < 100
    assert [process.event("status") for _ in range(2)] == ["succeeded", "canceled"]
    process.end()


def test_dora_sends_us_goals(dds_connect, run_dora):
    node = dds_connect("robot")
    ended = []

    def count(goal):
        sequence = [0]
        while len(sequence) < goal.goal.order and not goal.wait_for_cancel(0.05):
            sequence.append(len(sequence))
            goal.publish_feedback(sequence=sequence)
        ended.append((goal.is_cancel_requested, len(sequence)))
        return {"sequence": sequence}

    node.create_action_server("/count", FIBONACCI, count, accept=lambda goal: goal.order < 1000)
    process = run_dora(do="send goals", goals=[[5, False], [5000, False], [100, True]])
    assert process.event("status") == "succeeded"
    assert process.event("rejected") == 5000
    assert process.event("cancelled") == 0
    eventually(lambda: len(ended) == 2)
    assert ended[0] == (False, 5)
    assert ended[1][0]
    assert ended[1][1] < 100
    process.end()

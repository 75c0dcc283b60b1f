"""Actions with dora-rs, both ways: over Zenoh, and over DDS by another implementation (RustDDS)."""

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
    pytest.mark.parametrize("profile", ["humble", "rep2016", "dds"]),
]


@pytest.fixture
def node(profile, request):
    """Our node: over DDS, or in a domain of its own over Zenoh."""
    if profile == "dds":
        return request.getfixturevalue("dds_connect")("cockpit")
    return request.getfixturevalue("connect")("cockpit", "?domain=11")


@pytest.fixture
def run_dora(profile, start, router, dds_domain, service_interfaces):
    """Start dora, which follows a plan in our node's domain."""

    def run_dora(**plan):
        plan |= {
            "port": int(router.listen.rpartition(":")[2]),
            "domain": dds_domain if profile == "dds" else 11,
            "interfaces": str(service_interfaces),
            "profile": profile,
        }
        # dora takes the domain of its data keys and its type descriptions from here only.
        env = os.environ | {
            "ROS_DOMAIN_ID": str(plan["domain"]),
            "AMENT_PREFIX_PATH": str(service_interfaces),
        }
        process = start(str(PEERS / "dora_services_peer.py"), json.dumps(plan), env=env)
        process.event("ready")
        return process

    return run_dora


def test_we_send_goals_to_dora(node, run_dora):
    process = run_dora(do="serve action")
    client = node.create_action_client("/count")
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


def test_dora_sends_us_goals(node, run_dora):
    ended = []

    def count(goal):
        sequence = [0]
        while len(sequence) < goal.goal.order and not goal.wait_for_cancel(0.05):
            sequence.append(len(sequence))
            goal.publish_feedback(sequence=sequence)
        ended.append((goal.is_cancel_requested, len(sequence)))
        return {"sequence": sequence}

    accept = {"accept": lambda goal: goal.order < 1000}
    server = node.create_action_server("/count", FIBONACCI, count, **accept)
    process = run_dora(do="send goals", goals=[[5, False], [5000, False], [100, True]])
    services = [f"/count/_action/{name}" for name in ("send_goal", "cancel_goal", "get_result")]
    feedback = "/count/_action/feedback"
    eventually(
        lambda: all(map(node.service_clients, services)) and node.subscriptions(feedback),
        "dora's clients and subscription",
        timeout=60,
    )
    process.ask(go=True)
    assert process.event("status") == "succeeded"
    assert process.event("rejected") == 5000
    assert process.event("cancelled") == 0
    eventually(lambda: len(ended) == 2)
    assert ended[0] == (False, 5)
    assert ended[1][0]
    assert ended[1][1] < 100
    server.close()
    process.end()

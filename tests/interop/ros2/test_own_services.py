"""Services and actions between our own processes, over every middleware."""

from __future__ import annotations

import importlib.util
import json
import os
import random
import signal
import time
from pathlib import Path

import pytest
from waiting import eventually, nothing_happens

import rosglass
from rosglass.comm import GoalStatus
from rosglass.wires.zenoh.router import Router

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[2] / "examples"
ADD, TRIGGER = "example_interfaces/srv/AddTwoInts", "std_srvs/srv/Trigger"
TEXT = "std_msgs/msg/String"
FIBONACCI = "example_interfaces/action/Fibonacci"
#: A killed participant of DDS is gone after its lease, which is 10 s without this.
SHORT_LEASE = (
    "<CycloneDDS><Domain><Discovery><LeaseDuration>1s</LeaseDuration></Discovery></Domain>"
    "</CycloneDDS>"
)
WORLDS = {"zenoh": "zenoh", "zenoh client": "zenoh", "dds": "cyclonedds"}


@pytest.fixture(scope="module", params=list(WORLDS))
def new_url(request, router, ros_domains):
    """Return URLs of one middleware, each with a domain of its own."""
    if importlib.util.find_spec(WORLDS[request.param]) is None:
        pytest.skip(f'needs pip install "rosglass[{request.param.split()[0]}]"')
    domains = random.SystemRandom().sample(ros_domains, 10)

    def new_url():
        domain = domains.pop()
        if request.param == "dds":
            return f"dds://?domain={domain}"
        mode = "client" if request.param.endswith("client") else "peer"
        return f"{router.url}?domain={domain}&mode={mode}"

    return new_url


@pytest.fixture(scope="module")
def url(new_url):
    return new_url()


@pytest.fixture(scope="module")
def run_peer(start):
    def run_peer(what, url, name="peer", **env):
        plan = {"url": url, "do": what, "name": name}
        script = str(HERE / "peers" / "services_peer.py")
        return start(script, json.dumps(plan), env=os.environ | env)

    return run_peer


@pytest.fixture(scope="module")
def server(url, run_peer):
    process = run_peer("offer", url)
    process.event("ready")
    yield process
    process.end()


@pytest.fixture
def node(url):
    with rosglass.connect(url, "cockpit") as node:
        yield node


def count(goal):
    sequence = [0]
    while len(sequence) < goal.goal.order and not goal.wait_for_cancel(0.02):
        sequence.append(len(sequence))
        goal.publish_feedback(sequence=sequence)
    return {"sequence": sequence}


def test_the_other_way_round(node, url, run_peer):
    """The other program calls before we offer anything, and is answered when we do."""
    peer = run_peer("use", url, "user")
    nothing_happens(0.3)
    node.create_service_server("/my/add", ADD, lambda request: {"sum": request.a + request.b})
    node.create_action_server("/my/count", FIBONACCI, count)
    assert peer.event("sums") == list(range(1, 21))
    assert peer.event("goal") == ["succeeded", [0, 1, 2, 3], [2, 3, 4]]
    peer.end()


def test_a_server_that_is_killed_at_work(new_url, run_peer, monkeypatch):
    """Its calls and goals end soon, with an error, and the client is ready for the next server."""
    # Usually some seconds, in which a router may be restarted.
    monkeypatch.setattr("rosglass.comm.service_client._GRACE_S", 0.5)
    monkeypatch.setattr("rosglass.ros2.action_client.GRACE_S", 0.7)
    monkeypatch.setattr("rosglass.ros2.action_client.OUTAGE_S", 0.9)
    url = new_url()
    server = run_peer("offer", url, "victim", CYCLONEDDS_URI=SHORT_LEASE)
    server.event("ready")
    with rosglass.connect(url, "cockpit") as node:
        client = node.create_service_client("/never", TRIGGER)
        actions = node.create_action_client("/count", FIBONACCI)
        assert client.wait_for_server(30), client.problem
        assert actions.wait_for_server(30), actions.problem
        call, goal = client.call_async(timeout=60), actions.send_goal({"order": 900}, timeout=60)
        server.event("asked")
        assert goal.acceptance.result(30)
        server.end()
        with pytest.raises(rosglass.ConnectionLostError, match="went away"):
            call.result(30)
        with pytest.raises(rosglass.ConnectionLostError, match="went away"):
            goal.result(30)
        assert goal.status is GoalStatus.LOST
        assert not client.ready
        again = run_peer("offer", url, "victim")
        again.event("ready")
        assert actions.send_goal({"order": 2}).result(30).status is GoalStatus.SUCCEEDED
        again.end()


def test_ctrl_c_ends_a_call(url, server, run_peer):
    caller = run_peer("wait", url, "caller")
    caller.event("waiting")
    server.event("asked")
    os.kill(caller.pid, signal.SIGINT)
    assert caller.event("interrupted", timeout=30) < 2
    assert caller.popen.wait(30) == 0


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_a_goal_survives_a_router_that_is_restarted(free_port, run_peer, mode):
    listen = f"tcp/127.0.0.1:{free_port}"
    url = f"zenoh://127.0.0.1:{free_port}?mode={mode}"
    with Router(listen):
        server = run_peer("offer", url, "survivor")
        server.event("ready")
        node = rosglass.connect(url, "cockpit")
        actions = node.create_action_client("/count", FIBONACCI)
        add = node.create_service_client("/add", ADD)
        feedback = []
        goal = actions.send_goal(
            {"order": 150}, on_feedback=lambda message: feedback.append(len(message.sequence))
        )
        assert goal.acceptance.result(30), actions.problem
        eventually(lambda: feedback, what="feedback")
    time.sleep(0.5)
    with Router(listen):
        status, result = goal.result(30)
        assert status is GoalStatus.SUCCEEDED
        assert len(result.sequence) == 150
        # The result comes by another way than feedback, and may be faster than the last one.
        assert feedback[-1] >= 149
        assert len(set(feedback)) == len(feedback)
        assert add.call({"a": 1, "b": 1}).sum == 2
        node.close()
    server.end()


@pytest.mark.parametrize(
    ("server", "client", "lines"),
    [
        (
            "service_server.py",
            "service_client.py",
            ["1 + 2 = 3\n", "20 + 22 = 42\n", "in asyncio: [0, 2, 4, 6, 8]\n"],
        ),
        (
            "action_server.py",
            "action_client.py",
            [
                *["so far:"] * 4,
                "succeeded [0, 1, 1, 2, 3, 5]",
                "cancelling 1 goal",
                "canceled",
                "the server of /fibonacci does not accept goal ",
            ],
        ),
    ],
    ids=["services", "actions"],
)
def test_the_examples(new_url, start, server, client, lines):
    url = new_url()
    serving = start(str(EXAMPLES / server), url)
    eventually(lambda: "ready; Ctrl-C ends it\n" in serving.output, what=serving.output)
    using = start(str(EXAMPLES / client), url)
    assert using.popen.wait(30) == 0, using.output
    # The lines of two threads may be mixed up, but nothing is missing.
    eventually(lambda: lines[-1] in "".join(using.output), what=using.output)
    shown = "".join(using.output)
    assert {text: shown.count(text) for text in lines} == {
        text: lines.count(text) for text in lines
    }
    os.kill(serving.pid, signal.SIGINT)
    assert serving.popen.wait(30) == 0
    eventually(lambda: serving.output[-1] == "bye\n", what=serving.output)

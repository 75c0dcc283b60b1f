"""Services and actions over Zenoh with dora-rs and zenoh-ros2-sdk, both ways."""

from __future__ import annotations

import importlib.util
import json
import os
import threading
import time
from concurrent.futures import Future
from pathlib import Path

import pytest
import zenoh
from waiting import eventually

import rosglass
from rosglass.errors import ConnectionLostError, TimeoutError  # noqa: A004
from rosglass.wires.zenoh.keys import Attachment

PEERS = Path(__file__).parent / "peers"
ADD = "example_interfaces/srv/AddTwoInts"
NODES = {"dora": "/dora/dora_node", "sdk": "/sdk/server_add"}
KINDS = ["dora-humble", "dora-rep2016", "sdk"]
pytestmark = pytest.mark.peers


@pytest.fixture(scope="module")
def run_peer(start, router, service_interfaces):
    """Start a peer, which follows a plan in a domain of its own."""

    def run_peer(kind, **plan):
        script, _, profile = kind.partition("-")
        module = {"dora": "dora", "sdk": "zenoh_ros2_sdk"}[script]
        if importlib.util.find_spec(module) is None:
            pytest.skip(f'{module} is not installed: pip install "rosglass[peers]"')
        port = int(router.listen.rpartition(":")[2])
        plan |= {
            "port": port,
            "domain": 11,
            "interfaces": str(service_interfaces),
            "profile": profile,
        }
        # dora takes the domain of its data keys and its type descriptions from here only.
        env = os.environ | {"ROS_DOMAIN_ID": "11", "AMENT_PREFIX_PATH": plan["interfaces"]}
        process = start(str(PEERS / f"{script}_services_peer.py"), json.dumps(plan), env=env)
        process.event("ready")
        return process

    return run_peer


@pytest.fixture
def node(connect):
    return connect("cockpit", "?domain=11")


@pytest.fixture(scope="module", params=KINDS)
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def server(kind, run_peer):
    process = run_peer(kind, do="serve")
    yield process
    process.end()


@pytest.mark.parametrize("given", [ADD, None], ids=["type given", "type discovered"])
def test_we_call_the_peer(node, server, given):
    client = node.create_service_client("/add", given)
    assert client.wait_for_server(30), client.problem
    assert client.type.name == ADD
    assert client.call({"a": 2, "b": 40}).sum == 42
    assert [client.call({"a": value, "b": -1}).sum for value in range(20)] == list(range(-1, 19))
    assert client.problem == ""


def test_five_in_flight_answered_in_reverse_order(node, server):
    client = node.create_service_client("/hold", ADD)
    assert client.wait_for_server(30), client.problem
    calls = [client.call_async({"a": value, "b": 100}) for value in range(5)]
    assert client.pending == 5
    server.event("held")
    assert [call.result(30).sum for call in calls] == [100, 101, 102, 103, 104]
    assert client.pending == 0


def test_a_call_that_is_never_answered_ends_at_its_time(node, server):
    client = node.create_service_client("/never", ADD)
    assert client.wait_for_server(30), client.problem
    before = time.monotonic()
    with pytest.raises(TimeoutError, match=r"did not answer within 0\.5 s"):
        client.call({"a": 1}, timeout=0.5)
    assert time.monotonic() - before < 5
    assert client.pending == 0


def test_the_peers_service_is_in_our_graph(node, kind, server):
    (found,) = eventually(lambda: node.service_servers("/add"))
    assert str(found.node) == NODES[kind.partition("-")[0]]
    assert found.type == ADD
    assert found.type_hash == ("" if kind == "dora-humble" else rosglass.load(ADD).rihs01)
    assert node.services()["/add"] == [ADD]


@pytest.mark.parametrize("answers", ["at once", "later"])
def test_the_peer_calls_us(node, kind, run_peer, answers):
    """Later: when the callback, and the thread that called it, are long gone."""
    waiting = []

    def add(request):
        total = {"sum": request.a + request.b}
        if answers == "at once":
            return total
        promise = Future()
        waiting.append(threading.Timer(0.2, promise.set_result, [total]))
        waiting[-1].start()
        return promise

    service = f"/ours_{answers[-2:]}"
    server = node.create_service_server(service, ADD, add)
    process = run_peer(kind, do="call", service=service, pairs=[[1, 2], [-5, 5], [2**40, 1]])
    assert [process.event("sum") for _ in range(3)] == [3, 0, 2**40 + 1]
    assert server.problem == ""
    process.end()
    for timer in waiting:
        timer.join()


def test_peer_is_notified_when_our_callback_fails(node, kind, run_peer):
    def fail(request):
        raise ValueError("the arm is off")

    node.create_service_server("/broken", ADD, fail)
    process = run_peer(kind, do="call", service="/broken", pairs=[[1, 2]])
    assert process.event("failed", timeout=30)
    process.end()


def test_a_client_that_ignores_errors_receives_a_response(node, kind, run_peer, router):
    """rmw_zenoh's clients log an error, and go on waiting for a response."""

    def fail(request):
        raise ValueError("out of order")

    node.create_service_server("/broken_too", ADD, fail, answers_failures=True)
    process = run_peer(kind, do="call", service="/broken_too", pairs=[[1, 2]])
    assert process.event("failed")  # it takes the error
    process.end()
    # A query as rmw_zenoh sends it.
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([router.listen]))
    add = rosglass.load(ADD)
    key = f"11/broken_too/example_interfaces::srv::dds_::AddTwoInts_/{add.rihs01}"
    note = Attachment(1, time.time_ns(), bytes(16)).encode()
    with zenoh.open(config) as session:
        given = add.request.encode({"a": 1, "b": 2})
        replies = list(session.get(key, payload=given, attachment=note))
    assert replies[0].err is not None
    assert b"out of order" in replies[0].err.payload.to_bytes()
    assert replies[1].ok is not None
    assert add.response.decode(replies[1].ok.payload.to_bytes()).sum == 0
    assert len(replies) == 2


def test_a_peer_that_is_killed_in_mid_call(node, kind, run_peer):
    process = run_peer(kind, do="serve", suffix="2")
    client = node.create_service_client("/add2", ADD)
    assert client.wait_for_server(30), client.problem
    before = time.monotonic()
    with pytest.raises(ConnectionLostError, match="went away before it answered"):
        client.call({"a": -2}, timeout=30)
    assert time.monotonic() - before < 15
    assert process.popen.wait(30) == 1
    eventually(lambda: not client.ready)
    # The one that comes after it serves the same client.
    again = run_peer(kind, do="serve", suffix="2")
    assert client.call({"a": 1, "b": 1}, timeout=30).sum == 2
    again.end()

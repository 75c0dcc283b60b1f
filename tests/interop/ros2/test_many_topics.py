"""Thousands of topics that a peer announces."""

from __future__ import annotations

import json
import threading
import time

import pytest
import zenoh
from usage import memory
from waiting import eventually

from rosglass.comm import ConnectionState
from rosglass.wires.zenoh.endpoints import Pump
from rosglass.wires.zenoh.middleware import ZenohMiddleware
from rosglass.wires.zenoh.router import Router

TOPICS = 4_000
#: Bytes of memory for each, and seconds of this process's CPU in all.
MEMORY, CPU = 10_000, 20.0
#: Seconds; for each wait, where other tests take the processor.
LONG = 120.0


def count(node):
    time.sleep(0.5)  # counting is work itself
    return len(node.topics())


def test_thousands_of_announced_topics_cost_their_share(router, connect, run_command):
    node = connect("panel", "?domain=0")
    states = []
    node.on_status_change(lambda status: states.append(status.state))
    publisher = connect("robot", "?domain=0").create_publisher("/beat", "std_msgs/msg/String")
    beats = node.create_subscription("/beat", "std_msgs/msg/String")
    eventually(publisher.subscription_count)
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([router.listen]))
    before, began = memory(), time.process_time()
    with zenoh.open(config) as session:
        head = "@ros2_lv/0/0badc0de/0"
        kind, qos = "geometry_msgs::msg::dds_::Twist_/TypeHashNotSupported", "::,10:,:,:,,"
        announced = [
            session.liveliness().declare_token(f"{head}/{n}/MP/%/%/flood/%t{n}/{kind}/{qos}")
            for n in range(TOPICS)
        ]
        eventually(lambda: count(node) >= TOPICS, timeout=LONG)
        assert memory() - before < 3 * MEMORY * TOPICS  # three see them, the router among these
        publisher.publish(data="alive")
        assert beats.wait(30).message().data == "alive"

        late = connect("late", "?domain=0")
        late.on_status_change(lambda status: states.append(status.state))
        eventually(lambda: count(late) >= TOPICS, timeout=LONG)

        code, out, said = run_command("topic", "list", "--url", router.url + "?domain=0")
        assert code == 0
        assert out.count("\n/t") >= TOPICS - 1
        assert "the router has not sent the whole graph yet" in said
        del announced
    assert ConnectionState.LOST not in states
    eventually(lambda: count(node) < 10, timeout=LONG)
    assert late.status().state is ConnectionState.CONNECTED
    assert time.process_time() - began < CPU


def test_a_graph_is_incomplete_as_soon_as_it_is_connected(router, connect, monkeypatch):
    """However late the thread runs that asks the router for the end of its tokens."""
    released = threading.Event()
    monkeypatch.setattr(
        "rosglass.wires.zenoh.middleware.limit_silence", lambda _: released.wait(LONG)
    )
    node = connect("panel", "?domain=0")
    try:
        eventually(lambda: node.status().state is ConnectionState.CONNECTED, timeout=LONG)
        assert node.unnamed_programs() == 1
    finally:
        released.set()
    eventually(lambda: node.unnamed_programs() == 0, timeout=LONG)


def test_a_router_that_is_linked_before_the_session_is_stored_counts(router, connect, monkeypatch):
    """The worker polls while the session is being opened: it must look at that link later."""
    polled, limited = threading.Event(), threading.Event()
    poll = ZenohMiddleware.poll

    def poll_and_report(self):
        linked = self.is_linked()
        poll(self)
        if linked:
            polled.set()

    def start_slowly(*arguments):
        started = Pump(*arguments)
        if arguments[-1].endswith("links"):
            assert polled.wait(LONG)
        return started

    monkeypatch.setattr(ZenohMiddleware, "poll", poll_and_report)
    monkeypatch.setattr("rosglass.wires.zenoh.middleware.Pump", start_slowly)
    monkeypatch.setattr("rosglass.wires.zenoh.middleware.limit_silence", lambda _: limited.set())
    node = connect("panel", "?domain=0")
    eventually(limited.is_set, timeout=LONG)
    eventually(lambda: node.unnamed_programs() == 0, timeout=LONG)


def test_a_graph_is_incomplete_while_its_router_is_lost(connect, free_port):
    address = f"tcp/127.0.0.1:{free_port}"

    def state():
        return node.status().state, node.unnamed_programs()

    with Router(address) as router:
        node = connect("panel", "?domain=0", url=router.url)
        eventually(lambda: state() == (ConnectionState.CONNECTED, 0), timeout=LONG)
    # The node may connect once more to the router that closes.
    eventually(lambda: state() == (ConnectionState.LOST, 1), timeout=LONG)
    with Router(address):
        eventually(lambda: state() == (ConnectionState.CONNECTED, 0), timeout=LONG)


def test_topics_that_come_and_go_announce_the_same_tokens(router, connect):
    """Every program in the graph keeps the key of each token for ever."""
    node, keys = connect("cockpit", "?domain=0"), set()
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([router.listen]))
    with zenoh.open(config) as session:
        watch = session.liveliness().declare_subscriber(
            "@ros2_lv/**", lambda sample: keys.add(str(sample.key_expr))
        )
        # Zenoh sends the tokens that were declared before a link or a watch in any order.
        eventually(lambda: any("/cockpit" in key for key in keys))
        counts = []
        for turn in range(4):
            topics = [f"/panel/t{number}" for number in range(100)]
            made = [node.create_subscription(topic, "std_msgs/msg/String") for topic in topics]
            last = node.create_subscription(f"/turn/t{turn}", "std_msgs/msg/String")
            eventually(lambda turn=turn: any(f"%turn%t{turn}/" in key for key in keys))
            counts.append(sum("%panel%" in key for key in keys))
            for subscription in (*made, last):
                subscription.close()
        watch.undeclare()
    # Those closed last rest, and so have two tokens.
    assert 100 == counts[0] < counts[1] == counts[2] == counts[3] < 200


@pytest.fixture
def run_command(run_command, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "0")
    # Its 18 s are too few where other tests take the processor, and its 1 s too many where none do.
    monkeypatch.setattr("rosglass.cli.connecting._INTRODUCTION_S", {"zenoh": LONG})
    monkeypatch.setattr("rosglass.cli.connecting._REPORT_PERIOD_S", 0.1)
    return run_command

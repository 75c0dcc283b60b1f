"""Nodes, their endpoints, and closing them, on every wire."""

from __future__ import annotations

import copy
import gc
import pickle
import threading
import time
import weakref

import pytest
from executors import Manual

import rosglass
from rosglass import QoS
from rosglass.comm import IMMEDIATE, ConnectionState, GoalStatus

TEXT = "std_msgs/msg/String"


def test_node_reports_that_it_is_connected(robot, console, eventually):
    assert robot.status().state is not ConnectionState.CLOSED
    eventually(lambda: console.status().state is ConnectionState.CONNECTED, console.status)


def test_nodes_see_each_other_come_and_go(connect, eventually):
    one = connect("one")
    names = [node.full for node in eventually(one.nodes)]
    assert "/one" in names
    other = connect("other", "/arm")
    eventually(lambda: "/arm/other" in [node.full for node in one.nodes()], one.nodes)
    other.close()
    eventually(lambda: "/arm/other" not in [node.full for node in one.nodes()], one.nodes)


def test_topics_and_their_ends_are_shown(robot, console, topic, wire, eventually):
    publisher = robot.create_publisher(topic, TEXT, QoS.latched())
    subscription = robot.create_subscription(topic, TEXT)
    eventually(lambda: console.topics().get(topic) == [TEXT], console.topics)
    eventually(lambda: console.publishers(topic) and console.subscriptions(topic))
    (end,) = console.publishers(topic)
    assert (end.name, end.type, end.node.full) == (topic, TEXT, "/robot")
    if not wire.is_ros1:  # whose master knows neither
        assert end.qos.durability is QoS.latched().durability
        assert len(end.gid) == 16
    assert console.publishers(topic.strip("/")) == [end], "names are resolved"
    with pytest.raises(rosglass.InvalidNameError):
        console.publishers("a b")
    assert [end.node.full for end in console.subscriptions(topic)] == ["/robot"]
    publisher.close()
    subscription.close()
    eventually(lambda: topic not in console.topics(), console.topics)


def test_services_are_shown(robot, console, topic, wire, eventually):
    server = robot.create_service_server(topic, wire.add, lambda _: {})
    eventually(lambda: console.services().get(topic) == [wire_type(wire)], console.services)
    (end,) = console.service_servers(topic)
    assert end.node.full == "/robot"
    if not wire.is_ros1:  # whose master knows neither clients nor hashes
        assert end.type_hash == rosglass.load(wire.add).rihs01
        robot.create_service_client(topic, wire.add)
        eventually(lambda: console.service_clients(topic))
        assert [end.node.full for end in console.service_clients(topic)] == ["/robot"]
    server.close()
    eventually(lambda: not console.service_servers(topic))


def wire_type(wire):
    package, name = wire.add.split("/")[0], wire.add.split("/")[-1]
    return f"{package}/srv/{name}"


def test_endpoints_of_a_node_are_listed(robot, console, topic, eventually):
    robot.create_publisher(topic, TEXT)
    eventually(
        lambda: topic in [end.name for end in console.endpoints("/robot")],
        lambda: console.endpoints("/robot"),
    )
    assert console.endpoints("/no_such_node") == []
    with pytest.raises(rosglass.InvalidNameError):
        console.endpoints("no such node")


def test_changes_of_the_graph_are_reported(robot, console, topic):
    changed = threading.Event()
    console.on_graph_change(changed.set)
    changed.clear()
    robot.create_publisher(topic, TEXT)
    assert changed.wait(30)


def test_changes_of_the_graph_are_merged_while_a_callback_waits_for_its_turn(
    robot, console, topic, eventually
):
    later, calls, looks = Manual(), [], []
    listener = console.on_graph_change(lambda: calls.append(1), later)
    console.on_graph_change(lambda: looks.append(1), IMMEDIATE)
    for number in range(3):
        count = len(looks)
        robot.create_publisher(f"{topic}_{number}", TEXT)
        eventually(lambda count=count: len(looks) > count)
    assert len(later.jobs) == 1
    later.run()
    assert calls == [1]
    robot.create_publisher(f"{topic}_more", TEXT)
    eventually(lambda: later.jobs)
    listener.close()
    later.run()
    assert calls == [1]


def test_type_is_fetched_by_its_name(robot, console, topic, wire):
    robot.create_publisher(topic, TEXT, QoS.latched())
    assert console.fetch_type(TEXT, timeout=30).name == TEXT


def test_similar_name_is_suggested(robot, console, topic, eventually):
    robot.create_publisher(topic + "_pose", TEXT)
    subscription = console.create_subscription(topic + "_posse", TEXT)
    eventually(lambda: topic + "_pose" in subscription.hint, lambda: subscription.hint)


def test_use_of_a_closed_node(connect, topic):
    node = connect("gone")
    subscription = node.create_subscription(topic, TEXT)
    publisher = node.create_publisher(topic, TEXT)
    states = []
    node.on_status_change(lambda status: states.append(status.state), IMMEDIATE)
    node.close()
    node.close()
    assert node.nodes() == []
    assert node.status().state is ConnectionState.CLOSED
    assert states[-1:] == [ConnectionState.CLOSED]
    assert subscription.closed
    assert publisher.subscription_count() == 0
    publisher.close()
    subscription.close()
    for use in (
        lambda: node.create_publisher(topic, TEXT),
        lambda: node.create_subscription(topic),
        lambda: node.on_graph_change(print),
        lambda: node.on_status_change(print),
        lambda: publisher.publish(data="x"),
        lambda: publisher.publish_serialized(b""),
    ):
        with pytest.raises(rosglass.NodeClosedError, match="closed"):
            use()


@pytest.mark.parametrize("take", [copy.copy, copy.deepcopy, pickle.dumps])
def test_nodes_and_endpoints_cannot_be_copied(console, topic, take):
    for made in (
        console,
        console.create_publisher(topic, TEXT),
        console.create_subscription(topic),
        console.create_service_client(f"{topic}_client"),
        console.create_service_server(f"{topic}_server", "std_srvs/srv/Empty", print),
        console.create_action_client(f"{topic}_action"),
        console.parameters,
        console.create_parameter_client("/robot"),
        console.clock,
    ):
        with pytest.raises(rosglass.UnsupportedError, match="neither be copied nor") as refused:
            take(made)
        # A clock shows its time, too.
        assert str(refused.value).startswith(repr(made).partition(":")[0])


def test_closing_ends_waiting(connect, topic):
    node = connect("waiting")
    subscription = node.create_subscription(topic, TEXT)
    threading.Timer(0.2, node.close).start()
    assert subscription.wait(30) is None
    with pytest.raises(rosglass.NodeClosedError):
        node.wait_for_message(topic, TEXT, 1)


def test_closing_ends_the_threads(connect, topic, eventually):
    before = set(threading.enumerate())
    node = connect("threads")
    node.create_subscription(topic, TEXT, lambda _: None)
    node.close()

    def left():
        return [t for t in set(threading.enumerate()) - before if "threads" in t.name]

    eventually(lambda: not left(), left)


def publish(robot, console, topic, wire):
    with (
        console.create_subscription(topic, TEXT, qos=QoS.latched()) as subscription,
        robot.create_publisher(topic, TEXT, QoS.latched()) as publisher,
    ):
        publisher.publish(data="x")
        assert subscription.wait(30) is not None
        return weakref.ref(publisher), weakref.ref(subscription)


def call(robot, console, topic, wire):
    with (
        robot.create_service_server(topic, wire.add, lambda r: {"sum": r.a}) as server,
        console.create_service_client(topic, wire.add) as client,
    ):
        assert client.call({"a": 1}, timeout=30).sum == 1
        return weakref.ref(server), weakref.ref(client)


def act(robot, console, topic, wire):
    with (
        robot.create_action_server(topic, wire.count, lambda _: None) as server,
        console.create_action_client(topic, wire.count) as client,
    ):
        assert client.send_goal({"order": 3}).result(30).status is GoalStatus.SUCCEEDED
        return weakref.ref(server), weakref.ref(client)


def own_threads():
    """Return what runs, but for connections to a node's API, which their callers keep a while."""
    return [t for t in threading.enumerate() if "process_request_thread" not in t.name]


@pytest.mark.parametrize("use", [publish, call, act])
def test_closed_endpoints_leave_nothing_behind(
    robot, console, topic, wire, eventually, use, monkeypatch
):
    monkeypatch.setattr("rosglass.wires.tcpros.core._IDLE_TIMEOUT_S", 0.2)
    use(robot, console, topic, wire)  # what nodes make at a first use stays
    threads = len(own_threads())
    used = [made for _ in range(5) for made in use(robot, console, topic, wire)]

    def left():
        gc.collect()
        return [made() for made in used if made() is not None]

    eventually(lambda: len(left()) <= 2, left)  # threads may hold what they did last
    eventually(lambda: len(own_threads()) <= threads, own_threads)


def test_log_goes_to_rosout(robot, console, wire, eventually):
    found = []
    console.create_subscription(
        "/rosout", None, lambda message: found.append((message.name, message.msg)), QoS(100)
    )
    eventually(lambda: console.publishers("/rosout"))

    def logged():
        robot.logger.warning("low battery")
        return [name for name, text in found if text == "low battery"]

    assert eventually(logged)[0].strip("/") == "robot"


def test_timers_and_time(console):
    ticks, enough = [], threading.Event()

    def tick():
        ticks.append(console.now())
        if len(ticks) >= 3:
            enough.set()

    with console.create_timer(0.02, tick):
        assert enough.wait(30)
    assert ticks == sorted(ticks)
    assert abs(console.now().nanoseconds - time.time_ns()) < 1_000_000_000
    with pytest.raises(rosglass.ConversionError):
        console.create_timer(0, tick)
    with pytest.raises(rosglass.ConversionError, match="executor"):
        console.create_timer(1.0, tick, executor=7)


@pytest.mark.parametrize(
    ("name", "namespace"),
    [("a b", "/"), ("", "/"), ("1st", "/"), ("x-y", "/"), ("arm", "left"), ("arm", "/a b")],
)
def test_bad_node_names_are_refused(wire, name, namespace):
    with pytest.raises(rosglass.InvalidNameError):
        rosglass.connect(wire.url, name, namespace)

"""Registration of a node at the master, also by odd masters and after rare faults."""

from __future__ import annotations

import logging
import socket
import threading
import time
import xmlrpc.client
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import pytest
from inside import core_of
from ports import free_port
from tcpros import node_uri, publisher_address, publisher_links
from waiting import eventually

import rosglass
from rosglass.comm import ConnectionState, EndpointKind, NodeName
from rosglass.comm.builtin_services import BuiltinServices
from rosglass.ros1.parameter_server import ParameterWatches
from rosglass.wires.tcpros import address, registrations
from rosglass.wires.tcpros.publication import Publication
from rosglass.wires.tcpros.topic_subscription import TopicSubscription

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.unit.ros1.conftest import FakeMaster

    from rosglass.ros1 import Ros1Node


@pytest.fixture
def node(master: FakeMaster) -> Iterator[Any]:
    """A connected node."""
    made = connected(master)
    yield made
    made.close()


def shut_down(node: Any, caller: str, reason: str) -> None:
    """Ask a node to shut down, as its master or a tool does."""
    with xmlrpc.client.ServerProxy(node_uri(node)) as api:
        api.shutdown(caller, reason)


def connected(master: FakeMaster, name: str = "panel") -> Any:
    made = rosglass.connect(master.url, name, own_services=False)
    eventually(lambda: made.status().state is ConnectionState.CONNECTED, made.status)
    return made


def test_master_that_restarts_with_the_same_process_number(
    master: FakeMaster, node: Ros1Node
) -> None:
    node.create_publisher("/a", "std_msgs/Empty")
    eventually(lambda: "/panel" in master.publishers.get("/a", {}))
    pid = master.pid
    master.stop()
    master.start()
    master.pid = pid
    eventually(lambda: "/panel" in master.publishers.get("/a", {}))


def test_closing_and_creating_again_keeps_a_topic_registered(
    master: FakeMaster, node: Ros1Node
) -> None:
    for _ in range(100):
        publisher = node.create_publisher("/a", "std_msgs/Empty")
        subscription = node.create_subscription("/a", "std_msgs/Empty")
        publisher.close()
        subscription.close()
    node.create_publisher("/a", "std_msgs/Empty")
    node.create_subscription("/a", "std_msgs/Empty")
    # Whatever waits for the master is done before these.
    node.create_publisher("/last", "std_msgs/Empty")
    eventually(lambda: "/panel" in master.publishers.get("/last", {}))
    assert "/panel" in master.publishers["/a"]
    assert "/panel" in master.subscribers["/a"]


@pytest.mark.parametrize("create", ["create_publisher", "create_subscription"])
def test_closing_from_other_threads_at_the_same_time(
    master: FakeMaster, node: Ros1Node, create: str
) -> None:
    def churn() -> None:
        for _ in range(50):
            getattr(node, create)("/a", "std_msgs/Empty").close()

    threads = [threading.Thread(target=churn) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    kept = getattr(node, create)("/a", "std_msgs/Empty")
    offers = master.publishers if create == "create_publisher" else master.subscribers
    eventually(lambda: "/panel" in offers.get("/a", {}))
    kept.close()
    eventually(lambda: "/panel" not in offers["/a"])


@pytest.mark.parametrize("create", ["create_publisher", "create_subscription"])
def test_endpoint_that_closes_while_its_predecessor_is_registered_is_unregistered(
    master: FakeMaster, node: Ros1Node, create: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    member = Publication if create == "create_publisher" else TopicSubscription
    offers = master.publishers if create == "create_publisher" else master.subscribers
    first = getattr(node, create)("/a", "std_msgs/Empty")
    eventually(lambda: "/panel" in offers.get("/a", {}))
    second: list[Any] = []
    successor = member.successor

    def close_successor(self: Any) -> Any:
        found = successor(self)
        while second:
            second.pop().close()  # before it was registered itself
        return found

    def hold(*_: Any) -> Any:
        # The node's thread is about to register both.
        first.close()
        second.append(getattr(node, create)("/a", "std_msgs/Empty"))
        del master.answers["lookupNode"]
        return master.lookupNode("/panel", "/panel")

    monkeypatch.setattr(member, "successor", close_successor)
    master.answers["lookupNode"] = hold
    eventually(lambda: "/panel" not in offers["/a"])
    assert not second


@pytest.mark.parametrize(
    "answer",
    [
        5,
        [1],
        [1, "", 5],
        [1, "", []],
        [1, "", [[], []]],
        [1, "", [[["/a"]], [], []]],
        [1, "", [[[1, 2]], [], []]],
        ["1", "", [[], [], []]],
        [True, "", [[], [], []]],
        {"code": 1},
        [0, "out of order", 0],
        [-1, "no such luck", 0],
    ],
)
def test_invalid_answers_of_a_master_are_reported(master: FakeMaster, answer: Any) -> None:
    master.answers["getSystemState"] = lambda _: answer
    with rosglass.connect(master.url, "panel", own_services=False) as node:
        eventually(lambda: "trying again" in node.status().detail, node.status)
        assert node.status().state is ConnectionState.CONNECTING
        detail = node.status().detail
        assert "not as " in detail or "refuses getSystemState" in detail
        del master.answers["getSystemState"]
        eventually(lambda: node.status().state is ConnectionState.CONNECTED)


def test_something_else_at_the_masters_address_is_reported() -> None:
    def serve() -> None:
        while True:
            try:
                sock, _ = server.accept()
            except OSError:
                return
            sock.recv(4096)
            sock.sendall(b"HTTP/1.0 404 Not Found\r\n\r\n<html></html>")
            sock.close()

    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=serve, daemon=True).start()
        url = f"ros1://127.0.0.1:{server.getsockname()[1]}"
        with rosglass.connect(url, "panel") as node:
            eventually(lambda: "HTTP status 404; trying again" in node.status().detail)
        server.shutdown(socket.SHUT_RDWR)


def test_refusal_is_shown_logged_once_and_tried_again(
    master: FakeMaster, node: Ros1Node, caplog: pytest.LogCaptureFixture
) -> None:
    master.answers["registerPublisher"] = lambda *_: [0, "not on Sundays", 0]
    with caplog.at_level(logging.WARNING):
        node.create_publisher("/a", "std_msgs/Empty")
        eventually(lambda: "not on Sundays" in node.status().detail)
        assert node.status().state is ConnectionState.CONNECTED
        eventually(lambda: master.calls.count("registerPublisher") > 2)
    assert len([r for r in caplog.records if "not on Sundays" in r.getMessage()]) == 1
    del master.answers["registerPublisher"]
    eventually(lambda: node.status().detail == "")
    assert "/panel" in master.publishers["/a"]


def test_wrong_own_address_is_shown(master: FakeMaster, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_IP", "192.0.2.7")
    url = master.url.partition("?")[0]
    with rosglass.connect(url, "panel", own_services=False) as node:
        eventually(lambda: node.status().state is ConnectionState.CONNECTED)
        expected = "ROS_IP=192.0.2.7 is not an address of this machine"
        eventually(lambda: node.status().detail.startswith(expected))
        node.create_publisher("/a", "std_msgs/Empty")
        eventually(lambda: "/panel" in master.publishers.get("/a", {}))
        assert master.publishers["/a"]["/panel"].startswith("http://192.0.2.7:")


def test_new_network_address_is_announced_and_the_node_continues(
    master: FakeMaster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(address, "_route_elsewhere", lambda: "127.0.0.1")
    url = master.url.partition("?")[0]
    with rosglass.connect(url, "panel", own_services=False) as node:
        node.create_publisher("/a", "std_msgs/Empty")
        eventually(lambda: "127.0.0.1" in master.publishers.get("/a", {}).get("/panel", ""))
        monkeypatch.setattr(address, "_route_elsewhere", lambda: "127.0.0.2")
        eventually(lambda: "127.0.0.2" in master.publishers["/a"]["/panel"])
        # The master takes it for another node, and asks the old one to shut down.
        shut_down(node, "/master", "[/panel] Reason: new node registered with same name")
        eventually(lambda: "shutdown" not in [t.name for t in threading.enumerate()])
        assert node.status().state is ConnectionState.CONNECTED
        shut_down(node, "/rosnode", "user request")
        eventually(lambda: node.status().state is ConnectionState.CLOSED)


def test_node_listens_where_it_is_reached_and_keeps_its_ports(
    master: FakeMaster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(address, "_route_elsewhere", lambda: "")
    with rosglass.connect(master.url.partition("?")[0], "panel", own_services=False) as node:
        node.create_publisher("/a", "std_msgs/Empty")
        eventually(lambda: "/panel" in master.publishers.get("/a", {}))
        before = urlsplit(master.publishers["/a"]["/panel"])
        topics = publisher_address(node, "/a")
        assert before.hostname == "127.0.0.1"
        monkeypatch.setattr(address, "_route_elsewhere", lambda: "127.0.0.2")
        eventually(lambda: "127.0.0.2" in master.publishers["/a"]["/panel"])
        assert urlsplit(master.publishers["/a"]["/panel"]).port == before.port
        assert publisher_address(node, "/a") == ("127.0.0.2", topics[1])
        for port in (before.port, topics[1]):
            assert port is not None
            socket.create_connection(("127.0.0.2", port), 10).close()
            with pytest.raises(ConnectionRefusedError):
                socket.create_connection(("127.0.0.1", port), 10).close()


def test_another_port_is_announced_where_a_program_has_the_nodes_port(
    master: FakeMaster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(address, "_route_elsewhere", lambda: "")
    with ExitStack() as stack:
        node = stack.enter_context(
            rosglass.connect(master.url.partition("?")[0], "panel", own_services=False)
        )
        node.create_publisher("/a", "std_msgs/Empty")
        eventually(lambda: "/panel" in master.publishers.get("/a", {}))
        port = urlsplit(master.publishers["/a"]["/panel"]).port
        stack.enter_context(socket.create_server(("127.0.0.3", port or 0)))
        monkeypatch.setattr(address, "_route_elsewhere", lambda: "127.0.0.3")
        eventually(lambda: "127.0.0.3" in master.publishers["/a"]["/panel"])
        assert urlsplit(master.publishers["/a"]["/panel"]).port != port
        assert publisher_address(node, "/a")[0] == "127.0.0.3"


def test_node_whose_port_is_taken_says_so_and_listens_once_it_is_free(
    master: FakeMaster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(address, "_route_elsewhere", lambda: "")
    port = free_port()
    url = f"{master.url.partition('?')[0]}?slave_port={port}"
    with rosglass.connect(url, "panel", own_services=False) as node:
        node.create_publisher("/a", "std_msgs/Empty")
        eventually(lambda: "/panel" in master.publishers.get("/a", {}))
        with socket.create_server(("127.0.0.4", port)):
            monkeypatch.setattr(address, "_route_elsewhere", lambda: "127.0.0.4")
            eventually(lambda: f"cannot listen on port {port}" in node.status().detail)
        eventually(lambda: "127.0.0.4" in master.publishers["/a"]["/panel"])
        eventually(lambda: node.status().state is ConnectionState.CONNECTED)
        assert urlsplit(master.publishers["/a"]["/panel"]).port == port


#: The API of a node that was killed: the master lists it, but it does not answer.
GONE = "http://127.0.0.1:1/"


def test_killed_node_keeps_its_name_until_another_registers(
    master: FakeMaster,
) -> None:
    master.publishers["/old"] = {"/panel": GONE}
    # The program's start parameters are set, but nothing lists the node yet.
    master.answers["subscribeParam"] = lambda *_: [0, "not now", 0]
    node = connected(master)
    for _ in range(2):
        master.calls.clear()
        eventually(lambda: "getSystemState" in master.calls, node.status)
    assert node.status().state is ConnectionState.CONNECTED
    assert core_of(node).name.full in master.publishers["/old"]
    node.close()


def test_connected_node_keeps_its_name(master: FakeMaster, monkeypatch: pytest.MonkeyPatch) -> None:
    asked, join = threading.Event(), ParameterWatches._join
    listed: list[bool] = []

    def answer(node: str) -> Any:
        listed.append(master.lookupNode("", node)[0] == 1)
        asked.set()
        return master.getSystemState(node)

    def join_late(*arguments: Any) -> None:
        asked.wait(0.3)  # the master must not be asked before
        join(*arguments)

    master.answers["getSystemState"] = answer
    monkeypatch.setattr(ParameterWatches, "_join", join_late)
    with connected(master):
        assert listed[0]


def test_later_node_of_the_name_ends_a_node(master: FakeMaster, node: Any) -> None:
    eventually(lambda: master.lookupNode("", "/panel")[2] == node_uri(node))
    master.answers["lookupNode"] = lambda *_: [1, "", GONE]  # and its call gets lost
    eventually(lambda: node.status().state is ConnectionState.CLOSED)
    taken = f"new node registered with same name; {GONE} has the name /panel now"
    assert node.status().detail == f"closed by {node.master_uri}: {taken}"
    assert not node.status().killed


@pytest.mark.parametrize(
    "reason",
    [
        "[/before] Reason: new node registered with same name",  # a node that had our port
        "[/panel] Reason: new node registered with same name",  # but we have it again
    ],
)
def test_outdated_shutdown_of_the_master_ends_no_node(
    master: FakeMaster, node: Any, reason: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "rosglass.ros1")
    shut_down(node, "/master", reason)
    eventually(
        lambda: f"/panel: ignored, as it has its name: closed by /master: {reason}" in caplog.text
    )
    assert node.status().state is ConnectionState.CONNECTED
    shut_down(node, "/rosnode", "user request")
    eventually(lambda: node.status().state is ConnectionState.CLOSED)


def test_publisher_that_leaves_while_its_subscriber_registers_again_is_dropped(
    master: FakeMaster, node: Any
) -> None:
    robot = connected(master, "robot")
    robot.create_publisher("/a", "std_msgs/Int32")
    node.create_subscription("/a", "std_msgs/Int32")
    (link,) = eventually(lambda: [one for one in publisher_links(node, "/a") if one.connected])

    def answer(*arguments: Any) -> Any:
        del master.answers["registerSubscriber"]
        listed = master.registerSubscriber(*arguments)
        with xmlrpc.client.ServerProxy(node_uri(node)) as api:
            api.publisherUpdate("/master", "/a", [])  # which is newer than the answer
        return listed

    master.answers["registerSubscriber"] = answer
    del master.subscribers["/a"]["/panel"]
    eventually(lambda: link.ended)
    robot.close()


def test_own_messages_are_ignored_also_after_the_address_has_changed(
    master: FakeMaster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(address, "_route_elsewhere", lambda: "127.0.0.1")
    url = master.url.partition("?")[0]
    with rosglass.connect(url, "panel", own_services=False) as node:
        others: list[Any] = []
        node.create_subscription("/a", "std_msgs/Int32", others.append, ignore_local=True)
        every = node.create_subscription("/a", "std_msgs/Int32")
        publisher = node.create_publisher("/a", "std_msgs/Int32")
        eventually(lambda: publisher.subscription_count() and every.publisher_count())
        monkeypatch.setattr(address, "_route_elsewhere", lambda: "127.0.0.2")
        eventually(lambda: "127.0.0.2" in master.publishers["/a"]["/panel"])
        # The old connection ends a second after the new one was made: only the latter counts.
        eventually(
            lambda: (
                [link.uri for link in publisher_links(node, "/a") if link.connected]
                == [node_uri(node)]
            )
        )
        publisher.publish({"data": 1})
        assert every.wait(30).message().data == 1
        last = node.create_publisher("/b", "std_msgs/Int32")
        node.create_subscription("/b", "std_msgs/Int32", others.append)
        eventually(lambda: last.publish({"data": 2}) or others)
        assert others[0].data == 2


def test_node_that_is_shut_down_remotely_stops_lookups(master: FakeMaster, node: Any) -> None:
    master.offer("/add", 1)
    eventually(lambda: "/add" in node.services())
    core = core_of(node)
    shut_down(node, "/rosnode", "user request")
    eventually(lambda: node.status().state is ConnectionState.CLOSED)
    eventually(lambda: "shutdown" not in [thread.name for thread in threading.enumerate()])
    ran = threading.Event()
    for pool in (core.pool, core.lookups):
        pool.run(ran.set)
    assert not ran.wait(0.3)


def test_graph_and_its_changes_are_reported(master: FakeMaster, node: Ros1Node) -> None:
    changes: list[float] = []
    node.on_graph_change(lambda: changes.append(time.monotonic()))
    master.publishers["/scan"] = {"/robot/laser": "http://127.0.0.1:1/"}
    master.types["/scan"] = "sensor_msgs/LaserScan"
    master.subscribers["/cmd"] = {"/robot/base": "http://127.0.0.1:1/"}
    master.types["/cmd"] = "*"
    eventually(lambda: "/scan" in node.topics())
    assert node.topics() == {"/cmd": [], "/scan": ["sensor_msgs/msg/LaserScan"]}
    laser, base = NodeName("/robot", "laser"), NodeName("/robot", "base")
    assert node.nodes() == sorted([laser, base, NodeName("/", "panel")])
    (end,) = node.publishers("/scan")
    assert (end.kind, end.node, end.type) == (
        EndpointKind.PUBLISHER,
        laser,
        "sensor_msgs/msg/LaserScan",
    )
    assert [one.name for one in node.endpoints("/robot/base")] == ["/cmd"]
    assert node.endpoints("/unknown") == []
    eventually(lambda: changes)
    # A type that becomes known later counts as a change.
    count = len(changes)
    master.types["/cmd"] = "geometry_msgs/Twist"
    eventually(lambda: node.topics()["/cmd"] == ["geometry_msgs/msg/Twist"])
    eventually(lambda: len(changes) > count)
    del master.publishers["/scan"]
    eventually(lambda: "/scan" not in node.topics())


def test_publisher_that_is_registered_but_gone_is_reported(
    master: FakeMaster, node: Ros1Node
) -> None:
    port = free_port()
    master.publishers["/scan"] = {"/laser": f"http://127.0.0.1:{port}/"}
    subscription = node.create_subscription("/scan")
    eventually(lambda: "Connection refused" in subscription.problem)
    assert f"http://127.0.0.1:{port}/" in subscription.problem


def test_node_sends_few_requests_to_its_master(master: FakeMaster, node: Ros1Node) -> None:
    node.create_publisher("/a", "std_msgs/Empty")
    eventually(lambda: "/panel" in master.publishers.get("/a", {}))
    looks = master.calls.count("getSystemState")
    # The first of these may be the one that finds the topic; its type is asked for after that.
    eventually(lambda: master.calls.count("getSystemState") >= looks + 2)
    master.calls.clear()
    eventually(lambda: master.calls.count("getSystemState") >= 2)
    assert set(master.calls) == {"getPid", "lookupNode", "getSystemState"}


def unregistering() -> set[threading.Thread]:
    """Return the threads that unregister closed nodes; other tests may have left some."""
    return {one for one in threading.enumerate() if one.name == "rosglass unregister"}


def test_node_that_closes_while_the_master_hangs_is_unregistered_later(
    master: FakeMaster, node: Ros1Node
) -> None:
    hung = connected(master, "hung")
    hung.create_publisher("/a", "std_msgs/Empty")
    hung.create_subscription("/b", "std_msgs/Empty")
    hung.create_service_server("/c", "std_srvs/Empty", lambda _: None)
    eventually(lambda: "/c" in master.services and "/hung" in master.subscribers.get("/b", {}))
    master.running.clear()
    before, began = unregistering(), time.monotonic()
    hung.close()
    assert time.monotonic() - began < 8, "about two seconds on a machine that is not loaded"
    (thread,) = unregistering() - before
    master.running.set()
    eventually(lambda: "/hung" not in master.publishers["/a"], lambda: master.calls[-20:])
    eventually(lambda: "/hung" not in master.subscribers["/b"] and "/c" not in master.services)
    assert node.status().state is not ConnectionState.CLOSED
    thread.join(20)
    assert not thread.is_alive()


def test_unregistering_gives_up_on_an_absent_master(
    master: FakeMaster, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(registrations, "_RETRY_LIMIT_S", 0.0)
    gone = connected(master, "gone")
    gone.create_publisher("/a", "std_msgs/Empty")
    eventually(lambda: "/gone" in master.publishers.get("/a", {}))
    caplog.set_level(logging.INFO, "rosglass.ros1")
    master.stop()
    before = unregistering()
    gone.close()
    eventually(lambda: "may still list /gone" in caplog.text)
    eventually(lambda: unregistering() <= before)
    master.start()


def test_node_on_the_ports_of_an_unregistered_one_stays_registered(
    master: FakeMaster, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = connected(master, "same")
    first.create_publisher("/a", "std_msgs/Empty")
    eventually(lambda: "/same" in master.publishers.get("/a", {}))
    (known,) = master.publishers["/a"].values()
    master.stop()
    first.close()
    port = known.rstrip("/").rpartition(":")[2]
    second = rosglass.connect(f"{master.url}&slave_port={port}", "same", own_services=False)
    second.create_publisher("/a", "std_msgs/Empty")
    master.start()
    eventually(lambda: "rosglass unregister" not in [one.name for one in threading.enumerate()])
    eventually(lambda: master.publishers.get("/a", {}).get("/same") == known)
    second.close()


def test_orderly_exit_is_not_a_warning_but_a_crash_is(
    master: FakeMaster, node: Any, caplog: pytest.LogCaptureFixture
) -> None:
    node.create_action_server("/go", "actionlib/Test", lambda goal: None)
    word = node.create_subscription("/word", "std_msgs/String")
    desk = connected(master, "desk")
    client = desk.create_action_client("/go", "actionlib/Test")
    publisher = desk.create_publisher("/word", "std_msgs/String")
    assert client.wait_for_server(30)
    eventually(publisher.subscription_count)
    caplog.set_level(logging.INFO, "rosglass.comm")
    client.close()
    publisher.close()
    for topic in ("/go/goal", "/go/cancel", "/word"):
        eventually(
            lambda topic=topic: f"{topic}: it has had no publisher" in caplog.text,
            lambda: caplog.text,
        )  # type: ignore[misc]
    assert [r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING] == []
    # A node that is killed never unregisters.
    other = connected(master, "other")
    publisher = other.create_publisher("/word", "std_msgs/String")
    eventually(lambda: "/other" in master.publishers.get("/word", {}))
    eventually(publisher.subscription_count)
    master.answers["unregisterPublisher"] = lambda *_: [1, "", 0]
    other.close()
    eventually(lambda: "cannot be received from" in word.problem, lambda: word.problem)
    eventually(
        lambda: any(
            r.levelno == logging.WARNING and "/word" in r.getMessage() for r in caplog.records
        ),
        lambda: caplog.text,
    )


def test_unreachable_publisher_is_logged_once_for_all_topics_and_on_return(
    master: FakeMaster, node: Any, caplog: pytest.LogCaptureFixture
) -> None:
    topics = ["/a", "/b", "/c"]
    heard = [node.create_subscription(topic, "std_msgs/String") for topic in topics]
    robot = connected(master, "robot")
    for topic in topics:
        robot.create_publisher(topic, "std_msgs/String")
    # Connected, which is more than being listed: from then on the publisher's name is known.
    eventually(
        lambda: all(
            any(link.connected for link in publisher_links(node, topic)) for topic in topics
        )
    )

    def logged(what: str) -> list[str]:
        return [r.getMessage() for r in caplog.records if what in r.getMessage()]

    master.answers["unregisterPublisher"] = lambda *_: [1, "", 0]
    robot.close()
    eventually(lambda: logged("cannot be received"), lambda: caplog.text)
    eventually(lambda: all("refused; trying again" in one.problem.lower() for one in heard))
    del master.answers["unregisterPublisher"]
    for topic in topics:
        del master.publishers[topic]["/robot"]  # as a real one does for a new node of that name
    robot = connected(master, "robot")
    for topic in topics:
        robot.create_publisher(topic, "std_msgs/String")
    eventually(lambda: logged("is back"), lambda: caplog.text)
    (lost,) = logged("cannot be received")
    assert lost.startswith("/a, /b, /c: /robot cannot be received from: http://")
    assert logged("is back") == ["/a, /b, /c: /robot is back"]
    assert {r.levelno for r in caplog.records if "/robot" in r.getMessage()} == {logging.WARNING}
    eventually(lambda: not any(one.problem for one in heard), lambda: [h.problem for h in heard])
    robot.close()


def test_node_that_cannot_be_made_leaves_nothing_behind(
    master: FakeMaster, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any) -> None:
        raise OSError("no more threads")

    monkeypatch.setattr(BuiltinServices, "open", fail)
    with pytest.raises(OSError, match="no more threads"):
        rosglass.connect(master.url, "panel")
    monkeypatch.undo()
    eventually(lambda: not [t for t in threading.enumerate() if t.name.startswith("panel")])
    connected(master).close()

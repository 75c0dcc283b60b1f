"""Answers of a node's slave API to tools, masters and garbage."""

from __future__ import annotations

import http.client
import os
import socket
import threading
import xmlrpc.client
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import pytest
from tcpros import node_uri, publisher_address
from waiting import eventually

import rosglass
from rosglass.comm import ConnectionState

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.unit.ros1.conftest import FakeMaster

    from rosglass.ros1 import Ros1Node


@pytest.fixture
def node(master: FakeMaster) -> Iterator[Ros1Node]:
    """A node that publishes and subscribes."""
    made: Any = rosglass.connect(master.url, "panel", own_services=False)
    made.create_publisher("/speed", "std_msgs/Float64")
    made.create_subscription("/words", "std_msgs/String")
    made.create_subscription("/any")
    # The master's own answer must not come after what the tests send.
    eventually(lambda: made.publishers("/speed") and made.subscriptions("/any"))
    yield made
    made.close()


@pytest.fixture
def api(node: Ros1Node) -> Iterator[xmlrpc.client.ServerProxy]:
    """The node's API."""
    with xmlrpc.client.ServerProxy(node_uri(node), allow_none=True) as proxy:
        yield proxy


def place(node: Ros1Node) -> tuple[str, int]:
    parts = urlsplit(node_uri(node))
    return str(parts.hostname), int(parts.port or 0)


def test_tools_get_their_answers(api: Any, node: Ros1Node, master: FakeMaster) -> None:
    assert api.getPid("/t") == [1, "", os.getpid()]
    assert api.getMasterUri("/t") == [1, "", f"http://127.0.0.1:{master.port}"]
    assert api.getPublications("/t") == [1, "", [["/speed", "std_msgs/Float64"]]]
    subscriptions = api.getSubscriptions("/t")[2]
    assert ["/words", "std_msgs/String"] in subscriptions
    assert ["/any", "*"] in subscriptions
    code, _, protocol = api.requestTopic("/t", "/speed", [["UDPROS", 1], ["TCPROS"]])
    assert (code, protocol[:2]) == (1, ["TCPROS", "127.0.0.1"])
    socket.create_connection(tuple(protocol[1:]), 10).close()


def test_connections_are_listed_as_in_rospy(api: Any, node: Ros1Node) -> None:
    reader = node.create_subscription("/speed")
    eventually(reader.publisher_count)
    _, port = publisher_address(node, "/speed")
    rows = api.getBusInfo("/t")[2]
    inbound = next(row for row in rows if row[2] == "i" and row[5])
    outbound = next(row for row in rows if row[2] == "o")
    assert inbound[1:6] == [node_uri(node), "i", "TCPROS", "/speed", True]
    assert outbound[1:6] == ["/panel", "o", "TCPROS", "/speed", True]
    # rosnode's pattern for the last column.
    for row, ours in ((inbound, None), (outbound, port)):
        words = row[6].split()
        assert words[:4] == ["TCPROS", "connection", "on", "port"]
        assert ours in (None, int(words[4]))
        assert words[5] == "to"
        assert words[7:10] == ["on", "socket", words[9]]
    publishers, subscribers, services = api.getBusStats("/t")[2]
    assert publishers[0][0] == "/speed"
    assert {row[0] for row in subscribers} >= {"/speed", "/words"}
    assert services == []


@pytest.mark.parametrize(
    ("method", "arguments", "expected"),
    [
        ("getPid", (), "getPid: "),
        ("getBusInfo", (1, 2), "getBusInfo: "),
        ("requestTopic", ("/t", "/speed"), "requestTopic: "),
        ("requestTopic", ("/t", "/nothing", [["TCPROS"]]), "/panel does not publish /nothing"),
        ("requestTopic", ("/t", 5, [["TCPROS"]]), "topic is not a string, but 5"),
        ("requestTopic", ("/t", "/speed", "TCPROS"), "protocols is not a list"),
        ("requestTopic", ("/t", "/speed", []), "speaks TCPROS only, not nothing"),
        ("requestTopic", ("/t", "/speed", [["UDPROS", b"x", "h", 1, 2]]), "TCPROS only, not UDPR"),
        ("requestTopic", ("/t", "/speed", [[{"a": 1}], 5, []]), "TCPROS only, not {'a': 1}, 5"),
        ("publisherUpdate", ("/t", "/words", "http://x:1/"), "publishers is not a list"),
        ("publisherUpdate", ("/t", "/words", [1]), "publishers is not a string, but 1"),
        ("publisherUpdate", ("/t",), "publisherUpdate: "),
        ("paramUpdate", ("/t", ["x"], 1), "parameter_key is not a string"),
        ("shutdown", (5, "x"), "caller_id is not a string"),
    ],
)
def test_calls_that_make_no_sense_are_refused(
    api: Any, node: Ros1Node, method: str, arguments: tuple[Any, ...], expected: str
) -> None:
    code, message, _ = getattr(api, method)(*arguments)
    assert code == -1
    assert expected in message
    assert node.status().state is not ConnectionState.CLOSED


def test_unknown_methods_and_publishers_are_harmless(api: Any, node: Ros1Node) -> None:
    for method in ("getStuff", "system.listMethods", "_dispatch", "getPid.x", "__init__.x", ""):
        with pytest.raises(xmlrpc.client.Fault):
            getattr(api, method)("/t")
    assert api.publisherUpdate("/m", "/nothing", ["http://127.0.0.1:1/"])[0] == 1
    strange = [
        "",
        "x",
        "http://",
        "http://[::",
        "http://a..b:1/",
        "http://127.0.0.1:99999/",
        "\x7f",
    ]
    assert api.publisherUpdate("/m", "/any", strange)[0] == 1
    subscription = node.create_subscription("/any")
    eventually(
        lambda: all(uri in subscription.problem for uri in ("a..b", "99999")),
        lambda: subscription.problem,
    )
    assert api.publisherUpdate("/m", "/any", [])[0] == 1
    eventually(lambda: not subscription.problem)


_DEEP = "<value><array><data>" * 20_000 + "</data></array></value>" * 20_000
_LAUGHS = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]>'


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"\0" * 100,
        b"<methodCall>",
        b"<methodCall><methodName>getPid</methodName></methodCall>",
        b"<methodCall><params><param><value>x</value></param></params></methodCall>",
        f"<methodCall><methodName>paramUpdate</methodName><params><param><value>a</value></param>"
        f"<param>{_DEEP}</param><param>{_DEEP}</param></params></methodCall>".encode(),
        f"{_LAUGHS}<methodCall><methodName>&b;</methodName></methodCall>".encode(),
        "<methodCall><methodName>getPid</methodName><params><param><value>ä".encode("latin-1"),
        b"<methodCall><methodName>getPid</methodName><params><param><value><i4>x</i4></value>",
    ],
)
def test_garbage_is_harmless(api: Any, node: Ros1Node, body: bytes) -> None:
    connection = http.client.HTTPConnection(*place(node), timeout=10)
    connection.request("POST", "/", body)
    answer = connection.getresponse().read()
    connection.close()
    assert b"methodResponse" in answer or not body
    assert api.getPid("/t")[0] == 1


@pytest.mark.parametrize(
    ("head", "status"),
    [
        (b"POST / HTTP/1.1\r\n\r\n", b" 400 "),
        (b"POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n", b" 400 "),
        (b"POST / HTTP/1.1\r\nContent-Length: -5\r\n\r\n", b" 400 "),
        (b"POST / HTTP/1.1\r\nContent-Length: \xb2\r\n\r\n", b" 400 "),
        (b"POST / HTTP/1.1\r\nContent-Length: 5\r\nContent-Encoding: gzip\r\n\r\n12345", b" 501 "),
        (b"GET / HTTP/1.1\r\n\r\n", b" 501 "),
        (b"\x16\x03\x01 TLS\r\n\r\n", b"400"),
    ],
)
def test_strange_requests_are_refused(api: Any, node: Ros1Node, head: bytes, status: bytes) -> None:
    with socket.create_connection(place(node), 10) as sock:
        sock.sendall(head)
        assert status in sock.recv(4096)
    assert api.getPid("/t")[0] == 1


def test_flood_of_connections_uses_at_most_100_threads(api: Any, node: Ros1Node) -> None:
    socks = [socket.create_connection(place(node), 10) for _ in range(150)]
    try:
        # The oldest make room at once, so that the master gets through.
        socks[0].settimeout(10)
        assert socks[0].recv(1) == b""
        assert api.getPid("/t")[0] == 1
        # A thread that has just served a client may take a moment to end.
        eventually(lambda: sum("process_request" in t.name for t in threading.enumerate()) <= 100)
    finally:
        for sock in socks:
            sock.close()
    eventually(lambda: sum("process_request" in t.name for t in threading.enumerate()) < 10)
    assert api.getPid("/t")[0] == 1


def test_closing_ends_the_connections_of_the_api(node: Ros1Node) -> None:
    address = place(node)
    with socket.create_connection(address, 10) as sock:
        eventually(lambda: any("process_request" in t.name for t in threading.enumerate()))
        node.close()
        assert sock.recv(1) == b""
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(address, 10).close()


def test_shutdown_request_names_the_caller(api: Any, node: Ros1Node) -> None:
    statuses: list[Any] = []
    done = threading.Event()
    node.on_status_change(
        lambda status: (
            statuses.append(status),
            status.state is ConnectionState.CLOSED and done.set(),
        )
    )
    assert api.shutdown("/rosnode", "user request")[0] == 1
    assert done.wait(30)
    assert statuses[-1].detail == "closed by /rosnode: user request"
    assert node.status() == statuses[-1]

"""Which hosts a node takes `shutdown` and `publisherUpdate` from: its own and the master's."""

from __future__ import annotations

import http.client
import socket
import threading
import xmlrpc.client
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from tcpros import node_uri

from rosglass.comm import ConnectionState
from rosglass.wires.tcpros.slave import Slave

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.unit.ros1.conftest import FakeMaster

MASTER = "198.51.100.1"


class From(xmlrpc.client.Transport):
    """Calls from an address of this machine."""

    def __init__(self, address: str) -> None:
        super().__init__()
        self._address = address

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        return http.client.HTTPConnection(host, timeout=20, source_address=(self._address, 0))


class Connected(socket.socket):
    """A connection that comes from where the test says."""

    ends = ("", "")

    def getpeername(self) -> Any:
        return (self.ends[0], 4000)

    def getsockname(self) -> Any:
        return (self.ends[1], 5000)


class Core:
    """A node: its master, and what ended it."""

    def __init__(self) -> None:
        self.master = SimpleNamespace(
            uri=f"http://{MASTER}:11311", reached_at=MASTER, reached_from="192.0.2.7"
        )
        self.ended: list[tuple[str, str]] = []

    def shut_down(self, caller: str, reason: str) -> None:
        self.ended.append((caller, reason))


def call_from(
    peer: str, own: str, method: str = "shutdown", *arguments: Any, topics: Any = None
) -> tuple[list[Any], Core]:
    """Call a method of a node between these addresses: the answer, and the node."""
    core = Core()
    slave = Slave(core, topics, lambda _: None)  # type: ignore[arg-type]
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            made = Connected(fileno=server.accept()[0].detach())
            made.ends = (peer, own)
            slave.accept(made, peer)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        with xmlrpc.client.ServerProxy(f"http://127.0.0.1:{server.getsockname()[1]}") as node:
            call = getattr(node, method)
            answer: Any = call("/other", *(arguments or ("user request",)))
        thread.join(30)
    slave.close()
    return answer, core


@pytest.mark.parametrize(
    ("peer", "own"),
    [
        ("127.0.0.1", "127.0.0.1"),
        ("127.0.0.1", "127.0.1.1"),
        ("127.0.1.1", "127.0.0.1"),
        ("127.0.1.1", "127.0.1.1"),
        ("::ffff:127.0.1.1", "::ffff:127.0.0.1"),
        ("::1", "::1"),
        ("192.0.2.7", "192.0.2.7"),
        ("fe80::7%eth0", "fe80::7%eth0"),
        (MASTER, "192.0.2.7"),
        (f"::ffff:{MASTER}", "::ffff:192.0.2.7"),
    ],
)
def test_own_addresses_and_the_masters_may_end_a_node(peer: str, own: str) -> None:
    answer, core = call_from(peer, own)
    assert answer[0] == 1
    assert core.ended == [("/other", "user request")]


@pytest.mark.parametrize(
    "peer", ["192.0.2.8", "::ffff:192.0.2.8", "198.51.100.2", "2001:db8::1", "fe80::8%eth0"]
)
def test_other_hosts_may_not(peer: str, caplog: pytest.LogCaptureFixture) -> None:
    answer, core = call_from(peer, "192.0.2.7")
    assert answer[0] == -1
    plain = peer.removeprefix("::ffff:")
    assert f"taken from this node's own and the master's host, not from {plain}" in answer[1]
    assert not core.ended
    assert f"/other at {plain} wanted to end this node" in caplog.text


@pytest.mark.parametrize("source", ["127.0.0.1", "127.0.1.1"])
def test_node_of_a_machine_at_127_0_1_1_is_shut_down(
    connect: Callable[..., Any], eventually: Callable[..., Any], master: FakeMaster, source: str
) -> None:
    url = master.url.replace("?ip=127.0.0.1", "?ip=127.0.1.1")
    node = connect("panel", url=url, own_services=False)
    node.create_publisher("/speed", "std_msgs/Float64")
    eventually(lambda: "/panel" in master.publishers.get("/speed", {}))
    uri = node_uri(node)
    assert uri.startswith("http://127.0.1.1:")
    with xmlrpc.client.ServerProxy(uri, transport=From(source)) as proxy:
        assert proxy.shutdown("/rosnode", "user request")[0] == 1  # type: ignore[index]
    eventually(lambda: node.status().state is ConnectionState.CLOSED)


class Topic:
    """A topic that a node subscribes to."""

    must_register_again = False

    def __init__(self) -> None:
        self.publishers: list[str] = []

    def on_publishers_changed(self, uris: list[str]) -> None:
        self.publishers = uris


def update_from(peer: str, own: str, topic: Topic) -> None:
    """Send a node an update of a topic's publishers."""
    topics = SimpleNamespace(subscribed=lambda: {"/speed": topic})
    update = ("/speed", ["http://192.0.2.66:1/"])
    answer, _ = call_from(peer, own, "publisherUpdate", *update, topics=topics)
    assert answer[0] == 1


@pytest.mark.parametrize("peer", [MASTER, f"::ffff:{MASTER}"])
def test_masters_updates_are_trusted(peer: str) -> None:
    topic = Topic()
    update_from(peer, "192.0.2.7", topic)
    assert topic.publishers == ["http://192.0.2.66:1/"]
    assert not topic.must_register_again


@pytest.mark.parametrize(
    "peer", ["192.0.2.8", "::ffff:192.0.2.8", "198.51.100.2", "127.0.0.1", "192.0.2.7"]
)
def test_after_other_updates_the_master_is_asked(
    peer: str, caplog: pytest.LogCaptureFixture
) -> None:
    topic = Topic()
    update_from(peer, "192.0.2.7", topic)
    assert topic.publishers == []
    assert topic.must_register_again
    assert f"is not the master at {MASTER}, which is asked" in caplog.text

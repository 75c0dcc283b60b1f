"""Thousands of connections to a node."""

from __future__ import annotations

import gc
import os
import socket
import threading
import xmlrpc.client
from pathlib import Path

import pytest
from tcpros import node_uri, publisher_address

from rosglass.wires.tcpros import node as tcpros_node

FLOOD = 1000
HEADER = b"\x14\0\0\0\x10\0\0\0callerid=/caller"


def flood(port, payload=b""):
    """Connect a thousand times, the last 200 staying; return these."""
    kept = []
    for _ in range(FLOOD):
        sock = socket.create_connection(("127.0.0.1", port), 20)
        if payload:
            sock.sendall(payload)
        kept.append(sock)
        if len(kept) > 200:
            kept.pop(0).close()
    return kept


@pytest.fixture
def node(connect, eventually):
    made = connect("panel", own_services=False)
    made.create_publisher("/speed", "std_msgs/Float64")
    eventually(lambda: made.publishers("/speed"))
    return made


def open_files():
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


def hello(name):
    """Return the connection header of a subscriber to /speed."""
    fields = (f"callerid={name}".encode(), b"topic=/speed", b"type=*", b"md5sum=*")
    header = b"".join(len(field).to_bytes(4, "little") + field for field in fields)
    return len(header).to_bytes(4, "little") + header


def place(node):
    """Return the ports of a node: of its API, and of its topics."""
    api = node.publishers("/speed")[0]
    assert api.node.full == "/panel"
    return node_uri(node), publisher_address(node, "/speed")[1]


@pytest.mark.parametrize("payload", [b"", b"\xff\xff\xff\xff", b"POST / HTTP/1.1\r\n", HEADER])
def test_floods_leave_threads_and_files_and_the_node_answers(node, connect, eventually, payload):
    uri, port = place(node)
    before = open_files()
    for target in (port, int(uri.rsplit(":", 1)[1].strip("/"))):
        kept = flood(target, payload)
        try:
            assert open_files() < before + len(kept) + 330
            assert threading.active_count() < 250
            assert xmlrpc.client.ServerProxy(uri).getPid("/t")[0] == 1
            reader = connect(f"reader{target}", own_services=False).create_subscription("/speed")
            eventually(reader.publisher_count)
            reader.close()
        finally:
            for sock in kept:
                sock.close()
    eventually(lambda: open_files() < before + 20)


def test_there_are_fewer_connections_than_files(connect, eventually, monkeypatch):
    assert 100 <= tcpros_node.max_connections() <= 10_000
    monkeypatch.setattr(tcpros_node, "max_connections", lambda: 50)
    node = connect("panel", own_services=False)
    publisher = node.create_publisher("/speed", "std_msgs/Float64")
    eventually(lambda: node.publishers("/speed"))
    _, port = place(node)
    socks = []
    for _ in range(80):
        socks.append(socket.create_connection(("127.0.0.1", port), 20))
        socks[-1].sendall(hello("/greedy"))
    try:
        eventually(lambda: publisher.subscription_count() == 50)
        ended = 0
        for sock in socks:
            sock.settimeout(20)
            try:
                ended += not sock.recv(1)
            except ConnectionResetError:
                ended += 1
        assert ended == 30
    finally:
        for sock in socks:
            sock.close()
    eventually(lambda: publisher.subscription_count() == 0)


def test_many_honest_peers_that_come_back_at_once_are_all_served(node):
    _, port = place(node)
    socks = [socket.create_connection(("127.0.0.1", port), 20) for _ in range(110)]
    try:
        # When the last one is answered, all are accepted.
        for number, sock in reversed(list(enumerate(socks))):
            sock.sendall(hello(f"/peer{number}"))
            assert sock.recv(4), f"peer {number} was cut"
    finally:
        for sock in socks:
            sock.close()


def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_unfinished_request_leaves_no_memory_behind(node, eventually):
    node.create_service_server("/reset", "std_srvs/Empty", lambda _: {})
    before = resident()
    fields = (b"callerid=/caller", b"service=/reset", b"md5sum=*")
    header = b"".join(len(field).to_bytes(4, "little") + field for field in fields)
    # Python's collector may run much later.
    gc.disable()
    try:
        with socket.create_connection(("127.0.0.1", place(node)[1]), 20) as caller:
            caller.sendall(len(header).to_bytes(4, "little") + header)
            caller.recv(4)
            caller.sendall((2**29).to_bytes(4, "little"))
            for _ in range(256):
                caller.sendall(bytes(2**20))
            eventually(lambda: resident() > before + 200 * 2**20)
        eventually(lambda: resident() < before + 50 * 2**20)
    finally:
        gc.enable()


def test_call_with_too_many_values_is_refused(node, caplog):
    uri, _ = place(node)
    values = [""] * 100_000
    with pytest.raises(xmlrpc.client.Fault, match="more than 100000 XML elements"):
        xmlrpc.client.ServerProxy(uri).paramUpdate("/t", "/values", values)
    assert "more than 100000 XML elements" in caplog.text
    # A robot's model is one value.
    long = "x" * 10_000_000
    assert xmlrpc.client.ServerProxy(uri).paramUpdate("/t", "/robot_description", long)[0] == 1

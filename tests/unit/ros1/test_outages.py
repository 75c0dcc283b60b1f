"""Connections that are kept while the network is away."""

from __future__ import annotations

import socket
import struct
import sys
from types import SimpleNamespace

import pytest
from waiting import at_rate, eventually

from rosglass.wires.tcpros import connection
from rosglass.wires.tcpros.connection import Connection, Frame, UnackedBytes, survive_outages
from rosglass.wires.tcpros.io_loop import IoLoop


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have other options")
def test_subscriber_gives_a_connection_up_before_its_publisher_does():
    with socket.socket() as sock:
        survive_outages(sock)
        names = (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
        idle, pause, count = (sock.getsockopt(socket.IPPROTO_TCP, name) for name in names)
        given_up = sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) / 1000
    ros = 60 + 9 * 10  # rospy and roscpp set these
    assert idle + pause * count > ros
    assert given_up > ros


@pytest.fixture
def clock(monkeypatch):
    made = SimpleNamespace(now=100.0)
    # Only for the module: whatever else runs in this process goes by the real one.
    monkeypatch.setattr(connection, "time", SimpleNamespace(monotonic=lambda: made.now))
    return made


def test_connection_without_acknowledgement_for_half_a_second_has_stalled(clock, monkeypatch):
    watched, waiting = UnackedBytes(None), [0]
    monkeypatch.setattr(watched, "unacked", lambda: waiting[0])

    def later(seconds, written, unconfirmed):
        clock.now += seconds
        watched.written, waiting[0] = written, unconfirmed
        return watched.stalled()

    # An idle connection does not stall, nor does its first word; it is asked before each.
    assert not later(60, 0, 0)
    assert not later(60, 0, 0)
    assert not later(0.1, 10, 10)
    assert not later(0.3, 20, 20)
    assert later(0.2, 30, 30)
    # Something was confirmed: it goes on, however much still waits.
    assert not later(0.1, 40, 35)
    assert later(0.6, 40, 35)
    assert not later(0.1, 40, 0)


@pytest.mark.skipif(
    sys.platform != "linux", reason="other systems do not report unacknowledged bytes"
)
def test_silent_subscriber_gets_only_the_newest_afterwards(monkeypatch):
    silent = [False]
    real = UnackedBytes.unacked
    # As if the network was away: what is sent stays unconfirmed.
    monkeypatch.setattr(UnackedBytes, "unacked", lambda u: u.written if silent[0] else real(u))
    loop = IoLoop("test outages")
    ours, peer = socket.socketpair()
    link = Connection(loop, _Tcp(ours), print, print, print, peer="robot")
    loop.call(link.accept)
    peer.settimeout(10)
    try:
        silent[0] = True
        for number in at_rate(0.01, 100):
            link.send([struct.pack("<I", number)], keep=1)
        assert link.stalled
        assert link.waiting() == 1
        assert link.lost > 10
        silent[0] = False
        data = b""
        while not data.endswith(struct.pack("<I", number)):
            data += peer.recv(4096)
        received = [each for (each,) in struct.iter_unpack("<I", data)]
        assert received[-1] == number
        assert len(received) < number - 10
    finally:
        loop.close()
        peer.close()
        ours.close()


@pytest.mark.skipif(
    sys.platform != "linux", reason="other systems do not report unacknowledged bytes"
)
def test_commands_to_a_silent_subscriber_expire_here(monkeypatch):
    silent = [False]
    real = UnackedBytes.unacked
    monkeypatch.setattr(UnackedBytes, "unacked", lambda u: u.written if silent[0] else real(u))
    loop = IoLoop("test outages")
    ours, peer = socket.socketpair()
    link = Connection(loop, _Tcp(ours), print, print, print, peer="robot")
    loop.call(link.accept)
    peer.settimeout(10)

    def send(number):
        link.send_frame(Frame([struct.pack("<I", number)], timeout=0.3), keep=1)

    try:
        eventually(lambda: link.connected)
        silent[0] = True
        for number in at_rate(0.02, 50):
            send(number)
        eventually(lambda: link.waiting() == 0)
        lost = link.lost
        assert lost > 25
        silent[0] = False
        send(1000)
        data = b""
        while not data.endswith(struct.pack("<I", 1000)):
            data += peer.recv(4096)
        received = [each for (each,) in struct.iter_unpack("<I", data)]
        assert len(received) + lost == number + 2, "each was delivered, or counted"
        assert received[:-1] == list(range(len(received) - 1)), "the first ones, of 0.1 s"
    finally:
        loop.close()
        peer.close()
        ours.close()


class _Tcp:
    """A socket without network that takes TCP's options."""

    def __init__(self, sock):
        self._sock = sock

    def setsockopt(self, *_):
        pass

    def __getattr__(self, name):
        return getattr(self._sock, name)

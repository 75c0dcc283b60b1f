from __future__ import annotations

import socket
import sys

import pytest

zenoh = pytest.importorskip("zenoh")

from rosglass.wires.zenoh.endpoints import LocalRegistry  # noqa: E402
from rosglass.wires.zenoh.session import Heartbeat, limit_silence  # noqa: E402


class FakeSession:
    """Answers liveliness queries when the test says so; knows links."""

    def __init__(self, links=()):
        self.questions = []
        self.links = lambda: links

    @property
    def info(self):
        return self

    def liveliness(self):
        return self

    def get(self, key, channel, timeout):
        self.questions.append(FakeChannel())
        return self.questions[-1]


class FakeChannel:
    """The reply channel of a query: open, ended, or with an error in it."""

    state = "open"

    def try_recv(self):
        if self.state == "ended":
            raise zenoh.ZError("channel is empty and closed")
        return None if self.state == "open" else "Timeout"


def test_router_that_answers_is_queried_again():
    heartbeat, session = Heartbeat("key"), FakeSession()
    for now in range(10):
        heartbeat.beat(session, float(now))
        session.questions[-1].state = "ended"
        assert not heartbeat.silent
    assert len(session.questions) == 10


def test_router_is_silent_until_it_answers():
    heartbeat, session = Heartbeat("key"), FakeSession()
    silent = []
    for now in range(8):
        heartbeat.beat(session, float(now))
        silent.append(heartbeat.silent)
    assert silent == [False] * 4 + [True] * 4
    assert len(session.questions) == 1, "one question at a time"
    session.questions[0].state = "ended"
    heartbeat.beat(session, 8.0)
    assert heartbeat.silent, "a link that is given up ends its questions, too"
    assert len(session.questions) == 2
    session.questions[1].state = "ended"
    heartbeat.beat(session, 9.0)
    assert not heartbeat.silent


def test_query_that_timed_out_is_repeated_and_the_router_stays_silent():
    heartbeat, session = Heartbeat("key"), FakeSession()
    heartbeat.beat(session, 0.0)
    heartbeat.beat(session, 5.0)
    session.questions[0].state = "error"
    heartbeat.beat(session, 10.0)
    assert heartbeat.silent
    assert len(session.questions) == 2
    heartbeat.pause()
    assert not heartbeat.silent


def test_router_that_sends_tokens_is_not_silent_though_its_answer_queues():
    heartbeat, session = Heartbeat("key"), FakeSession()
    for now in range(10):
        heartbeat.on_received(float(now))
        heartbeat.beat(session, float(now))
        assert not heartbeat.silent
    heartbeat.beat(session, 11.0)
    assert not heartbeat.silent
    heartbeat.beat(session, 13.0)
    assert heartbeat.silent


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="a setting of Linux")
@pytest.mark.parametrize(
    ("peer", "locator", "limited"),
    [
        ("127.0.0.1", "tcp/127.0.0.1:7", True),
        ("::1", "tcp/[::1]:7", True),
        ("192.0.2.1", "tcp/192.0.2.1:7", True),
        ("::ffff:192.0.2.1", "tcp/[::ffff:192.0.2.1]:7", True),
        ("fe80::1%eth0", "tcp/[fe80::1]:7", True),
        ("192.0.2.1", "tls/192.0.2.1:7", True),
        ("192.0.2.1", "udp/192.0.2.1:7", False),
        ("192.0.2.1", "tcp/192.0.2.2:7", False),
        ("192.0.2.1", "tcp/192.0.2.1:8", False),
        ("192.0.2.1", "tcp/robot:7", False),
    ],
)
def test_connections_end_when_nothing_is_acknowledged(peer, locator, limited, monkeypatch):
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.create_connection(server.getsockname()) as connection,
    ):
        # An address of this machine's own passes for another machine's.
        monkeypatch.setattr(socket.socket, "getpeername", lambda _: (peer, 7), raising=False)

        class Link:
            dst = locator

        limit_silence(FakeSession([Link]))
        timeout = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT)
        assert (timeout == 4000) is limited


def test_places():
    places = LocalRegistry()
    assert places.find(("/t", "type")) == ()
    places.add(("/t", "type"), "a")
    places.add(("/t", "type"), "b")
    places.add(("/u", "type"), "c")
    assert places.find(("/t", "type")) == ("a", "b")
    places.remove(("/t", "type"), "a")
    places.remove(("/t", "type"), "a")
    places.remove(("/t", "type"), "b")
    assert places.find(("/t", "type")) == ()
    assert places.find(("/u", "type")) == ("c",)

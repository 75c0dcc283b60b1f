"""One TCPROS connection over sockets of this machine."""

from __future__ import annotations

import socket
import struct
import threading
import time

import pytest
from ports import free_port
from waiting import eventually

from rosglass.wires.tcpros import connection as module
from rosglass.wires.tcpros.connection import Connection, encode_header
from rosglass.wires.tcpros.io_loop import IoLoop

HEADER = encode_header({"callerid": "/peer", "topic": "/t"})


def frame(content: bytes) -> bytes:
    return struct.pack("<I", len(content)) + content


class End:
    """A connection of ours, and the other end's socket."""

    def __init__(self, loop, small=False):
        with socket.socket() as listener:
            listener.bind(("127.0.0.1", 0))
            listener.listen()
            self.peer = socket.create_connection(listener.getsockname())
            ours, _ = listener.accept()
        if small:
            ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
            self.peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self.peer.settimeout(10)
        self.headers, self.frames, self.ended = [], [], []
        #: Callbacks that a test may replace.
        self.on_header, self.on_frame = self.headers.append, self._keep
        self.link = Connection(
            loop,
            ours,
            self._take_header,
            self._take_frame,
            self.ended.append,
            peer="a peer",
        )
        loop.call(self.link.accept)

    def _take_header(self, header):
        self.on_header(header)

    def _take_frame(self, data, _):
        self.on_frame(data)

    def _keep(self, data):
        self.frames.append(bytes(data))


@pytest.fixture
def loop():
    made = IoLoop("test connections")
    yield made
    made.close()


@pytest.fixture
def end(loop):
    made = End(loop)
    yield made
    made.peer.close()


def test_frames_come_byte_by_byte(end):
    for byte in HEADER + frame(b"hello") + frame(b""):
        end.peer.send(bytes([byte]))
    assert eventually(lambda: len(end.frames) == 2)
    assert end.frames == [b"hello", b""]
    assert end.link.peer == "/peer"


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"\xff\xff\xff\xff", "connection header claims to have 4294967295"),
        (b"GET / HTTP/1.1\r\n\r\n", "connection header claims"),
        (frame(b"\xff\xff\xff\xff"), "truncated"),
        (frame(frame(b"no equals sign")), "has no '='"),
        (frame(b""), "is empty"),
        (HEADER + b"\xff\xff\xff\xff", "a message claims"),
        (encode_header({"callerid": "/peer", "error": "go away"}), "/peer refuses: go away"),
    ],
)
def test_garbage_ends_the_connection_with_the_reason(end, data, reason):
    end.peer.sendall(data)
    assert reason in eventually(lambda: end.ended)[0]
    assert end.peer.recv(10) == b""
    assert end.frames == []


def test_peer_without_header_times_out(loop, monkeypatch):
    monkeypatch.setattr(module, "_HEADER_TIMEOUT_S", 0.1)
    end = End(loop)
    assert "no connection header was received" in eventually(lambda: end.ended)[0]


def test_connection_with_a_header_in_time_stays_open(loop, monkeypatch):
    monkeypatch.setattr(module, "_HEADER_TIMEOUT_S", 0.1)
    end = End(loop)
    end.peer.sendall(HEADER)
    eventually(lambda: end.headers)
    later = End(loop)
    eventually(lambda: later.ended)
    end.peer.sendall(frame(b"still there"))
    assert eventually(lambda: end.frames) == [b"still there"]


def test_refused_connection_ends_with_the_reason(loop):
    address = ("127.0.0.1", free_port())
    ended = []
    loop.call(
        lambda: Connection.dial(loop, address, {}, lambda _: None, lambda *_: None, ended.append)
    )
    assert "refused" in eventually(lambda: ended)[0]


def test_slow_reader_costs_bounded_memory_and_gets_the_newest(loop):
    end = End(loop, small=True)
    for number in range(100):
        end.link.send([frame(b"%05d" % number + b"x" * 20_000)], keep=5)
    assert end.link.waiting() <= 6
    lost = end.link.lost
    assert lost > 50
    received = bytearray()
    size = 20_009
    while len(received) < size * (100 - lost):
        received += end.peer.recv(1 << 20)
    numbers = [int(received[at + 4 : at + 9]) for at in range(0, len(received), size)]
    assert numbers == sorted(numbers)
    assert numbers[-1] == 99
    end.peer.close()


def test_caller_may_reuse_its_buffer(loop):
    end = End(loop, small=True)
    data = bytearray(frame(b"a" * 300_000))
    end.link.send([data])
    data[:] = b"\0" * len(data)
    received = bytearray()
    while len(received) < len(data):
        received += end.peer.recv(1 << 20)
    assert received == frame(b"a" * 300_000)
    end.peer.close()


def test_sent_data_arrives_although_the_loop_is_closed_at_once():
    loop = IoLoop("finishing")
    end = End(loop, small=True)
    end.link.send([frame(b"stop" * 6_000)])
    loop.call(lambda: end.link.finish(1.0))
    closing = threading.Thread(target=loop.close)
    closing.start()
    received = bytearray()
    while data := end.peer.recv(1 << 20):
        received += data
    closing.join(10)
    assert received == frame(b"stop" * 6_000)
    assert end.ended == [""]


def test_closing_the_loop_ends_every_connection():
    loop = IoLoop("closing")
    ends = [End(loop) for _ in range(5)]
    ends[0].peer.sendall(HEADER)
    eventually(lambda: ends[0].headers)
    loop.call(lambda: ends[0].link.set_urgent(urgent=False))
    loop.close()
    assert [end.ended for end in ends] == [[""]] * 5
    assert all(end.peer.recv(1) == b"" for end in ends)


def test_non_urgent_frames_are_deferred_until_drained(loop, end):
    end.peer.sendall(HEADER + frame(b"first"))
    eventually(lambda: end.frames)
    loop.call(lambda: end.link.set_urgent(urgent=False))
    for number in range(20):
        end.peer.sendall(frame(b"%d" % number))
    eventually(lambda: end.link.drain() or len(end.frames) == 21)
    end.peer.sendall(frame(b"by itself"))
    assert eventually(lambda: end.frames[-1] == b"by itself")


def test_many_non_urgent_frames_do_not_block_the_loop(loop, end):
    end.peer.sendall(HEADER)
    eventually(lambda: end.headers)
    loop.call(lambda: end.link.set_urgent(urgent=False))
    began = time.monotonic()
    for _ in range(300):
        end.peer.sendall(frame(b"x" * 1_000_000))
    assert eventually(lambda: len(end.frames) == 300)
    assert time.monotonic() - began < 15


def test_failing_callback_ends_its_connection_only(loop, end, caplog):
    def fail(_):
        raise ValueError("a fault")

    end.on_frame = fail
    other = End(loop)
    for one in (end, other):
        one.peer.sendall(HEADER + frame(b"x"))
    assert "a fault" in eventually(lambda: end.ended)[0]
    assert eventually(lambda: other.frames) == [b"x"]
    assert "handling a message failed" in caplog.text
    other.peer.close()


def test_pausing_keeps_what_came_with_the_header(loop, end):
    end.on_header = lambda _: end.link.pause(reading=False)
    end.peer.sendall(HEADER + frame(b"latched") + frame(b"next"))
    eventually(lambda: end.link.header)
    turned = threading.Event()
    loop.call(turned.set)
    assert turned.wait(30)
    assert end.frames == []
    loop.call(lambda: end.link.pause(reading=True))
    assert eventually(lambda: len(end.frames) == 2)
    assert end.frames == [b"latched", b"next"]

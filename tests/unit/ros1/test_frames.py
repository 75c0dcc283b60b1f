"""Frames of TCPROS: cut from what comes, and waiting to be sent."""

from __future__ import annotations

import struct

import pytest

from rosglass.errors import DecodeError
from rosglass.wires.tcpros.connection import (
    MAX_FRAME,
    MAX_HEADER,
    Frame,
    Incoming,
    Outgoing,
    encode_header,
    parse_header,
)

HEADER = {"callerid": "/n", "md5sum": "*"}


def frame(content: bytes) -> bytes:
    return struct.pack("<I", len(content)) + content


class Taken:
    """Keeps everything that an Incoming hands on."""

    def __init__(self, lead: int = 0) -> None:
        self.header: dict[str, str] = {}
        self.frames: list[bytes | memoryview] = []
        self.leads: list[int] = []
        self.incoming = Incoming("/peer", lead, self._take)

    def _take(self, frames: list[bytes | memoryview], first: int) -> None:
        if not self.header:
            (only,) = frames
            self.header = parse_header(bytes(only))
        else:
            self.frames += frames
            self.leads += [first] * len(frames)

    def give(self, data: bytes, step: int = 65536) -> None:
        """Hand over bytes, at most `step` at a time, as a connection does."""
        while data:
            room = self.incoming.room
            count = min(step, len(data))
            if room is None:
                self.incoming.feed(data[:count])
            else:
                count = min(count, len(room))
                room[:count] = data[:count]
                self.incoming.filled(count)
            data = data[count:]


CONTENTS = [
    b"",
    b"a",
    b"bc" * 40,
    *[b"%03d" % n for n in range(100)],
    b"z" * 5000,
    b"",
    b"y" * 70000,
]


@pytest.mark.parametrize("step", [1, 2, 3, 7, 1000, 4096, 65536])
def test_frames_are_the_same_however_they_arrive(step):
    taken = Taken()
    data = encode_header(HEADER) + b"".join(map(frame, CONTENTS))
    taken.give(data, step)
    assert taken.header == HEADER
    assert [bytes(one) for one in taken.frames] == CONTENTS
    assert taken.incoming.total == len(data)


@pytest.mark.parametrize("step", [1, 5, 65536])
def test_byte_is_in_front_of_each_response_but_not_of_the_header(step):
    taken = Taken(lead=1)
    taken.give(encode_header(HEADER) + b"\1" + frame(b"yes") + b"\0" + frame(b"n" * 6000), step)
    assert [bytes(one) for one in taken.frames] == [b"yes", b"n" * 6000]
    assert taken.leads == [1, 0]


def test_runs_of_one_size_end_where_the_size_changes():
    contents = [b"%04d" % n for n in range(50)] + [b"longer"] + [b"%04d" % n for n in range(200)]
    taken = Taken()
    taken.give(encode_header(HEADER) + b"".join(map(frame, contents)))
    assert taken.frames == contents


def test_header_may_be_longer_than_what_is_read_at_once():
    taken = Taken()
    long = HEADER | {"message_definition": "x" * 200_000}
    taken.give(encode_header(long) + frame(b"after"))
    assert taken.header == long
    assert taken.frames == [b"after"]


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (struct.pack("<I", MAX_HEADER + 1), "the connection header"),
        (b"GET / HTTP/1.1\r\n\r\n", "the connection header"),
        (encode_header(HEADER) + struct.pack("<I", MAX_FRAME + 1), "a message"),
        (encode_header(HEADER) + b"\xff" * 8, "a message"),
    ],
)
def test_impossible_length_is_refused(data, what):
    with pytest.raises(DecodeError, match=f"/peer.*{what} claims to have"):
        Taken().give(data)


def test_header_with_too_many_fields_is_refused():
    # A million of them would keep the node's loop busy for half a second.
    with pytest.raises(DecodeError, match="more than 100 fields"):
        Taken().give(encode_header({f"n{k}": "" for k in range(101)}))


def test_memory_is_had_only_as_bytes_arrive():
    taken = Taken()
    taken.give(encode_header(HEADER) + struct.pack("<I", MAX_FRAME) + b"only this")
    room = taken.incoming.room
    assert room is not None
    assert len(room) < 2_000_000
    taken.give(b"x" * len(room))
    assert taken.incoming.room is not None
    assert len(taken.incoming.room) < 4_000_000
    assert taken.frames == []


def test_big_frames_are_views_that_stay_as_they_are():
    taken = Taken()
    taken.give(encode_header(HEADER))
    for number in range(8):
        taken.give(frame(bytes([number]) * 100_000))
    assert [bytes(one) for one in taken.frames] == [bytes([n]) * 100_000 for n in range(8)]
    assert all(type(one) is memoryview and one.readonly for one in taken.frames)


def test_unreferenced_buffers_are_reused():
    taken = Taken()
    taken.give(encode_header(HEADER))
    buffers = set()
    for _ in range(6):
        taken.give(frame(b"x" * 100_000))
        buffers.add(id(taken.frames.pop().obj))  # type: ignore[union-attr]
    assert len(buffers) <= 2


def test_stopped_reader_resumes_later():
    taken = Taken()
    taken.give(encode_header(HEADER))
    taken.incoming.stopped = True
    taken.give(frame(b"kept") + frame(b"too"))
    assert taken.frames == []
    taken.incoming.stopped = False
    taken.incoming.feed(b"")
    assert taken.frames == [b"kept", b"too"]


# -- sending -----------------------------------------------------------------------------------


def drain(outgoing: Outgoing, step: int = 1_000_000) -> bytes:
    sent = bytearray()

    def write(parts):
        (part,) = parts
        sent.extend(part[:step])
        return min(step, len(part))

    while len(outgoing):
        outgoing.send(write)
    return bytes(sent)


def test_oldest_message_is_dropped_and_counted():
    outgoing = Outgoing()
    for number in range(10):
        outgoing.add(Frame([b"%d" % number]), 0, 3, 0)
    assert (len(outgoing), outgoing.lost) == (3, 7)
    assert drain(outgoing) == b"789"
    assert outgoing.held == 0


def test_partly_sent_frame_is_finished():
    outgoing = Outgoing()
    outgoing.add(Frame([b"begun"]), 2, 1, 0)
    for number in range(5):
        outgoing.add(Frame([b"%d" % number]), 0, 1, 0)
    assert drain(outgoing, 1) == b"gun4"
    assert outgoing.lost == 4


def test_latched_message_is_not_dropped_before_a_newer_one_arrives():
    outgoing, latched = Outgoing(), Frame([b"L"], kept=True)
    outgoing.add(latched, 0, 0, 0)
    for number in range(5):
        outgoing.add(Frame([b"%d" % number]), 0, 2, 0)
    assert drain(outgoing) == b"L4"
    latched.kept = False
    outgoing.add(latched, 0, 0, 0)
    for number in range(5):
        outgoing.add(Frame([b"%d" % number]), 0, 2, 0)
    assert drain(outgoing) == b"34"


def test_keeping_all_is_bounded_by_bytes():
    outgoing = Outgoing()
    for _ in range(100):
        outgoing.add(Frame([b"x" * 100]), 0, 0, 1000)
    assert outgoing.held <= 1000
    assert outgoing.lost == 90


def test_waiting_data_is_copied_once():
    theirs = bytearray(b"0123456789")
    one = Frame([b"ab", theirs])
    rests = [one.rest(5), one.rest(0), one.rest(7)]
    theirs[:] = b"##########"
    assert [bytes(rest) for rest in rests] == [b"3456789", b"ab0123456789", b"56789"]
    assert rests[1].obj is rests[2].obj


def test_frames_may_have_many_parts():
    one = Frame([b"%d" % (n % 10) for n in range(1000)])
    assert (len(one.parts), one.size) == (1, 1000)

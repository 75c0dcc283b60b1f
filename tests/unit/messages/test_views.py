"""Messages in read-only views: nothing is copied, and all else is as with bytes."""

from __future__ import annotations

import copy
import gc
import pickle
import random
import weakref
from array import array
from typing import Any

import numpy as np
import pytest

from rosglass import DecodeError
from rosglass.messages import MessageType, load

TEXT = """\
string name
t/Part[] parts
t/Even[] even
float64[] values
bool[] bits
string[<=3] words
uint16 last
================================================================================
MSG: t/Part
string label
float64[] samples
bool good
================================================================================
MSG: t/Even
float64 x
int32 n
int32 m
"""
KIND = MessageType.from_text("t/msg/Everything", TEXT)
WIDE = MessageType.from_text("t/msg/Wide", "uint8 a\nwstring b\nwstring[] c")
VALUE: dict[str, Any] = {
    "name": "grüße",
    "parts": [{"label": f"p{i}", "samples": [i + 0.5] * i, "good": i == 1} for i in range(10)],
    "even": [{"x": float(i), "n": i, "m": -i} for i in range(4)],
    "values": [0.0, 1.0, 2.0],
    "bits": [True, False, True],
    "words": ["zero", "one", "grün"],
    "last": 9,
}
PATHS = (
    "name",
    "last",
    "parts[3].label",
    "parts[*].label",
    "parts[-1].samples[2]",
    "even[*].n",
    "even[2]",
    "parts",
    "parts[3]",
    "parts[1:3]",
    "parts[-1].samples",
    "even",
    "bits",
    "values",
    "values[1:]",
    "words[2]",
    "words",
)
IMAGE = load("sensor_msgs/msg/Image")
PICTURE = IMAGE.encode(height=2, width=3, step=3, encoding="mono8", data=bytes(range(6)))
FORMATS = [("cdr", "little"), ("cdr", "big"), ("ros1", "little")]


class Block(bytearray):
    """Memory that can be watched."""


def view(data: bytes) -> memoryview:
    return memoryview(Block(data)).toreadonly()


def plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


@pytest.mark.parametrize(("wire", "order"), FORMATS)
def test_view_reads_as_its_bytes_do(wire: str, order: str) -> None:
    data = KIND.encode(VALUE, wire=wire, byteorder=order)
    expected = KIND.decode(data, wire=wire)
    assert KIND.decode(view(data), wire=wire) == expected
    assert KIND.decode_all(view(data), wire=wire) == expected
    assert KIND.decode(view(data), wire=wire).to_json() == expected.to_json()
    KIND.validate(view(data), wire=wire)
    for path in PATHS:
        get = KIND.path(path, wire=wire)
        assert plain(get(view(data))) == plain(get(data)) == plain(get(view(data)))
        assert plain(expected[path]) == plain(KIND.decode(view(data), wire=wire)[path])
    get = KIND.path(*PATHS[:2], wire=wire)
    assert get(view(data)) == get(data) == (VALUE["name"], 9)


@pytest.mark.parametrize("path", ["parts", "parts[3]", "even[2]", "values", "even[*].x", "bits"])
@pytest.mark.parametrize(("wire", "order"), FORMATS)
def test_value_of_a_path_does_not_follow_a_changing_buffer(
    wire: str, order: str, path: str
) -> None:
    data = KIND.encode(VALUE, wire=wire, byteorder=order)
    for make in (lambda memory: memory, memoryview):
        memory = bytearray(data)
        found = KIND.path(path, wire=wire)(make(memory))
        memory[4:] = bytes(len(memory) - 4)
        assert plain(found) == plain(KIND.path(path, wire=wire)(data))


@pytest.mark.parametrize("width", [2, 4])
def test_wide_strings_are_read_from_views(width: int) -> None:
    value = {"a": 1, "b": "grün 🤖", "c": ["x", "", "yz"]}
    data = WIDE.encode(value, wstring_width=width)
    for message in (WIDE.decode(view(data)), WIDE.decode_all(view(data))):
        assert message.to_dict() == value
    assert WIDE.path("b")(view(data)) == value["b"]


@pytest.mark.parametrize(("wire", "order"), FORMATS)
def test_damage_is_reported_as_in_bytes(wire: str, order: str) -> None:
    data = KIND.encode(VALUE, wire=wire, byteorder=order)
    chance = random.Random(3)
    damaged = [data[:size] for size in range(0, len(data), 7)]
    for _ in range(200):
        broken = bytearray(data)
        broken[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        damaged.append(bytes(broken))

    def outcome(buffer: Any) -> str:
        try:
            return str(KIND.decode_all(buffer, wire=wire).to_json())
        except DecodeError as error:
            return str(error)

    differing = [buffer for buffer in damaged if outcome(buffer) != outcome(view(buffer))]
    assert differing == []


def test_nothing_is_copied_and_the_memory_lives_as_long_as_it_is_seen() -> None:
    block = Block(PICTURE)
    gone = weakref.ref(block)
    message = IMAGE.decode(memoryview(block).toreadonly())
    pixels = message.data
    assert np.shares_memory(pixels, np.frombuffer(block, np.uint8))
    assert not pixels.flags.writeable
    (size, same) = IMAGE.path("height", "data")(memoryview(block).toreadonly())
    assert size == 2
    assert np.shares_memory(same, np.frombuffer(block, np.uint8))
    del block, message, same
    gc.collect()
    assert gone() is not None
    assert pixels.tolist() == list(range(6))
    del pixels
    gc.collect()
    assert gone() is None


def test_elements_keep_the_memory_alive() -> None:
    block = Block(KIND.encode(VALUE))
    gone = weakref.ref(block)
    last = KIND.decode(memoryview(block).toreadonly()).parts[9]
    del block
    gc.collect()
    assert gone() is not None
    assert last.label == "p9"
    assert last.samples.tolist() == [9.5] * 9
    del last
    gc.collect()
    assert gone() is None


def test_untouched_message_is_passed_on() -> None:
    seen = view(PICTURE)
    message = IMAGE.decode(seen)
    (part,) = IMAGE.encode_parts(message)
    assert part is seen
    assert type(IMAGE.encode(message)) is bytes
    assert IMAGE.encode(message) == PICTURE
    assert message.height == 2
    assert b"".join(IMAGE.encode_parts(message)) == IMAGE.encode(message) == PICTURE


def test_other_byte_order_is_not_passed_on() -> None:
    big = IMAGE.encode(IMAGE.decode(PICTURE), byteorder="big")
    assert IMAGE.encode(IMAGE.decode(view(big))) == PICTURE
    (part,) = IMAGE.encode_parts(IMAGE.decode(view(big)), byteorder="big")
    assert part == big


def test_messages_in_views_are_compared_copied_and_pickled() -> None:
    message, same = IMAGE.decode(view(PICTURE)), IMAGE.decode(PICTURE)
    assert pickle.loads(pickle.dumps(message)) == same
    assert message == same
    assert message == copy.deepcopy(message)
    assert message.copy().data.flags.writeable
    assert pickle.loads(pickle.dumps(KIND.decode(view(KIND.encode(VALUE))).parts))[2].label == "p2"


def test_views_that_may_change_or_are_not_bytes_are_copied() -> None:
    block = bytearray(PICTURE)
    messages = [
        IMAGE.decode(memoryview(block)),
        IMAGE.decode(memoryview(array("B", block)).cast("b").toreadonly()),
        IMAGE.decode(block),
    ]
    block[:] = bytes(len(block))
    assert all(message == IMAGE.decode(PICTURE) for message in messages)
    spread = bytearray(2 * len(PICTURE))
    spread[::2] = PICTURE
    assert IMAGE.decode(memoryview(spread).toreadonly()[::2]) == IMAGE.decode(PICTURE)

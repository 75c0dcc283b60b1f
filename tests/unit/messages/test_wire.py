"""The wire formats, byte by byte where it matters, and what is not accepted."""

from __future__ import annotations

import pickle
import struct
from typing import Any

import numpy as np
import pytest

from rosglass import DecodeError, UnsupportedError
from rosglass.messages import Message, MessageType, load

LITTLE, BIG = b"\0\1\0\0", b"\0\0\0\0"


def hexed(text: str) -> bytes:
    return bytes.fromhex(text.replace("|", ""))


# Body after the CDR header, then ROS 1, both little endian; | marks fields.
VECTORS = [
    ("uint8 a\nuint32 b", {"a": 1, "b": 2}, "01|000000 02000000", "01|02000000"),
    (
        "uint8 a\nfloat64 b",
        {"a": 1, "b": 1.0},
        "01|00000000000000 000000000000f03f",
        "01|000000000000f03f",
    ),
    ("string a\nuint8 b", {"a": "hi", "b": 7}, "03000000 686900|07", "02000000 6869|07"),
    ("string a", {"a": ""}, "01000000 00", "00000000"),
    ("string a\nuint16 b", {"a": "abc", "b": 1}, "04000000 61626300|0100", "03000000 616263|0100"),
    (
        "string a\nuint32 b\nfloat64 c",
        {"a": "", "b": 1, "c": 1.0},
        "01000000 00|000000 01000000|00000000 000000000000f03f",
        "00000000|01000000|000000000000f03f",
    ),
    # No padding for the elements of an empty sequence (as Fast CDR and Cyclone write it).
    ("float64[] a\nuint8 b", {"a": [], "b": 1}, "00000000|01", "00000000|01"),
    (
        "float64[] a",
        {"a": [1.0]},
        "01000000|00000000 000000000000f03f",
        "01000000|000000000000f03f",
    ),
    ("float64[1] a", {"a": [1.0]}, "000000000000f03f", "000000000000f03f"),
    ("uint8 x\nint16[2] a", {"x": 1, "a": [1, -1]}, "01|00 0100 ffff", "01|0100 ffff"),
    ("bool[] a\nbool b", {"a": [True, False], "b": True}, "02000000 0100|01", "02000000 0100|01"),
    (
        "string[] a",
        {"a": ["x", "yz"]},
        "02000000|02000000 7800|0000 03000000 797a00",
        "02000000|01000000 78|02000000 797a",
    ),
    (
        "int64[] a\nint64 b",
        {"a": [], "b": 1},
        "00000000|00000000 0100000000000000",
        "00000000|0100000000000000",
    ),
]


@pytest.mark.parametrize(("text", "value", "cdr", "ros1"), VECTORS)
def test_bytes_are_as_specified(text: str, value: dict[str, Any], cdr: str, ros1: str) -> None:
    kind = MessageType.from_text("t/msg/Vector", text)
    for wire, data in (("cdr", LITTLE + hexed(cdr)), ("ros1", hexed(ros1))):
        assert kind.encode(value, wire=wire) == data
        assert kind.encode(kind.create(value), wire=wire) == data
        assert b"".join(kind.encode_parts(value, wire=wire)) == data
        assert kind.decode(data, wire=wire) == kind.create(value)
        assert kind.decode_all(data, wire=wire) == kind.create(value)
        kind.validate(data, wire=wire)


def test_big_endian_has_its_own_header() -> None:
    kind = MessageType.from_text("t/msg/Big", "uint16 a\nfloat32[] b\nstring c")
    data = kind.encode(a=1, b=[1.0], c="x", byteorder="big")
    assert data == BIG + hexed("0001|0000 00000001 3f800000|00000002 7800")
    message = kind.decode(data)
    assert (message.a, message.b.tolist(), message.c) == (1, [1.0], "x")
    assert kind.encode(message, byteorder="big") == data
    assert kind.encode(kind.decode(data)) == kind.encode(a=1, b=[1.0], c="x")
    assert kind.encode(kind.decode(data), byteorder="big") is data


def test_empty_messages_take_a_byte_in_cdr() -> None:
    empty = load("std_msgs/msg/Empty")
    assert empty.encode() == LITTLE + b"\0"
    assert empty.encode(wire="ros1") == b""
    assert empty.decode(empty.encode()) == empty.create()
    assert repr(empty.decode(b"", wire="ros1")) == "std_msgs/msg/Empty()"
    text = "std_msgs/Empty[] a\nstd_msgs/Empty b\nuint16 c\n" + "=" * 80 + "\nMSG: std_msgs/Empty\n"
    kind = MessageType.from_text("t/msg/Empties", text)
    value = {"a": [{}, {}, {}], "b": {}, "c": 5}
    assert kind.encode(value) == LITTLE + hexed("03000000 000000|00 0500")
    assert kind.encode(value, wire="ros1") == hexed("03000000 0500")
    for wire in ("cdr", "ros1"):
        assert kind.decode(kind.encode(value, wire=wire), wire=wire).to_dict() == value


@pytest.mark.parametrize(
    ("code", "name"),
    [
        (2, "PL_CDR_BE"),
        (3, "PL_CDR_LE"),
        (6, "CDR2_BE"),
        (7, "CDR2_LE"),
        (8, "D_CDR2_BE"),
        (9, "D_CDR2_LE"),
        (10, "PL_CDR2_BE"),
        (11, "PL_CDR2_LE"),
        (0x101, "unknown"),
    ],
)
def test_other_encapsulations_are_refused_by_name(code: int, name: str) -> None:
    kind = load("std_msgs/msg/Int32")
    data = struct.pack(">HH", code, 0) + bytes(4)
    for attempt in (kind.decode, kind.decode_all, kind.validate, kind.path("data")):
        with pytest.raises(DecodeError, match=f"{name} "):
            attempt(data)


def test_padding_at_the_end_is_normal_and_more_is_not() -> None:
    kind = load("std_msgs/msg/String")
    data = kind.encode(data="abc")
    for extra in range(4):
        kind.validate(data + bytes(extra))
        assert kind.decode(data + bytes(extra)).data == "abc"
    with pytest.raises(DecodeError, match="4 bytes left over") as caught:
        kind.validate(data + bytes(4))
    assert caught.value.offset == len(data)
    with pytest.raises(DecodeError, match="1 bytes left over"):
        kind.validate(kind.encode(data="abc", wire="ros1") + b"\0", wire="ros1")


def test_strings_are_read_leniently() -> None:
    kind = load("std_msgs/msg/String")
    for body, meant in (
        ("00000000", ""),  # some writers count no NUL for an empty string
        ("03000000 616263", "abc"),  # no NUL at all
        ("04000000 61006200", "a\0b"),
        ("03000000 61ff00", "a\udcff"),
    ):
        data = LITTLE + hexed(body)
        for message in (kind.decode(data), kind.decode_all(data)):
            assert message.data == meant
        assert kind.path("data")(data) == meant
        kind.validate(data)
    broken = kind.decode(LITTLE + hexed("03000000 61ff00"))
    assert kind.encode(broken.to_dict()) == LITTLE + hexed("03000000 61ff00")
    assert kind.encode(broken.copy()) == LITTLE + hexed("03000000 61ff00")


def test_nan_payloads_survive() -> None:
    kind = MessageType.from_text("t/msg/Nan", "float64 a\nfloat64[] b\nfloat32[] c\nfloat32 d")
    odd, quiet = 0x7FF8DEADBEEF0001, 0x7FC12345
    data = LITTLE + struct.pack("<Q", odd) + struct.pack("<IIQ", 1, 0, odd)
    data += struct.pack("<III", 1, quiet, quiet)
    message = kind.decode(data)
    assert message.a != message.a
    assert kind.encode(message) == data
    assert kind.encode(message.to_dict()) == data
    assert kind.encode(message.copy()) == data
    assert message == kind.decode_all(data)


@pytest.mark.parametrize("width", [2, 4])
@pytest.mark.parametrize("byteorder", ["little", "big"])
def test_wstrings_in_both_widths(width: int, byteorder: str) -> None:
    text = "uint8 before\nwstring one\nwstring[] more\nuint32 after"
    kind = MessageType.from_text("t/msg/Wide", text)
    value = {"before": 1, "one": "hé🤖", "more": ["", "a", "日本"], "after": 7}
    data = kind.encode(value, wstring_width=width, byteorder=byteorder)
    for given in (width, None):
        message = kind.decode(data, wstring_width=given)
        assert message.to_dict() == value
        assert kind.decode_all(data, wstring_width=given) == message
        assert kind.path("more[2]", "after", wstring_width=given)(data) == ("日本", 7)
        kind.validate(data, wstring_width=given)
    assert kind.encode(kind.decode(data), wstring_width=width, byteorder=byteorder) == data
    other = kind.encode(value, wstring_width=6 - width)
    assert kind.encode(kind.decode(data), wstring_width=6 - width) == other
    with pytest.raises(DecodeError):
        kind.validate(data, wstring_width=6 - width)


def test_wstring_bytes() -> None:
    kind = MessageType.from_text("t/msg/W", "wstring a\nuint8 b")
    # As rclpy 7.1.6 writes them, see tests/interop/ros2/test_rclpy_wstrings.py.
    assert kind.encode(a="hi", b=1) == LITTLE + hexed("02000000 6800000069000000|01")
    assert kind.encode(a="🤖", b=1) == LITTLE + hexed("02000000 3ed80000 16dd0000|01")
    assert kind.encode(a="hi", b=1, wstring_width=2) == LITTLE + hexed("02000000 68006900|01")
    with pytest.raises(UnsupportedError, match="2 or 4 bytes, not 3"):
        kind.encode(a="", wstring_width=3)


def test_wstring_width_follows_from_the_padding_if_nothing_else_shows_it() -> None:
    kind = MessageType.from_text("t/msg/W", "wstring a")
    # One character: 2 bytes and 2 of padding, or 4 bytes. The header's options count the padding.
    assert kind.decode(hexed("0001 0002 01000000 41000000")).a == "A"
    assert kind.encode(kind.decode(hexed("0001 0002 01000000 41000000")).copy()) == hexed(
        "0001 0000 01000000 41000000"
    )
    assert kind.decode(hexed("0001 0000 01000000 41000000")).a == "A"
    # As UTF-16 these were "A\0" with something left over.
    assert kind.decode(hexed("0001 0000 02000000 41000000 42000000")).a == "AB"
    with pytest.raises(DecodeError, match="beyond U"):
        _ = kind.decode(hexed("0001 0000 01000000 ffffffff"), wstring_width=4).a


def test_wstrings_survive_pickling() -> None:
    kind = MessageType.from_text("t/msg/W", "wstring[] a")
    for width in (2, 4):
        message = kind.decode(kind.encode(a=["", "ab"], wstring_width=width))
        assert pickle.loads(pickle.dumps(message)) == message


def test_parts_do_not_copy_big_arrays() -> None:
    kind = load("sensor_msgs/msg/Image")
    pixels = np.arange(10_000, dtype=np.uint8)
    for value in ({"data": pixels}, kind.create(data=pixels)):
        parts = kind.encode_parts(value)
        assert all(isinstance(part, (bytes, memoryview)) for part in parts)
        assert any(np.shares_memory(np.frombuffer(part, np.uint8), pixels) for part in parts)
        assert all(memoryview(part).format == "B" for part in parts)
        assert b"".join(parts) == kind.encode(value)
    big = kind.encode_parts({"data": pixels}, byteorder="big")
    assert b"".join(big) == kind.encode({"data": pixels}, byteorder="big")
    gaps = kind.encode_parts({"data": pixels[::2]})
    assert b"".join(gaps) == kind.encode({"data": pixels[::2].copy()})
    assert b"".join(kind.encode_parts()) == kind.encode()


@pytest.mark.parametrize("wire", ["cdr", "ros1"])
def test_every_cut_is_noticed(wire: str) -> None:
    kind = load("visualization_msgs/msg/Marker")
    value = {"ns": "a", "points": [{}, {}], "colors": [{}], "text": "x", "mesh_resource": "y"}
    data = kind.encode(value, wire=wire)
    for length in range(len(data)):
        cut = data[:length]
        for attempt in (
            kind.validate,
            kind.decode_all,
            lambda cut, wire: Message.to_dict(kind.decode(cut, wire=wire)),
        ):
            with pytest.raises(DecodeError) as caught:
                attempt(cut, wire=wire)
            assert caught.value.type_name.split("/")[0] in {"visualization_msgs", "geometry_msgs"}


def test_hostile_counts_name_the_field() -> None:
    kind = load("sensor_msgs/msg/JointState")
    data = bytearray(kind.encode(name=["a"], position=[1.0]))
    data[20:24] = b"\xff\xff\xff\xff"
    with pytest.raises(DecodeError, match="claims 4294967295 elements") as caught:
        kind.decode_all(bytes(data))
    assert caught.value.path == "name"
    assert caught.value.offset == 20


def test_nonsense_arguments_are_errors() -> None:
    kind = load("std_msgs/msg/Int32")
    kind.decode(kind.encode(data=1))  # later calls take a shorter way
    for call in (
        lambda: kind.decode(b"", wire="xcdr"),
        lambda: kind.encode(data=1, wire="json"),
        lambda: kind.encode(data=1, wire=["cdr"]),  # type: ignore[arg-type]
        lambda: kind.encode(data=1, byteorder="middle"),
        lambda: kind.encode(data=1, wire="ros1", byteorder="big"),
        lambda: kind.decode(kind.encode(data=1), wstring_width=8),
        lambda: kind.path("data", wire="x"),
    ):
        with pytest.raises(UnsupportedError):
            call()
    for nonsense in ("text", None, 5, ["a"]):
        with pytest.raises(DecodeError, match="expected bytes"):
            kind.decode(nonsense)


@pytest.mark.parametrize("ros", [1, 2])
def test_types_of_one_ros_version_travel_in_the_format_of_the_other(ros: int) -> None:
    kind = load("sensor_msgs/msg/JointState", ros=ros)
    message = kind.create(name=["a"], position=[1.0])
    for wire in ("cdr", "ros1"):
        assert kind.decode(kind.encode(message, wire=wire), wire=wire) == message

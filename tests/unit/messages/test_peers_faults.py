"""Faults of peers where we differ on purpose: one test per fault, the peer's words first.

Each test pins the peer's behaviour too, so that a fixed peer shows up here and the work-around in
``peers.py`` can go.
"""

from __future__ import annotations

import struct
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import rosglass
from rosglass import DecodeError

from . import corpus, peers
from .ours import from_text

LITTLE = b"\x00\x01\x00\x00"


def mcap_functions(name: str, text: str) -> tuple[Any, Any]:
    dynamic = peers.need_mcap()
    return (
        dynamic.generate_dynamic(name, text)[name],
        dynamic.serialize_dynamic(name, text)[name],
    )


def genpy_class(name: str, text: str) -> Any:
    return peers.need_genpy().generate_dynamic(name, text)[name]


@pytest.mark.parametrize("text", ["é", "ÅÄÖ", "日本語", "🤖"])
@pytest.mark.parametrize("wire", ["ros1", "cdr"])
def test_string_length_counts_bytes(text: str, wire: str) -> None:
    # Foxglove's ROS 2 writer counts UTF-16 units and cuts the bytes off on the wire.
    kind = rosglass.load("std_msgs/msg/String", ros=1 if wire == "ros1" else 2)
    raw = text.encode()
    body = raw if wire == "ros1" else raw + b"\0"
    expected = (b"" if wire == "ros1" else LITTLE) + struct.pack("<I", len(body)) + body
    assert kind.encode({"data": text}, wire=wire) == expected
    assert kind.decode(expected, wire=wire).data == text


@pytest.mark.parametrize("value", [128, 200, 255])
def test_ros2_byte_is_unsigned(value: int) -> None:
    # rosbags takes ROS 2's byte for an int8; rosidl maps it to octet, 0 to 255.
    store = corpus.store(2)
    with pytest.raises(struct.error):
        store.serialize_cdr(store.types["std_msgs/msg/Byte"](data=value), "std_msgs/msg/Byte")
    data = LITTLE + bytes([value])
    assert store.deserialize_cdr(data, "std_msgs/msg/Byte").data == value - 256

    kind = rosglass.load("std_msgs/msg/Byte", ros=2)
    assert kind.encode({"data": value}, wire="cdr") == data
    assert kind.decode(data, wire="cdr").data == value


@pytest.mark.peers
@pytest.mark.parametrize("value", [128, 200, 255])
def test_ros2_char_is_unsigned(value: int) -> None:
    # mcap-ros2 takes ROS 2's char for an int8; rosidl maps it to uint8.
    read, write = mcap_functions("std_msgs/msg/Char", "char data")
    with pytest.raises(struct.error):
        write({"data": value})
    data = LITTLE + bytes([value])
    assert read(data).data == value - 256

    kind = rosglass.load("std_msgs/msg/Char", ros=2)
    assert kind.encode({"data": value}, wire="cdr") == data
    assert kind.decode(data, wire="cdr").data == value


def test_ros1_byte_is_signed_and_char_unsigned() -> None:
    byte, char = (rosglass.load(f"std_msgs/{name}", ros=1) for name in ("Byte", "Char"))
    assert byte.decode(b"\xc8", wire="ros1").data == -56
    assert char.decode(b"\xc8", wire="ros1").data == 200


def test_ros1_duration_has_signed_nanoseconds() -> None:
    # rosbags reads ROS 1's duration as int32 + uint32; it is int32 + int32.
    data = struct.pack("<ii", -1, -500_000_000)
    store = corpus.store(1)
    theirs = store.deserialize_ros1(data, "std_msgs/msg/Duration").data
    assert (theirs.sec, theirs.nanosec) == (-1, 2**32 - 500_000_000)

    kind = rosglass.load("std_msgs/Duration", ros=1)
    ours = kind.decode(data, wire="ros1")
    assert (ours.data.secs, ours.data.nsecs) == (-1, -500_000_000)
    assert kind.encode(ours.to_dict(), wire="ros1") == data


@pytest.mark.parametrize("seconds", [2**31, 3_000_000_000, 2**32 - 1])
def test_ros1_time_goes_on_after_2038(seconds: int) -> None:
    # rosbags reads ROS 1's time as int32 + uint32; it is uint32 + uint32.
    data = struct.pack("<II", seconds, 1)
    store = corpus.store(1)
    assert store.deserialize_ros1(data, "std_msgs/msg/Time").data.sec == seconds - 2**32

    kind = rosglass.load("std_msgs/Time", ros=1)
    assert kind.decode(data, wire="ros1").data.secs == seconds
    assert kind.encode({"data": {"secs": seconds, "nsecs": 1}}, wire="ros1") == data


@pytest.mark.peers
def test_ros2_duration_is_signed_without_its_definition_at_hand() -> None:
    # mcap-ros2 falls back to uint32 seconds when the schema does not spell Duration out.
    data = LITTLE + struct.pack("<iI", -2, 5)
    read, _ = mcap_functions("a_msgs/msg/A", "builtin_interfaces/Duration span")
    assert read(data).span.sec == 2**32 - 2

    message = rosglass.load("builtin_interfaces/msg/Duration", ros=2).decode(data, wire="cdr")
    assert (message.sec, message.nanosec) == (-2, 5)


TRUNCATED = struct.pack("<I", 0xFFFFFFFF) + b"\x07"


@pytest.mark.genpy
def test_genpy_takes_one_byte_for_four_thousand_million() -> None:
    kind = genpy_class("a_msgs/A", "uint8[] data\n")
    assert kind().deserialize(TRUNCATED).data == b"\x07"


@pytest.mark.peers
def test_mcap_takes_one_byte_for_four_thousand_million() -> None:
    read, _ = mcap_functions("a_msgs/msg/A", "uint8[] data")
    assert read(LITTLE + TRUNCATED).data == b"\x07"


def test_truncated_bytes_are_an_error() -> None:
    data = TRUNCATED
    for ros, wire, buffer in ((1, "ros1", data), (2, "cdr", LITTLE + data)):
        kind = from_text("a_msgs/msg/A", "uint8[] data", ros)
        with pytest.raises(DecodeError, match="data"):
            len(kind.decode(buffer, wire=wire).data)
        with pytest.raises(DecodeError, match="data"):
            kind.decode_all(buffer, wire=wire)
        with pytest.raises(DecodeError, match="data"):
            kind.validate(buffer, wire=wire)


@pytest.mark.peers
@pytest.mark.parametrize(
    ("identifier", "name"),
    [
        (2, "PL_CDR"),
        (3, "PL_CDR"),
        (6, "CDR2"),
        (7, "CDR2"),
        (8, "D_CDR2"),
        (9, "D_CDR2"),
        (10, "PL_CDR2"),
        (11, "PL_CDR2"),
        (66, "42"),
    ],
)
def test_other_encapsulations_are_rejected_by_name(identifier: int, name: str) -> None:
    # mcap-ros2 only looks at the lowest bit and decodes parameter lists and XCDR2 as plain CDR.
    data = bytes([0, identifier, 0, 0]) + struct.pack("<d" if identifier & 1 else ">d", 1.5)
    read, _ = mcap_functions("std_msgs/msg/Float64", "float64 data")
    assert read(data).data == 1.5

    kind = rosglass.load("std_msgs/msg/Float64", ros=2)
    for use in (lambda b: kind.decode(b, wire="cdr").data, kind.decode_all, kind.validate):
        with pytest.raises(DecodeError, match=name):
            use(data)
    with pytest.raises(DecodeError, match=name):
        kind.path("data", wire="cdr")(data)


@pytest.mark.genpy
def test_genpy_rewrites_durations() -> None:
    data = struct.pack("<ii", -1, -500_000_000)
    theirs = BytesIO()
    genpy_class("std_msgs/Duration", "duration data\n")().deserialize(data).serialize(theirs)
    assert struct.unpack("<ii", theirs.getvalue()) == (-2, 500_000_000)


def test_ros1_duration_keeps_its_bytes() -> None:
    data = struct.pack("<ii", -1, -500_000_000)
    kind = rosglass.load("std_msgs/Duration", ros=1)
    for message in (kind.decode(data, wire="ros1"), kind.decode_all(data, wire="ros1")):
        assert kind.encode(message, wire="ros1") == data
        assert kind.encode(message.to_dict(), wire="ros1") == data


LATIN1 = b"caf\xe9"


@pytest.mark.genpy
def test_genpy_replaces_invalid_utf8() -> None:
    data = struct.pack("<I", len(LATIN1)) + LATIN1
    assert genpy_class("std_msgs/String", "string data\n")().deserialize(data).data == "caf\ufffd"


def test_rosbags_gives_the_message_up_for_invalid_utf8() -> None:
    data = struct.pack("<I", len(LATIN1)) + LATIN1
    with pytest.raises(SerdeError):
        corpus.store(1).deserialize_ros1(data, "std_msgs/msg/String")


@pytest.mark.parametrize("wire", ["ros1", "cdr"])
def test_invalid_utf8_survives(wire: str) -> None:
    raw = LATIN1
    ros1 = struct.pack("<I", len(raw)) + raw
    cdr = LITTLE + struct.pack("<I", len(raw) + 1) + raw + b"\0"
    data = ros1 if wire == "ros1" else cdr
    kind = rosglass.load("std_msgs/msg/String", ros=1 if wire == "ros1" else 2)
    for message in (kind.decode(data, wire=wire), kind.decode_all(data, wire=wire)):
        assert message.data.startswith("caf")
        assert kind.encode(message.to_dict(), wire=wire) == data


@pytest.mark.parametrize("width", [2, 4])
@pytest.mark.parametrize("text", ["", "a", "Grüße", "日本語", "🤖 drives"])
@pytest.mark.parametrize("byteorder", ["little", "big"])
def test_wstring_in_both_widths(text: str, width: int, byteorder: str) -> None:
    # No peer of Python knows wstring. ROS 2's nodes write the count of UTF-16 units and 4 bytes for
    # each, OMG's CDR for UTF-16 the same count and 2 bytes for each; no terminator.
    order = "<" if byteorder == "little" else ">"
    native = text.encode("utf-16-le")
    units = struct.unpack(f"<{len(native) // 2}H", native)
    raw = struct.pack(f"{order}{len(units)}{'H' if width == 2 else 'I'}", *units)
    header = LITTLE if byteorder == "little" else bytes(4)
    prefix = header + b"\x05" + bytes(3)
    data = prefix + struct.pack(order + "I", len(raw) // width) + raw
    data += bytes(-(len(data) - 4) % 2) + struct.pack(order + "H", 77)
    kind = from_text("a_msgs/msg/A", "uint8 before\nwstring text\nuint16 after", ros=2)
    value = {"before": 5, "text": text, "after": 77}
    encoded = kind.encode(value, wire="cdr", byteorder=byteorder, wstring_width=width)
    assert encoded == data
    for message in (
        kind.decode(data, wire="cdr", wstring_width=width),
        kind.decode_all(data, wire="cdr", wstring_width=width),
    ):
        assert message.to_dict() == value


@pytest.mark.peers
def test_peers_do_not_know_wstring() -> None:
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg("wstring data", "a_msgs/msg/A"))
    with pytest.raises(KeyError, match="wstring"):
        store.deserialize_cdr(LITTLE + bytes(4), "a_msgs/msg/A")
    read, write = mcap_functions("a_msgs/msg/A", "wstring data")
    with pytest.raises(NotImplementedError):
        read(LITTLE + bytes(4))
    with pytest.raises(NotImplementedError):
        write({"data": "a"})


@pytest.mark.parametrize("wire", ["ros1", "cdr"])
def test_cyclic_types_are_refused_when_loaded(wire: str) -> None:
    # rosbags and genpy run into the recursion limit, mcap-ros2 decodes until the data ends.
    ros = 1 if wire == "ros1" else 2
    text = f"a_msgs/B b\n{'=' * 80}\nMSG: a_msgs/B\na_msgs/A[] a\n"
    with pytest.raises(rosglass.CyclicTypeError, match=r"A.*B.*A"):
        from_text("a_msgs/msg/A", text, ros).decode(bytes(8), wire=wire)


@pytest.mark.parametrize("count", [0, 1, 3, 1000])
def test_ros1_empty_messages_in_a_list_take_no_bytes(count: int) -> None:
    text = f"std_msgs/Empty[] e\nuint8 after\n\n{'=' * 80}\nMSG: std_msgs/Empty\n"
    kind = from_text("a_msgs/msg/A", text, ros=1)
    data = struct.pack("<IB", count, 9)
    message = kind.decode(data, wire="ros1")
    assert message.after == 9
    assert len(message.e) == count
    kind.validate(data, wire="ros1")
    assert kind.path("after", wire="ros1")(data) == 9


def test_ros1_countless_empty_messages_are_refused() -> None:
    # Nothing in the bytes limits their number, so a limit of ours has to.
    text = f"std_msgs/Empty[] e\n\n{'=' * 80}\nMSG: std_msgs/Empty\n"
    kind = from_text("a_msgs/msg/A", text, ros=1)
    with pytest.raises(DecodeError, match="e"):
        kind.decode_all(b"\xff\xff\xff\xff", wire="ros1")


def test_bool_arrays_take_any_byte_but_zero_for_true() -> None:
    kind = from_text("a_msgs/msg/A", "bool[] flags\nbool one", ros=1)
    data = struct.pack("<I", 4) + b"\x00\x01\x02\xff" + b"\x07"
    for message in (kind.decode(data, wire="ros1"), kind.decode_all(data, wire="ros1")):
        assert list(message.flags) == [False, True, True, True]
        assert message.one is True
        clean = struct.pack("<I", 4) + b"\x00\x01\x01\x01" + b"\x01"
        assert kind.encode(message.to_dict(), wire="ros1") == clean


def test_arrays_of_numbers_are_views_of_the_buffer() -> None:
    kind = rosglass.load("sensor_msgs/msg/Image", ros=2)
    data = kind.encode({"data": np.arange(256, dtype=np.uint8)}, wire="cdr")
    view = kind.decode(data, wire="cdr").data
    assert np.shares_memory(np.asarray(view), np.frombuffer(data, np.uint8))
    assert not np.asarray(view).flags.writeable

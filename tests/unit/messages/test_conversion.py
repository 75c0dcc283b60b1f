"""Conversions in: what is taken, what is refused, and how the refusal reads."""

from __future__ import annotations

import array
import collections
import types
from typing import Any

import numpy as np
import pytest

import rosglass
from rosglass import ConversionError
from rosglass.messages import MessageType, load

NAN, INF = float("nan"), float("inf")


def scalar(kind: str) -> MessageType:
    return MessageType.from_text("t/msg/One", f"{kind} data")


def array_of(kind: str) -> MessageType:
    return MessageType.from_text("t/msg/Many", f"{kind} data")


@pytest.mark.parametrize(
    ("kind", "value", "meant"),
    [
        ("uint8", 255, 255),
        ("uint8", 2.0, 2),
        ("uint8", np.int64(7), 7),
        ("uint8", np.float32(7.0), 7),
        ("byte", b"\xc8", 200),
        ("byte", bytearray(b"\2"), 2),
        ("int64", -(2**63), -(2**63)),
        ("uint64", 2**64 - 1, 2**64 - 1),
        ("float64", 3, 3.0),
        ("float64", np.float32(0.5), 0.5),
        ("float64", np.int8(-1), -1.0),
        ("float64", INF, INF),
        ("float32", -INF, -INF),
        ("float32", 3.4028234e38, np.float32(3.4028234e38)),
        ("bool", True, True),
        ("bool", np.bool_(False), False),
        ("string", "grüße", "grüße"),
        ("string", np.str_("a"), "a"),
        ("string", "a\0b", "a\0b"),
        ("string", "\udcff", "\udcff"),
        ("wstring", "日本🤖", "日本🤖"),
    ],
)
def test_values_that_fit(kind: str, value: Any, meant: Any) -> None:
    one = scalar(kind)
    for data in (one.encode(data=value), one.encode(one.create(data=value))):
        assert one.decode(data).data == meant


def test_byte_is_written_as_rclpy_writes_it_and_read_as_a_number() -> None:
    status = rosglass.load("diagnostic_msgs/msg/DiagnosticStatus")
    message = status.create()
    message.level = b"\x02"
    assert status.decode(status.encode(message)).level == 2
    assert message.to_dict()["level"] == 2
    assert '"level": 2' in message.to_json()
    signed = MessageType.from_text("t/One", "byte data\nbyte[] more", ros=1)
    made = signed.decode(signed.encode(data=b"\xff", more=[b"\xfe", 1]))
    assert (made.data, made.more.tolist()) == (-1, [-2, 1])


@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        ("uint8", 256, "an integer from 0 to 255 (uint8)"),
        ("uint8", -1, "an integer from 0 to 255 (uint8)"),
        ("int8", 128, "an integer from -128 to 127 (int8)"),
        ("byte", 256, "an integer from 0 to 255, or bytes of length 1 (byte)"),
        ("byte", b"", "an integer, or bytes of length 1 (byte)"),
        ("byte", b"ab", "an integer, or bytes of length 1 (byte)"),
        ("uint8", b"a", "an integer (uint8)"),
        ("int32", 1.5, "an integer (int32)"),
        ("int32", NAN, "an integer (int32)"),
        ("int32", INF, "an integer (int32)"),
        ("int64", 2.0**63, "an integer from -9223372036854775808"),
        ("int32", True, "an integer (int32)"),
        ("int32", np.bool_(True), "an integer (int32)"),
        ("int32", "1", "an integer (int32)"),
        ("int32", None, "an integer (int32)"),
        ("int32", [1], "an integer (int32)"),
        ("int32", np.array([1]), "an integer (int32)"),
        ("float64", True, "a number (float64)"),
        ("float64", np.bool_(True), "a number (float64)"),
        ("float64", "1.0", "a number (float64)"),
        ("float64", None, "a number (float64)"),
        ("float64", 10**400, "a number within the range of float64 (float64)"),
        ("float64", 1j, "a number (float64)"),
        ("float32", 1e39, "a number within +-3.4028235e+38 (float32)"),
        ("float32", -(10**60), "a number within +-3.4028235e+38 (float32)"),
        ("bool", 1, "a bool, True or False (bool)"),
        ("bool", "true", "a bool, True or False (bool)"),
        ("string", b"abc", "a string (decode the bytes first)"),
        ("string", 5, "a string"),
        ("string", None, "a string"),
        ("string", "\ud800", "text that UTF-8 can encode"),
        ("string<=3", "abcd", "at most 3 bytes of UTF-8, not 4"),
        ("string<=3", "äää", "at most 3 bytes of UTF-8, not 6"),
        ("wstring<=3", "🤖🤖", "at most 3 UTF-16 units, not 4"),
    ],
)
def test_values_that_do_not_fit(kind: str, value: Any, expected: str) -> None:
    one = scalar(kind)
    message = one.create()
    message.data = value
    for attempt in (
        lambda: one.encode(data=value),
        lambda: one.encode_parts({"data": value}),
        lambda: one.create(data=value),
        lambda: one.encode(message),
    ):
        with pytest.raises(ConversionError) as caught:
            attempt()
        assert caught.value.path == "data"
        assert caught.value.expected.startswith(expected)
        assert caught.value.type_name == "t/msg/One"


@pytest.mark.parametrize(
    ("kind", "value", "meant"),
    [
        ("uint8[]", b"ab", [97, 98]),
        ("uint8[]", bytearray(b"ab"), [97, 98]),
        ("uint8[]", memoryview(b"abcd")[::2], [97, 99]),
        ("byte[]", b"\xff", [255]),
        ("uint8[]", np.array([1, 2], np.int64), [1, 2]),
        ("int16[]", np.array([1.0, -2.0]), [1, -2]),
        ("int16[]", np.array([1, 2], ">i2"), [1, 2]),
        ("float64[]", [1, 2.5], [1.0, 2.5]),
        ("float64[]", (1.0,), [1.0]),
        ("float64[]", range(3), [0.0, 1.0, 2.0]),
        ("float64[]", np.arange(10.0)[::3], [0.0, 3.0, 6.0, 9.0]),
        ("float64[]", array.array("f", [1.0]), [1.0]),
        ("float64[]", np.array([1, 2.5], object), [1.0, 2.5]),
        ("float32[]", np.array([INF, 1e-60]), [INF, 0.0]),
        ("float32[2]", np.array([1.0, 2.0]), [1.0, 2.0]),
        ("int32[<=2]", [1], [1]),
        ("bool[]", [True, np.bool_(False)], [True, False]),
        ("bool[]", np.array([True, False]), [True, False]),
        ("string[]", ("a", "b"), ["a", "b"]),
        ("string[]", np.array(["a", "b"]), ["a", "b"]),
        ("string[]", collections.deque(["a"]), ["a"]),
    ],
)
@pytest.mark.parametrize("byteorder", ["little", "big"])
def test_arrays_that_fit(kind: str, value: Any, meant: Any, byteorder: str) -> None:
    many = array_of(kind)
    message = many.create(data=value)
    assert list(message.data) == meant
    for given in ({"data": value}, message):
        data = many.encode(given, byteorder=byteorder)
        assert b"".join(many.encode_parts(given, byteorder=byteorder)) == data
        assert list(many.decode(data).data) == meant


@pytest.mark.parametrize(
    ("kind", "value", "path", "expected"),
    [
        ("uint8[]", [1, 256], "data[1]", "an integer from 0 to 255"),
        ("uint8[]", np.array([1, -1]), "data[1]", "an integer from 0 to 255"),
        ("uint8[]", np.array([1.0, 0.5]), "data[1]", "an integer (uint8)"),
        ("uint64[]", np.array([2.0**64]), "data[0]", "an integer from 0 to"),
        ("int64[]", np.array([2**63], np.uint64), "data[0]", "an integer from"),
        ("int32[]", np.array([NAN]), "data[0]", "an integer (int32)"),
        ("int32[]", [1, True], "data[1]", "an integer (int32)"),
        ("int32[]", np.array([True]), "data", "an array of int32, not of bool"),
        ("int32[]", b"abcd", "data", "a list or numpy array of int32"),
        ("bool[]", b"\1", "data", "a list or numpy array of bool"),
        ("bool[]", np.array([1, 0]), "data", "an array of bool, not of int64"),
        ("bool[]", [1], "data[0]", "a bool"),
        ("float64[]", "abc", "data", "a list of float64"),
        ("float64[]", 1.0, "data", "a list of float64"),
        ("float64[]", None, "data", "a list of float64"),
        ("float64[]", {1.0}, "data", "a list of float64"),
        ("float64[]", iter([1.0]), "data", "a list of float64"),
        ("float64[]", np.zeros((2, 2)), "data", "one dimension, not 2"),
        ("float64[]", np.array(1.0), "data", "one dimension, not 0"),
        ("float64[]", np.array(["a"]), "data", "an array of float64, not of <U1"),
        ("float64[]", np.array([1j]), "data", "an array of float64, not of complex128"),
        ("float64[]", np.array([1.0, None], object), "data[1]", "a number (float64)"),
        ("float32[]", np.array([1.0, 1e39]), "data[1]", "a number within"),
        ("float32[]", [1e39], "data[0]", "a number within"),
        ("float64[3]", [1.0], "data", "exactly 3 elements, not 1"),
        ("float64[3]", np.zeros(4), "data", "exactly 3 elements, not 4"),
        ("float64[<=3]", np.zeros(4), "data", "at most 3 elements, not 4"),
        ("float64[<=3]", [1.0] * 4, "data", "at most 3 elements, not 4"),
        ("string[]", "abc", "data", "a list of string"),
        ("string[]", ["a", b"b"], "data[1]", "a string"),
        ("string[<=1]", ["a", "b"], "data", "at most 1 elements, not 2"),
        ("string[2]", ["a"], "data", "exactly 2 elements, not 1"),
        ("string<=1[]", ["a", "bb"], "data[1]", "at most 1 bytes"),
    ],
)
def test_arrays_that_do_not_fit(kind: str, value: Any, path: str, expected: str) -> None:
    many = array_of(kind)
    for attempt in (many.encode, many.encode_parts, many.create):
        with pytest.raises(ConversionError) as caught:
            attempt({"data": value})
        assert caught.value.path == path
        assert caught.value.expected.startswith(expected)


@pytest.mark.parametrize(
    ("value", "path", "expected"),
    [
        ({"headr": {}}, "headr", "did you mean 'header'"),
        ({"header": {"stamp": {"secs": 1}}}, "header.stamp.secs", "did you mean 'sec'"),
        ({5: 1}, "5", "a field of nav_msgs/msg/Path"),
        ({"poses": [{}, {"pose": {"position": {"x": "a"}}}]}, "poses[1].pose.position.x", "a num"),
        ({"poses": {"x": 1}}, "poses", "a list of geometry_msgs/msg/PoseStamped"),
        ({"poses": {}}, "poses", "a list of geometry_msgs/msg/PoseStamped"),
        ({"poses": ""}, "poses", "a list of geometry_msgs/msg/PoseStamped"),
        ({"poses": iter([{}])}, "poses", "a list of geometry_msgs/msg/PoseStamped"),
        ({"poses": [None]}, "poses[0]", "a dict or a geometry_msgs/msg/PoseStamped"),
        ({"header": []}, "header", "a dict or a std_msgs/msg/Header"),
        ({"header": 3}, "header", "a dict or a std_msgs/msg/Header"),
        ([("header", {})], "", "a dict or a nav_msgs/msg/Path"),
        ("header", "", "a dict or a nav_msgs/msg/Path"),
    ],
)
def test_messages_that_do_not_fit(value: Any, path: str, expected: str) -> None:
    kind = load("nav_msgs/msg/Path")
    for attempt in (kind.encode, kind.encode_parts, kind.create):
        with pytest.raises(ConversionError) as caught:
            attempt(value)
        assert caught.value.path == path
        assert expected in caught.value.expected
        assert "nav_msgs/msg/Path" in str(caught.value)


@pytest.mark.parametrize("value", ["", b"", [], (), set(), np.array([])])
def test_nothing_but_a_dict_makes_an_empty_message(value: Any) -> None:
    kind = MessageType.from_text("t/msg/Has", "Empty e\n===\nMSG: t/Empty\n")
    for attempt in (kind.encode, kind.encode_parts, kind.create):
        with pytest.raises(ConversionError) as caught:
            attempt({"e": value})
        assert caught.value.path == "e"
    assert kind.encode({"e": {}}) == kind.encode(e=collections.OrderedDict()) == kind.encode()


def test_other_messages_are_refused() -> None:
    path, pose = load("nav_msgs/msg/Path"), load("geometry_msgs/msg/Pose")
    with pytest.raises(ConversionError, match="expected a nav_msgs/msg/Path"):
        path.encode(pose.create())
    with pytest.raises(ConversionError, match="expected a std_msgs/msg/Header of ROS 2"):
        path.encode(header=load("std_msgs/Header", ros=1).create())
    # The same fields do not make the same type.
    transform = load("geometry_msgs/msg/Transform").create()
    transform.translation = load("geometry_msgs/msg/Point").create()
    with pytest.raises(ConversionError, match="translation: expected a geometry_msgs/msg/Vector3"):
        load("geometry_msgs/msg/Transform").encode(transform)


def test_any_mapping_will_do_and_messages_inside_it() -> None:
    kind = load("geometry_msgs/msg/PoseStamped")
    pose = load("geometry_msgs/msg/Pose")
    shell = pose.decode(pose.encode(position={"y": 2.0}))
    value = types.MappingProxyType({"header": collections.OrderedDict(frame_id="m"), "pose": shell})
    message = kind.decode(kind.encode(value))
    assert (message.header.frame_id, message.pose.position.y) == ("m", 2.0)
    assert message.pose.orientation.w == 1.0  # the definition's default


def test_keywords_and_values_can_be_combined() -> None:
    kind = load("geometry_msgs/msg/Twist")
    base = kind.create(linear={"x": 1.0})
    assert kind.decode(kind.encode(base, angular={"z": 2.0})).angular.z == 2.0
    assert kind.create({"linear": {"x": 3.0}}, angular={"z": 2.0}).linear.x == 3.0
    assert base.angular.z == 0.0
    assert kind(linear={"x": 4.0}).linear.x == 4.0
    with pytest.raises(ConversionError) as caught:
        kind.encode(base, angle={})
    assert caught.value.path == "angle"


@pytest.mark.parametrize(
    ("given", "parts"),
    [
        (rosglass.Time(1_500_000_001), (1, 500_000_001)),
        (rosglass.Duration(-500_000_000), (-1, 500_000_000)),
        (types.SimpleNamespace(secs=3, nsecs=4), (3, 4)),
        (types.SimpleNamespace(sec=3, nanosec=4), (3, 4)),
    ],
)
def test_times_take_what_looks_like_a_time(given: Any, parts: tuple[int, int]) -> None:
    two = load("builtin_interfaces/msg/Duration")
    assert tuple(two.decode(two.encode(given)).to_dict().values()) == parts
    header = load("std_msgs/msg/Header")
    assert tuple(header.create(stamp=given).stamp.to_dict().values()) == parts
    one = load("std_msgs/Duration", ros=1)
    assert tuple(one.decode(one.encode(data=given)).data.to_dict().values()) == parts


def test_times_are_checked_like_everything_else() -> None:
    header = load("std_msgs/Header", ros=1)
    with pytest.raises(ConversionError) as caught:
        header.encode(stamp=rosglass.Time(-1))
    assert caught.value.path == "stamp.secs"
    with pytest.raises(ConversionError, match="expected a dict or a time"):
        header.encode(stamp=1.5)
    assert header.encode(stamp={"secs": 2**32 - 1, "nsecs": 0})[4:8] == b"\xff" * 4
    duration = load("std_msgs/Duration", ros=1)
    kept = duration.decode(duration.encode(data={"secs": -1, "nsecs": -500_000_000})).data
    assert (kept.secs, kept.nsecs) == (-1, -500_000_000)


def test_missing_fields_are_completed_alike_everywhere() -> None:
    kind = load("visualization_msgs/msg/Marker")
    value = {"ns": "a", "points": [{"x": 1.0}, {}], "pose": {"position": {"z": 1.0}}}
    assert kind.encode(value) == kind.encode(kind.create(value))
    assert b"".join(kind.encode_parts(value)) == kind.encode(value)
    assert kind.encode() == kind.encode({}) == kind.encode(kind.create())

"""Messages: shells that become plain objects, and what both can do."""

from __future__ import annotations

import copy
import pickle
import sys
import threading
from typing import Any

import numpy as np
import pytest

import rosglass
from rosglass import ConversionError, DecodeError, FieldPathError
from rosglass.interfaces.definition import Definition, Field, FieldType
from rosglass.messages import Message, MessageType, load

IMU = load("sensor_msgs/msg/Imu")
PATH = load("nav_msgs/msg/Path")


def imu() -> bytes:
    return IMU.encode(
        header={"frame_id": "imu", "stamp": {"sec": 1, "nanosec": 2}},
        orientation={"w": 1.5},
        orientation_covariance=range(9),
    )


def way(count: int = 20) -> bytes:
    poses = [
        {"header": {"frame_id": f"p{i}"}, "pose": {"position": {"x": i}}} for i in range(count)
    ]
    return PATH.encode(header={"frame_id": "map"}, poses=poses)


def test_fields_are_read_by_attribute_item_and_path() -> None:
    message = IMU.decode(imu())
    assert message.header.frame_id == "imu"
    assert message["header"]["stamp"]["nanosec"] == 2
    assert message["orientation.w"] == 1.5
    assert message["orientation_covariance[-1]"] == 8.0
    assert list(message) == [field.name for field in IMU.fields]
    assert "orientation" in message
    assert "speed" not in message
    assert {"header", "orientation", "to_dict"} <= set(dir(message))


def test_untouched_message_is_its_bytes() -> None:
    # Unnecessary padding survives only if the bytes are not written anew.
    padded = load("std_msgs/msg/String").encode(data="abc") + b"\0\0"
    message = load("std_msgs/msg/String").decode(padded)
    assert load("std_msgs/msg/String").encode(message) is padded
    assert load("std_msgs/msg/String").encode_parts(message) == [padded]
    assert message.data == "abc"
    assert load("std_msgs/msg/String").encode(message) == padded[:-2]


@pytest.mark.parametrize("wire", ["cdr", "ros1"])
def test_untouched_message_changes_wire_when_asked(wire: str) -> None:
    other = "ros1" if wire == "cdr" else "cdr"
    data = IMU.encode(IMU.decode(imu()), wire=wire)
    message = IMU.decode(data, wire=wire)
    assert IMU.encode(message, wire=other) == IMU.encode(message.to_dict(), wire=other)


def test_writes_are_respected_at_every_depth() -> None:
    message = PATH.decode(way())
    message.poses[7].pose.orientation.w = 0.5
    message["poses[8].header.frame_id"] = "eight"
    message.header.stamp.sec = 9
    again = PATH.decode(PATH.encode(message))
    assert again.poses[7].pose.orientation.w == 0.5
    assert again.poses[8].header.frame_id == "eight"
    assert again.header.stamp.sec == 9
    assert [pose.pose.position.x for pose in again.poses] == list(range(20))


def test_first_access_may_be_a_write() -> None:
    message = IMU.decode(imu())
    message.orientation = {"x": 1.0}
    again = IMU.decode(IMU.encode(message))
    assert again.orientation.x == 1.0
    assert again.header.frame_id == "imu"


def test_unencodable_value_is_refused_when_encoding() -> None:
    message = PATH.decode(way())
    message.poses[3].pose.position.x = "far"
    for encode in (PATH.encode, PATH.encode_parts):
        with pytest.raises(ConversionError) as caught:
            encode(message)
        assert caught.value.path == "poses[3].pose.position.x"
        assert caught.value.value == "far"
    with pytest.raises(AttributeError):
        message.header.frame = "map"


def test_unknown_names_are_errors_with_a_hint() -> None:
    message = IMU.decode(imu())
    with pytest.raises(AttributeError, match="did you mean 'orientation'"):
        _ = message.orientatoin
    with pytest.raises(FieldPathError, match="has no field 'q'"):
        _ = message["orientation.q"]
    with pytest.raises(FieldPathError, match="index 9 is out of range"):
        _ = message["orientation_covariance[9]"]
    assert not hasattr(message, "__array__")


def test_arrays_are_views_until_they_are_written_to() -> None:
    data = imu()
    message = IMU.decode(data)
    view = message.orientation_covariance
    assert np.shares_memory(view, np.frombuffer(data, np.uint8))
    with pytest.raises(ValueError, match="read-only"):
        view[0] = 1.0
    owned = message.writable("orientation_covariance")
    owned[0] = 7.0
    assert message.writable("orientation_covariance") is owned
    message["orientation_covariance[1]"] = 8.0
    message["orientation_covariance[2:4]"] = [5.0, 6.0]
    assert list(IMU.decode(IMU.encode(message)).orientation_covariance[:5]) == [7, 8, 5, 6, 4]
    assert IMU.decode(data).orientation_covariance[0] == 0.0
    for path in ("orientation", "orientation_covariance[0]"):
        with pytest.raises(FieldPathError, match="does not lead to a numeric array"):
            message.writable(path)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("data[0]", 1.7),
        ("data[0]", 256),
        ("data[0]", True),
        ("data[0]", "7"),
        ("data[*]", 1.5),
        ("data[0:2]", [1, 1.5]),
        ("data[0:2]", np.array([300, 1])),
        ("data[0:2]", [1, 2, 3]),
        ("data[0:2]", "ab"),
    ],
)
def test_elements_are_set_as_strictly_as_fields(path: str, value: Any) -> None:
    kind = load("sensor_msgs/msg/Image")
    message = kind.decode(kind.encode(data=b"abc"))
    with pytest.raises(ConversionError, match=r"sensor_msgs/msg/Image: data\["):
        message[path] = value
    assert bytes(message.data) == b"abc"
    message["data[*]"] = 120.0
    message["data[1:]"] = b"yz"
    assert bytes(kind.decode(kind.encode(message)).data) == b"xyz"


def test_paths_meet_what_was_assigned() -> None:
    message = load("sensor_msgs/msg/Image").create()
    message.data = [1, 2]
    message["data[0]"] = 5
    assert list(message.writable("data")) == [5, 2]
    message.header = message.data = 3
    for path in ("header.stamp.sec", "data[0]"):
        with pytest.raises(FieldPathError, match="an assigned value of the wrong kind"):
            message[path] = 1
        with pytest.raises(FieldPathError, match="an assigned value of the wrong kind"):
            _ = message[path]


def test_other_buffers_are_copied_at_once() -> None:
    buffer = bytearray(imu())
    messages = [IMU.decode(buffer), IMU.decode(memoryview(buffer)), IMU.decode_all(buffer)]
    expected = IMU.decode(imu())
    buffer[:] = bytes(len(buffer))
    assert all(message == expected for message in messages)
    assert IMU.decode(np.frombuffer(imu(), np.uint8)) == expected


@pytest.mark.parametrize("whole", [IMU.decode, IMU.decode_all])
def test_copy_is_detached_and_writable(whole: Any) -> None:
    message = whole(imu())
    twin = message.copy()
    assert twin == message
    twin.orientation_covariance[0] = 5.0
    twin.header.frame_id = "other"
    assert message.orientation_covariance[0] == 0.0
    assert message.header.frame_id == "imu"
    assert twin != message
    assert copy.deepcopy(message) == message
    assert copy.copy(message).header is message.header


def test_copy_reaches_into_arrays_of_messages() -> None:
    message = PATH.decode(way())
    twin = message.copy()
    twin.poses[1].pose.position.x = 99.0
    assert message.poses[1].pose.position.x == 1.0


def test_equality_is_by_value() -> None:
    lazy, eager = PATH.decode(way()), PATH.decode_all(way())
    assert lazy == eager
    assert lazy == PATH.create(lazy.to_dict())
    eager.poses[19].header.frame_id = "x"
    assert lazy != eager
    assert lazy != "path"
    assert lazy != PATH.decode(way(19))
    joints = load("sensor_msgs/msg/JointState")
    assert joints.create(position=[float("nan")]) == joints.create(position=[float("nan")])
    assert load("std_msgs/Float64").create(data=1.0) != load("std_msgs/Float32").create(data=1.0)
    with pytest.raises(TypeError, match="unhashable"):
        hash(lazy)


@pytest.mark.parametrize("ros", [1, 2])
def test_messages_can_be_pickled(ros: int) -> None:
    kind = load("sensor_msgs/msg/JointState", ros=ros)
    message = kind.create(name=["a", "\udcff"], position=[1.0, 2.0])
    again = pickle.loads(pickle.dumps([message, kind.decode(kind.encode(message))]))
    assert again == [message, message]


def test_repr_is_short() -> None:
    image = load("sensor_msgs/msg/Image").create(data=bytes(6_000_000), encoding="rgb8")
    text = repr(image)
    assert text.startswith("sensor_msgs/msg/Image(header=(stamp=(sec=0, nanosec=0)")
    assert "encoding='rgb8'" in text
    assert "... 6000000 in all]" in text
    assert len(text) < 400
    assert len(repr(load("std_msgs/String").create(data="x" * 1000))) < 100
    assert "... 20 in all" in repr(PATH.decode(way()))


def awkward() -> MessageType:
    names = ("from", "class", "_b", "__x", "copy", "type", "to_dict", "_buffer__", "_schema__")
    fields = tuple(Field(name, FieldType("int8")) for name in names)
    return MessageType(Definition("t/msg/Awkward", 1, fields))


def test_field_names_that_clash_keep_their_wire_name() -> None:
    kind = awkward()
    value = {field.name: index for index, field in enumerate(kind.fields)}
    data = kind.encode(value)
    assert data == bytes(range(9))
    for message in (kind.decode(data), kind.decode_all(data), kind.create(value)):
        assert Message.to_dict(message) == value
        assert (message.from_, message.class_, message._b) == (0, 1, 2)
        assert (message["__x"], message["_buffer__"]) == (3, 7)
        assert (message.copy, message.type, message.to_dict) == (4, 5, 6)
        assert Message.copy(message) == message
        assert kind.encode(message) == data
    assert kind.encode(from_=5)[0] == 5
    assert kind.path("from")(data) == 0
    with pytest.raises(ConversionError, match="each field once"):
        kind.encode({"from": 1, "from_": 2})


def test_threads_may_decode_the_same_shell() -> None:
    data = imu()
    problems: list[str] = []
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)

    def work(message: Any, start: threading.Barrier) -> None:
        start.wait()
        try:
            message.orientation.x = message.orientation.w + 1
            if message.header.stamp.nanosec != 2 or message.orientation.x != 2.5:
                problems.append("a write was lost")
        except Exception as error:
            problems.append(repr(error))

    try:
        for _ in range(100):
            message, barrier = IMU.decode(data), threading.Barrier(4)
            threads = [threading.Thread(target=work, args=(message, barrier)) for _ in range(4)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert problems == []


def test_failing_shell_stays_a_shell() -> None:
    data = imu()[:60]
    message = IMU.decode(data)
    for _ in range(2):
        with pytest.raises(DecodeError) as caught:
            _ = message.header
        assert caught.value.type_name == "sensor_msgs/msg/Imu"
        assert caught.value.path == "orientation_covariance"
        assert caught.value.offset == 4 + 48
    assert "orientation_covariance at byte 52" in repr(message)


def test_deleted_fields_are_errors() -> None:
    message = IMU.create()
    del message.orientation
    with pytest.raises(AttributeError, match="was deleted"):
        _ = message.orientation
    with pytest.raises(rosglass.Error):
        IMU.encode(message)
    assert "orientation=<deleted>" in repr(message)


def test_times_know_their_nanoseconds() -> None:
    header = load("std_msgs/msg/Header").create(stamp={"sec": -1, "nanosec": 500_000_000})
    assert header.stamp.nanoseconds == -500_000_000
    assert header.stamp.seconds == -0.5
    old = load("std_msgs/Header", ros=1).create(stamp={"secs": 2, "nsecs": 1})
    assert old.stamp.nanoseconds == 2_000_000_001

"""Messages and services of one ROS in the other's words."""

from __future__ import annotations

import numpy as np
import pytest

from rosglass import ConversionError, DecodeError, UnsupportedError, load
from rosglass.interfaces import Library
from rosglass.messages import MessageType, ServiceTranslation, ServiceType, Translation
from rosglass.messages.schema import Kind, schema_of


def sample_values(kind):
    """Return values for every field; two elements for each sequence that may have them."""
    return _values(schema_of(kind.definition))


def _values(schema):
    return {member.name: _member(member) for member in schema.members}


def _member(member):
    if not member.is_array:
        return _one(member, 0)
    count = member.fixed_count
    if count is None:
        count = min(2, member.size or 2)
    return [_one(member, index) for index in range(count)]


def _one(member, index):
    if member.struct is not None:
        if member.struct.is_time:
            return dict(zip((m.name for m in member.struct.members), (5 + index, 7), strict=True))
        return _values(member.struct)
    if member.kind is Kind.TEXT:
        return f"text {index}"
    if member.number.python is bool:
        return True
    return member.number.python(3 + index)


def without_seq(value):
    if isinstance(value, dict):
        return {name: without_seq(inner) for name, inner in value.items() if name != "seq"}
    if isinstance(value, list):
        return [without_seq(inner) for inner in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def all_messages():
    library = Library()
    for ros in (1, 2):
        for name in library.names(ros, "msg"):
            yield pytest.param(ros, name, id=f"ROS {ros} {name}")


@pytest.mark.parametrize(("ros", "name"), list(all_messages()))
def test_there_and_back(ros, name):
    ours = load(name, ros)
    there = Translation(ours)
    back = Translation(there.type, [ours])
    assert (there.type.ros, back.type) == (3 - ros, ours)
    values = sample_values(ours)
    if name.endswith("/Log"):
        values["level"] = 8 if ros == 1 else 40
    data = ours.encode(values)
    translated = there.encode(data)
    # By the bytes and field by field it must come to the same.
    assert translated == there.type.encode(there.convert(ours.decode(data)))
    there.type.validate(translated)
    returned = back.encode(translated)
    ours.validate(returned)
    if not there.left_out:
        before, after = (ours.decode(each).to_dict() for each in (data, returned))
        assert without_seq(after) == without_seq(before)
    else:
        assert there.encode(returned) == translated


@pytest.mark.parametrize("name", ["sensor_msgs/Image", "std_msgs/String", "geometry_msgs/Point32"])
def test_views_and_garbage(name):
    ours = load(name, ros=1)
    there = Translation(ours)
    data = ours.encode(sample_values(ours))
    assert there.encode(memoryview(data)) == there.encode(bytearray(data)) == there.encode(data)
    for end in range(len(data)):
        with pytest.raises(DecodeError):
            there.encode(data[:end])


def test_big_arrays_of_both_byte_orders():
    ours = load("sensor_msgs/PointCloud")
    there = Translation(ours)
    points = [{"x": float(i), "y": 1.0, "z": -1.0} for i in range(20_000)]
    values = {"header": {"frame_id": "map"}, "points": points}
    expected = there.type.encode(values)
    assert there.encode(ours.encode(values)) == expected
    assert there.encode(ours.encode(values, byteorder="big")) == expected
    assert there.encode(memoryview(ours.encode(values))) == expected


@pytest.mark.parametrize(
    ("ros", "name", "values", "path"),
    [
        (1, "std_msgs/Header", {"stamp": {"secs": 2**31, "nsecs": 0}}, "stamp.secs"),
        (
            1,
            "sensor_msgs/Image",
            {"header": {"stamp": {"secs": 2**32 - 1, "nsecs": 0}}},
            "header.stamp.secs",
        ),
        (
            1,
            "tf2_msgs/TFMessage",
            {"transforms": [{}, {"header": {"stamp": {"secs": 2**31, "nsecs": 0}}}]},
            r"transforms\[1\].header.stamp.secs",
        ),
        (
            2,
            "sensor_msgs/Image",
            {"header": {"stamp": {"sec": -1, "nanosec": 0}}},
            "header.stamp.sec",
        ),
        (2, "builtin_interfaces/Time", {"sec": -5}, "sec"),
        (
            2,
            "trajectory_msgs/JointTrajectory",
            {"points": [{"time_from_start": {"sec": 0, "nanosec": 2**31}}]},
            r"points\[0\].time_from_start.nanosec",
        ),
    ],
)
def test_times_that_the_other_ros_cannot_say(ros, name, values, path):
    ours = load(name, ros)
    with pytest.raises(ConversionError, match=path):
        Translation(ours).encode(ours.encode(values))


def test_arrays_beyond_a_bound_are_refused():
    ours = load("shape_msgs/SolidPrimitive", ros=1)
    there = Translation(ours)
    assert there.added == ("polygon",)
    with pytest.raises(ConversionError, match="dimensions"):
        there.encode(ours.encode({"dimensions": [1.0] * 4}))


def test_untranslated_fields_are_reported():
    there = Translation(load("visualization_msgs/MarkerArray"))
    assert "markers[].mesh_file" in there.left_out
    assert there.type == load("visualization_msgs/MarkerArray", ros=1)
    assert Translation(load("visualization_msgs/MarkerArray", ros=1)).left_out == ()


@pytest.mark.parametrize(
    ("one", "two"),
    [
        ("std_msgs/Time", "builtin_interfaces/Time"),
        ("std_msgs/Duration", "builtin_interfaces/Duration"),
        ("tf/tfMessage", "tf2_msgs/TFMessage"),
        ("rosgraph_msgs/Log", "rcl_interfaces/Log"),
    ],
)
def test_types_with_another_name(one, two):
    first, second = load(one, ros=1), load(two)
    assert Translation(first).type == second
    assert Translation(second, [first]).type == first


def test_log_levels():
    ours = load("rosgraph_msgs/Log", ros=1)
    there = Translation(ours)
    back = Translation(there.type)
    for one, two in ((1, 10), (2, 20), (4, 30), (8, 40), (16, 50)):
        log = there.type.decode(there.encode(ours.encode({"level": one, "msg": "m"})))
        assert (log.level, log.msg) == (two, "m")
        assert ours.decode(back.encode(there.type.encode(log))).level == one
    assert there.left_out == ("header.frame_id", "topics")


def test_own_type_is_translated_to_ros_1():
    text = """
string NAME="a b"
bool ON=true
wstring wide
string<=4 short
byte[<=3] raw
char[2] letters
builtin_interfaces/Time[] times
int32 speed 7
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
    ours = MessageType.from_text("my_msgs/msg/Own", text)
    there = Translation(ours)
    kinds = {field.name: str(field.type) for field in there.type.fields}
    assert kinds == {
        "wide": "string",
        "short": "string",
        "raw": "uint8[]",
        "letters": "uint8[2]",
        "times": "time[]",
        "speed": "int32",
    }
    assert there.derived
    assert there.type.constants == {"NAME": "a b", "ON": True}
    values = {"wide": "ü", "short": "ab", "raw": [255], "times": [{"sec": 1, "nanosec": 2}]}
    found = there.type.decode(there.encode(ours.encode(values)))
    assert (found.wide, found.raw.tolist(), found.times[0].nsecs) == ("ü", [255], 2)
    again = MessageType.from_text("my_msgs/msg/Own", there.type.definition.text, ros=1)
    assert again.md5 == there.type.md5
    back = Translation(there.type, [ours])
    with pytest.raises(ConversionError, match="short"):
        back.encode(there.type.encode({"short": "too long"}))


def test_broken_counterpart_is_reported(tmp_path, caplog):
    folder = tmp_path / "my_msgs/msg"
    folder.mkdir(parents=True)
    (folder / "Own.msg").write_text("int32 x\nint32\n")
    library = Library()
    library.add_path(tmp_path)
    ours = MessageType.from_text("my_msgs/msg/Own", "int32 x")
    assert Translation(ours, library=library).derived
    (line,) = caplog.messages
    assert line.startswith("my_msgs/msg/Own of ROS 1 is not used as the counterpart of my_msgs/")
    assert "Own.msg:2" in line


def test_names_that_differ_only_in_case_are_refused():
    with pytest.raises(UnsupportedError, match="differ only in case"):
        Translation(MessageType.from_text("m/msg/X", "int8 a\nint8 A\n", ros=1))


@pytest.mark.parametrize(
    ("ros", "name", "other"),
    [
        (1, "std_srvs/SetBool", "std_srvs/srv/SetBool"),
        (1, "rospy_tutorials/AddTwoInts", "example_interfaces/srv/AddTwoInts"),
        (1, "roscpp/Empty", "std_srvs/srv/Empty"),
        (1, "nav_msgs/GetMap", "nav_msgs/srv/GetMap"),
        (1, "roscpp/GetLoggers", "roscpp/srv/GetLoggers"),
        (2, "std_srvs/Trigger", "std_srvs/srv/Trigger"),
        (2, "example_interfaces/AddTwoInts", "rospy_tutorials/srv/AddTwoInts"),
        (2, "lifecycle_msgs/ChangeState", "lifecycle_msgs/srv/ChangeState"),
    ],
)
def test_services(ros, name, other):
    package, base = name.split("/")
    server = load(f"{package}/srv/{base}", ros)
    assert isinstance(server, ServiceType)
    found = ServiceTranslation(server)
    assert (found.type.name, found.type.ros) == (other, 3 - ros)
    assert found.derived == (name in ("roscpp/GetLoggers", "lifecycle_msgs/ChangeState"))
    asked = found.type.request.create(sample_values(found.type.request))
    server.request.validate(server.request.encode(found.request.convert(asked)))
    answer = server.response.create(sample_values(server.response))
    translated = found.type.response.encode(found.response.convert(answer))
    assert translated == found.response.encode(server.response.encode(answer))


def test_message_without_fields_whose_counterpart_has_some():
    ours = MessageType.from_text("own_msgs/msg/Grown", "", ros=1)
    grown = MessageType.from_text("own_msgs/msg/Grown", "int32 a 7\nstring[] b\n")
    there, back = Translation(ours, [grown]), Translation(grown, [ours])
    assert (there.type, there.added, back.left_out) == (grown, ("a", "b"), ("a", "b"))
    assert grown.decode(there.encode(b"")).a == 7
    assert back.encode(grown.encode({"a": 1})) == b""

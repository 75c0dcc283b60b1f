"""Reading recordings that others wrote, and damaged ones."""

from __future__ import annotations

import logging
from random import Random
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from mcap import writer as mcap_writer
from rosbags import rosbag1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from rosglass import load
from rosglass.bags import open_bag
from rosglass.comm import Durability, QoS, Reliability
from rosglass.errors import BagError, UnsupportedError
from rosglass.interfaces import full_text
from rosglass.messages import MessageType, OpaqueType, Translation

if TYPE_CHECKING:
    from pathlib import Path

SECOND = 1_000_000_000
STRING = "std_msgs/msg/String"


def write_mcap(path: Path, count: int = 5, *, finish: bool = True, **channel: Any) -> Path:
    found = load(STRING)
    writer = mcap_writer.Writer(str(path), chunk_size=200)
    writer.start("ros2")
    text = full_text(found.definition).encode()
    schema = writer.register_schema(STRING, "ros2msg", text)
    number = writer.register_channel("/chatter", "cdr", schema, channel)
    for i in range(count):
        writer.add_message(number, i * SECOND, found.encode({"data": f"n{i}"}), i * SECOND)
    if finish:
        writer.finish()
    else:
        writer.flush()
    return path


def texts(bag: Any, *args: Any, **options: Any) -> list[str]:
    found = []
    for message in bag.messages(*args, **options):
        kind = message.channel.type()
        found.append(kind.decode(message.data, wire=message.channel.wire).data)
    return found


def test_mcap_file_with_qos_as_text_or_numbers(tmp_path):
    words = "- {reliability: best_effort, durability: transient_local, depth: 3, history: 1}"
    with open_bag(write_mcap(tmp_path / "a.mcap", offered_qos_profiles=words)) as bag:
        (channel,) = bag.channels
        assert (channel.topic, channel.type_name, channel.count) == ("/chatter", STRING, 5)
        assert (bag.start, bag.end, bag.duration, bag.problem) == (0, 4 * SECOND, 4.0, "")
        assert texts(bag) == [f"n{i}" for i in range(5)]
        assert texts(bag, None, SECOND, 3 * SECOND) == ["n1", "n2"]
        assert texts(bag, []) == []
        assert channel.offered == (QoS(3, Reliability.BEST_EFFORT, Durability.TRANSIENT_LOCAL),)
    numbers = "- {reliability: 1, durability: 1, depth: 0, deadline: {sec: 9223372036, nsec: 0}}"
    with open_bag(write_mcap(tmp_path / "b.mcap", offered_qos_profiles=numbers)) as bag:
        assert bag.channels[0].profile() == QoS.latched(10)
    with open_bag(write_mcap(tmp_path / "c.mcap", offered_qos_profiles="[oops")) as bag:
        assert bag.channels[0].profile() == QoS()


@pytest.mark.parametrize("cut", [0, 60, 400])
def test_recording_cut_short_plays_what_it_holds(tmp_path, caplog, cut):
    path = write_mcap(tmp_path / "a.mcap", 50, finish=False)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) - cut])
    with caplog.at_level(logging.WARNING), open_bag(path) as bag:
        found = texts(bag)
        assert found == [f"n{i}" for i in range(len(found))]
        assert len(found) > 30
        assert "not closed properly" in bag.problem
        assert bag.end == (len(found) - 1) * SECOND


@pytest.mark.parametrize("content", [b"", b"nonsense" * 20, b"\x89MCAP0\r\n\x01\x02\x03"])
def test_invalid_mcap_file_is_refused(tmp_path, content):
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(BagError, match=r"x\.mcap"):
        open_bag(path).close()


def test_path_without_recording_is_refused(tmp_path):
    with pytest.raises(BagError, match="does not exist"):
        open_bag(tmp_path / "none.mcap")
    with pytest.raises(BagError, match="cannot be read as a recording"):
        open_bag(tmp_path)
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(BagError, match=r"notes\.txt.*MCAP files"):
        open_bag(tmp_path / "notes.txt")
    with pytest.raises(BagError, match="by its path"):
        open_bag(7)


def test_foreign_topics_are_left_out_and_named(tmp_path):
    path = tmp_path / "a.mcap"
    writer = mcap_writer.Writer(str(path))
    writer.start()
    schema = writer.register_schema("Thing", "jsonschema", b"{}")
    number = writer.register_channel("/json", "json", schema)
    writer.add_message(number, 1, b"{}", 1)
    writer.finish()
    with open_bag(path) as bag:
        assert bag.channels == ()
        assert "/json (json described by jsonschema)" in bag.problem


@pytest.mark.parametrize("encoding", ["", "unknown"])
def test_type_without_definition_is_opaque(tmp_path, encoding):
    path = tmp_path / "a.mcap"
    writer = mcap_writer.Writer(str(path))
    writer.start("ros2")
    schema = writer.register_schema("unheard_of_msgs/msg/Thing", encoding, b"")
    number = writer.register_channel("/s", "cdr", schema)
    writer.add_message(number, 1, b"\0\1\0\0\1", 1)
    writer.finish()
    with open_bag(path) as bag:
        found = bag.channels[0].type()
        assert isinstance(found, OpaqueType)
        assert "no definition" in found.reason


def test_ros2_bag_in_sqlite(tmp_path):
    store = get_typestore(Stores.ROS2_JAZZY)
    kind = store.types[STRING]
    with Writer2(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/chatter", STRING, typestore=store)
        for i in range(3):
            data = store.serialize_cdr(kind(f"n{i}"), STRING)
            writer.write(connection, i * SECOND, data)
    with open_bag(tmp_path / "bag") as bag:
        assert texts(bag) == ["n0", "n1", "n2"]
        assert texts(bag, bag.channels, SECOND) == ["n1", "n2"]
        assert (bag.channels[0].wire, bag.channels[0].count) == ("cdr", 3)
        assert bag.channels[0].type().rihs01 == load(STRING).rihs01


def test_ros1_bag_translated(tmp_path):
    store = get_typestore(Stores.ROS1_NOETIC)
    header = store.types["std_msgs/msg/Header"]
    stamp = store.types["builtin_interfaces/msg/Time"](12, 345)
    info = store.types["sensor_msgs/msg/CameraInfo"](
        header(7, stamp, "cam"), 480, 640, "plumb_bob", np.arange(5.0), np.arange(9.0),
        np.arange(9.0), np.arange(12.0), 1, 2,
        store.types["sensor_msgs/msg/RegionOfInterest"](1, 2, 3, 4, True),
    )  # fmt: skip
    name = "sensor_msgs/msg/CameraInfo"
    with rosbag1.Writer(tmp_path / "a.bag") as writer:
        connection = writer.add_connection("/camera_info", name, typestore=store)
        writer.write(connection, 5 * SECOND, store.serialize_ros1(info, name))
    with open_bag(tmp_path / "a.bag") as bag:
        (message,) = bag.messages()
        assert message.channel.wire == "ros1"
        converter = Translation(message.channel.type())
    assert converter.type.rihs01 == load(name).rihs01
    found = converter.type.decode(converter.encode(message.data))
    assert (found.header.stamp.sec, found.header.stamp.nanosec) == (12, 345)
    assert (found.header.frame_id, found.roi.do_rectify) == ("cam", True)
    assert list(found.k) == list(range(9))


def test_own_ros_1_type_is_translated_by_its_definition():
    text = """
byte LOW=-3
Header header
char letter
byte[] raw
byte level
time[] times
duration[2] spans
my_msgs/Part[] Parts
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: my_msgs/Part
string Name
time at
"""
    ours = MessageType.from_text("my_msgs/msg/Whole", text, ros=1)
    converter = Translation(ours)
    values = {
        "header": {"frame_id": "map"},
        "letter": 65,
        "raw": [-1, 2],
        "level": -2,
        "times": [{"secs": 1, "nsecs": 2}],
        "spans": [{"secs": -1, "nsecs": 0}, {"secs": 0, "nsecs": 5}],
        "Parts": [{"Name": "a", "at": {"secs": 3, "nsecs": 4}}],
    }
    found = converter.type.decode(converter.encode(ours.encode(values)))
    assert [field.name for field in converter.type.fields] == [
        "header", "letter", "raw", "level", "times", "spans", "parts",
    ]  # fmt: skip
    assert (found.letter, list(found.raw), found.level) == (65, [-1, 2], -2)
    assert (found.times[0].sec, found.times[0].nanosec, found.spans[0].sec) == (1, 2, -1)
    assert (found.parts[0].name, found.parts[0].at.sec) == ("a", 3)
    assert converter.type.constants.LOW == -3
    again = MessageType.from_text("my_msgs/msg/Whole", full_text(converter.type.definition))
    assert again.rihs01 == converter.type.rihs01


def test_diagnostics_keep_their_level():
    ours = load("diagnostic_msgs/msg/DiagnosticArray", ros=1)
    converter = Translation(ours)
    data = ours.encode({"status": [{"level": 2, "name": "motor"}, {"level": -1}]})
    found = converter.type.decode(converter.encode(data))
    assert converter.type.rihs01 == load("diagnostic_msgs/msg/DiagnosticArray").rihs01
    levels = [status.level for status in found.status]
    assert [v if isinstance(v, int) else v[0] for v in levels] == [2, 255]


def test_names_that_differ_only_in_case_are_refused():
    with pytest.raises(UnsupportedError, match="differ only in case"):
        Translation(MessageType.from_text("m/msg/X", "int8 a\nint8 A\n", ros=1))


def test_mcap_file_is_recognized_by_its_magic(tmp_path):
    path = write_mcap(tmp_path / "a.mcap").rename(tmp_path / "drive")
    with open_bag(path) as bag:
        assert len(texts(bag)) == 5


def test_end_of_a_file_of_zeros_is_reported_in_words(tmp_path):
    path = write_mcap(tmp_path / "a.mcap", 50, finish=False)
    path.write_bytes(path.read_bytes() + bytes(100))
    with open_bag(path) as bag:
        assert len(texts(bag)) == 50
        assert bag.problem == "it was not closed properly: its end is missing or damaged"


def write_sqlite(path: Path) -> Path:
    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer2(path / "sql", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/chatter", STRING, typestore=store)
        for i in range(30):
            text = store.serialize_cdr(store.types[STRING](f"n{i}"), STRING)
            writer.write(connection, i * SECOND, text)
    return next((path / "sql").glob("*.db3"))


def write_ros1(path: Path) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    with rosbag1.Writer(path / "a.bag") as writer:
        connection = writer.add_connection("/chatter", STRING, typestore=store)
        for i in range(30):
            text = store.serialize_ros1(store.types[STRING](f"n{i}"), STRING)
            writer.write(connection, i * SECOND, text)
    return path / "a.bag"


@pytest.mark.parametrize("kind", ["mcap", "sqlite", "ros1"])
def test_whatever_is_damaged_is_read_or_refused(tmp_path, kind):
    path = {
        "mcap": lambda: write_mcap(tmp_path / "a.mcap", 30),
        "sqlite": lambda: write_sqlite(tmp_path),
        "ros1": lambda: write_ros1(tmp_path),
    }[kind]()
    good, random = path.read_bytes(), Random(7)
    refused = 0
    for number in range(70):
        data = bytearray(good)
        if number % 3 == 0:
            del data[random.randrange(len(data)) :]
        for _ in range(number % 5):
            place = random.randrange(len(data) + 1)
            data[place : place + 1] = random.randbytes(1)
        path.write_bytes(data)
        try:
            with open_bag(path) as bag:
                for _ in bag.messages():
                    pass
        except BagError:
            refused += 1
    assert refused

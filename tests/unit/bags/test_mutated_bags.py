"""Recordings that are cut, mutated, or declare sizes and types that are not there."""

from __future__ import annotations

import logging
import random
import re
import resource
import struct

import pytest
import yaml
from mcap.writer import CompressionType, Writer
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

import rosglass
from rosglass.bags import open_bag

STRING = "std_msgs/msg/String"
#: Values that replace a length, an offset or a count.
SIZES = (0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**63 - 1, 2**64 - 1)
MUTANTS = 80
#: Bytes by which this process may grow.
MEMORY = 300 * 2**20


def write_mcap(path, compression=CompressionType.NONE, name=STRING, text="string data", more=None):
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=400, compression=compression)
        writer.start("ros2", "test")
        schema = writer.register_schema(name, "ros2msg", text.encode())
        offered = {"offered_qos_profiles": "- {history: 1, depth: 3}"} if more is None else more
        channel = writer.register_channel("/a", "cdr", schema, offered)
        for number in range(40):
            writer.add_message(channel, number, b"\0\1\0\0\3\0\0\0m1\0\0", number, number)
        writer.finish()


def write_bag(path):
    with Ros1Writer(path) as writer:
        kinds = get_typestore(Stores.ROS1_NOETIC)
        connection = writer.add_connection("/a", STRING, typestore=kinds)
        for number in range(40):
            writer.write(connection, number, b"\2\0\0\0m1")


def write_sqlite(path):
    folder = path.with_suffix("")
    with Ros2Writer(folder, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        kinds = get_typestore(Stores.ROS2_HUMBLE)
        connection = writer.add_connection("/a", STRING, typestore=kinds)
        for number in range(40):
            writer.write(connection, number, b"\0\1\0\0\3\0\0\0m1\0\0")
    next(folder.glob("*.db3")).rename(path)


FORMATS = {
    "plain.mcap": write_mcap,
    "lz4.mcap": lambda path: write_mcap(path, CompressionType.LZ4),
    "zstd.mcap": lambda path: write_mcap(path, CompressionType.ZSTD),
    "one.bag": write_bag,
    "two.db3": write_sqlite,
}


def mutate(data, chance):
    """Return the bytes cut, with some changed, with a size replaced, or with a part twice."""
    kind, place = chance.randrange(5), chance.randrange(len(data))
    end = place + chance.randrange(1, 300)
    if kind == 0:
        return data[:place]
    if kind == 1:
        return data[:place] + chance.randbytes(3) + data[place + 3 :]
    if kind == 2:
        width, size = chance.choice(("<I", "<Q")), chance.choice(SIZES)
        said = struct.pack(width, size % 2 ** (8 * struct.calcsize(width)))
        return data[:place] + said + data[place + len(said) :]
    return data[:place] + data[end:] if kind == 3 else data[:end] + data[place:]


def read(path):
    """Read all that a recording has; return how many messages, and None if it is refused."""
    try:
        with open_bag(path) as bag:
            for channel in bag.channels:
                channel.profile()
                try:
                    channel.type()
                except rosglass.Error:
                    continue
            return sum(1 for _ in bag.messages())
    except rosglass.Error:
        return None


@pytest.mark.parametrize("name", FORMATS)
def test_mutated_recordings_are_read_in_part_or_refused(name, tmp_path, caplog):
    caplog.set_level(logging.CRITICAL)
    path = tmp_path / name
    FORMATS[name](path)
    good, chance = path.read_bytes(), random.Random(7)
    assert read(path) == 40
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    found = []
    for _ in range(MUTANTS):
        path.write_bytes(mutate(good, chance))
        found.append(read(path))
    assert len(found) == MUTANTS
    assert all(count is None or count <= 80 for count in found)
    assert any(found)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown * 1024 < MEMORY


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("", "string data"),
        ("no slash", "string data"),
        ("a/b/c/d", "string data"),
        ("\x1b[2J/msg/X", "string data"),
        ("std_msgs/msg/../../X", "string data"),
        ("pkg/msg/T", "T again"),
        ("pkg/msg/T", "float64[999999999999] x"),
        ("pkg/msg/T", "string<=0 x\nint8[<=-1] y"),
        ("pkg/msg/T", "\0\xff" * 1000),
        ("pkg/msg/T", "x" * 1_000_000),
    ],
)
def test_hostile_types_in_recordings_leave_the_rest_readable(name, text, tmp_path):
    write_mcap(tmp_path / "a.mcap", name=name, text=text)
    assert read(tmp_path / "a.mcap") in (0, 40)


@pytest.mark.parametrize(
    "text",
    [
        "x", "- 1", "{}", "- {depth: -1}", "- {depth: 1e999}", "- {deadline: {sec: .inf}}",
        "- {deadline: {sec: .nan, nsec: x}}", "- {history: [1]}", "- {history: {a: 1}}",
        "- {reliability: 2001-99-99}", "- " + "9" * 10_000, "- &a [*a]", "[" * 10_000,
        yaml.safe_dump([{"lifespan": {"sec": 2**70}}]),
    ],
)  # fmt: skip
def test_hostile_profiles_in_recordings_count_as_the_default(text, tmp_path):
    write_mcap(tmp_path / "a.mcap", more={"offered_qos_profiles": text})
    assert read(tmp_path / "a.mcap") == 40


@pytest.mark.parametrize(
    "value", ["x", "-1", "[1]", "{a: 1}", "null", "1.5", "1e999", "2001-01-01"]
)
@pytest.mark.parametrize("field", ["nanoseconds", "nanoseconds_since_epoch", "message_count"])
def test_metadata_of_other_kinds_is_read_or_refused(field, value, tmp_path):
    write_sqlite(tmp_path / "bag.db3")
    folder = tmp_path / "bag"
    (tmp_path / "bag.db3").rename(folder / "bag.db3")
    metadata = folder / "metadata.yaml"
    assert read(folder) == 40
    metadata.write_text(re.sub(rf"\b{field}: \d+", f"{field}: {value}", metadata.read_text()))
    assert read(folder) in (None, 0, 40)

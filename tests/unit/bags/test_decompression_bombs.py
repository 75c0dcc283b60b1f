"""Recordings whose compressed parts expand to more than they should, or declare so."""

from __future__ import annotations

import bz2
import io
import json
import sqlite3
import struct
import subprocess
import sys
from contextlib import closing
from functools import cache
from types import SimpleNamespace

import lz4.frame
import pytest
import yaml
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Message,
    Schema,
    Statistics,
)
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from rosglass.bags import open_bag
from rosglass.bags.bag import CHUNK_LIMIT, decompress
from rosglass.errors import BagError

STRING = "std_msgs/msg/String"
BOMB = 2 * 2**30
#: Messages of a good chunk.
MESSAGES = 5
MAGIC = b"\x89MCAP0\r\n"
#: Reads recordings with 2 GiB of addresses and a minute of CPU.
READER = """
import json, resource, sys
resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))
resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
import rosglass
from rosglass.bags import open_bag
try:
    with open_bag(sys.argv[1]) as bag:
        count = len(list(bag.messages()))
        print(json.dumps([count, bag.problem]))
except rosglass.Error as error:
    print(json.dumps([None, str(error)]))
"""


def read(path):
    """Return how many messages another process reads, and what it says of the recording."""
    command = [sys.executable, "-c", READER, str(path)]
    found = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert found.returncode == 0, found.stderr[-2000:]
    return json.loads(found.stdout)


@cache
def zstd_bomb(size):
    compressor = zstandard.ZstdCompressor(level=1).compressobj()
    parts = [compressor.compress(bytes(2**20)) for _ in range(size // 2**20)]
    return b"".join(parts) + compressor.flush()


@cache
def sized_zstd_bomb(size):
    compressor = zstandard.ZstdCompressor(level=1).compressobj(size=size)
    parts = [compressor.compress(bytes(2**20)) for _ in range(size // 2**20)]
    return b"".join(parts) + compressor.flush()


@cache
def lz4_bomb(size):
    compressor = lz4.frame.LZ4FrameCompressor()
    parts = [compressor.begin()]
    parts += [compressor.compress(bytes(2**20)) for _ in range(size // 2**20)]
    return b"".join(parts) + compressor.flush()


@cache
def bz2_bomb(size):
    return bz2.compress(bytes(2**24)) * (size // 2**24)


def record(found):
    builder = RecordBuilder()
    found.write(builder)
    return builder.end()


def good_chunk(first):
    """Return the arguments of a chunk of messages."""
    content = b"".join(
        record(
            Message(
                channel_id=1,
                data=b"\0\1\0\0\1\0\0\0\0",
                log_time=time,
                publish_time=time,
                sequence=time,
            )
        )
        for time in range(first, first + MESSAGES)
    )
    return "zstd", zstandard.compress(content), len(content), first


def write_mcap(path, chunks, indexed):
    schema = Schema(data=b"string data", encoding="ros2msg", id=1, name=STRING)
    channel = Channel(id=1, topic="/a", message_encoding="cdr", metadata={}, schema_id=1)
    file = io.BytesIO()
    file.write(
        MAGIC + record(Header(library="test", profile="ros2")) + record(schema) + record(channel)
    )
    indexes = []
    for compression, data, size, first in chunks:
        indexes.append(
            ChunkIndex(
                chunk_length=0,
                chunk_start_offset=file.tell(),
                compression=compression,
                compressed_size=len(data),
                message_end_time=first + MESSAGES - 1,
                message_index_length=0,
                message_index_offsets={1: 0},
                message_start_time=first,
                uncompressed_size=size,
            )
        )
        file.write(
            record(
                Chunk(
                    compression=compression,
                    data=data,
                    message_start_time=first,
                    message_end_time=first + MESSAGES - 1,
                    uncompressed_crc=0,
                    uncompressed_size=size,
                )
            )
        )
    if indexed:
        file.write(record(DataEnd(0)))
        start = file.tell()
        counts = Statistics(
            attachment_count=0,
            channel_count=1,
            channel_message_counts={1: 3 * MESSAGES},
            chunk_count=len(chunks),
            message_count=3 * MESSAGES,
            message_start_time=0,
            message_end_time=100,
            metadata_count=0,
            schema_count=1,
        )
        for found in (schema, channel, counts, *indexes):
            file.write(record(found))
        file.write(
            record(Footer(summary_start=start, summary_offset_start=0, summary_crc=0)) + MAGIC
        )
    path.write_bytes(file.getvalue())
    return indexes[1].chunk_start_offset


EMPTY = bytes([Opcode.MESSAGE]) + struct.pack("<QHIQQ", 22, 1, 0, 10, 10)
BOMBS = {
    "zstd that says so": lambda: ("zstd", sized_zstd_bomb(BOMB), BOMB),
    "zstd without size": lambda: ("zstd", zstd_bomb(BOMB), 100),
    "zstd that lies": lambda: ("zstd", sized_zstd_bomb(BOMB), 100),
    "zstd of no content": lambda: ("zstd", zstandard.compress(b"abc"), 2**40),
    "zstd of records of no kind": lambda: ("zstd", zstd_bomb(2**28), 2**28),
    "lz4 that says so": lambda: ("lz4", lz4_bomb(BOMB), BOMB),
    "lz4 that lies": lambda: ("lz4", lz4_bomb(BOMB), 100),
    "lz4 of no content": lambda: ("lz4", b"abc", CHUNK_LIMIT),
    "unknown": lambda: ("pied piper", b"abc", 3),
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_chunks_of_an_mcap_file_that_expand_too_far_are_left_out(bomb, tmp_path):
    path = tmp_path / "a.mcap"
    chunks = [good_chunk(0), (*BOMBS[bomb](), 10), good_chunk(20)]
    for indexed in (True, False):
        offset = write_mcap(path, chunks, indexed)
        count, problem = read(path)
        assert count == 2 * MESSAGES
        assert "1 chunk is damaged or too large and left out" in problem
        assert f"at byte {offset}: " in problem


def test_declared_size_is_reported(tmp_path, caplog):
    chunks = [good_chunk(0), ("zstd", b"", CHUNK_LIMIT + 1, 10), good_chunk(20)]
    offset = write_mcap(tmp_path / "a.mcap", chunks, True)
    with open_bag(tmp_path / "a.mcap") as bag:
        assert bag.problem == ""  # only reading shows it
        for _ in range(3):
            assert len(list(bag.messages())) == 2 * MESSAGES
        assert "1 chunk is" in bag.problem
    (line,) = [entry.getMessage() for entry in caplog.records]
    assert "a.mcap" in line
    assert f"byte {offset}: it declares {CHUNK_LIMIT + 1} bytes, and {CHUNK_LIMIT} are" in line


def test_messages_beyond_counting_in_a_chunk_are_read_within_the_memory(tmp_path):
    """Eight megabytes of empty messages, four thousand times smaller in the file."""
    count = 8 * 2**20 // len(EMPTY)
    data = zstandard.compress(EMPTY * count)
    chunks = [good_chunk(0), ("zstd", data, count * len(EMPTY), 10), good_chunk(20)]
    for indexed in (True, False):
        write_mcap(tmp_path / "a.mcap", chunks, indexed)
        with open_bag(tmp_path / "a.mcap") as bag:
            times = [message.time for message in bag.messages()]
        assert len(times) == count + 2 * MESSAGES
        assert times == sorted(times)


def test_chunk_that_the_index_names_often_is_read_once(tmp_path):
    path = tmp_path / "a.mcap"
    write_mcap(path, [good_chunk(0), good_chunk(10), good_chunk(20)], True)
    data = path.read_bytes()
    start = struct.unpack("<Q", data[-28:-20])[0]
    path.write_bytes(data[:-37] + data[start:-37] * 50 + data[-37:])
    with open_bag(path) as bag:
        assert len(list(bag.messages())) == 3 * MESSAGES


def ros1_record(fields, data):
    head = b"".join(
        struct.pack("<I", len(name) + 1 + len(value)) + name + b"=" + value
        for name, value in fields.items()
    )
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data


@pytest.mark.parametrize("size", [100, BOMB])
@pytest.mark.parametrize("compression", ["bz2", "lz4"])
def test_chunks_of_a_cut_ros1_bag_that_expand_too_far_are_left_out(compression, size, tmp_path):
    bomb = bz2_bomb(BOMB) if compression == "bz2" else lz4_bomb(BOMB)
    connection = {b"op": b"\7", b"conn": bytes(4), b"topic": b"/a"}
    header = b"".join(
        struct.pack("<I", len(text)) + text
        for text in (
            b"type=std_msgs/String",
            b"md5sum=992ce8a1687cec8c8bd883ec73ca41d1",
            b"message_definition=string data",
        )
    )
    message = {b"op": b"\2", b"conn": bytes(4), b"time": bytes(8)}
    content = ros1_record(connection, header) + ros1_record(message, b"\2\0\0\0m1")

    def chunk(kind, data, declared):
        fields = {b"op": b"\5", b"compression": kind, b"size": struct.pack("<I", declared)}
        return ros1_record(fields, data)

    good = chunk(b"lz4", lz4.frame.compress(content), len(content))
    top = b"#ROSBAG V2.0\n" + ros1_record({b"op": b"\3", b"index_pos": bytes(8)}, b" " * 9)
    path = tmp_path / "a.bag"
    path.write_bytes(top + good + chunk(compression.encode(), bomb, size) + good)
    count, problem = read(path)
    assert count == 2
    assert f"1 chunk is damaged or too large and left out, the first at byte {len(top + good)}" in (
        problem
    )


@pytest.mark.parametrize("compression", ["bz2", "lz4"])
def test_ros1_bag_with_an_index_is_refused_where_it_expands_too_far(compression, tmp_path):
    path = tmp_path / "a.bag"
    kinds = get_typestore(Stores.ROS1_NOETIC)
    writer = Ros1Writer(path)
    writer.set_compression(Ros1Writer.CompressionFormat[compression.upper()])
    writer.compressor = lambda _: bz2_bomb(BOMB) if compression == "bz2" else lz4_bomb(BOMB)
    with writer:
        connection = writer.add_connection("/a", STRING, typestore=kinds)
        writer.write(connection, 1, b"\2\0\0\0m1")
    offset = path.read_bytes().index(b"compression=")
    count, problem = read(path)
    assert count is None
    assert f"holds more than {CHUNK_LIMIT} bytes" in problem
    named = int(problem.split("the chunk at byte ")[1].split(":")[0])
    assert 0 < offset - named < 30


def test_messages_of_a_ros2_bag_that_expand_too_far_are_left_out(tmp_path):
    folder = tmp_path / "bag"
    kinds = get_typestore(Stores.ROS2_HUMBLE)
    with Ros2Writer(folder, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/a", STRING, typestore=kinds)
        for time in range(MESSAGES):
            content = zstandard.compress(b"\0\1\0\0\1\0\0\0\0")
            bad = {1: zstd_bomb(BOMB), 2: sized_zstd_bomb(BOMB)}
            writer.write(connection, time, bad.get(time, content))
    metadata = folder / "metadata.yaml"
    found = yaml.safe_load(metadata.read_text())
    found["rosbag2_bagfile_information"] |= {
        "compression_mode": "MESSAGE",
        "compression_format": "zstd",
    }
    metadata.write_text(yaml.safe_dump(found))
    count, problem = read(folder)
    assert count == MESSAGES - 2
    assert "2 messages are damaged or too large and left out, the first of /a at 1 ns" in problem


def packed_bag(folder, pack):
    """Write a bag whose file is compressed as a whole, by `pack`; returns the file."""
    kinds = get_typestore(Stores.ROS2_HUMBLE)
    with Ros2Writer(folder, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/a", STRING, typestore=kinds)
        for time in range(MESSAGES):
            writer.write(connection, time, b"\0\1\0\0\1\0\0\0\0")
    (file,) = folder.glob("*.db3")
    packed = file.with_name(f"{file.name}.zstd")
    packed.write_bytes(pack(file))
    file.unlink()
    metadata = folder / "metadata.yaml"
    found = yaml.safe_load(metadata.read_text())
    found["rosbag2_bagfile_information"] |= {
        "compression_mode": "FILE",
        "compression_format": "zstd",
        "relative_file_paths": [packed.name],
    }
    metadata.write_text(yaml.safe_dump(found))
    return packed


@pytest.fixture
def small_disk(tmp_path, monkeypatch):
    """Say that the folder for temporary files has room for 20 MiB beyond what stays free."""
    place = tmp_path / "tmp"
    place.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(place))

    def usage(_):
        used = sum(file.stat().st_size for file in place.rglob("*") if file.is_file())
        return SimpleNamespace(free=2**30 + 20 * 2**20 - used)

    monkeypatch.setattr("shutil.disk_usage", usage)
    return place


def test_bag_that_is_compressed_as_a_whole_is_read(small_disk, tmp_path):
    packed_bag(tmp_path / "bag", lambda file: zstandard.compress(file.read_bytes()))
    with open_bag(tmp_path / "bag") as bag:
        assert len(list(bag.messages())) == MESSAGES
        assert list(small_disk.iterdir())
    assert not list(small_disk.iterdir())


@pytest.mark.parametrize("bomb", [zstd_bomb, sized_zstd_bomb])
def test_bag_that_is_compressed_as_a_whole_does_not_fill_the_disk(bomb, small_disk, tmp_path):
    file = packed_bag(tmp_path / "bag", lambda _: bomb(256 * 2**20))
    with pytest.raises(BagError) as caught:
        open_bag(tmp_path / "bag")
    assert f"{file} holds more than {20 * 2**20} bytes" in str(caught.value)
    assert f"no room in {small_disk}: {2**30} bytes stay free there" in str(caught.value)
    assert "TMPDIR" in str(caught.value)
    assert not list(small_disk.iterdir())


def test_profiles_in_a_compressed_database_that_stand_for_too_much_are_refused(tmp_path):
    lines = ["- &a0 {history: 1}"]
    lines += [f"- &a{n} {{<<: [{', '.join([f'*a{n - 1}'] * 9)}]}}" for n in range(1, 12)]

    def pack(file):
        with closing(sqlite3.connect(file)) as database, database:
            database.execute("UPDATE topics SET offered_qos_profiles = ?", ("\n".join(lines),))
        return zstandard.compress(file.read_bytes())

    packed_bag(tmp_path / "bag", pack)
    count, problem = read(tmp_path / "bag")
    assert count is None
    assert "more than 1000000 values" in problem


@pytest.mark.parametrize("bomb", ["zstd that says so", "zstd that lies", "lz4 that lies"])
def test_mcap_file_in_a_folder_is_refused_where_it_expands_too_far(bomb, tmp_path):
    folder = tmp_path / "bag"
    kinds = get_typestore(Stores.ROS2_HUMBLE)
    with Ros2Writer(folder, version=8, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/a", STRING, typestore=kinds)
        writer.write(connection, 0, b"\0\1\0\0\1\0\0\0\0")
    (file,) = folder.glob("*.mcap")
    assert read(folder)[0] == 1
    write_mcap(file, [good_chunk(0), (*BOMBS[bomb](), 10), good_chunk(20)], True)
    count, problem = read(folder)
    assert count is None
    assert str(CHUNK_LIMIT) in problem or "damaged" in problem


def test_profiles_in_a_database_that_stand_for_too_much_are_refused(tmp_path):
    """Without the folder's metadata, they come from the database itself."""
    kinds = get_typestore(Stores.ROS2_HUMBLE)
    folder = tmp_path / "bag"
    with Ros2Writer(folder, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/a", STRING, typestore=kinds)
        writer.write(connection, 0, b"\0\1\0\0\1\0\0\0\0")
    (file,) = folder.glob("*.db3")
    assert read(file)[0] == 1
    lines = ["- &a0 {history: 1}"]
    lines += [f"- &a{n} {{<<: [{', '.join([f'*a{n - 1}'] * 9)}]}}" for n in range(1, 12)]
    with sqlite3.connect(file) as database:
        database.execute("UPDATE topics SET offered_qos_profiles = ?", ("\n".join(lines),))
    database.close()
    count, problem = read(file)
    assert count is None
    assert "more than 1000000 values" in problem


def test_nothing_within_the_limit_is_refused():
    content = bytes(range(256)) * 1000
    packed = {
        "zstd": zstandard.compress(content),
        "lz4": lz4.frame.compress(content),
        "bz2": bz2.compress(content[:1000]) + bz2.compress(content[1000:]),
        "none": content,
    }
    for kind, data in packed.items():
        for size in (len(content), None):
            assert decompress(kind, data, size) == content
    for kind in ("zstd", "lz4", "bz2"):
        with pytest.raises(BagError):
            decompress(kind, packed[kind], len(content) - 1)
        with pytest.raises(BagError):
            decompress(kind, packed[kind][:-9], len(content))

"""How the messages of a recording are spread over time, and playing a part of it."""

from __future__ import annotations

import threading
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import pytest
from mcap import writer as mcap_writer
from rosbags import rosbag1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

import rosglass
from rosglass.bags import open_bag, read_density
from rosglass.errors import BagError
from rosglass.interfaces import full_text

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
STRING = "std_msgs/msg/String"
#: Seconds of the messages of each topic.
SPREAD = {"/dense": [at / 100 for at in range(1000)], "/rare": [0.5, 9.99]}


def _messages() -> list[tuple[float, str]]:
    return sorted((at, topic) for topic, times in SPREAD.items() for at in times)


def write_mcap(path: Path, *, finish: bool = True, chunk: int = 4096) -> Path:
    kind: Any = rosglass.load(STRING)
    with path.open("wb") as stream:
        writer = mcap_writer.Writer(stream, chunk_size=chunk)
        writer.start("ros2")
        schema = writer.register_schema(STRING, "ros2msg", full_text(kind.definition).encode())
        numbers = {topic: writer.register_channel(topic, "cdr", schema) for topic in SPREAD}
        for at, topic in _messages():
            time = START + round(at * SECOND)
            writer.add_message(numbers[topic], time, kind.encode({"data": f"{at}"}), time)
        writer.finish()
    if not finish:
        path.write_bytes(path.read_bytes()[:-400])
    return path


def write_sqlite(path: Path) -> Path:
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer2(path, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        numbers = {topic: writer.add_connection(topic, STRING, typestore=store) for topic in SPREAD}
        for at, topic in _messages():
            data = store.serialize_cdr(store.types[STRING](f"{at}"), STRING)
            writer.write(numbers[topic], START + round(at * SECOND), data)
    return path


def write_ros1(path: Path) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    with rosbag1.Writer(path) as writer:
        numbers = {topic: writer.add_connection(topic, STRING, typestore=store) for topic in SPREAD}
        for at, topic in _messages():
            data = store.serialize_ros1(store.types[STRING](f"{at}"), STRING)
            writer.write(numbers[topic], START + round(at * SECOND), data)
    return path


@pytest.mark.parametrize(
    "make",
    [
        lambda folder: write_mcap(folder / "a.mcap"),
        lambda folder: write_mcap(folder / "cut.mcap", finish=False),
        lambda folder: write_sqlite(folder / "bag"),
        lambda folder: next(write_sqlite(folder / "bag").glob("*.db3")),
        lambda folder: write_ros1(folder / "a.bag"),
    ],
    ids=["mcap", "mcap without an index", "folder", "db3", "bag"],
)
def test_density_of_each_topic(make: Callable[[Path], Path], tmp_path: Path) -> None:
    dense, rare = read_density(make(tmp_path), 10)
    assert (dense.topic, dense.count, rare.topic, rare.count) == ("/dense", 1000, "/rare", 2)
    assert sum(dense.parts) == 1000
    assert all(abs(part - 100) <= 1 for part in dense.parts)
    assert rare.parts == (1, 0, 0, 0, 0, 0, 0, 0, 0, 1)


def test_density_is_read_from_the_index(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_mcap(tmp_path / "a.mcap")
    bag = open_bag(path)
    monkeypatch.setattr(type(bag), "messages", None)
    assert sum(len(times) for _, times in bag.times()) == 1002
    bag.close()


def test_damaged_message_index_is_left_out(tmp_path: Path) -> None:
    path = write_mcap(tmp_path / "a.mcap")
    bag: Any = open_bag(path)
    place = min(bag._chunks[0].message_index_offsets.values())
    content = bytearray(path.read_bytes())
    content[place : place + 9] = b"\xff" * 9
    path.write_bytes(content)
    dense, _ = read_density(path, 10)
    assert 0 < dense.count < 1000
    bag.close()


def test_counting_ends_early_and_refuses_bad_numbers(tmp_path: Path) -> None:
    path = write_mcap(tmp_path / "a.mcap")
    ended = threading.Event()
    ended.set()
    assert sum(one.count for one in read_density(path, 5, ended)) < 1000
    for bad in (0, 10_001, float("nan"), "5"):
        with pytest.raises(BagError, match="parts"):
            read_density(path, bad)  # type: ignore[arg-type]


def test_a_part_is_played_and_repeated(tmp_path: Path, eventually: Callable[..., Any]) -> None:
    path = write_mcap(tmp_path / "a.mcap")
    got: list[float] = []
    with rosglass.connect(f"replay:{path}?paused=true&rate=20&loop=true", name="viewer") as node:
        playback: Any = node.playback  # type: ignore[attr-defined]
        with pytest.raises(BagError, match="after its start"):
            playback.set_range(5, 5)
        with pytest.raises(BagError, match="end"):
            playback.set_range(5, 500)
        playback.set_range(4, 5)
        assert playback.range == (4, 5)
        eventually(lambda: playback.position == 4)
        node.create_subscription("/dense", STRING, lambda m: got.append(float(m.data)), qos=500)
        playback.play()
        eventually(lambda: sum(b < a for a, b in pairwise(list(got))) >= 2)
        playback.pause()
        played = [at for at in got if at >= 4]
        # What a display shows at the start is up to 3 s older.
        assert min(got) >= 1
        assert max(got) < 5
        assert min(played) < 4.1
        assert max(played) > 4.9
        playback.set_range(0, playback.duration)
        playback.seek(9.5)
        playback.play()
        eventually(lambda: max(got) > 9.9)


def test_single_messages_are_played(tmp_path: Path, eventually: Callable[..., Any]) -> None:
    path = write_mcap(tmp_path / "a.mcap")
    got: list[str] = []
    with rosglass.connect(f"replay:{path}?paused=true", name="viewer") as node:
        playback: Any = node.playback  # type: ignore[attr-defined]
        node.create_subscription("/dense", STRING, lambda m: got.append(m.data), qos=500)
        for expected in (1, 2, 3):
            playback.step()
            eventually(lambda: len(got) == expected)  # noqa: B023 - called at once
        assert not playback.is_playing

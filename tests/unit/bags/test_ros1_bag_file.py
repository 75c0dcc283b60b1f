"""Writing ROS 1 bags."""

from __future__ import annotations

from random import Random

import pytest
from rosbags.rosbag1 import Reader

from rosglass import load
from rosglass.bags import open_bag
from rosglass.bags.recorder import create
from rosglass.comm import QoS, Sample
from rosglass.errors import BagError

STRING = load("std_msgs/String", ros=1)


def sample(number: int, size: int = 0) -> Sample:
    data = STRING.encode({"data": f"{number:06}" + "x" * size}, wire="ros1")
    return Sample(data, "ros1", STRING, 10**9 + number * 10**6, None, b"/talker")


@pytest.mark.parametrize("compression", ["", "none", "lz4", "bz2"])
def test_a_bag_of_many_chunks_is_complete(tmp_path, compression):
    path = tmp_path / "a.bag"
    file = create(path, "ros1", compression)
    words = file.channel("/words", STRING, [], b"/talker")
    other = file.channel("/other", STRING, [QoS.latched()], b"/listener")
    for number in range(3000):
        file.write(words if number % 3 else other, sample(number, 1000))
        if number % 500 == 0:
            file.flush()
    assert file.size() > 0
    file.finish()
    file.close()
    file.close()
    with Reader(path) as reader:
        found = {c.topic: (c.ext.callerid, c.ext.latching, c.msgcount) for c in reader.connections}
        assert found == {"/words": ("/talker", 0, 2000), "/other": ("/listener", 1, 1000)}
        times = [time for _, time, _ in reader.messages()]
    assert times == [10**9 + number * 10**6 for number in range(3000)]
    with open_bag(path) as bag:
        assert [channel.count for channel in bag.channels] == [1000, 2000]
        assert bag.start == 10**9


def test_places_of_written_messages_are_forgotten(tmp_path):
    """A day of recording must not fill the memory."""
    file = create(tmp_path / "a.bag", "ros1", "none")
    words = file.channel("/words", STRING, [], b"/talker")
    for number in range(5000):
        file.write(words, sample(number, 1000))
    kept = [chunk.connections[0] for chunk in file._writer.chunks[:-1]]
    assert len(kept) > 3
    assert all(isinstance(places, range) for places in kept)
    file.finish()


def unfinished(path, compression="none"):
    """Write 100 messages in 10 chunks, and no index, as when the program is killed."""
    file = create(path, "ros1", compression)
    words = file.channel("/words", STRING, [], b"/talker")
    more = file.channel("/words", STRING, [], b"/other")
    kept = file.channel("/kept", STRING, [QoS.latched()], b"/other")
    for number in range(100):
        file.write((words, more, kept)[number % 3], sample(number))
        if number % 10 == 9:
            file.flush()
    file.close()
    return path


def texts(bag, *args):
    return [STRING.decode(m.data, wire="ros1").data for m in bag.messages(*args)]


@pytest.mark.parametrize("name", ["a.bag", "a.bag.active"])
@pytest.mark.parametrize("compression", ["none", "lz4", "bz2"])
def test_a_bag_without_an_end_is_read_for_as_far_as_it_goes(tmp_path, caplog, name, compression):
    path = unfinished(tmp_path / "a.bag", compression).rename(tmp_path / name)
    with open_bag(path) as bag:
        assert "not closed properly" in bag.problem
        kept, words = bag.channels
        assert (words.topic, words.count, words.offered) == ("/words", 67, ())
        assert (kept.topic, kept.count, kept.offered) == ("/kept", 33, (QoS.latched(),))
        assert kept.type() == STRING
        assert (bag.start, bag.end) == (10**9, 10**9 + 99 * 10**6)
        assert texts(bag) == [f"{number:06}" for number in range(100)]
        assert texts(bag, [kept], 10**9 + 50 * 10**6, 10**9 + 56 * 10**6) == ["000050", "000053"]


def test_a_bag_cut_anywhere_is_read_or_refused(tmp_path, caplog):
    data = unfinished(tmp_path / "a.bag").read_bytes()
    path = tmp_path / "cut.bag"
    counts = []
    for end in range(0, len(data), 97):
        path.write_bytes(data[:end])
        try:
            with open_bag(path) as bag:
                found = texts(bag)
                assert found == [f"{number:06}" for number in range(len(found))]
                counts.append(len(found))
        except BagError:
            assert end < 5500
    assert counts == sorted(counts)
    assert {10, 90, 100} <= set(counts)


def test_a_damaged_bag_is_read_or_refused(tmp_path, caplog):
    data = unfinished(tmp_path / "a.bag").read_bytes()
    path, random = tmp_path / "hurt.bag", Random(2026)
    read = refused = 0
    for _ in range(200):
        hurt = bytearray(data)
        for _ in range(random.randint(1, 4)):
            hurt[random.randrange(len(hurt))] = random.randrange(256)
        path.write_bytes(hurt)
        try:
            with open_bag(path) as bag:
                read += sum(1 for _ in bag.messages())
        except BagError:
            refused += 1
    # Most of the damage costs a chunk at most.
    assert read > 100 * 50
    assert refused < 50


def test_what_a_format_cannot_hold_is_refused(tmp_path):
    with pytest.raises(BagError, match=r"name it \.mcap"):
        create(tmp_path / "a.bag", "cdr", "")
    assert not (tmp_path / "a.bag").exists()
    with pytest.raises(BagError, match="no compression 'zip'"):
        create(tmp_path / "a.mcap", "cdr", "zip")

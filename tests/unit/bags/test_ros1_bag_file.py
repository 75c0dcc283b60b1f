"""Writing ROS 1 bags."""

from __future__ import annotations

from random import Random

import pytest
from mcap import writer as mcap_writer
from rosbags.rosbag1 import Reader
from waiting import eventually

import rosglass
from rosglass import load
from rosglass.bags import Player, open_bag
from rosglass.bags.recorder import create
from rosglass.cli import main
from rosglass.comm import QoS, Sample
from rosglass.errors import BagError
from rosglass.messages import MessageType, OpaqueType
from rosglass.messages.types import mend

STRING = load("std_msgs/String", ros=1)


def sample(number: int, size: int = 0) -> Sample:
    data = STRING.encode({"data": f"{number:06}" + "x" * size}, wire="ros1")
    return Sample(data, "ros1", STRING, 10**9 + number * 10**6, None, b"/talker")


@pytest.mark.parametrize("compression", ["", "none", "lz4", "bz2"])
def test_bag_of_many_chunks_is_complete(tmp_path, compression):
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
def test_bag_without_index_is_read_up_to_its_last_chunk(tmp_path, caplog, name, compression):
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


def test_bag_cut_anywhere_is_read_or_refused(tmp_path, caplog):
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


def test_damaged_bag_is_read_or_refused(tmp_path, caplog):
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


def test_messages_before_their_connection_are_counted_and_played(tmp_path, caplog):
    """A chunk with the connection is damaged, and the end of the file repeats the connection."""
    path = tmp_path / "a.bag"
    file = create(path, "ros1", "bz2")
    words = file.channel("/words", STRING, [], b"/talker")
    for number in range(30):
        file.write(words, sample(number))
        if number % 10 == 9:
            file.flush()
    file.finish()
    file.close()
    data = bytearray(path.read_bytes())
    start = data.index(b"BZh")
    data[start + 20 : start + 40] = bytes(20)
    # Without the index, the file is read from its start.
    index = data.index(b"index_pos=") + len(b"index_pos=")
    data[index : index + 8] = (2**40).to_bytes(8, "little")
    path.write_bytes(data)
    found: list[str] = []
    with open_bag(path) as bag, rosglass.connect("local://before_connection") as node:
        (channel,) = bag.channels
        assert channel.count == 20
        assert (bag.start, bag.end) == (10**9 + 10 * 10**6, 10**9 + 29 * 10**6)
        wanted = texts(bag)
        assert len(wanted) == 20
        with Player(node, bag, delay=0.0, paused=True) as player:
            heard = node.create_subscription(
                "/words", callback=lambda m: found.append(m.data), qos=100
            )
            eventually(heard.publisher_count)
            player.resume()
            assert player.wait(30)
        eventually(lambda: found == wanted)


def test_end_that_lies_before_the_messages_ends_playing(tmp_path):
    writer = mcap_writer.Writer(str(tmp_path / "a.mcap"), use_statistics=True)
    writer.start("ros1")
    schema = writer.register_schema("std_msgs/String", "ros1msg", b"string data\n")
    number = writer.register_channel("/words", "ros1", schema)
    data = STRING.encode(data="late", wire="ros1")
    for time in (10**18, 2 * 10**18):
        writer.add_message(number, time, data, time)
    writer._Writer__statistics.message_end_time = 10**18
    writer.finish()
    with open_bag(tmp_path / "a.mcap") as bag, rosglass.connect("local://early_end") as node:
        assert bag.duration == 0.0
        with Player(node, bag, delay=0.0) as player:
            assert player.wait(30)
            assert player.status().sent == 2


#: Texts as recorders in the field wrote them, each with the md5 sum of what was meant.
BROKEN = {
    "a line that is not a definition": ("Header header\nfloat64 data\n\\n\n\n", "own_msgs/Level"),
    "a comment on two lines": (
        "Header header\n# \note this\nfloat64 temperature\nfloat64 variance\n",
        "sensor_msgs/Temperature",
    ),
    "no nested types": ("Vector3  linear\nVector3  angular\n", "geometry_msgs/Twist"),
}
HEADER = "===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"


@pytest.mark.parametrize("case", BROKEN)
@pytest.mark.parametrize("finished", [True, False])
def test_broken_definition_is_replaced_by_that_with_its_md5(tmp_path, caplog, case, finished):
    text, name = BROKEN[case]
    if name.startswith("own_msgs"):
        wanted = MessageType.from_text(name, f"Header header\nfloat64 data\n{HEADER}", ros=1)
    else:
        wanted = load(name, ros=1)
    path = tmp_path / "a.bag"
    file = create(path, "ros1", "none")
    kind = OpaqueType(name, wanted.md5, text=text, ros=1)
    number = file.channel("/t", kind, [], b"/talker")
    data = wanted.encode()
    file.write(number, Sample(data, "ros1", kind, 10**9, None, b"/talker"))
    file.flush()
    if finished:
        file.finish()
    file.close()
    with open_bag(path) as bag:
        found = bag.channels[0].type()
        assert not isinstance(found, OpaqueType)
        assert found.md5 == wanted.md5
        assert [found.decode_all(m.data) for m in bag.messages()] == [found.create()]


def test_broken_definition_with_another_md5_stays_bytes(tmp_path):
    path = tmp_path / "a.bag"
    file = create(path, "ros1", "none")
    kind = OpaqueType("own_msgs/Level", "a" * 32, text="float64 data\noops\n", ros=1)
    file.channel("/t", kind, [], b"/talker")
    file.finish()
    file.close()
    with open_bag(path) as bag:
        found = bag.channels[0].type()
    assert isinstance(found, OpaqueType)
    assert "own_msgs/msg/Level>:2:1" in found.reason
    assert "no definition of own_msgs/msg/Level (ROS 1) was found" in found.reason


def test_definition_of_broken_lines_alone_is_given_up():
    assert mend("own_msgs/msg/Level", "oops\n" * 10_000, "a" * 32) is None
    # A text that takes the parser a while is not tried ten times.
    good = MessageType.from_text("own_msgs/msg/Level", "float64 data\n", ros=1)
    for count, mended in ((1000, good), (200_000, None)):
        assert mend("own_msgs/msg/Level", "#\n" * count + "float64 data\noops", good.md5) == mended


def play(capsys, *arguments):
    code = main(["play", *map(str, arguments), "--url", "local://play_command", "-d", "0"])
    out, err = capsys.readouterr()
    return code, out, err


def test_play_of_a_bag_without_messages_ends(tmp_path, capsys):
    file = create(tmp_path / "a.bag", "ros1", "none")
    file.channel("/words", STRING, [], b"/talker")
    file.finish()
    file.close()
    code, out, err = play(capsys, tmp_path / "a.bag")
    assert (code, "0 messages sent" in out, "holds no messages" in err) == (1, True, True)


def test_play_takes_its_file_behind_names_of_topics(tmp_path, capsys):
    path = unfinished(tmp_path / "a.bag")
    lines = (
        ("-t", "/words", path),
        (path, "-t", "/words"),
        ("-t", "/words", "-m", "/words:=/w", path),
        ("-m", "/words:=/w", "/kept:=/k", "-t", "/words", path),
        ("-t", "/words", "--rate", "2", path),
    )
    for line in lines:
        code, out, _ = play(capsys, *line)
        assert code == 0
        assert "playing 1 topics" in out
        assert "67 messages sent" in out
    for line in (("-t", "/words"), ("-m", "/words:=/w"), ()):
        code, _, err = play(capsys, *line)
        assert code == 1
        assert "FILE is missing: rosglass play FILE" in err
    code, _, err = play(capsys, path, "-m", "/words")
    assert code == 1
    assert "--remap '/words' is not of the form /old:=/new" in err


def test_unsupported_format_is_refused(tmp_path):
    with pytest.raises(BagError, match=r"name it \.mcap"):
        create(tmp_path / "a.bag", "cdr", "")
    assert not (tmp_path / "a.bag").exists()
    with pytest.raises(BagError, match="no compression 'zip'"):
        create(tmp_path / "a.mcap", "cdr", "zip")

"""Recording from ROS 1 and playing to it, with rosbag, rospy and rosbags as judges."""

from __future__ import annotations

import base64
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Reader, Writer
from waiting import at_rate, eventually

import rosglass
from rosglass.bags import Player, Recorder, open_bag
from rosglass.comm import Durability
from rosglass.errors import BagError
from rosglass.messages import OpaqueType

if TYPE_CHECKING:
    from pathlib import Path

STRING, GRID = "std_msgs/String", "nav_msgs/OccupancyGrid"
CELLS = {"info": {"width": 2, "height": 1, "resolution": 0.25}, "data": [-1, 100]}


@pytest.fixture(params=["a.mcap", "a.bag", "lz4.bag", "bz2.bag"])
def recording(request, connect, rospy_peer, tmp_path) -> Path:
    """Five texts of rospy, then five of ours, and a map from before."""
    rospy_peer.call("publish", topic="/map", type=GRID, value=CELLS, latch=True)
    rospy_peer.call("publish", topic="/words", type=STRING)
    robot, ears = connect("robot"), connect("ears")
    ours = robot.create_publisher("/words", STRING)
    path = tmp_path / request.param
    compression = request.param.partition(".")[0].replace("a", "")
    with Recorder(ears, path, ["/words", "/map"], compression=compression) as recorder:
        eventually(ours.subscription_count)
        eventually(lambda: rospy_peer.call("connections", topic="/words"))
        for number in at_rate(0.05, 5):
            value = {"data": f"rospy {number}"}
            rospy_peer.call("publish", topic="/words", type=STRING, value=value)
        eventually(lambda: recorder.status().messages == 6)
        for number in at_rate(0.05, 5):
            ours.publish(data=f"ours {number}")
        eventually(lambda: recorder.status().messages == 11)
    status = recorder.status()
    assert status.topics == {"/map": 1, "/words": 10}
    assert not status.dropped
    assert not status.problems
    for topic in ("/map", "/words"):
        rospy_peer.call("unpublish", topic=topic)
    robot.close()
    return path


def test_recordings_are_read_by_others_and_by_us(recording, tool):
    texts = [f"rospy {number}" for number in range(5)] + [f"ours {number}" for number in range(5)]
    if recording.suffix == ".bag":
        info = tool("rosbag", "info", str(recording))
        lines = [line.split() for line in info.splitlines()]
        assert ["messages:", "11"] in lines
        assert ["/words", "10", "msgs", ":", STRING, "(2", "connections)"] in lines
        assert any(line[-5:] == ["/map", "1", "msg", ":", GRID] for line in lines)
        compression = recording.stem if recording.stem in ("lz4", "bz2") else "none"
        assert ["compression:", compression] in [line[:2] for line in lines]
        with AnyReader([recording]) as reader:
            found = {
                (c.topic, c.ext.callerid, c.ext.latching, c.msgcount) for c in reader.connections
            }
            assert [
                reader.deserialize(data, c.msgtype).data
                for c, _, data in reader.messages()
                if c.topic == "/words"
            ] == texts
        assert found == {
            ("/map", "/rospy_peer", 1, 1),
            ("/words", "/rospy_peer", 0, 5),
            ("/words", "/robot", 0, 5),
        }
    else:
        with recording.open("rb") as file:
            reader = make_reader(file)
            assert reader.get_header().profile == "ros1"
            summary = reader.get_summary()
            callers = {
                (c.topic, c.metadata["callerid"], c.metadata["latching"])
                for c in summary.channels.values()
            }
            assert {s.encoding for s in summary.schemas.values()} == {"ros1msg"}
            assert {s.name for s in summary.schemas.values()} == {STRING, GRID}
            assert {c.message_encoding for c in summary.channels.values()} == {"ros1"}
        assert callers == {
            ("/map", "/rospy_peer", "1"),
            ("/words", "/rospy_peer", "0"),
            ("/words", "/robot", "0"),
        }
    with open_bag(recording) as bag:
        grid, words = bag.channels
        assert (grid.topic, grid.count, words.topic, words.count) == ("/map", 1, "/words", 10)
        assert grid.profile().durability is Durability.TRANSIENT_LOCAL
        assert words.profile().durability is Durability.VOLATILE
        kind = words.type()
        found = [kind.decode(m.data, wire="ros1").data for m in bag.messages([words])]
    assert found == texts


def test_a_recording_plays_to_rospy_as_it_was(recording, connect, rospy_peer):
    node = connect("player")
    rospy_peer.call("subscribe", topic="/words", type=STRING)
    with open_bag(recording) as bag, Player(node, bag, delay=0, paused=True) as player:
        assert not player.problems
        # rospy counts connections that it is still making: the player's count is right.
        eventually(node.create_publisher("/words", STRING).subscription_count)
        player.resume()
        received = [rospy_peer.event("received") for _ in range(10)]
        # The map was sent before rospy asks for it.
        rospy_peer.call("subscribe", topic="/map", type=GRID)
        grid = rospy_peer.event("received")
        assert player.wait(30)
    assert [each["value"]["data"] for each in received] == [
        *(f"rospy {number}" for number in range(5)),
        *(f"ours {number}" for number in range(5)),
    ]
    assert received[0]["header"]["md5sum"] == rosglass.load(STRING, ros=1).md5
    assert grid["value"]["data"] == CELLS["data"]
    assert grid["header"]["latching"] == "1"
    for topic in ("/words", "/map"):
        rospy_peer.call("unsubscribe", topic=topic)


def test_rosbag_plays_our_recording_to_us(connect, rospy_peer, tmp_path, start_tool):
    robot, ears = connect("robot"), connect("ears")
    ours = robot.create_publisher("/again", STRING, rosglass.QoS.latched())
    ours.publish(data="once")
    with Recorder(ears, tmp_path / "again.bag", ["/again"]) as recorder:
        eventually(lambda: recorder.status().messages)
    robot.close()
    start_tool("rosbag", "play", "--quiet", "--keep-alive", str(tmp_path / "again.bag"))
    assert ears.create_subscription("/again").wait(30).message().data == "once"


def test_a_bag_of_an_unknown_type_plays_by_the_definition_it_holds(connect, tmp_path, rospy_peer):
    text = "uint8 LEVEL=3\nstring[] words\nduration wait\n"
    kind = rosglass.MessageType.from_text("secret_msgs/Vault", text, ros=1)
    data = kind.encode({"words": ["gold", "café"], "wait": {"secs": -1, "nsecs": 5}}, wire="ros1")
    path = tmp_path / "secret.bag"
    with Writer(path) as writer:
        connection = writer.add_connection(
            "/vault", "secret_msgs/msg/Vault", msgdef=text, md5sum=kind.md5, latching=1
        )
        writer.write(connection, 1_000_000_000, data)
    node = connect("player")
    with open_bag(path) as bag, Player(node, bag, delay=0.1) as player:
        player.wait(30)
        rospy_peer.call("subscribe", topic="/vault")
        received = rospy_peer.event("received")
    assert received["header"]["type"] == "secret_msgs/Vault"
    assert received["header"]["md5sum"] == kind.md5
    assert received["header"]["message_definition"].strip() == text.strip()
    assert base64.b64decode(received["raw"]) == data
    rospy_peer.call("unsubscribe", topic="/vault")


def test_the_clock_of_a_recording_drives_rospy(connect, start_master, start_rospy, tmp_path):
    kind = rosglass.load(STRING, ros=1)
    path = tmp_path / "old.bag"
    with Writer(path) as writer:
        connection = writer.add_connection(
            "/words", "std_msgs/msg/String", msgdef="string data\n", md5sum=kind.md5
        )
        for second in range(20):
            data = kind.encode({"data": str(second)}, wire="ros1")
            writer.write(connection, (1000 + second) * 1_000_000_000, data)
    master = start_master()
    master.call("setParam", "/use_sim_time", True)
    peer = start_rospy("follower", master=master)
    node = connect("player", url=master.url)
    with open_bag(path) as bag, Player(node, bag, rate=5, clock=50, delay=0.1) as player:
        times = [peer.call("time") for _ in iter(lambda: player.wait(0.05), True)]
    times = [each for each in times if each]
    assert times == sorted(times)
    assert 1000 <= times[-1] <= 1020
    assert times[-1] - times[0] > 2
    peer.end()


@pytest.mark.parametrize("name", ["sealed.bag", "sealed.mcap"])
@pytest.mark.parametrize("text", ["", "what is this?\n", "uint8 other\n"])
def test_messages_without_definition_are_recorded_and_played_as_bytes(
    name, text, connect, tmp_path
):
    kind = OpaqueType("sealed_msgs/msg/Box", "a" * 32, text=text, ros=1)
    robot, ears = connect("robot"), connect("ears")
    secret = robot.create_publisher("/sealed", kind, rosglass.QoS.latched())
    path = tmp_path / name
    with Recorder(ears, path, ["/sealed"]) as recorder:
        eventually(secret.subscription_count)
        secret.publish_serialized(b"\x01\x02")
        eventually(lambda: recorder.status().messages, what=lambda: str(recorder.status()))
    secret.close()
    if path.suffix == ".bag":
        with Reader(path) as reader:
            ((connection, _, data),) = reader.messages()
        assert (connection.msgtype, connection.digest) == ("sealed_msgs/msg/Box", "a" * 32)
        assert (connection.msgdef.data, bytes(data)) == (text, b"\x01\x02")
    with open_bag(path) as bag:
        assert [message.data for message in bag.messages()] == [b"\x01\x02"]
        (channel,) = bag.channels
        assert channel.type() == kind
        with Player(robot, bag, delay=0) as player:
            assert player.wait(30)
            assert not player.problems
            sample = ears.create_subscription("/sealed", kind).wait(30)
    assert (sample.data, sample.type.md5) == (b"\x01\x02", "a" * 32)


def test_rosbag_mends_a_recording_that_was_killed(connect, tmp_path, master, tool):
    publisher = connect("robot").create_publisher("/steady", STRING)
    path = tmp_path / "killed.bag"
    command = [sys.executable, "-m", "rosglass", "record", "/steady", "-o", str(path)]
    process = subprocess.Popen([*command, "--url", master.url], stdout=subprocess.DEVNULL)
    try:
        eventually(publisher.subscription_count)

        sent = 0

        def written():
            nonlocal sent
            publisher.publish(data="x" * 100)
            sent += 1
            return path.exists() and path.stat().st_size > 10_000

        def complete():
            with open_bag(path) as bag:
                return [channel.count for channel in bag.channels] == [sent]

        eventually(written, what="the second that may be lost to have passed")
        # Killed in the middle of writing, it may have lost that second, too.
        eventually(complete)
    finally:
        process.kill()
        process.wait()
    with open_bag(path) as bag:
        (channel,) = bag.channels
        assert "not closed properly" in bag.problem
        assert channel.count > 10
    tool("rosbag", "reindex", "-f", str(path))
    lines = [line.split() for line in tool("rosbag", "info", str(path)).splitlines()]
    assert ["messages:", str(channel.count)] in lines
    with open_bag(path) as bag:
        assert bag.problem == ""
        assert len(list(bag.messages())) == channel.count


def test_all_topics_are_recorded_whatever_their_names(connect, start_master, tmp_path):
    url = start_master().url
    robot, ears = connect("robot", "/left_arm", url=url), connect("ears", url=url)
    private = robot.create_publisher("~_state", STRING)
    with Recorder(ears, tmp_path / "all", exclude="/rosout.*") as recorder:
        eventually(private.subscription_count)
        private.publish(data="a")
        late = robot.create_publisher("late", "std_msgs/Empty")
        eventually(late.subscription_count)
        late.publish()
        eventually(lambda: recorder.status().messages == 2, what=lambda: str(recorder.status()))
    assert recorder.status().topics == {"/left_arm/late": 1, "/left_arm/robot/_state": 1}


@pytest.mark.parametrize(
    ("name", "compression", "reason"),
    [
        ("a.bag", "zstd", "compression 'zstd': none, lz4, bz2"),
        ("a.mcap", "bz2", "compression 'bz2': zstd, lz4, none"),
        ("there.bag", "", "choose another name"),
        ("no/where.bag", "", "make the folder"),
    ],
)
def test_invalid_recording_is_refused(connect, tmp_path, name, compression, reason):
    (tmp_path / "there.bag").write_text("mine")
    with pytest.raises(BagError, match=reason):
        Recorder(connect("ears"), tmp_path / name, compression=compression)
    assert (tmp_path / "there.bag").read_text() == "mine"

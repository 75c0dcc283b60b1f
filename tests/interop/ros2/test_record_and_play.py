"""Recording from a graph and playing to one, with other programs' libraries as judges."""

from __future__ import annotations

import json
import logging
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from mcap_ros2.reader import read_ros2_messages
from rosbags import rosbag1
from rosbags.typesys import Stores, get_typestore
from waiting import at_rate, eventually

from rosglass.bags import Player, PlayerState, Recorder, open_bag
from rosglass.comm import QoS
from rosglass.errors import BagError
from rosglass.messages import OpaqueType

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from rosglass.comm import Node

STRING, GRID = "std_msgs/msg/String", "nav_msgs/msg/OccupancyGrid"


@pytest.fixture(params=["zenoh", "dds"])
def join(request: pytest.FixtureRequest) -> Callable[..., Node]:
    name = "connect" if request.param == "zenoh" else "dds_connect"
    found: Callable[..., Node] = request.getfixturevalue(name)
    return found


@pytest.fixture
def recording(join: Callable[..., Node], tmp_path: Path) -> Path:
    """Ten texts in 0.9 s, a latched map from before, and an opaque topic."""
    robot, ears = join("robot"), join("ears")
    grid = robot.create_publisher("/map", GRID, QoS.latched())
    grid.publish(info={"width": 2, "height": 1}, data=[1, 2])
    secret = robot.create_publisher("/secret", OpaqueType("secret_msgs/msg/X"), QoS.sensor_data())
    texts = robot.create_publisher("/chatter", STRING)
    path = tmp_path / "a.mcap"
    with Recorder(ears, path, exclude="/rosout|/parameter_events") as recorder:
        eventually(lambda: texts.subscription_count() and secret.subscription_count())
        for i in at_rate(0.1, 10):
            texts.publish(data=f"n{i}")
            secret.publish_serialized(b"\0\1\0\0" + bytes([i]))
        eventually(lambda: recorder.status().messages >= 21)
        assert not recorder.status().dropped
    robot.close()
    ears.close()
    return path


def test_all_types_of_a_topic_are_recorded(join: Callable[..., Node], tmp_path: Path) -> None:
    robot, ears = join("robot"), join("ears")
    texts = robot.create_publisher("/mixed", STRING)
    path = tmp_path / "mixed.mcap"
    with Recorder(ears, path, ["/mixed"]) as recorder:
        eventually(texts.subscription_count)
        texts.publish(data="x")
        eventually(lambda: recorder.status().messages)
        switches = robot.create_publisher("/mixed", "std_msgs/msg/Bool")
        eventually(lambda: switches.subscription_count() > 1 or len(ears.topics()["/mixed"]) > 1)

        before = recorder.status().messages

        def is_recorded() -> bool:
            switches.publish(data=True)
            return recorder.status().messages > before

        eventually(is_recorded)
        assert recorder.status().problems == {}
    with open_bag(path) as bag:
        assert [channel.type_name for channel in bag.channels] == ["std_msgs/msg/Bool", STRING]
        for message in bag.messages():
            message.channel.type().decode(message.data)


def test_a_recording_is_read_by_others_and_played_by_us(
    join: Callable[..., Node], recording: Path
) -> None:
    found = [(m.channel.topic, m.ros_msg) for m in read_ros2_messages(str(recording), ["/chatter"])]
    assert [message.data for _, message in found] == [f"n{i}" for i in range(10)]
    node, listener = join("player"), join("listener")
    heard: list[str] = []
    times: list[int] = []
    listener.create_subscription("/talk", STRING, lambda message: heard.append(message.data))
    listener.create_subscription(
        "/clock", "rosgraph_msgs/msg/Clock", lambda m: times.append(m.clock.nanosec), QoS.clock()
    )
    grid = listener.create_subscription("/map", GRID, qos=QoS.latched())
    secret = listener.create_subscription(
        "/secret", OpaqueType("secret_msgs/msg/X"), qos=QoS.sensor_data().with_depth(20)
    )
    with (
        open_bag(recording) as bag,
        Player(node, bag, rate=3.0, clock=50, remap={"/chatter": "/talk"}) as player,
    ):
        began = time.monotonic()
        assert player.wait(30)
        assert player.status().state is PlayerState.FINISHED
        assert player.status().sent == 21
        assert player.problems == {}
        assert time.monotonic() - began > bag.duration / 3
        eventually(lambda: len(heard) == 10)
        assert heard == [f"n{i}" for i in range(10)]
        sample = grid.wait(30)
        assert sample is not None
        assert list(sample.message().data) == [1, 2]
        eventually(lambda: secret.statistics().received == 10)
        assert len(times) > 2


def test_pausing_stepping_seeking_and_looping(join: Callable[..., Node], recording: Path) -> None:
    node, listener = join("player"), join("listener")
    heard: list[str] = []
    texts = listener.create_subscription("/chatter", STRING, lambda m: heard.append(m.data))
    with (
        open_bag(recording) as bag,
        Player(node, bag, topics=["chatter"], paused=True, loop=True) as player,
    ):
        eventually(lambda: player.status().state is PlayerState.PAUSED)
        assert heard == []
        player.step()
        eventually(lambda: heard == ["n0"])
        player.seek(bag.duration - 0.25)
        player.resume()
        eventually(lambda: "n9" in heard)
        assert "n4" not in heard[: heard.index("n9")]
        eventually(lambda: heard.count("n0") == 2)
        player.pause()
        assert player.is_paused
        player.set_rate(1000.0)
        player.resume()
        eventually(lambda: len(heard) > 100)
        for wrong in (-1, 1e9, float("nan"), True, "1"):
            with pytest.raises(BagError, match="position must be a number from 0"):
                player.seek(wrong)  # type: ignore[arg-type]
    assert player.status().state is PlayerState.CLOSED
    texts.close()


def test_mixing_with_a_robot_is_said(
    join: Callable[..., Node], recording: Path, caplog: pytest.LogCaptureFixture
) -> None:
    node, robot = join("player"), join("robot2")
    robot.create_publisher("/chatter", STRING)
    eventually(lambda: node.publishers("/chatter"))
    with (
        caplog.at_level(logging.WARNING),
        open_bag(recording) as bag,
        Player(node, bag, topics=["/chatter"], delay=0, rate=100) as player,
    ):
        assert player.wait(30)
        assert "/robot2 publishes here, too" in player.problems["/chatter"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"topics": ["/nope"]}, "has no topic /nope; it has /chatter"),
        ({"exclude": ".*"}, "nothing to play"),
        ({"exclude": "("}, "not a regular expression"),
        ({"rate": 0}, "rate must be a number"),
        ({"start": 99}, "start must be a number from 0 to"),
        ({"topics": "/chatter"}, "as a list"),
    ],
)
def test_wrong_arguments_are_refused(
    connect: Callable[..., Node], tmp_path: Path, options: dict[str, Any], message: str
) -> None:
    node = connect("player")
    path = tmp_path / "a.mcap"
    with Recorder(node, path) as recorder:
        node.create_publisher("/chatter", STRING, QoS.latched()).publish(data="x")
        eventually(lambda: recorder.status().messages)
    with open_bag(path) as bag, pytest.raises(BagError, match=message):
        Player(node, bag, **options)
    with pytest.raises(BagError, match="File exists"):
        Recorder(node, path)
    with pytest.raises(BagError, match="compression"):
        Recorder(node, tmp_path / "b.mcap", compression="zip")


def test_the_commands_with_a_ros1_bag(
    router: Any, connect: Callable[..., Node], tmp_path: Path
) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    name = "sensor_msgs/msg/LaserScan"
    header = store.types["std_msgs/msg/Header"]
    stamp = store.types["builtin_interfaces/msg/Time"](1, 2)
    scan = store.types[name](
        header(0, stamp, "laser"), 0.0, 1.0, 0.5, 0.0, 0.0, 0.0, 9.0,
        np.array([1, 2, 3], np.float32), np.array([], np.float32),
    )  # fmt: skip
    with rosbag1.Writer(tmp_path / "a.bag") as writer:
        connection = writer.add_connection("/scan", name, typestore=store)
        for i in range(5):
            writer.write(connection, i * 100_000_000, store.serialize_ros1(scan, name))
    rosglass = [sys.executable, "-m", "rosglass"]
    listed = subprocess.run(
        [*rosglass, "play", str(tmp_path / "a.bag"), "--list", "--json"],
        capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    assert json.loads(listed.stdout)["topics"] == [
        {"topic": "/scan", "type": "sensor_msgs/LaserScan", "wire": "ros1", "messages": 5}
    ]
    output = tmp_path / "again.mcap"
    recorder = subprocess.Popen(
        [*rosglass, "record", "/scan", "-o", str(output), "--url", router.url],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    eventually(output.exists)
    played = subprocess.run(
        [*rosglass, "play", str(tmp_path / "a.bag"), "--url", router.url, "--delay", "2"],
        capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    assert "5 messages sent" in played.stdout
    time.sleep(0.5)
    recorder.send_signal(signal.SIGINT)
    out, err = recorder.communicate(timeout=30)
    assert "5 messages of 1 topics" in out, err
    with open_bag(output) as bag:
        found = [m.channel.type().decode(m.data) for m in bag.messages()]
    assert [list(message.ranges) for message in found] == [[1, 2, 3]] * 5

"""A recording in a robot's place."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

import pytest
from mcap import writer as mcap_writer
from rosbags import rosbag1
from rosbags.typesys import Stores, get_typestore
from waiting import eventually

import rosglass
from rosglass import load
from rosglass.bags import Player, ReplayNode, open_bag
from rosglass.cli import main
from rosglass.comm import ConnectionState, Duration, QoS, Time
from rosglass.errors import BagError, ConversionError, NodeClosedError, UnsupportedError
from rosglass.interfaces import full_text
from rosglass.messages import MessageType, OpaqueType

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

SECOND = 1_000_000_000
#: When the recordings were made: not now.
START = 1_700_000_000 * SECOND
STRING, CLOCK = "std_msgs/msg/String", "rosgraph_msgs/msg/Clock"
LATCHED = "- {reliability: reliable, durability: transient_local, depth: 1, history: 1}"


def write(path: Path, seconds: float = 2.0, *, clock: bool = False) -> Path:
    """Record ``/chatter`` at 10 Hz, and ``/plan``, latched, once at the beginning."""
    writer = mcap_writer.Writer(str(path))
    writer.start("ros2")

    def channel(topic: str, name: str, **more: str) -> Callable[[int, Any], None]:
        found = load(name)
        schema = writer.register_schema(name, "ros2msg", full_text(found.definition).encode())
        number = writer.register_channel(topic, "cdr", schema, more)

        def add(at: int, fields: Any) -> None:
            writer.add_message(number, at, found.encode(fields), at)

        return add

    plan = channel("/plan", STRING, offered_qos_profiles=LATCHED)
    chatter = channel("/chatter", STRING)
    time_of = channel("/clock", CLOCK) if clock else None
    plan(START, {"data": "go"})
    for i in range(round(seconds * 10) + 1):
        at = START + i * SECOND // 10
        chatter(at, {"data": str(i)})
        if time_of is not None:
            time_of(at, {"clock": {"sec": 50 + i, "nanosec": 0}})
    writer.finish()
    return path


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    return write(tmp_path / "drive.mcap")


@pytest.fixture
def play() -> Iterator[Callable[..., ReplayNode]]:
    made = []

    def connect(path: Path, options: str = "") -> ReplayNode:
        node = rosglass.connect(f"replay:{path}{options}", "cockpit")
        assert isinstance(node, ReplayNode)
        made.append(node)
        return node

    yield connect
    for node in made:
        node.close()


def listen(node: ReplayNode, topic: str, **options: Any) -> list[str]:
    found: list[str] = []
    node.create_subscription(topic, callback=lambda m: found.append(m.data), **options)
    return found


def test_subscriptions_get_what_was_recorded(drive, play):
    node = play(drive, "?rate=20")
    found = listen(node, "/chatter", qos=100)
    eventually(lambda: len(found) == 21, "the whole recording")
    assert found == [str(i) for i in range(21)]
    eventually(lambda: not node.playback.is_playing, "it pauses at its end")
    assert node.playback.position == pytest.approx(2.0)
    assert node.playback.duration == pytest.approx(2.0)
    assert node.status().state is ConnectionState.CONNECTED
    assert "drive.mcap" in node.status().detail


def test_time_is_the_recordings(drive, play):
    node = play(drive)
    assert node.now() == Time(START)
    stamps = []
    got = threading.Event()

    def take(sample: Any) -> None:
        stamps.append((sample.received_ns, node.now().nanoseconds))
        if len(stamps) > 5:
            got.set()

    node.create_subscription("/chatter", raw_callback=take)
    assert got.wait(30)
    for received, now in stamps:
        assert START <= now <= START + 2.2 * SECOND
        # As recorded, to the nanosecond.
        assert (received - START) % (SECOND // 10) == 0


def test_recorded_clock_is_used(tmp_path, play):
    node = play(write(tmp_path / "sim.mcap", clock=True), "?rate=5")
    eventually(lambda: node.now() >= Time(60 * SECOND))
    assert node.now() <= Time(70 * SECOND)


def test_seeking_shows_what_was_there_while_it_is_paused(drive, play):
    node = play(drive, "?paused=true")
    chatter, plan = listen(node, "/chatter"), listen(node, "/plan", qos=QoS.latched(1))
    assert not node.playback.is_playing
    node.playback.seek(1.05)
    assert node.playback.position == pytest.approx(1.05)
    eventually(lambda: chatter and plan)
    assert (chatter, plan) == (["10"], ["go"])
    node.playback.seek(0.35)
    eventually(lambda: len(chatter) > 1)
    assert chatter == ["10", "3"]
    assert not node.playback.is_playing
    node.playback.play()
    eventually(lambda: chatter[-1] == "20")
    assert chatter == ["10", *map(str, range(3, 21))]


def test_latecomers_get_what_was_latched(drive, play):
    node = play(drive, "?rate=20")
    eventually(lambda: not node.playback.is_playing)
    assert listen(node, "/chatter") == []
    plan = listen(node, "/plan", qos=QoS.latched(1))
    eventually(lambda: plan == ["go"])


def test_playing_again_from_the_end_and_looping(drive, play):
    node = play(drive, "?rate=20")
    found = listen(node, "/chatter", qos=1000)
    eventually(lambda: not node.playback.is_playing and len(found) == 21)
    count = len(found)
    node.playback.play()
    eventually(lambda: len(found) > count)
    assert found[count] == "0"
    node.playback.set_loop(True)
    eventually(lambda: found.count("0") >= 4)
    assert node.playback.is_playing
    assert node.playback.loop
    node.playback.set_rate(0.5)
    assert node.playback.rate == 0.5
    with pytest.raises(BagError, match="rate"):
        node.playback.set_rate(0)
    with pytest.raises(BagError, match="position"):
        node.playback.seek(3)


@pytest.mark.parametrize(
    ("seconds", "topics", "options", "lap"),
    [
        (0.0, ["/chatter"], {}, 0.1),
        (1.0, ["/plan"], {}, 1.0),
        (1.0, ["/plan"], {"rate": 2.0}, 0.5),
        (1.0, ["/plan"], {"start": 0.05, "duration": 0.02, "clock": 1.0}, 0.1),
        (1.0, ["/plan"], {"duration": 0.5}, 0.5),
    ],
    ids=["one message", "one early", "faster", "none but a latched one", "part"],
)
def test_lap_lasts_as_long_as_what_was_selected(tmp_path, play, seconds, topics, options, lap):
    path = write(tmp_path / "short.mcap", seconds)
    node, begun = play(path, "?paused=true"), time.monotonic()
    with (
        open_bag(path) as bag,
        Player(node, bag, topics=topics, loop=True, delay=0.0, **options) as player,
    ):
        eventually(lambda: player.status().sent >= 4)  # one in each lap
        sent, took = player.status().sent, time.monotonic() - begun
    assert took >= 0.99 * lap * (sent - 1)


def test_publishing_to_a_recording_is_a_problem(drive, play):
    node = play(drive, "?paused=true")
    found = listen(node, "/cmd")
    with node.create_publisher("/cmd", STRING) as publisher:
        publisher.publish(data="stop")
        assert "reaches no robot" in publisher.problem
        assert publisher.subscription_count() == 0
        with pytest.raises(ConversionError, match="data"):
            publisher.publish(data=7)
    with pytest.raises(NodeClosedError):
        publisher.publish(data="stop")
    assert found == []
    with pytest.raises(
        UnsupportedError, match=r"drive\.mcap is a recording, which answers no requests"
    ):
        node.create_service_client("/reset", "std_srvs/srv/Trigger")


def test_graph_is_that_of_the_recording(drive, play):
    node = play(drive, "?paused=true")
    assert node.topics()["/chatter"] == [STRING]
    assert [p.node.full for p in node.publishers("/chatter")] == ["/recording"]
    assert [n.full for n in node.nodes()] == ["/cockpit", "/recording"]
    assert node.services() == node.actions() == {}
    changed = threading.Event()
    node.on_graph_change(changed.set)
    listen(node, "/chatter")
    assert changed.wait(20)
    assert [s.node.full for s in node.subscriptions("/chatter")] == ["/cockpit"]


def test_some_topics_only(drive, play):
    node = play(drive, "?paused=true")
    node.choose(["plan"])
    chatter, plan = listen(node, "/chatter"), listen(node, "/plan", qos=QoS.latched(1))
    assert node.publishers("/chatter") == []
    node.playback.seek(1.0)
    eventually(lambda: plan)
    assert chatter == []
    node.choose([])
    node.playback.seek(0.55)
    eventually(lambda: chatter == ["5"])


def test_topic_that_was_left_out_is_received_as_soon_as_it_is_chosen(drive, play):
    # Not first when the node looks at the graph: what a paused recording sends comes once.
    node = play(drive, "?paused=true")
    node.choose(["plan"])
    chatter = node.create_subscription("/chatter")
    assert chatter.type.name == STRING
    assert chatter.publisher_count() == 0
    node.choose([])
    assert chatter.publisher_count() == 1


def test_other_type_than_recorded_is_a_problem(drive, play):
    node = play(drive)
    other = node.create_subscription("/chatter", "std_msgs/msg/Bool")
    eventually(lambda: other.problem)
    assert other.problem == "/recording publishes std_msgs/msg/String here, not std_msgs/msg/Bool"
    assert "chatter" in node.create_subscription("/chater").hint


def test_ros_1_recording(tmp_path, play):
    store = get_typestore(Stores.ROS1_NOETIC)
    kind = store.types[STRING]
    path = tmp_path / "old.bag"
    with rosbag1.Writer(path) as writer:
        connection = writer.add_connection("/chatter", STRING, typestore=store)
        for i in range(5):
            data = store.serialize_ros1(kind(data=str(i)), STRING)
            writer.write(connection, START + i * SECOND // 10, data)
    node = play(path)
    assert node.wire == "ros1"
    found = listen(node, "/chatter")
    eventually(lambda: len(found) == 5)
    assert found == ["0", "1", "2", "3", "4"]
    assert node.now() >= Time(START)


def test_ros_1_recording_sends_what_is_latched_to_every_subscriber(tmp_path, play):
    store = get_typestore(Stores.ROS1_NOETIC)
    kind = store.types[STRING]
    path = tmp_path / "latched.bag"
    with rosbag1.Writer(path) as writer:
        for topic, latching in (("/plan", 1), ("/chatter", 0)):
            connection = writer.add_connection(topic, STRING, typestore=store, latching=latching)
            writer.write(connection, START, store.serialize_ros1(kind(data=topic), STRING))
    node = play(path)
    eventually(lambda: not node.playback.is_playing)
    plan, chatter = listen(node, "/plan"), listen(node, "/chatter")
    eventually(lambda: plan == ["/plan"])
    node.playback.seek(0.0)
    eventually(lambda: not node.playback.is_playing)
    assert set(chatter) <= {"/chatter"}


def test_recording_is_received_whatever_quality_of_service_was_offered(tmp_path, play):
    # What was received once is not withheld now.
    node = play(write(tmp_path / "drive.mcap"), "?rate=20")
    asked = QoS(depth=100, deadline=Duration.from_seconds(0.001))
    found = listen(node, "/chatter", qos=asked)
    eventually(lambda: len(found) == 21)


def test_types_that_only_the_recording_knows(tmp_path, play):
    path = tmp_path / "own.mcap"
    writer = mcap_writer.Writer(str(path))
    writer.start("ros2")
    own = MessageType.from_text("own_msgs/msg/Height", "float64 metres")
    schema = writer.register_schema(own.name, "ros2msg", b"float64 metres")
    number = writer.register_channel("/height", "cdr", schema)
    writer.add_message(number, START, own.encode(metres=2.5), START)
    unknown = writer.register_schema("own_msgs/msg/Lost", "", b"")
    number = writer.register_channel("/lost", "cdr", unknown)
    writer.add_message(number, START, b"\0\1\0\0abcd", START)
    writer.finish()
    node = play(path, "?paused=true")
    assert node.fetch_type("own_msgs/msg/Height").fields[0].name == "metres"
    heights = [node.create_subscription("/height", given) for given in (None, own.name)]
    lost = node.create_subscription("/lost", callback=lambda _: None)
    # Those that take bytes, as interfaces and commands do, report the same.
    samples = [node.create_subscription("/lost", given) for given in (None, "own_msgs/Lost")]
    for each in (lost, *samples):
        eventually(lambda each=each: "the recording has no definition of it" in each.problem)
        assert "Library.add_path('own_msgs')" in each.problem
    eventually(lambda: all(each.type is not None for each in samples))
    node.playback.play()
    assert [height.wait(30).message().metres for height in heights] == [2.5, 2.5]
    assert [each.wait(30).data for each in samples] == [b"\0\1\0\0abcd"] * 2
    assert all(isinstance(each.type, OpaqueType) for each in samples)


def test_ros_1_definition_with_another_md5_is_reported(tmp_path, play, capsys):
    path = tmp_path / "own.mcap"
    writer = mcap_writer.Writer(str(path))
    writer.start("ros1")
    schema = writer.register_schema("own_msgs/Gear", "ros1msg", b"float32 x\n")
    number = writer.register_channel("/gear", "ros1", schema, {"md5sum": "0" * 32})
    writer.add_message(number, START, b"abcd", START)
    writer.finish()
    subscription = play(path, "?paused=true").create_subscription("/gear")
    eventually(lambda: f"the recording says md5 {'0' * 32}" in subscription.problem)
    assert main(["topic", "echo", "/gear", "--once", "--url", f"replay:{path}"]) == 0
    out, err = capsys.readouterr()
    assert out == "61626364\n---\n"
    assert f"/gear: own_msgs/Gear is shown as bytes: the recording says md5 {'0' * 32}" in err


@pytest.mark.parametrize(
    ("rest", "error", "message"),
    [
        ("", ConversionError, r"a recording such as replay:drive\.mcap"),
        ("nothing.mcap", BagError, r"nothing\.mcap does not exist"),
        ("drive.mcap?rate=fast", ConversionError, "a number such as 0.5"),
        ("drive.mcap?rate=0", BagError, "rate must be"),
        ("drive.mcap?speed=2", ConversionError, "options such as rate=2"),
        ("drive.mcap?loop=maybe", ConversionError, "options such as rate=2"),
    ],
)
def test_unplayable_url_is_refused(drive, monkeypatch, rest, error, message):
    monkeypatch.chdir(drive.parent)
    with pytest.raises(error, match=message):
        rosglass.connect(f"replay:{rest}")


def test_closing_ends_everything(drive, play):
    threads = threading.active_count()
    node = play(drive)
    subscription = node.create_subscription("/chatter")
    assert subscription.wait(20) is not None
    node.close()
    node.close()
    assert subscription.closed
    assert node.status().state is ConnectionState.CLOSED
    eventually(lambda: threading.active_count() <= threads)
    with pytest.raises(NodeClosedError):
        node.create_subscription("/chatter")


@pytest.mark.parametrize(
    ("command", "output"),
    [
        (["topic", "list"], "/chatter"),
        (["topic", "echo", "/chatter", "--once"], "data: '"),
        (["node", "list"], "/recording"),
        (["service", "list"], ""),
    ],
)
def test_commands_list_contents_of_recordings(drive, capsys, command, output):
    from rosglass.cli import main

    main([*command, "--url", f"replay:{drive}"])
    assert output in capsys.readouterr().out


def test_unrecorded_durability_causes_no_problem(drive, play):
    node = play(drive, "?rate=20")
    found: list[str] = []
    subscription = node.create_subscription(
        "/chatter", callback=lambda m: found.append(m.data), qos=QoS.latched()
    )
    eventually(lambda: found and subscription.publisher_count() == 1)
    assert subscription.problem == ""
    # What was recorded is compared.
    plan = node.create_subscription("/plan", qos=QoS(deadline=Duration(SECOND)))
    eventually(lambda: "deadline" in plan.problem)

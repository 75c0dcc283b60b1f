"""Messages of several topics that belong together, on real middleware."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.comm import ConnectionState, QoS

if TYPE_CHECKING:
    from conftest import Bench

IMU, TEMPERATURE = "sensor_msgs/msg/Imu", "sensor_msgs/msg/Temperature"

PANEL = """
    QtObject {
        id: root
        property SynchronizedSubscription sync: SynchronizedSubscription {
            PROPERTIES
            onNewMessages: (list) => root.got.push(list.map((m) => m.header.frame_id).join("+"))
        }
        property var got: []
        function all() { return got.join() }
        function state() { return [sync.stale, sync.frequency > 0, sync.problem].join() }
        function latest() {
            return sync.messages ? sync.messages.map((m) => m.header.frame_id).join("+") : ""
        }
        function problem() { return sync.problem }
        function dropped() { return sync.dropped }
        function disable() { sync.enabled = false }
        function setTopics(t) { sync.topics = t }
        MORE
    }
"""


def panel(live: Bench, properties: str, more: str = "") -> Any:
    return live.load(PANEL.replace("PROPERTIES", properties).replace("MORE", more))


class Robot:
    def __init__(self, live: Bench, wait: Any, count: int = 2) -> None:
        names = [("/a", IMU), ("/b", TEMPERATURE), ("/c", IMU)][:count]
        self._senders = [live.robot.create_publisher(t, kind, QoS(50)) for t, kind in names]
        self._wait, self._ros1 = wait, live.robot.wire == "ros1"

    def linked(self) -> None:
        self._wait(lambda: all(s.subscription_count() for s in self._senders), 30)

    def send(self, topic: int, milliseconds: int, name: str) -> None:
        sec, rest = divmod(milliseconds, 1000)
        part = "nsecs" if self._ros1 else "nanosec"
        stamp = {"secs" if self._ros1 else "sec": 1000 + sec, part: rest * 1_000_000}
        self._senders[topic].publish(header={"stamp": stamp, "frame_id": name})


@pytest.mark.parametrize("module", ["Ros2 1.0", "Ros 1.0"])
def test_matching_messages_arrive_together(live: Bench, module: str, wait: Any) -> None:
    live.module = module
    robot = Robot(live, wait)
    root = panel(live, 'topics: ["/a", "/b"]; slop: 20')
    assert root.state() == "true,false,"
    robot.linked()
    for k in range(10):
        robot.send(0, 100 * k, f"a{k}")
        if k != 4:
            robot.send(1, 100 * k + 10, f"b{k}")
    wait(lambda: "a8+b8" in root.all())
    assert "a4" not in root.all()
    assert root.all().startswith("a0+b0,a1+b1,a2+b2,a3+b3,a5+b5")
    assert root.latest() in ("a8+b8", "a9+b9")
    wait(lambda: root.dropped() == 1)
    wait(lambda: root.state().startswith("false"))
    root.disable()
    wait(lambda: root.state().startswith("true"))


@pytest.mark.both_qt
def test_three_topics_with_their_types(live: Bench, wait: Any) -> None:
    robot = Robot(live, wait, 3)
    wanted = f'[{{topic: "/a", type: "{IMU}"}}, "/b", {{topic: "c", qos: 5}}]'
    root = panel(live, f"topics: {wanted}; slop: 0")
    robot.linked()
    for k in range(3):
        for topic in (2, 0, 1):
            robot.send(topic, k, f"{'abc'[topic]}{k}")
    wait(lambda: root.all() == "a0+b0+c0,a1+b1+c1,a2+b2+c2")


def test_the_topics_of_subscriptions(live: Bench, wait: Any) -> None:
    robot = Robot(live, wait, 3)
    root = panel(
        live,
        "subscriptions: [one, two]; slop: 20",
        """
        property Subscription one: Subscription { id: one; topic: "/a" }
        property Subscription two: Subscription { id: two; topic: "/b" }
        function change() { two.topic = "/c" }
        """,
    )
    times = itertools.count()

    def heard(other: int, wanted: str) -> bool:
        # In ROS 1, two subscriptions share one link: it does not show when both are ready.
        at = 10 * next(times)
        robot.send(0, at, "a")
        robot.send(other, at, "bc"[other - 1])
        return bool(wanted in root.all())

    wait(lambda: heard(1, "a+b"))
    root.change()
    wait(lambda: heard(2, "a+c"))


@pytest.mark.parametrize(
    ("properties", "message"),
    [
        ('topics: ["/a"]', "at least two of them"),
        ('topics: "/a"', "expected an array"),
        ('topics: ["/a", 7]', 'a topic, {topic: "/scan"'),
        ('topics: ["/a", "/b b"]', "/b b"),
        ('topics: ["/a", {topic: "/b", type: "no/msg/Such"}]', "no/msg/Such"),
    ],
)
def test_problems_are_reported(live: Bench, wait: Any, properties: str, message: str) -> None:
    root = panel(live, properties)
    wait(lambda: message in root.problem())
    root.setTopics(["/a", "/b"])
    wait(lambda: root.problem() == "")


def test_messages_without_header(live: Bench, wait: Any) -> None:
    text = live.robot.create_publisher("/text", "std_msgs/msg/String", 10)
    other = live.robot.create_publisher("/other", "std_msgs/msg/String", 10)
    root = panel(live, 'topics: ["/text", "/other"]')
    loose = live.load("""
        QtObject {
            property int n: 0
            property SynchronizedSubscription sync: SynchronizedSubscription {
                topics: ["/text", "/other"]; allowHeaderless: true; slop: 60000
                onNewMessages: (list) => n += list.length
            }
        }
    """)

    def heard() -> bool:
        text.publish(data="x")
        other.publish(data="y")
        return bool(loose.property("n") >= 2)

    wait(heard)
    wait(lambda: "std_msgs/msg/String has no header.stamp to go by" in root.problem())


def test_values_that_are_refused(live: Bench, caplog: Any) -> None:
    panel(live, "queueSize: 0; slop: -1; timeout: -5")
    for message in ("queueSize 0 is not", "slop -1 ms is not", "timeout -5 ms is negative"):
        assert message in caplog.text


def test_a_set_that_a_silent_link_kept_back_is_stale(running: Bench, wait: Any) -> None:
    robot = Robot(running, wait)
    root = panel(running, 'topics: ["/a", "/b"]')
    robot.linked()
    robot.send(0, 0, "left")
    robot.send(1, 0, "right")
    wait(lambda: root.state().startswith("false"))
    running.world.held_back_s = 10
    robot.send(0, 500, "LEFT")
    robot.send(1, 500, "RIGHT")
    wait(lambda: root.latest() == "LEFT+RIGHT")
    assert root.state().startswith("true")


def test_a_set_from_before_an_outage_stays_stale(running: Bench, wait: Any) -> None:
    robot = Robot(running, wait)
    root = panel(running, 'timeout: 0; topics: ["/a", "/b"]')
    robot.linked()
    robot.send(0, 0, "left")
    robot.send(1, 0, "right")
    wait(lambda: root.state().startswith("false"))
    node: Any = running.session.node
    node.set_status(ConnectionState.LOST, "gone")
    wait(lambda: root.state().startswith("true"))
    node.set_status(ConnectionState.CONNECTED)
    wait(lambda: running.session.state == "connected")
    wait.settled(running.session)
    assert root.state().startswith("true")
    robot.send(0, 500, "LEFT")
    robot.send(1, 500, "RIGHT")
    wait(lambda: root.state().startswith("false"))

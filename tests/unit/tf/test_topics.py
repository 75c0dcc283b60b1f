"""Listener and broadcasters on a node without a network."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import pytest
from receiving import deliver

import rosglass
from rosglass.comm import (
    IMMEDIATE,
    Clock,
    ConnectionState,
    QoS,
    Sample,
    Status,
    Subscription,
    Time,
    Timers,
)
from rosglass.comm.qos import Durability
from rosglass.errors import InvalidArgumentException, InvalidNameError, NodeClosedError
from rosglass.tf import (
    UNKNOWN_PUBLISHER,
    StaticTransformBroadcaster,
    Transform,
    TransformBroadcaster,
    TransformListener,
)

NAME = "tf2_msgs/msg/TFMessage"


class Node:
    """The parts of a node that tf needs; keeps published messages."""

    def __init__(self, ros: int = 2) -> None:
        self.wire = "ros1" if ros == 1 else "cdr"
        self.type: Any = rosglass.load(NAME, ros)
        self.clock = Clock("test", IMMEDIATE, Timers("test"))
        self.has_simulated_stamps = False
        self.subscriptions: dict[str, Subscription] = {}
        self.profiles: dict[str, QoS] = {}
        self.sent: list[tuple[str, bytes]] = []
        self.known: list[Any] = []
        self.asked = 0
        self.refused = ""
        self.state = ConnectionState.CONNECTED
        self.closed: list[str] = []
        #: Called when something is sent, as subscriptions of the same program are.
        self.receivers: list[Any] = []

    def status(self) -> Status:
        return Status(self.state, "")

    def resolve(self, name: str) -> str:
        return name if name.startswith("/") else f"/own/{name}"

    def create_subscription(self, topic: str, type: str, **more: Any) -> Subscription:
        if topic == self.refused:
            raise NodeClosedError("closed")
        made = Subscription(
            topic, self.type, more["qos"], more["executor"], raw_callback=more["raw_callback"]
        )
        self.subscriptions[topic], self.profiles[topic] = made, more["qos"]
        return made

    def create_publisher(self, topic: str, type: str, qos: QoS) -> Any:
        if self.state is ConnectionState.CLOSED:
            raise NodeClosedError("closed")
        self.profiles[topic] = qos

        def send(data: bytes) -> None:
            self.sent.append((topic, data))
            for callback in self.receivers:
                callback()

        return SimpleNamespace(
            topic=topic,
            type=self.type,
            publish=lambda fields: send(self.type.encode(fields, wire=self.wire)),
            publish_serialized=send,
            close=lambda: self.closed.append(topic),
        )

    def publishers(self, topic: str) -> list[Any]:
        self.asked += 1
        return self.known

    def deliver(self, number: int, publisher: bytes = b"gid") -> None:
        topic, data = self.sent[number]
        sample = Sample(data, self.wire, self.type, 0, None, publisher)
        deliver(self.subscriptions[topic], sample)


def place(child: str, sec: int = 5) -> Transform:
    return Transform(
        (1.0, 0.0, 0.0), stamp=Time.from_parts(sec, 7), frame_id="map", child_frame_id=child
    )


@pytest.mark.parametrize("ros", [1, 2])
def test_sent_and_received(ros: int) -> None:
    node: Any = Node(ros)
    listener = TransformListener(node)
    TransformBroadcaster(node).send_transform([place("base"), place("arm")])
    fixed = StaticTransformBroadcaster(node)
    fixed.send_transform(place("camera"))
    fixed.send_transform(place("lidar"))
    node.deliver(0, b"/robot")
    # The last message has all.
    node.deliver(2, b"/robot")
    tree = listener.buffer.tree()
    assert sorted(tree) == ["arm", "base", "camera", "lidar", "map"]
    assert [name for name in tree if tree[name].static] == ["camera", "lidar"]
    assert listener.buffer.lookup_transform("map", "arm").stamp == Time.from_parts(5, 7)
    assert node.profiles["/tf_static"].durability is Durability.TRANSIENT_LOCAL
    assert node.profiles["/tf"].durability is Durability.VOLATILE
    assert tree["arm"].authority == ("/robot" if ros == 1 else UNKNOWN_PUBLISHER)


def test_frames_that_a_bridge_passes_on_are_not_late_because_others_are_stamped_ahead() -> None:
    node: Any = Node()
    listener = TransformListener(node)
    broadcaster = TransformBroadcaster(node)
    for number in range(40):
        # AMCL's are a second ahead by default.
        frame, ahead = ("odom", 30) if number % 2 else ("base", 0)
        broadcaster.send_transform(place(frame, 100 + number + ahead))
        topic, data = node.sent[-1]
        sample = Sample(data, node.wire, node.type, (100 + number) * 10**9, None, b"bridge")
        deliver(node.subscriptions[topic], sample)
    assert listener.buffer.silence("map", "base") < 15
    assert listener.buffer.silence("map", "odom") < 15


@pytest.mark.parametrize("ros", [1, 2])
def test_several_broadcasters_of_a_node_send_all_transforms_together(ros: int) -> None:
    node: Any = Node(ros)
    first, second = StaticTransformBroadcaster(node), StaticTransformBroadcaster(node)
    elsewhere = StaticTransformBroadcaster(node, "/other")
    assert first.publisher is second.publisher is not elsewhere.publisher
    first.send_transform(place("camera"))
    second.send_transform([place("lidar"), place("camera", 9)])
    elsewhere.send_transform(place("arm"))
    # Who comes late gets the last message only.
    listener = TransformListener(node)
    node.deliver(1)
    tree = listener.buffer.tree()
    assert sorted(tree) == ["camera", "lidar", "map"]
    first.close()
    first.close()
    assert node.closed == []
    with pytest.raises(NodeClosedError):
        first.send_transform(place("camera"))
    second.send_transform(place("sonar"))
    node.deliver(3)
    assert sorted(listener.buffer.tree()) == ["camera", "lidar", "map", "sonar"]
    second.close()
    assert node.closed == ["/tf_static"]
    assert StaticTransformBroadcaster(node).publisher is not second.publisher
    node.state = ConnectionState.CLOSED
    with pytest.raises(NodeClosedError):
        StaticTransformBroadcaster(node)


def test_callback_of_static_transforms_may_send_some() -> None:
    """Also from another thread, and waiting for it: no lock is held while they are sent."""
    node: Any = Node()
    broadcaster = StaticTransformBroadcaster(node)
    sent = threading.Event()

    def answer() -> None:
        node.receivers.clear()

        def send() -> None:
            broadcaster.send_transform(place("lidar"))
            sent.set()

        threading.Thread(target=send, daemon=True).start()
        assert sent.wait(20)
        broadcaster.send_transform(place("sonar"))

    node.receivers.append(answer)
    done = threading.Thread(target=lambda: broadcaster.send_transform(place("camera")), daemon=True)
    done.start()
    done.join(25)
    assert not done.is_alive()
    assert sent.is_set()
    listener = TransformListener(node)
    node.deliver(len(node.sent) - 1)
    assert sorted(listener.buffer.tree()) == ["camera", "lidar", "map", "sonar"]


def test_static_transforms_can_be_sent_after_one_that_failed() -> None:
    node: Any = Node()
    broadcaster = StaticTransformBroadcaster(node)

    def fail() -> None:
        node.receivers.clear()
        raise NodeClosedError("the connection is gone")

    node.receivers.append(fail)
    with pytest.raises(NodeClosedError):
        broadcaster.send_transform(place("camera"))
    broadcaster.send_transform(place("lidar"))
    listener = TransformListener(node)
    node.deliver(1)
    assert sorted(listener.buffer.tree()) == ["camera", "lidar", "map"]


def test_name_of_a_publisher_is_asked_for_once() -> None:
    node: Any = Node()
    listener = TransformListener(node)
    TransformBroadcaster(node).send_transform(place("base"))
    node.deliver(0)
    assert node.asked == 0, "who receives has other things to do"
    assert listener.buffer.tree()["base"].authority == UNKNOWN_PUBLISHER
    # Over DDS, names of nodes arrive after their publishers.
    for full in ("/_dds/driver_4711_robot", "/robot/driver"):
        publisher = SimpleNamespace(gid=b"gid", node=SimpleNamespace(full=full))
        node.known = [SimpleNamespace(gid=b"other"), publisher]
        assert listener.buffer.tree()["base"].authority == full
    node.known = []
    assert listener.buffer.tree()["base"].authority == "/robot/driver"


@pytest.mark.parametrize(
    ("namespace", "topic"),
    [("/", "/tf"), ("", "/own/tf"), ("/robot1", "/robot1/tf"), ("robot1/", "/own/robot1/tf")],
)
def test_namespaces(namespace: str, topic: str) -> None:
    node: Any = Node()
    listener = TransformListener(node, namespace=namespace)
    assert [one.topic for one in listener.subscriptions] == [topic, f"{topic}_static"]
    assert TransformBroadcaster(node, namespace).publisher.topic == topic
    assert StaticTransformBroadcaster(node, namespace).publisher.topic == f"{topic}_static"


def test_invalid_namespace_is_rejected() -> None:
    with pytest.raises(InvalidNameError):
        TransformListener(Node(), namespace=None)  # type: ignore[arg-type]


def test_failed_listener_closes_its_other_subscription() -> None:
    node: Any = Node()
    node.refused = "/tf_static"
    with pytest.raises(NodeClosedError):
        TransformListener(node)
    assert node.subscriptions["/tf"].closed


def test_invalid_transforms_are_not_sent() -> None:
    node: Any = Node()
    for kind in (TransformBroadcaster, StaticTransformBroadcaster):
        broadcaster = kind(node)
        for bad in (None, 3, ["map"], Transform(), Transform(frame_id="a", child_frame_id="a")):
            with pytest.raises(InvalidArgumentException):
                broadcaster.send_transform([place("base"), bad] if bad == 3 else bad)  # type: ignore[list-item]
    assert node.sent == []


def test_rubbish_changes_nothing(caplog: pytest.LogCaptureFixture) -> None:
    node: Any = Node()
    listener = TransformListener(node)
    node.sent.append(("/tf", b"\x00\x01\x00\x00\xff\xff\xff\xff"))
    node.deliver(0)
    assert not len(listener.buffer.tree())
    assert "TFMessage" in caplog.text


def test_closing() -> None:
    node: Any = Node()
    listener = TransformListener(node)
    promise = listener.buffer.lookup_transform_async("map", "base")
    TransformBroadcaster(node).send_transform(place("base"))
    listener.close()
    listener.close()
    node.deliver(0)
    assert not listener.buffer.has_frame("base")
    with pytest.raises(NodeClosedError):
        promise.result(1)


def test_time_that_begins_anew() -> None:
    node: Any = Node()
    listener = TransformListener(node)
    TransformBroadcaster(node).send_transform(place("base"))
    StaticTransformBroadcaster(node).send_transform(place("camera"))
    node.deliver(0)
    node.deliver(1)
    node.clock.simulate(True)
    assert sorted(listener.buffer.tree()) == ["camera", "map"]
    node.clock.advance(Time.from_parts(9, 0))
    node.deliver(0)
    node.clock.advance(Time.from_parts(10, 0))
    assert listener.buffer.has_frame("base")
    node.clock.advance(Time.from_parts(1, 0))
    assert not listener.buffer.has_frame("base")

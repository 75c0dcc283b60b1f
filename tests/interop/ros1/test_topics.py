"""Topics both ways with rospy and roscpp: every kind of field, latched ones, images of 6 MB."""

from __future__ import annotations

import zlib

import pytest
from waiting import eventually

import rosglass
from rosglass.messages.message import plain

INF = float("inf")
HEADER = {"seq": 7, "stamp": {"secs": 4294967295, "nsecs": 999999999}, "frame_id": "base_länk"}
IDENTITY = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
SIZE = 1920 * 1080 * 3
IMAGE = {
    "header": HEADER,
    "height": 1080,
    "width": 1920,
    "encoding": "rgb8",
    "is_bigendian": 0,
    "step": 5760,
}

#: Type and value of each kind of field that ROS 1 has, at its limits.
VALUES = {
    "empty": ("std_msgs/Empty", {}),
    "bool": ("std_msgs/Bool", {"data": True}),
    "byte": ("std_msgs/Byte", {"data": -128}),
    "char": ("std_msgs/Char", {"data": 255}),
    "int8": ("std_msgs/Int8", {"data": -128}),
    "uint8": ("std_msgs/UInt8", {"data": 255}),
    "int16": ("std_msgs/Int16", {"data": -32768}),
    "uint16": ("std_msgs/UInt16", {"data": 65535}),
    "int32": ("std_msgs/Int32", {"data": -(2**31)}),
    "uint32": ("std_msgs/UInt32", {"data": 2**32 - 1}),
    "int64": ("std_msgs/Int64", {"data": -(2**63)}),
    "uint64": ("std_msgs/UInt64", {"data": 2**64 - 1}),
    "float32": ("std_msgs/Float32", {"data": -0.15625}),
    "float64": ("std_msgs/Float64", {"data": 1.7976931348623157e308}),
    "infinity": ("std_msgs/Float64", {"data": -INF}),
    "time": ("std_msgs/Time", {"data": {"secs": 2**32 - 1, "nsecs": 999999999}}),
    "duration": ("std_msgs/Duration", {"data": {"secs": -(2**31), "nsecs": 999999999}}),
    "string": ("std_msgs/String", {"data": 'Grüße, ロボット 🤖 "quoted"\n\tbackslash \\'}),
    "empty string": ("std_msgs/String", {"data": ""}),
    "long string": ("std_msgs/String", {"data": "é" * 100_000}),
    "array": (
        "std_msgs/Float64MultiArray",
        {
            "layout": {
                "dim": [
                    {"label": "rows", "size": 2, "stride": 4},
                    {"label": "", "size": 2, "stride": 2},
                ],
                "data_offset": 0,
            },
            "data": [0.0, -1.5, INF, 1e-308],
        },
    ),
    "byte array": (
        "std_msgs/ByteMultiArray",
        {"layout": {"dim": [], "data_offset": 1}, "data": [-128, -1, 0, 127]},
    ),
    "int64 array": (
        "std_msgs/Int64MultiArray",
        {"layout": {"dim": [], "data_offset": 1}, "data": [-(2**63), 2**63 - 1]},
    ),
    "fixed array": (
        "nav_msgs/Odometry",
        {
            "header": HEADER,
            "child_frame_id": "base",
            "pose": {
                "pose": {"position": {"x": 1.5, "y": -2.5, "z": 0.0}, "orientation": IDENTITY},
                "covariance": [i / 4 for i in range(36)],
            },
            "twist": {
                "twist": {
                    "linear": {"x": 0.5, "y": 0.0, "z": 0.0},
                    "angular": {"x": 0.0, "y": 0.0, "z": -0.25},
                },
                "covariance": [0.0] * 36,
            },
        },
    ),
    "nested arrays": (
        "trajectory_msgs/JointTrajectory",
        {
            "header": HEADER,
            "joint_names": ["shoulder", "", "ellbögen"],
            "points": [
                {
                    "positions": [0.5, 1.0, -1.0],
                    "velocities": [],
                    "accelerations": [2.0],
                    "effort": [],
                    "time_from_start": {"secs": -1, "nsecs": 500000000},
                },
                {
                    "positions": [],
                    "velocities": [],
                    "accelerations": [],
                    "effort": [],
                    "time_from_start": {"secs": 3, "nsecs": 0},
                },
            ],
        },
    ),
    "strings in arrays": (
        "diagnostic_msgs/DiagnosticArray",
        {
            "header": HEADER,
            "status": [
                {
                    "level": 2,
                    "name": "motör",
                    "message": "hot",
                    "hardware_id": "",
                    "values": [{"key": "°C", "value": "93"}, {"key": "", "value": ""}],
                },
                {"level": 0, "name": "", "message": "", "hardware_id": "x", "values": []},
            ],
        },
    ),
}
KINDS = list(VALUES)


def topic_of(direction: str, kind: str) -> str:
    return f"/{direction}/{kind.replace(' ', '_')}"


def numbered(value: dict) -> dict:
    """Return what is received of a publisher's first message: publishers number headers."""
    return value | {"header": value["header"] | {"seq": 1}} if "header" in value else value


def roscpp_type(name: str) -> dict[str, str]:
    """Return the arguments that roscpp needs for a type that it was not compiled with."""
    found = rosglass.load(name, ros=1)
    text = rosglass.interfaces.full_text(found.definition)
    return {"type": name, "md5": found.md5, "definition": text}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("given", ["type given", "type discovered"])
def test_we_receive_what_rospy_publishes(kind, given, connect, rospy_peer):
    name, value = VALUES[kind]
    topic = topic_of(f"rospy/{given.split()[1]}", kind)
    rospy_peer.call("publish", topic=topic, type=name, value=value, latch=True)
    node = connect("reader")
    subscription = node.create_subscription(topic, name if given == "type given" else None)
    sample = subscription.wait(30)
    assert sample is not None, subscription.problem or node.status()
    assert sample.type.md5 == rosglass.load(name, ros=1).md5
    value = numbered(value)
    assert plain(sample.message().to_dict()) == value
    assert sample.publisher == b"/rospy_peer"
    assert sample.data == sample.type.encode(value, wire="ros1")


@pytest.mark.parametrize("kind", KINDS)
def test_rospy_receives_what_we_publish(kind, connect, rospy_peer):
    name, value = VALUES[kind]
    topic = topic_of("to_rospy", kind)
    publisher = connect("writer").create_publisher(topic, name, rosglass.QoS.latched())
    publisher.publish(value)
    rospy_peer.call("subscribe", topic=topic, type=name)
    received = rospy_peer.event("received")
    assert received["topic"] == topic
    assert received["value"] == numbered(value)
    assert received["header"]["latching"] == "1"
    assert received["header"]["callerid"] == "/writer"
    rospy_peer.call("unsubscribe", topic=topic)


@pytest.mark.parametrize("kind", KINDS)
def test_roscpp_and_we_exchange_the_same_bytes(kind, connect, roscpp_peer):
    name, value = VALUES[kind]
    data = rosglass.load(name, ros=1).encode(numbered(value), wire="ros1")
    there, back = topic_of("to_roscpp", kind), topic_of("from_roscpp", kind)
    node = connect("exchanger")
    publisher = node.create_publisher(there, name, rosglass.QoS.latched())
    publisher.publish(value)
    roscpp_peer.call("subscribe", topic=there)
    received = roscpp_peer.event("received")
    shown = data.hex() if len(data) <= 100_000 else len(data)
    assert (received["topic"], received["value"]) == (there, shown)
    assert received["header"]["type"] == name
    roscpp_peer.call("publish", topic=back, data=data.hex(), latch=True, **roscpp_type(name))
    sample = node.create_subscription(back).wait(30)
    assert sample.data == data
    assert plain(sample.message().to_dict()) == numbered(value)


def test_our_messages_are_numbered_as_rospy_numbers_its_own(connect, rospy_peer):
    name, topic = "geometry_msgs/PoseStamped", "/numbered"
    publisher = connect("counter").create_publisher(topic, name)
    rospy_peer.call("subscribe", topic=topic, type=name)
    eventually(publisher.subscription_count)
    message = publisher.type(header={"seq": 40})
    for _ in range(3):
        publisher.publish(message)
    publisher.publish_serialized(publisher.type.encode(message, wire="ros1"))
    publisher.publish(message)
    got = [rospy_peer.event("received")["value"]["header"]["seq"] for _ in range(5)]
    assert got == [1, 2, 3, 40, 4]
    assert message.header.seq == 40
    rospy_peer.call("unsubscribe", topic=topic)


def test_roscpp_decodes_what_we_publish_with_its_own_classes(connect, roscpp_peer):
    node = connect("typed")
    values = {
        "std_msgs/String": {"data": "Grüße"},
        "geometry_msgs/PoseStamped": {
            "header": {"stamp": {"secs": 12, "nsecs": 34}, "frame_id": "map"},
            "pose": {"position": {"x": 1.5}, "orientation": {"w": 1.0}},
        },
        "sensor_msgs/Image": IMAGE | {"data": bytes([7]) * SIZE},
    }
    expected = {
        "std_msgs/String": "Grüße",
        "geometry_msgs/PoseStamped": {
            "frame_id": "map", "sec": 12, "nsec": 34, "x": 1.5, "w": 1.0,
        },
        "sensor_msgs/Image": {"size": SIZE, "sum": 7 * SIZE, "width": 1920, "encoding": "rgb8"},
    }  # fmt: skip
    for name, value in values.items():
        topic = f"/typed/{name.rpartition('/')[2].lower()}"
        node.create_publisher(topic, name, rosglass.QoS.latched()).publish(value)
        roscpp_peer.call("subscribe", topic=topic, type=name)
        received = roscpp_peer.event("received")
        assert (received["topic"], received["value"]) == (topic, expected[name])


def test_images_of_six_megabytes_arrive_whole_both_ways(connect, rospy_peer, roscpp_peer):
    node = connect("camera")
    value = IMAGE | {"data": bytes(range(256)) * (SIZE // 256)}
    publisher = node.create_publisher("/picture/ours", "sensor_msgs/Image", rosglass.QoS.latched())
    publisher.publish(value)
    rospy_peer.call("subscribe", topic="/picture/ours", type="sensor_msgs/Image")
    received = rospy_peer.event("received")["value"]
    assert received["data"] == [SIZE, zlib.crc32(value["data"])]
    assert received["header"] == HEADER | {"seq": 1}
    whole = IMAGE | {"data": {"repeat": 9, "length": SIZE}}
    rospy_peer.call(
        "publish", topic="/picture/rospys", type="sensor_msgs/Image", value=whole, latch=True
    )
    sample = node.create_subscription("/picture/rospys").wait(30)
    assert bytes(sample.message().data) == bytes([9]) * SIZE
    kind = rosglass.load("sensor_msgs/Image", ros=1)
    head = kind.encode(IMAGE, wire="ros1")[:-4] + SIZE.to_bytes(4, "little")
    roscpp_peer.call(
        "publish", topic="/picture/roscpps", data=head.hex(), padding=SIZE, latch=True,
        **roscpp_type("sensor_msgs/Image"),
    )  # fmt: skip
    sample = node.create_subscription("/picture/roscpps").wait(30)
    assert sample.message().data[SIZE - 1] == 7
    assert len(sample.message().data) == SIZE


@pytest.mark.parametrize("which", ["rospy", "roscpp"])
def test_only_the_last_message_of_a_latched_peer_comes(which, connect, rospy_peer, roscpp_peer):
    topic, kind = f"/latched/{which}", rosglass.load("std_msgs/Int32", ros=1)
    for number in (1, 2, 3):
        if which == "rospy":
            rospy_peer.call(
                "publish", topic=topic, type="std_msgs/Int32", value={"data": number}, latch=True
            )
        else:
            data = kind.encode({"data": number}, wire="ros1").hex()
            roscpp_peer.call(
                "publish", topic=topic, data=data, latch=True, **roscpp_type("std_msgs/Int32")
            )
    node = connect("late")
    subscription = node.create_subscription(topic)
    assert subscription.wait(30).message().data == 3
    assert subscription.wait(0.3) is None


@pytest.mark.parametrize("which", ["rospy", "roscpp"])
def test_peers_get_our_last_latched_message_and_nothing_of_a_volatile_one(
    which, connect, rospy_peer, roscpp_peer
):
    peer = rospy_peer if which == "rospy" else roscpp_peer
    node = connect("early")
    latched = node.create_publisher(
        f"/ours/latched_{which}", "std_msgs/String", rosglass.QoS.latched()
    )
    volatile = node.create_publisher(f"/ours/volatile_{which}", "std_msgs/String")
    for text in ("first", "second"):
        latched.publish(data=text)
        volatile.publish(data=text)
    for publisher in (volatile, latched):
        peer.call("subscribe", topic=publisher.topic, type="std_msgs/String")
        eventually(publisher.subscription_count, what="the peer's connection")
    received = peer.event("received")
    shown = {"data": "second"} if which == "rospy" else "second"
    assert (received["topic"], received["value"]) == (latched.topic, shown)
    volatile.publish(data="third")
    received = peer.event("received")
    assert received["topic"] == volatile.topic


@pytest.mark.parametrize("which", ["rospy", "roscpp"])
def test_a_thousand_messages_come_in_order_and_complete(which, connect, rospy_peer, roscpp_peer):
    topic, kind = f"/many/{which}", "geometry_msgs/PointStamped"
    node = connect("counter")
    subscription = node.create_subscription(topic, kind, qos=2000)
    if which == "rospy":
        rospy_peer.call("publish", topic=topic, type=kind, queue=2000)
        ask = {"type": kind, "value": {"header": {"frame_id": "a"}}, "count": 1000, "rate": 2000}
    else:
        data = rosglass.load(kind, ros=1).encode({"header": {"frame_id": "a"}}, wire="ros1").hex()
        ask = roscpp_type(kind) | {"data": data, "count": 1000, "rate": 2000, "queue": 2000}
        roscpp_peer.call("publish", topic=topic, queue=2000, **roscpp_type(kind))
    peer = rospy_peer if which == "rospy" else roscpp_peer
    eventually(lambda: peer.call("connections", topic=topic), what="our connection at the peer")
    peer.call("publish", topic=topic, **ask)
    numbers = []
    while len(numbers) < 1000:
        sample = subscription.wait(30)
        assert sample is not None, f"after {len(numbers)} of 1000: {subscription.statistics()}"
        numbers.append(sample.message().header.seq)
    if which == "rospy":  # it counts them; roscpp was given bytes
        assert numbers == list(range(numbers[0], numbers[0] + 1000))


def test_several_publishers_feed_one_subscription(connect, rospy_peer, start_rospy, roscpp_peer):
    second = start_rospy("second_peer")
    node = connect("listener")
    own = connect("ours_too")
    subscription = node.create_subscription("/shared", "std_msgs/String", qos=100)
    value = {"data": "x"}
    for peer in (rospy_peer, second):
        peer.call("publish", topic="/shared", type="std_msgs/String", value=value, latch=True)
    data = rosglass.load("std_msgs/String", ros=1).encode(value, wire="ros1").hex()
    roscpp_peer.call(
        "publish", topic="/shared", data=data, latch=True, **roscpp_type("std_msgs/String")
    )
    own.create_publisher("/shared", "std_msgs/String", rosglass.QoS.latched()).publish(value)
    senders = set()
    while len(senders) < 4:
        sample = subscription.wait(30)
        assert sample is not None, f"only from {senders}"
        senders.add(sample.publisher.decode())
    assert senders == {"/rospy_peer", "/second_peer", "/roscpp_peer", "/ours_too"}
    second.end()

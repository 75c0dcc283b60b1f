"""The other sides of benchmarks/dds.py: cyclonedds's own Python API, and dora-rs."""
# Annotations stay objects: cyclonedds makes its types of them.

import threading
import time
from dataclasses import dataclass
from typing import Any

from cyclonedds import _clayer
from cyclonedds.core import (
    InstanceState,
    Listener,
    Policy,
    Qos,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

# ruff: noqa: D101, D102 - types and callbacks that are named for what they are

WIDTH, HEIGHT = 1920, 1080
_MASK = SampleState.Any | ViewState.Any | InstanceState.Any


@dataclass
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    header: Header
    px: float64
    py: float64
    pz: float64
    ox: float64
    oy: float64
    oz: float64
    ow: float64


TYPES = {
    "std_msgs/msg/String": String,
    "sensor_msgs/msg/Image": Image,
    "geometry_msgs/msg/PoseStamped": PoseStamped,
}


def make(kind: type) -> Any:
    """Return a sample to be sent."""
    if kind is String:
        return String("")
    header = Header(Time(0, 0), "")
    if kind is PoseStamped:
        return PoseStamped(header, *[0.0] * 7)
    return Image(header, HEIGHT, WIDTH, "rgb8", 0, 3 * WIDTH, bytes(WIDTH * HEIGHT * 3))


def profile(plan: dict[str, Any]) -> Qos:
    """Return what ROS 2's default profile is, or reliable with all samples kept."""
    return Qos(
        Policy.Reliability.Reliable(duration(infinite=True)),
        Policy.History.KeepAll if plan["case"] == "rate" else Policy.History.KeepLast(10),
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )


def sender(plan: dict[str, Any], dds_topic: str) -> Any:
    """Return a function that publishes one sample with the time in it."""
    participant = DomainParticipant(plan["domain"])
    topic = Topic(participant, dds_topic, TYPES[plan["type"]])
    writer = DataWriter(participant, topic, qos=profile(plan))
    value = make(TYPES[plan["type"]])

    def send() -> None:
        if isinstance(value, String):
            value.data = f"{time.time_ns():020}{'x' * 35}"
        else:
            value.header.stamp = Time(*divmod(time.time_ns(), 1_000_000_000))
        writer.write(value)

    return send


class OnData(Listener):  # type: ignore[misc]
    """Takes samples, or their bytes, when there are some."""

    def __init__(self, take: Any) -> None:
        super().__init__()
        self._take = take

    def on_data_available(self, reader: DataReader) -> None:
        self._take(reader)


def receive(plan: dict[str, Any], dds_topic: str, text: Any, stamp: Any, data: Any) -> Any:
    """Subscribe; returns what has to be kept.

    Args:
        plan: What to do.
        dds_topic: The topic.
        text: Takes a String's text.
        stamp: Takes the seconds and nanoseconds of a header.
        data: Takes bytes.
    """
    participant = DomainParticipant(plan["domain"])
    kind = TYPES[plan["type"]]
    topic = Topic(participant, dds_topic, kind)

    def take(reader: DataReader) -> None:
        for sample in reader.take(64):
            if kind is String:
                text(sample.data)
            else:
                stamp(sample.header.stamp.sec, sample.header.stamp.nanosec)

    def take_bytes(reader: DataReader) -> None:
        for found, _ in _clayer.ddspy_take(reader._ref, _MASK, 64):
            data(found)

    listener = None
    if plan["case"] != "unread" and plan["how"] != "waitset":
        listener = OnData(take if plan["how"] == "listener" else take_bytes)
    reader = DataReader(participant, topic, qos=profile(plan), listener=listener)
    if plan["how"] == "waitset":
        waitset = WaitSet(participant)
        waitset.attach(ReadCondition(reader, _MASK))

        def run() -> None:
            while True:
                waitset.wait(duration(seconds=1))
                take(reader)

        threading.Thread(target=run, daemon=True).start()
    return participant, topic, reader, listener


def receive_by_dora(plan: dict[str, Any], ros_topic: str, stamp: Any) -> Any:
    """Subscribe with dora-rs, which has to be asked for messages; returns what has to be kept."""
    import warnings

    import dora

    warnings.simplefilter("ignore")  # it says of itself that it is unstable
    context = dora.Ros2Context(
        [plan["interfaces"]], transport=dora.Ros2Transport.dds(), domain_id=plan["domain"]
    )
    node = context.new_node("subscriber", "/dora", dora.Ros2NodeOptions())
    qos = dora.Ros2QosPolicies(reliable=True, keep_last=10)
    topic = node.create_topic(ros_topic, plan["type"].replace("/msg/", "/"), qos)
    subscription = node.create_subscription(topic)

    def run() -> None:
        while True:
            message = subscription.next()
            if message is None:
                time.sleep(0.0005)
                continue
            sent = message[0]["header"]["stamp"]
            stamp(sent["sec"].as_py(), sent["nanosec"].as_py())

    threading.Thread(target=run, daemon=True).start()
    return node, subscription

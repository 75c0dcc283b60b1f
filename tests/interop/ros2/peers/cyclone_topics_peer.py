"""Cyclone DDS's own Python API with real types: `cyclone_topics_peer.py PLAN`, see ``plan`` below.

It writes and reads what the plan says until its standard input ends.
"""
# Annotations stay objects: cyclonedds makes its types of them.

import json
import sys
import threading
from dataclasses import dataclass

from cyclonedds.core import Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from summary import VALUES, report, summary
from waiting import at_rate, eventually

# What is in the plan: "domain"; types by topic to "publish" and "subscribe"; how many to publish in
# "count", seconds between them in "period"; "asked" to begin when a line comes on standard input
# (readers say "linked" when they know a writer); "texts" to number them;
# "rubbish" with the lengths of sequences to be sent as Strings. What is in "qos": "best_effort",
# "latched", "xcdr2" (no other encoding), "depth" (0 keeps all), and seconds of "deadline",
# "lifespan" and "lease".
plan = json.loads(sys.argv[1])
given = plan.get("qos", {})


@dataclass
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


@dataclass
class Int32(IdlStruct, typename="std_msgs::msg::dds_::Int32_"):
    data: int32


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector3
    angular: Vector3


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
class Rubbish(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    length: uint32
    words: sequence[uint32]


TYPES = {
    "std_msgs/msg/String": String,
    "std_msgs/msg/Int32": Int32,
    "geometry_msgs/msg/Twist": Twist,
    "sensor_msgs/msg/Image": Image,
}


def value(kind: type, fields: dict) -> object:
    """Return a sample with the fields, which are dicts inside."""
    inner = {"linear": Vector3, "angular": Vector3, "header": Header, "stamp": Time}
    return kind(
        **{name: value(inner[name], x) if name in inner else x for name, x in fields.items()}
    )


def profile(writer: bool) -> Qos:
    depth = given.get("depth", 10)
    policies = [
        Policy.Reliability.BestEffort
        if given.get("best_effort")
        else Policy.Reliability.Reliable(duration(seconds=1)),
        Policy.Durability.TransientLocal if given.get("latched") else Policy.Durability.Volatile,
        Policy.History.KeepLast(depth) if depth else Policy.History.KeepAll,
        Policy.DataRepresentation(
            use_cdrv0_representation="xcdr2" not in given,
            use_xcdrv2_representation="xcdr2" in given,
        ),
    ]
    if given.get("latched") and writer:
        history = Policy.History.KeepLast(depth or 1)
        policies.append(Policy.DurabilityService(0, history, -1, -1, -1))
    if "deadline" in given:
        policies.append(Policy.Deadline(duration(seconds=given["deadline"])))
    if "lifespan" in given and writer:
        policies.append(Policy.Lifespan(duration(seconds=given["lifespan"])))
    if "lease" in given:
        policies.append(Policy.Liveliness.Automatic(duration(seconds=given["lease"])))
    return Qos(*policies)


def subscribe(name: str, kind: type, reader: DataReader) -> None:
    linked = False
    for _ in at_rate(0.002):
        if not linked and reader.get_matched_publications():
            linked = True
            report(linked=name)
        for sample in reader.take(100):
            if isinstance(sample, kind):
                report(received=name, value=summary(sample))


def publish(name: str, type_name: str, kind: type, writer: DataWriter) -> None:
    samples = [value(kind, VALUES.get(type_name, {"data": 7}))] if kind is not Rubbish else []
    samples += [Rubbish(2**32 - 1 - size, [size] * size) for size in plan.get("rubbish", ())]
    begin.wait()
    if "asked" in plan:
        eventually(writer.get_matched_subscriptions)
    for number in at_rate(plan.get("period", 0.1), plan.get("count")):
        for sample in samples:
            if plan.get("texts"):
                sample.data = f"{number}"
            writer.write(sample)
    report(published=name)
    kept.append(writer)


participant = DomainParticipant(plan["domain"])
kept: list[DataWriter] = []
threads: list[threading.Thread] = []
begin = threading.Event()
if "asked" not in plan:
    begin.set()
# Here, not in the threads: cyclonedds prepares a type with no regard to others that do the same.
for name, of_type in plan.get("subscribe", {}).items():
    kind = TYPES[of_type]
    reader = DataReader(participant, Topic(participant, f"rt{name}", kind), qos=profile(False))
    threads.append(threading.Thread(target=subscribe, args=(name, kind, reader), daemon=True))
for name, of_type in plan.get("publish", {}).items():
    kind = Rubbish if "rubbish" in plan else TYPES[of_type]
    writer = DataWriter(participant, Topic(participant, f"rt{name}", kind), qos=profile(True))
    threads.append(
        threading.Thread(target=publish, args=(name, of_type, kind, writer), daemon=True)
    )
for thread in threads:
    thread.start()
report(ready=True)
sys.stdin.readline()
begin.set()
sys.stdin.read()

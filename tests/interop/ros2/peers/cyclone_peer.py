"""Cyclone DDS's own Python nodes, with real types: `cyclone_peer.py PLAN`, see ``plan`` below.

It speaks plain DDS and writes what rmw_cyclonedds writes; it reports what it sees of others as raw
Cyclone DDS shows it, and ends on ``{"quit": true}``. Its types need annotations that are evaluated.
"""

import json
import sys
import threading
from dataclasses import dataclass

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import InstanceState, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, bounded_str, int64, sequence, uint8
from cyclonedds.internal import DDS
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from summary import report

# The plan: "domain", "width" of identities in bytes, "topics" (what node /cyclone/talker has, by
# topic: a "writer" or a "reader" of std_msgs/msg/String), "hash" of their type, "service" (name of
# an AddTwoInts server of node /cyclone/adder), "foreign" (a DDS topic that is not of ROS),
# "rubbish" (whether to write that about nodes), "observe" (whether to report what others announce).
plan = json.loads(sys.argv[1])
info = "rmw_dds_common::msg::dds_"
srv = "example_interfaces::srv::dds_::AddTwoInts"
width = plan.get("width", 16)


@dataclass
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


@dataclass
class Request(IdlStruct, typename=f"{srv}_Request_"):
    a: int64
    b: int64


@dataclass
class Response(IdlStruct, typename=f"{srv}_Response_"):
    sum: int64


@dataclass
class Gid(IdlStruct, typename=f"{info}::Gid_"):
    data: array[uint8, width]


@dataclass
class NodeEntitiesInfo(IdlStruct, typename=f"{info}::NodeEntitiesInfo_"):
    node_namespace: bounded_str[256]
    node_name: bounded_str[256]
    reader_gid_seq: sequence[Gid]
    writer_gid_seq: sequence[Gid]


@dataclass
class ParticipantEntitiesInfo(IdlStruct, typename=f"{info}::ParticipantEntitiesInfo_"):
    gid: Gid
    node_entities_info_seq: sequence[NodeEntitiesInfo]


@dataclass
class Rubbish(IdlStruct, typename=f"{info}::ParticipantEntitiesInfo_"):
    data: sequence[uint8]


def gid(entity) -> Gid:
    return Gid(list(entity.guid.bytes.ljust(width, b"\0")))


participant = DomainParticipant(plan["domain"], Qos(Policy.Userdata(b"enclave=/;")))
latched = [
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.Durability.TransientLocal,
    Policy.DataRepresentation(use_cdrv0_representation=True),
]
endpoint_qos = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.Deadline(duration(milliseconds=500)),
    Policy.DataRepresentation(use_cdrv0_representation=True),
    Policy.Userdata(f"typehash={plan.get('hash', '')};".encode()),
)
talker = NodeEntitiesInfo("/cyclone", "talker", [], [])
adder = NodeEntitiesInfo("/cyclone", "adder", [], [])
kept = []
for name, kind in plan.get("topics", {}).items():
    topic = Topic(participant, f"rt{name}", String)
    made = (DataWriter if kind == "writer" else DataReader)(participant, topic, qos=endpoint_qos)
    gids = talker.writer_gid_seq if kind == "writer" else talker.reader_gid_seq
    gids.append(gid(made))
    kept.append(made)
if "service" in plan:
    requests = DataReader(participant, Topic(participant, f"rq{plan['service']}Request", Request))
    replies = DataWriter(participant, Topic(participant, f"rr{plan['service']}Reply", Response))
    adder.reader_gid_seq.append(gid(requests))
    adder.writer_gid_seq.append(gid(replies))
    kept += [requests, replies]
if "foreign" in plan:
    kept.append(DataWriter(participant, Topic(participant, plan["foreign"], String)))
if plan.get("rubbish"):
    discovery = Topic(participant, "ros_discovery_info", Rubbish)
    writer = DataWriter(participant, discovery, qos=Qos(*latched, Policy.History.KeepAll))
    for number in range(50):
        writer.write(Rubbish([255] * (number + 1)))
elif plan.get("topics"):
    discovery = Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo)
    writer = DataWriter(participant, discovery, qos=Qos(*latched))
    writer.write(ParticipantEntitiesInfo(gid(participant), [talker, adder]))


def node_of(entities: NodeEntitiesInfo) -> dict:
    return {
        "namespace": entities.node_namespace,
        "name": entities.node_name,
        "readers": [bytes(item.data).hex() for item in entities.reader_gid_seq],
        "writers": [bytes(item.data).hex() for item in entities.writer_gid_seq],
    }


def user_data(qos: Qos) -> str:
    return bytes(qos[Policy.Userdata].data).decode() if Policy.Userdata in qos else ""


def observe() -> None:
    """Report what others announce, as plain Cyclone DDS sees it."""
    mask = SampleState.Any | ViewState.Any | InstanceState.Any
    infos = DataReader(
        participant,
        Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo),
        qos=Qos(*latched, Policy.History.KeepAll),
    )
    readers = {
        "participant": BuiltinDataReader(participant, BuiltinTopicDcpsParticipant),
        "writer": BuiltinDataReader(participant, BuiltinTopicDcpsPublication),
        "reader": BuiltinDataReader(participant, BuiltinTopicDcpsSubscription),
        "nodes": infos,
    }
    waitset = WaitSet(participant)
    for reader in readers.values():
        waitset.attach(ReadCondition(reader, mask))
    while True:
        waitset.wait(duration(seconds=10))
        for kind, reader in readers.items():
            for sample in reader.take(100):
                if kind == "nodes" and isinstance(sample, ParticipantEntitiesInfo):
                    nodes = [node_of(entities) for entities in sample.node_entities_info_seq]
                    report(info={"gid": bytes(sample.gid.data).hex(), "nodes": nodes})
                elif kind == "participant" and sample.sample_info.valid_data:
                    guid, data = sample.key.bytes.hex(), user_data(sample.qos)
                    report(participant={"guid": guid, "user_data": data})
                elif kind in ("reader", "writer") and sample.sample_info.valid_data:
                    found = {"topic": sample.topic_name, "type": sample.type_name}
                    found |= {"guid": sample.key.bytes.hex(), "user_data": user_data(sample.qos)}
                    report(**{kind: found})


if plan.get("observe"):
    threading.Thread(target=observe, daemon=True).start()
report(ready=True)
for line in sys.stdin:
    if json.loads(line).get("quit"):
        DDS._dll_handle.dds_delete(participant._ref)
        break

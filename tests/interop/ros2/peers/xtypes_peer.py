"""Cyclone DDS's own Python writers, which announce their types: `xtypes_peer.py PLAN`."""

import json
import sys
from dataclasses import dataclass
from typing import Optional

import cyclonedds.idl.annotations as annotate
import cyclonedds.idl.types as t
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlEnum, IdlStruct, make_idl_struct
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from summary import report
from waiting import at_rate

# The plan: "domain".
plan = json.loads(sys.argv[1])


def struct(name, fields):
    return make_idl_struct(f"{name}_", f"my_msgs.msg.dds_.{name}_", fields)


@dataclass
@annotate.mutable
class Mutable(IdlStruct, typename="my_msgs.msg.dds_.Mutable_"):
    a: t.int8


@dataclass
class Maybe(IdlStruct, typename="my_msgs.msg.dds_.Maybe_"):
    a: Optional[t.int8]  # noqa: UP045 - Cyclone DDS knows no other spelling


class Color(IdlEnum, typename="my_msgs.msg.Color"):
    RED = 0


Part = struct("Part", {"a": t.int8, "xyz": t.array[t.float32, 3]})
PART = Part(a=1, xyz=[1, 2, 3])
STATE = {
    "state": (t.uint8, 3),
    "flag": (bool, True),
    "parts": (t.sequence[Part], [PART, PART]),
    "few": (t.sequence[Part, 2], [PART]),
    "one": (Part, PART),
    "pair": (t.array[Part, 2], [PART, PART]),
    "name": (str, "hi"),
    "short": (t.bounded_str[5], "abc"),
    "names": (t.sequence[str], ["x", "yz"]),
    "raw": (t.sequence[t.byte], [1, 255]),
    "letter": (t.char, "A"),
    "small": (t.int16, -2),
    "big": (t.uint64, 2**63),
    "wide": (t.float64, 0.5),
}
samples = {
    "state": struct("State", {name: kind for name, (kind, _) in STATE.items()})(
        **{name: value for name, (_, value) in STATE.items()}
    ),
    "with_enum": struct("WithEnum", {"color": Color})(color=Color.RED),
    "rows": struct("Rows", {"rows": t.sequence[t.sequence[t.uint8]]})(rows=[[1]]),
    "mutable": Mutable(a=1),
    "maybe": Maybe(a=None),
}
participant = DomainParticipant(plan["domain"])
writers = [
    (DataWriter(participant, Topic(participant, f"rt/{name}", type(sample))), sample)
    for name, sample in samples.items()
]
report(ready=True)
for _ in at_rate(0.1):
    for writer, sample in writers:
        writer.write(sample)

"""Answers requests after replies that belong to none: `dds_foreign_replies_peer.py PLAN`.

The plan: "domain", "service" of type example_interfaces/srv/AddTwoInts, and how many "foreign"
replies come before each answer, which comes twice. Their headers are those of rmw_cyclonedds.
"""

import json
import random
import sys
from dataclasses import dataclass

from cyclonedds.core import Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import int64, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from summary import report
from waiting import at_rate

plan = json.loads(sys.argv[1])
srv = "example_interfaces::srv::dds_::AddTwoInts"


@dataclass
class Request(IdlStruct, typename=f"{srv}_Request_"):
    client: uint64
    number: int64
    a: int64
    b: int64


@dataclass
class Response(IdlStruct, typename=f"{srv}_Response_"):
    client: uint64
    number: int64
    sum: int64


qos = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.History.KeepAll,
    Policy.DataRepresentation(use_cdrv0_representation=True),
)
participant = DomainParticipant(plan["domain"])
requests = DataReader(
    participant, Topic(participant, f"rq{plan['service']}Request", Request), qos=qos
)
replies = DataWriter(
    participant, Topic(participant, f"rr{plan['service']}Reply", Response), qos=qos
)
chance = random.Random(1)
sent = 0
for _ in at_rate(0.005):
    for request in requests.take(10):
        client, number = request.client, request.number
        for turn in range(plan["foreign"]):
            other = chance.getrandbits(64) if turn % 2 else client
            near = chance.choice((-(2**63), -1, 0, number - 1, number + 1000, 2**63 - 1))
            replies.write(Response(other, number if other != client else near, -1))
            sent += 1
        for _ in range(2):
            replies.write(Response(client, number, request.a + request.b))
        report(sent=sent)

"""Sends bytes that are neither requests nor replies: `dds_rubbish_peer.py PLAN`.

The plan: "domain", "requests" and "replies", services of type example_interfaces/srv/AddTwoInts
whose requests and replies to spoil. It has no server's ids, as no rmw has written it.
"""

import json
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import uint8, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from summary import report
from waiting import at_rate, eventually

plan = json.loads(sys.argv[1])
srv = "example_interfaces::srv::dds_::AddTwoInts"


@dataclass
class Request(IdlStruct, typename=f"{srv}_Request_"):
    octet: uint8


@dataclass
class Response(IdlStruct, typename=f"{srv}_Response_"):
    some: uint64


qos = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.History.KeepAll,
    Policy.DataRepresentation(use_cdrv0_representation=True),
)
participant = DomainParticipant(plan["domain"])
requests = DataWriter(
    participant, Topic(participant, f"rq{plan['requests']}Request", Request), qos=qos
)
odd = DataReader(participant, Topic(participant, f"rq{plan['replies']}Request", Request), qos=qos)
replies = DataWriter(
    participant, Topic(participant, f"rr{plan['replies']}Reply", Response), qos=qos
)
eventually(lambda: requests.get_matched_subscriptions() and replies.get_matched_subscriptions())
time.sleep(0.2)
for number in range(20):
    requests.write(Request(number))
    replies.write(Response(number))
report(sent=True)
for _ in at_rate(0.01):
    for _ in odd.take(10):
        replies.write(Response(4711))

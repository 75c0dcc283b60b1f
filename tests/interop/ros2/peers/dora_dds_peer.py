"""A dora-rs node over DDS: `dora_dds_peer.py PLAN` with the plan as JSON, see ``plan`` below."""

from __future__ import annotations

import json
import sys

import dora
from summary import report

# {"domain", "interfaces", "publish": {topic: type}, "subscribe": {topic: type}}
plan = json.loads(sys.argv[1])
transport = dora.Ros2Transport.dds()
context = dora.Ros2Context([plan["interfaces"]], transport=transport, domain_id=plan["domain"])
node = context.new_node("dora_node", "/dora", dora.Ros2NodeOptions())
qos = dora.Ros2QosPolicies(reliable=True, keep_last=5)


def topic(name: str, type_name: str):
    return node.create_topic(name, type_name.replace("/msg/", "/"), qos)


kept = [node.create_publisher(topic(*item)) for item in plan.get("publish", {}).items()]
kept += [node.create_subscription(topic(*item)) for item in plan.get("subscribe", {}).items()]
report(ready=True)
sys.stdin.read()  # until the tests end

"""A dora-rs node: `dora_peer.py PLAN` with the plan as JSON, see ``plan`` below."""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import dora
import pyarrow as pa
from summary import VALUES, report, summary
from waiting import at_rate

# {"port", "domain", "interfaces", "profile": "humble" or "rep2016" over Zenoh, "dds" without port,
#  "publish": {topic: type}, "subscribe": {topic: type}, "latched": bool, "count": how many messages
#  to publish}
plan = json.loads(sys.argv[1])
with tempfile.NamedTemporaryFile("w", suffix=".json5", delete=False) as config:
    json.dump(
        {
            "mode": "peer",
            "connect": {"endpoints": [f"tcp/127.0.0.1:{plan.get('port')}"]},
            "listen": {"endpoints": ["tcp/127.0.0.1:0"]},
            "scouting": {"multicast": {"enabled": False}},
            "timestamping": {"enabled": True},
        },
        config,
    )
if plan["profile"] == "dds":
    transport = dora.Ros2Transport.dds()
else:
    transport = dora.Ros2Transport.zenoh(plan["profile"], config.name)
context = dora.Ros2Context([plan["interfaces"]], transport=transport, domain_id=plan["domain"])
Path(config.name).unlink()
node = context.new_node("dora_node", "/dora", dora.Ros2NodeOptions())
qos = dora.Ros2QosPolicies(reliable=True, keep_last=5)
if plan.get("latched"):
    durability = dora.Ros2Durability.TransientLocal
    qos = dora.Ros2QosPolicies(durability=durability, reliable=True, keep_last=1)


def topic(name: str, type_name: str):
    return node.create_topic(name, type_name.replace("/msg/", "/"), qos)


def value(type_name: str):
    given = VALUES[type_name]
    if type_name == "sensor_msgs/msg/Image":
        fields = [
            ("header", pa.struct([
                ("stamp", pa.struct([("sec", pa.int32()), ("nanosec", pa.uint32())])),
                ("frame_id", pa.string()),
            ])),
            ("height", pa.uint32()), ("width", pa.uint32()), ("encoding", pa.string()),
            ("is_bigendian", pa.uint8()), ("step", pa.uint32()), ("data", pa.list_(pa.uint8())),
        ]  # fmt: skip
        return pa.array([given], type=pa.struct(fields))
    return pa.array([given])


subscriptions = {
    name: node.create_subscription(topic(name, type_name))
    for name, type_name in plan.get("subscribe", {}).items()
}
publishers = [
    (node.create_publisher(topic(name, type_name)), value(type_name))
    for name, type_name in plan.get("publish", {}).items()
]
report(ready=True)
count = plan.get("count")
for number in at_rate(0.1):
    for publisher, message in publishers if count is None or number < count else []:
        publisher.publish(message)
    if number == count:
        report(published=True)
    for name, subscription in subscriptions.items():
        while (message := subscription.next()) is not None:
            report(received=name, value=summary(message.to_pylist()[0]))

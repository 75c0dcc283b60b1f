"""A zenoh-ros2-sdk program: `sdk_peer.py PLAN` with the plan as JSON, see ``plan`` below."""

from __future__ import annotations

import json
import sys
import threading
from pathlib import Path

from summary import VALUES, report, summary
from waiting import at_rate
from zenoh_ros2_sdk import message_registry
from zenoh_ros2_sdk.discovery import get_topic_info
from zenoh_ros2_sdk.publisher import ROS2Publisher
from zenoh_ros2_sdk.qos import QosDurability, QosProfile
from zenoh_ros2_sdk.session import ZenohSession
from zenoh_ros2_sdk.subscriber import ROS2Subscriber

# {"port", "domain", "interfaces", "publish": {topic: type}, "subscribe": {topic: type},
#  "latched": bool, "count": how many messages to publish}; a line {"info": topic} on standard
#  input asks for what the SDK sees.
plan = json.loads(sys.argv[1])
session = ZenohSession.get_instance("127.0.0.1", plan["port"])
registry = message_registry.get_registry(str(Path(plan["interfaces"]) / "share"))
common = {"domain_id": plan["domain"], "router_port": plan["port"], "namespace": "/sdk"}
if plan.get("latched"):
    common["qos"] = QosProfile(durability=QosDurability.TRANSIENT_LOCAL, history_depth=1)


def build(type_name: str, value: dict) -> dict:
    """Return the keyword arguments of the SDK's class: nested values as its own objects."""
    import numpy as np

    made = {}
    _, fields = session.store.fielddefs[type_name]
    for name, (kind, what) in fields:
        given = value[name]
        if kind.name == "NAME":
            given = session.store.types[what](**build(what, given))
        elif kind.name == "SEQUENCE":
            given = np.array(given, dtype=np.uint8)
        made[name] = given
    return made


def receiver(topic: str):
    return lambda message: report(received=topic, value=summary(message))


subscribers = [
    ROS2Subscriber(topic, name, receiver(topic), node_name=f"listener{i}", **common)
    for i, (topic, name) in enumerate(plan.get("subscribe", {}).items())
]
publishers = {
    topic: (ROS2Publisher(topic, name, node_name=f"talker{i}", **common), name)
    for i, (topic, name) in enumerate(plan.get("publish", {}).items())
}


def answer() -> None:
    for line in sys.stdin:
        topic = json.loads(line)["info"]
        info = get_topic_info(topic, plan["domain"], "127.0.0.1", plan["port"], verbose=True)
        ends = [*info.publishers, *info.subscribers] if info else []
        report(
            info=[[e.node_namespace, e.node_name, e.topic_type, e.type_hash, e.qos] for e in ends]
        )


answering = threading.Thread(target=answer, daemon=True)
answering.start()
report(ready=True)
built = {topic: build(name, VALUES[name]) for topic, (_, name) in publishers.items()}
for _ in at_rate(0.1, plan.get("count")):
    for topic, (publisher, _) in publishers.items():
        publisher.publish(**built[topic])
answering.join()  # until the tests end

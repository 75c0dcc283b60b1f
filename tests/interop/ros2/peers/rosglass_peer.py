"""Another rosglass program: `rosglass_peer.py PLAN` with the plan as JSON, see ``plan`` below."""

from __future__ import annotations

import json
import sys

from summary import VALUES, report, summary
from waiting import at_rate

import rosglass

# The plan: "port", "domain", further "options" of the URL, "publish" and "subscribe" (type by
# topic), "latched", "quiet" (topics not to report), "depth" of queues, "period" in seconds,
# "count" of messages to publish.
plan = json.loads(sys.argv[1])
url = f"zenoh://127.0.0.1:{plan['port']}?domain={plan['domain']}{plan.get('options', '')}"
node = rosglass.connect(url, "peer", "/own")
qos = rosglass.QoS.latched() if plan.get("latched") else rosglass.QoS(plan.get("depth", 10))


def receiver(topic: str):
    return lambda message: report(received=topic, value=summary(message.to_dict()))


for topic, name in plan.get("subscribe", {}).items():
    quiet = topic in plan.get("quiet", [])
    node.create_subscription(topic, name, None if quiet else receiver(topic), qos)
publishers = {
    topic: (node.create_publisher(topic, name, qos), VALUES[name])
    for topic, name in plan.get("publish", {}).items()
}
report(ready=True)
for _ in at_rate(plan.get("period", 0.1), plan.get("count")):
    for publisher, value in publishers.values():
        publisher.publish(value)
report(published=True)
sys.stdin.read()  # until the tests end

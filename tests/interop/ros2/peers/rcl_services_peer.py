"""Another rosglass program with parameters, a log and a clock: `rcl_services_peer.py PLAN`.

The plan: {"url", "arguments": what follows --ros-args}. On its standard input it receives
{"log": text}, {"set": {name: value}}, {"clock": seconds} (which it publishes), {"read": true}.
Setting "slow" takes a minute.
"""

from __future__ import annotations

import json
import sys
import time

from summary import report

import rosglass
from rosglass.comm import ParameterDescriptor, Range

plan = json.loads(sys.argv[1])
node = rosglass.connect(
    plan["url"], "robot", "/arm", arguments=["--ros-args", *plan.get("arguments", [])]
)
parameters = node.parameters
parameters.declare("speed", 1.0, ParameterDescriptor(description="m/s", range=Range(0.0, 5.0)))
parameters.declare("names", ["left", "right"])
parameters.declare("blob", b"\x00\x01\xff")
parameters.declare("limits.low", -(2**62))
parameters.declare("serial", "abc", ParameterDescriptor(read_only=True))
parameters.declare("slow", 0)


def slowly(values: dict) -> str:
    if "slow" in values:
        report(setting=True)
        time.sleep(60)
    return ""


parameters.on_set(slowly)
clock = node.create_publisher("/clock", "rosgraph_msgs/msg/Clock", rosglass.QoS.clock())
report(ready=True)
for line in sys.stdin:
    request = json.loads(line)
    if "log" in request:
        node.logger.warning(request["log"])
    elif "set" in request:
        parameters.set(request["set"])
    elif "clock" in request:
        clock.publish(clock={"sec": request["clock"]})
    else:
        report(speed=parameters.get("speed"), chatter=node.resolve("chatter"))

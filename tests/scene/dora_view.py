"""A robot's program with dora-rs: calls services over DDS, `dora_view.py FOLDER CALLS`.

FOLDER has the definitions, CALLS is a JSON list of service, type and request; it prints a JSON line
after each call.
"""

import json
import os
import sys

import dora
import pyarrow as pa

#: Types that dora cannot derive from Python's values.
NUMBERS = {"sec": pa.int32(), "nanosec": pa.uint32(), "mode": pa.uint8()}


def typed(value, name=""):
    """Return the type of a value in Arrow."""
    if isinstance(value, dict):
        return pa.struct([(key, typed(inner, key)) for key, inner in value.items()])
    return NUMBERS[name] if name in NUMBERS else pa.scalar(value).type


definitions, calls = sys.argv[1], json.loads(sys.argv[2])
domain = int(os.environ["ROS_DOMAIN_ID"])
context = dora.Ros2Context([definitions], transport=dora.Ros2Transport.dds(), domain_id=domain)
node = context.new_node("dora_node", "/dora", dora.Ros2NodeOptions())
qos = dora.Ros2QosPolicies(reliable=True, keep_last=10)
for service, kind, request in calls:
    client = node.create_service_client(service, kind, qos)
    try:
        client.call(pa.array([request], typed(request)), timeout_s=20.0)
    except Exception as error:
        print(json.dumps(str(error)), flush=True)
    else:
        print(json.dumps("done"), flush=True)

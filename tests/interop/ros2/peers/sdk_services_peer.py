"""A zenoh-ros2-sdk program with services: `sdk_services_peer.py PLAN` with the plan as JSON.

It offers ``/add``, ``/hold`` and ``/never`` (AddTwoInts), or calls those of the test, as "do" says:
"serve" or "call". The SDK has no actions.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from pathlib import Path

from summary import report
from zenoh_ros2_sdk import message_registry
from zenoh_ros2_sdk.service_client import ROS2ServiceClient
from zenoh_ros2_sdk.service_server import ROS2ServiceServer

# The plan: "port", "domain", "interfaces", "do", "service" to call, "pairs" of numbers to add.
plan = json.loads(sys.argv[1])
message_registry.get_registry(str(Path(plan["interfaces"]) / "share"))
common = {"domain_id": plan["domain"], "router_port": plan["port"], "namespace": "/sdk"}
ADD = "example_interfaces/srv/AddTwoInts"


def offer(name, **arguments):
    node = f"server_{name.strip('/')}"
    full = f"{name}{plan.get('suffix', '')}"
    return ROS2ServiceServer(full, ADD, node_name=node, **arguments, **common)


def serve():
    def add(request):
        if request.a == -2:
            os._exit(1)  # killed in mid-call
        return adding.response_msg_class(sum=request.a + request.b)

    adding = offer("/add", callback=add)
    holding, ignoring = offer("/hold", mode="queue"), offer("/never", mode="queue")

    def ignore():
        while True:
            kept.append(ignoring.take_request())
            report(ignored=True)

    kept = []
    threading.Thread(target=ignore, daemon=True).start()
    report(ready=True)
    while True:
        held = [holding.take_request() for _ in range(5)]
        report(held=5)
        for key, request in reversed(held):
            holding.send_response(key, holding.response_msg_class(sum=request.a + request.b))


def call():
    report(ready=True)
    name = plan.get("service", "/add")
    client = ROS2ServiceClient(name, ADD, timeout=5.0, node_name="caller", **common)
    for first, second in plan["pairs"]:
        response = client.call(a=first, b=second)
        if response is None:
            report(failed="no response")
        else:
            report(sum=int(response.sum))


{"serve": serve, "call": call}[plan["do"]]()
threading.Event().wait(600)

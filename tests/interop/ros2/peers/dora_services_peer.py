"""A dora-rs node with services and actions: `dora_services_peer.py PLAN`, the plan as JSON.

It offers ``/add``, ``/hold`` and ``/never`` (AddTwoInts) and ``/count`` (Fibonacci), or uses those
of the test, as "do" says: "serve", "serve action", "call", "send goals".
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import threading
from pathlib import Path

import dora
import pyarrow as pa
from summary import report
from waiting import eventually

# {"port", "domain", "interfaces", "profile": "humble" or "rep2016" over Zenoh, or "dds", "do"}
plan = json.loads(sys.argv[1])
if plan["profile"] == "dds":
    transport = dora.Ros2Transport.dds()
else:
    config = {
        "mode": "peer",
        "connect": {"endpoints": [f"tcp/127.0.0.1:{plan['port']}"]},
        "listen": {"endpoints": ["tcp/127.0.0.1:0"]},
        "scouting": {"multicast": {"enabled": False}},
        "timestamping": {"enabled": True},
    }
    file = Path(tempfile.mkdtemp()) / "session.json5"
    file.write_text(json.dumps(config))
    transport = dora.Ros2Transport.zenoh(plan["profile"], str(file))
context = dora.Ros2Context([plan["interfaces"]], transport=transport, domain_id=plan["domain"])
node = context.new_node("dora_node", "/dora", dora.Ros2NodeOptions())
qos = dora.Ros2QosPolicies(reliable=True, keep_last=10)
ADD, FIBONACCI = "example_interfaces/AddTwoInts", "example_interfaces/Fibonacci"


def add(server, request):
    number, value = request
    given = value[0].as_py()
    if given["a"] == -2:
        os._exit(1)  # killed in mid-call
    server.send_response(number, pa.array([{"sum": given["a"] + given["b"]}]))


def serve():
    adding, holding, ignoring = (
        node.create_service_server(f"{name}{plan.get('suffix', '')}", ADD, qos)
        for name in ("/add", "/hold", "/never")
    )
    report(ready=True)
    held = []
    while True:
        if (request := adding.take_request(timeout_s=0.02)) is not None:
            add(adding, request)
        if (request := holding.take_request(timeout_s=0.02)) is not None:
            held.append(request)
        if len(held) == 5:
            report(held=5)
            for request in reversed(held):
                add(holding, request)
            held.clear()
        if ignoring.take_request(timeout_s=0.001) is not None:
            report(ignored=True)


def serve_action():
    server = node.create_action_server("/count", FIBONACCI, qos)
    report(ready=True)
    while True:
        taken = server.take_goal(timeout_s=0.1)
        if taken is None:
            continue
        goal, value = taken
        order, sequence, status = value[0]["order"].as_py(), [0], "succeeded"
        while len(sequence) < order and status == "succeeded":
            sequence.append(len(sequence))
            numbers = pa.array([{"sequence": sequence}], _sequence())
            server.send_feedback(goal, numbers)
            if server.take_cancel(timeout_s=0.05) is not None:
                status = "canceled"
        numbers = pa.array([{"sequence": sequence}], _sequence())
        server.send_result(goal, numbers, status=status, timeout_s=10.0)
        report(status=status)


def _sequence():
    return pa.struct([("sequence", pa.list_(pa.int32()))])


def call():
    report(ready=True)
    client = node.create_service_client(plan.get("service", "/add"), ADD, qos)
    for first, second in plan["pairs"]:
        report(**ask(client, pa.array([{"a": first, "b": second}])))


def ask(client, request):
    try:
        return {"sum": client.call(request, timeout_s=5.0)[0]["sum"].as_py()}
    except Exception as error:
        return {"failed": str(error)}


def send_goals():
    client = node.create_action_client("/count", FIBONACCI, qos)
    report(ready=True)
    # RustDDS announces ten of its readers and writers a second, more slowly if packets are lost:
    # the test says when its server knows all, as earlier requests may be lost.
    sys.stdin.readline()
    for order, cancels in plan["goals"]:
        goal = send_goal(client, order)
        if goal is None:
            report(rejected=order)
            continue
        feedback, cancelled = [], None
        while len(feedback) < order - 1:
            numbers = client.take_feedback(goal, timeout_s=2.0)
            if numbers is None:
                break
            feedback.append(len(numbers[0]["sequence"].as_py()))
            if cancels and len(feedback) == 2:
                cancelled = client.cancel(goal, timeout_s=10.0)
                break
        if cancelled is not None:
            report(cancelled=cancelled)  # dora forgets the goal with that
            continue
        # dora asks again each time.
        status, result = eventually(lambda goal=goal: client.take_result(goal, timeout_s=5.0))
        report(status=status, sequence=result[0]["sequence"].as_py(), feedback=feedback)


def send_goal(client, order):
    """Send a goal until it is answered: RustDDS drops requests while it knows no server."""

    def answer():
        try:
            return [client.send_goal(pa.array([{"order": order}], _order()), timeout_s=5.0)]
        except RuntimeError as error:
            report(unanswered=str(error).partition("\n")[0])
            return []

    return eventually(answer)[0]


def _order():
    return pa.struct([("order", pa.int32())])


{"serve": serve, "serve action": serve_action, "call": call, "send goals": send_goals}[plan["do"]]()
threading.Event().wait(600)

"""Another rosglass program that offers services and an action, or uses those of the test.

``services_peer.py PLAN`` with the plan as JSON: "url", "do" (see below), "name".
"""

from __future__ import annotations

import json
import sys
import threading
import time
from concurrent.futures import Future

from summary import report
from waiting import eventually

import rosglass

ADD, TRIGGER = "example_interfaces/srv/AddTwoInts", "std_srvs/srv/Trigger"
FIBONACCI = "example_interfaces/action/Fibonacci"
plan = json.loads(sys.argv[1])
node = rosglass.connect(plan["url"], plan.get("name", "peer"), "/own")


def fail(request):
    raise ValueError("the arm is off")


def never(request):
    report(asked=True)
    return Future()


def count(goal):
    sequence = [0]
    while len(sequence) < goal.goal.order and not goal.wait_for_cancel(0.02):
        sequence.append(len(sequence))
        goal.publish_feedback(sequence=sequence)
    return {"sequence": sequence}


def offer():
    node.create_service_server("/add", ADD, lambda request: {"sum": request.a + request.b})
    node.create_service_server("/fail", TRIGGER, fail)
    node.create_service_server("/never", TRIGGER, never)
    node.create_action_server("/count", FIBONACCI, count, accept=lambda goal: goal.order < 1000)
    report(ready=True)


def use():
    add = node.create_service_client("/my/add", ADD)
    sums = [add.call_async({"a": value, "b": 1}) for value in range(20)]
    report(sums=[call.result(10).sum for call in sums])
    feedback = []
    client = node.create_action_client("/my/count")
    client.wait_for_server(10)
    goal = client.send_goal({"order": 4}, on_feedback=lambda m: feedback.append(len(m.sequence)))
    status, result = goal.result(10)
    eventually(lambda: len(feedback) >= 3)
    report(goal=[status.value, list(map(int, result.sequence)), feedback])


def wait():
    """Wait in a call, for Ctrl-C to come."""
    client = node.create_service_client("/never", TRIGGER)
    client.wait_for_server(10)
    report(waiting=True)
    try:
        client.call(timeout=None)
    except KeyboardInterrupt:
        started = time.monotonic()
        node.close()
        report(interrupted=time.monotonic() - started, threads=threading.active_count())
        sys.exit()


{"offer": offer, "use": use, "wait": wait}[plan["do"]]()
threading.Event().wait(600)

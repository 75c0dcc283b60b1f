"""A robot and an operator on two machines, in two network namespaces that a cable connects.

``two_machines_zenoh.py SECONDS``, to be run as root of a network namespace, which is the
operator's. The cable is unplugged for so long. Prints what the operator sees.
"""

from __future__ import annotations

import itertools
import sys
import time

from summary import report
from two_machines import ROBOT, THERE, Cable
from waiting import eventually

import rosglass
from rosglass.comm import IMMEDIATE

ADD, TWIST = "example_interfaces/srv/AddTwoInts", "geometry_msgs/msg/Twist"
ROUTER = """
from rosglass.wires.zenoh.router import Router
router = Router("tcp/0.0.0.0:7447")
"""


with Cable() as cable:
    robot = ROUTER + ROBOT.format("zenoh://127.0.0.1")
    cable.start(sys.executable, "-c", robot, ready="ready")
    node = rosglass.connect(f"zenoh://{THERE}", "operator")
    began = time.monotonic()
    states: list[tuple[float, str]] = []
    node.on_status_change(
        lambda status: states.append((time.monotonic() - began, status.state.name)), IMMEDIATE
    )
    got: list[tuple[float, float]] = []
    node.create_subscription(
        "/count",
        TWIST,
        raw_callback=lambda s: got.append((time.monotonic() - began, s.message().linear.x)),
        executor=IMMEDIATE,
    )
    maps: list[str] = []
    node.create_subscription(
        "/map", "std_msgs/msg/String", lambda m: maps.append(m.data), rosglass.QoS.latched()
    )
    client = node.create_service_client("/add", ADD)
    assert client.wait_for_server(10), client.problem
    before = client.call({"a": 1, "b": 2}).sum
    time.sleep(1)
    states.clear()
    cable.unplug()
    unplugged = time.monotonic() - began
    call = client.call_async({"a": 3, "b": 4}, timeout=20)
    time.sleep(float(sys.argv[1]))
    cable.plug()
    plugged = time.monotonic() - began
    eventually(lambda: got[-1][0] >= plugged + 1 or time.monotonic() - began >= plugged + 10)
    numbers = [number for _, number in got]
    times = [when for when, _ in got]
    report(
        before=before,
        after=client.call({"a": 5, "b": 6}, timeout=5).sum,
        lost=next(when for when, state in states if state == "LOST") - unplugged,
        states=[state for _, state in states],
        call=repr(call.exception(5)),
        recovered=next(when for when, _ in got if when > plugged) - plugged,
        silence=max(later - when for when, later in itertools.pairwise(times)),
        ordered=numbers == sorted(set(numbers)),
        maps=maps,
        status=str(node.status()),
    )
    node.close()

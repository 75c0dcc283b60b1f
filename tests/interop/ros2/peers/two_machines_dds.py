"""A robot and an operator on two machines, in two network namespaces that a cable connects, by DDS.

``two_machines_dds.py SECONDS``, to be run as root of a network namespace, which is the operator's.
The cable is unplugged for so long. Prints what the operator sees.
"""

from __future__ import annotations

import sys
import time

from summary import report
from two_machines import ROBOT, Cable
from waiting import eventually

import rosglass
from rosglass.comm import IMMEDIATE

ADD, TWIST, STRING = (
    "example_interfaces/srv/AddTwoInts",
    "geometry_msgs/msg/Twist",
    "std_msgs/msg/String",
)


with Cable() as cable:
    cable.start(sys.executable, "-c", ROBOT.format("dds://"), ready="ready")
    node = rosglass.connect("dds://", "operator")
    began = time.monotonic()

    def now() -> float:
        return time.monotonic() - began

    states: list[tuple[float, str]] = []
    node.on_status_change(lambda status: states.append((now(), status.state.name)), IMMEDIATE)
    got: list[tuple[float, float]] = []
    numbers = node.create_subscription(
        "/count",
        TWIST,
        raw_callback=lambda s: got.append((now(), s.message().linear.x)),
        executor=IMMEDIATE,
    )
    maps: list[str] = []
    node.create_subscription("/map", STRING, lambda m: maps.append(m.data), rosglass.QoS.latched())
    client = node.create_service_client("/add", ADD)
    assert client.wait_for_server(20), client.problem
    before = client.call({"a": 1, "b": 2}).sum
    eventually(lambda: maps and got)
    states.clear()
    cable.unplug()
    unplugged = now()
    call = client.call_async({"a": 3, "b": 4}, timeout=20)
    time.sleep(float(sys.argv[1]) - 0.2)
    outage = {
        "status": str(node.status()),
        "publishers": numbers.publisher_count(),
        "problem": numbers.problem,
        "server": client.problem,
        "ready": client.ready,
    }
    time.sleep(0.2)
    cable.plug()
    plugged = now()
    eventually(lambda: got[-1][0] >= plugged + 1 or now() >= plugged + 15)
    count = [number for _, number in got]
    report(
        before=before,
        outage=outage,
        call=repr(call.exception(15)),
        after=client.call({"a": 5, "b": 6}, timeout=15).sum,
        lost=next((when for when, state in states if state == "LOST"), 99) - unplugged,
        states=[state for _, state in states],
        recovered=next((when for when, _ in got if when > plugged), 99) - plugged,
        rate=sum(when > got[-1][0] - 0.5 for when, _ in got) / 0.5,
        ordered=count == sorted(set(count)),
        maps=maps,
        publishers=numbers.publisher_count(),
        problems=[numbers.problem, client.problem],
        status=str(node.status()),
    )
    node.close()

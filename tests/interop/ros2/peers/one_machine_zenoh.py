"""Two peers beside a router whose loopback interface fails.

``one_machine_zenoh.py SECONDS``, to be run as root of a network namespace. The interface is down
for so long. Prints what one of the peers sees.
"""

from __future__ import annotations

import subprocess
import sys
import time

from summary import report
from waiting import eventually

import rosglass
from rosglass.comm import IMMEDIATE

STRING = "std_msgs/msg/String"
ROUTER = """
import time
from rosglass.wires.zenoh.router import Router
router = Router("tcp/127.0.0.1:7447")
time.sleep(1000)
"""
TALKER = """
import time, rosglass
node = rosglass.connect("zenoh://127.0.0.1:7447?mode=peer", "talker")
publisher = node.create_publisher("/count", "std_msgs/msg/String")
while True:
    publisher.publish(data="x")
    time.sleep(0.05)
"""


def loopback(state: str) -> None:
    """Set the loopback interface up or down."""
    subprocess.run(["ip", "link", "set", "lo", state], check=True)


loopback("up")
others = [subprocess.Popen([sys.executable, "-c", text]) for text in (ROUTER, TALKER)]
try:
    node = rosglass.connect("zenoh://127.0.0.1:7447?mode=peer", "cockpit")
    got: list[float] = []
    node.create_subscription(
        "/count", STRING, lambda _: got.append(time.monotonic()), executor=IMMEDIATE
    )
    eventually(lambda: got and str(node.status()).startswith("CONNECTED: router"))
    states: list[tuple[float, str]] = []
    node.on_status_change(
        lambda status: states.append((time.monotonic(), status.state.name)), IMMEDIATE
    )
    loopback("down")
    down = time.monotonic()
    time.sleep(float(sys.argv[1]))
    loopback("up")
    up = time.monotonic()
    eventually(lambda: got[-1] > up and str(node.status()).startswith("CONNECTED: router"))
    report(lost=next(when for when, state in states if state == "LOST") - down)
    node.close()
finally:
    for other in others:
        other.kill()

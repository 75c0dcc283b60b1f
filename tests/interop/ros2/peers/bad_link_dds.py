"""Cameras of a robot behind a link that loses and delays packets for a while, by DDS.

``bad_link_dds.py SECONDS``, to be run as root of a network namespace, which is the operator's.
Prints what the operator receives after the link has recovered; null where TUN devices are not
permitted.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from bad_link import BadLink
from summary import report
from waiting import eventually, nothing_happens

import rosglass
from rosglass.comm import IMMEDIATE

IMAGE = "sensor_msgs/msg/CompressedImage"
CAMERAS = [f"/camera{number}" for number in range(4)]
#: The link of a camera over bad Wi-Fi.
LOSS, DELAY_S = 0.2, 0.2
ROBOT = f"""
import time, rosglass
node = rosglass.connect("dds://", "robot")
cameras = [node.create_publisher(topic, {IMAGE!r}) for topic in {CAMERAS}]
print("ready", flush=True)
while True:
    for camera in cameras:
        camera.publish(format="jpeg", data=bytes(57_000))
    time.sleep(1 / 15)
"""


def ip_fragments() -> int:
    """Return how many IP fragments this machine has received, of datagrams larger than a packet."""
    names, counts = (line.split() for line in Path("/proc/net/snmp").read_text().splitlines()[:2])
    return int(counts[names.index("ReasmReqds")])


try:
    link = BadLink()
except OSError as error:
    report(missing=str(error))
    sys.exit()
with link, rosglass.connect("dds://", "operator") as node:
    link.start(sys.executable, "-c", ROBOT, ready="ready")
    got = dict.fromkeys(CAMERAS, 0)

    def count(topic: str) -> None:
        def receive(_: object) -> None:
            got[topic] += 1

        node.create_subscription(topic, IMAGE, raw_callback=receive, executor=IMMEDIATE)

    for topic in CAMERAS:
        count(topic)
    eventually(lambda: min(got.values()) > 30)
    link.be(LOSS, DELAY_S)
    nothing_happens(float(sys.argv[1]))
    link.be(0, 0)
    began, before = time.monotonic(), dict(got)
    # More than what may still have been on its way.
    eventually(lambda: all(got[topic] > before[topic] + 15 for topic in CAMERAS), timeout=60)
    report(missing="", back=time.monotonic() - began, ip_fragments=ip_fragments())

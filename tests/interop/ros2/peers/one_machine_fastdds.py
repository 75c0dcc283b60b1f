"""A publisher of images and an rclpy subscriber on one machine that has a network, by DDS.

``one_machine_fastdds.py PYTHON``, to be run as root of a network namespace; the Python is that of
rclpy. Prints what the publisher and ``rosglass doctor`` say.
"""

from __future__ import annotations

import json
import logging
import subprocess
import sys
from pathlib import Path

from summary import report
from waiting import at_rate, eventually

import rosglass

IMAGE = "sensor_msgs/msg/Image"
URL = "dds://?domain=0"

for command in (
    "ip link set lo up",
    "ip link add eth0 type veth peer name other",
    "ip addr add 10.77.0.1/24 dev eth0",
    "ip link set other up",
    "ip link set eth0 up multicast on",
    "ip route add 224.0.0.0/4 dev eth0",
):
    subprocess.run(command.split(), check=True)
lines: list[str] = []
handler = logging.Handler(logging.WARNING)
handler.emit = lambda record: lines.append(record.getMessage())  # type: ignore[method-assign]
logging.getLogger("rosglass").addHandler(handler)
peer = subprocess.Popen(
    [sys.argv[1], "-u", str(Path(__file__).parent / "rclpy_peer.py"), "viewer"],
    stdin=subprocess.PIPE,
    stdout=subprocess.DEVNULL,
    text=True,
)
try:
    assert peer.stdin is not None
    task = {"do": "subscribe", "number": 1, "topic": "/camera", "type": IMAGE, "quiet": True}
    print(json.dumps(task), file=peer.stdin, flush=True)
    with rosglass.connect(URL, "driver") as node:
        publisher = node.create_publisher("/camera", IMAGE, rosglass.QoS(1))
        eventually(publisher.subscription_count)
        before = publisher.problem
        image = publisher.type.create(
            height=1080, width=1920, encoding="rgb8", step=5760, data=bytes(1080 * 5760)
        )
        for _ in at_rate(0.01, 3000):
            publisher.publish(image)
            if publisher.problem:
                break
        doctor = subprocess.run(
            [sys.executable, "-m", "rosglass", "doctor", "--json", "--url", URL],
            capture_output=True,
            check=False,
            text=True,
        )
        report(
            before=before,
            problem=publisher.problem,
            dropped=publisher.dropped,
            logged=[line for line in lines if "dropped" in line],
            doctor=[f for f in json.loads(doctor.stdout) if "Fast DDS" in f["text"]],
        )
finally:
    peer.kill()

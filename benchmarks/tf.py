"""Measure what following 50 transforms at 100 Hz costs, against tf2_ros in Python, in one run.

    python benchmarks/tf.py

Both decode the same ROS 1 messages of 50 transforms and put them into a buffer; tf2_ros (Debian's
python3-tf2-ros) with rospy's message class and tf2's C++ BufferCore. Then both look up across five
links. The ways take turns, and the best turn of each counts, as other programs disturb.
"""

from __future__ import annotations

import subprocess
import time

import rosglass
from rosglass.comm import Sample
from rosglass.tf import TransformBuffer
from rosglass.tf.topics import transforms_in

COUNT, MESSAGES, LOOKUPS, TURNS = 50, 500, 2000, 3
PEER = f"""
import sys, time, rospy, tf2_py
from tf2_msgs.msg import TFMessage
from geometry_msgs.msg import TransformStamped
data = sys.stdin.buffer.read()
size = len(data) // {MESSAGES}
parts = [data[at:at + size] for at in range(0, len(data), size)]
core = tf2_py.BufferCore(rospy.Duration(10))
start = time.process_time()
for part in parts:
    for transform in TFMessage().deserialize(part).transforms:
        core.set_transform(transform, "a")
filled = time.process_time()
for _ in range({LOOKUPS}):
    core.lookup_transform_core("link0", "link5", rospy.Time(0))
print(filled - start, time.process_time() - filled)
"""


def messages(kind: rosglass.MessageType) -> list[bytes]:
    made = []
    for number in range(MESSAGES):
        stamp = {"secs": 1000 + number // 100, "nsecs": number % 100 * 10_000_000}
        transforms = [
            {
                "header": {"stamp": stamp, "frame_id": f"link{link}"},
                "child_frame_id": f"link{link + 1}",
                "transform": {"rotation": {"w": 1.0}},
            }
            for link in range(COUNT)
        ]
        made.append(kind.encode({"transforms": transforms}))
    return made


def ours(kind: rosglass.MessageType, parts: list[bytes]) -> tuple[float, float]:
    samples = [Sample(part, "ros1", kind, 0) for part in parts]
    buffer = TransformBuffer()
    start = time.process_time()
    for sample in samples:
        buffer.set_many(transforms_in(sample), "a")
    filled = time.process_time()
    for _ in range(LOOKUPS):
        buffer.lookup_transform("link0", "link5")
    return filled - start, time.process_time() - filled


def theirs(parts: list[bytes]) -> tuple[float, float] | None:
    command = ["/usr/bin/python3", "-c", PEER]
    env = {"PATH": "/usr/bin:/bin"}
    try:
        done = subprocess.run(
            command, input=b"".join(parts), env=env, capture_output=True, check=True
        )
    except (OSError, subprocess.CalledProcessError) as error:
        print(f"tf2_ros is left out (apt install python3-tf2-ros): {error}")
        return None
    filled, looked = map(float, done.stdout.split())
    return filled, looked


def main() -> None:
    kind = rosglass.load("tf2_msgs/msg/TFMessage", 1)
    assert isinstance(kind, rosglass.MessageType)
    parts = messages(kind)
    turns = [(ours(kind, parts), theirs(parts)) for _ in range(TURNS)]
    filled, looked = (min(own[at] for own, _ in turns) for at in (0, 1))
    peers = [other for _, other in turns if other is not None]
    percent = filled / MESSAGES * 100 * 100
    print(f"{COUNT} transforms at 100 Hz: {percent:.1f} % of a core", end="")
    print(f", {filled / min(p[0] for p in peers):.2f} of tf2_ros" if peers else "")
    print(f"a lookup across 5 links: {looked / LOOKUPS * 1e6:.1f} us", end="")
    print(f", {looked / min(p[1] for p in peers):.2f} of tf2_py" if peers else "")


if __name__ == "__main__":
    main()

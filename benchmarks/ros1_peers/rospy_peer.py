"""The rospy side of benchmarks/ros1_topics.py, run by the distribution's own Python.

rospy_peer.py KIND CASE: subscribe, print "ready", wait for two lines on standard input, and print
what was received between them.
"""

import json
import sys
import time

import rospy
from geometry_msgs.msg import PointStamped, PoseStamped
from sensor_msgs.msg import Image
from std_msgs.msg import String

_FIRST = 5
got, sent = [], []


class Count:
    """Counts messages, and looks at their content."""

    def __init__(self):
        self.count = 0

    def touch_data(self, message):
        """Take a message."""
        if len(message.data):
            self.count += 1

    def touch_point(self, message):
        """Take a PointStamped."""
        if message.point.x:
            self.count += 1


def text(message):
    """Note a String, which begins with the time of sending."""
    got.append(time.time_ns())
    sent.append(int(message.data[:20]))


def stamped(message):
    """Note a message by its header's stamp."""
    got.append(time.time_ns())
    sent.append(message.header.stamp.to_nsec())


def main():
    """Measure."""
    kind, case = sys.argv[1:3]
    rospy.init_node("rospy_subscriber", disable_rostime=True, disable_signals=True)
    types = {"image": Image, "point": PointStamped, "pose": PoseStamped, "text": String}
    message = types[kind]
    call = text if kind == "text" else stamped
    counted = Count()
    touch = counted.touch_point if kind == "point" else counted.touch_data
    call = {"unread": None, "rate": touch}.get(case, call)
    big = {"buff_size": 16 * 1024 * 1024} if kind == "image" else {}
    rospy.Subscriber("/bench", message, call, tcp_nodelay=True, **big)
    print("ready", flush=True)
    sys.stdin.readline()
    before, began = time.process_time(), time.monotonic()
    sys.stdin.readline()
    cpu = (time.process_time() - before) / (time.monotonic() - began)
    latencies = sorted((r - s) / 1e6 for r, s in zip(got, sent, strict=True))[_FIRST:]
    figures = {"count": counted.count or len(got), "cpu": cpu}
    if latencies:
        figures["median"] = latencies[len(latencies) // 2]
        figures["p99"] = latencies[int(0.99 * len(latencies))]
    print(json.dumps(figures), flush=True)
    rospy.signal_shutdown("done")


main()

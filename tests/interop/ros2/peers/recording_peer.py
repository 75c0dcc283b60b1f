"""Publishes and records numbered messages until it is ended: URL PATH BYTES [LIMIT].

Prints a line of JSON each 50 ms, with the number of the newest message that has come by then, and
for the error that ends the recording.
Of random bytes, which no compression makes smaller. LIMIT is the size in bytes beyond which the
system refuses to write the file, as a full disk does.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import time

import rosglass
from rosglass.bags import Recorder
from rosglass.comm import IMMEDIATE

#: The bytes of a message's number: after the header and an empty layout.
NUMBER = slice(16, 24)


def report(**event: object) -> None:
    print(json.dumps(event), flush=True)


url, path, size = sys.argv[1], sys.argv[2], int(sys.argv[3])
if len(sys.argv) > 4:
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[4]), resource.RLIM_INFINITY))
with rosglass.connect(url, "robot") as robot, rosglass.connect(url, "panel") as panel:
    numbers = robot.create_publisher("/numbers", "std_msgs/msg/ByteMultiArray", qos=1000)
    recorder = Recorder(panel, path, ["/numbers"])
    while not recorder.status().topics.get("/numbers"):
        numbers.publish(data=(0).to_bytes(8, "little") + os.urandom(size))
        time.sleep(0.01)
    came = [0]
    panel.create_subscription(
        "/numbers",
        qos=1000,
        raw_callback=lambda sample: came.append(int.from_bytes(sample.data[NUMBER], "little")),
        executor=IMMEDIATE,
    )
    sent, reported = 0, 0.0
    while True:
        sent += 1
        numbers.publish(data=sent.to_bytes(8, "little") + os.urandom(size))
        try:
            status = recorder.status()
        except rosglass.BagError as error:
            report(error=str(error))
            break
        if time.monotonic() - reported > 0.05:
            reported = time.monotonic()
            report(state={"at": reported, "came": came[-1], "recorded": status.messages})
        time.sleep(0.005)
    try:
        recorder.close()
    except rosglass.BagError as error:
        report(closed=str(error))
    recorder.close()

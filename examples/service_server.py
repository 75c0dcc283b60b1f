"""Offers the service /add, and /count_down, which responds when it has counted to zero.

Run it with ``python examples/service_server.py [URL]``.

The URL says where the robot is, e.g. zenoh://robot.local:7447 or dds://; without one the
environment decides, as it does for ROS 2's own programs.
"""

from __future__ import annotations

import sys
import threading
from concurrent.futures import Future

import rosglass


def add(request):
    """Respond at once: a message, a dict, or None for an empty response."""
    return {"sum": request.a + request.b}


def count_down(request):
    """Respond later, without blocking other callbacks."""
    answer = Future()
    done = {"success": True, "message": "zero"}
    threading.Timer(1.0, answer.set_result, [done]).start()
    return answer


with rosglass.connect(sys.argv[1] if len(sys.argv) > 1 else None, "calculator") as node:
    node.create_service_server("/add", "example_interfaces/srv/AddTwoInts", add)
    node.create_service_server("/count_down", "std_srvs/srv/Trigger", count_down)
    print("ready; Ctrl-C ends it", flush=True)
    try:
        threading.Event().wait()
    except KeyboardInterrupt:
        print("bye")

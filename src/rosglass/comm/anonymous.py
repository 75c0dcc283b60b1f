"""Names for nodes that nobody has to know by name."""

from __future__ import annotations

import itertools
import os
import re
import time

__all__ = ["anonymous_name"]

_numbers = itertools.count(1)


def anonymous_name(name: str) -> str:
    """Return a node name that begins with `name` and that nobody else has.

    In ROS 1 a second node of a name ends the first one, and process numbers alone are no
    distinction: programs in containers often have the same.

    Made as rospy and roscpp do: host, process and time in milliseconds are appended.
    """
    import socket  # noqa: PLC0415 - only needed to connect

    host = re.sub(r"[^A-Za-z0-9_]", "_", socket.gethostname())
    # Two underscores in a row are no name in ROS 2.
    text = f"{name}_{host}_{os.getpid()}_{int(time.time() * 1000)}_{next(_numbers)}"
    return re.sub("__+", "_", text)

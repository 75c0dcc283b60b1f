"""Values that all peers of the tests publish, and how they report what they received."""

from __future__ import annotations

import dataclasses
import json
import sys
import threading
import zlib
from pathlib import Path
from typing import Any

sys.path.append(str(Path(__file__).parents[3] / "helpers"))  # for waiting

WIDTH, HEIGHT = 640, 480

VALUES: dict[str, dict[str, Any]] = {
    "std_msgs/msg/String": {"data": "Grüße, robot"},
    "geometry_msgs/msg/Twist": {
        "linear": {"x": 0.5, "y": -1.25, "z": 0.0},
        "angular": {"x": 0.0, "y": 0.0, "z": 3.0},
    },
    "sensor_msgs/msg/Image": {
        "header": {"stamp": {"sec": 12, "nanosec": 34}, "frame_id": "camera"},
        "height": HEIGHT,
        "width": WIDTH,
        "encoding": "rgb8",
        "is_bigendian": 0,
        "step": 3 * WIDTH,
        "data": [i % 251 for i in range(3 * WIDTH * HEIGHT)],
    },
}


def summary(value: Any) -> Any:
    """Return `value` as plain data; long arrays become their length and checksum."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, dict):
        return {k: summary(v) for k, v in value.items() if not k.startswith("__")}
    if isinstance(value, (bytes, bytearray, list, tuple)):
        if len(value) > 100:
            return [len(value), zlib.crc32(bytes(value))]
        return [summary(item) for item in value]
    return value


_lock = threading.Lock()


def report(**event: Any) -> None:
    """Print one line in one piece: other threads report, too, and the log goes the same way."""
    with _lock:
        sys.stdout.write(json.dumps(event) + "\n")
        sys.stdout.flush()

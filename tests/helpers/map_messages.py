"""Messages of a robot with a map, for tests of maps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def grid(
    cells: Any, resolution: float = 0.1, frame: str = "map", x: float = 0.0, w: float = 1.0
) -> dict[str, Any]:
    """Return an occupancy grid whose lower left corner is at `x`, 0."""
    rows = np.asarray(cells, np.int8)
    origin = {"position": {"x": x}, "orientation": {"w": w}}
    info = {
        "resolution": resolution, "width": rows.shape[1], "height": rows.shape[0],
        "origin": origin,
    }  # fmt: skip
    return {"header": {"frame_id": frame}, "info": info, "data": rows.ravel()}


def transform(parent: str, child: str, x: float = 0.0, yaw: float = 0.0) -> dict[str, Any]:
    """Return a transform."""
    return {
        "header": {"frame_id": parent},
        "child_frame_id": child,
        "transform": {
            "translation": {"x": x},
            "rotation": {"z": math.sin(yaw / 2), "w": math.cos(yaw / 2)},
        },
    }

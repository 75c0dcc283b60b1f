"""A simulated iterative pose prediction, for figure4.qml: offers its iterations as a service.

python pose_prediction.py [URL]
"""

from __future__ import annotations

import contextlib
import math
import sys
import threading
from pathlib import Path

import rosglass

COUNT = 20


def orientation(step: int) -> tuple[float, float]:
    """Return roll and pitch in radians after some steps, which converge on a slope."""
    rest = math.exp(-step / 5)
    return 0.25 + 0.6 * rest * math.cos(step), -0.15 + 0.5 * rest * math.sin(0.8 * step)


def quaternion(roll: float, pitch: float) -> dict[str, float]:
    """Return a rotation about x, then about y."""
    cr, sr, cp, sp = (f(a / 2) for a in (roll, pitch) for f in (math.cos, math.sin))
    return {"x": sr * cp, "y": cr * sp, "z": -sr * sp, "w": cr * cp}


def answer(request: rosglass.Message) -> dict[str, object]:
    """Return an iteration."""
    step = min(request.iteration, COUNT - 1)
    roll, pitch = orientation(step + 1)
    return {
        "count": COUNT,
        "input": quaternion(*orientation(step)),
        "output": quaternion(roll, pitch),
        "stability": max(0.0, 1 - math.hypot(roll, pitch) / 0.9),
    }


def main() -> None:
    """Offer the service until Ctrl-C."""
    library = rosglass.Library()
    library.add_path(Path(__file__).parent / "definitions")
    url = sys.argv[1] if len(sys.argv) > 1 else None
    with rosglass.connect(url, "pose_prediction", library=library) as node:
        kind = "pose_prediction_msgs/srv/GetIteration"
        node.create_service_server("/pose_prediction/get_iteration", kind, answer)
        print("ready: /pose_prediction/get_iteration", flush=True)
        with contextlib.suppress(KeyboardInterrupt):
            threading.Event().wait()


if __name__ == "__main__":
    main()

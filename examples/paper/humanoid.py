"""A simulated humanoid, for figure5.qml: state, gestures, speech, sensors and motors.

python humanoid.py [URL]
"""

from __future__ import annotations

import contextlib
import math
import sys
import time
from typing import TYPE_CHECKING, Any

import rosglass
from rosglass.comm import QoS, Time

if TYPE_CHECKING:
    from rosglass.comm import Node

JOINTS = ["head_yaw", "head_pitch", "l_shoulder", "l_elbow", "r_shoulder", "r_elbow"]
#: Joint positions of the gestures, in radians.
GESTURES = {
    "wave": {"r_shoulder": 1.8, "r_elbow": 0.9},
    "nod": {"head_pitch": 0.5},
    "bow": {"head_pitch": 0.7, "l_shoulder": 0.3, "r_shoulder": 0.3},
    "point": {"r_shoulder": 1.3},
}


class Humanoid:
    """Moves while it stands, and speaks on request."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._standing, self._gesture, self._since = False, "", 0.0
        latched = QoS.latched()
        self._state = node.create_publisher("/humanoid/state", "std_msgs/msg/String", latched)
        self._spoken = node.create_publisher("/humanoid/spoken", "std_msgs/msg/String", latched)
        self._joints = node.create_publisher("/humanoid/joints", "sensor_msgs/msg/JointState", 10)
        self._heat = node.create_publisher("/humanoid/heat", "sensor_msgs/msg/Temperature", 10)
        self._near = node.create_publisher("/humanoid/sonar", "sensor_msgs/msg/Range", 10)
        node.create_service_server("/humanoid/stand", "std_srvs/srv/SetBool", self._stand)
        node.create_subscription("/humanoid/say", "std_msgs/msg/String", self._say)
        node.create_subscription("/humanoid/gesture", "std_msgs/msg/String", self._move)
        self._tell()

    def _tell(self) -> None:
        self._state.publish(data=self._gesture or ("standing" if self._standing else "sitting"))

    def _stand(self, request: Any) -> dict[str, Any]:
        self._standing = request.data
        self._tell()
        return {"success": True, "message": "standing" if request.data else "sitting"}

    def _say(self, message: Any) -> None:
        self._spoken.publish(data=message.data)

    def _move(self, message: Any) -> None:
        if self._standing and message.data in GESTURES:
            self._gesture, self._since = message.data, time.monotonic()
            self._tell()

    def live(self) -> None:
        """Publish its state 20 times per second, until Ctrl-C."""
        while True:
            now = time.monotonic()
            if self._gesture and now - self._since > 3:
                self._gesture = ""
                self._tell()
            swing = math.sin((now - self._since) * 4)
            wanted = GESTURES.get(self._gesture, {})
            positions = [wanted.get(name, 0.0) * (0.7 + 0.3 * swing) for name in JOINTS]
            header = {"stamp": Time.now()}
            efforts = [abs(position) * 12 for position in positions]
            self._joints.publish(header=header, name=JOINTS, position=positions, effort=efforts)
            self._heat.publish(header=header, temperature=38 + sum(efforts) / 4)
            self._near.publish(
                header=header, min_range=0.1, max_range=4.0, range=2 + math.sin(now / 3)
            )
            time.sleep(0.05)


def main() -> None:
    """Run until Ctrl-C."""
    url = sys.argv[1] if len(sys.argv) > 1 else None
    with rosglass.connect(url, "humanoid") as node:
        humanoid = Humanoid(node)
        print("ready: /humanoid", flush=True)
        with contextlib.suppress(KeyboardInterrupt):
            humanoid.live()


if __name__ == "__main__":
    main()

"""The place that the robot is to drive to, taken and answered as move_base does."""

from __future__ import annotations

import math
import threading
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import QoS, Time
from rosglass.demo.telemetry import header

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Node
    from rosglass.messages import Message

__all__ = ["ABORTED", "ACTIVE", "PREEMPTED", "REJECTED", "SUCCEEDED", "DriveGoal"]

#: Of ``actionlib_msgs/msg/GoalStatus``.
ACTIVE, PREEMPTED, SUCCEEDED, ABORTED, REJECTED = 1, 2, 3, 4, 5
#: Frames in which a goal is accepted: the robot's localization does not drift.
_FRAMES = ("map", "odom", "")
#: Seconds between two confirmations of what has not changed.
_CONFIRM = 0.5


class DriveGoal:
    """A goal at ``/move_base_simple/goal``, and in ``/move_base/status`` what becomes of it.

    Args:
        node: Where both are offered.
        refusal: Why no goal is taken at present; empty when one is.
    """

    def __init__(self, node: Node, refusal: Callable[[], str]) -> None:
        self._refusal = refusal
        self._lock = threading.Lock()
        self._place: tuple[float, float] | None = None
        self._count, self._published_at = 0, -math.inf
        self._status: list[dict[str, Any]] = []
        kind = "actionlib_msgs/msg/GoalStatusArray"
        self._publisher = node.create_publisher("/move_base/status", kind, QoS.latched())
        self._subscription = node.create_subscription(
            "/move_base_simple/goal", "geometry_msgs/msg/PoseStamped", self._on_goal, 1
        )

    @property
    def place(self) -> tuple[float, float] | None:
        """Where to drive to, metres in the frame map; None for nowhere."""
        return self._place

    def end(self, status: int, text: str) -> None:
        """Drive there no longer; nothing happens where no goal is being driven to.

        Args:
            status: One of the constants above.
            text: Why.
        """
        with self._lock:
            active, self._place = self._place is not None, None
            if active:
                self._status[-1].update(status=status, text=text)
        if active:
            self._tell()

    def confirm(self) -> None:
        """Tell its state again, now and then."""
        if time.monotonic() - self._published_at >= _CONFIRM:
            self._tell()

    def close(self) -> None:
        """Take no more goals; safe to call twice."""
        self._subscription.close()

    def _on_goal(self, message: Message) -> None:
        place, frame = message.pose.position, message.header.frame_id
        if frame.lstrip("/") not in _FRAMES:
            refusal = f"goals are expected in the frame map, not in {frame}"
        elif not (math.isfinite(place.x) and math.isfinite(place.y)):
            refusal = f"{place.x}, {place.y} is no place"
        else:
            refusal = self._refusal()
        self.end(PREEMPTED, "another goal came")
        with self._lock:
            now = Time.now()
            self._count += 1
            self._status = [
                {
                    "goal_id": {"stamp": now, "id": f"goal-{self._count}"},
                    "status": REJECTED if refusal else ACTIVE,
                    "text": refusal or "on the way to the goal",
                }
            ]
            self._place = None if refusal else (place.x, place.y)
        self._tell()

    def _tell(self) -> None:
        self._published_at = time.monotonic()
        with self._lock:
            status = [dict(entry) for entry in self._status]
        self._publisher.publish({"header": header(Time.now(), ""), "status_list": status})

"""A server of Nav2's action ``navigate_to_pose`` for tests."""

from __future__ import annotations

import time
from typing import Any


class Driver:
    """A server of Nav2's action that drives until its goal ends; another goal preempts it.

    Attributes:
        goals: Those that it has received.
    """

    def __init__(self, node: Any) -> None:
        self.goals: list[Any] = []
        self.server = node.create_action_server(
            "/navigate_to_pose", "nav2_msgs/action/NavigateToPose", self.execute
        )

    def execute(self, goal: Any) -> dict[str, Any]:
        self.goals.append(goal)
        number = len(self.goals)
        while not goal.is_cancel_requested:
            if len(self.goals) > number:
                raise RuntimeError("preempted")
            time.sleep(0.01)
        return {}

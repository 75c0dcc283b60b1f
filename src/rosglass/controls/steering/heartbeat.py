"""The topic that shows whether the robot that is steered still sends its data."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.controls.topics.live_topic import LiveTopic
from rosglass.errors import Error

if TYPE_CHECKING:
    from rosglass.comm.node import Node

__all__ = ["Heartbeat"]

_ODOMETRY = "nav_msgs/msg/Odometry"
#: Messages per second that are looked at.
_RATE = 10


class Heartbeat(LiveTopic):
    """Receives a topic of the robot that is steered: without a name, its odometry.

    That is found beside the topic of its commands or below, or directly in a namespace around it:
    for ``/anna/base/cmd_vel``, ``/anna/base/odom`` before ``/anna/odom`` before ``/odom``, and
    never ``/bert/odom``.
    """

    _commands = ""

    def follow(self, commands: str, topic: str, namespace: str, timeout: int) -> None:
        """Set what is received.

        Args:
            commands: The resolved topic of the robot's commands; empty for no robot.
            topic: The topic to receive; empty for the odometry.
            namespace: Namespace of a relative `topic`.
            timeout: Milliseconds after which it is stale; 0 to receive nothing.
        """
        if commands != self._commands:
            self._commands, self._resolved = commands, ""
            self._begin_again()
        self.throttleRate, self.timeout = _RATE, timeout
        self.types = [] if topic else [_ODOMETRY]
        self.ns, self.topic = namespace, topic
        self.enabled = bool(commands) and timeout > 0

    def silence(self) -> str:
        """Return in words that the robot has fallen silent; empty if not, or it is not known.

        A topic that was never received proves nothing: it may be published only while it changes.
        """
        if not self.enabled or not self.stale or self.age < 0:
            return ""
        return f"the robot sends no data: {self._resolved} is {self.age:.1f} s old"

    def _select(self, node: Node) -> str:
        try:
            topics = node.topics()
        except Error:
            return self._resolved
        found = sorted(
            (name for name, types in topics.items() if _ODOMETRY in types),
            key=lambda name: (name.count("/"), name),
        )
        around = self._commands.rpartition("/")[0]
        near = [name for name in found if name.startswith(f"{around}/")]
        while around and not near:
            around = around.rpartition("/")[0]
            near = [name for name in found if name.rpartition("/")[0] == around]
        return self._resolved if self._resolved in near or not near else near[0]

"""Logging: a node's logger, whose messages go to Python's handlers and to ``/rosout``.

Behaviour: ROS wiki, "rosout" and "rospy/Overview/Logging"; levels and fields are
``rosgraph_msgs/Log``'s. As in rospy and roscpp, ``name`` is the node's and ``topics`` are those
that the node publishes or subscribes to, unless ``/rosout_disable_topics_generation`` is set.
"""

from __future__ import annotations

import itertools
import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm import QoS
from rosglass.comm.logger import NodeLogger
from rosglass.comm.rosout import LibraryLog, RosoutHandler, clean, message_of
from rosglass.comm.terminal import show_on_terminal
from rosglass.ros1.core import Member

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Publisher
    from rosglass.ros1.core import Core
    from rosglass.ros1.node import Ros1Node

__all__ = ["Rosout", "logger_name"]

_TOPIC, _TYPE = "/rosout", "rosgraph_msgs/Log"
_NO_TOPICS = "/rosout_disable_topics_generation"
#: Latched, as rospy and roscpp have it.
_QOS = QoS(depth=1000, durability=QoS.latched().durability)
#: Seconds that the first messages wait for the node ``/rosout``: latched is only the last one.
_PATIENCE = 2.0
#: ``rosgraph_msgs/Log``'s levels by the least of Python's that they stand for.
_LEVELS = ((50, 16), (40, 8), (30, 4), (20, 2))
_DEBUG = 1


def logger_name(node: str) -> str:
    """Return the name of a node's logger, below ``ros`` as in roscpp: ``ros.arm.gripper``."""
    return "ros." + node.strip("/").replace("/", ".")


class _Flush(Member):
    """Closes a handler as its node closes."""

    def __init__(self, handler: RosoutHandler, core: Core) -> None:
        self._handler, self._core = handler, core

    def close(self) -> None:
        self._handler.close()
        self._core.remove(self)


class Rosout:
    """A node's logging: its logger and its publisher of ``/rosout``.

    Args:
        node: The node it belongs to.
        core: What that consists of.
        topics: Returns the topics that the node publishes or subscribes to.
    """

    def __init__(self, node: Ros1Node, core: Core, topics: Callable[[], list[str]]) -> None:
        name = logger_name(core.name.full)
        self._node, self._core, self._topics = node, core, topics
        self._numbers = itertools.count(1)
        self._quiet = node.parameter_server.subscribe(_NO_TOPICS)
        self.logger = NodeLogger(name, logging.getLogger())
        self.logger.setLevel(logging.INFO)
        self._handler = RosoutHandler(
            name, self._announce, self._fields, lambda: not core.forked, _PATIENCE
        )
        self.logger.addHandler(self._handler)
        self._library = LibraryLog(self._handler, core.runs_here)
        show_on_terminal(self.logger)

    def open(self) -> None:
        """Announce the publisher."""
        self._handler.open()

    def close(self) -> None:
        """Let go of all handlers; safe to call twice."""
        self._library.close()
        self.logger.removeHandler(self._handler)
        self._handler.close()
        self._quiet.close()

    def _announce(self, handler: RosoutHandler) -> Publisher:
        made = self._node.create_publisher(_TOPIC, _TYPE, _QOS)
        # Closed before the publisher, as members are: what waits is still sent.
        self._core.add(_Flush(handler, self._core))
        return made

    def _fields(self, record: logging.LogRecord) -> dict[str, Any]:
        """Return the fields of a ``Log`` message."""
        # A robot's time may be a simulation's: the record's own is only the system's.
        now = self._core.clock.now().nanoseconds
        return {
            "header": {
                "seq": next(self._numbers) % 2**32,
                "stamp": {"secs": now // 10**9, "nsecs": now % 10**9},
            },
            "level": _level(record.levelno),
            "name": self._core.name.full,
            "msg": message_of(record),
            "file": clean(record.pathname),
            "function": clean(record.funcName or ""),
            "line": max(0, record.lineno),
            "topics": [] if self._quiet.value else self._topics(),
        }


def _level(number: int) -> int:
    """Return the level of ROS that is no more severe than Python's, the least one at least."""
    return next((ros for least, ros in _LEVELS if number >= least), _DEBUG)

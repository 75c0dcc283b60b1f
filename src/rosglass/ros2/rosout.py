"""Logging: a node's logger, whose messages go to Python's handlers and to ``/rosout``.

Behaviour: design article "Logging" and ``rcl``'s ``logging_rosout``; levels and fields are
``rcl_interfaces/msg/Log``'s, whose numbers are those of :mod:`logging`, too.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm import Duration, QoS
from rosglass.comm.logger import NodeLogger
from rosglass.comm.rosout import LibraryLog, RosoutHandler, clean, message_of
from rosglass.comm.terminal import show_on_terminal
from rosglass.ros2.core import Member

if TYPE_CHECKING:
    from rosglass.comm import Node, Publisher
    from rosglass.ros2.core import Core

__all__ = ["ROSOUT_QOS", "Rosout", "logger_name"]

#: rcl's ``rcl_qos_profile_rosout_default``.
ROSOUT_QOS = QoS(
    depth=1000, durability=QoS.latched().durability, lifespan=Duration.from_seconds(10)
)
_TOPIC, _TYPE = "/rosout", "rcl_interfaces/msg/Log"
_FATAL = 50


def logger_name(node: str) -> str:
    """Return the name of a node's logger, as rcl has it: ``/arm/gripper`` logs as arm.gripper."""
    return node.strip("/").replace("/", ".")


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
    """

    def __init__(self, node: Node, core: Core) -> None:
        arguments, name = core.arguments, logger_name(core.name.full)
        self._node, self._core = node, core
        self.handler: RosoutHandler | None = None
        if arguments.rosout:
            self.handler = RosoutHandler(name, self._announce, _fields, lambda: not core.forked)
        self.logger = NodeLogger(name, logging.getLogger(), dict(arguments.logger_levels))
        if name not in arguments.logger_levels:
            level = arguments.log_level
            self.logger.setLevel(logging.INFO if level is None else level)
        self.logger.propagate = arguments.stdout
        self._library: logging.Handler | None = None
        if self.handler is not None:
            self.logger.addHandler(self.handler)
            self._library = LibraryLog(self.handler, core.runs_here)
        if arguments.stdout:
            show_on_terminal(self.logger)

    def open(self) -> None:
        """Announce the publisher, if there is to be one."""
        if self.handler is not None:
            self.handler.open()

    def close(self) -> None:
        """Let go of all handlers; safe to call twice."""
        if self.handler is None:
            return
        if self._library is not None:
            self._library.close()
        self.logger.removeHandler(self.handler)
        self.handler.close()

    def _announce(self, handler: RosoutHandler) -> Publisher:
        made = self._node.create_publisher(_TOPIC, _TYPE, ROSOUT_QOS)
        # Closed before the publisher, as members are: what waits is still sent.
        self._core.add(_Flush(handler, self._core))
        return made


def _fields(record: logging.LogRecord) -> dict[str, Any]:
    """Return the fields of a ``Log`` message."""
    return {
        "stamp": {
            "sec": int(record.created),
            "nanosec": min(999_999_999, int(record.created % 1 * 1e9)),
        },
        "level": _level(record.levelno),
        "name": clean(record.name),
        "msg": message_of(record),
        "file": clean(record.pathname),
        "function": clean(record.funcName or ""),
        "line": max(0, record.lineno),
    }


def _level(number: int) -> int:
    """Return the level of ROS that is no more severe than Python's, the least one at least."""
    return max(10, min(_FATAL, number // 10 * 10))

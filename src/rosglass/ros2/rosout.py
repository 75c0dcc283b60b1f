"""Logging: a node's logger, whose messages go to Python's handlers and to ``/rosout``.

Behaviour: design article "Logging" and ``rcl``'s ``logging_rosout``; levels and fields are
``rcl_interfaces/msg/Log``'s, whose numbers are those of :mod:`logging`, too.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.comm import Duration, QoS, Worker
from rosglass.errors import Error
from rosglass.ros2.core import Member

if TYPE_CHECKING:
    from rosglass.comm import Node, Publisher
    from rosglass.ros2.core import Core

__all__ = ["ROSOUT_QOS", "NodeLogger", "Rosout", "RosoutHandler", "logger_name"]

_log = logging.getLogger("rosglass.ros2")
#: rcl's ``rcl_qos_profile_rosout_default``.
ROSOUT_QOS = QoS(
    depth=1000, durability=QoS.latched().durability, lifespan=Duration.from_seconds(10)
)
_TOPIC, _TYPE = "/rosout", "rcl_interfaces/msg/Log"
#: Messages that may wait to be published, and that are published in a second.
_MAX_WAITING = _MAX_RATE = 1000
#: Characters of a message.
_MAX_TEXT = 32 * 1024
#: Pause of the publishing thread; it is woken when there is something to do.
_PAUSE = 3600.0
_FATAL = 50


def logger_name(node: str) -> str:
    """Return the name of a node's logger, as rcl has it: ``/arm/gripper`` logs as arm.gripper."""
    return node.strip("/").replace("/", ".")


class NodeLogger(logging.Logger):
    """A node's logger, or a child of it.

    A :class:`logging.Logger` like any other, except that :func:`logging.getLogger` does not know
    it: several nodes in one process, in one graph or in several, may bear the same name. It starts
    with level INFO, as ROS 2's loggers do, and hands its messages on to Python's root logger.

    Args:
        name: Its name.
        parent: Where its messages go, too.
        levels: Least severe levels of it and its children, by name.
    """

    def __init__(
        self, name: str, parent: logging.Logger, levels: dict[str, int] | None = None
    ) -> None:
        self._levels = {} if levels is None else levels
        super().__init__(name, self._levels.get(name, logging.NOTSET))
        self.parent = parent
        self._children: dict[str, NodeLogger] = {}

    def getChild(self, suffix: str) -> NodeLogger:  # noqa: N802 - logging's spelling
        """Return the logger ``<name>.<suffix>``, whose messages go where this one's go."""
        first, _, rest = suffix.partition(".")
        child = self._children.get(first)
        if child is None:
            made = NodeLogger(f"{self.name}.{first}", self, self._levels)
            child = self._children.setdefault(first, made)
        return child.getChild(rest) if rest else child

    def isEnabledFor(self, level: int) -> bool:  # noqa: N802 - logging's spelling
        """Return whether messages of `level` pass."""
        # Asked anew each time: logging only clears the caches of loggers that it knows.
        if self.disabled or self.manager.disable >= level:
            return False
        return level >= self.getEffectiveLevel()


class RosoutHandler(logging.Handler):
    """Publishes log records; never waits, never raises.

    Messages come faster than 1000 in a second, or than they can be sent, are left out and counted;
    long ones are cut.
    """

    def __init__(self, node: Node, core: Core) -> None:
        super().__init__()
        self._node, self._core = node, core
        self._waiting: deque[dict[str, Any]] = deque()
        self._lost = 0
        self._second, self._count = 0, 0
        self._start = threading.Lock()
        self._publisher: Publisher | None = None
        self._worker: Worker | None = None
        self._closed = False

    def open(self) -> None:
        """Announce the publisher, so that subscriptions are there before the first message."""
        with self._start:
            if self._publisher is None and not self._closed:
                self._publisher = self._node.create_publisher(_TOPIC, _TYPE, ROSOUT_QOS)
                # Closed before the publisher, as members are: what waits is still sent.
                self._core.add(_Flush(self, self._core))

    def emit(self, record: logging.LogRecord) -> None:
        """Publish a record soon."""
        try:
            if not self._closed and self._admit(record.created):
                self._waiting.append(_fields(record))
                self._wake()
        except Exception:
            self._lost += 1

    def close(self) -> None:
        """Publish what waits, and end; safe to call twice."""
        with self._start:
            closed, self._closed = self._closed, True
            worker, self._worker = self._worker, None
        if closed or self._core.forked:
            return
        if worker is not None:
            worker.close()
        self._publish()
        super().close()

    def _admit(self, created: float) -> bool:
        if int(created) != self._second:
            self._second, self._count = int(created), 0
        self._count += 1
        if self._count <= _MAX_RATE and len(self._waiting) < _MAX_WAITING:
            return True
        self._lost += 1
        return False

    def _wake(self) -> None:
        worker = self._worker
        if worker is None:
            with self._start:
                if self._closed or self._core.forked:
                    return
                if self._worker is None:
                    name = f"{self._core.name.name} rosout"
                    self._worker = Worker(name, lambda _: self._publish(), _PAUSE)
                worker = self._worker
        worker.wake()

    def _publish(self) -> None:
        # Whatever goes wrong here must not be logged: it would come here.
        with suppress(Error, OSError):
            self.open()
        publisher = self._publisher
        while self._waiting:
            fields = self._waiting.popleft()
            with suppress(Error, OSError):
                if publisher is not None:
                    publisher.publish(fields)
        if self._lost and publisher is not None and not self._closed:
            lost, self._lost = self._lost, 0
            with suppress(Error, OSError):
                publisher.publish(self._loss(lost))

    def _loss(self, lost: int) -> dict[str, Any]:
        now = time.time()
        record = logging.LogRecord(
            logger_name(self._core.name.full),
            logging.WARNING,
            __file__,
            0,
            "%d log messages were left out: there are too many",
            (lost,),
            None,
            "_loss",
        )
        record.created = now
        return _fields(record)


class _Flush(Member):
    """Closes a handler as its node closes."""

    def __init__(self, handler: RosoutHandler, core: Core) -> None:
        self._handler, self._core = handler, core

    def follow(self, moved: bool, idle: bool) -> None:
        """Follow the graph, which is of no concern here."""

    def close(self) -> None:
        self._handler.close()
        self._core.remove(self)


class _OwnThreads(logging.Filter):
    """Lets the library's warnings pass that a node's own threads make: they are about it."""

    def __init__(self, core: Core) -> None:
        super().__init__()
        self._core = core

    def filter(self, record: logging.LogRecord) -> bool:
        return record.levelno >= logging.WARNING and self._core.runs_here()


class Rosout:
    """A node's logging: its logger and its publisher of ``/rosout``.

    Args:
        node: The node it belongs to.
        core: What that consists of.
    """

    def __init__(self, node: Node, core: Core) -> None:
        arguments, name = core.arguments, logger_name(core.name.full)
        self.handler = RosoutHandler(node, core) if arguments.rosout else None
        self.logger = NodeLogger(name, logging.getLogger(), dict(arguments.logger_levels))
        if name not in arguments.logger_levels:
            level = arguments.log_level
            self.logger.setLevel(logging.INFO if level is None else level)
        self.logger.propagate = arguments.stdout
        self._library: logging.Handler | None = None
        if self.handler is not None:
            self.logger.addHandler(self.handler)
            self._library = _Forward(self.handler)
            self._library.addFilter(_OwnThreads(core))
            logging.getLogger("rosglass").addHandler(self._library)

    def open(self) -> None:
        """Announce the publisher, if there is to be one."""
        if self.handler is not None:
            self.handler.open()

    def close(self) -> None:
        """Let go of all handlers; safe to call twice."""
        if self.handler is None:
            return
        if self._library is not None:
            logging.getLogger("rosglass").removeHandler(self._library)
        self.logger.removeHandler(self.handler)
        self.handler.close()


class _Forward(logging.Handler):
    def __init__(self, handler: RosoutHandler) -> None:
        super().__init__()
        self._handler = handler

    def emit(self, record: logging.LogRecord) -> None:
        self._handler.emit(record)


def _fields(record: logging.LogRecord) -> dict[str, Any]:
    """Return the fields of a ``Log`` message."""
    return {
        "stamp": {
            "sec": int(record.created),
            "nanosec": min(999_999_999, int(record.created % 1 * 1e9)),
        },
        "level": _level(record.levelno),
        "name": _clean(record.name),
        "msg": _clean(_FORMATTER.format(record)),
        "file": _clean(record.pathname),
        "function": _clean(record.funcName or ""),
        "line": max(0, record.lineno),
    }


_FORMATTER = logging.Formatter("%(message)s")


def _level(number: int) -> int:
    """Return the level of ROS that is no more severe than Python's, the least one at least."""
    return max(10, min(_FATAL, number // 10 * 10))


def _clean(text: str) -> str:
    """Return what a ROS string can hold of `text`, which may not be all of it."""
    if len(text) > _MAX_TEXT:
        text = f"{text[:_MAX_TEXT]}... (cut; {len(text)} characters)"
    return text.replace("\0", "\\0").encode("utf-8", "backslashreplace").decode()

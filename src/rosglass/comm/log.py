"""A node's log: a Python logger whose records go to Python's handlers and to ``/rosout``.

Behaviour: ROS wiki, "rosout"; design article "Logging" and ``rcl``'s ``logging_rosout``. A
:class:`RosoutTopic` describes the messages of ROS 1's or ROS 2's ``/rosout``. Records are shown on
the terminal if the program has not configured `logging`.
"""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.core import NodeMember
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.comm.timers import Worker
from rosglass.errors import Error, escape_controls

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm.core import NodeCore
    from rosglass.comm.publisher import Publisher
    from rosglass.comm.qos import QoS

__all__ = [
    "LibraryLog",
    "NodeLog",
    "NodeLogger",
    "RosoutHandler",
    "RosoutTopic",
    "clean",
    "message_of",
    "show_on_terminal",
    "warn_on_terminal",
]

_TOPIC = "/rosout"
#: Maximum number of messages that wait to be published, and that are published per second.
_MAX_WAITING = _MAX_RATE = 1000
#: Maximum length of a message in characters.
_MAX_TEXT = 32 * 1024
#: Longest pause of the publishing thread, which each record wakes.
_IDLE_POLL_S = 3600.0
#: Pause between checks for the first subscription.
_SUBSCRIPTION_POLL_S = 0.02
_FORMATTER = logging.Formatter("%(message)s")


class RosoutTopic(NamedTuple):
    """The messages of ``/rosout``.

    Attributes:
        type: Name of their type.
        qos: The publisher's profile.
        fields: Returns a message's fields; called in the thread that logs.
        first_wait_s: How long the first messages wait for a subscription, if late subscriptions
            would miss them.
    """

    type: str
    qos: QoS
    fields: Callable[[logging.LogRecord], dict[str, Any]]
    first_wait_s: float = 0.0


class NodeLog:
    """A node's log: its logger, and its publisher of ``/rosout``.

    Args:
        core: The node.
        name: The logger's name.
        rosout: The messages to publish; None publishes nothing.
        level: The logger's level.
        levels: Levels of the logger and its children, by name.
        to_python: Whether records also go to Python's handlers, and so to the terminal.
    """

    def __init__(
        self,
        core: NodeCore,
        name: str,
        rosout: RosoutTopic | None,
        *,
        level: int = logging.INFO,
        levels: Mapping[str, int] | None = None,
        to_python: bool = True,
    ) -> None:
        self.logger = NodeLogger(name, logging.getLogger(), levels)
        if name not in (levels or {}):
            self.logger.setLevel(level)
        self.logger.propagate = to_python
        self._handler: RosoutHandler | None = None
        self._library: LibraryLog | None = None
        if rosout is not None:
            self._handler = RosoutHandler(core, name, rosout)
            self.logger.addHandler(self._handler)
            self._library = LibraryLog(self._handler, core.runs_here)
        if to_python:
            show_on_terminal(self.logger)

    def open(self) -> None:
        """Announce the publisher, if there is one."""
        if self._handler is not None:
            self._handler.open()

    def close(self) -> None:
        """Publish waiting messages, and remove all handlers; safe to call twice."""
        if self._library is not None:
            self._library.close()
        if self._handler is not None:
            self.logger.removeHandler(self._handler)
            self._handler.close()


@hint_at_members
class NodeLogger(logging.Logger):
    """A node's logger, or a child of it.

    An ordinary :class:`logging.Logger` that is not registered with :func:`logging.getLogger`, as
    several nodes of a process may have the same name. Its initial level is INFO, as in ROS, and it
    propagates to Python's root logger.

    Args:
        name: Its name.
        parent: The logger it propagates to.
        levels: Levels of it and its children, by name.
    """

    def __init__(
        self, name: str, parent: logging.Logger, levels: Mapping[str, int] | None = None
    ) -> None:
        self._levels = {} if levels is None else levels
        super().__init__(name, self._levels.get(name, logging.NOTSET))
        self.parent = parent
        self._children: dict[str, NodeLogger] = {}

    def getChild(self, suffix: str) -> NodeLogger:  # noqa: N802 - logging's spelling
        """Return the logger ``<name>.<suffix>``, which propagates to this one."""
        first, _, rest = suffix.partition(".")
        child = self._children.get(first)
        if child is None:
            made = NodeLogger(f"{self.name}.{first}", self, self._levels)
            child = self._children.setdefault(first, made)
        return child.getChild(rest) if rest else child

    def family(self) -> list[NodeLogger]:
        """Return it and all its descendants, sorted by name."""
        found = [self]
        for _, child in sorted(self._children.copy().items()):
            found += child.family()
        return found

    def isEnabledFor(self, level: int) -> bool:  # noqa: N802 - logging's spelling
        """Return whether records of `level` are logged."""
        # Not cached: logging clears the caches of registered loggers only.
        if self.disabled or self.manager.disable >= level:
            return False
        return level >= self.getEffectiveLevel()


class RosoutHandler(logging.Handler, NodeMember):
    """Publishes log records; never waits, never raises.

    Messages above 1000 per second, or faster than they can be sent, are dropped and counted; long
    ones are truncated.

    Args:
        core: The core of the node.
        name: Name of the node's logger, for the handler's own messages.
        topic: The messages of ``/rosout``.
    """

    def __init__(self, core: NodeCore, name: str, topic: RosoutTopic) -> None:
        super().__init__()
        self._core, self._label, self._topic = core, name, topic
        self._first_wait_s = topic.first_wait_s
        self._waiting: deque[dict[str, Any]] = deque()
        self._lost = 0
        self._second, self._count = 0, 0
        #: Guards the creation of publisher and worker. Reentrant: a closing node closes the handler
        #: when the handler adds its publisher.
        self._start = threading.RLock()
        self._publisher: Publisher | None = None
        self._worker: Worker | None = None
        self._closed = False

    def open(self) -> None:
        """Announce the publisher, so that subscriptions match before the first message."""
        with self._start:
            if self._publisher is None and not self._closed:
                topic = self._topic
                core = self._core
                core.check_open()
                message_type = core.types.message(topic.type)
                # Slow to import; interfaces need only `warn_on_terminal` before their first frame.
                from rosglass.comm.publisher import Publisher  # noqa: PLC0415

                self._publisher = Publisher(core, core.resolve(_TOPIC), message_type, topic.qos)
                # Members close in reverse order: this one before its publisher.
                self._core.add(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Publish a record soon."""
        try:
            if not self._closed and self._admit(record.created):
                self._waiting.append(self._topic.fields(record))
                self._wake()
        except Exception:  # noqa: BLE001 - logging must not raise; the loss is published
            self._lost += 1

    def close(self) -> None:
        """Publish waiting messages, and stop; safe to call twice."""
        with self._start:
            closed, self._closed = self._closed, True
            worker, self._worker = self._worker, None
        if closed or self._core.forked:
            return
        self._core.remove(self)
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
                    name = f"{self._label} rosout"
                    self._worker = Worker(name, lambda _: self._publish(), _IDLE_POLL_S)
                worker = self._worker
        worker.wake()

    def _publish(self) -> None:
        with suppress(Error, OSError):  # not logged: the record of it would end up here
            self.open()
        publisher = self._publisher
        if publisher is not None:
            self._await_subscription(publisher)
        while self._waiting:
            fields = self._waiting.popleft()
            with suppress(Error, OSError):  # as above
                if publisher is not None:
                    publisher.publish(fields)
        if self._lost and publisher is not None and not self._closed:
            lost, self._lost = self._lost, 0
            with suppress(Error, OSError):  # as above
                publisher.publish(self._topic.fields(self._loss(lost)))

    def _await_subscription(self, publisher: Publisher) -> None:
        wait_s, self._first_wait_s = self._first_wait_s, 0.0
        end = time.monotonic() + wait_s
        while not (self._closed or publisher.subscription_count()) and time.monotonic() < end:
            time.sleep(_SUBSCRIPTION_POLL_S)

    def _loss(self, lost: int) -> logging.LogRecord:
        text = "%d log messages were dropped: there are too many"
        record = logging.LogRecord(
            self._label, logging.WARNING, __file__, 0, text, (lost,), None, "_loss"
        )
        record.created = time.time()
        return record


class LibraryLog(logging.Handler):
    """Publishes the library's warnings from a node's own threads, which concern that node.

    It is active until it is closed.

    Args:
        handler: The handler that publishes them.
        runs_here: Whether the calling thread is one of the node's own.
    """

    def __init__(self, handler: RosoutHandler, runs_here: Callable[[], bool]) -> None:
        super().__init__(logging.WARNING)
        self._handler, self._runs_here = handler, runs_here
        logging.getLogger("rosglass").addHandler(self)
        warn_on_terminal()

    def emit(self, record: logging.LogRecord) -> None:
        """Publish a record of the node's threads."""
        if self._runs_here():
            self._handler.emit(record)

    def close(self) -> None:
        """Remove the handler; safe to call twice."""
        logging.getLogger("rosglass").removeHandler(self)
        super().close()


def message_of(record: logging.LogRecord) -> str:
    """Return a record's text, with its traceback."""
    return clean(_FORMATTER.format(record))


def clean(text: str) -> str:
    """Return `text` as a valid ROS string: truncated, and without invalid characters."""
    if len(text) > _MAX_TEXT:
        text = f"{text[:_MAX_TEXT]}... (cut; {len(text)} characters)"
    return text.replace("\0", "\\0").encode("utf-8", "backslashreplace").decode()


class _TerminalHandler(logging.Handler):
    """Replaces `logging.lastResort`, which is inactive if a logger has any handler.

    A node's logger always has one, for /rosout.

    Args:
        logger: The logger whose handlers are considered.
        level: Its level.
    """

    def __init__(self, logger: logging.Logger, level: int) -> None:
        super().__init__(level)
        self._logger = logger
        self.setFormatter(logging.Formatter("%(levelname)s %(name)s: %(message)s"))

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record to stderr, unless the program has configured logging."""
        if logging.lastResort is None or logging.getLogger().handlers:
            return
        if any(isinstance(handler, logging.StreamHandler) for handler in self._logger.handlers):
            return
        try:
            sys.stderr.write(f"{escape_controls(self.format(record))}\n")
        except Exception:  # noqa: BLE001 - as logging's own handlers do
            self.handleError(record)


_handler = _TerminalHandler(logging.getLogger("rosglass"), logging.WARNING)


def show_on_terminal(logger: logging.Logger) -> None:
    """Show a node's log on the terminal, as ROS does, if `logging` is not configured."""
    logger.addHandler(_TerminalHandler(logger, logging.NOTSET))


def warn_on_terminal(formatter: logging.Formatter | None = None) -> None:
    """Show the library's warnings on the terminal if `logging` is not configured.

    Args:
        formatter: The format; None keeps the current one, initially with level and logger.
    """
    if formatter is not None:
        _handler.setFormatter(formatter)
    logging.getLogger("rosglass").addHandler(_handler)

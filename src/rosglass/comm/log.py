"""A node's log: a logger of Python's whose messages go to its handlers, and to ``/rosout``.

Behaviour: ROS wiki, "rosout"; design article "Logging" and ``rcl``'s ``logging_rosout``. What a
message on ``/rosout`` looks like is ROS 1's or ROS 2's own: a :class:`RosoutTopic` says it. The
terminal shows messages where the program has not configured `logging`.
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
from rosglass.comm.publisher import Publisher
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.comm.timers import Worker
from rosglass.errors import Error, escape_controls

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm.core import NodeCore
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
#: Messages that may wait to be published, and that are published in a second.
_MAX_WAITING = _MAX_RATE = 1000
#: Characters of a message.
_MAX_TEXT = 32 * 1024
#: Pause of the publishing thread; it is woken when there is something to do.
_IDLE_POLL_S = 3600.0
#: Pause between looks for the first subscription.
_SUBSCRIPTION_POLL_S = 0.02
_FORMATTER = logging.Formatter("%(message)s")


class RosoutTopic(NamedTuple):
    """What the messages of ``/rosout`` look like.

    Attributes:
        type: Their type's name.
        qos: The publisher's profile.
        fields: Returns a message's fields; called in the thread that logs.
        first_wait_s: How long the first messages wait for a subscription, where those that come
            later would miss them.
    """

    type: str
    qos: QoS
    fields: Callable[[logging.LogRecord], dict[str, Any]]
    first_wait_s: float = 0.0


class NodeLog:
    """A node's log: its logger, and its publisher of ``/rosout``.

    Args:
        core: What the node consists of.
        name: The logger's name.
        rosout: What is published; None publishes nothing.
        level: Least severe level that the logger lets pass.
        levels: The same for it and its children, by name.
        to_python: Whether messages also go to Python's handlers, and so to the terminal.
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
        """Announce the publisher, if there is to be one."""
        if self._handler is not None:
            self._handler.open()

    def close(self) -> None:
        """Publish what waits, and let go of all handlers; safe to call twice."""
        if self._library is not None:
            self._library.close()
        if self._handler is not None:
            self.logger.removeHandler(self._handler)
            self._handler.close()


@hint_at_members
class NodeLogger(logging.Logger):
    """A node's logger, or a child of it.

    A :class:`logging.Logger` like any other, except that :func:`logging.getLogger` does not know
    it: several nodes in one process, in one graph or in several, may bear the same name. It starts
    with level INFO, as ROS's loggers do, and hands its messages on to Python's root logger.

    Args:
        name: Its name.
        parent: Where its messages go, too.
        levels: Least severe levels of it and its children, by name.
    """

    def __init__(
        self, name: str, parent: logging.Logger, levels: Mapping[str, int] | None = None
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

    def family(self) -> list[NodeLogger]:
        """Return it and all loggers below it that were asked for, sorted by name."""
        found = [self]
        for _, child in sorted(self._children.copy().items()):
            found += child.family()
        return found

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

    Args:
        core: What the node consists of.
        name: The node's logger, for what the handler has to say itself.
        topic: What a message looks like.
    """

    def __init__(self, core: NodeCore, name: str, topic: RosoutTopic) -> None:
        super().__init__()
        self._core, self._label, self._topic = core, name, topic
        self._first_wait_s = topic.first_wait_s
        self._waiting: deque[dict[str, Any]] = deque()
        self._lost = 0
        self._second, self._count = 0, 0
        #: Reentrant: a node that is just closing closes the handler as it adds its publisher.
        self._start = threading.RLock()
        self._publisher: Publisher | None = None
        self._worker: Worker | None = None
        self._closed = False

    def open(self) -> None:
        """Announce the publisher, so that subscriptions are there before the first message."""
        with self._start:
            if self._publisher is None and not self._closed:
                topic = self._topic
                core = self._core
                core.check_open()
                message_type = core.types.message(topic.type)
                self._publisher = Publisher(core, core.resolve(_TOPIC), message_type, topic.qos)
                # Members close in reverse order: what waits is published before the publisher ends.
                self._core.add(_Flush(self, self._core))

    def emit(self, record: logging.LogRecord) -> None:
        """Publish a record soon."""
        try:
            if not self._closed and self._admit(record.created):
                self._waiting.append(self._topic.fields(record))
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
                    name = f"{self._label} rosout"
                    self._worker = Worker(name, lambda _: self._publish(), _IDLE_POLL_S)
                worker = self._worker
        worker.wake()

    def _publish(self) -> None:
        # An error here must not be logged: its record would come here.
        with suppress(Error, OSError):
            self.open()
        publisher = self._publisher
        if publisher is not None:
            self._await_subscription(publisher)
        while self._waiting:
            fields = self._waiting.popleft()
            with suppress(Error, OSError):
                if publisher is not None:
                    publisher.publish(fields)
        if self._lost and publisher is not None and not self._closed:
            lost, self._lost = self._lost, 0
            with suppress(Error, OSError):
                publisher.publish(self._topic.fields(self._loss(lost)))

    def _await_subscription(self, publisher: Publisher) -> None:
        wait_s, self._first_wait_s = self._first_wait_s, 0.0
        end = time.monotonic() + wait_s
        while not (self._closed or publisher.subscription_count()) and time.monotonic() < end:
            time.sleep(_SUBSCRIPTION_POLL_S)

    def _loss(self, lost: int) -> logging.LogRecord:
        text = "%d log messages were left out: there are too many"
        record = logging.LogRecord(
            self._label, logging.WARNING, __file__, 0, text, (lost,), None, "_loss"
        )
        record.created = time.time()
        return record


class _Flush(NodeMember):
    """Closes a handler as its node closes."""

    def __init__(self, handler: RosoutHandler, core: NodeCore) -> None:
        self._handler, self._core = handler, core

    def close(self) -> None:
        self._handler.close()
        self._core.remove(self)


class LibraryLog(logging.Handler):
    """Publishes the library's warnings that a node's own threads make: they are about the node.

    It listens from the start, until it is closed.

    Args:
        handler: Publishes them.
        runs_here: Whether the calling thread is one of the node's own.
    """

    def __init__(self, handler: RosoutHandler, runs_here: Callable[[], bool]) -> None:
        super().__init__(logging.WARNING)
        self._handler, self._runs_here = handler, runs_here
        logging.getLogger("rosglass").addHandler(self)
        warn_on_terminal()

    def emit(self, record: logging.LogRecord) -> None:
        """Hand on a record."""
        if self._runs_here():
            self._handler.emit(record)

    def close(self) -> None:
        """Listen no more; safe to call twice."""
        logging.getLogger("rosglass").removeHandler(self)
        super().close()


def message_of(record: logging.LogRecord) -> str:
    """Return a record's text, with the error that it reports."""
    return clean(_FORMATTER.format(record))


def clean(text: str) -> str:
    """Return what a ROS string can hold of `text`, which may not be all of it."""
    if len(text) > _MAX_TEXT:
        text = f"{text[:_MAX_TEXT]}... (cut; {len(text)} characters)"
    return text.replace("\0", "\\0").encode("utf-8", "backslashreplace").decode()


class _TerminalHandler(logging.Handler):
    """Does what `logging.lastResort` does, which says nothing once there is any handler.

    There always is: what is logged goes to /rosout as well.

    Args:
        logger: The logger that it is for.
        level: Least severe level that it shows.
    """

    def __init__(self, logger: logging.Logger, level: int) -> None:
        super().__init__(level)
        self._logger = logger
        self.setFormatter(logging.Formatter("%(levelname)s %(name)s: %(message)s"))

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record to stderr, unless the program has made its own arrangements."""
        if logging.lastResort is None or logging.getLogger().handlers:
            return
        if any(isinstance(handler, logging.StreamHandler) for handler in self._logger.handlers):
            return
        try:
            sys.stderr.write(f"{escape_controls(self.format(record))}\n")
        except Exception:
            self.handleError(record)


_handler = _TerminalHandler(logging.getLogger("rosglass"), logging.WARNING)


def show_on_terminal(logger: logging.Logger) -> None:
    """Show what a node's logger logs, as ROS does, where `logging` has not been configured."""
    logger.addHandler(_TerminalHandler(logger, logging.NOTSET))


def warn_on_terminal(formatter: logging.Formatter | None = None) -> None:
    """Have warnings of the library be seen where `logging` has not been configured.

    Args:
        formatter: How they look; as before, or with level and logger, by default.
    """
    if formatter is not None:
        _handler.setFormatter(formatter)
    logging.getLogger("rosglass").addHandler(_handler)

"""Handing log records of Python on to a topic, which never holds up who logs."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.comm.terminal import warn_on_terminal
from rosglass.comm.worker import Worker
from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.publisher import Publisher

__all__ = ["LibraryLog", "RosoutHandler", "clean", "message_of"]

#: Messages that may wait to be published, and that are published in a second.
_MAX_WAITING = _MAX_RATE = 1000
#: Characters of a message.
_MAX_TEXT = 32 * 1024
#: Pause of the publishing thread; it is woken when there is something to do.
_PAUSE = 3600.0
#: Seconds between looks for the first subscription.
_GLANCE = 0.02
_FORMATTER = logging.Formatter("%(message)s")


class RosoutHandler(logging.Handler):
    """Publishes log records; never waits, never raises.

    Messages come faster than 1000 in a second, or than they can be sent, are left out and counted;
    long ones are cut.

    Args:
        name: Of the node's logger, for what the handler has to say itself.
        announce: Makes the publisher, and sees to it that the handler is closed with the node,
            before the publisher: what waits is still sent.
        fields: Returns the message's fields; called in the thread that logs.
        alive: Whether this process is the one that the node belongs to.
        patience: Seconds that the first messages wait for a subscription, where those that come
            later would miss them.
    """

    def __init__(
        self,
        name: str,
        announce: Callable[[RosoutHandler], Publisher],
        fields: Callable[[logging.LogRecord], dict[str, Any]],
        alive: Callable[[], bool],
        patience: float = 0.0,
    ) -> None:
        super().__init__()
        self._patience = patience
        self._label, self._announce = name, announce
        self._fields, self._alive = fields, alive
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
                self._publisher = self._announce(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Publish a record soon."""
        try:
            if not self._closed and self._admit(record.created):
                self._waiting.append(self._fields(record))
                self._wake()
        except Exception:
            self._lost += 1

    def close(self) -> None:
        """Publish what waits, and end; safe to call twice."""
        with self._start:
            closed, self._closed = self._closed, True
            worker, self._worker = self._worker, None
        if closed or not self._alive():
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
                if self._closed or not self._alive():
                    return
                if self._worker is None:
                    name = f"{self._label} rosout"
                    self._worker = Worker(name, lambda _: self._publish(), _PAUSE)
                worker = self._worker
        worker.wake()

    def _publish(self) -> None:
        # Whatever goes wrong here must not be logged: it would come here.
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
                publisher.publish(self._fields(self._loss(lost)))

    def _await_subscription(self, publisher: Publisher) -> None:
        patience, self._patience = self._patience, 0.0
        end = time.monotonic() + patience
        while not (self._closed or publisher.subscription_count()) and time.monotonic() < end:
            time.sleep(_GLANCE)

    def _loss(self, lost: int) -> logging.LogRecord:
        told = "%d log messages were left out: there are too many"
        record = logging.LogRecord(
            self._label, logging.WARNING, __file__, 0, told, (lost,), None, "_loss"
        )
        record.created = time.time()
        return record


class LibraryLog(logging.Handler):
    """Hands on the library's warnings that a node's own threads make: they are about it.

    It listens from the start, until it is closed.

    Args:
        handler: Who takes them.
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
    """Return a record's text, with the error it tells of."""
    return clean(_FORMATTER.format(record))


def clean(text: str) -> str:
    """Return what a ROS string can hold of `text`, which may not be all of it."""
    if len(text) > _MAX_TEXT:
        text = f"{text[:_MAX_TEXT]}... (cut; {len(text)} characters)"
    return text.replace("\0", "\\0").encode("utf-8", "backslashreplace").decode()

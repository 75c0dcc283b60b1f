"""Receiving: a topic's samples, to be taken, waited for or called back with."""

from __future__ import annotations

import logging
import math
import threading
import time
from contextlib import suppress
from functools import wraps
from typing import TYPE_CHECKING

from rosglass.comm.events import SubscriptionEvents
from rosglass.comm.executor import IMMEDIATE, check_plain
from rosglass.comm.handle import Executor, Handle, check_flag, check_may_wait
from rosglass.comm.inbox import ImmediateInbox, Inbox
from rosglass.comm.promise import check_timeout
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.comm.sample import Sample
from rosglass.errors import ConversionError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Iterator

    from rosglass.comm.events import (
        DeadlineMissed,
        IncompatibleQoS,
        LivelinessChanged,
        Matched,
        SamplesLost,
    )
    from rosglass.comm.qos import QoS
    from rosglass.comm.statistics import Statistics
    from rosglass.comm.time import Duration
    from rosglass.messages import Message, MessageType

__all__ = ["Source", "Subscription"]

_log = logging.getLogger("rosglass.comm")
#: Seconds that a subscription counts as watched after somebody waited for it.
_MEMORY = 1.0
#: Longest uninterrupted wait in seconds: on Windows a lock that is waited for holds up Ctrl-C.
_SLICE = 0.2


class Source:
    """What a subscription asks of its world; a world overrides what it can do."""

    def publisher_count(self) -> int:
        """Return how many publishers match now."""
        return 0

    def hint(self) -> str:
        """Return what a person could do about a topic without publishers, empty if nothing."""
        return ""

    def attend(self) -> None:
        """Hand on samples as they come from now on, if :attr:`Subscription.watched`."""

    def refresh(self) -> None:
        """Deliver, in the calling thread, what waits to be delivered."""

    def inform(self) -> None:
        """Look at the subscription soon, without waiting: listeners or patience are new."""

    def lost(self) -> int:
        """Return how many samples were sent and have not arrived."""
        return 0


@hint_at_members
class Subscription(Handle):
    """Receives the messages of one topic.

    Once closed, it has nothing more to take: :attr:`closed` tells a polling loop when to end.

    ``for sample in subscription`` and ``async for sample in subscription`` wait for each sample and
    end when the subscription is closed.

    Attributes:
        topic: Absolute topic name.
    """

    def __init__(
        self,
        topic: str,
        message_type: MessageType | None,
        qos: QoS,
        executor: Executor,
        callback: Callable[[Message], None] | None = None,
        raw_callback: Callable[[Sample], None] | None = None,
        on_close: Callable[[], None] | None = None,
    ) -> None:
        for name, given in (("callback", callback), ("raw_callback", raw_callback)):
            if given is not None:
                check_plain(given, topic, name)
        if callback is not None and raw_callback is not None:
            told = "None beside a callback: one of the two is called, not both"
            raise ConversionError("raw_callback", raw_callback, told, topic)
        if not isinstance(executor, Executor):
            raise ConversionError("executor", executor, "a rosglass.comm.Executor", topic)
        self.topic = topic
        # What has an underscore is also for the feed, which fills and closes it.
        self._on_close = on_close
        self._source = Source()
        self._events = SubscriptionEvents(topic)
        self._qos, self._type, self._executor = qos, message_type, executor
        self._called = callback is not None or raw_callback is not None
        self._decodes = callback is not None and raw_callback is None
        #: An item for each thread or task that waits for a sample.
        self._waiting: list[None] = []
        self._watched_at = -math.inf
        self._patient = False
        self._problem = self._logged = ""
        call = raw_callback
        if call is None and callback is not None:
            call = _decoding(callback)
        if call is not None and executor is IMMEDIATE:
            self._inbox: Inbox = ImmediateInbox(topic, qos, call, callback)
        else:
            self._inbox = Inbox(topic, qos, executor, call, callback)

    # -- what it is ------------------------------------------------------------------------------

    @property
    def type(self) -> MessageType | None:
        """The message type; None while it is not discovered yet."""
        return self._type

    @property
    def qos(self) -> QoS:
        """The quality of service requested; what was left open is filled in as it is decided."""
        return self._qos

    @property
    def problem(self) -> str:
        """Why nothing can be received, in words; empty when all is well.

        Also when whoever published has left, or the connection is lost; :attr:`hint` helps when
        nobody has published yet.
        """
        return self._problem

    @property
    def hint(self) -> str:
        """What may be wrong when nobody publishes the topic, e.g. a name much like it."""
        return "" if self.closed else self._source.hint()

    @property
    def closed(self) -> bool:
        """Whether :meth:`close` was called."""
        return self._inbox.closed

    def __repr__(self) -> str:
        kind = self._type.name if self._type is not None else "type not known yet"
        return f"<{type(self).__name__} {self.topic} [{kind}]{' closed' * self.closed}>"

    def publisher_count(self) -> int:
        """Return how many publishers match this subscription now; 0 after closing."""
        return 0 if self.closed else self._source.publisher_count()

    # -- taking ----------------------------------------------------------------------------------

    def take(self) -> Sample | None:
        """Return the oldest waiting sample, or None."""
        self._source.refresh()
        return self._inbox.pop()

    def take_latest(self) -> Sample | None:
        """Return the newest waiting sample and forget the older ones (they count as dropped)."""
        self._source.refresh()
        return self._inbox.pop_latest()

    def wait(self, timeout: float | None = None) -> Sample | None:
        """Return the oldest waiting sample, waiting for one if need be.

        Args:
            timeout: Seconds to wait, None for ever.

        Returns:
            None when none came in time, or when the subscription was closed.

        Raises:
            ConversionError: The timeout is no number of seconds.
            UnsupportedError: Called in a thread that receives, where none could come.
        """
        left = check_timeout(timeout, f"{self.topic}: wait()")
        deadline = math.inf if left is None else time.monotonic() + left
        self._watch()
        try:
            while True:
                sample = self.take()
                remaining = deadline - time.monotonic()
                if sample is not None or self.closed or remaining <= 0:
                    return sample
                check_may_wait(self.topic, following=True)
                ready = threading.Lock()
                ready.acquire()
                if self._inbox.enlist(ready.release):
                    ready.acquire(timeout=min(remaining, _SLICE))
                    self._inbox.dismiss(ready.release)
        finally:
            self._unwatch()

    def __iter__(self) -> Iterator[Sample]:
        while (sample := self.wait()) is not None:
            yield sample

    async def __aiter__(self) -> AsyncIterator[Sample]:
        import asyncio  # noqa: PLC0415 - only for those who use it

        loop = asyncio.get_running_loop()
        arrived = asyncio.Event()

        def wake() -> None:
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(arrived.set)

        self._watch()
        try:
            while True:
                sample = self.take()
                if sample is not None:
                    yield sample
                elif self.closed:
                    return
                elif self._inbox.enlist(wake):
                    await arrived.wait()
                    arrived.clear()
        finally:
            self._inbox.dismiss(wake)
            self._unwatch()

    @property
    def patient(self) -> bool:
        """Whether callbacks may come late; see :meth:`set_patient`."""
        return self._patient

    def set_patient(self, patient: bool) -> None:
        """Say whether callbacks may come a tenth of a second late, for some samples at a time.

        For callbacks that look at a fast topic now and then: receiving takes a fraction of the time
        where the middleware need not hand on each sample by itself.

        Raises:
            ConversionError: It is neither True nor False.
        """
        check_flag(patient, "patient", self.topic)
        if patient != self._patient:
            self._patient = patient
            self._source.inform()

    def set_inbox_limit(self, limit: int) -> None:
        """Bound the memory of an inbox that keeps all; 256 MiB unless set.

        Beyond it the oldest samples are dropped and counted, and the log says who is too slow. An
        inbox that keeps the last so many is bounded by that.

        Args:
            limit: Bytes; each sample counts with its data and some 500 bytes more.

        Raises:
            ConversionError: It is no number of bytes.
        """
        self._inbox.set_limit(limit)

    def statistics(self) -> Statistics:
        """Return counts and rates as of now."""
        self._source.refresh()
        return self._inbox.statistics(self._source.lost())

    def lateness(self, sample: Sample) -> Duration:
        """Return how much longer a sample took than the fastest of its publisher.

        Zero when nothing is known about that. See :attr:`Statistics.lateness`.

        Raises:
            ConversionError: It is no sample.
        """
        if not isinstance(sample, Sample):
            raise ConversionError("sample", sample, "a rosglass.comm.Sample", self.topic)
        return self._inbox.lateness(sample)

    # -- events ----------------------------------------------------------------------------------

    def on_matched(
        self, callback: Callable[[Matched], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when a publisher comes that matches, and when it goes.

        Those that are there already are told first.

        Args:
            callback: Told who, and how many there are now.
            executor: Where it runs; None for where the subscription's own callbacks run.

        Raises:
            ConversionError: One of the arguments is not what it should be.
        """
        return self._inform(self._events.matched.add(callback, executor or self._executor))

    def on_incompatible_qos(
        self, callback: Callable[[IncompatibleQoS], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when a publisher comes that offers less than was asked for.

        Those that are there already are told first; arguments as for :meth:`on_matched`.
        """
        return self._inform(self._events.incompatible.add(callback, executor or self._executor))

    def on_deadline_missed(
        self, callback: Callable[[DeadlineMissed], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` each time that nothing came within the profile's deadline.

        Time runs from the moment that a publisher matches. Arguments as for :meth:`on_matched`.
        """
        return self._inform(self._events.deadline.add(callback, executor or self._executor))

    def on_liveliness_change(
        self, callback: Callable[[LivelinessChanged], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when a publisher becomes alive, and when it is alive no more.

        A publisher is alive while it is seen; one that promises to show its liveliness itself
        (manual by topic), while it does so in time. Arguments as for :meth:`on_matched`.
        """
        return self._inform(self._events.liveliness.add(callback, executor or self._executor))

    def on_samples_lost(
        self, callback: Callable[[SamplesLost], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when samples were lost on the way; arguments as for :meth:`on_matched`.

        What a full inbox drops is no loss of this kind: :meth:`statistics` counts it.
        """
        return self._inform(self._events.lost.add(callback, executor or self._executor))

    def on_problem_change(
        self, callback: Callable[[str], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with :attr:`problem` whenever it changes; empty when all is well again.

        Arguments as for :meth:`on_matched`.
        """
        return self._inform(self._events.problem.add(callback, executor or self._executor))

    # -- the end ---------------------------------------------------------------------------------

    def close(self) -> None:
        """Stop receiving; waiting samples are forgotten. Safe to call twice, from any thread."""
        if not self._inbox.close():
            return
        self._events.clear()
        if self._on_close is not None:
            self._on_close()

    # -- inside ----------------------------------------------------------------------------------

    @property
    def _watched(self) -> bool:
        """Whether samples are waited for, to be taken or called back with, or were just now."""
        recent = time.monotonic() - self._watched_at < _MEMORY
        return (self._called and not self._patient) or bool(self._waiting) or recent

    def _set_problem(
        self, problem: str, level: int = logging.WARNING, logged: str | None = None
    ) -> None:
        """Take why nothing can be received, and log it once.

        Args:
            problem: Why, in words; empty when all is well.
            level: Of what is logged.
            logged: What of it is logged, where others log the rest; None for all.
        """
        logged = problem if logged is None else logged
        if logged != self._logged:
            self._logged = logged
            if logged:
                _log.log(level, "%s: %s", self.topic, logged)
        if problem != self._problem:
            self._problem = problem
            self._events.problem.notify(problem)

    def _inform(self, handle: Handle) -> Handle:
        self._source.inform()
        return handle

    def _watch(self) -> None:
        self._waiting.append(None)
        self._watched_at = time.monotonic()
        self._source.attend()

    def _unwatch(self) -> None:
        self._watched_at = time.monotonic()
        self._waiting.pop()


def _decoding(callback: Callable[[Message], None]) -> Callable[[Sample], None]:
    @wraps(callback)
    def call(sample: Sample) -> None:
        callback(sample[2].decode(sample[0], sample[1]))  # as message() does, a step sooner

    return call

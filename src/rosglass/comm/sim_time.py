"""Simulated time: the topic ``/clock`` drives a node's clock while the world says so."""

from __future__ import annotations

import threading
from abc import abstractmethod
from typing import TYPE_CHECKING, Any

from rosglass.comm.executor import IMMEDIATE
from rosglass.comm.node import Handle
from rosglass.comm.qos import QoS
from rosglass.errors import Error

if TYPE_CHECKING:
    import logging

    from rosglass.comm.clock import Clock
    from rosglass.comm.node import Node
    from rosglass.comm.sample import Sample
    from rosglass.comm.subscription import Subscription
    from rosglass.comm.time import Time

__all__ = ["ClockFollower"]


class ClockFollower(Handle):
    """Lets a node's clock follow ``/clock``, or the system's time.

    Args:
        node: The node.
        clock: Its clock.
        type_name: The topic's type.
        log: Where failures are told.
    """

    def __init__(self, node: Node, clock: Clock, type_name: str, log: logging.Logger) -> None:
        self._node, self._clock, self._type_name, self._log = node, clock, type_name, log
        self._lock = threading.Lock()
        self._subscription: Subscription | None = None
        self._closed = False

    def close(self) -> None:
        """Follow no longer; the clock keeps its time. Safe to call twice."""
        with self._lock:
            self._closed = True
            subscription, self._subscription = self._subscription, None
        if subscription is not None:
            subscription.close()

    @property
    def following(self) -> bool:
        """Whether the clock follows ``/clock``."""
        return self._subscription is not None

    def follow(self, wanted: bool) -> bool:
        """Follow ``/clock`` from now on, or no longer; return whether it is followed only now."""
        made = None
        with self._lock:
            if self._closed or wanted == self.following:
                return False
            if wanted:
                try:
                    made = self._node.create_subscription(
                        "/clock",
                        self._type_name,
                        qos=QoS.clock(),
                        raw_callback=self._tick,
                        executor=IMMEDIATE,
                    )
                except Error:
                    self._log.exception(
                        "%s: the time of the simulation cannot be followed", self._node
                    )
                    return False
            old, self._subscription = self._subscription, made
        if old is not None:
            old.close()
        # As it is now: another thread may have changed it since.
        self._clock.simulate(self.following)
        return wanted

    def _tick(self, sample: Sample) -> None:
        self._clock.advance(self._time_of(sample.message().clock))

    @abstractmethod
    def _time_of(self, stamp: Any) -> Time:
        """Return the time that a message's stamp means."""

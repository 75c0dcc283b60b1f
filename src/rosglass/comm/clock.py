"""A node's clock, with system or simulated time, and its timers.

Behaviour: design article "Clock and Time", and rclcpp's ``Clock`` and ``TimeSource``: simulated
time is zero until ``/clock`` is received.
"""

from __future__ import annotations

import logging
import threading
import time
from contextlib import suppress
from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm.executor import RetryingExecutor, check_plain
from rosglass.comm.handle import Executor, Handle, Unique, guarded, reraise_exit
from rosglass.comm.listeners import Listeners
from rosglass.comm.log_limits import FailureLog
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.comm.time import Duration, Time
from rosglass.errors import ArgumentError, NodeClosedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.timers import Timers

__all__ = ["Clock", "ClockChange", "Jump", "Timer"]

_log = logging.getLogger("rosglass.comm")
#: Longest uninterrupted wait: on Windows, waiting for a lock blocks Ctrl-C.
_SLICE_S = 0.2
#: How long simulated time may stand still before a sleeping thread logs a warning.
_STILL_S = 5.0


class ClockChange(Enum):
    """The change of a clock's time source in a jump."""

    NONE = "none"
    TO_SIMULATED = "to simulated"
    TO_SYSTEM = "to system"


class Jump(NamedTuple):
    """A discontinuity of a clock.

    Attributes:
        delta: New time minus old time; negative for a jump backwards.
        change: How the time source changed with it.
    """

    delta: Duration
    change: ClockChange


@hint_at_members
class Clock(Unique):
    """The time of a node.

    Args:
        name: The node's name, for messages.
        executor: Runs callbacks that have no executor of their own.
        timers: The node's timers, whose thread posts callbacks to their executors.
    """

    def __init__(self, name: str, executor: Executor, timers: Timers) -> None:
        self._name, self._executor, self._timers = name, executor, timers
        #: Guards all members below, and wakes sleeping threads.
        self._changed = threading.Condition()
        self._simulated = False
        self._time = 0
        self._switches = 0
        self._closed = False
        self._watchers: list[_Watcher] = []
        #: The open timers.
        self._periodic: list[Timer] = []
        #: Fires the next due timers; None without timers, or if only simulated time decides when.
        self._alarm: Handle | None = None

    def __repr__(self) -> str:
        kind = "simulated" if self._simulated else "system"
        return f"<Clock of {self._name}: {kind} time {self.now().seconds:.3f}>"

    @property
    def is_simulated(self) -> bool:
        """True if the time comes from a simulation (``/clock``) instead of the system."""
        return self._simulated

    def now(self) -> Time:
        """Return the time; zero until a simulated clock has received one."""
        return Time(self._time) if self._simulated else Time(time.time_ns())

    def sleep(self, duration: Duration | float) -> bool:
        """Wait until `duration` (seconds, or a Duration) has passed on this clock.

        Keeps waiting while simulated time stands still, and waits again for the time that it jumps
        back.

        Returns:
            True; False if the clock changed between system and simulated time while sleeping.

        Raises:
            NodeClosedError: The node is closed, or is closed while sleeping.
        """
        length = duration if isinstance(duration, Duration) else _seconds("duration", duration)
        with self._changed:
            end, switches = self._tick() + length.nanoseconds, self._switches
        return self._sleep(end, self._tick, switches)

    def sleep_until(self, when: Time) -> bool:
        """Wait until the clock shows `when`; results and errors as for :meth:`sleep`."""
        if not isinstance(when, Time):
            raise ArgumentError("when", when, "a rosglass.Time")
        return self._sleep(when.nanoseconds, lambda: self.now().nanoseconds, self._switches)

    def on_jump(
        self,
        callback: Callable[[Jump], None],
        *,
        forward: Duration | None = None,
        executor: Executor | None = None,
    ) -> Handle:
        """Call `callback` when the clock jumps back, or changes its source.

        Args:
            callback: Called with the :class:`Jump`.
            forward: Also report jumps forward of at least this much; simulated time only.
            executor: Runs `callback`; None for the node's own dispatcher thread.
        """
        if not callable(callback):
            raise ArgumentError("callback", callback, "something that can be called")

        watcher = _Watcher(self._watchers, forward)
        watcher.listeners.add(callback, executor or self._executor)
        self._watchers.append(watcher)
        return watcher

    def create_timer(
        self,
        period: Duration | float,
        callback: Callable[[], None],
        executor: Executor | None = None,
    ) -> Timer:
        """Call `callback` every `period` (seconds, or a Duration) of this clock.

        Ticks are skipped while a call is still waiting or running.

        Raises:
            ArgumentError: The period is not above zero.
            NodeClosedError: The node is closed.
        """
        length = period if isinstance(period, Duration) else _seconds("period", period)
        if length <= Duration():
            raise ArgumentError("period", period, "a time above zero")
        check_plain(callback, "create_timer()")
        if executor is not None and not isinstance(executor, Executor):
            raise ArgumentError("executor", executor, "a rosglass.comm.Executor", "create_timer()")
        timer = Timer(self, length, callback, executor or self._executor)
        with self._changed:
            if self._closed:
                raise NodeClosedError(f"node {self._name} is closed; connect again")
            timer.due = self._tick() + length.nanoseconds
            self._periodic.append(timer)
            self._set_alarm()
        return timer

    def simulate(self, simulated: bool) -> None:
        """Switch between simulated and system time; called by the node."""
        with self._changed:
            if simulated == self._simulated or self._closed:
                return
            before = self.now()
            self._simulated = simulated
            self._time = 0
            self._switches += 1
            delta = self.now() - before
            self._restart()
        change = ClockChange.TO_SIMULATED if simulated else ClockChange.TO_SYSTEM
        self._notify(Jump(delta, change))

    def advance(self, now: Time) -> None:
        """Set the simulated time; called by the node. No effect while system time is used."""
        with self._changed:
            if not self._simulated or self._closed:
                return
            delta = now.nanoseconds - self._time
            self._time = now.nanoseconds
            if delta < 0:
                self._restart()
            else:
                self._set_alarm()
            self._changed.notify_all()
        if self._watchers:
            self._notify(Jump(Duration(delta), ClockChange.NONE))

    def close(self) -> None:
        """End timers and sleeps; safe to call twice."""
        with self._changed:
            self._closed = True
            self._periodic.clear()
            self._set_alarm()
            self._changed.notify_all()
        for watcher in list(self._watchers):
            watcher.close()

    def forget(self, timer: Timer) -> None:
        """Remove a closed timer; called by :class:`Timer`."""
        with self._changed, suppress(ValueError):  # closed twice
            self._periodic.remove(timer)
            self._set_alarm()

    def _notify(self, jump: Jump) -> None:
        for watcher in list(self._watchers):
            watcher.notify(jump)

    def _tick(self) -> int:
        """Return the time that measures intervals, not affected by setting the system clock."""
        return self._time if self._simulated else time.monotonic_ns()

    def _sleep(self, end: int, read: Callable[[], int], switches: int) -> bool:
        shown, warned = self._time, False
        still_at = time.monotonic() + _STILL_S
        while True:
            with self._changed:
                if self._closed:
                    raise NodeClosedError(
                        f"node {self._name} was closed while its clock was waited for"
                    )
                if self._switches != switches:
                    return False
                rest = end - read()
                if rest <= 0:
                    return True
                if self._time != shown:
                    shown, still_at = self._time, time.monotonic() + _STILL_S
                still = self._simulated and not warned and time.monotonic() > still_at
                if not still:
                    self._changed.wait(_SLICE_S if self._simulated else min(rest / 1e9, _SLICE_S))
            if still:  # without the lock: log handlers are the user's, and may use the clock
                warned = True
                _log.warning(
                    "%s sleeps by simulated time, which stands at %.3f s: is /clock published?",
                    self._name,
                    shown / 1e9,
                )

    def _restart(self) -> None:
        """Restart the timers' periods, after their due times became meaningless."""
        now = self._tick()
        for timer in self._periodic:
            timer.due = now + timer.period.nanoseconds
        self._set_alarm()
        self._changed.notify_all()

    def _set_alarm(self) -> None:
        """Schedule the next due timers; the lock is held."""
        if self._alarm is not None:
            self._alarm.close()
            self._alarm = None
        if not self._periodic:
            return
        left = (min(timer.due for timer in self._periodic) - self._tick()) / 1e9
        if left <= 0 or not self._simulated:  # otherwise advance() fires them
            self._alarm = self._timers.after(max(0.0, left), self._fire_due)

    def _fire_due(self) -> None:
        """Fire the due timers in order of their due times; run on the timers' thread."""
        with self._changed:
            now = self._tick()
            due = sorted((t for t in self._periodic if t.due <= now), key=lambda timer: timer.due)
            for timer in due:
                # Missed ticks are skipped.
                timer.due += timer.period.nanoseconds * (
                    (now - timer.due) // timer.period.nanoseconds + 1
                )
            self._set_alarm()
        for timer in due:
            with guarded(_log, "%s failed", timer):
                timer.fire()


class _Watcher(Handle):
    """Notifies one callback of the jumps that it was registered for."""

    def __init__(self, watchers: list[_Watcher], forward: Duration | None) -> None:
        self.listeners: Listeners[Jump] = Listeners()
        self._watchers, self._forward = watchers, forward

    def notify(self, jump: Jump) -> None:
        jumped = jump.delta < Duration() or jump.change is not ClockChange.NONE
        if jumped or (self._forward is not None and jump.delta >= self._forward):
            self.listeners.notify(jump)

    def close(self) -> None:
        with suppress(ValueError):  # closed twice
            self._watchers.remove(self)
        self.listeners.clear()


@hint_at_members
class Timer(Handle):
    """Calls back periodically; created by :meth:`Node.create_timer`.

    Attributes:
        period: Time between two calls.
        due: When to call next, in nanoseconds of the clock's interval time.
    """

    due = 0

    def __init__(
        self, clock: Clock, period: Duration, callback: Callable[[], None], executor: Executor
    ) -> None:
        self.period = period
        self._closed = False
        self._clock, self._callback = clock, callback
        self._executor = RetryingExecutor(executor, repr(self))
        self._waiting = False
        self._failures = FailureLog(_log)

    def __repr__(self) -> str:
        return f"<Timer every {self.period.seconds} s{' closed' * self._closed}>"

    def fire(self) -> None:
        """Post the callback, unless the previous call is still waiting or running."""
        if not self._waiting:
            self._waiting = True
            self._executor.post(self._run)

    def close(self) -> None:
        """Stop calling back; safe to call twice, from any thread and from the callback."""
        if not self._closed:
            self._closed = True
            self._executor.close()
            self._clock.forget(self)

    def _run(self) -> None:
        try:
            if not self._closed:
                self._callback()
        except (Exception, SystemExit) as error:  # noqa: BLE001 - a user's callback
            reraise_exit(error)
            self._failures.exception("the callback of %s failed", self)
        finally:
            self._waiting = False


def _seconds(what: str, value: object) -> Duration:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e9:
        raise ArgumentError(what, value, "seconds or a rosglass.Duration")
    return Duration.from_seconds(value)

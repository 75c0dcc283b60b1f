"""The clock of a node: the system's time, or a simulation's.

Behaviour: design article "Clock and Time", and rclcpp's ``Clock`` and ``TimeSource``: a node whose
time is simulated but was not told yet lives at time zero.
"""

from __future__ import annotations

import logging
import threading
import time
from contextlib import suppress
from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm.executor import RetryingExecutor, check_plain, let_exit
from rosglass.comm.handle import Executor, Handle, Unique
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
#: Longest uninterrupted wait in seconds: on Windows a lock that is waited for holds up Ctrl-C.
_SLICE_S = 0.2
#: Seconds that simulated time may stand still before those who sleep by it are warned.
_STILL_S = 5.0


class ClockChange(Enum):
    """What happened to the source of a clock's time when it jumped."""

    NONE = "none"
    TO_SIMULATED = "to simulated"
    TO_SYSTEM = "to system"


class Jump(NamedTuple):
    """A clock that did not just move on.

    Attributes:
        delta: The new time less the old one; negative for a jump backwards.
        change: Whether the source of the time changed, too.
    """

    delta: Duration
    change: ClockChange


@hint_at_members
class Clock(Unique):
    """What time it is for a node.

    Args:
        name: Of the node, for threads and messages.
        executor: Where callbacks run that bring no executor of their own.
        timers: The node's, on whose thread callbacks are posted to their executors.
    """

    def __init__(self, name: str, executor: Executor, timers: Timers) -> None:
        self._name, self._executor, self._timers = name, executor, timers
        self._changed = threading.Condition()
        self._simulated = False
        self._time = 0
        self._switches = 0
        self._closed = False
        self._watchers: list[_Watcher] = []
        #: The timers in use, few at a time; changed with the lock.
        self._periodic: list[Timer] = []
        #: Fires what is due; None while nothing is, or only the simulation's time can tell.
        self._alarm: Handle | None = None

    def __repr__(self) -> str:
        kind = "simulated" if self._simulated else "system"
        return f"<Clock of {self._name}: {kind} time {self.now().seconds:.3f}>"

    @property
    def is_simulated(self) -> bool:
        """Whether the time comes from a simulation (``/clock``) instead of the system."""
        return self._simulated

    def now(self) -> Time:
        """Return the time; zero while a simulated clock was not told any yet."""
        return Time(self._time) if self._simulated else Time(time.time_ns())

    def sleep(self, duration: Duration | float) -> bool:
        """Wait until `duration` (seconds, or a Duration) has passed on this clock.

        A simulation that stands still is waited for; one that jumps back is waited for again.

        Returns:
            True; False when the clock changed between system and simulated time meanwhile.

        Raises:
            NodeClosedError: The node is closed, or gets closed meanwhile.
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
            forward: Tell jumps forward of at least this much, too; simulated time only.
            executor: Where `callback` runs; None for the node's own dispatcher thread.
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

        A callback that is still running or waiting when its time comes again misses that turn.

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
        """Take the time from a simulation, or from the system; for worlds."""
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
        self._tell(Jump(delta, change))

    def advance(self, now: Time) -> None:
        """Set the simulated time; for worlds. Without effect while the system's time is used."""
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
            self._tell(Jump(Duration(delta), ClockChange.NONE))

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
        """Let go of a timer that was closed; for :class:`Timer`."""
        with self._changed, suppress(ValueError):
            self._periodic.remove(timer)
            self._set_alarm()

    def _tell(self, jump: Jump) -> None:
        for watcher in list(self._watchers):
            watcher.tell(jump)

    def _tick(self) -> int:
        """Return what intervals are measured with: a system clock that is set does not count."""
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
            if still:  # handlers of the log are the user's, and may use the clock
                warned = True
                _log.warning(
                    "%s sleeps by simulated time, which stands at %.3f s: is /clock published?",
                    self._name,
                    shown / 1e9,
                )

    def _restart(self) -> None:
        """Count the timers' periods from now on: the old times mean nothing any more."""
        now = self._tick()
        for timer in self._periodic:
            timer.due = now + timer.period.nanoseconds
        self._set_alarm()
        self._changed.notify_all()

    def _set_alarm(self) -> None:
        """Let the timers that are due next be fired in time; the lock is held."""
        if self._alarm is not None:
            self._alarm.close()
            self._alarm = None
        if not self._periodic:
            return
        left = (min(timer.due for timer in self._periodic) - self._tick()) / 1e9
        if left <= 0 or not self._simulated:  # else, the simulation's time has to move first
            self._alarm = self._timers.after(max(0.0, left), self._fire_due)

    def _fire_due(self) -> None:
        """Fire the timers that are due, in their order; run on the timers' thread."""
        with self._changed:
            now = self._tick()
            due = sorted((t for t in self._periodic if t.due <= now), key=lambda timer: timer.due)
            for timer in due:
                # Turns that were missed are not made up for.
                timer.due += timer.period.nanoseconds * (
                    (now - timer.due) // timer.period.nanoseconds + 1
                )
            self._set_alarm()
        for timer in due:
            try:
                timer.fire()
            except BaseException:  # noqa: PERF203 - sys.exit() must not end the others
                _log.exception("%s asked to end its thread, which goes on", timer)


class _Watcher(Handle):
    """Passes on the jumps that one callback wants to know of."""

    def __init__(self, watchers: list[_Watcher], forward: Duration | None) -> None:
        self.listeners: Listeners[Jump] = Listeners()
        self._watchers, self._forward = watchers, forward

    def tell(self, jump: Jump) -> None:
        wanted = jump.delta < Duration() or jump.change is not ClockChange.NONE
        if wanted or (self._forward is not None and jump.delta >= self._forward):
            self.listeners.notify(jump)

    def close(self) -> None:
        with suppress(ValueError):
            self._watchers.remove(self)
        self.listeners.clear()


@hint_at_members
class Timer(Handle):
    """Calls back again and again; made by :meth:`Node.create_timer`.

    Attributes:
        period: Time between two calls.
        due: When to call next, in nanoseconds of what the clock measures intervals with.
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
        """Post the callback, unless it is still waiting or running from the last time."""
        if not self._waiting:
            self._waiting = True
            self._executor.post(self._run)

    def close(self) -> None:
        """Call back no more; safe to call twice, from any thread and from the callback."""
        if not self._closed:
            self._closed = True
            self._executor.close()
            self._clock.forget(self)

    def _run(self) -> None:
        try:
            if not self._closed:
                self._callback()
        except (Exception, SystemExit) as error:
            let_exit(error)
            self._failures.exception("the callback of %s failed", self)
        finally:
            self._waiting = False


def _seconds(what: str, value: object) -> Duration:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e9:
        raise ArgumentError(what, value, "seconds or a rosglass.Duration")
    return Duration.from_seconds(value)

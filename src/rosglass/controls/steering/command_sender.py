"""The thread that sends a robot's velocity commands, and stops it when they are no longer fresh.

It does not need Qt: a screen that is frozen cannot keep it from stopping the robot.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.handle import Handle, guarded
from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.publisher import Publisher

__all__ = ["FRESH_S", "CommandSender", "Limits", "Velocity"]

_log = logging.getLogger("rosglass.controls")
#: Seconds after which a command without another one is no longer fresh, and the robot is halted.
FRESH_S = 0.15
#: Seconds between two messages: while nothing changes, during a ramp, and at least.
_PERIOD_S, _RAMP_PERIOD_S, _SHORTEST_S = 0.05, 0.02, 0.01
#: Zeros of a halt that are sent whatever happens, and the seconds between them.
_ZEROS, _ZERO_GAP_S = 3, 0.02
#: Further zeros follow for so long that an outage is noticed, in which the first ones were lost.
_ZERO_PERIOD_S, _ZERO_PHASE_S = 0.1, 1.0
#: Seconds after a halt until which zeros are sent again, while the robot is not connected.
_LONGEST_OUTAGE_S = 60.0
#: Change of the system's clock in seconds that halts: stamps before and after it do not compare.
_CLOCK_STEP_S = 0.15
#: Seconds that closing waits for the last zeros.
_CLOSE_TIMEOUT_S = 1.0


class Velocity(NamedTuple):
    """A velocity: m/s forward and to the left, and rad/s to the left.

    For types of ackermann_msgs, `turn` is the steering angle in rad.
    """

    forward: float = 0.0
    sideways: float = 0.0
    turn: float = 0.0


class Limits(NamedTuple):
    """Limits of what is sent; a rate of 0 stands for none.

    Attributes:
        fastest: The velocity at full deflection.
        acceleration: Largest increase of speed, in m/s².
        deceleration: Largest decrease of speed while held, in m/s².
        turn_acceleration: Largest change of the turn, in rad/s².
    """

    fastest: Velocity = Velocity()
    acceleration: float = 0.0
    deceleration: float = 0.0
    turn_acceleration: float = 0.0


def _steady_clock() -> Callable[[], float]:
    """Return a clock in seconds that goes on while the machine sleeps, if the system has one."""
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    if boot is None:
        return time.monotonic
    return lambda: time.clock_gettime(boot)


class CommandSender(Handle):
    """Sends velocities on one topic while they are held; zeros when they no longer are.

    :meth:`begin`, :meth:`steer` and :meth:`halt` return at once. While held, the newest command is
    repeated, 20 times a second, until there has been none for :data:`FRESH_S`; then it halts by
    itself. A halt ignores the ramps: it sends at least three zeros, 20 ms apart, and some more for
    a second, or until a lost connection is back. After that nothing is sent.

    Args:
        publisher: The publisher; closed with this.
        compose: Returns the message of a velocity in a frame; called on this object's thread.
        on_halt: Called on this object's thread with the reason when it has halted by itself.

    Attributes:
        limits: The limits; to be set before the first command.
        frame: The frame of messages with a header.
        connected: Whether the robot is connected, as far as the session knows.
        velocity: The velocity sent last.
        problem: Why the last message could not be sent; empty if it could.
    """

    def __init__(
        self,
        publisher: Publisher,
        compose: Callable[[Velocity, str], dict[str, Any]],
        on_halt: Callable[[str], None],
    ) -> None:
        self.publisher, self._compose, self._on_halt = publisher, compose, on_halt
        self.limits, self.frame, self.connected = Limits(), "", True
        self.velocity, self.problem = Velocity(), ""
        self._clock = _steady_clock()
        self._changed = threading.Condition()
        self._held = self._closing = False
        #: Why it has halted by itself since the last :meth:`begin`.
        self._ended = self._unreported = ""
        self._target = Velocity()
        self._is_new = False
        self._fresh_at = self._sent_at = self._wall_offset = 0.0
        #: When the next zero is due; None if none is.
        self._zero_at: float | None = None
        #: Zeros sent since it was halted, when that was, and since when the zeros arrive.
        self._zeros, self._halted_at, self._phase_at = 0, 0.0, 0.0
        self._lost = 0
        self._had_subscriber = False
        self._thread = threading.Thread(
            target=self._run, name=f"commands {publisher.topic}", daemon=True
        )
        self._thread.start()

    # -- any thread ------------------------------------------------------------------------------

    def begin(self, forward: float, left: float, sideways: float) -> None:
        """Start to send; arguments as for :meth:`steer`."""
        subscribers = self._subscribers()
        with self._changed:
            now = self._clock()
            self._held, self._ended, self._zero_at = not self._closing, "", None
            self._wall_offset, self._had_subscriber = time.time() - now, subscribers > 0
            self.velocity, self._sent_at = Velocity(), now - _PERIOD_S
            self._set(forward, left, sideways, now)

    def steer(self, forward: float, left: float, sideways: float) -> str:
        """Set the deflection, each from -1 to 1, again within :data:`FRESH_S`.

        Returns:
            Why it has halted since :meth:`begin`; empty if it has not.
        """
        with self._changed:
            now = self._clock()
            if self._held:
                self._halt_if_stale(now)
            if self._held:
                self._set(forward, left, sideways, now)
            return self._ended

    @property
    def ended(self) -> str:
        """Why it has halted by itself since :meth:`begin`; empty if it has not."""
        return self._ended

    def halt(self) -> None:
        """Send zeros, if anything was sent that they must follow."""
        with self._changed:
            if self._held:
                self._stop(self._clock())

    def end_zeros(self) -> None:
        """Send no more than the first zeros: another sender steers the robot now."""
        with self._changed:
            self._halted_at = -math.inf
            if not self._held and self._zeros >= _ZEROS:
                self._zero_at = None
            self._changed.notify()

    def close(self) -> None:
        """Halt, wait for three zeros, and withdraw the publisher; safe to call twice."""
        with self._changed:
            if self._held:
                self._stop(self._clock())
            self._closing = True
            self._changed.notify()
        if threading.current_thread() is not self._thread:
            self._thread.join(_CLOSE_TIMEOUT_S)
        self.publisher.close()

    # -- with the lock ---------------------------------------------------------------------------

    def _set(self, forward: float, left: float, sideways: float, now: float) -> None:
        fastest = self.limits.fastest
        target = Velocity(
            fastest.forward * forward, fastest.sideways * sideways, fastest.turn * left
        )
        self._fresh_at = now
        if target != self._target or self.velocity != target:
            self._target, self._is_new = target, True
        self._changed.notify()

    def _stop(self, now: float, reason: str = "") -> None:
        self._held, self._ended, self._unreported = False, reason, reason
        self.velocity = self._target = Velocity()
        self._zeros, self._zero_at = 0, now
        self._halted_at = self._phase_at = now
        self._changed.notify()

    def _halt_if_stale(self, now: float) -> None:
        """Halt if there was no command for too long, or the system's clock was changed."""
        if now - self._fresh_at >= FRESH_S:
            self._stop(now, f"no command for {FRESH_S * 1000:.0f} ms")
            return
        wall = time.time()
        # The thread may have been interrupted between the clocks.
        if self._clock() - now < _CLOCK_STEP_S / 3:
            step = wall - now - self._wall_offset
            if abs(step) > _CLOCK_STEP_S:
                self._stop(now, f"the system's clock was changed by {step:+.1f} s")

    def _due(self) -> float | None:
        """Return when the next message is due; None if none is."""
        if not self._held:
            return None if self._closing and self._zeros >= _ZEROS else self._zero_at
        ramps = self.velocity != self._target
        gap = _SHORTEST_S if self._is_new else _RAMP_PERIOD_S if ramps else _PERIOD_S
        return self._sent_at + gap

    def _advance(self, now: float) -> Velocity:
        """Return the velocity to send now, and set what follows it."""
        if self._held:
            # After a pause, a ramp goes on where it was.
            passed = min(now - self._sent_at, _PERIOD_S)
            limits, before, target = self.limits, self.velocity, self._target
            up, down, turn = limits.acceleration, limits.deceleration, limits.turn_acceleration
            self.velocity = Velocity(
                _approach(before.forward, target.forward, up * passed, down * passed),
                _approach(before.sideways, target.sideways, up * passed, down * passed),
                _approach(before.turn, target.turn, turn * passed, turn * passed),
            )
            self._sent_at, self._is_new = now, False
            return self.velocity
        self._zeros += 1
        over = now - self._phase_at >= _ZERO_PHASE_S or now - self._halted_at >= _LONGEST_OUTAGE_S
        if self._zeros < _ZEROS:
            self._zero_at = now + _ZERO_GAP_S
        else:
            self._zero_at = None if over else now + _ZERO_PERIOD_S
        return Velocity()

    # -- the thread ------------------------------------------------------------------------------

    def _run(self) -> None:
        while True:
            arrives = self._zero_at is None or self._arrives()
            with self._changed:
                now = self._clock()
                if not arrives:  # a zero was dropped, perhaps long before the next one is due
                    self._phase_at = now
                if self._held:
                    self._halt_if_stale(now)
                due = self._due()
                if due is None and self._closing:
                    return
                if due is None or due > now:
                    if self._held:
                        due = min(due or 0.0, self._fresh_at + FRESH_S)
                    self._changed.wait(None if due is None else max(0.0, due - now))
                    continue
                velocity = self._advance(now)
            self._send(velocity, now)
            with self._changed:
                reason, self._unreported = self._unreported, ""
            if reason:
                with guarded(_log, "%s: a callback failed", self.publisher.topic):
                    self._on_halt(reason)

    def _send(self, velocity: Velocity, decided_at: float) -> None:
        with guarded(_log, "internal error: no command was sent on %s", self.publisher.topic):
            try:
                message = self._compose(velocity, self.frame)
                # This thread or the process may have stood still since then.
                if not any(velocity) or self._clock() - decided_at < FRESH_S:
                    self.publisher.publish(message)
                self.problem = ""
            except Error as error:
                self.problem = str(error)

    def _arrives(self) -> bool:
        """Return whether messages reach the robot now, as far as this machine knows."""
        before, self._lost = self._lost, self.publisher.dropped
        gone = self._had_subscriber and not self._subscribers()
        return self.connected and self._lost == before and not gone

    def _subscribers(self) -> int:
        with suppress(Error):  # the node is closed
            return self.publisher.subscription_count()
        return 0


def _approach(value: float, target: float, up: float, down: float) -> float:
    """Return `value` moved towards `target`, by at most `up` away from zero or `down` to it.

    A limit of 0 does not apply.
    """
    if value * target < 0:  # to zero first, by the limit of that
        value, target = (value, 0.0) if down else (0.0, target)
    most = up if abs(target) > abs(value) else down
    step = target - value
    return target if not most or abs(step) <= most else value + (most if step > 0 else -most)

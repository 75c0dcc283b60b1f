"""Points in time and durations with nanosecond accuracy."""

from __future__ import annotations

import time as _time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, overload

from rosglass.comm.rclpy_names import hint_at_members
from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    from rosglass.messages.message import Stamp

__all__ = ["Duration", "Time"]

_NS = 1_000_000_000


def _check(kind: str, nanoseconds: object, instead: str) -> None:
    if type(nanoseconds) is not int:
        raise ArgumentError("nanoseconds", nanoseconds, f"an integer; {instead}", kind)


@hint_at_members
@dataclass(frozen=True, slots=True, order=True)
class Duration:
    """A span of time.

    Attributes:
        nanoseconds: Length in nanoseconds; may be negative.
    """

    nanoseconds: int = 0

    def __post_init__(self) -> None:
        _check("Duration", self.nanoseconds, "Duration.from_seconds() takes fractions")

    @classmethod
    def from_seconds(cls, seconds: float) -> Duration:
        """Return the duration nearest to `seconds`; raises ArgumentError unless it is finite."""
        try:
            return cls(round(seconds * _NS))
        except (TypeError, ValueError, OverflowError):
            expected = "a finite number of seconds"
            raise ArgumentError("seconds", seconds, expected, "Duration.from_seconds()") from None

    @property
    def seconds(self) -> float:
        """Length in seconds."""
        return self.nanoseconds / _NS

    def __add__(self, other: Duration) -> Duration:
        if not isinstance(other, Duration):
            return NotImplemented
        return Duration(self.nanoseconds + other.nanoseconds)

    def __sub__(self, other: Duration) -> Duration:
        if not isinstance(other, Duration):
            return NotImplemented
        return Duration(self.nanoseconds - other.nanoseconds)

    def __neg__(self) -> Duration:
        return Duration(-self.nanoseconds)


@hint_at_members
@dataclass(frozen=True, slots=True, order=True)
class Time:
    """A point in time.

    Attributes:
        nanoseconds: Nanoseconds since the epoch of the clock it was read from
            (the Unix epoch unless a simulated clock is in use).
    """

    nanoseconds: int = 0

    def __post_init__(self) -> None:
        _check("Time", self.nanoseconds, "Time.from_parts() takes seconds and nanoseconds")

    @classmethod
    def now(cls) -> Time:
        """Return the system clock's time."""
        return cls(_time.time_ns())

    @classmethod
    def from_parts(cls, sec: int, nanosec: int) -> Time:
        """Return the time of a ROS message's seconds and nanoseconds."""
        return cls(sec * _NS + nanosec)

    @property
    def sec(self) -> int:
        """Whole seconds, rounded towards minus infinity."""
        return self.nanoseconds // _NS

    @property
    def nanosec(self) -> int:
        """Nanoseconds beyond :attr:`sec`, 0 to 999,999,999."""
        return self.nanoseconds % _NS

    @property
    def seconds(self) -> float:
        """Seconds since the epoch; a float loses accuracy below a microsecond."""
        return self.nanoseconds / _NS

    def to_dict(self) -> dict[str, int]:
        """Return the value of a ``builtin_interfaces/msg/Time`` field."""
        return {"sec": self.sec, "nanosec": self.nanosec}

    def __add__(self, other: Duration | Stamp) -> Time:
        span = _from_field(other)
        if not isinstance(span, Duration):
            return NotImplemented
        return Time(self.nanoseconds + span.nanoseconds)

    @overload
    def __sub__(self, other: Time) -> Duration: ...

    @overload
    def __sub__(self, other: Duration) -> Time: ...

    @overload
    def __sub__(self, other: Stamp) -> Any: ...

    def __sub__(self, other: Time | Duration | Stamp) -> Any:
        value = _from_field(other)
        if isinstance(value, Time):
            return Duration(self.nanoseconds - value.nanoseconds)
        if isinstance(value, Duration):
            return Time(self.nanoseconds - value.nanoseconds)
        return NotImplemented

    def __rsub__(self, other: Stamp) -> Duration:
        when = _from_field(other)
        if not isinstance(when, Time):
            return NotImplemented
        return Duration(when.nanoseconds - self.nanoseconds)


def _from_field(value: object) -> object:
    """Return the Time or Duration of a message's field; other objects unchanged."""
    if isinstance(value, (Time, Duration)):
        return value
    from rosglass.messages.message import Stamp  # noqa: PLC0415 - QML files need none so early

    if not isinstance(value, Stamp):
        return value
    return (Duration if value.is_duration else Time)(value.nanoseconds)

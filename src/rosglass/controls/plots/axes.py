"""The axes of a plot: their ranges, and the numbers beside them."""

from __future__ import annotations

import math
import time

__all__ = ["Axis", "clock_text", "number_text", "time_ticks"]

#: Greatest amount on an axis; beyond, differences overflow.
_MAX = 1e300
#: Pixels between two numbers on an axis, and the share of its range that data must fill before it
#: shrinks, after as many seconds.
_TICK_PX = 50.0
_MIN_FILLED, _SHRINK_AFTER_S = 0.4, 2.0
#: Steps of the time axis in seconds; below a second 1, 2, 5 of a power of ten.
_TIME_STEPS = (
    1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 21600, 43200, 86400,
)  # fmt: skip
#: Seconds since the epoch from which a time is a date (2001), not that of a simulation.
_DATE_S = 1e9


class Axis:
    """The range of values of an axis.

    Attributes:
        low: Lower end; its logarithm on a logarithmic axis.
        high: Upper end.
        given: Ends that the user has set; NaN where the data decides.
        logarithmic: Whether distances are those of logarithms.
    """

    def __init__(self) -> None:
        self.low, self.high = 0.0, 1.0
        self.given = (math.nan, math.nan)
        self.logarithmic = False
        self._wide_since: float | None = None
        #: Whether the range is still that of no or other data.
        self._is_fresh = True

    def fit(self, low: float, high: float, height: float, now: float) -> bool:
        """Adapt the range to data; return whether it has changed.

        Args:
            low: Least finite value shown; more than `high` without one. On a logarithmic axis, the
                least one above 0.
            high: Greatest one.
            height: Length of the axis in pixels.
            now: Monotonic time in seconds.
        """
        before = self.low, self.high
        if low <= high:
            self._fit(self._position(low), self._position(high), height, now)
        ends = [self._position(end) if self._is_valid(end) else math.nan for end in self.given]
        if not math.isnan(ends[0]):
            self.low = ends[0]
        if not math.isnan(ends[1]):
            self.high = ends[1]
        if not self.low < self.high:
            self.high = self.low + max(1.0, abs(self.low) * 1e-6)
            if not math.isnan(ends[1]) and math.isnan(ends[0]):
                self.low, self.high = ends[1] - max(1.0, abs(ends[1]) * 1e-6), ends[1]
        return before != (self.low, self.high)

    def value(self, share: float) -> float:
        """Return the value at a share of the axis, 0 at its lower end."""
        at = self.low + (self.high - self.low) * share
        return 10 ** min(at, 300.0) if self.logarithmic else at

    def ticks(self, height: float) -> list[tuple[float, str]]:
        """Return the numbers beside the axis: the share at which each is, and its text."""
        span = self.high - self.low
        if self.logarithmic and span >= 2:
            step = max(1.0, math.ceil(span / max(2.0, height / _TICK_PX)))
        else:
            step = nice_step(span / max(2.0, height / _TICK_PX))
        first = math.ceil(self.low / step - 1e-9)
        last = math.floor(self.high / step + 1e-9)
        found = []
        for number in range(first, min(last, first + 100) + 1):
            at = number * step
            text = number_text(10**at, 0.0) if self.logarithmic else number_text(at, step)
            found.append(((at - self.low) / span, text))
        return found

    def _position(self, value: float) -> float:
        if self.logarithmic:
            return math.log10(min(max(value, 1e-300), _MAX))
        return min(max(value, -_MAX), _MAX)

    def _is_valid(self, end: float) -> bool:
        return not math.isnan(end) and not (self.logarithmic and end <= 0)

    def _fit(self, low: float, high: float, height: float, now: float) -> None:
        margin = 0.0 if low < high else max(abs(low) * 0.1, 1e-6 if low else 1.0)
        wanted_low, wanted_high = low - margin, high + margin
        step = nice_step((wanted_high - wanted_low) / max(2.0, height / _TICK_PX))
        wanted_low = math.floor(wanted_low / step + 1e-9) * step
        wanted_high = math.ceil(wanted_high / step - 1e-9) * step
        inside = self.low <= low and high <= self.high and not self._is_fresh
        filled = (wanted_high - wanted_low) / max(self.high - self.low, 1e-300)
        if inside and filled >= _MIN_FILLED:
            self._wide_since = None
            return
        if inside:
            # The data may come back: a range that follows each swing cannot be read.
            self._wide_since = now if self._wide_since is None else self._wide_since
            if now - self._wide_since < _SHRINK_AFTER_S:
                return
        self._wide_since, self._is_fresh = None, False
        self.low, self.high = wanted_low, wanted_high

    def forget(self) -> None:
        """Adapt to the next data at once, as it is other data."""
        self.low, self.high = 0.0, 1.0
        self._wide_since, self._is_fresh = None, True


def nice_step(least: float) -> float:
    """Return the least number of 1, 2 or 5 times a power of ten that is not below another one."""
    if not 0 < least < math.inf:
        return 1.0
    power = 10.0 ** math.floor(math.log10(least))
    if not power:
        return 1e-300
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least * (1 - 1e-9))


def number_text(value: float, step: float = 0.0) -> str:
    """Return a number as it is written beside an axis with such steps; 0 for any number."""
    if not math.isfinite(value):
        return "NaN" if math.isnan(value) else ("∞" if value > 0 else "-∞")
    if value == 0:
        return "0"
    size = abs(value)
    if step and step >= 1e-5 and size < 1e7:
        text = f"{value:.{max(0, -math.floor(math.log10(step) + 1e-9))}f}"
    elif 1e-4 <= size < 1e7:
        text = f"{value:.6g}"
    else:
        text = f"{value:.4g}"
    return text


def time_ticks(
    start: float, length: float, width: float, *, relative: bool
) -> list[tuple[float, str]]:
    """Return the times below a plot: the share at which each is, and its text.

    Args:
        start: Seconds at the left end.
        length: Seconds from there to the right end.
        width: Pixels.
        relative: Whether times are counted backwards from the right end.
    """
    least = length / max(1.0, width / (2 * _TICK_PX))
    step = nice_step(least) if least <= 1 else 0.0
    step = step or next(
        (one for one in _TIME_STEPS if one >= least), nice_step(least / 86400) * 86400
    )
    begin = -length if relative else start
    number = math.ceil(begin / step - 1e-9)
    found: list[tuple[float, str]] = []
    while number * step <= begin + length * (1 + 1e-9) and len(found) < 100:
        at = number * step
        text = _ago(at, step) if relative else clock_text(at, step)
        found.append(((at - begin) / length, text))
        number += 1
    return found


def _ago(at: float, step: float) -> str:
    if abs(at) < step / 2:
        return "0 s"
    if step >= 3600:
        return f"{number_text(at / 3600, step / 3600)} h"
    if step >= 60:
        return f"{number_text(at / 60, step / 60)} min"
    return f"{number_text(at, step)} s"


def clock_text(seconds: float, step: float = 0.001) -> str:
    """Return a time of day in this machine's zone; seconds for times of a simulation."""
    digits = max(0, min(9, -math.floor(math.log10(step) + 1e-9))) if step < 1 else 0
    if not _DATE_S <= seconds < 1e11:
        return f"{number_text(round(seconds, digits), min(step, 1.0))} s"
    whole = math.floor(seconds)
    part = round((seconds - whole) * 10**digits)
    if part >= 10**digits:
        whole, part = whole + 1, 0
    text = time.strftime("%H:%M:%S" if step < 60 else "%H:%M", time.localtime(whole))
    return f"{text}.{part:0{digits}d}" if digits else text

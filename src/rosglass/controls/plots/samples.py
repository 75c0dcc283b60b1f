"""The samples of one plotted line, and their extremes in each column of pixels.

Samples are kept in blocks, so that old ones are dropped without moving the others. Each block has
the least and greatest value of every 16, 64, 256 ... samples, so that a view of hours costs what
its columns cost: a spike of one sample is seen at any zoom.
"""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Times = NDArray[np.int64]
    Values = NDArray[np.float64]

__all__ = ["BLOCK_SIZE", "MAX_RUNS", "Columns", "Samples"]

#: Samples in a full block, and in a new one, which doubles until it is full.
BLOCK_SIZE, _FIRST_SIZE = 65_536, 256
#: Samples in a chunk of each level, the smallest first.
_LEVELS = (16, 64, 256, 1024, 4096)
_GROUP = _LEVELS[-1]
#: A level serves if a column has this many of its chunks: they are assigned to a column as a whole,
#: which moves none by more than half a column.
_MIN_CHUNKS = 2
#: Nanoseconds by which a time may be before the newest one to be a late sample; beyond, time itself
#: has gone back (a simulation was reset, a recording began again).
_MAX_LATE_NS = 2_000_000_000
#: Runs that are kept: stretches between which time went back.
MAX_RUNS = 16
#: Pauses between samples whose median is the usual one, and the least gap in nanoseconds.
_RECENT_PAUSES, _MIN_GAP_NS = 32, 1_000_000_000
#: Times the usual pause that count as silence.
_PAUSES = 5
#: Times that samples can have: half of int64, so that differences fit.
_MAX_TIME = 1 << 62


class _Block:
    """Up to 65,536 samples in the order of their times."""

    def __init__(self) -> None:
        self.times: Times = np.empty(_FIRST_SIZE, np.int64)
        self.values: Values = np.empty(_FIRST_SIZE, np.float64)
        self.count = 0
        #: Samples that the levels cover, and for each level the least and greatest values.
        self.covered = 0
        self.levels: list[tuple[Values, Values]] = []

    @property
    def nbytes(self) -> int:
        """Bytes of its arrays."""
        extra = sum(low.nbytes + high.nbytes for low, high in self.levels)
        return self.times.nbytes + self.values.nbytes + extra

    def add(self, times: Times, values: Values) -> int:
        """Append as many samples as it has room for; return how many."""
        count = min(len(times), BLOCK_SIZE - self.count)
        end = self.count + count
        size = len(self.times)
        if end > size:
            while size < end:
                size *= 2
            self.times, self.values = _grown(self.times, size), _grown(self.values, size)
        self.times[self.count : end] = times[:count]
        self.values[self.count : end] = values[:count]
        self.count = end
        while self.covered + _GROUP <= end:
            self._cover()
        return count

    def cut(self, count: int) -> None:
        """Drop all but the first `count` samples."""
        self.count = count
        self.covered = min(self.covered, count // _GROUP * _GROUP)

    def _cover(self) -> None:
        """Add the extremes of the next 4096 samples to the levels."""
        if not self.levels:
            sizes = [BLOCK_SIZE // size for size in _LEVELS]
            self.levels = [(np.empty(size), np.empty(size)) for size in sizes]
        start = self.covered
        low = high = self.values[start : start + _GROUP]
        for size, (lows, highs) in zip(_LEVELS, self.levels, strict=True):
            shape = _GROUP // size, -1
            low = np.fmin.reduce(low.reshape(shape), axis=1)
            high = np.fmax.reduce(high.reshape(shape), axis=1)
            place = start // size
            lows[place : place + len(low)], highs[place : place + len(low)] = low, high
        self.covered = start + _GROUP

    def parts(self, first: int, end: int, most: float) -> Iterator[tuple[Times, Values, Values]]:
        """Yield times, least and greatest values of samples or chunks from `first` to `end`.

        Args:
            first: Index of the first sample.
            end: Index after the last one.
            most: Samples that a chunk may have.
        """
        level = sum(size <= most for size in _LEVELS) - 1
        if level < 0 or not self.levels:
            yield self.times[first:end], self.values[first:end], self.values[first:end]
            return
        size = _LEVELS[level]
        start, stop = -(-first // size), min(end, self.covered) // size
        if start >= stop:
            yield self.times[first:end], self.values[first:end], self.values[first:end]
            return
        low, high = self.levels[level]
        head, tail = slice(first, start * size), slice(stop * size, end)
        if head.start < head.stop:
            yield self.times[head], self.values[head], self.values[head]
        yield self.times[start * size : stop * size : size], low[start:stop], high[start:stop]
        if tail.start < tail.stop:
            yield self.times[tail], self.values[tail], self.values[tail]


def _grown(array: Any, size: int) -> Any:
    made = np.empty(size, array.dtype)
    made[: len(array)] = array
    return made


class _Run:
    """The samples of a time in which the clock did not go back."""

    def __init__(self) -> None:
        self.blocks: list[_Block] = []

    @property
    def first(self) -> int:
        """Time of the first sample."""
        return int(self.blocks[0].times[0])

    @property
    def last(self) -> int:
        """Time of the last sample."""
        block = self.blocks[-1]
        return int(block.times[block.count - 1])

    @property
    def count(self) -> int:
        """Number of samples."""
        return sum(block.count for block in self.blocks)

    def add(self, times: Times, values: Values) -> None:
        """Add samples in the order of their times, which may begin before the last one."""
        if self.blocks and times[0] < self.last:
            held_times, held_values = self._take_after(int(times[0]))
            times = np.concatenate((held_times, times))
            values = np.concatenate((held_values, values))
            order = np.argsort(times, kind="stable")
            times, values = times[order], values[order]
        done = 0
        while done < len(times):
            if not self.blocks or self.blocks[-1].count == BLOCK_SIZE:
                self.blocks.append(_Block())
            done += self.blocks[-1].add(times[done:], values[done:])

    def between(self, start: int, end: int) -> tuple[Times, Values]:
        """Return copies of the samples from `start` to before `end`."""
        times, values = [], []
        for block, first, stop in self._ranges(start, end):
            times.append(block.times[first:stop])
            values.append(block.values[first:stop])
        if not times:
            return np.empty(0, np.int64), np.empty(0)
        return np.concatenate(times), np.concatenate(values)

    def neighbour(self, time: int, *, before: bool) -> tuple[int, float] | None:
        """Return the last sample up to a time, or the first one after it; None without one."""
        for block in reversed(self.blocks) if before else self.blocks:
            at = int(np.searchsorted(block.times[: block.count], time, "right"))
            at -= before
            if 0 <= at < block.count:
                return int(block.times[at]), float(block.values[at])
        return None

    def drop_before(self, time: int) -> int:
        """Drop blocks whose samples are all older than a time; return how many samples."""
        dropped = 0
        while len(self.blocks) > 1 and self.blocks[0].times[self.blocks[0].count - 1] < time:
            dropped += self.blocks.pop(0).count
        return dropped

    def reduce(self, low: Values, high: Values, start: int, step: int) -> None:
        """Set the extremes of the columns that have samples.

        Args:
            low: Least values of the columns.
            high: Greatest ones.
            start: Time of the first column.
            step: Length of a column in nanoseconds.
        """
        parts: list[tuple[Times, Values, Values]] = []
        for block, first, stop in self._ranges(start, start + len(low) * step):
            span = max(1, int(block.times[stop - 1]) - int(block.times[first]))
            per_column = (stop - first) * step / span
            parts += block.parts(first, stop, per_column / _MIN_CHUNKS)
        if len(parts) == 1:
            _reduce(*parts[0], low, high, start, step)
        elif parts:
            times, lows, highs = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
            _reduce(times, lows, highs, low, high, start, step)

    def _ranges(self, start: int, end: int) -> Iterator[tuple[_Block, int, int]]:
        for block in self.blocks:
            times = block.times[: block.count]
            if times[-1] < start:
                continue
            if times[0] >= end:
                return
            first, stop = (int(at) for at in np.searchsorted(times, (start, end)))
            if first < stop:
                yield block, first, stop

    def _take_after(self, time: int) -> tuple[Times, Values]:
        """Remove and return the samples after a time."""
        times, values = [], []
        while self.blocks:
            block = self.blocks[-1]
            at = int(np.searchsorted(block.times[: block.count], time, "right"))
            times.append(block.times[at : block.count].copy())
            values.append(block.values[at : block.count].copy())
            block.cut(at)
            if at:
                break
            self.blocks.pop()
        return np.concatenate(times[::-1]), np.concatenate(values[::-1])


def _reduce(
    times: Times,
    lows: Values,
    highs: Values,
    low: Values,
    high: Values,
    start: int,
    step: int,
) -> None:
    """Set the extremes of columns by ascending samples, all of which are within the columns."""
    first, last = (int(times[0]) - start) // step, (int(times[-1]) - start) // step
    if first == last:
        low[first], high[first] = np.fmin.reduce(lows), np.fmax.reduce(highs)
        return
    column = (times - start) // step
    begins = np.append(0, np.flatnonzero(column[1:] != column[:-1]) + 1)
    columns = column[begins]
    low[columns], high[columns] = _extremes(lows, highs, begins)


def _extremes(lows: Values, highs: Values, begins: NDArray[np.intp]) -> tuple[Values, Values]:
    """Return the least and greatest values of the parts that begin at these indices.

    Two windows of a power of two cover a part of usual length. numpy computes them for all parts
    together, in half of the time of ``reduceat``, which goes from part to part.
    """
    ends = np.append(begins[1:], len(lows))
    lengths = ends - begins
    size = 1 << int(np.sort(lengths)[len(lengths) // 2]).bit_length() - 1
    unusual = np.flatnonzero((lengths < size) | (lengths > 2 * size))
    pairs = np.column_stack((begins[unusual], ends[unusual])).ravel()
    pairs = pairs[pairs < len(lows)]
    left, right = begins.copy(), ends - size
    left[unusual] = right[unusual] = 0
    found = []
    for pick, values in ((np.fmin, lows), (np.fmax, highs)):
        windows = values
        for level in range(size.bit_length() - 1):
            windows = pick(windows[: -(1 << level)], windows[1 << level :])
        result = pick(windows[left], windows[right])
        if len(unusual):
            result[unusual] = pick.reduceat(values, pairs)[::2]
        found.append(result)
    return found[0], found[1]


def _kept(bins: NDArray[np.int64], values: Values, *, extremes: bool) -> NDArray[np.intp]:
    """Return the indices of the least and greatest value, or of the first, of each bin."""
    begins = np.append(0, np.flatnonzero(bins[1:] != bins[:-1]) + 1)
    if not extremes or len(begins) == len(bins):
        return begins
    group = np.repeat(np.arange(len(begins)), np.diff(np.append(begins, len(bins))))
    is_missing = np.isnan(values)
    low = np.lexsort((np.where(is_missing, np.inf, values), group))[begins]
    high = np.lexsort((np.where(is_missing, np.inf, -values), group))[begins]
    return np.unique(np.concatenate((low, high)))


class Samples:
    """The samples of one line; filled by one thread, and read by another.

    Times are nanoseconds since the epoch of whichever clock stamped them. Where time goes back by
    more than 2 s, a new run begins: the newest run is shown, all that are kept are exported.

    Attributes:
        removed: Samples that were dropped as they were older than the history.
        restarts: How often time went back.
        merged: Samples that were left out as they are between the extremes of their bin.
        bin_ns: Length of the bins, of which the least and greatest sample are kept; 0 keeps all.
        extremes: Whether these are kept; otherwise, the first one of each bin.
    """

    def __init__(self, bin_ns: int = 0, *, extremes: bool = True) -> None:
        self.bin_ns, self.extremes = bin_ns, extremes
        self.merged = 0
        self._lock = threading.RLock()
        self._runs: deque[_Run] = deque()
        self._changed_from = _MAX_TIME
        self._pauses: deque[int] = deque(maxlen=_RECENT_PAUSES)
        self.removed = self.restarts = 0

    def __len__(self) -> int:
        with self._lock:
            return sum(run.count for run in self._runs)

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        with self._lock:
            return sum(block.nbytes for run in self._runs for block in run.blocks)

    @property
    def span(self) -> tuple[int, int] | None:
        """Times of the first and last sample of the newest run; None without samples."""
        with self._lock:
            return (self._runs[-1].first, self._runs[-1].last) if self._runs else None

    @property
    def gap_ns(self) -> int:
        """Nanoseconds between two samples from which there is a gap in the line."""
        with self._lock:
            pauses = sorted(self._pauses)
        usual = pauses[len(pauses) // 2] if pauses else 0
        return max(_MIN_GAP_NS, _PAUSES * max(usual, self.bin_ns))

    def add(self, times: Times, values: Values) -> None:
        """Add samples in the order in which they arrived.

        Args:
            times: Nanoseconds; beyond 2^62 (the year 2116) they count as that.
            values: As many values; NaN leaves a gap.
        """
        if not len(times):
            return
        times = np.clip(times, -_MAX_TIME, _MAX_TIME)
        if self.bin_ns:
            kept = _kept(times // self.bin_ns, values, extremes=self.extremes)
            self.merged += len(times) - len(kept)
            times, values = times[kept], values[kept]
        with self._lock:
            while len(times):
                count = self._count_before_restart(times)
                self._add_run(times[:count], values[:count])
                times, values = times[count:], values[count:]
                if len(times):
                    self._restart()

    def restart(self) -> None:
        """Begin a new run: further times are those of another clock."""
        with self._lock:
            if self._runs:
                self._restart()

    def clear(self) -> None:
        """Drop all samples."""
        with self._lock:
            self._runs.clear()
            self._pauses.clear()
            self._changed_from = -_MAX_TIME
            self.removed = self.restarts = self.merged = 0

    def forget(self, before: int, most: int) -> None:
        """Drop old samples, in blocks, and count them.

        Args:
            before: Time before which samples of the newest run are dropped.
            most: Number of samples to keep; earlier runs are dropped first.
        """
        with self._lock:
            if not self._runs:
                return
            self.removed += self._runs[-1].drop_before(before)
            count = len(self)
            while count > most and (len(self._runs) > 1 or len(self._runs[0].blocks) > 1):
                run = self._runs[0]
                count -= run.blocks[0].count
                self.removed += run.blocks.pop(0).count
                if not run.blocks:
                    self._runs.popleft()

    def between(self, start: int, end: int) -> tuple[Times, Values]:
        """Return the samples of the newest run from `start` to before `end`, as copies."""
        with self._lock:
            if not self._runs:
                return np.empty(0, np.int64), np.empty(0)
            return self._runs[-1].between(start, end)

    def before(self, time: int) -> tuple[int, float] | None:
        """Return the last sample up to a time, of the newest run; None without one."""
        with self._lock:
            return self._runs[-1].neighbour(time, before=True) if self._runs else None

    def after(self, time: int) -> tuple[int, float] | None:
        """Return the first sample after a time, of the newest run; None without one."""
        with self._lock:
            return self._runs[-1].neighbour(time, before=False) if self._runs else None

    def runs(self) -> list[tuple[Times, Values]]:
        """Return copies of all samples, run by run."""
        with self._lock:
            return [run.between(-_MAX_TIME - 1, _MAX_TIME + 1) for run in self._runs]

    def take_change(self) -> int:
        """Return from which time on samples were added since the last call; 2^62 for none."""
        with self._lock:
            changed, self._changed_from = self._changed_from, _MAX_TIME
        return changed

    def reduce(self, low: Values, high: Values, start: int, step: int) -> None:
        """Set the extremes of columns: +inf and -inf where they are empty, NaN if all are NaN.

        Args:
            low: Filled with the least values.
            high: Filled with the greatest values.
            start: Time of the first column.
            step: Length of a column in nanoseconds, at least 1.
        """
        low.fill(np.inf)
        high.fill(-np.inf)
        with self._lock:
            if self._runs:
                self._runs[-1].reduce(low, high, start, step)

    def _count_before_restart(self, times: Times) -> int:
        """Return how many of the times belong to the newest run."""
        newest = self._runs[-1].last if self._runs and self._runs[-1].blocks else -_MAX_TIME
        if len(times) == 1:
            if int(times[0]) < newest - _MAX_LATE_NS:
                self._restart()
            return 1
        reached = np.maximum.accumulate(np.concatenate(([newest], times[:-1])))
        back = np.flatnonzero(times < reached - _MAX_LATE_NS)
        if not len(back):
            return len(times)
        if back[0] == 0:
            self._restart()
            return self._count_before_restart(times)
        return int(back[0])

    def _restart(self) -> None:
        """Begin a new run."""
        if self._runs and not self._runs[-1].blocks:
            return
        self.restarts += 1
        self._runs.append(_Run())
        while len(self._runs) > MAX_RUNS:
            self.removed += self._runs.popleft().count
        self._pauses.clear()
        self._changed_from = -_MAX_TIME

    def _add_run(self, times: Times, values: Values) -> None:
        if not self._runs:
            self._runs.append(_Run())
        run = self._runs[-1]
        if len(times) > 1 and (times[1:] < times[:-1]).any():
            order = np.argsort(times, kind="stable")
            times, values = times[order], values[order]
        first, last = int(times[0]), int(times[-1])
        if run.blocks:
            pause = (last - run.last) // len(times)
        elif len(times) > 1:
            pause = (last - first) // (len(times) - 1)
        else:
            pause = -1
        if pause >= 0:
            self._pauses.append(pause)
        self._changed_from = min(self._changed_from, first)
        run.add(times, values)


class Columns:
    """The extremes of several lines in each column of pixels of the visible time.

    Columns lie on a fixed grid of time, so that only new samples are looked at while it scrolls.

    Attributes:
        first: Number of the first column: it begins at `first * step`.
        step: Nanoseconds of a column.
        low: Least values, a row for each line; +inf in empty columns, NaN where all are NaN.
        high: Greatest values; -inf in empty columns.
    """

    def __init__(self) -> None:
        self.first, self.step = 0, 1
        self._lines: list[Samples] = []
        self.low: Values = np.empty((0, 0))
        self.high: Values = np.empty((0, 0))

    @property
    def count(self) -> int:
        """Number of columns."""
        return int(self.low.shape[1])

    def update(self, lines: list[Samples], first: int, step: int, count: int) -> int:
        """Show other columns, or the same with new samples.

        Args:
            lines: The lines.
            first: Number of the first column.
            step: Nanoseconds of a column, at least 1.
            count: Number of columns.

        Returns:
            The first column that has changed after the columns were moved; `count` if none has.
        """
        same = lines == self._lines and step == self.step and count == self.count
        moved = first - self.first
        if not same or abs(moved) >= count:
            self._lines = list(lines)
            self.low, self.high = np.empty((2, len(lines), count))
            self.first, self.step = first, step
            for row, line in enumerate(lines):
                line.take_change()
                line.reduce(self.low[row], self.high[row], first * step, step)
            return 0
        self.first = first
        fresh = count
        if moved > 0:
            fresh = count - moved
            for array in (self.low, self.high):
                array[:, :fresh] = array[:, moved:].copy()
        elif moved < 0:
            fresh = 0
            for array in (self.low, self.high):
                array[:, -moved:] = array[:, :moved].copy()
        changed_from = fresh
        for row, line in enumerate(lines):
            changed = min(max(line.take_change() // step - first, 0), count)
            if moved < 0:
                end = count if changed < count else -moved
                line.reduce(self.low[row, :end], self.high[row, :end], first * step, step)
                continue
            start = min(fresh, changed)
            if start < count:
                begin = (first + start) * step
                line.reduce(self.low[row, start:], self.high[row, start:], begin, step)
                changed_from = min(changed_from, start)
        return changed_from

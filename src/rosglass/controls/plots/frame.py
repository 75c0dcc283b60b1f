"""Computes the frames of a plot: which columns, at which scale, with which lines."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rosglass.controls.plots import raster as plot_raster
from rosglass.controls.plots.axes import Axis
from rosglass.controls.plots.raster import Curve, outline
from rosglass.controls.plots.samples import Columns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rosglass.controls.plots.lines import PlotLines
    from rosglass.controls.plots.samples import Samples

    Numbers = NDArray[np.float64]

__all__ = ["LEFT", "RIGHT", "PlotFrame", "ShownLine"]

LEFT, RIGHT = 0, 1
#: Points of a curve of one field against another; of more, every second, third ... is drawn.
_MAX_CURVE = 20_000


class ShownLine(NamedTuple):
    """One line.

    Attributes:
        samples: Its samples.
        x_samples: Values along the horizontal axis; None for time.
        axis: The index of its axis.
        color: As 0xAARRGGBB.
    """

    samples: Samples
    x_samples: Samples | None
    axis: int
    color: int


class _Points(NamedTuple):
    """The visible points of a curve of one field against another."""

    line: ShownLine
    x: Numbers
    y: Numbers


class PlotFrame:
    """The visible columns and axes of a plot.

    Attributes:
        axes: The left and the right axis.
        x_axis: The horizontal axis of curves of one field against another.
        columns: The extremes of the lines over time.
    """

    def __init__(self) -> None:
        self.axes = (Axis(), Axis())
        self.x_axis = Axis()
        self.columns = Columns()

    def draw(
        self,
        view: PlotLines,
        lines: Sequence[ShownLine],
        end_ns: int,
        window_ns: int,
        gap_ns: int,
        *,
        force: bool,
    ) -> bool:
        """Draw the lines, unless nothing has changed; return whether a range has changed.

        Args:
            view: The item that shows them.
            lines: The lines.
            end_ns: Time at the right end.
            window_ns: Visible nanoseconds.
            gap_ns: Pause that is a gap; 0 for that of each line.
            force: Whether something else has changed.
        """
        width, height = view.pixels
        over_time = [line for line in lines if line.x_samples is None]
        step = max(1, round(window_ns / width))
        first = end_ns // step - width + 1
        columns = self.columns
        before = columns.first, columns.step, columns.count
        start = columns.update([line.samples for line in over_time], first, step, width)
        is_still = start >= width and before == (first, step, width)
        curves = self._curves(
            [line for line in lines if line.x_samples is not None], end_ns - window_ns, end_ns
        )
        if is_still and not force and not curves:
            return False
        axis_of = np.array([line.axis for line in over_time], np.intp)
        changed = self._fit_axes(axis_of, curves, width, height)
        gaps = np.array([gap_ns or line.samples.gap_ns for line in over_time], np.float64)
        low, high = columns.low, columns.high
        if start == 0 or changed or force:
            low, high = self._with_edges(over_time, gaps)
        scale, offset = np.zeros(len(over_time)), np.zeros(len(over_time))
        logarithmic = np.zeros(len(over_time), bool)
        for at, axis in enumerate(self.axes):
            chosen = axis_of == at
            per_unit = (height - 1) / (axis.high - axis.low)
            scale[chosen] = per_unit
            offset[chosen] = (height - 1) + axis.low * per_unit
            logarithmic[chosen] = axis.logarithmic
        most = np.minimum(gaps // step + 1, width + 1).astype(np.int64)
        shown = outline(low, high, offset, scale, logarithmic, most)
        if force:
            start = 0
        colors = np.array([line.color for line in over_time], np.uint32)
        key = step, [(axis.low, axis.high, axis.logarithmic) for axis in self.axes]
        drawn = [self._to_pixels(points, width, height) for points in curves]
        ticks = self.axes[LEFT].ticks(height / view.ratio)
        rows = [round((1 - at) * (height - 1)) for at, _ in ticks]
        begin = _first_to_draw(low, high, start)
        view.show(plot_raster, shown, colors, drawn, (key, first, begin, rows))
        return changed

    def _with_edges(self, lines: list[ShownLine], gaps: Numbers) -> tuple[Numbers, Numbers]:
        """Return the columns with the points at which lines cross the ends of the plot."""
        low, high = self.columns.low, self.columns.high
        if not len(lines):
            return low, high
        first, step, count = self.columns.first, self.columns.step, self.columns.count
        ends = [(0, first * step), (count - 1, (first + count) * step - 1)]
        copied = False
        for column, at in ends:
            for row in np.flatnonzero(low[:, column] > high[:, column]):
                samples = lines[row].samples
                before, after = samples.before(at), samples.after(at)
                if before is None or after is None:
                    continue
                length = after[0] - before[0]
                if length > gaps[row] or after[0] < first * step:
                    continue
                if not copied:
                    low, high, copied = low.copy(), high.copy(), True
                share = (at - before[0]) / max(1, length)
                with np.errstate(over="ignore", invalid="ignore"):
                    value = before[1] * (1 - share) + after[1] * share
                if math.isfinite(value):
                    low[row, column] = high[row, column] = value
        return low, high

    def _fit_axes(
        self, axis_of: NDArray[np.intp], curves: list[_Points], width: int, height: int
    ) -> bool:
        now, changed, columns = time.monotonic(), False, self.columns
        for at, axis in enumerate(self.axes):
            rows = axis_of == at
            values = [points.y for points in curves if points.line.axis == at]
            low = min(
                _least(one, logarithmic=axis.logarithmic) for one in (columns.low[rows], *values)
            )
            high = max(
                _greatest(one, logarithmic=axis.logarithmic)
                for one in (columns.high[rows], *values)
            )
            changed |= axis.fit(low, high, height, now)
        if curves:
            low = min(_least(points.x, logarithmic=False) for points in curves)
            high = max(_greatest(points.x, logarithmic=False) for points in curves)
            changed |= self.x_axis.fit(low, high, width / 2, now)
        return changed

    def _curves(self, lines: list[ShownLine], start: int, end: int) -> list[_Points]:
        """Return the points of the visible time."""
        found = []
        for line in lines:
            assert line.x_samples is not None
            _, y = line.samples.between(start, end + 1)
            _, x = line.x_samples.between(start, end + 1)
            count = min(len(x), len(y))
            stride = max(1, -(-count // _MAX_CURVE))
            found.append(_Points(line, x[:count:stride], y[:count:stride]))
        return found

    def _to_pixels(self, points: _Points, width: int, height: int) -> Curve:
        across, axis = self.x_axis, self.axes[points.line.axis]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            values = np.log10(points.y) if axis.logarithmic else points.y
            x = (points.x - across.low) / (across.high - across.low) * (width - 1)
            y = (height - 1) * (1 - (values - axis.low) / (axis.high - axis.low))
        return Curve(x, y, points.line.color)


def _first_to_draw(low: Numbers, high: Numbers, start: int) -> int:
    """Return the first column to draw: lines to the new columns begin at the last samples."""
    if start <= 0 or not len(low):
        return max(0, start)
    present = (low <= high)[:, start - 1 :: -1]
    last = start - 1 - present.argmax(axis=1)
    last[~present.any(axis=1)] = start
    return int(max(0, min(start, last.min())))


def _least(values: Numbers, *, logarithmic: bool) -> float:
    bound = 0.0 if logarithmic else -np.inf
    return float(np.where((values > bound) & (values < np.inf), values, np.inf).min(initial=np.inf))


def _greatest(values: Numbers, *, logarithmic: bool) -> float:
    bound = 0.0 if logarithmic else -np.inf
    return float(
        np.where((values > bound) & (values < np.inf), values, -np.inf).max(initial=-np.inf)
    )

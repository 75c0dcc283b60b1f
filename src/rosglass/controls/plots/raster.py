"""Draws the lines of a plot into an image, by numpy for all columns together.

The image is like a roll of paper: while the plot scrolls, only its new columns are painted. That
costs less than half of what lines of OpenGL cost where the processor computes OpenGL, and is the
same in Qt 5 and with Qt's software renderer, which draws no lines of a scene graph.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Pixels = NDArray[np.uint32]
    Numbers = NDArray[np.float64]
    Indices = NDArray[np.intp]

__all__ = ["Curve", "Outline", "Raster", "background", "outline"]

#: Pixels beyond which a line that leaves the plot is cut; differences overflow nowhere.
_FAR = 1e6
#: Pixels that are filled at once.
_PART = 1 << 15


class Curve(NamedTuple):
    """A line of points anywhere, for plots of one field against another.

    Attributes:
        x: Pixels from the left; NaN leaves a gap.
        y: Pixels from the top.
        color: As 0xAARRGGBB.
    """

    x: Numbers
    y: Numbers
    color: int


class Outline(NamedTuple):
    """The extents of lines in the columns of pixels in which they have samples.

    Attributes:
        row: The line of each extent.
        column: Its column.
        up: Its upper end in pixels from the top.
        down: Its lower end.
        joined: Whether it is connected to the next one; one element less.
    """

    row: Indices
    column: Indices
    up: Numbers
    down: Numbers
    joined: NDArray[np.bool_]

    def joins(self) -> tuple[Indices, Numbers, Numbers]:
        """Return the extents that are connected to the next one, and both ends in pixels."""
        first = np.flatnonzero(self.joined)
        after = first + 1
        middle = (self.up[after] + self.down[after]) / 2
        here = np.clip(middle, self.up[first], self.down[first])
        there = np.clip(here, self.up[after], self.down[after])
        return first, here, there


def background(height: int, color: int, grid_color: int, grid: list[int]) -> Pixels:
    """Return the colours of the rows of an image, some of which are lines of a grid.

    Args:
        height: Number of rows.
        color: As 0xAARRGGBB.
        grid_color: That of the grid.
        grid: Its rows.
    """
    rows = np.full(height, color, np.uint32)
    rows[[row for row in grid if 0 <= row < height]] = grid_color
    return rows


def outline(
    low: Numbers,
    high: Numbers,
    offset: Numbers,
    scale: Numbers,
    logarithmic: NDArray[np.bool_],
    most: NDArray[np.int64],
) -> Outline:
    """Return the extents of lines.

    Args:
        low: Least values in each column, a row for each line; more than `high` where empty.
        high: Greatest values.
        offset: Pixels from the top at which each line has the value 0 (its logarithm, if so).
        scale: Pixels of each line's unit.
        logarithmic: Whether it is drawn by the logarithms of its values.
        most: Columns between two extents of each line that are still connected.
    """
    present = low <= high
    if logarithmic.any():
        present &= (high > 0) | ~logarithmic[:, None]
    row, column = np.nonzero(present)
    bottom, top = low[present], high[present]
    if logarithmic.any():
        chosen = logarithmic[row]
        tiny = np.finfo(np.float64).tiny
        bottom[chosen] = np.log10(np.maximum(bottom[chosen], tiny))
        top[chosen] = np.log10(top[chosen])
    by, at = scale[row], offset[row]
    with np.errstate(invalid="ignore", over="ignore"):
        up = np.clip(at - by * top, -_FAR, _FAR)
        down = np.clip(at - by * bottom, -_FAR, _FAR)
    joined = (row[1:] == row[:-1]) & (column[1:] - column[:-1] <= most[row[1:]])
    broken = np.isnan(low)
    if broken.any():
        passed = np.cumsum(broken, axis=1)[present]
        joined &= passed[1:] == passed[:-1]
    return Outline(row, column, up, down, joined)


class Raster:
    """An image of the lines.

    Each column is kept twice, as far apart as the image is wide: whichever column is the first one,
    the visible ones are beside each other in memory, and scrolling moves no pixel.

    Attributes:
        width: Pixels.
        height: Pixels.
        background: Colours of each row where there is no line, as 0xAARRGGBB.
    """

    def __init__(self, width: int, height: int, background: Pixels) -> None:
        self.width, self.height, self.background = width, height, background
        # A row more: the last one of an image that begins in the middle ends in it.
        self._memory: Pixels = np.empty((height + 1, 2 * width), np.uint32)
        self._first = 0

    @property
    def memory(self) -> Pixels:
        """The memory from the first visible pixel on; rows are 8 * width bytes apart."""
        start = self._first % self.width
        return self._memory.reshape(-1)[start : start + self.height * 2 * self.width]

    @property
    def pixels(self) -> Pixels:
        """The visible part, a view of its memory."""
        return self.memory.reshape(self.height, 2 * self.width)[:, : self.width]

    def draw(
        self, shown: Outline, colors: Pixels, curves: list[Curve], first: int, start: int
    ) -> None:
        """Draw columns anew.

        Args:
            shown: The extents in all columns.
            colors: Colour of each line as 0xAARRGGBB.
            curves: Lines of points, which need all columns to be drawn.
            first: Number of the first visible column, by which the image is scrolled.
            start: The first column to draw; those before it are as they were.
        """
        self._first = first
        self._clear(start)
        if len(shown.row):
            self._draw_lines(shown, colors, start)
        for curve in curves:
            x, y = curve.x, curve.y
            good = np.isfinite(x) & np.isfinite(y)
            at = np.flatnonzero(good[1:] & good[:-1])
            self._draw_segments(x[at], y[at], x[at + 1], y[at + 1], curve.color, 0)
        for left, right in self._ranges(start):
            self._memory[:, left + self.width : right + self.width] = self._memory[:, left:right]

    def _clear(self, start: int) -> None:
        for left, right in self._ranges(start):
            self._memory[:-1, left:right] = self.background[:, None]

    def _ranges(self, start: int) -> Sequence[tuple[int, int]]:
        """Return where the columns from `start` on are in the left half of the memory."""
        width = self.width
        if start == 0:
            return ((0, width),)
        if start >= width:
            return ()
        begin, end = (self._first + start) % width, (self._first + width - 1) % width + 1
        return ((begin, end),) if begin < end else ((begin, width), (0, end))

    def _draw_lines(self, shown: Outline, colors: Pixels, start: int) -> None:
        first, here, there = shown.joins()
        up, down = shown.up.copy(), shown.down.copy()
        near = shown.column[first + 1] - shown.column[first] == 1
        # Between neighbours, the later one reaches to the earlier one.
        later = first[near] + 1
        up[later] = np.minimum(up[later], here[near])
        down[later] = np.maximum(down[later], here[near])
        top = np.clip(np.floor(up), -1, self.height).astype(np.intp)
        bottom = np.clip(np.floor(down), -1, self.height).astype(np.intp)
        seen = (bottom >= 0) & (top < self.height) & (shown.column >= start)
        np.maximum(top, 0, out=top)
        np.minimum(bottom, self.height - 1, out=bottom)
        far = ~near & (shown.column[first + 1] >= start)
        bounds = np.searchsorted(shown.row, np.arange(len(colors) + 1))
        far_first, far_here, far_there = first[far], here[far], there[far]
        far_bounds = np.searchsorted(shown.row[far_first], np.arange(len(colors) + 1))
        for row, color in enumerate(colors):
            part = slice(bounds[row], bounds[row + 1])
            chosen = seen[part]
            if chosen.any():
                self._fill(
                    shown.column[part][chosen], top[part][chosen], bottom[part][chosen], color
                )
            part = slice(far_bounds[row], far_bounds[row + 1])
            if part.start < part.stop:
                at = far_first[part]
                self._draw_segments(
                    shown.column[at] + 0.5,
                    far_here[part],
                    shown.column[at + 1] + 0.5,
                    far_there[part],
                    color,
                    start,
                )

    def _fill(self, column: Indices, top: Indices, bottom: Indices, color: np.uint32) -> None:
        """Fill vertical spans, ends included."""
        length = bottom - top + 1
        stride = 2 * self.width
        passed = np.cumsum(length) - length
        begin = top * stride + (column + self._first) % self.width - passed * stride
        flat = self._memory.reshape(-1)
        # In parts whose indices stay in the processor's cache.
        total = int(passed[-1] + length[-1])
        ends = np.searchsorted(passed, np.arange(_PART, total + _PART, _PART))
        at = 0
        for end in ends.tolist():
            if end > at:
                part = slice(at, end)
                count = int(length[part].sum())
                places = np.repeat(begin[part], length[part])
                places += _steps(count, stride, int(passed[at]))
                flat[places] = color
                at = end

    def _draw_segments(
        self,
        x0: Numbers,
        y0: Numbers,
        x1: Numbers,
        y1: Numbers,
        color: Any,
        start: int,
    ) -> None:
        """Draw straight lines, from column `start` on."""
        kept, begin, end = _clip(x0, y0, x1, y1, start, self.width, self.height)
        x0, y0, dx, dy = x0[kept], y0[kept], (x1 - x0)[kept], (y1 - y0)[kept]
        length = np.maximum(np.abs(dx), np.abs(dy)) * (end - begin)
        count = length.astype(np.intp) + 2
        step = _steps(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
        share = np.repeat(begin, count) + step * np.repeat((end - begin) / (count - 1), count)
        x = np.floor(np.repeat(x0, count) + share * np.repeat(dx, count)).astype(np.intp)
        y = np.floor(np.repeat(y0, count) + share * np.repeat(dy, count)).astype(np.intp)
        inside = (x >= start) & (x < self.width) & (y >= 0) & (y < self.height)
        places = y[inside] * (2 * self.width) + (x[inside] + self._first) % self.width
        self._memory.reshape(-1)[places] = color


def _clip(
    x0: Numbers, y0: Numbers, x1: Numbers, y1: Numbers, left: float, right: float, height: float
) -> tuple[Indices, Numbers, Numbers]:
    """Return which segments are inside a rectangle, and the shares at which they begin and end."""
    dx, dy = x1 - x0, y1 - y0
    begin, end = np.zeros(len(x0)), np.ones(len(x0))
    with np.errstate(divide="ignore", invalid="ignore"):
        for direction, distance in (
            (-dx, x0 - left),
            (dx, right - x0),
            (-dy, y0),
            (dy, height - y0),
        ):
            share = distance / direction
            begin = np.where(direction < 0, np.maximum(begin, share), begin)
            end = np.where(direction > 0, np.minimum(end, share), end)
            end = np.where((direction == 0) & (distance < 0), -1.0, end)
    kept = np.flatnonzero(begin <= end)
    return kept, begin[kept], end[kept]


def _steps(count: int, step: int = 1, first: int = 0) -> Indices:
    """Return `count` multiples of a step, from that with the number `first` on."""
    return np.arange(first * step, (first + count) * step, step)

"""Draws the lines of a plot into an image, by numpy for all columns together.

The image is like a roll of paper: while the plot scrolls, only its new columns are painted. Where a
line begins or ends in a column is sorted, so that each pixel is written once, however many lines
cover it, and in the order of the memory. That costs less than half of what lines of OpenGL cost
where the processor computes OpenGL, and is the same in Qt 5 and with Qt's software renderer, which
draws no lines of a scene graph.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Pixels = NDArray[np.uint32]
    Numbers = NDArray[np.float64]
    Indices = NDArray[np.intp]

__all__ = ["Background", "Curve", "Outline", "Raster", "outline"]

#: Pixels beyond which a line that leaves the plot is cut; differences overflow nowhere.
_FAR = 1e6
#: Lines that are drawn at once, the bits of a mask, and the bits of their numbers.
_MOST_LINES, _LINE_BITS = 64, 6
#: Columns that are drawn at once.
_PART = 256


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

    def spans(self, start: int, height: int) -> Spans:
        """Return the pixels of lines in an image of such a height; column `start` counts as 0."""
        first = np.flatnonzero(self.joined)
        first = first[self.column[first + 1] >= start]
        after = first + 1
        # A connection leads from the point of an extent that is nearest to the middle of the next.
        middle = (self.up[after] + self.down[after]) / 2
        here = np.clip(middle, self.up[first], self.down[first])
        there = np.clip(here, self.up[after], self.down[after])
        slope = (there - here) / (self.column[after] - self.column[first])
        # Up and down from the middle of a column, so that the next column begins a pixel further.
        reach = np.maximum(np.abs(slope) - 1, 0) / 2
        up, down = self.up.copy(), self.down.copy()
        for at, y in ((first, here + np.copysign(reach, slope)),
                      (after, there - np.copysign(reach, slope))):  # fmt: skip
            up[at], down[at] = np.minimum(up[at], y), np.maximum(down[at], y)
        begin = np.maximum(self.column[first] + 1, start)
        join, step = _counted(np.maximum(self.column[after] - begin, 0))
        between = begin[join] + step
        y = here[join] + slope[join] * (between - self.column[first][join])
        row = np.concatenate((self.row, self.row[first][join]))
        column = np.concatenate((self.column, between))
        up, down = np.concatenate((up, y - reach[join])), np.concatenate((down, y + reach[join]))
        kept = np.flatnonzero((column >= start) & (up < height) & (down >= 0))
        top = np.floor(np.maximum(up[kept], 0)).astype(np.intp)
        bottom = np.floor(np.minimum(down[kept], height - 1)).astype(np.intp)
        return Spans(row[kept], column[kept] - start, top, bottom)


class Spans(NamedTuple):
    """The pixels of lines: at most one span of each line in a column.

    Attributes:
        row: The line of each span.
        column: Its column.
        top: Its first pixel from the top.
        bottom: Its last one.
    """

    row: Indices
    column: Indices
    top: Indices
    bottom: Indices

    def of_rows(self, first: int, end: int) -> Spans:
        """Return the spans of some lines, of which `first` counts as 0."""
        kept = np.flatnonzero((self.row >= first) & (self.row < end))
        row, column, top, bottom = (values[kept] for values in self)
        return Spans(row - first, column, top, bottom)


class Background(NamedTuple):
    """The colours of an image where there is no line.

    Attributes:
        color: As 0xAARRGGBB.
        grid_color: That of the rows of a grid.
        grid: The rows of the grid; those outside the image are left out.
    """

    color: int
    grid_color: int
    grid: tuple[int, ...]


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

    Its memory is twice as wide as the image, which moves along in it: scrolling moves the pixels
    only when the end is reached.

    Attributes:
        width: Pixels.
        height: Pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        # A row more: the last one of an image that begins in the middle ends in it.
        self._memory: Pixels = np.zeros((height + 1, 2 * width), np.uint32)
        #: Number of the first visible column, and its place in the memory.
        self._first = self._place = 0

    @property
    def memory(self) -> Pixels:
        """The memory from the first visible pixel on; rows are 8 * width bytes apart."""
        return self._memory.reshape(-1)[self._place :][: self.height * 2 * self.width]

    @property
    def pixels(self) -> Pixels:
        """The visible part, a view of its memory."""
        return self._memory[: self.height, self._place : self._place + self.width]

    def draw(
        self,
        shown: Outline,
        colors: Pixels,
        curves: list[Curve],
        background: Background,
        first: int,
        start: int,
    ) -> None:
        """Draw columns anew.

        Args:
            shown: The extents in all columns.
            colors: Colour of each line as 0xAARRGGBB, not 0; later lines cover earlier ones.
            curves: Lines of points, which need all columns to be drawn.
            background: What is behind the lines.
            first: Number of the first visible column, by which the image is scrolled.
            start: The first column to draw; those before it are as they were.
        """
        place = self._place + first - self._first if start > 0 else 0
        if place > self.width:
            self._memory[:, :start] = self._memory[:, place : place + start]
            place = 0
        self._first, self._place = first, place
        start = max(0, start)
        if start < self.width:
            self._draw_columns(shown.spans(start, self.height), colors, background, start)
        for curve in curves:
            self._draw_curve(curve)

    def _draw_columns(
        self, spans: Spans, colors: Pixels, background: Background, start: int
    ) -> None:
        area = self.pixels[:, start:]
        first = spans if len(colors) <= _MOST_LINES else spans.of_rows(0, _MOST_LINES)
        self._draw_lines(area, first, colors[:_MOST_LINES], background.color)
        for at in range(_MOST_LINES, len(colors), _MOST_LINES):
            others = spans.of_rows(at, at + _MOST_LINES)
            self._draw_lines(area, others, colors[at : at + _MOST_LINES], None)
        for row in background.grid:
            if 0 <= row < self.height:
                area[row][area[row] == background.color] = background.grid_color

    def _draw_lines(
        self, area: Pixels, spans: Spans, colors: Pixels, background: int | None
    ) -> None:
        """Draw up to 64 lines: each pixel once, in the colour of the last line that covers it.

        Without a background, they are drawn over what is there.
        """
        columns = area.shape[1]
        begin = spans.column * self.height
        # A line begins or ends: in the order of pixels downwards, column by column.
        places = np.concatenate((begin + spans.top, begin + spans.bottom + 1))
        events = places << _LINE_BITS | np.concatenate((spans.row, spans.row))
        events.sort()
        places, lines = events >> _LINE_BITS, events & (_MOST_LINES - 1)
        # Bit by bit, which lines cover the pixels from there on.
        covers = np.bitwise_xor.accumulate(np.left_shift(np.uint64(1), lines.astype(np.uint64)))
        # The highest bit, without another one beside it: then no rounding carries it.
        _, last = np.frexp((covers & ~(covers >> np.uint64(1))).astype(np.float64))
        palette = np.concatenate(([background or 0], colors)).astype(np.uint32)
        hues = palette[np.concatenate(([0], last))]
        # Parts that stay in the processor's cache.
        for left in range(0, columns, _PART):
            part = area[:, left : left + _PART]
            ends = np.array((left, left + part.shape[1])) * self.height
            first, stop = np.searchsorted(places, ends)
            lengths = np.diff(places[first:stop], prepend=ends[0], append=ends[1])
            drawn = np.repeat(hues[first : stop + 1], lengths).reshape(-1, self.height).T
            if background is None:
                np.copyto(part, drawn, where=drawn != 0)
            else:
                part[...] = drawn

    def _draw_curve(self, curve: Curve) -> None:
        good = np.isfinite(curve.x) & np.isfinite(curve.y)
        at = np.flatnonzero(good[1:] & good[:-1])
        x0, y0 = curve.x[at], curve.y[at]
        x1, y1 = curve.x[at + 1], curve.y[at + 1]
        kept, begin, end = _clip(x0, y0, x1, y1, self.width, self.height)
        x0, y0, dx, dy = x0[kept], y0[kept], (x1 - x0)[kept], (y1 - y0)[kept]
        length = np.maximum(np.abs(dx), np.abs(dy)) * (end - begin)
        count = length.astype(np.intp) + 2
        segment, step = _counted(count)
        share = begin[segment] + step * ((end - begin) / (count - 1))[segment]
        x = np.floor(x0[segment] + share * dx[segment]).astype(np.intp)
        y = np.floor(y0[segment] + share * dy[segment]).astype(np.intp)
        inside = (x >= 0) & (x < self.width) & (y >= 0) & (y < self.height)
        self.pixels[y[inside], x[inside]] = curve.color


def _clip(
    x0: Numbers, y0: Numbers, x1: Numbers, y1: Numbers, width: float, height: float
) -> tuple[Indices, Numbers, Numbers]:
    """Return which segments are inside a rectangle, and the shares at which they begin and end."""
    dx, dy = x1 - x0, y1 - y0
    begin, end = np.zeros(len(x0)), np.ones(len(x0))
    with np.errstate(divide="ignore", invalid="ignore"):
        for direction, distance in (
            (-dx, x0),
            (dx, width - x0),
            (-dy, y0),
            (dy, height - y0),
        ):
            share = distance / direction
            begin = np.where(direction < 0, np.maximum(begin, share), begin)
            end = np.where(direction > 0, np.minimum(end, share), end)
            end = np.where((direction == 0) & (distance < 0), -1.0, end)
    kept = np.flatnonzero(begin <= end)
    return kept, begin[kept], end[kept]


def _counted(counts: Indices) -> tuple[Indices, Indices]:
    """Return the index of each count as often as it says, and the numbers from 0 to each count."""
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]

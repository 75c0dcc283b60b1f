"""The lines of a plot as vertices for OpenGL, or in an image for other renderers.

Either is computed by numpy for all lines together. The image is drawn like a roll of paper: while
the plot scrolls, only its new columns are painted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rosglass.qt import QtGui

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Pixels = NDArray[np.uint32]
    Numbers = NDArray[np.float64]
    Indices = NDArray[np.intp]

__all__ = ["Curve", "Outline", "Raster", "background", "outline", "scaled", "vertices"]

#: Pixels beyond which a line that leaves the plot is cut; float32 and int32 are exact there.
_FAR = 1e6
_VERTEX = np.dtype([("x", np.float32), ("y", np.float32), ("color", np.uint32)])


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


def vertices(shown: Outline, colors: Pixels, curves: list[Curve]) -> NDArray[Any]:
    """Return pairs of vertices, for OpenGL's lines.

    Args:
        shown: The extents.
        colors: Colour of each line as 0xAARRGGBB.
        curves: Lines of points.
    """
    first, here, there = shown.joins()
    count, joins = len(shown.row), len(first)
    parts = [_curve_vertices(curve) for curve in curves]
    made = np.empty(2 * (count + joins) + sum(map(len, parts)), _VERTEX)
    color, x = _rgba(colors)[shown.row], shown.column + np.float32(0.5)
    for begin, ys in ((0, shown.up - 0.5), (1, shown.down + 0.5)):
        half = made[begin : 2 * count : 2]
        half["x"], half["y"], half["color"] = x, ys, color
    for begin, places, ys in ((0, first, here), (1, first + 1, there)):
        half = made[2 * count + begin : 2 * (count + joins) : 2]
        half["x"], half["y"], half["color"] = x[places], ys, color[places]
    at = 2 * (count + joins)
    for part in parts:
        made[at : at + len(part)] = part
        at += len(part)
    return made


def scaled(lines: NDArray[Any], factor: float) -> NDArray[Any]:
    """Return vertices with positions multiplied by a factor."""
    if factor != 1:
        lines = lines.copy()
        lines["x"] *= factor
        lines["y"] *= factor
    return lines


def _curve_vertices(curve: Curve) -> NDArray[Any]:
    good = np.isfinite(curve.x) & np.isfinite(curve.y)
    first = np.flatnonzero(good[1:] & good[:-1])
    made = np.empty(2 * len(first), _VERTEX)
    for begin, places in ((0, first), (1, first + 1)):
        half = made[begin::2]
        half["x"] = np.clip(curve.x[places], -_FAR, _FAR)
        half["y"] = np.clip(curve.y[places], -_FAR, _FAR)
    made["color"] = _rgba(np.array([curve.color], np.uint32))[0]
    return made


def _rgba(colors: Pixels) -> Pixels:
    """Return 0xAARRGGBB as the bytes R, G, B, A in memory."""
    red, green, blue = colors >> 16 & 255, colors >> 8 & 255, colors & 255
    bytes_in_order: Pixels = (red | green << 8 | blue << 16 | np.uint32(255 << 24)).astype("<u4")
    return bytes_in_order


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

    def image(self) -> QtGui.QImage:
        """Return the visible part, which shares this memory."""
        start = self._first % self.width
        view = self._memory.reshape(-1)[start : start + self.height * 2 * self.width]
        return QtGui.QImage(
            view.data, self.width, self.height, 8 * self.width, QtGui.QImage.Format.Format_RGB32
        )

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

    def _clear(self, start: int) -> None:
        width = self.width
        begin, end = (self._first + start) % width, (self._first + width - 1) % width + 1
        ranges = ((begin, end),) if begin < end else ((begin, width), (0, end))
        if start == 0:
            ranges = ((0, width),)
        for left, right in ranges:
            for at in (left, left + width):
                self._memory[:-1, at : at + right - left] = self.background[:, None]

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
        total = int(length.sum())
        stride = 2 * self.width
        begin = top * stride + (column + self._first) % self.width
        passed = np.cumsum(length) - length
        places = np.repeat(begin - passed * stride, length) + _steps(total) * stride
        flat = self._memory.reshape(-1)
        flat[places] = color
        places += self.width
        flat[places] = color

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
        flat = self._memory.reshape(-1)
        flat[places] = color
        flat[places + self.width] = color


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


#: 0, 1, 2 ..., as long as was needed so far.
_counted = [np.arange(1 << 16)]


def _steps(count: int) -> Indices:
    """Return 0, 1, 2 ... as a shared array."""
    if count > len(_counted[0]):
        _counted[0] = np.arange(count + count // 2)
    return _counted[0][:count]

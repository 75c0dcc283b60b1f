"""Covers the non-empty or changed parts of a frame with few rectangles, to save blending."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

__all__ = [
    "TILE",
    "Rect",
    "changed_tiles",
    "cover",
    "covered_tiles",
    "trimmed",
    "uncovered",
    "update_covered",
]

#: Width and height of a tile in pixels.
TILE = 8
#: Rows of pixels compared at a time; a multiple of :data:`TILE`.
_ROWS_AT_A_TIME = 64


class Rect(NamedTuple):
    """A rectangle in pixels from the upper left corner; right and bottom are exclusive."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def area(self) -> int:
        """Number of pixels."""
        return (self.right - self.left) * (self.bottom - self.top)

    def overlaps(self, other: Rect) -> bool:
        """Return whether the rectangles overlap."""
        return (
            self.left < other.right
            and other.left < self.right
            and self.top < other.bottom
            and other.top < self.bottom
        )

    def union(self, other: Rect) -> Rect:
        """Return the smallest rectangle that contains both."""
        return Rect(
            min(self.left, other.left),
            min(self.top, other.top),
            max(self.right, other.right),
            max(self.bottom, other.bottom),
        )


def covered_tiles(pixels: NDArray[np.uint32]) -> NDArray[np.bool_]:
    """Return for each tile of a frame whether it has a visible pixel.

    Args:
        pixels: Array of shape (height, width), each pixel 0xAARRGGBB with premultiplied colours;
            a colour with alpha 0 is additive, and visible.
    """
    height, width = pixels.shape
    whole = height // TILE
    columns = np.zeros((-(-height // TILE), width), np.uint32)
    full = pixels[: whole * TILE].reshape(whole, TILE, width)
    np.bitwise_or.reduce(full, axis=1, out=columns[:whole])
    if whole < len(columns):
        np.bitwise_or.reduce(pixels[whole * TILE :], axis=0, out=columns[whole])
    tiles: NDArray[np.bool_] = (
        np.bitwise_or.reduceat(columns, np.arange(0, width, TILE), axis=1) != 0
    )
    return tiles


def update_covered(
    covered: NDArray[np.bool_], pixels: NDArray[np.uint32], rects: list[Rect]
) -> None:
    """Update a result of :func:`covered_tiles` for the changed rectangles of the frame."""
    for first, last in {(rect.top // TILE, -(-rect.bottom // TILE)) for rect in rects}:
        covered[first:last] = covered_tiles(pixels[first * TILE : last * TILE])


def changed_tiles(
    pixels: NDArray[np.uint32],
    before: NDArray[np.uint32],
    within: Iterable[tuple[int, int, int, int]] | None = None,
) -> NDArray[np.bool_]:
    """Return for each tile whether two frames of the same size differ in it.

    Args:
        pixels: The new frame.
        before: The old frame.
        within: Rectangles to compare; None for the whole frames.
    """
    height, width = pixels.shape
    tiles = np.zeros((-(-height // TILE), -(-width // TILE)), np.bool_)
    if within is not None:
        for left, top, right, bottom in within:
            rows = slice(top // TILE, -(-bottom // TILE))
            columns = slice(left // TILE, -(-right // TILE))
            area = (
                slice(rows.start * TILE, rows.stop * TILE),
                slice(columns.start * TILE, columns.stop * TILE),
            )
            tiles[rows, columns] |= covered_tiles(pixels[area] ^ before[area])
        return tiles
    for top in range(0, height, _ROWS_AT_A_TIME):
        now, then = pixels[top : top + _ROWS_AT_A_TIME], before[top : top + _ROWS_AT_A_TIME]
        # Checking for equality is faster, and most of a frame does not change.
        if (now != then).any():
            tiles[top // TILE : -(-(top + _ROWS_AT_A_TIME) // TILE)] = covered_tiles(now ^ then)
    return tiles


def cover(
    tiles: NDArray[np.bool_], width: int, height: int, *, most: int = 48, worth: int = 0
) -> list[Rect]:
    """Return disjoint rectangles that cover all set tiles.

    Args:
        tiles: From :func:`covered_tiles` or :func:`changed_tiles`.
        width: Width of the frame in pixels, which limits the rectangles.
        height: Its height in pixels.
        most: Maximum number of rectangles; coarser ones are used to keep it.
        worth: Pixels that may be covered in addition to save one rectangle.
    """
    step = TILE
    while True:
        rects = [
            Rect(left * step, top * step, min(right * step, width), min(bottom * step, height))
            for left, top, right, bottom in _merged_runs(tiles)
        ]
        if len(rects) <= most:
            return _merged(rects, worth) if worth else rects
        step *= 2
        tiles = _at_half_resolution(tiles)


def uncovered(tiles: NDArray[np.bool_], rects: list[Rect]) -> int | None:
    """Return the number of unset tiles in the rectangles; None if a set tile is outside of all."""
    inside = np.zeros_like(tiles)
    for rect in rects:
        rows = slice(rect.top // TILE, -(-rect.bottom // TILE))
        inside[rows, rect.left // TILE : -(-rect.right // TILE)] = True
    if (tiles & ~inside).any():
        return None
    return int(inside.sum()) - int(tiles.sum())


def trimmed(pixels: NDArray[np.uint32], rect: Rect) -> Rect:
    """Return a rectangle without empty rows and columns at its edges, up to a tile on each side."""
    part = pixels[rect.top : rect.bottom, rect.left : rect.right]
    left, right = _leading(part[:, :TILE], 0), _leading(part[:, : -TILE - 1 : -1], 0)
    top, bottom = _leading(part[:TILE], 1), _leading(part[: -TILE - 1 : -1], 1)
    inner = Rect(rect.left + left, rect.top + top, rect.right - right, rect.bottom - bottom)
    return inner if inner.left < inner.right and inner.top < inner.bottom else rect


def _leading(part: NDArray[np.uint32], axis: int) -> int:
    """Return the number of leading empty columns (axis 0) or rows (axis 1)."""
    filled = np.asarray(part.any(axis=axis))
    return int(filled.argmax()) if filled.any() else len(filled)


def _at_half_resolution(tiles: NDArray[np.bool_]) -> NDArray[np.bool_]:
    rows, columns = tiles.shape
    across = np.logical_or.reduceat(tiles, np.arange(0, columns, 2), axis=1)
    half: NDArray[np.bool_] = np.logical_or.reduceat(across, np.arange(0, rows, 2), axis=0)
    return half


def _merged_runs(tiles: NDArray[np.bool_]) -> list[Rect]:
    """Return the horizontal runs of set tiles, with equal runs in adjacent rows merged."""
    padded = np.pad(tiles, 1)
    edges = padded[:, 1:] != padded[:, :-1]
    done: list[Rect] = []
    growing: dict[tuple[int, int], int] = {}
    for row in np.flatnonzero((edges[1:] != edges[:-1]).any(axis=1)).tolist():
        starts = np.flatnonzero(edges[row + 1]).tolist()
        runs = set(zip(starts[::2], starts[1::2], strict=True))
        ended = [run for run in growing if run not in runs]
        done += [Rect(left, growing.pop((left, right)), right, row) for left, right in ended]
        for run in sorted(runs):
            growing.setdefault(run, row)
    return done


def _merged(rects: list[Rect], worth: int) -> list[Rect]:
    """Merge rectangles while each merge adds at most `worth` pixels per rectangle saved."""
    while True:
        outer = next(
            (o for o in _bounds_of_close_pairs(rects, worth) if _is_worthwhile(o, rects, worth)),
            None,
        )
        if outer is None:
            return rects
        rects = [*(rect for rect in rects if not rect.overlaps(outer)), outer]


def _bounds_of_close_pairs(rects: list[Rect], worth: int) -> Iterator[Rect]:
    """Iterate over the bounding rectangles of close pairs, the closest pair first."""
    left, top, right, bottom = np.array(rects, np.int64).reshape(-1, 4).T
    width = np.maximum.outer(right, right) - np.minimum.outer(left, left)
    height = np.maximum.outer(bottom, bottom) - np.minimum.outer(top, top)
    area = (right - left) * (bottom - top)
    between = width * height - np.add.outer(area, area)
    ones, others = np.nonzero(np.triu(between <= 4 * worth, 1))
    for number in np.argsort(between[ones, others], kind="stable"):
        yield rects[ones[number]].union(rects[others[number]])


def _is_worthwhile(outer: Rect, rects: list[Rect], worth: int) -> bool:
    inside = [rect for rect in rects if rect.overlaps(outer)]
    # A rectangle that reaches beyond it would be blended twice.
    if any(outer.union(rect) != outer for rect in inside):
        return False
    return outer.area - sum(rect.area for rect in inside) <= worth * (len(inside) - 1)

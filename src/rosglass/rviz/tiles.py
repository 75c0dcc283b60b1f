"""Where a picture has something on it, in few rectangles: only what is blended costs."""

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

#: Pixels of a tile's edge.
TILE = 8
#: Rows of pixels that are compared at a time; a multiple of a tile's.
_ROWS_AT_A_TIME = 64


class Rect(NamedTuple):
    """A rectangle in pixels, from the upper left corner; right and bottom are outside."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def area(self) -> int:
        """How many pixels it has."""
        return (self.right - self.left) * (self.bottom - self.top)

    def meets(self, other: Rect) -> bool:
        """Return whether both have a pixel in common."""
        return (
            self.left < other.right
            and other.left < self.right
            and self.top < other.bottom
            and other.top < self.bottom
        )

    def around(self, other: Rect) -> Rect:
        """Return the smallest rectangle with both in it."""
        return Rect(
            min(self.left, other.left),
            min(self.top, other.top),
            max(self.right, other.right),
            max(self.bottom, other.bottom),
        )


def covered_tiles(pixels: NDArray[np.uint32]) -> NDArray[np.bool_]:
    """Return for each tile of a picture whether anything on it can be seen.

    Args:
        pixels: Shape (height, width), each pixel 0xAARRGGBB with premultiplied colours; a colour
            without alpha shines, and is seen as well.
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
    """Update the result of :func:`covered_tiles` where the picture has changed since."""
    for first, last in {(rect.top // TILE, -(-rect.bottom // TILE)) for rect in rects}:
        covered[first:last] = covered_tiles(pixels[first * TILE : last * TILE])


def changed_tiles(
    pixels: NDArray[np.uint32], before: NDArray[np.uint32], within: Iterable[Rect] | None = None
) -> NDArray[np.bool_]:
    """Return for each tile whether two pictures of one size differ in it.

    Args:
        pixels: One.
        before: The other.
        within: Where they may differ, and are compared; None for anywhere.
    """
    height, width = pixels.shape
    tiles = np.zeros((-(-height // TILE), -(-width // TILE)), np.bool_)
    if within is not None:
        for rect in within:
            rows = slice(rect.top // TILE, -(-rect.bottom // TILE))
            columns = slice(rect.left // TILE, -(-rect.right // TILE))
            place = (
                slice(rows.start * TILE, rows.stop * TILE),
                slice(columns.start * TILE, columns.stop * TILE),
            )
            tiles[rows, columns] |= covered_tiles(pixels[place] ^ before[place])
        return tiles
    for top in range(0, height, _ROWS_AT_A_TIME):
        now, then = pixels[top : top + _ROWS_AT_A_TIME], before[top : top + _ROWS_AT_A_TIME]
        # Most of a picture stays as it is, which is found out faster than what is another.
        if (now != then).any():
            tiles[top // TILE : -(-(top + _ROWS_AT_A_TIME) // TILE)] = covered_tiles(now ^ then)
    return tiles


def cover(
    tiles: NDArray[np.bool_], width: int, height: int, *, most: int = 48, worth: int = 0
) -> list[Rect]:
    """Return rectangles that together cover all tiles that are set, and do not overlap.

    Args:
        tiles: From :func:`covered_tiles` or :func:`changed_tiles`.
        width: Pixels of the picture; no rectangle reaches over its edges.
        height: Pixels.
        most: Rectangles; above that, larger ones are taken that cover more than is needed.
        worth: Pixels that a rectangle less may cost more.
    """
    step = TILE
    while True:
        rects = [
            Rect(left * step, top * step, min(right * step, width), min(bottom * step, height))
            for left, top, right, bottom in _runs_below_each_other(tiles)
        ]
        if len(rects) <= most:
            return _joined(rects, worth) if worth else rects
        step *= 2
        tiles = _halved(tiles)


def uncovered(tiles: NDArray[np.bool_], rects: list[Rect]) -> int | None:
    """Return how many tiles of rectangles are not set; None if set ones are in no rectangle."""
    inside = np.zeros_like(tiles)
    for rect in rects:
        rows = slice(rect.top // TILE, -(-rect.bottom // TILE))
        inside[rows, rect.left // TILE : -(-rect.right // TILE)] = True
    if (tiles & ~inside).any():
        return None
    return int(inside.sum()) - int(tiles.sum())


def trimmed(pixels: NDArray[np.uint32], rect: Rect) -> Rect:
    """Return a rectangle without what is empty at its edges, as far as a tile from each."""
    part = pixels[rect.top : rect.bottom, rect.left : rect.right]
    left, right = _leading(part[:, :TILE], 0), _leading(part[:, : -TILE - 1 : -1], 0)
    top, bottom = _leading(part[:TILE], 1), _leading(part[: -TILE - 1 : -1], 1)
    inner = Rect(rect.left + left, rect.top + top, rect.right - right, rect.bottom - bottom)
    return inner if inner.left < inner.right and inner.top < inner.bottom else rect


def _leading(part: NDArray[np.uint32], axis: int) -> int:
    """Return how many columns (axis 0) or rows (axis 1) are empty before the first that is not."""
    filled = np.asarray(part.any(axis=axis))
    return int(filled.argmax()) if filled.any() else len(filled)


def _halved(tiles: NDArray[np.bool_]) -> NDArray[np.bool_]:
    rows, columns = tiles.shape
    across = np.logical_or.reduceat(tiles, np.arange(0, columns, 2), axis=1)
    half: NDArray[np.bool_] = np.logical_or.reduceat(across, np.arange(0, rows, 2), axis=0)
    return half


def _runs_below_each_other(tiles: NDArray[np.bool_]) -> list[Rect]:
    """Return runs of tiles, those that stand alike in rows below each other as one."""
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


def _joined(rects: list[Rect], worth: int) -> list[Rect]:
    """Join neighbours as long as each rectangle less costs no more than `worth` pixels."""
    while True:
        outer = next((o for o in _around_neighbours(rects, worth) if _saves(o, rects, worth)), None)
        if outer is None:
            return rects
        rects = [*(rect for rect in rects if not rect.meets(outer)), outer]


def _around_neighbours(rects: list[Rect], worth: int) -> Iterator[Rect]:
    """Iterate over what is around two that stand close together, the closest first."""
    left, top, right, bottom = np.array(rects, np.int64).reshape(-1, 4).T
    width = np.maximum.outer(right, right) - np.minimum.outer(left, left)
    height = np.maximum.outer(bottom, bottom) - np.minimum.outer(top, top)
    area = (right - left) * (bottom - top)
    between = width * height - np.add.outer(area, area)
    ones, others = np.nonzero(np.triu(between <= 4 * worth, 1))
    for number in np.argsort(between[ones, others], kind="stable"):
        yield rects[ones[number]].around(rects[others[number]])


def _saves(outer: Rect, rects: list[Rect], worth: int) -> bool:
    inside = [rect for rect in rects if rect.meets(outer)]
    # One that is cut by the edge would be blended twice.
    if any(outer.around(rect) != outer for rect in inside):
        return False
    return outer.area - sum(rect.area for rect in inside) <= worth * (len(inside) - 1)

"""Where a picture has something on it, in few rectangles: only what is blended costs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["TILE", "Rect", "changed_tiles", "cover", "covered_tiles"]

#: Pixels of a tile's edge.
TILE = 16


class Rect(NamedTuple):
    """A rectangle in pixels, from the upper left corner; right and bottom are outside."""

    left: int
    top: int
    right: int
    bottom: int


def _any_per_tile(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return for each tile whether any of its pixels is set."""
    height, width = mask.shape
    rows, columns = -(-height // TILE), -(-width // TILE)
    across = np.logical_or.reduceat(mask, np.arange(0, width, TILE), axis=1)
    tiles: NDArray[np.bool_] = np.logical_or.reduceat(across, np.arange(0, height, TILE), axis=0)
    assert tiles.shape == (rows, columns)
    return tiles


def covered_tiles(pixels: NDArray[np.uint32]) -> NDArray[np.bool_]:
    """Return for each tile of a picture whether anything on it can be seen.

    Args:
        pixels: Shape (height, width), each pixel 0xAARRGGBB with premultiplied colours; a colour
            without alpha shines, and is seen as well.
    """
    return _any_per_tile(pixels != 0)


def changed_tiles(pixels: NDArray[np.uint32], before: NDArray[np.uint32]) -> NDArray[np.bool_]:
    """Return for each tile whether two pictures of one size differ in it."""
    return _any_per_tile(pixels != before)


def cover(tiles: NDArray[np.bool_], width: int, height: int, most: int = 48) -> list[Rect]:
    """Return rectangles that together cover all tiles that are set, and do not overlap.

    Args:
        tiles: From :func:`covered_tiles` or :func:`changed_tiles`.
        width: Pixels of the picture; no rectangle reaches over its edges.
        height: Pixels.
        most: Rectangles; above that, larger ones are taken that cover more than is needed.
    """
    step = TILE
    while True:
        rects = [
            Rect(left * step, top * step, min(right * step, width), min(bottom * step, height))
            for left, top, right, bottom in _merge(tiles)
        ]
        if len(rects) <= most:
            return rects
        step *= 2
        tiles = _halved(tiles)


def _halved(tiles: NDArray[np.bool_]) -> NDArray[np.bool_]:
    rows, columns = tiles.shape
    across = np.logical_or.reduceat(tiles, np.arange(0, columns, 2), axis=1)
    half: NDArray[np.bool_] = np.logical_or.reduceat(across, np.arange(0, rows, 2), axis=0)
    return half


def _merge(tiles: NDArray[np.bool_]) -> list[Rect]:
    """Return runs of tiles, those that stand alike in rows below each other as one."""
    done: list[Rect] = []
    growing: dict[tuple[int, int], int] = {}
    for row in range(tiles.shape[0] + 1):
        runs = _runs(tiles[row]) if row < tiles.shape[0] else []
        ended = [run for run in growing if run not in runs]
        done += [Rect(left, growing.pop((left, right)), right, row) for left, right in ended]
        for run in runs:
            growing.setdefault(run, row)
    return done


def _runs(row: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(row, prepend=False, append=False))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]

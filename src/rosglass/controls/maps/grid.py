"""Occupancy grids as tiles: levels of cells, updates, and RViz's or the theme's colours."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rosglass.controls.maps.tiles import TILE_PX, TileKey
from rosglass.errors import Error
from rosglass.images.grid_colors import grid_colors
from rosglass.qt import QtGui

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["MOST_CELLS", "GridChange", "GridReader", "GridTiles", "theme_colors"]

#: Cells of a map that are kept, in bytes; with the levels a third more.
MOST_CELLS = 100_000_000
_Format = QtGui.QImage.Format


def theme_colors(
    free: Sequence[int], occupied: Sequence[int], alpha: int = 255
) -> NDArray[np.uint8]:
    """Return colours from that of free cells to that of occupied ones, (256, 4) RGBA.

    Unknown cells are transparent; values that the format does not define are as in RViz.

    Args:
        free: Red, green and blue.
        occupied: The same.
        alpha: Opacity of known cells.
    """
    colors = grid_colors("map")
    share = np.linspace(0.0, 1.0, 101)[:, np.newaxis] ** 0.8
    colors[:101, :3] = np.array(free) + (np.array(occupied) - np.array(free)) * share
    colors[:101, 3] = alpha
    colors[255] = 0
    return colors


def _packed(colors: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Return colours as premultiplied ARGB, in the order of levels: unknown, 0, 1 ..."""
    rgba = colors.astype(np.uint32)
    red, green, blue = ((rgba[:, n] * rgba[:, 3] + 127) // 255 for n in range(3))
    packed = (rgba[:, 3] << 24) | (red << 16) | (green << 8) | blue
    return np.roll(packed, 1).astype(np.uint32)


def _halved(cells: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the largest of each 2 x 2 cells; the last row or column may be alone."""
    rows = cells[0::2].copy()
    np.maximum(rows[: len(cells) // 2], cells[1::2], out=rows[: len(cells) // 2])
    out = np.ascontiguousarray(rows[:, 0::2])
    half = cells.shape[1] // 2
    np.maximum(out[:, :half], rows[:, 1::2], out=out[:, :half])
    return out


class GridTiles:
    """The cells of a map of one size and resolution; a :class:`TileSource`.

    A cell is kept as its value + 1, so that unknown is the least: of four cells, the next level
    shows the one with the largest value, and no wall is lost when it is seen from far.

    Args:
        columns, rows: Cells in x and y.
        resolution: Metres of a cell.
    """

    def __init__(self, columns: int, rows: int, resolution: float) -> None:
        self.columns, self.rows, self.resolution = columns, rows, resolution
        #: Packed colours; replaced as a whole.
        self.colors = _packed(grid_colors("map"))
        self.is_opaque = True
        self._cells = [np.zeros((rows, columns), np.uint8)]
        while max(self._cells[-1].shape) > TILE_PX:
            shape = [-(-side // 2) for side in self._cells[-1].shape]
            self._cells.append(np.zeros(shape, np.uint8))
        self.levels = len(self._cells)
        self._versions = [
            np.zeros([-(-side // TILE_PX) for side in cells.shape], np.int64)
            for cells in self._cells
        ]

    @property
    def width(self) -> float:
        """Metres in x."""
        return self.columns * self.resolution

    @property
    def height(self) -> float:
        """Metres in y."""
        return self.rows * self.resolution

    def value_at(self, x: float, y: float) -> int | None:
        """Return the value of the cell at metres from the lower left corner; None outside."""
        column, row = math.floor(x / self.resolution), math.floor(y / self.resolution)
        if not (0 <= column < self.columns and 0 <= row < self.rows):
            return None
        return int(self._cells[0][row, column].view(np.int8)) - 1

    def unit(self, level: int) -> float:
        """Return the metres of a pixel."""
        return self.resolution * 2.0**level

    def range(
        self, level: int, box: tuple[float, float, float, float]
    ) -> tuple[int, int, int, int]:
        """Return the first column and row in a box, and those after the last."""
        side = TILE_PX * self.unit(level)
        most = self._versions[level].shape[::-1]
        first = [min(max(math.floor(v / side), 0), n) for v, n in zip(box[:2], most, strict=True)]
        last = [
            min(max(math.floor(v / side) + 1, 0), n) for v, n in zip(box[2:], most, strict=True)
        ]
        return first[0], first[1], max(first[0], last[0]), max(first[1], last[1])

    def rect(self, key: TileKey) -> tuple[float, float, float, float]:
        """Return left, bottom, width and height of a tile in metres."""
        unit, shape = self.unit(key.level), self._cells[key.level].shape
        x, y = key.column * TILE_PX, key.row * TILE_PX
        wide, high = min(TILE_PX, shape[1] - x), min(TILE_PX, shape[0] - y)
        return x * unit, y * unit, wide * unit, high * unit

    def version(self, key: TileKey) -> int:
        """Return a number that changes with the tile."""
        return int(self._versions[key.level][key.row, key.column])

    def paint(self, key: TileKey) -> QtGui.QImage:
        """Return a tile's image, north up."""
        x, y = key.column * TILE_PX, key.row * TILE_PX
        cells = self._cells[key.level][y : y + TILE_PX, x : x + TILE_PX][::-1]
        pixels = self.colors[cells]
        kind = _Format.Format_RGB32 if self.is_opaque else _Format.Format_ARGB32_Premultiplied
        high, wide = pixels.shape
        return QtGui.QImage(pixels.data, wide, high, 4 * wide, kind).copy()

    def set_colors(self, colors: NDArray[np.uint8]) -> None:
        """Use other colours, (256, 4) RGBA, for all tiles."""
        self.colors, self.is_opaque = _packed(colors), bool((colors[:, 3] == 255).all())
        for versions in self._versions:
            np.add(versions, 1, out=versions)

    def write(self, x: int, y: int, data: NDArray[np.uint8]) -> None:
        """Write cells from a column and row on; tiles in which nothing changes stay as they are."""
        rows, columns = data.shape
        for row in range(y // TILE_PX, -(-(y + rows) // TILE_PX)):
            for column in range(x // TILE_PX, -(-(x + columns) // TILE_PX)):
                y0, x0 = max(y, row * TILE_PX), max(x, column * TILE_PX)
                y1, x1 = (
                    min(y + rows, (row + 1) * TILE_PX),
                    min(x + columns, (column + 1) * TILE_PX),
                )
                new = data[y0 - y : y1 - y, x0 - x : x1 - x] + np.uint8(1)
                here = self._cells[0][y0:y1, x0:x1]
                if not np.array_equal(here, new):
                    here[...] = new
                    self._spread(x0, y0, x1, y1)

    def _spread(self, x0: int, y0: int, x1: int, y1: int) -> None:
        """Compute the other levels of changed cells, and count the changes of their tiles."""
        for level, versions in enumerate(self._versions):
            if level:
                x0, y0, x1, y1 = x0 // 2, y0 // 2, -(-x1 // 2), -(-y1 // 2)
                below = self._cells[level - 1][2 * y0 : 2 * y1, 2 * x0 : 2 * x1]
                self._cells[level][y0:y1, x0:x1] = _halved(below)
            versions[y0 // TILE_PX : -(-y1 // TILE_PX), x0 // TILE_PX : -(-x1 // TILE_PX)] += 1


class GridChange(NamedTuple):
    """A map that was received or changed.

    Attributes:
        tiles: Its cells; the same object until size or resolution change.
        pose: x, y in metres and yaw in radians of its lower left corner in its frame.
        source: The message whose frame counts; for updates, the whole map.
        warning: What is odd about it; empty for nothing.
    """

    tiles: GridTiles
    pose: tuple[float, float, float]
    source: Any
    warning: str = ""


class _Header(NamedTuple):
    """The header of a map without its cells."""

    header: Any

    def __contains__(self, name: object) -> bool:
        return name == "header"


class GridReader:
    """Reads the maps of one topic, and their updates, on the worker thread.

    Args:
        colors: (256, 4) RGBA.
    """

    def __init__(self, colors: NDArray[np.uint8]) -> None:
        self._colors = colors
        self._tiles: GridTiles | None = None
        self._last: GridChange | None = None

    def set_colors(self, colors: NDArray[np.uint8]) -> None:
        """Use other colours; on the worker thread."""
        self._colors = colors
        if self._tiles is not None:
            self._tiles.set_colors(colors)

    def read(self, message: Any) -> GridChange | None:
        """Read a ``nav_msgs/OccupancyGrid`` or a ``map_msgs/OccupancyGridUpdate``.

        Raises:
            Error: It cannot be shown; what was shown before stays.
        """
        if "info" not in message:
            return self._read_update(message)
        info = message.info
        columns, rows, resolution = int(info.width), int(info.height), float(info.resolution)
        if not (math.isfinite(resolution) and 1e-6 <= resolution <= 1e6):
            raise Error(f"info.resolution is {resolution:g}: expected metres of a cell, above 0")
        pose, warning = planar(info.origin, "info.origin")
        data = _cells(message.data, columns, rows)
        tiles = self._tiles
        if tiles is None or (tiles.columns, tiles.rows, tiles.resolution) != (
            columns, rows, resolution,
        ):  # fmt: skip
            tiles = self._tiles = GridTiles(columns, rows, resolution)
            tiles.set_colors(self._colors)
        tiles.write(0, 0, data)
        self._last = GridChange(tiles, pose, _Header(_HeaderCopy.of(message.header)), warning)
        return self._last

    def _read_update(self, message: Any) -> GridChange | None:
        last = self._last
        if last is None:
            return None  # a whole map will come first
        tiles, x, y = last.tiles, int(message.x), int(message.y)
        columns, rows = int(message.width), int(message.height)
        if x < 0 or y < 0 or x + columns > tiles.columns or y + rows > tiles.rows:
            raise Error(
                f"an update of {columns} x {rows} cells at {x}, {y} is beyond the map of "
                f"{tiles.columns} x {tiles.rows} cells"
            )
        tiles.write(x, y, _cells(message.data, columns, rows))
        return last


class _Stamp(NamedTuple):
    sec: int
    nanosec: int


class _HeaderCopy(NamedTuple):
    """Frame and time of a message, without the memory of the message."""

    frame_id: str
    stamp: _Stamp

    @classmethod
    def of(cls, header: Any) -> _HeaderCopy:
        return cls(str(header.frame_id), _Stamp(0, 0))


def _cells(data: Any, columns: int, rows: int) -> NDArray[np.uint8]:
    if columns <= 0 or rows <= 0:
        raise Error(f"the map has {columns} x {rows} cells")
    if columns * rows > MOST_CELLS:
        most = MOST_CELLS // 1_000_000
        raise Error(f"{columns} x {rows} cells are more than the {most} million that are shown")
    cells = np.asarray(data)
    if cells.size != columns * rows:
        raise Error(
            f"the map has {cells.size} cells, expected {columns} x {rows} = {columns * rows}"
        )
    return cells.view(np.uint8).reshape(rows, columns)


def planar(pose: Any, name: str) -> tuple[tuple[float, float, float], str]:
    """Return x, y and yaw of a ``geometry_msgs/Pose``, and what is odd about it.

    A quaternion of zeros counts as no rotation, as in RViz.

    Raises:
        Error: A number is not finite.
    """
    at, turn = pose.position, pose.orientation
    x, y, z, w = (float(value) for value in (turn.x, turn.y, turn.z, turn.w))
    if not all(map(math.isfinite, (at.x, at.y, x, y, z, w))):
        raise Error(f"{name} has a number that is not finite")
    length = x * x + y * y + z * z + w * w
    warning = ""
    if length < 1e-12:
        w, warning = 1.0, f"{name}.orientation is 0, 0, 0, 0: shown without a rotation"
    elif abs(length - 1) > 0.1:
        warning = f"{name}.orientation is not normalised"
    yaw = math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return (float(at.x), float(at.y), yaw), warning

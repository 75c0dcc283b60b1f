"""Map tiles on this machine's disk: folders ``z/x/y.png``, and MBTiles files; no network access."""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from urllib.parse import quote

from rosglass.errors import Error
from rosglass.qt import QtCore, QtGui

if TYPE_CHECKING:
    from collections.abc import Callable
    from sqlite3 import Connection

    from rosglass.controls.maps.tiles import TileKey

__all__ = ["EARTH_M", "GeoTiles", "from_mercator", "open_tiles", "to_mercator"]

#: Half of the circumference of Web Mercator's Earth, in metres.
EARTH_M = math.pi * 6_378_137.0
#: Degrees of latitude that Web Mercator ends at.
_MAX_LATITUDE = 85.0511287798
#: Zoom levels that are read, the sides of a tile in pixels, and bytes of its file.
_MAX_ZOOM, _MAX_SIDE_PX, _MAX_BYTES = 24, 1024, 4 << 20
#: Levels below a missing tile that are searched for what is enlarged instead.
_MAX_ENLARGED = 4
_SUFFIXES = (".png", ".jpg", ".jpeg")
_SIDE_PX = 256


def to_mercator(latitude: float, longitude: float) -> tuple[float, float]:
    """Return Web Mercator metres, east and north, of degrees; latitudes beyond 85° are limited."""
    latitude = max(-_MAX_LATITUDE, min(_MAX_LATITUDE, latitude))
    y = math.log(math.tan(math.pi / 4 + math.radians(latitude) / 2)) / math.pi
    return longitude / 180 * EARTH_M, y * EARTH_M


def from_mercator(x: float, y: float) -> tuple[float, float]:
    """Return latitude and longitude in degrees."""
    angle = math.atan(math.exp(max(-20.0, min(20.0, y / EARTH_M * math.pi))))
    return math.degrees(2 * angle - math.pi / 2), x / EARTH_M * 180


class GeoTiles:
    """Tiles of the Earth; a :class:`~rosglass.controls.maps.tiles.TileSource` in Mercator metres.

    Args:
        read: Returns the file of zoom, column and row (from the north); None if it is missing.
            Called on the worker thread.
        least, most: The zoom levels.
        attribution: Whose data it is, as the file says; empty if it does not.
        close: Closes the file.
    """

    def __init__(
        self,
        read: Callable[[int, int, int], bytes | None],
        least: int,
        most: int,
        attribution: str = "",
        close: Callable[[], None] = lambda: None,
    ) -> None:
        if not 0 <= least <= most <= _MAX_ZOOM:
            raise Error(f"zoom levels {least} to {most}: expected 0 to {_MAX_ZOOM}")
        self._read, self._most, self.close = read, most, close
        self.attribution = attribution
        self.levels = most - least + 1
        self.least, self.most = least, most
        #: Why the last tile that is there could not be shown.
        self.problem = ""

    def zoom(self, level: int) -> int:
        """Return the zoom level of a level; level 0 is the finest."""
        return self._most - level

    def unit(self, level: int) -> float:
        """Return the metres of a pixel."""
        return 2 * EARTH_M / _SIDE_PX / 2.0 ** self.zoom(level)

    def range(
        self, level: int, box: tuple[float, float, float, float]
    ) -> tuple[int, int, int, int]:
        """Return the first column and row in a box, and those after the last."""
        count = 1 << self.zoom(level)
        side = 2 * EARTH_M / count
        left, bottom, right, top = box

        def limited(number: float) -> int:
            return int(min(max(math.floor(number), 0), count))

        c0, r0 = limited((left + EARTH_M) / side), limited((EARTH_M - top) / side)
        c1, r1 = (
            limited((right + EARTH_M) / side + 1), limited((EARTH_M - bottom) / side + 1)
        )  # fmt: skip
        return c0, r0, max(c0, c1), max(r0, r1)

    def rect(self, key: TileKey) -> tuple[float, float, float, float]:
        """Return left, bottom, width and height of a tile."""
        side = 2 * EARTH_M / (1 << self.zoom(key.level))
        return key.column * side - EARTH_M, EARTH_M - (key.row + 1) * side, side, side

    def version(self, key: TileKey) -> int:  # noqa: ARG002 - tiles do not change
        """Return a number that changes with the tile."""
        return 0

    def paint(self, key: TileKey) -> QtGui.QImage | None:
        """Return a tile's image; where it is missing, a part of a coarser one."""
        zoom = self.zoom(key.level)
        for up in range(min(_MAX_ENLARGED, zoom - self.least) + 1):
            column, row = key.column >> up, key.row >> up
            data = self._read(zoom - up, column, row)
            image = None if data is None else self._decode(data, f"{zoom - up}/{column}/{row}")
            if image is None:
                continue
            if not up:
                return image
            side = image.width() / (1 << up)
            x, y = (key.column - (column << up)) * side, (key.row - (row << up)) * side
            part = image.copy(round(x), round(y), max(1, round(side)), max(1, round(side)))
            smooth = QtCore.Qt.TransformationMode.SmoothTransformation
            aspect = QtCore.Qt.AspectRatioMode.IgnoreAspectRatio
            return part.scaled(_SIDE_PX, _SIDE_PX, aspect, smooth)
        return None

    def _decode(self, data: bytes, name: str) -> QtGui.QImage | None:
        if len(data) > _MAX_BYTES:
            self.problem = f"tile {name} has {len(data)} bytes, more than {_MAX_BYTES}"
            return None
        buffer = QtCore.QBuffer()
        buffer.setData(QtCore.QByteArray(data))
        reader = QtGui.QImageReader(buffer)
        # Before it is decoded: a small file may be a huge image.
        size = reader.size()
        if max(size.width(), size.height()) > _MAX_SIDE_PX:
            self.problem = f"tile {name} is {size.width()} x {size.height()} pixels large"
            return None
        image = reader.read()
        if image.isNull():
            self.problem = f"tile {name} is not an image: {reader.errorString()}"
            return None
        return image.convertToFormat(QtGui.QImage.Format.Format_ARGB32_Premultiplied)


def open_tiles(path: str) -> GeoTiles:
    """Open a folder or an MBTiles file; reads from it happen on the same thread.

    Raises:
        Error: It is missing, or is neither.
    """
    place = Path(path)
    if place.is_dir():
        return _open_folder(place)
    if place.is_file():
        return _open_mbtiles(place)
    raise Error(f"{path}: there is no such folder or MBTiles file")


def _open_folder(folder: Path) -> GeoTiles:
    zooms = [
        int(child.name) for child in folder.iterdir()
        if child.name.isdecimal() and len(child.name) < 3 and child.is_dir()
    ]  # fmt: skip
    zooms = [zoom for zoom in zooms if zoom <= _MAX_ZOOM]
    if not zooms:
        raise Error(f"{folder}: the folder has no tiles; they are expected as z/x/y.png or .jpg")

    def read(zoom: int, column: int, row: int) -> bytes | None:
        column_folder = folder / str(zoom) / str(column)
        found = (column_folder / f"{row}{suffix}" for suffix in _SUFFIXES)
        path = next((one for one in found if one.is_file()), None)
        if path is None:
            return None
        with suppress(OSError), path.open("rb") as file:  # another program may remove it
            return file.read(_MAX_BYTES + 1)
        return None

    return GeoTiles(read, min(zooms), max(zooms))


class _Metadata(NamedTuple):
    format: str
    least: int
    most: int
    attribution: str


def _open_mbtiles(file: Path) -> GeoTiles:
    import sqlite3  # noqa: PLC0415 - only for these files

    try:
        connection = sqlite3.connect(f"file:{quote(str(file.resolve()))}?mode=ro", uri=True)
    except sqlite3.Error as error:
        raise Error(f"{file}: {error}") from None
    try:
        found = _read_metadata(connection)
        if found.format not in ("png", "jpg", "jpeg"):
            raise Error(f"{file}: it has tiles of the format {found.format!r}, not png or jpg")

        def read(zoom: int, column: int, row: int) -> bytes | None:
            # MBTiles counts rows from the south.
            at = (zoom, column, (1 << zoom) - 1 - row)
            try:
                data = connection.execute(
                    "SELECT tile_data FROM tiles WHERE zoom_level = ? AND tile_column = ? "
                    "AND tile_row = ? LIMIT 1",
                    at,
                ).fetchone()
            except sqlite3.Error:
                return None
            return bytes(data[0]) if data is not None and isinstance(data[0], bytes) else None

        return GeoTiles(read, found.least, found.most, found.attribution, connection.close)
    except sqlite3.Error as error:
        connection.close()
        raise Error(f"{file}: it is not an MBTiles file: {error}") from None
    except Error:
        connection.close()
        raise


def _read_metadata(connection: Connection) -> _Metadata:
    names = ("format", "minzoom", "maxzoom", "attribution")
    rows = connection.execute(
        f"SELECT name, value FROM metadata WHERE name IN ({','.join('?' * len(names))})", names
    )
    found = {str(name): str(value) for name, value in rows.fetchmany(20)}
    least, most = (
        _zoom(connection, found.get(name, ""), pick)
        for name, pick in (("minzoom", "min"), ("maxzoom", "max"))
    )
    return _Metadata(found.get("format", "png"), least, most, found.get("attribution", "")[:200])


def _zoom(connection: Connection, value: str, pick: str) -> int:
    """Return a zoom level of the metadata; the one of the tiles if it is missing there."""
    if value.isdecimal() and len(value) < 3:
        return int(value)
    row = connection.execute(f"SELECT {pick}(zoom_level) FROM tiles").fetchone()
    if row is None or not isinstance(row[0], int):
        raise Error("the file has no tiles")
    return row[0]

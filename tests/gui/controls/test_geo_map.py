"""The control GeoMap: positions, and tiles from folders and MBTiles files."""

from __future__ import annotations

import math
import sqlite3
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.controls.maps.geo_tiles import from_mercator, open_tiles, to_mercator
from rosglass.errors import Error
from rosglass.qt import QtCore, QtGui

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

FIX = "sensor_msgs/msg/NavSatFix"
#: A place, and the column and row of its tile at zoom 14.
ZURICH, COLUMN, ROW = (47.3769, 8.5417), 8580, 5737
pytestmark = [pytest.mark.both_qt, pytest.mark.usefixtures("app")]


def tile(color: str, side: int = 256, kind: str = "PNG") -> bytes:
    """Return a tile of one colour."""
    image = QtGui.QImage(side, side, QtGui.QImage.Format.Format_RGB32)
    image.fill(QtGui.QColor(color))
    array = QtCore.QByteArray()
    buffer = QtCore.QBuffer(array)
    buffer.open(QtCore.QIODevice.OpenModeFlag.WriteOnly)
    image.save(buffer, kind)
    return bytes(array.data())


def folder_of(path: Path, tiles: dict[tuple[int, int, int], bytes], suffix: str = "png") -> Path:
    for (zoom, column, row), data in tiles.items():
        file = path / str(zoom) / str(column) / f"{row}.{suffix}"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(data)
    return path


def mbtiles_of(path: Path, tiles: dict[tuple[int, int, int], bytes], **metadata: str) -> Path:
    """Write an MBTiles file; rows are given from the north."""
    with sqlite3.connect(path) as file:
        file.execute("CREATE TABLE metadata (name text, value text)")
        file.execute(
            "CREATE TABLE tiles "
            "(zoom_level integer, tile_column integer, tile_row integer, tile_data blob)"
        )
        file.executemany("INSERT INTO metadata VALUES (?, ?)", list(metadata.items()))
        file.executemany(
            "INSERT INTO tiles VALUES (?, ?, ?, ?)",
            [(z, x, (1 << z) - 1 - y, data) for (z, x, y), data in tiles.items()],
        )
    file.close()
    return path


def fix(publisher: Any, place: tuple[float, float] = ZURICH, status: int = 0, **more: Any) -> None:
    publisher.publish(
        header={"frame_id": "gps"}, status={"status": status}, latitude=place[0],
        longitude=place[1], **more,
    )  # fmt: skip


def middle(controls: Any, dx: int = 60) -> str:
    """Return the colour beside the middle of the map, as a name."""
    plane = controls.find("plane")
    at = plane.mapToScene(QtCore.QPointF(plane.width() / 2 + dx, plane.height() / 2 + dx))
    return str(controls.grab().pixelColor(round(at.x()), round(at.y())).name())


@pytest.mark.parametrize("kind", ["folder", "mbtiles", "jpg"])
def test_position_is_shown_on_tiles(
    controls: Any, tmp_path: Path, wait: Callable[..., None], kind: str
) -> None:
    around = {
        (14, COLUMN + x, ROW + y): tile("#00ff00" if not x and not y else "#0000ff")
        for x in (-1, 0, 1)
        for y in (-1, 0, 1)
    }
    if kind == "mbtiles":
        path = mbtiles_of(tmp_path / "a b.mbtiles", around, format="png", attribution="© Someone")
    elif kind == "jpg":
        around = {key: tile("#00ff00", kind="JPG") for key in around}
        path = folder_of(tmp_path / "tiles", around, "jpg")
    else:
        path = folder_of(tmp_path / "tiles", around)
    publisher = controls.robot.create_publisher("/gps/fix", FIX)
    view = controls.show(f'GeoMap {{ anchors.fill: parent; tiles: "file://{path}" }}')
    wait(publisher.subscription_count)
    fix(publisher, position_covariance=[4, 0, 0, 0, 1, 0, 0, 0, 9], position_covariance_type=2)
    wait(lambda: not view.property("stale"))
    wait(lambda: view.property("scene").property("hasTiles"))
    tiles = view.property("scene").tiles
    wait(lambda: tiles.model.rows and tiles.is_complete)
    color = QtGui.QColor(middle(controls))
    assert color.green() > 200
    assert color.blue() < 100
    assert view.property("status") == ""
    assert view.property("accuracy") == pytest.approx(2 * 2.45)
    assert view.property("note") == "± 4.90 m"
    assert (view.property("latitude"), view.property("longitude")) == ZURICH
    ring = controls.find("circle")
    assert ring.width() == pytest.approx(
        2 * 4.9 * view.property("camera").scale / math.cos(math.radians(ZURICH[0])), rel=1e-3
    )
    expected = "© Someone" if kind == "mbtiles" else ""
    assert controls.find("attribution").property("text") == expected


def test_lost_fix_is_said_and_the_last_position_stays(
    controls: Any, wait: Callable[..., None]
) -> None:
    publisher = controls.robot.create_publisher("/fix", FIX)
    view = controls.show("GeoMap { anchors.fill: parent }")
    wait(publisher.subscription_count)
    fix(publisher, (math.nan, math.nan), -1)
    wait(lambda: view.property("status") == "NO FIX")
    assert not controls.find("mark").isVisible()
    fix(publisher)
    wait(lambda: view.property("status") == "")
    before = view.property("scene").robotX
    assert controls.find("mark").isVisible()
    assert math.isnan(view.property("accuracy")), "an unknown covariance"
    fix(publisher, (0.0, 0.0), -1)
    wait(lambda: view.property("status") == "NO FIX: the last position is shown")
    assert view.property("scene").robotX == before
    assert math.isnan(view.property("latitude"))
    fix(publisher, (math.nan, 8.0))
    wait(lambda: "no valid position" in view.property("status"))
    fix(publisher, (91.0, 8.0))
    fix(publisher, ZURICH, 2)
    wait(lambda: view.property("status") == "")
    assert view.property("fix") == "fix, ground-based augmentation"


@pytest.mark.parametrize(
    ("tiles", "named"),
    [
        ("https://tile.openstreetmap.org/", "is not read: tiles come from a folder"),
        ("file:///nowhere/at/all", "there is no such folder or MBTiles file"),
        ("file:///etc/hostname", "it is not an MBTiles file"),
        ("file:///etc", "the folder has no tiles"),
    ],
)
def test_tiles_that_cannot_be_read_are_named(
    controls: Any, wait: Callable[..., None], tiles: str, named: str
) -> None:
    publisher = controls.robot.create_publisher("/fix", FIX)
    view = controls.show(f'GeoMap {{ anchors.fill: parent; tiles: "{tiles}" }}')
    wait(publisher.subscription_count)
    fix(publisher)
    wait(lambda: named in view.property("status"), lambda: view.property("status"))
    wait(controls.find("mark").isVisible)  # the rest lives on


def test_moving_the_map_by_hand_ends_following(controls: Any, wait: Callable[..., None]) -> None:
    from rosglass.qt import optional

    publisher = controls.robot.create_publisher("/fix", FIX)
    view = controls.show("GeoMap { anchors.fill: parent }")
    wait(publisher.subscription_count)
    fix(publisher)
    wait(lambda: not view.property("stale"))
    camera, scene = view.property("camera"), view.property("scene")
    assert camera.centerX == pytest.approx(scene.robotX)
    controls.find("plane").forceActiveFocus()
    test: Any = optional("QtTest")
    test.QTest.keyClick(controls.window, QtCore.Qt.Key.Key_Left)
    assert not view.property("follow")
    fix(publisher, (ZURICH[0] + 0.001, ZURICH[1]))
    wait(lambda: len(scene.track.points) == 2)
    assert camera.centerX < scene.robotX - 1
    view.setProperty("follow", True)
    wait(lambda: camera.centerX == pytest.approx(scene.robotX))


def test_texts_of_the_grid_grow_with_the_theme(controls: Any) -> None:
    view = controls.show(
        "GeoMap { anchors.fill: parent; property real size: 1; onSizeChanged: Theme.scale = size }"
    )
    view.setProperty("size", 2)
    try:
        (marks,) = (
            item for item in controls.window.findChildren(QtCore.QObject) if hasattr(item, "paint")
            and item.property("gridSize")
        )  # fmt: skip
        image = QtGui.QImage(400, 300, QtGui.QImage.Format.Format_RGB32)
        painter = QtGui.QPainter(image)
        marks.paint(painter)
        size = painter.font().pixelSize()
        painter.end()
        assert size == 22
    finally:
        view.setProperty("size", 1)


def test_missing_tiles_are_parts_of_coarser_ones(tmp_path: Path) -> None:
    from rosglass.controls.maps.tiles import TileKey

    path = mbtiles_of(
        tmp_path / "a.mbtiles",
        {(0, 0, 0): tile("#ff0000"), (1, 0, 0): tile("#00ff00"), (3, 7, 7): tile("#0000ff")},
        format="png",
    )
    tiles = open_tiles(str(path))
    assert (tiles.least, tiles.most, tiles.levels) == (0, 3, 4)
    image = tiles.paint(TileKey(1, 1, 1))
    assert image is not None
    assert image.pixelColor(9, 9).name() == "#00ff00", "of zoom 1"
    image = tiles.paint(TileKey(0, 7, 0))
    assert image is not None
    assert image.pixelColor(9, 9).name() == "#ff0000", "of zoom 0"
    left, bottom, width, height = tiles.rect(TileKey(0, 7, 7))
    assert tiles.range(0, (left + 1, bottom + 1, left + width - 1, bottom + height - 1)) == (
        7,
        7,
        8,
        8,
    )
    tiles.close()


def test_hostile_tiles_are_refused(tmp_path: Path) -> None:
    from rosglass.controls.maps.tiles import TileKey

    bad = {(1, 0, 0): b"not an image", (1, 1, 0): tile("#ff0000", 2048), (1, 0, 1): bytes(5 << 20)}
    folder_of(tmp_path, bad)
    tiles = open_tiles(str(tmp_path))
    for (column, row), named in {
        (0, 0): "tile 1/0/0 is not an image",
        (1, 0): "tile 1/1/0 is 2048 x 2048 pixels large",
        (0, 1): "tile 1/0/1 has 4194305 bytes",
    }.items():
        assert tiles.paint(TileKey(0, column, row)) is None
        assert named in tiles.problem
    empty = mbtiles_of(tmp_path / "a.mbtiles", {}, format="png")
    with pytest.raises(Error, match="the file has no tiles"):
        open_tiles(str(empty))
    vector = mbtiles_of(tmp_path / "b.mbtiles", {(0, 0, 0): b"x"}, format="pbf")
    with pytest.raises(Error, match="tiles of the format 'pbf', not png or jpg"):
        open_tiles(str(vector))
    deep = mbtiles_of(tmp_path / "c.mbtiles", {(0, 0, 0): b"x"}, minzoom="0", maxzoom="40")
    with pytest.raises(Error, match="zoom levels 0 to 40"):
        open_tiles(str(deep))


def test_mercator_is_that_of_other_maps() -> None:
    x, y = to_mercator(*ZURICH)
    north = 6_378_137 * math.asinh(math.tan(math.radians(ZURICH[0])))
    assert (x, y) == pytest.approx((950_857.69, north), abs=0.01)
    assert from_mercator(x, y) == pytest.approx(ZURICH)
    assert to_mercator(90.0, 0.0)[1] == pytest.approx(math.pi * 6_378_137, rel=1e-6)

"""The element ``GeoScene``: where a robot with a satellite receiver is, on tiles of the Earth."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rosglass.comm.executor import Dispatcher
from rosglass.controls.maps.camera import MapCamera, Plane, Track
from rosglass.controls.maps.geo_tiles import (
    EARTH_M,
    GeoTiles,
    from_mercator,
    open_tiles,
    to_mercator,
)
from rosglass.controls.maps.tiles import TileImages, TileLayer
from rosglass.errors import Error
from rosglass.qml.elements.element import Element
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qml.engine.session import GuiExecutor, result_of, weak_callback
from rosglass.qt import Property, QtCore, QtGui, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.controls.maps.layers import MapLayer

__all__ = ["GeoScene"]

#: Metres between two points of the track, and in one step beyond which a new one begins.
_TRACK_STEP_M, _JUMP_M = 0.5, 1000.0
#: Standard deviations of the circle that holds 95 % of the positions.
_SIGMAS_95 = 2.45
#: Degrees between the lines of a grid, and heights of a text at least.
_STEPS = [
    step * 10.0**power for power in range(-7, 2) for step in (1, 2, 5)
    if step * 10.0**power <= 30
]  # fmt: skip
_LEAST = 8.0
_IDENTITY = Plane(1.0, 0.0, 0.0, 1.0, 0.0, 0.0)


def _degrees(value: float, sides: str, digits: int) -> str:
    return f"{abs(value):.{digits}f}° {sides[value < 0]}"


class GeoScene(Element):
    """The contents of a map of the Earth. See the page of ``GeoMap``."""

    _HOLDS = ("worker", "images", "track")

    repaint = Signal()
    layersChanged = Signal()
    tilesChanged = Signal()

    #: A folder of tiles or an MBTiles file; empty for none.
    tilesPath = Writable(str, "")
    #: Topics of geographic_msgs/GeoPath.
    paths = Writable(list, [])
    camera = Writable(QtCore.QObject, None, then="_on_camera")

    tiles = Property(QtCore.QObject, lambda self: self._layer, notify=tilesChanged)
    layers = Property(list, lambda self: list(self._layers.values()), notify=layersChanged)
    #: Whether tiles are shown.
    hasTiles = ReadOnly(bool, False)
    attribution = ReadOnly(str, "")
    #: The position that is shown, in Mercator metres; and its accuracy in metres on the ground.
    robotX = ReadOnly(float, 0.0, notify="robotMoved")
    robotY = ReadOnly(float, 0.0, notify="robotMoved")
    robotMoved = Signal()
    #: Whether there has been a position.
    robotSeen = ReadOnly(bool, False)
    #: Radius of the circle that holds 95 % of the positions, in metres; NaN while unknown.
    accuracy = ReadOnly(float, math.nan)
    #: The problem of the tiles; empty without one.
    tilesProblem = ReadOnly(str, "")

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self.worker = Dispatcher("rosglass geo map")
        self.track = Track(_TRACK_STEP_M, _JUMP_M)
        self._images: TileImages | None = None
        self._layer: TileLayer | None = None
        self._layers: dict[str, MapLayer] = {}
        self._source: GeoTiles | None = None
        worker = self.worker
        self.destroyed.connect(worker.close)

    @property
    def gui(self) -> GuiExecutor:
        """The executor of the GUI thread."""
        return self._executor

    def changed(self) -> None:
        """Paint again."""
        self.repaint.emit()

    # Tiles and layers.

    def _wanted(self) -> tuple[Any, ...] | None:
        return (self.tilesPath,) if self.tilesPath else None

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        path, executor = wanted[0], self._executor
        done = weak_callback(self._on_opened)

        def work() -> None:
            result = result_of(lambda: open_tiles(path), "opening tiles")
            executor.post(lambda: done(wanted, result))

        self.worker.post(work)

    def _on_opened(self, wanted: tuple[Any, ...], result: GeoTiles | Error) -> None:
        if not is_alive(self) or self._config is not wanted:
            if not isinstance(result, Error):
                result.close()
            return
        if isinstance(result, Error):
            report(self, tilesProblem=str(result))
            return
        self._set_endpoint(result)

    def _dispose(self, session: Any, endpoint: GeoTiles) -> None:  # noqa: ARG002 - the base's
        # On the thread that reads from it.
        self.worker.post(endpoint.close)

    def _on_created(self, endpoint: GeoTiles) -> None:
        if self._layer is None:
            images = TileImages(self._runtime.engine if self._runtime is not None else None)
            self._cleanup["images"] = images.close
            self._layer = TileLayer(self, images, self.worker, self._executor)
            self._layer.keeps_cells = False
            self.tilesChanged.emit()
        self._layer.set_source(endpoint)
        self._layer.set_view(self._map_camera(), _IDENTITY)
        report(self, tilesProblem="", hasTiles=True, attribution=endpoint.attribution)

    def _on_closed(self, endpoint: GeoTiles | None) -> None:  # noqa: ARG002 - the base's
        if self._layer is not None:
            self._layer.set_source(None)
        report(self, tilesProblem="", hasTiles=False, attribution="")

    def _update(self) -> None:
        super()._update()
        wanted = [str(topic) for topic in self.paths] if self.node is not None else []
        if wanted == [*self._layers]:
            return
        from rosglass.controls.maps.layers import GeoPathLayer  # noqa: PLC0415 - numpy takes 70 ms

        before, self._layers = self._layers, {}
        for topic in wanted:
            kept = before.pop(topic, None)
            self._layers[topic] = GeoPathLayer(self, topic) if kept is None else kept
        self.layersChanged.emit()
        for layer in before.values():
            layer.deleteLater()

    @Slot()
    def _on_tick(self) -> None:
        tiles = self._endpoint
        if tiles is not None:
            report(self, tilesProblem=tiles.problem)

    # The camera.

    def _map_camera(self) -> MapCamera | None:
        camera: Any = self.camera
        return camera if isinstance(camera, MapCamera) else None

    def _on_camera(self) -> None:
        camera = self._map_camera()
        if camera is not None:
            # Signals do not reach methods of objects that QML extends, but they reach functions.
            camera.changed.connect(weak_callback(self._follow_camera))
            if self._layer is not None:
                self._layer.set_view(camera, _IDENTITY)
        self.changed()

    def _follow_camera(self) -> None:
        if is_alive(self):
            if self._layer is not None:
                self._layer.refresh()
            self.repaint.emit()

    # The position.

    @Slot(float, float, float, float, float, result=bool)
    def setPosition(
        self, latitude: float, longitude: float, east: float, north: float, both: float
    ) -> bool:
        """Show a position in degrees, and its covariances in square metres; NaN if unknown.

        Returns:
            Whether they are degrees on the Earth.
        """
        if not (abs(latitude) <= 90 and abs(longitude) <= 180):
            return False
        x, y = to_mercator(latitude, longitude)
        self.track.append(x, y)
        # The larger half axis of the ellipse.
        middle, half = (east + north) / 2, (east - north) / 2
        variance = middle + math.hypot(half, both)
        known = math.isfinite(variance) and variance >= 0
        report(
            self,
            robotX=x,
            robotY=y,
            robotSeen=True,
            accuracy=_SIGMAS_95 * math.sqrt(variance) if known else math.nan,
        )
        self.repaint.emit()
        return True

    @Slot()
    def clearTrack(self) -> None:
        """Begin a new track."""
        self.track.clear()
        self.repaint.emit()

    @Slot(float, float, result=QtCore.QPointF)
    def toMap(self, latitude: float, longitude: float) -> QtCore.QPointF:
        """Return Mercator metres of degrees."""
        return QtCore.QPointF(*to_mercator(latitude, longitude))

    @Slot(float, float, result=QtCore.QPointF)
    def toDegrees(self, x: float, y: float) -> QtCore.QPointF:
        """Return latitude and longitude of Mercator metres."""
        return QtCore.QPointF(*from_mercator(x, y))

    @Slot(float, float, result=str)
    def describe(self, x: float, y: float) -> str:
        """Return the coordinates of a point in Mercator metres."""
        latitude, longitude = from_mercator(x, y)
        if abs(longitude) > 180:
            return ""
        return ", ".join((_degrees(latitude, "NS", 6), _degrees(longitude, "EW", 6)))

    @Slot(float, result=float)
    def stretch(self, y: float) -> float:
        """Return Mercator metres of a metre on the ground."""
        return 1 / math.cos(math.radians(from_mercator(0.0, y)[0]))

    # Painting.

    def paint_under(self, painter: QtGui.QPainter, color: QtGui.QColor, size: float) -> None:
        """Paint a grid of degrees, with texts of a height in pixels, where there are no tiles."""
        camera = self._map_camera()
        if camera is None or self.hasTiles:
            return
        left, bottom, right, top = camera.box()
        left, right = max(left, -EARTH_M), min(right, EARTH_M)
        bottom, top = max(bottom, -EARTH_M), min(top, EARTH_M)
        if left >= right or bottom >= top:
            return
        south, west = from_mercator(left, bottom)
        north, east = from_mercator(right, top)
        view = camera.to_screen()
        faint = QtGui.QColor(color)
        faint.setAlphaF(0.35)
        degrees = _LEAST * size / math.hypot(view.a, view.c) / EARTH_M * 180
        step = next((one for one in _STEPS if one >= degrees), 30.0)
        digits = max(0, math.ceil(-math.log10(step) - 1e-9))
        font = painter.font()
        font.setPixelSize(max(1, round(size)))
        painter.setFont(font)
        for first, last, is_latitude in ((west, east, False), (south, north, True)):
            for number in range(math.ceil(first / step), math.floor(last / step) + 1)[:200]:
                value = number * step
                ends = [
                    to_mercator(value, end) if is_latitude else to_mercator(end, value)
                    for end in ((west, east) if is_latitude else (south, north))
                ]
                a, b = (QtCore.QPointF(*view.apply(*end)) for end in ends)
                painter.setPen(faint)
                painter.drawLine(a, b)
                painter.setPen(color)
                at = (4.0, a.y() - 3) if is_latitude else (a.x() + 3, camera.height - 2.3 * size)
                text = _degrees(value, "NS" if is_latitude else "EW", digits)
                painter.drawText(QtCore.QPointF(*at), text)

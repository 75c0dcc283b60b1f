"""The displays Map (occupancy grids, costmaps and their updates) and GridCells."""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from rosglass.comm.qos import QoS, Reliability
from rosglass.errors import Error
from rosglass.images.grid_colors import grid_colors
from rosglass.messages import read_columns
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.scene.configs.settings import Setting, rgb_of
from rosglass.scene.displays.topic_display import TopicDisplay
from rosglass.scene.render.arrays import are_drawable, check_numbers
from rosglass.scene.render.drawing import MapImage, Points
from rosglass.scene.render.matrices import matrix_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = ["GridCellsDisplay", "MapDisplay"]

_MAX_SIDE = 16384
_MAX_CELLS = 2_000_000


class _Grid(NamedTuple):
    """A whole map.

    Attributes:
        cells: (rows, columns) bytes.
        resolution: Metres of a cell.
        origin: Pose of its lower left corner in its frame.
        replaces_all: Earlier maps and updates do not count any more.
    """

    cells: NDArray[np.uint8]
    resolution: float
    origin: NDArray[np.float64]
    replaces_all: bool = True


class _Update(NamedTuple):
    """A part of a map.

    Attributes:
        x, y: Column and row where it begins.
        cells: (rows, columns) bytes.
    """

    x: int
    y: int
    cells: NDArray[np.uint8]


def _cells_of(message: Any, width: int, height: int) -> NDArray[np.uint8]:
    if not (0 < width <= _MAX_SIDE and 0 < height <= _MAX_SIDE):
        raise Error(f"width {width}, height {height}: expected 1 to {_MAX_SIDE} cells")
    data = np.asarray(message.data)
    if len(data) != width * height:
        raise Error(f"data: {len(data)} cells; expected {width} x {height} = {width * height}")
    return data.view(np.uint8).reshape(height, width)


def _read_map(message: Any) -> _Grid | _Update:
    if "info" not in message:
        cells = _cells_of(message, message.width, message.height)
        return _Update(message.x, message.y, cells.copy())
    info = message.info
    resolution = float(info.resolution)
    if not (np.isfinite(resolution) and resolution > 0):
        raise Error(f"info.resolution: expected metres above 0, got {resolution}")
    check_numbers("info.resolution", resolution)
    cells = _cells_of(message, info.width, info.height)
    return _Grid(cells.copy(), resolution, matrix_of(info.origin))


class MapDisplay(TopicDisplay):
    """A map or costmap, with updates. See its page in ``docs/scene.md``."""

    TYPE = "Map"
    MESSAGES = ("nav_msgs/OccupancyGrid", "map_msgs/OccupancyGridUpdate")
    SUGGESTED = MESSAGES[:1]
    KEEPS_ALL = True
    #: A kept update may be older than the map.
    FURTHER_QOS: ClassVar[QoS] = QoS(reliability=Reliability.BEST_AVAILABLE)

    alpha = Setting("Alpha", "float", 0.7, "Opacity.", min=0.0, max=1.0)
    colorScheme = Setting(
        "Color Scheme", "enum", "map", "Colours of the values.", choices=["map", "costmap", "raw"]
    )
    drawBehind = Setting("Draw Behind", "bool", False, "Draw it below everything else.")
    useTimestamp = Setting(
        "Use Timestamp", "bool", False, "Place it at its own time, not the newest.",
        then="_place_again",
    )  # fmt: skip
    updateTopic = Setting(
        "Update Topic", "topic", "", "Topic of updates; by default the topic with _updates.",
        then="_schedule",
    )  # fmt: skip

    #: Metres of a cell; 0 before the first map.
    resolution = ReadOnly(float, 0.0)
    #: Cells in x and y.
    columns = ReadOnly(int, 0)
    rows = ReadOnly(int, 0)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._image = MapImage()
        self._image.owner = self
        #: A copy of the received cells, as updates are written into it.
        self._cells: NDArray[np.uint8] | None = None
        self._corner: NDArray[np.float64] = np.eye(4)
        self._where = ("", 0)
        super().__init__(parent, runtime)

    @property
    def cells(self) -> NDArray[np.uint8] | None:
        """The map with its updates, (rows, columns) bytes; None before the first one."""
        return self._cells

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a file, in which RViz 2 has chosen the topic of updates."""
        refused = super().load_settings(saved)
        if self.updateTopic == f"{self.topic}_updates":
            self.updateTopic = ""  # it follows the topic
        return refused

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file, with the topic of updates, which RViz 2 needs."""
        kept = super().save_settings(older, ros)
        if self.topic and not self.updateTopic:
            before, updates = kept["Update Topic"], f"{self.topic}_updates"
            kept["Update Topic"] = (
                {**before, "Value": updates} if isinstance(before, dict) else updates
            )
        return kept

    def suggested(self, path: str) -> tuple[str, ...]:
        """Return the types of the topics that panels suggest for a setting."""
        return self.MESSAGES[1:] if path == "Update Topic" else super().suggested(path)

    def further_topics(self, topic: str) -> tuple[str, ...]:
        """Return the topic of updates."""
        return self._resolve_further("Update Topic", self.updateTopic or f"{topic}_updates")

    def preparer(self) -> Callable[[Any], Any]:
        """Return the function that checks and copies cells."""
        return _read_map

    def _show_waiting(self) -> None:
        #: The map with the updates that are here: it is copied once for all of them.
        changed: NDArray[np.uint8] | None = None
        while self._waiting:
            item = self._waiting.popleft()
            if isinstance(item.data, _Grid):
                self._last = item
                self._where = (item.frame, item.stamp)
                self._cells, self._corner = item.data.cells, item.data.origin
                self.root.add(self._image)
                self._image.set_cells(self._cells, item.data.resolution)
                rows, columns = self._cells.shape
                report(self, resolution=item.data.resolution, rows=rows, columns=columns)
                self.delete_status("Update")
                changed = None
            elif self._fits(item.data):
                assert self._cells is not None
                if changed is None:
                    changed = self._cells = self._cells.copy()
                x, y, cells = item.data
                changed[y : y + len(cells), x : x + cells.shape[1]] = cells
        if changed is not None:
            self._image.set_cells(changed, self.resolution)
        self._place_again()

    def _fits(self, update: _Update) -> bool:
        """Return whether an update is within the map; the status says why it is not."""
        if self._cells is None:
            self.set_status("Update", "warn", "an update arrived before the map and is ignored")
            return False
        rows, columns = update.cells.shape
        x, y = update.x, update.y
        if x < 0 or y < 0 or x + columns > self._cells.shape[1] or y + rows > self._cells.shape[0]:
            whole = f"{self._cells.shape[1]} x {self._cells.shape[0]}"
            text = f"x {x}, y {y}, {columns} x {rows} cells: beyond the map of {whole} cells"
            self.set_status("Update", "error", text)
            return False
        self.delete_status("Update")
        return True

    def _place_again(self) -> None:
        if self._cells is None:
            return
        frame, stamp = self._where
        pose = self.place_of(frame, stamp if self.useTimestamp else 0)
        self._image.visible = pose is not None
        if pose is not None:
            self._image.pose = pose @ self._corner

    def followed_frames(self) -> tuple[str, ...]:
        """Return the map's frame, unless it is placed at its own time."""
        return () if self.useTimestamp or self._cells is None else (self._where[0],)

    def on_transforms(self) -> None:
        """Follow the map's frame."""
        self._place_again()

    def on_fixed_frame(self) -> None:
        """Place the map in the new fixed frame."""
        self._place_again()

    def _restyle(self) -> None:
        self._image.set_palette(grid_colors(self.colorScheme))
        self._image.set_look(alpha=self.alpha, below=self.drawBehind)

    def reset(self) -> None:
        """Drop the map."""
        super().reset()
        self._cells = None
        report(self, resolution=0.0, rows=0, columns=0)


class GridCellsDisplay(TopicDisplay):
    """The cells of a ``nav_msgs/GridCells``. See its page in ``docs/scene.md``."""

    TYPE = "GridCells"
    MESSAGES = ("nav_msgs/GridCells",)

    color = Setting("Color", "color", "#19ff00", "Colour of the cells.")
    alpha = Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._cells = Points()
        self._cells.owner = self
        self._size = 0.0
        super().__init__(parent, runtime)

    def preparer(self) -> Callable[[Any], Any]:
        """Return the function that reads cells."""
        return _read_cells

    def show(self, data: Any, pose: NDArray[np.float64], frame: str, stamp: int) -> None:  # noqa: ARG002
        """Show cells as rectangles in the plane of their frame."""
        points, self._size, height = data
        # Tiles are squares: the other side comes with the pose.
        self._cells.set_points(points)
        self._cells.pose = pose @ np.diag([1.0, height / self._size, 1.0, 1.0])
        self.root.add(self._cells)
        self._restyle()

    def _restyle(self) -> None:
        coloring = replace(self._cells.coloring, mode="flat", first=rgb_of(self.color))
        # RViz draws cells twice.
        alpha = 1 - (1 - self.alpha) ** 2
        self._cells.set_look(style="tiles", size=self._size, coloring=coloring, alpha=alpha)


def _read_cells(message: Any) -> tuple[NDArray[np.float32], float, float]:
    width, height = float(message.cell_width), float(message.cell_height)
    if not (np.isfinite([width, height]).all() and width > 0 and height > 0):
        raise Error(f"cell_width {width}, cell_height {height}: expected metres above 0")
    check_numbers("cell_width, cell_height", (width, height))
    if len(message.cells) > _MAX_CELLS:
        raise Error(f"cells: {len(message.cells)} are more than the {_MAX_CELLS} that are drawn")
    points = read_columns(message.cells, "x", "y", "z")
    check_numbers("cells", points)
    # Tiles are squares.
    points[:, 1] *= width / height
    if not are_drawable([width / height, height / width]).all() or not are_drawable(points).all():
        raise Error(f"cell_width {width}, cell_height {height}: one is too small for the other")
    return points.astype(np.float32), width, height

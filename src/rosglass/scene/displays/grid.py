"""The displays Grid and Axes."""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rosglass.scene.configs.rviz_formats import FIXED_FRAME
from rosglass.scene.configs.settings import Setting, rgb_of
from rosglass.scene.displays.display import Display
from rosglass.scene.displays.shapes import AxesShapes
from rosglass.scene.render.drawing import Lines
from rosglass.scene.render.scene_tree import Group

if TYPE_CHECKING:
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = ["AxesDisplay", "GridDisplay"]


class _InFrame(Display):
    """A display that stays in one frame of the robot."""

    frame = Setting("Reference Frame", "frame", FIXED_FRAME, "Frame in which it is drawn.")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._body = Group()
        super().__init__(parent, runtime)
        self.root.add(self._body)

    def followed_frames(self) -> tuple[str, ...]:
        """Return the frame that it is drawn in."""
        return (str(self.frame),)

    def on_transforms(self) -> None:
        """Follow the frame."""
        if not self.shown:
            return
        pose = self.place_of(self.frame)
        self._body.visible = pose is not None
        if pose is not None:
            self._body.pose = pose

    def leave(self) -> None:
        """Stop being shown."""
        super().leave()
        self.root.add(self._body)


class GridDisplay(_InFrame):
    """A grid of lines, in a plane or through space. See its page in ``docs/scene.md``."""

    TYPE = "Grid"

    planeCellCount = Setting(
        "Plane Cell Count", "int", 10, "Cells in each direction of the plane.", min=1, max=10000
    )
    normalCellCount = Setting(
        "Normal Cell Count", "int", 0, "Cells perpendicular to the plane.", min=0, max=1000
    )
    cellSize = Setting("Cell Size", "float", 1.0, "Side length of a cell, in metres.", min=0.0001)
    lineStyle = Setting(
        "Line Style", "enum", "Lines", "How lines are drawn.", choices=["Lines", "Billboards"]
    )
    lineWidth = Setting(
        "Line Style/Line Width", "float", 0.03, "Width of billboards, in metres.", min=0.001,
        shown_if={"lineStyle": "Billboards"},
    )  # fmt: skip
    color = Setting("Color", "color", "#a0a0a4", "Colour of the lines.")
    alpha = Setting("Alpha", "float", 0.5, "Opacity.", min=0.0, max=1.0)
    plane = Setting("Plane", "enum", "XY", "Plane of the grid.", choices=["XY", "XZ", "YZ"])
    offset = Setting("Offset", "vector", [0, 0, 0], "Position of the grid's centre, in metres.")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._lines = Lines()
        super().__init__(parent, runtime)
        self._body.add(self._lines)

    def _restyle(self) -> None:
        cells, high, size = self.planeCellCount, self.normalCellCount, self.cellSize
        # As many lines as can be distinguished; more than that is a solid plane.
        if (2 * cells + 2) * (high + 1) > 500_000:
            self.set_status("Grid", "error", "too many lines; choose fewer cells")
            return
        self.delete_status("Grid")
        reach = cells * size / 2
        at = np.linspace(-reach, reach, cells + 1)
        one, far = np.ones_like(at), np.full_like(at, reach)
        segments = []
        for level in (np.arange(high + 1) - high / 2) * size:
            flat = one * level
            segments.append(
                np.stack([np.stack([at, -far, flat], 1), np.stack([at, far, flat], 1)], 1)
            )
            segments.append(
                np.stack([np.stack([-far, at, flat], 1), np.stack([far, at, flat], 1)], 1)
            )
        if high:
            x, y = (values.reshape(-1) for values in np.meshgrid(at, at))
            up = np.full_like(x, high * size / 2)
            segments.append(np.stack([np.stack([x, y, -up], 1), np.stack([x, y, up], 1)], 1))
        order = {"XY": (0, 1, 2), "XZ": (0, 2, 1), "YZ": (2, 0, 1)}[self.plane]
        middle = [self.offset.x(), self.offset.y(), self.offset.z()]
        self._lines.in_metres = self.lineStyle == "Billboards"
        self._lines.set_segments(
            np.concatenate(segments)[..., order] + middle, (*rgb_of(self.color), self.alpha)
        )
        self._lines.set_look(width=self.lineWidth if self._lines.in_metres else 1.0)
        self.on_transforms()


class AxesDisplay(_InFrame):
    """The axes of a frame. See its page in ``docs/scene.md``."""

    TYPE = "Axes"

    length = Setting("Length", "float", 1.0, "Length of an axis, in metres.", min=0.0001)
    radius = Setting("Radius", "float", 0.1, "Radius of an axis, in metres.", min=0.0001)
    alpha = Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._axes = AxesShapes(self)
        super().__init__(parent, runtime)
        self._body.add(self._axes)

    def _restyle(self) -> None:
        self._axes.set_axes(np.eye(4), self.length, self.radius, self.alpha)
        self.on_transforms()

"""The display Path: the poses of a ``nav_msgs/Path``, as a line and optionally each on its own."""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import Error
from rosglass.scene.display import TopicDisplay
from rosglass.scene.displays.shapes import ArrowShapes, AxesShapes, poses_matrices
from rosglass.scene.drawing import Lines
from rosglass.scene.settings import Setting, rgb_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rosglass.qml.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = ["PathDisplay"]

_MAX_POSES = 500_000


class PathDisplay(TopicDisplay):
    """A path. See its page in ``docs/scene.md``."""

    TYPE = "Path"
    MESSAGES = ("nav_msgs/Path",)

    lineStyle = Setting(
        "Line Style", "enum", "Lines", "How the line is drawn.", choices=["Lines", "Billboards"]
    )
    lineWidth = Setting("Line Width", "float", 0.03, "Of billboards, in metres.", min=0.001)
    color = Setting("Color", "color", "#19ff00", "The colour of the line.")
    alpha = Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0)
    bufferLength = Setting(
        "Buffer Length", "int", 1, "How many paths are shown.", min=1, max=1000, then="_on_length"
    )
    offset = Setting("Offset", "vector", [0, 0, 0], "Of the path, in metres.")
    poseStyle = Setting(
        "Pose Style", "enum", "None", "How poses are drawn.", choices=["None", "Axes", "Arrows"]
    )
    axesLength = Setting("Length", "float", 0.3, "Of axes, in metres.", min=0.0)
    axesRadius = Setting("Radius", "float", 0.03, "Of axes, in metres.", min=0.0)
    poseColor = Setting("Pose Color", "color", "#ff55ff", "Of arrows.")
    shaftLength = Setting("Shaft Length", "float", 0.1, "Of arrows, metres.", min=0.0)
    headLength = Setting("Head Length", "float", 0.2, "Of arrows, metres.", min=0.0)
    shaftDiameter = Setting("Shaft Diameter", "float", 0.1, "In metres.", min=0.0)
    headDiameter = Setting("Head Diameter", "float", 0.3, "In metres.", min=0.0)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        #: The paths that are shown, the oldest first: poses, and matrices.
        self._paths: list[_Path] = []
        super().__init__(parent, runtime)

    def shows_all(self) -> bool:
        """Return whether earlier paths are shown as well."""
        return bool(self.bufferLength > 1)

    def preparer(self) -> Any:
        """Return the function that reads poses."""
        return _read_poses

    def show(self, data: NDArray[np.float64], pose: Any, frame: str, stamp: int) -> None:  # noqa: ARG002
        """Show a path, beside earlier ones."""
        path = _Path(data, self)
        path.place(pose)
        self._paths.append(path)
        self.root.add(*path.parts)
        self._restyle()

    def reset(self) -> None:
        """Drop all paths."""
        super().reset()
        self._paths.clear()

    def _restyle(self) -> None:
        while len(self._paths) > self.bufferLength:
            for part in self._paths.pop(0).parts:
                part.remove()
        for path in self._paths:
            path.restyle(self)


class _Path:
    """One path: a line, and axes or arrows at its poses."""

    def __init__(self, poses: NDArray[np.float64], owner: PathDisplay) -> None:
        self._poses = poses
        self._line, self._axes, self._arrows = Lines(), AxesShapes(owner), ArrowShapes(owner)
        self._line.owner = owner
        self.parts = (self._line, self._axes, self._arrows)

    def place(self, pose: NDArray[np.float64]) -> None:
        for part in self.parts:
            part.pose = pose

    def restyle(self, display: PathDisplay) -> None:
        shift = np.array([display.offset.x(), display.offset.y(), display.offset.z()])
        points = self._poses[:, :3] + shift
        self._line.in_metres = display.lineStyle == "Billboards"
        self._line.set_strip(points, (*rgb_of(display.color), display.alpha))
        self._line.set_look(width=display.lineWidth if self._line.in_metres else 1.0)
        matrices = poses_matrices(points, self._poses[:, 3:])
        none = matrices[:0]
        style = display.poseStyle
        self._axes.set_axes(
            matrices if style == "Axes" else none, display.axesLength, display.axesRadius
        )
        self._arrows.set_arrows(
            matrices if style == "Arrows" else none,
            (display.shaftLength, display.shaftDiameter),
            (display.headLength, display.headDiameter),
            (*rgb_of(display.poseColor), display.alpha),
        )


def _read_poses(message: Any) -> NDArray[np.float64]:
    """Return position and quaternion of each pose, (n, 7)."""
    count = len(message.poses)
    if count > _MAX_POSES:
        raise Error(f"poses: {count} are more than the {_MAX_POSES} that are shown")
    out = np.empty((count, 7))
    for at, stamped in enumerate(message.poses):
        p, q = stamped.pose.position, stamped.pose.orientation
        out[at] = (p.x, p.y, p.z, q.x, q.y, q.z, q.w)
    return out

"""The displays of poses: Pose, PoseArray, Path, PoseWithCovariance and Odometry."""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from rosglass.errors import Error
from rosglass.messages import read_columns
from rosglass.scene.configs.settings import Setting, rgb_of
from rosglass.scene.displays.shapes import ALONG, ArrowShapes, AxesShapes
from rosglass.scene.displays.topic_display import HistoryDisplay, TopicDisplay
from rosglass.scene.render.arrays import check_numbers
from rosglass.scene.render.drawing import Lines, Mesh
from rosglass.scene.render.matrices import matrix_of, poses_matrices, stack_poses
from rosglass.scene.render.mesh_shapes import CONE, CYLINDER, SPHERE
from rosglass.scene.render.scene_tree import Group

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = [
    "OdometryDisplay",
    "PathDisplay",
    "PoseArrayDisplay",
    "PoseDisplay",
    "PoseWithCovarianceDisplay",
]

_MAX_POSES = 100_000
#: Paths of a pose's position and quaternion in its message.
_POSE_PATHS = (
    *("position.x", "position.y", "position.z"),
    *("orientation.x", "orientation.y", "orientation.z", "orientation.w"),
)
#: Poses of an odometry that are shown.
_MAX_KEPT = 10_000
#: Deviations of orientations that are drawn as this, as in RViz.
_MAX_DEVIATION_RAD = math.radians(89)
#: Conditions of settings: the styles of a path that they belong to.
_BILLBOARDS = {"lineStyle": "Billboards"}
_POSE_AXES, _POSE_ARROWS = {"poseStyle": "Axes"}, {"poseStyle": "Arrows"}
#: Conditions of settings: the shapes and covariances that they belong to.
_ARROW, _AXES = {"shape": "Arrow"}, {"shape": "Axes"}
_FLAT_ARROW, _SOLID_ARROW = {"shape": "Arrow (Flat)"}, {"shape": "Arrow (3D)"}
_ANY_ARROW = {"shape": ("Arrow (Flat)", "Arrow (3D)")}
_COVARIANCE = {"covariance": True}
_POSITION, _ORIENTATION = {"covariancePosition": True}, {"covarianceOrientation": True}


def _metres(path: str, default: float, shown_if: Mapping[str, Any]) -> Setting:
    """Return the setting of a length, and the settings for which it has an effect."""
    text = f"{path.rpartition('/')[2].capitalize()} in metres."
    return Setting(path, "float", default, text, min=0.0, shown_if=shown_if)


def _shape_settings() -> tuple[Setting, ...]:
    """Return the settings of a pose that is shown as an arrow or as axes."""
    return (
        Setting("Shape", "enum", "Arrow", "How a pose is drawn.", choices=["Arrow", "Axes"]),
        Setting("Color", "color", "#ff1900", "Colour of arrows.", shown_if=_ARROW),
        Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0),
        _metres("Shaft Length", 1.0, _ARROW),
        _metres("Shaft Radius", 0.05, _ARROW),
        _metres("Head Length", 0.3, _ARROW),
        _metres("Head Radius", 0.1, _ARROW),
        _metres("Axes Length", 1.0, _AXES),
        _metres("Axes Radius", 0.1, _AXES),
    )


class _PoseShapes(Group):
    """Poses as arrows or axes.

    Args:
        display: The display, whose settings say how.
        arrow: The value of its setting `shape` for arrows; for axes, it is ``Axes``.
    """

    def __init__(self, display: Any, arrow: str = "Arrow") -> None:
        self._display, self._arrow = display, arrow
        self._arrows, self._axes = ArrowShapes(display), AxesShapes(display)
        super().__init__(self._arrows, self._axes)

    def draw(self, poses: NDArray[np.float64]) -> None:
        """Draw poses, (n, 4, 4), instead of those before."""
        display, none = self._display, poses[:0]
        self._arrows.set_arrows(
            poses if display.shape == self._arrow else none,
            # RViz takes what it calls radius for the diameter.
            (display.shaftLength, display.shaftRadius),
            (display.headLength, display.headRadius),
            (*rgb_of(display.color), display.alpha),
        )
        self._axes.set_axes(
            poses if display.shape == "Axes" else none,
            display.axesLength,
            display.axesRadius,
            display.alpha,
        )


def _read_pose(message: Any) -> NDArray[np.float64]:
    return matrix_of(message.pose)


class PoseDisplay(TopicDisplay):
    """A ``geometry_msgs/PoseStamped``. See its page in ``docs/scene.md``."""

    TYPE = "Pose"
    MESSAGES = ("geometry_msgs/PoseStamped",)

    shape, color, alpha, *_lengths = _shape_settings()
    shaftLength, shaftRadius, headLength, headRadius, axesLength, axesRadius = _lengths

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._shapes = _PoseShapes(self)
        self._poses: NDArray[np.float64] = np.zeros((0, 4, 4))
        super().__init__(parent, runtime)

    def preparer(self) -> Callable[[Any], Any]:
        """Return the function that reads the pose."""
        return _read_pose

    def show(self, data: Any, pose: NDArray[np.float64], frame: str, stamp: int) -> None:  # noqa: ARG002
        """Show a pose."""
        self._poses = stack_poses(pose @ data)
        self.root.add(self._shapes)
        self._restyle()

    def _restyle(self) -> None:
        self._shapes.draw(self._poses)

    def reset(self) -> None:
        """Drop the pose."""
        super().reset()
        self._poses = self._poses[:0]


class PoseArrayDisplay(TopicDisplay):
    """The poses of a ``geometry_msgs/PoseArray``. See its page in ``docs/scene.md``."""

    TYPE = "PoseArray"
    MESSAGES = ("geometry_msgs/PoseArray",)

    shape = Setting(
        "Shape", "enum", "Arrow (Flat)", "How poses are drawn.",
        choices=["Arrow (Flat)", "Arrow (3D)", "Axes"],
    )  # fmt: skip
    color = Setting("Color", "color", "#ff1900", "Colour of arrows.", shown_if=_ANY_ARROW)
    alpha = Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0)
    arrowLength = _metres("Arrow Length", 0.3, _FLAT_ARROW)
    headRadius = _metres("Head Radius", 0.03, _SOLID_ARROW)
    headLength = _metres("Head Length", 0.07, _SOLID_ARROW)
    shaftRadius = _metres("Shaft Radius", 0.01, _SOLID_ARROW)
    shaftLength = _metres("Shaft Length", 0.23, _SOLID_ARROW)
    axesLength = _metres("Axes Length", 0.3, _AXES)
    axesRadius = _metres("Axes Radius", 0.01, _AXES)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._flat, self._shapes = Lines(), _PoseShapes(self, "Arrow (3D)")
        self._flat.owner = self
        self._poses: NDArray[np.float64] = np.zeros((0, 4, 4))
        super().__init__(parent, runtime)

    def preparer(self) -> Callable[[Any], Any]:
        """Return the function that reads poses."""
        return _read_poses

    def show(self, data: Any, pose: NDArray[np.float64], frame: str, stamp: int) -> None:  # noqa: ARG002
        """Show poses."""
        self._poses = data
        self._flat.pose = self._shapes.pose = pose
        self.root.add(self._flat, self._shapes)
        self._restyle()

    def _restyle(self) -> None:
        flat = self._poses if self.shape == "Arrow (Flat)" else self._poses[:0]
        self._flat.set_segments(
            _flat_arrows(flat, self.arrowLength), (*rgb_of(self.color), self.alpha)
        )
        self._shapes.draw(self._poses)


def _read_poses(message: Any) -> NDArray[np.float64]:
    _check_count(message.poses, _MAX_POSES)
    rows = read_columns(message.poses, *_POSE_PATHS)
    check_numbers("poses", rows)
    return poses_matrices(rows[:, :3], rows[:, 3:])


def _check_count(poses: Any, most: int) -> None:
    if len(poses) > most:
        raise Error(f"poses: {len(poses)} are more than the {most} that are drawn")


def _flat_arrows(poses: NDArray[np.float64], length: float) -> NDArray[np.float64]:
    """Return three lines for each pose, (3 n, 2, 3): a shaft along x, and a head."""
    tip = np.array([length, 0, 0, 1])
    sides = [[0, 0, 0, 1], *([0.75 * length, s * 0.2 * length, 0, 1] for s in (-1, 1))]
    lines = np.array([[start, tip] for start in sides])
    placed: NDArray[np.float64] = np.einsum("nij,lej->nlei", poses, lines)
    return placed[..., :3].reshape(-1, 2, 3)


class _Covariance(NamedTuple):
    """A pose with its covariance.

    Attributes:
        pose: In its frame, 4 x 4.
        covariance: Covariance of x, y, z (m2) and rotations around x, y, z (rad2), 6 x 6.
        problem: Why it is not drawn, and is 0 here; empty otherwise.
    """

    pose: NDArray[np.float64]
    covariance: NDArray[np.float64]
    problem: str


def _read_covariance(message: Any) -> _Covariance:
    part = message.pose
    covariance = np.array(part.covariance, np.float64).reshape(6, 6)
    problem = ""
    try:
        check_numbers("pose.covariance", covariance.reshape(-1))
    except Error as error:
        covariance, problem = np.zeros((6, 6)), f"{error}; the pose is shown without"
    return _Covariance(matrix_of(part.pose), covariance, problem)


class _Uncertainty(NamedTuple):
    """The shapes of one covariance: matrices, 4 x 4.

    Attributes:
        ellipsoid: Matrix of the position; None without one.
        discs: Matrices of the orientation, each with the axis whose end it surrounds.
        cone: Matrix of the orientation of a robot in the plane, instead; None without one.
    """

    ellipsoid: NDArray[np.float64] | None
    discs: list[tuple[int, NDArray[np.float64]]]
    cone: NDArray[np.float64] | None


class _WithCovariance(TopicDisplay):
    """A display of poses with covariances."""

    shape, color, alpha, *_lengths = _shape_settings()
    shaftLength, shaftRadius, headLength, headRadius, axesLength, axesRadius = _lengths
    covariance = Setting("Covariance", "bool", True, "Show covariances.")
    covariancePosition = Setting(
        "Covariance/Position", "bool", True, "Show covariances of positions.", shown_if=_COVARIANCE
    )
    positionColor = Setting(
        "Covariance/Position/Color",
        "color",
        "#cc33cc",
        "Colour of the ellipsoid.",
        shown_if=_POSITION,
    )
    positionAlpha = Setting(
        "Covariance/Position/Alpha", "float", 0.3, "Opacity.", min=0.0, max=1.0, shown_if=_POSITION
    )
    positionScale = Setting(
        "Covariance/Position/Scale", "float", 1.0, "Size in standard deviations.", min=0.0,
        shown_if=_POSITION,
    )  # fmt: skip
    covarianceOrientation = Setting(
        "Covariance/Orientation",
        "bool",
        True,
        "Show covariances of orientations.",
        shown_if=_COVARIANCE,
    )
    orientationFrame = Setting(
        "Covariance/Orientation/Frame", "enum", "Local", "Frame of the rotations' axes.",
        choices=["Local", "Fixed"], shown_if=_ORIENTATION,
    )  # fmt: skip
    orientationColorStyle = Setting(
        "Covariance/Orientation/Color Style", "enum", "Unique", "One colour, or those of the axes.",
        choices=["Unique", "RGB"], shown_if=_ORIENTATION,
    )  # fmt: skip
    orientationColor = Setting(
        "Covariance/Orientation/Color", "color", "#ffff7f", "Colour of the shapes.",
        shown_if={**_ORIENTATION, "orientationColorStyle": "Unique"},
    )  # fmt: skip
    orientationAlpha = Setting(
        "Covariance/Orientation/Alpha", "float", 0.5, "Opacity.", min=0.0, max=1.0,
        shown_if=_ORIENTATION,
    )  # fmt: skip
    orientationOffset = Setting(
        "Covariance/Orientation/Offset", "float", 1.0, "Distance from the pose in metres.", min=0.0,
        shown_if=_ORIENTATION,
    )  # fmt: skip
    orientationScale = Setting(
        "Covariance/Orientation/Scale", "float", 1.0, "Size in standard deviations.", min=0.0,
        shown_if=_ORIENTATION,
    )  # fmt: skip

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._pose_shapes = _PoseShapes(self)
        #: In the fixed frame, the oldest first.
        self._poses: list[NDArray[np.float64]] = []
        #: Beside each pose: its covariance, and the rotation of its frame in the fixed frame.
        self._covariances: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
        #: Shapes of the first of them, with the settings that they depend on.
        self._shapes: list[_Uncertainty] = []
        self._shapes_look: tuple[Any, ...] = ()
        self._ellipsoids, self._discs, self._cones = Mesh(SPHERE), Mesh(CYLINDER), Mesh(CONE)
        self._uncertain = Group(self._ellipsoids, self._discs, self._cones)
        super().__init__(parent, runtime)

    def preparer(self) -> Callable[[Any], Any]:
        """Return the function that reads pose and covariance."""
        return _read_covariance

    def show(self, data: Any, pose: NDArray[np.float64], frame: str, stamp: int) -> None:  # noqa: ARG002
        """Show a pose with its covariance."""
        self._report_covariance(data)
        self._poses, self._covariances = [pose @ data.pose], [(data.covariance, pose[:3, :3])]
        self._shapes = []
        self._draw()

    def _report_covariance(self, data: _Covariance) -> None:
        if data.problem:
            self.set_status("Covariance", "warn", data.problem)
        else:
            self.delete_status("Covariance")

    def _draw(self) -> None:
        self.root.add(self._uncertain, self._pose_shapes)
        self._restyle()

    def reset(self) -> None:
        """Drop all poses."""
        super().reset()
        self._poses, self._covariances, self._shapes = [], [], []

    def _restyle(self) -> None:
        self._pose_shapes.draw(stack_poses(self._poses))
        look = (
            *(self.covariance, self.covariancePosition, self.positionScale),
            *(self.covarianceOrientation, self.orientationFrame),
            *(self.orientationOffset, self.orientationScale),
        )
        if look != self._shapes_look:
            self._shapes_look, self._shapes = look, []
        # Of poses that are drawn already they stay: a long way has many.
        for at in range(len(self._shapes), len(self._poses)):
            self._shapes.append(self._shape_of(self._poses[at], *self._covariances[at]))
        ellipsoids = [shape.ellipsoid for shape in self._shapes if shape.ellipsoid is not None]
        cones = [shape.cone for shape in self._shapes if shape.cone is not None]
        discs = [disc for shape in self._shapes for disc in shape.discs]
        self._ellipsoids.set_instances(
            np.array(ellipsoids).reshape(-1, 4, 4),
            (*rgb_of(self.positionColor), self.positionAlpha),
        )
        alpha = self.orientationAlpha
        unique = (*rgb_of(self.orientationColor), alpha)
        axes = [(1, 0, 0, alpha), (0, 1, 0, alpha), (0, 0, 1, alpha)]
        rgb = self.orientationColorStyle == "RGB"
        colors = [axes[axis] if rgb else unique for axis, _ in discs] or [unique]
        self._discs.set_instances(np.array([m for _, m in discs]).reshape(-1, 4, 4), colors)
        self._cones.set_instances(np.array(cones).reshape(-1, 4, 4), axes[2] if rgb else unique)

    def _shape_of(
        self, pose: NDArray[np.float64], covariance: NDArray[np.float64], turn: NDArray[np.float64]
    ) -> _Uncertainty:
        ellipsoid, cone = None, None
        discs: list[tuple[int, NDArray[np.float64]]] = []
        if self.covariance and self.covariancePosition:
            # Positions vary along the axes of the message's frame.
            ellipsoid = _ellipsoid(_turned(pose, turn), covariance[:3, :3], self.positionScale)
        if self.covariance and self.covarianceOrientation:
            whole = _turned(pose, turn) if self.orientationFrame == "Fixed" else pose
            turns = covariance[3:, 3:]
            if covariance[2, 2] <= 0 and turns[0, 0] <= 0 and turns[1, 1] <= 0 < turns[2, 2]:
                cone = self._cone(whole, turns[2, 2])
            else:
                discs = self._discs_of(whole, turns)
        return _Uncertainty(ellipsoid, discs, cone)

    def _cone(self, pose: NDArray[np.float64], variance: float) -> NDArray[np.float64]:
        """Return a flat cone in front of a pose: where a robot in the plane may be heading."""
        reach = self.orientationOffset
        angle = min(math.sqrt(variance) * self.orientationScale, _MAX_DEVIATION_RAD)
        wide = 2 * reach * math.tan(angle)
        # From its tip at the pose to its base at the offset; 1 mm high.
        local = np.diag([1e-3, wide, -reach, 1.0])
        local[2, 3] = reach
        # Wide in y, flat in z: the shape stands along z, with x and y exchanged.
        placed: NDArray[np.float64] = pose @ ALONG[0] @ local[[1, 0, 2, 3]][:, [1, 0, 2, 3]]
        return placed

    def _discs_of(
        self, pose: NDArray[np.float64], turns: NDArray[np.float64]
    ) -> list[tuple[int, NDArray[np.float64]]]:
        """Return a flat ellipse for each axis: where its end at the offset may be."""
        reach, found = self.orientationOffset, []
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            # The end of axis x moves along y by a rotation around z, along -z by one around y.
            along = np.array([[turns[v, v], -turns[v, u]], [-turns[u, v], turns[u, u]]])
            values, vectors = np.linalg.eigh((along + along.T) / 2)
            angles = np.sqrt(np.maximum(values, 0)) * self.orientationScale
            if not angles.any():
                continue
            size = 2 * reach * np.tan(np.minimum(angles, _MAX_DEVIATION_RAD))
            local = np.eye(4)
            local[:2, :2] = vectors * np.maximum(size, 1e-4)
            local[2, 2], local[2, 3] = 1e-3, reach
            found.append((axis, pose @ ALONG[axis] @ local))
        return found


def _turned(pose: NDArray[np.float64], turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a pose with another rotation, 3 x 3."""
    turned: NDArray[np.float64] = pose.copy()
    turned[:3, :3] = turn
    return turned


def _ellipsoid(
    pose: NDArray[np.float64], covariance: NDArray[np.float64], scale: float
) -> NDArray[np.float64] | None:
    """Return the matrix of the sphere that becomes the ellipsoid of a number of deviations."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    size = 2 * np.sqrt(np.maximum(values, 0)) * scale
    if not size.any():
        return None
    local = np.eye(4)
    # A flat one, of a robot in the plane, is still seen.
    local[:3, :3] = vectors * np.maximum(size, 1e-3)
    placed: NDArray[np.float64] = pose @ local
    return placed


class PoseWithCovarianceDisplay(_WithCovariance):
    """A ``geometry_msgs/PoseWithCovarianceStamped``. See its page in ``docs/scene.md``."""

    TYPE = "PoseWithCovariance"
    MESSAGES = ("geometry_msgs/PoseWithCovarianceStamped",)


class OdometryDisplay(_WithCovariance):
    """The way of a ``nav_msgs/Odometry``. See its page in ``docs/scene.md``."""

    TYPE = "Odometry"
    IS_CONTINUOUS = True
    MESSAGES = ("nav_msgs/Odometry",)

    positionTolerance = Setting(
        "Position Tolerance", "float", 0.1, "Minimum metres between shown poses.", min=0.0
    )
    angleTolerance = Setting(
        "Angle Tolerance", "float", 0.1, "Minimum radians between shown poses.", min=0.0
    )
    keep = Setting("Keep", "int", 100, "Number of poses shown; 0 for all.", min=0)

    #: RViz has the look of a pose below its shape here.
    SETTINGS: ClassVar[dict[str, Setting]] = {}

    def show(self, data: Any, pose: NDArray[np.float64], frame: str, stamp: int) -> None:  # noqa: ARG002
        """Show a pose beside earlier ones, if the robot has moved."""
        self._report_covariance(data)
        new = pose @ data.pose
        if self._poses and self._is_near(self._poses[-1], new):
            return
        self._poses.append(new)
        self._covariances.append((data.covariance, pose[:3, :3]))
        self._draw()

    def _restyle(self) -> None:
        self._drop_old()
        super()._restyle()

    def reset(self) -> None:
        """Drop all poses."""
        super().reset()
        self._drop_old()

    def _drop_old(self) -> None:
        gone = max(len(self._poses) - min(self.keep or _MAX_KEPT, _MAX_KEPT), 0)
        del self._poses[:gone], self._covariances[:gone], self._shapes[:gone]
        if len(self._poses) == _MAX_KEPT != self.keep:
            self.set_status("Keep", "warn", f"only the latest {_MAX_KEPT} poses are shown")
        else:
            self.delete_status("Keep")

    def _is_near(self, before: NDArray[np.float64], after: NDArray[np.float64]) -> bool:
        moved = float(np.linalg.norm(after[:3, 3] - before[:3, 3]))
        cosine = (np.trace(before[:3, :3].T @ after[:3, :3]) - 1) / 2
        turned = math.acos(min(max(float(cosine), -1.0), 1.0))
        return bool(moved < self.positionTolerance and turned < self.angleTolerance)

    def shows_all(self) -> bool:
        """Return that each message counts."""
        return True


_BELOW_SHAPE = (
    *("Color", "Alpha", "Shaft Length", "Shaft Radius", "Head Length", "Head Radius"),
    *("Axes Length", "Axes Radius"),
)
OdometryDisplay.SETTINGS = {
    f"Shape/{path}" if path in _BELOW_SHAPE else path: setting
    for path, setting in {**_WithCovariance.SETTINGS, **OdometryDisplay.SETTINGS}.items()
}


_MAX_PATH_POSES = 500_000


class PathDisplay(HistoryDisplay):
    """A path. See its page in ``docs/scene.md``."""

    TYPE = "Path"
    LENGTH = "Buffer Length"
    MESSAGES = ("nav_msgs/Path",)

    lineStyle = Setting(
        "Line Style", "enum", "Lines", "How the line is drawn.", choices=["Lines", "Billboards"]
    )
    lineWidth = Setting(
        "Line Width",
        "float",
        0.03,
        "Width of billboards, in metres.",
        min=0.001,
        shown_if=_BILLBOARDS,
    )
    color = Setting("Color", "color", "#19ff00", "Colour of the line.")
    alpha = Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0)
    bufferLength = Setting(
        "Buffer Length", "int", 1, "Number of paths shown.", min=1, max=1000, then="_on_length"
    )
    offset = Setting("Offset", "vector", [0, 0, 0], "Offset of the path, in metres.")
    poseStyle = Setting(
        "Pose Style", "enum", "None", "How poses are drawn.", choices=["None", "Axes", "Arrows"]
    )
    axesLength = _metres("Length", 0.3, _POSE_AXES)
    axesRadius = _metres("Radius", 0.03, _POSE_AXES)
    poseColor = Setting(
        "Pose Color", "color", "#ff55ff", "Colour of arrows.", shown_if=_POSE_ARROWS
    )
    shaftLength = _metres("Shaft Length", 0.1, _POSE_ARROWS)
    headLength = _metres("Head Length", 0.2, _POSE_ARROWS)
    shaftDiameter = _metres("Shaft Diameter", 0.1, _POSE_ARROWS)
    headDiameter = _metres("Head Diameter", 0.3, _POSE_ARROWS)

    def preparer(self) -> Any:
        """Return the function that reads poses."""
        return _read_path

    def draw(self, data: NDArray[np.float64], group: Group) -> None:
        """Draw a line, and axes or arrows at its poses."""
        points = data[:, :3] + [self.offset.x(), self.offset.y(), self.offset.z()]
        line = Lines(self.lineWidth, in_metres=True) if self.lineStyle == "Billboards" else Lines()
        line.owner = self
        line.set_strip(points, (*rgb_of(self.color), self.alpha))
        group.add(line)
        if self.poseStyle == "Axes":
            axes = AxesShapes(self)
            axes.set_axes(poses_matrices(points, data[:, 3:]), self.axesLength, self.axesRadius)
            group.add(axes)
        elif self.poseStyle == "Arrows":
            arrows = ArrowShapes(self)
            arrows.set_arrows(
                poses_matrices(points, data[:, 3:]),
                (self.shaftLength, self.shaftDiameter),
                (self.headLength, self.headDiameter),
                (*rgb_of(self.poseColor), self.alpha),
            )
            group.add(arrows)

    def _drop_old(self) -> None:
        """Drop the oldest paths until neither they nor all their poses are too many."""
        super()._drop_old()
        count = sum(len(path.data) for path in self._kept)
        if count <= _MAX_PATH_POSES:
            return
        while count > _MAX_PATH_POSES:
            oldest = self._kept.popleft()
            count -= len(oldest.data)
            oldest.group.remove()
        text = f"only the latest {len(self._kept)} paths are shown, which have {count} poses"
        self.set_status(self.LENGTH, "warn", f"{text}; reduce it")


def _read_path(message: Any) -> NDArray[np.float64]:
    """Return position and quaternion of each pose, (n, 7)."""
    _check_count(message.poses, _MAX_PATH_POSES)
    rows = np.empty((len(message.poses), 7))
    for at, stamped in enumerate(message.poses):
        p, q = stamped.pose.position, stamped.pose.orientation
        rows[at] = (p.x, p.y, p.z, q.x, q.y, q.z, q.w)
    check_numbers("poses", rows)
    return rows

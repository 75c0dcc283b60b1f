"""The views of a scene, which move its camera: RViz's view controllers, without Qt.

A view turns drags, the wheel, touches and keys into settings, and settings into a
:class:`~rosglass.scene.render.camera.Camera`. Names, defaults, limits and mouse rules are RViz's.
Where RViz 1.14 and RViz 2 differ, the rule is RViz 2's, unless a class says otherwise.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from rosglass.comm.names import similar
from rosglass.errors import Error, shown
from rosglass.overlay.orbit import STEEPEST, Orbit, Point
from rosglass.scene.render.camera import (
    FOV_RAD,
    Camera,
    Matrix,
    point_of,
    unit,
)
from rosglass.scene.view_controllers.events import Action, Button, Drag, Modifier, Touch, Wheel
from rosglass.scene.view_controllers.view_controller import (
    DEFAULT_DISTANCE_M,
    DRAG_ZOOM,
    WHEEL_ZOOM,
    FocalShape,
    ViewController,
    wheel_ratio,
)
from rosglass.scene.view_controllers.view_settings import (
    MAX_NAME_LENGTH,
    ChoiceSetting,
    FlagSetting,
    NumberSetting,
    PointSetting,
    ScaleSetting,
)

__all__ = [
    "VIEWS",
    "FPSView",
    "FrameAlignedView",
    "OrbitView",
    "ThirdPersonFollowerView",
    "TopDownOrthoView",
    "XYOrbitView",
    "create_view",
]

#: Height of an orthographic camera above its target frame, as in RViz.
_ORTHO_HEIGHT_M = 500.0
#: Radians of rotation for each unit that the mouse moves.
_TURN_RAD = 0.005

#: Metres that first-person views move for each unit of a drag, and each step of the wheel.
_DRAG_M, _DRAG_AHEAD_M, _WHEEL_AHEAD_M = 0.01, 0.1, 1.2
#: How far above its orbit a view on the ground has its camera, as a share of the distance: what it
#: looks at appears in the lower half.
_RAISED = 0.2
#: Distance at which an orbit takes over from an orthographic view.
_TAKEOVER_DISTANCE_M = 100.0
#: Cosine from which a camera counts as pointing along an axis.
_ALONG_AXIS = 0.999


class OrbitView(ViewController):
    """A camera that looks at a point and turns around it; it follows the target's position."""

    TYPE = "Orbit"
    DESCRIPTION = (
        "Makes it easy to move around a given point in space, looking at it from any angle."
    )
    _HELP = (
        (
            "Left-Click: Rotate.  Middle-Click: Move X/Y.  "
            "Right-Click/Mouse Wheel: Zoom.  Shift: More options."
        ),
        "Left-Click: Move X/Y.  Right-Click/Mouse Wheel: Move Z.",
    )
    #: Colour of the focal shape, RGBA.
    _COLOR = (1.0, 1.0, 0.0, 0.5)

    distance = NumberSetting(
        "Distance", DEFAULT_DISTANCE_M, "Distance from the focal point.", 0.001
    )
    focal_shape_size = NumberSetting("Focal Shape Size", 0.05, "Focal shape size.", 0.001, 10_000.0)
    focal_shape_fixed_size = FlagSetting("Focal Shape Fixed Size", True, "Focal shape size.")
    yaw = NumberSetting("Yaw", math.pi / 4, "Rotation of the camera around the Z (up) axis.")
    pitch = NumberSetting(
        "Pitch", math.pi / 4, "How much the camera is tipped downward.", -STEEPEST, STEEPEST
    )
    field_of_view = NumberSetting(
        "Field of View", FOV_RAD, "The field of view of the camera.", 0.001, math.pi / 2
    )
    focal_point = PointSetting(
        "Focal Point", Point(0.0, 0.0, 0.0), "The center point which the camera orbits."
    )

    @property
    def orbit(self) -> Orbit:
        """The camera's orbit in the target frame, the right way up."""
        sign = -1 if self.invert_z else 1
        return Orbit(self.focal_point, self.distance, sign * self.yaw, sign * self.pitch)

    def focal_shape(self) -> FocalShape:
        """Return the flat ball at the focal point."""
        pose = self._target.copy()
        pose[:3, 3] = (self._target @ np.append(self.focal_point, 1.0))[:3]
        across = self.focal_shape_size * (1.0 if self.focal_shape_fixed_size else self.distance)
        return FocalShape(pose, (across, across, across / 5), self._COLOR)

    def on_wheel(self, wheel: Wheel) -> None:
        """Zoom, or with Shift move along the line of sight."""
        if wheel.modifiers & Modifier.SHIFT and self._RIGHT[1] is Action.MOVE_Z:
            self._move_z(-wheel.steps * WHEEL_ZOOM / DRAG_ZOOM)
        else:
            super().on_wheel(wheel)

    def reset(self) -> None:
        """Look at the target frame's origin from 10 m, with RViz's angles."""
        for setting in self.settings():
            if setting not in ViewController.settings():
                self._store(setting.name, setting.default)

    def _carry(self, change: Matrix) -> None:
        self.focal_point = (change @ np.append(self.focal_point, 1.0))[:3]

    def _eye_pose(self) -> Matrix:
        orbit, pose = self.orbit, np.eye(4)
        pose[:3, 3] = orbit.eye
        pose[:3, 2] = unit(np.array(orbit.eye - orbit.focus))
        pose[:3, 0] = unit(np.cross((0.0, 0.0, -1.0 if self.invert_z else 1.0), pose[:3, 2]))
        pose[:3, 1] = np.cross(pose[:3, 2], pose[:3, 0])
        return pose

    def _fov(self) -> float:
        return self.field_of_view

    def _focus_distance(self) -> float:
        return self.distance

    def _look_at(self, point: Matrix) -> None:
        eye = self._eye_pose()
        self.focal_point = point
        self.distance = np.linalg.norm(eye[:3, 3] - point)
        self._aim(eye)

    def _take_over(self, other: ViewController, pose: Matrix) -> None:
        pose = pose.copy()
        if type(other) is OrbitView:
            self.distance, self.field_of_view = other.distance, other.field_of_view
        elif isinstance(other, TopDownOrthoView):
            self.distance = pose[2, 3] = _TAKEOVER_DISTANCE_M
        else:
            # RViz's rule: as far as the target frame is.
            self.distance = np.linalg.norm(pose[:3, 3])
        self.focal_point = pose[:3, 3] - pose[:3, 2] * self.distance
        self._aim(pose)

    def _aim(self, eye: Matrix) -> None:
        """Set yaw and pitch so that the camera is in the direction of a pose."""
        x, y, z = eye[:3, 3] - self.focal_point
        sign = -1 if self.invert_z else 1
        self.pitch = sign * math.asin(min(max(z / self.distance, -1.0), 1.0))
        if math.hypot(x, y) <= 1e-6 * self.distance:
            # From straight above, the view's up direction gives the camera's yaw.
            x, y, _ = -eye[:3, 1] * math.copysign(sign, z)
        self.yaw = sign * math.atan2(y, x) % math.tau

    def _rotate(self, drag: Drag) -> None:
        self.yaw = (self.yaw - _TURN_RAD * drag.dx) % math.tau
        self.pitch += _TURN_RAD * drag.dy

    def _move(self, drag: Drag) -> None:
        per_unit = 2 * math.tan(self.field_of_view / 2) * self.distance / max(drag.size[1], 1.0)
        self._shift(-drag.dx * per_unit, drag.dy * per_unit, 0.0)

    def _move_z(self, dy: float) -> None:
        self._shift(0.0, 0.0, dy * DRAG_ZOOM * self.distance)

    def _zoom(self, ratio: float) -> None:
        self.distance *= ratio

    def _twist(self, angle: float) -> None:
        self.yaw = (self.yaw + math.copysign(angle, angle * self.pitch)) % math.tau

    def _shift(self, x: float, y: float, z: float) -> None:
        """Move the focal point along the camera's axes."""
        self.focal_point = self.focal_point + point_of(self._eye_pose()[:3, :3] @ (x, y, z))


class XYOrbitView(OrbitView):
    """An orbit around a point of the target frame's XY plane; drags move along this plane."""

    TYPE = "XYOrbit"
    DESCRIPTION = (
        "Makes it easy to move around a given point on the XY plane, looking at it from any angle."
    )
    _RIGHT = (Action.ZOOM, Action.ZOOM)
    _HELP = (OrbitView._HELP[0], "Left-Click: Move X/Y.  Right-Click: Zoom.")
    _COLOR = (0.0, 1.0, 1.0, 0.5)

    def _eye_pose(self) -> Matrix:
        pose = super()._eye_pose()
        pose[:3, 3] += pose[:3, 1] * self.distance * _RAISED
        return pose

    def _look_at(self, point: Matrix) -> None:
        super()._look_at(point * (1.0, 1.0, 0.0))

    def _take_over(self, other: ViewController, pose: Matrix) -> None:
        if isinstance(other, TopDownOrthoView):
            super()._take_over(other, pose)
            return
        eye, up, back = pose[:3, 3], pose[:3, 1], pose[:3, 2]
        ahead, below = _to_ground(eye, -back), _to_ground(eye, -up)
        if ahead is None or below is None:
            # No ground is seen ahead of the camera: RViz begins anew.
            return
        self.distance = ahead * below / (below + _RAISED * ahead)
        lowered = pose.copy()
        lowered[:3, 3] -= up * self.distance * _RAISED
        self.focal_point = (lowered[:3, 3] - back * self.distance) * (1.0, 1.0, 0.0)
        self._aim(lowered)

    def _move(self, drag: Drag) -> None:
        camera = self.camera(*drag.size)
        places = []
        for x, y in ((drag.x - drag.dx, drag.y - drag.dy), (drag.x, drag.y)):
            origin, direction = camera.ray(x, y)
            eye = self._to_target(origin)
            way = self._target[:3, :3].T @ direction
            length = _to_ground(eye, way)
            if length is None:
                return
            places.append(eye + way * length)
        motion = (places[0] - places[1]) * (1.0, 1.0, 0.0)
        # Close to the horizon, a unit is any number of metres. RViz stops at one metre.
        most = max(1.0, self.distance / 10)
        length = float(np.linalg.norm(motion))
        self.focal_point = self.focal_point + point_of(motion * min(1.0, most / max(length, most)))


class ThirdPersonFollowerView(XYOrbitView):
    """An orbit on the ground that follows the target frame's position, and turns with its yaw."""

    TYPE = "ThirdPersonFollower"
    DESCRIPTION = (
        "Follow a target frame and turn the viewing direction with the yaw of the target frame."
    )

    def _followed(self, pose: Matrix) -> Matrix:
        followed = super()._followed(pose)
        yaw = math.atan2(pose[1, 0], pose[0, 0])
        followed[:3, :3] = _turned(yaw, 0.0, 0.0)
        return followed


class FPSView(ViewController):
    """A camera that looks around from where it is; it follows the target's position.

    With Shift, the left button rolls the camera in RViz 1.14 and moves it in RViz 2; the class id
    decides.
    """

    TYPE = "FPS"
    DESCRIPTION = (
        "Control the camera like in a First Person Shooter game: drag left to look left, etc."
    )
    _RIGHT = (Action.MOVE_Z, Action.MOVE_Z)

    yaw = NumberSetting(
        "Yaw", 0.0, "Rotation of the camera around the Z (up) axis.", -math.tau, math.tau
    )
    pitch = NumberSetting(
        "Pitch", 0.0, "How much the camera is tipped downward.", -math.pi, math.pi
    )
    roll = NumberSetting(
        "Roll", 0.0, "Rotation about the camera's view direction.", -math.pi, math.pi
    )
    position = PointSetting("Position", Point(5.0, 5.0, 10.0), "Position of the camera.")

    def __init__(self, class_id: str = "") -> None:
        super().__init__(class_id)
        rolls = self.class_id.startswith("rviz/")
        self._LEFT = (Action.ROTATE_3D, Action.ROTATE_2D if rolls else Action.MOVE_XY)
        with_shift = "Rotate Roll.  Middle-Click: Move X/Y." if rolls else "Move X/Y."
        self._HELP = (
            (
                "Left-Click: Rotate.  Middle-Click: Move X/Y.  "
                "Right-Click: Move Z.  Shift: More options."
            ),
            f"Left-Click: {with_shift}  Right-Click: Move Z.",
        )

    def on_wheel(self, wheel: Wheel) -> None:
        """Move ahead, 1.2 m for a step."""
        self._shift(0.0, 0.0, -_WHEEL_AHEAD_M * wheel.steps)

    def reset(self) -> None:
        """Look at the target frame's origin from (5, 5, 10)."""
        self.position = type(self).position.default
        self._look_at(np.zeros(3))

    def _carry(self, change: Matrix) -> None:
        self.position = (change @ np.append(self.position, 1.0))[:3]

    def _eye_pose(self) -> Matrix:
        pose = np.eye(4)
        forward, left, up = _turned(self.yaw, self.pitch, self.roll).T
        pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = -left, up, -forward, self.position
        return pose

    def _look_at(self, point: Matrix) -> None:
        x, y, z = point - self.position
        if x or y or z:
            pitch = math.atan2(-z, math.hypot(x, y))
            self._orient(math.atan2(y, x), min(max(pitch, -STEEPEST), STEEPEST), 0.0)

    def _take_over(self, other: ViewController, pose: Matrix) -> None:  # noqa: ARG002
        self.position = pose[:3, 3]
        self._orient(*_angles(pose))

    def _orient(self, yaw: float, pitch: float, roll: float) -> None:
        """Set the angles."""
        for setting, angle in zip(_ANGLES, (yaw, pitch, roll), strict=True):
            self._store(setting.name, setting.read(math.remainder(angle, math.tau)))

    def _rotate(self, drag: Drag) -> None:
        # RViz 1.14 saves some cameras with a pitch beyond the pole, and turned around.
        yaw, pitch, roll = _angles(self._eye_pose())
        pitch = min(max(pitch + _TURN_RAD * drag.dy, -STEEPEST), STEEPEST)
        self._orient(yaw - _TURN_RAD * drag.dx, pitch, roll)

    def _turn(self, drag: Drag) -> None:
        x, y = drag.x - drag.size[0] / 2, drag.y - drag.size[1] / 2
        turn = math.atan2(y - drag.dy, x - drag.dx) - math.atan2(y, x)
        self._orient(self.yaw, self.pitch, self.roll + turn)

    def _move(self, drag: Drag) -> None:
        self._shift(_DRAG_M * drag.dx, -_DRAG_M * drag.dy, 0.0)

    def _move_z(self, dy: float) -> None:
        self._shift(0.0, 0.0, _DRAG_AHEAD_M * dy)

    def _zoom(self, ratio: float) -> None:
        """Move ahead for a pinch as for the wheel."""
        self._shift(0.0, 0.0, (ratio - 1) / WHEEL_ZOOM * _WHEEL_AHEAD_M)

    def _shift(self, x: float, y: float, z: float) -> None:
        """Move along the camera's axes."""
        self.position = self.position + point_of(self._eye_pose()[:3, :3] @ (x, y, z))


_ANGLES = (FPSView.yaw, FPSView.pitch, FPSView.roll)
_ARBITRARY = "arbitrary"
#: Yaw and pitch of a camera that looks along an axis.
_AXES = {
    "+x axis": (0.0, 0.0),
    "-x axis": (math.pi, 0.0),
    "+y axis": (math.pi / 2, 0.0),
    "-y axis": (-math.pi / 2, 0.0),
    "+z axis": (0.0, -math.pi / 2),
    "-z axis": (0.0, math.pi / 2),
}


class FrameAlignedView(FPSView):
    """A camera that is fixed to the target frame, with its position and orientation."""

    TYPE = "FrameAligned"
    DESCRIPTION = "Align the camera with a TF frame."

    point_towards = ChoiceSetting(
        "Point towards",
        "-z axis",
        "Point the camera along the given axis of the frame.",
        (_ARBITRARY, *_AXES),
    )
    lock_camera = FlagSetting(
        "Lock Camera", False, "Lock camera in its current pose relative to the frame"
    )

    def __init__(self, class_id: str = "") -> None:
        super().__init__(class_id)
        self._axis = self.point_towards
        self.reset()

    def action(self, buttons: Button, modifiers: Modifier) -> Action:
        """Return the effect of a drag; nothing if the camera is locked."""
        return Action.NONE if self.lock_camera else super().action(buttons, modifiers)

    def help(self, modifiers: Modifier) -> str:
        """Return the instructions for the status bar."""
        if self.lock_camera:
            return "Unlock camera in settings to enable mouse interaction."
        return super().help(modifiers)

    def on_wheel(self, wheel: Wheel) -> None:
        """Move ahead, unless the camera is locked."""
        if not self.lock_camera:
            super().on_wheel(wheel)

    def on_touch(self, touch: Touch) -> None:
        """Rotate and move, unless the camera is locked."""
        if not self.lock_camera:
            super().on_touch(touch)

    def reset(self) -> None:
        """Look from the target frame's origin along the axis that was chosen last."""
        axis = self._axis
        self.position = (0.0, 0.0, 0.0)
        self._orient(*_AXES[axis], 0.0)

    def _followed(self, pose: Matrix) -> Matrix:
        return pose

    def _carry(self, change: Matrix) -> None:
        """Jump to another frame, as RViz does."""

    def _on_set(self, name: str) -> None:
        super()._on_set(name)
        if name == type(self).point_towards.name and self.point_towards != _ARBITRARY:
            self._axis = self.point_towards
            self.reset()
        elif name in {setting.name for setting in _ANGLES}:
            self._find_axis()

    def _orient(self, yaw: float, pitch: float, roll: float) -> None:
        super()._orient(yaw, pitch, roll)
        self._find_axis()

    def _find_axis(self) -> None:
        """Show along which axis the camera points."""
        forward = _turned(self.yaw, self.pitch, 0.0)[:, 0]
        along = (
            axis
            for axis, (yaw, pitch) in _AXES.items()
            if forward @ _turned(yaw, pitch, 0.0)[:, 0] > _ALONG_AXIS
        )
        found = next(along, _ARBITRARY)
        self._store(type(self).point_towards.name, found)
        if found != _ARBITRARY:
            self._axis = found


class TopDownOrthoView(ViewController):
    """An orthographic camera straight above; it follows the target's position."""

    TYPE = "TopDownOrtho"
    DESCRIPTION = "Orthographic projection, seen from the top."
    _LEFT = (Action.ROTATE_2D, Action.MOVE_XY)
    _RIGHT = (Action.ZOOM, Action.ZOOM)
    _HELP = (
        (
            "Left-Click: Rotate.  Middle-Click: Move X/Y.  "
            "Right-Click/Mouse Wheel: Zoom.  Shift: More options."
        ),
        "Left-Click: Move X/Y.  Right-Click/Mouse Wheel: Zoom.",
    )

    scale = ScaleSetting(
        "Scale", 10.0, "How much to scale up the size of things in the scene.", 1e-4, 1e6
    )
    angle = NumberSetting("Angle", 0.0, "Angle around the Z axis to rotate.")
    x = NumberSetting("X", 0.0, "X component of camera position.")
    y = NumberSetting("Y", 0.0, "Y component of camera position.")

    def camera(self, width: float, height: float) -> Camera:
        """Return the camera for an item of a size."""
        return replace(super().camera(width, height), scale=abs(self.scale))

    def on_wheel(self, wheel: Wheel) -> None:
        """Zoom."""
        self.scale *= wheel_ratio(-wheel.steps)

    def reset(self) -> None:
        """Look at the target frame's origin, 10 units to the metre."""
        for setting in (type(self).scale, type(self).angle, type(self).x, type(self).y):
            self._store(setting.name, setting.default)

    def _carry(self, change: Matrix) -> None:
        self.x, self.y = (change @ (self.x, self.y, 0.0, 1.0))[:2]

    def _eye_pose(self) -> Matrix:
        pose = np.eye(4)
        angle = self.angle + (math.pi if self.scale < 0 else 0.0)
        pose[:3, :3] = _turned(angle, 0.0, 0.0)
        pose[:3, 3] = self.x, self.y, _ORTHO_HEIGHT_M
        return pose

    def _fov(self) -> None:
        return None

    def _focus_distance(self) -> float:
        return _ORTHO_HEIGHT_M

    def _look_at(self, point: Matrix) -> None:
        self.x, self.y, _ = point

    def _take_over(self, other: ViewController, pose: Matrix) -> None:
        if isinstance(other, TopDownOrthoView):
            self.scale, self.angle = other.scale, other.angle
        at = pose[:3, 3]
        if isinstance(other, OrbitView):
            at = self._to_target((other._target @ np.append(other.focal_point, 1.0))[:3])
        self.x, self.y = at[:2]

    def _turn(self, drag: Drag) -> None:
        self._twist(_TURN_RAD * drag.dx)

    def _move(self, drag: Drag) -> None:
        across = np.array([-drag.dx, drag.dy, 0.0]) / abs(self.scale)
        right, up, _ = self._eye_pose()[:3, :3] @ across
        self.x, self.y = self.x + right, self.y + up

    def _zoom(self, ratio: float) -> None:
        # RViz turns the view over by a drag of 100 units in one event.
        self.scale *= max(2 - ratio, 0.01)

    def _pinch(self, ratio: float) -> None:
        self.scale *= ratio

    def _twist(self, angle: float) -> None:
        self.angle = math.remainder(self.angle + angle, math.tau)


#: The types of views, by the name in RViz's Views panel.
VIEWS: dict[str, type[ViewController]] = {
    view.TYPE: view
    for view in (
        OrbitView,
        XYOrbitView,
        ThirdPersonFollowerView,
        FPSView,
        TopDownOrthoView,
        FrameAlignedView,
    )
}
_PACKAGES = ("rviz", "rviz_default_plugins")


def create_view(class_id: str) -> ViewController:
    """Create a view.

    Args:
        class_id: RViz's, e.g. ``rviz/Orbit`` or ``rviz_default_plugins/Orbit``, or ``Orbit`` alone,
            which is RViz 2's.

    Raises:
        Error: There is no such type.
    """
    package, _, kind = class_id.rpartition("/") if isinstance(class_id, str) else ("", "", "")
    if kind in VIEWS and package in ("", *_PACKAGES):
        return VIEWS[kind](class_id if package else "")
    hint = similar(kind, VIEWS) if len(kind) <= MAX_NAME_LENGTH else ""
    raise Error(f"there is no view {shown(class_id)}{hint or '; there are ' + ', '.join(VIEWS)}")


def _turned(yaw: float, pitch: float, roll: float) -> Matrix:
    """Return the rotation by ROS's angles, whose columns are what is ahead, left and up."""
    (sy, cy), (sp, cp), (sr, cr) = ((math.sin(a), math.cos(a)) for a in (yaw, pitch, roll))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _angles(camera: Matrix) -> tuple[float, float, float]:
    """Return yaw, pitch (-pi/2 to pi/2) and roll of a camera's pose."""
    ahead, left, up = -camera[:3, 2], -camera[:3, 0], camera[:3, 1]
    pitch = math.asin(min(max(-ahead[2], -1.0), 1.0))
    if abs(ahead[2]) > 1 - 1e-9:
        # Straight down or up, yaw and roll are the same.
        return math.atan2(-left[0], left[1]), pitch, 0.0
    return math.atan2(ahead[1], ahead[0]), pitch, math.atan2(left[2], up[2])


def _to_ground(origin: Matrix, direction: Matrix) -> float | None:
    """Return the length of a ray to the plane of x and y; None if it does not meet it."""
    if abs(direction[2]) < 1e-9:
        return None
    length = float(-origin[2] / direction[2])
    return length if length >= 0 else None

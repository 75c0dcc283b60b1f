"""Interactive markers and their controls: what is drawn, and how the mouse drags it.

The geometry of drags is in the fixed frame; poses are those in the frame of the marker.
"""

from __future__ import annotations

import math
import time
from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.comm.time import Time
from rosglass.errors import Error, TransformException
from rosglass.qt import is_alive
from rosglass.scene.displays.interactive_marker_messages import (
    BUTTON,
    FIXED,
    HELP,
    MENU,
    MOVE_3D,
    MOVE_AXIS,
    MOVE_PLANE,
    MOVE_ROTATE,
    MOVE_ROTATE_3D,
    NONE,
    ROTATE_3D,
    ROTATE_AXIS,
    VIEW_FACING,
    ControlRecord,
    InteractiveMarkerRecord,
    description_control,
)
from rosglass.scene.displays.marker import MarkerGroup
from rosglass.scene.displays.marker_messages import MESH, MarkerRecord
from rosglass.scene.displays.shapes import AxesShapes
from rosglass.scene.render.camera import inverse, quaternion_of
from rosglass.scene.render.drawing import Lines
from rosglass.scene.render.matrices import instance_matrix
from rosglass.scene.render.scene_tree import Group
from rosglass.scene.view_controllers.events import Button, Modifier

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rosglass.scene.render.camera import Camera
    from rosglass.scene.tools.pointer_event import PointerEvent

    Vector = NDArray[np.float64]
    Matrix = NDArray[np.float64]

__all__ = ["MENU_SELECT", "Control", "InteractiveMarker"]

# visualization_msgs/InteractiveMarkerFeedback: types of events.
KEEP_ALIVE, POSE_UPDATE, MENU_SELECT, BUTTON_CLICK, MOUSE_DOWN, MOUSE_UP = range(6)
#: Feedback by which the user wants something, in words.
_COMMANDS = {POSE_UPDATE: "drag by", MENU_SELECT: "menu entry", BUTTON_CLICK: "button"}
#: Seconds until a feedback without a change, by which servers know that the user still holds a
#: marker; RViz's.
_HOLD_S = 0.25
#: Seconds within which a server repeats the poses that it receives.
_ECHO_S = 2.0
#: Brightening of the colours of a control under the mouse, and of a pressed one.
_HOVERED, _PRESSED = 0.3, 0.5
#: Points of a marker above which it is not painted anew to be highlighted.
_MAX_HIGHLIGHTED = 50_000
_DRAGGED = (*(MOVE_AXIS, MOVE_PLANE, ROTATE_AXIS, MOVE_ROTATE, MOVE_3D, ROTATE_3D, MOVE_ROTATE_3D),)
#: Half the length of the line along an axis that visual aids show, in metres.
_AID_M = 1000.0
#: Radians of a rotation for each unit of the view, as in RViz.
_RAD_PER_PIXEL = 2 * np.pi / 300


class Control:
    """A control of an interactive marker: what is drawn, and what the mouse does with it.

    Attributes:
        display: The display.
        marker: The interactive marker.
        record: Its description.
        root: Its drawables, in the marker's frame.
        shapes: Those of them that its description has.
    """

    def __init__(self, marker: InteractiveMarker, record: ControlRecord) -> None:
        self.display, self.marker, self.record = marker.display, marker, record
        self.root = Group()
        self.shapes = MarkerGroup(None)
        #: Poses of the frames of its markers in its own one, as far as they are known.
        self._frames: dict[tuple[str, int], Matrix] = {}
        self._aid = Lines(1.0)
        self._aid.visible = False
        self._highlight = 0.0
        #: By how much it was rotated about its axis, radians, which only it remembers.
        self._angle = 0.0
        #: The pressed point, in the marker's frame, while it is dragged.
        self._grab: Matrix | None = None
        self._pose = self._turn = np.eye(4)
        self._angle_then = 0.0
        #: The place on the control that a drag keeps under the mouse, and the centre of rotations,
        #: in the control's frame.
        self._held = self._center = np.zeros(3)
        self._last: PointerEvent | None = None

    def __repr__(self) -> str:
        return f"control {self.record.name} of {self.marker.record.name}"

    def describe(self) -> list[tuple[str, str]]:
        """Return the lines of the Selection panel."""
        lines = [("Interactive marker", self.marker.record.name), ("Control", self.record.name)]
        if self.record.description:
            lines.append(("Description", self.record.description))
        return lines

    @property
    def help(self) -> str:
        """The instructions for the status bar."""
        text = HELP.get(self.record.mode, "")
        if self.marker.record.menu and self.record.mode != MENU:
            text += " Right-Click: Show context menu."
        return text

    # -- drawing ---------------------------------------------------------------------------------

    def change(self, record: ControlRecord) -> None:
        """Apply a changed message; a drag continues."""
        self.record = record
        self._frames.clear()
        self.draw()

    def draw(self) -> None:
        """Draw its markers anew."""
        self.root.clear()
        owner: Any = None
        if self is not self.marker.title:
            owner = self.display if self.record.mode == NONE else self
        self.shapes = MarkerGroup(owner)
        self.place()
        for marker in self.record.markers:
            if marker.problem:
                continue
            pose = self._relative_pose(marker)
            if pose is None:
                continue
            try:
                self.shapes.put(self._painted(marker), pose, self.display.meshes)
            except Error as error:  # one that cannot be drawn does not hide the others
                self.display.set_line(self.marker.record.name, str(error))
        self.shapes.flush()
        self.root.add(self.shapes.root, self._aid)

    def _relative_pose(self, marker: MarkerRecord) -> Matrix | None:
        """Return the pose of a marker's frame in that of the control; None while not known.

        It is that of the time when the message was received: the marker moves with the control.
        """
        scene = self.display.scene
        if not marker.frame or scene is None:
            return np.eye(4)
        known = self._frames.get(marker.key)
        if known is None:
            try:
                found = scene.look_up(marker.frame, marker.stamp)
            except TransformException as error:
                self.display.set_line(self.marker.record.name, f"no transform: {error}")
                return None
            known = inverse(self.marker.root.pose @ self.shapes.root.pose) @ found
            self._frames[marker.key] = known
        return known

    def _painted(self, marker: MarkerRecord) -> MarkerRecord:
        color, colors = marker.color, marker.colors
        if self.record.automatic and not self.display.enableTransparency:
            color = (*color[:3], 1.0)
            colors = colors.copy()
            colors[:, 3:] = 1.0
        light = self._highlight
        if light and len(marker.points) <= _MAX_HIGHLIGHTED:
            red, green, blue, alpha = color
            if marker.kind == MESH and marker.embedded:
                # Painted over the mesh's own colours.
                if not (red or green or blue):
                    red = green = blue = 1.0
                bright = 1 + light
                color = (bright * red, bright * green, bright * blue, alpha or 1.0)
            else:
                red, green, blue = (min(part + light, 1.0) for part in (red, green, blue))
                color = (red, green, blue, alpha)
            colors = colors.copy()
            colors[:, :3] = np.minimum(colors[:, :3] + light, 1.0)
        return marker._replace(color=color, colors=colors)

    def _set_highlight(self, light: float) -> None:
        if light != self._highlight:
            self._highlight = light
            self.draw()

    def uses_mesh(self, uri: str) -> bool:
        """Return whether one of its markers is a mesh from an URI."""
        return any(one.kind == MESH and one.resource == uri for one in self.record.markers)

    def frame(self) -> Matrix:
        """Return its pose in the marker's frame."""
        pose: Matrix = self.marker.pose.copy()
        record = self.record
        if record.facing == FIXED:
            pose[:3, :3] = turn_about(record.turn[:, 0], self._angle)
        elif record.facing == VIEW_FACING:
            camera = self.display.camera if self._last is None else self._last.view.camera()
            turn = np.eye(3)
            if camera is not None:
                turn = facing_turn(record.turn, self._angle, camera)
            pose[:3, :3] = self.marker.root.pose[:3, :3].T @ turn
        return pose

    def place(self) -> None:
        """Move its markers to where it is."""
        pose = self.frame()
        self._aid.pose = pose
        if self.record.facing == VIEW_FACING and self.record.independent:
            pose = self.marker.pose
        self.shapes.root.pose = pose

    # -- the mouse -------------------------------------------------------------------------------

    def handle_pointer(self, what: str, event: PointerEvent) -> bool:
        """Handle an event of the tool Interact; see ``Interactive`` there."""
        if not is_alive(self.display):
            return False
        self.display.used_view = event.view
        if self.marker.controls.get(self.record.name) is not self:  # removed under the mouse
            if what == "release" and (self._grab is not None or self.record.mode == BUTTON):
                self.display.announce(f"{self} was removed: its release was not sent")
            return False
        if what == "press":
            return self._on_press(event)
        if what == "move" and self._grab is not None:
            self._drag(event)
        elif what == "release":
            self._on_release(event)
        elif what == "enter":
            self._set_highlight(_HOVERED)
        elif what in ("leave", "cancel"):
            if self._grab is not None:
                self._end_drag()
                self.marker.send(MOUSE_UP, self.record.name)
            self._set_highlight(0.0)
        return False

    def _on_press(self, event: PointerEvent) -> bool:
        if event.button is Button.RIGHT:
            return bool(self.marker.record.menu)
        if event.button is not Button.LEFT:
            return False
        self._set_highlight(_PRESSED)
        if self.record.mode in _DRAGGED:
            self._begin_drag(event)
        self.marker.send(MOUSE_DOWN, self.record.name, event.point)
        return True

    def _on_release(self, event: PointerEvent) -> None:
        on_it = event.hit is not None and event.hit.drawable.owner is self
        if event.button is Button.RIGHT:
            if on_it:
                self.display.show_menu(self, event)
            return
        if self._grab is not None:
            self._end_drag()
        elif self.record.mode == BUTTON and on_it:
            self.marker.send(BUTTON_CLICK, self.record.name, event.point)
        elif self.record.mode == MENU and on_it:
            self.display.show_menu(self, event)
        self.marker.send(MOUSE_UP, self.record.name, event.point)
        self._set_highlight(_HOVERED if on_it else 0.0)

    # -- drags -----------------------------------------------------------------------------------

    def _begin_drag(self, event: PointerEvent) -> None:
        self._last = event
        back = inverse(self.marker.root.pose)
        frame = self.frame()
        grab = frame[:3, 3].copy()
        if event.point is not None:
            grab = (back @ (*event.point, 1.0))[:3]
        self._grab, self._pose, self._turn = grab, self.marker.pose, frame
        self._angle_then = self._angle
        axis = frame[:3, :3] @ self.record.turn[:, 0]
        center = frame[:3, 3] + axis * float(axis @ (grab - frame[:3, 3]))
        into = inverse(frame)
        self._held, self._center = ((into @ (*one, 1.0))[:3] for one in (grab, center))
        self._show_aid(visible=True)
        self.marker.begin_drag(self)

    def _end_drag(self) -> None:
        self._grab = self._last = None
        self._show_aid(visible=False)
        self.marker.end_drag()

    def _show_aid(self, *, visible: bool) -> None:
        along = self.record.mode in (MOVE_AXIS, ROTATE_AXIS, MOVE_ROTATE)
        visible = (
            visible
            and along
            and self.record.facing != VIEW_FACING
            and bool(self.display.showVisualAids)
        )
        if visible:
            end = self.record.turn[:, 0] * _AID_M
            self._aid.set_segments([[-end, end]])
        self._aid.visible = visible

    def drag_again(self) -> None:
        """Follow the mouse as the marker's frame has moved."""
        if self._last is not None and self.record.mode in (MOVE_AXIS, MOVE_PLANE, ROTATE_AXIS):
            self._drag(self._last)

    def _drag(self, event: PointerEvent) -> None:
        self._last = event
        mode = self.record.mode
        camera = event.view.camera()
        pose: Matrix | None
        if mode in (MOVE_AXIS, MOVE_PLANE):
            pose = self._moved(camera, event)
        elif mode == ROTATE_AXIS:
            pose = self._rotated(camera, event)
        elif mode == MOVE_ROTATE:
            pose = self._pulled(camera, event)
        elif mode == ROTATE_3D or (mode == MOVE_ROTATE_3D and event.modifiers & Modifier.CTRL):
            pose = self._tumbled(camera, event)
        else:
            pose = self._carried(camera, event)
        if pose is not None:
            self.marker.set_pose(pose, self.record.name)

    def _axis(self, frame: Matrix) -> Matrix:
        """Return the control's axis in the fixed frame."""
        axis: Matrix = self.marker.root.pose[:3, :3] @ (frame[:3, :3] @ self.record.turn[:, 0])
        return axis

    def _to_fixed(self, point: Matrix) -> Matrix:
        found: Matrix = (self.marker.root.pose @ (*point, 1.0))[:3]
        return found

    def _from_fixed(self, point: Matrix) -> Matrix:
        found: Matrix = (inverse(self.marker.root.pose) @ (*point, 1.0))[:3]
        return found

    def _moved(self, camera: Camera, event: PointerEvent) -> Matrix | None:
        """Return the pose of the marker after a move along the axis or in the plane."""
        assert self._grab is not None
        find = point_on_axis if self.record.mode == MOVE_AXIS else point_on_plane
        found = find(camera, event.x, event.y, self._to_fixed(self._grab), self._axis(self.frame()))
        if found is None:
            return None
        pose: Matrix = self.marker.pose.copy()
        pose[:3, 3] = self._pose[:3, 3] + self._from_fixed(found) - self._grab
        return pose

    def _rotated(self, camera: Camera, event: PointerEvent) -> Matrix | None:
        """Return the pose of the marker after a rotation about the axis."""
        assert self._grab is not None
        center = (self._turn @ (*self._center, 1.0))[:3]
        found = point_on_plane(
            camera, event.x, event.y, self._to_fixed(center), self._axis(self._turn)
        )
        if found is None:
            return None
        axis = self._turn[:3, :3] @ self.record.turn[:, 0]
        angle = angle_about(axis, self._grab - center, self._from_fixed(found) - center)
        self._angle = self._angle_then + angle
        pose: Matrix = self.marker.pose.copy()
        pose[:3, :3] = turn_about(axis, angle) @ self._pose[:3, :3]
        return pose

    def _pulled(self, camera: Camera, event: PointerEvent) -> Matrix | None:
        """Return the pose of the marker after a pull, which rotates and moves it."""
        frame = self.frame()
        center, held = ((frame @ (*one, 1.0))[:3] for one in (self._center, self._held))
        found = point_on_plane(camera, event.x, event.y, self._to_fixed(center), self._axis(frame))
        if found is None:
            return None
        before, now = held - center, self._from_fixed(found) - center
        far = float(np.linalg.norm(now))
        if far < 1e-6:
            return None
        axis = frame[:3, :3] @ self.record.turn[:, 0]
        angle = angle_about(axis, before, now)
        self._angle += angle
        pose: Matrix = self.marker.pose.copy()
        pose[:3, :3] = turn_about(axis, angle) @ pose[:3, :3]
        pose[:3, 3] += now * (1 - float(np.linalg.norm(before)) / far)
        return pose

    def _carried(self, camera: Camera, event: PointerEvent) -> Matrix | None:
        """Return the pose of the marker after a move across the view, or towards it with Shift."""
        assert self._grab is not None
        grab, ahead = self._to_fixed(self._grab), -camera.pose[:3, 2]
        now = point_on_plane(camera, event.x, event.y, grab, ahead)
        before = point_on_plane(camera, event.x - event.dx, event.y - event.dy, grab, ahead)
        if now is None or before is None:
            return None
        way = now - before
        if event.modifiers & Modifier.SHIFT:
            way = ahead * float(camera.pose[:3, 1] @ way)
        local = self.marker.root.pose[:3, :3].T @ way
        self._grab = self._grab + local
        pose: Matrix = self.marker.pose.copy()
        pose[:3, 3] += local
        return pose

    def _tumbled(self, camera: Camera, event: PointerEvent) -> Matrix:
        """Return the pose of the marker after a rotation as of a trackball."""
        right, up, back = camera.pose[:3, 0], camera.pose[:3, 1], camera.pose[:3, 2]
        if event.modifiers & Modifier.SHIFT:
            turn = turn_about(-back, event.dx * _RAD_PER_PIXEL)
        else:
            turn = turn_about(up, event.dx * _RAD_PER_PIXEL)
            turn = turn @ turn_about(right, event.dy * _RAD_PER_PIXEL)
        place = self.marker.root.pose[:3, :3]
        pose: Matrix = self.marker.pose.copy()
        pose[:3, :3] = place.T @ turn @ place @ pose[:3, :3]
        return pose


class InteractiveMarker:
    """An interactive marker that is shown.

    Attributes:
        display: The display.
        record: Its description.
        root: Its drawables, at its frame in the fixed frame.
        pose: Its pose in its frame.
        controls: Its controls by name.
        title: The control that shows its description.
        frame: Its frame.
        stamp: The time at which its frame counts; 0 for always.
    """

    def __init__(self, display: Any, record: InteractiveMarkerRecord) -> None:
        self.display, self.record = display, record
        self.root = Group()
        self.root.visible = False
        self.pose = record.pose
        self.controls: dict[str, Control] = {}
        self.title: Control | None = None
        self._axes = AxesShapes()
        self.frame, self.stamp = record.frame, record.stamp
        self._placed = False
        #: The control that is dragged.
        self.dragged: Control | None = None
        self._changed = False
        self._sent = 0.0
        #: A pose that the server has sent during a drag.
        self._requested: tuple[str, int, Matrix] | None = None
        #: When poses were sent, and these, which a server repeats a little later.
        self._echoes: deque[tuple[float, Matrix]] = deque(maxlen=100)
        self.change(record)

    def change(self, record: InteractiveMarkerRecord) -> None:
        """Apply a message; a dragged control is kept."""
        self.record = record
        self.frame, self.stamp, self._placed = record.frame, record.stamp, False
        dragged = self.dragged
        if dragged is None:
            self.pose = record.pose
        self.place()
        controls = {}
        for one in record.controls:
            control = self.controls.get(one.name)
            if control is None or control.record.mode != one.mode:
                control = Control(self, one)
            controls[one.name] = control
        if dragged is not None and controls.get(dragged.record.name) is not dragged:
            self.end_drag()
        self.controls = controls
        title = description_control(record)
        self.title = Control(self, title)
        self.root.clear()
        for control in (*controls.values(), self.title):
            self.root.add(control.root)
        self.root.add(self._axes)
        for one in record.controls:
            controls[one.name].change(one)
        self.title.draw()
        self._move()
        self.restyle()

    def restyle(self) -> None:
        """Apply the display's settings."""
        display = self.display
        self._axes.visible = bool(display.showAxes)
        if self.title is not None:
            self.title.root.visible = bool(display.showDescriptions)
        for control in self.controls.values():
            control.root.visible = control.record.always_visible or display.is_active(control)

    def draw(self) -> None:
        """Draw all controls anew."""
        for control in self.controls.values():
            control.draw()

    # -- where it is -----------------------------------------------------------------------------

    def place(self) -> None:
        """Move to where its frame is; hide it while that is not known."""
        scene = self.display.scene
        if scene is None or (self._placed and self.stamp):
            return
        try:
            pose = scene.look_up(self.frame or scene.fixed_frame, self.stamp)
        except TransformException as error:
            self.root.visible = self._placed = False
            text = f"no transform from [{self.frame}]: {error}"
            self.display.set_line(self.record.name, text)
            return
        self.display.set_line(self.record.name, self.record.problem)
        self.root.visible = self._placed = True
        if not np.array_equal(pose, self.root.pose):
            self.root.pose = pose
            self.face()
            if self.dragged is not None:
                self.dragged.drag_again()

    def place_anew(self) -> None:
        """Find its frame in another fixed frame."""
        self._placed = False
        self.place()

    def face(self) -> None:
        """Turn parts that face the viewer."""
        for control in (*self.controls.values(), self.title):
            if control is None or not control.record.markers:
                continue
            if control.record.facing == VIEW_FACING:
                control.place()

    def _move(self) -> None:
        for control in (*self.controls.values(), self.title):
            if control is not None:
                control.place()
        self._axes.set_axes(self.pose[np.newaxis], self.record.scale, 0.05 * self.record.scale)

    def set_pose(self, pose: Matrix, control: str = "") -> None:
        """Move it in its frame.

        Args:
            pose: The new pose; a rotation is normalised again after rounding.
            control: The control that moves it; empty for the server.
        """
        if not np.isfinite(pose).all():
            return
        self.pose = instance_matrix(pose[:3, 3].tolist(), quaternion_of(pose))
        self._changed = self._changed or bool(control)
        self._move()

    def take_pose(self, frame: str, stamp: int, pose: Matrix) -> None:
        """Move to where the server says, after a drag."""
        if self._is_echo(pose):
            self._requested = None
            return
        if self.dragged is not None:
            self._requested = (frame, stamp, pose)
            return
        if (frame, stamp) != (self.frame, self.stamp):
            self.frame, self.stamp, self._placed = frame, stamp, False
            self.place()
        self.set_pose(pose)

    def _is_echo(self, pose: Matrix) -> bool:
        """Return whether a server repeats a pose that a newer one has replaced since."""
        now = time.monotonic()
        sent = [one for at, one in self._echoes if now - at < _ECHO_S]
        if self.dragged is None:
            sent = sent[:-1]  # the last one is where it is
        return any(bool(np.abs(one - pose).max() < 1e-6) for one in reversed(sent))

    # -- feedback --------------------------------------------------------------------------------

    def begin_drag(self, control: Control) -> None:
        """Send poses while a control is dragged."""
        self.dragged, self._changed, self._sent = control, False, time.monotonic()
        self.display.on_drag(self)

    def end_drag(self) -> None:
        """Send the last pose."""
        if self._changed and self.dragged is not None:
            self._changed = False
            self.send(POSE_UPDATE, self.dragged.record.name)
        self.dragged = None
        self.display.on_drag(None)
        requested, self._requested = self._requested, None
        if requested is not None:
            self.take_pose(*requested)

    def send_drag(self) -> None:
        """Send the pose if it has changed, and a sign of life if it has not for a while."""
        if self.dragged is None:
            return
        if self._changed:
            # In ROS 1, a server connects a little later than its markers are shown.
            self._changed = not self.send(POSE_UPDATE, self.dragged.record.name, is_last=False)
        elif time.monotonic() - self._sent > _HOLD_S:
            self.send(KEEP_ALIVE, "")

    def send(
        self, event: int, control: str, point: Any = None, entry: int = 0, *, is_last: bool = True
    ) -> bool:
        """Send a feedback; return whether a server receives it.

        A click, a choice from a menu, or a last pose that does not reach a server is announced.

        Args:
            event: Its type, e.g. :data:`MOUSE_DOWN`.
            control: Name of the control.
            point: The point under the mouse, in the fixed frame; None for unknown.
            entry: Number of the menu's entry.
            is_last: Whether nothing more will be sent if no server receives it.
        """
        self._sent = time.monotonic()
        scene = self.display.scene
        if scene is None:
            return False
        pose, frame, stamp = self.pose, self.frame, 0
        at = None if point is None else np.array(point, np.float64)
        if self.stamp:
            # As its place in its frame is of that time, it is sent in the fixed frame.
            pose, frame = self.root.pose @ pose, scene.fixed_frame
        else:
            stamp = scene.latest_time(frame)
            if at is not None:
                at = (inverse(self.root.pose) @ (*at, 1.0))[:3]
        if event == POSE_UPDATE:
            self._echoes.append((self._sent, pose))
        command = ""
        if is_last and event in _COMMANDS:
            what = f"{_COMMANDS[event]} {entry or control}".strip()
            command = f"{what} of marker {self.record.name}"
        sent: bool = self.display.publish(
            self,
            {
                "header": {"frame_id": frame, "stamp": Time(stamp)},
                "marker_name": self.record.name,
                "control_name": control,
                "event_type": event,
                "pose": {
                    "position": dict(zip("xyz", pose[:3, 3].tolist(), strict=True)),
                    "orientation": dict(zip("xyzw", quaternion_of(pose), strict=True)),
                },
                "menu_entry_id": entry,
                "mouse_point": {} if at is None else dict(zip("xyz", at.tolist(), strict=True)),
                "mouse_point_valid": at is not None,
            },
            command,
        )
        return sent


# -- geometry --------------------------------------------------------------------------------------


def turn_about(axis: Vector, angle: float) -> Matrix:
    """Return the rotation by an angle in radians about an axis of length 1, 3 x 3."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn: Matrix = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)
    return turn


def angle_about(axis: Vector, start: Vector, end: Vector) -> float:
    """Return the angle in radians from one direction to another one, about an axis."""
    return math.atan2(float(axis @ np.cross(start, end)), float(start @ end))


def _shortest_turn(start: Vector, end: Vector) -> Matrix:
    """Return the shortest rotation from one direction to another one, both of length 1."""
    axis = np.cross(start, end)
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        if start @ end > 0:
            return np.eye(3)
        helper = np.eye(3)[int(np.abs(start).argmin())]
        axis = np.cross(start, helper)
        return turn_about(axis / np.linalg.norm(axis), math.pi)
    return turn_about(axis / length, math.atan2(length, float(start @ end)))


def facing_turn(turn: Matrix, angle: float, camera: Camera) -> Matrix:
    """Return how a control is turned so that its x points away from the viewer, and z up.

    Args:
        turn: The orientation of the control.
        angle: By how much it was rotated about its axis, radians.
        camera: The camera.

    Returns:
        In the fixed frame, 3 x 3.
    """
    ahead, up = -camera.pose[:3, 2], camera.pose[:3, 1]
    facing = _shortest_turn(turn[:, 0], ahead)
    upright = _shortest_turn(facing @ turn[:, 2], up)
    found: Matrix = turn_about(ahead, angle) @ upright @ facing
    return found


def point_on_plane(
    camera: Camera, x: float, y: float, point: Vector, normal: Vector
) -> Vector | None:
    """Return the point of a plane that is seen at a point of the image; None without one.

    Args:
        camera: The camera.
        x: Units of the item, from its left edge.
        y: The same, from its upper edge.
        point: A point of the plane.
        normal: Normal of the plane, of length 1.
    """
    origin, way = (np.array(part) for part in camera.ray(x, y))
    slope = float(way @ normal)
    if abs(slope) < 1e-3:
        return None  # seen from its edge, where a pixel is kilometres
    far = float((point - origin) @ normal) / slope
    return None if far <= 0 else origin + far * way


def point_on_axis(camera: Camera, x: float, y: float, point: Vector, axis: Vector) -> Vector | None:
    """Return the point of a straight line that is seen nearest to a point of the image.

    Args:
        camera: The camera.
        x: Units of the item, from its left edge.
        y: The same, from its upper edge.
        point: A point of the line.
        axis: Its direction, of length 1.

    Returns:
        None where the line points to the viewer, or the point would be behind the camera.
    """
    at = camera.project(tuple(point))
    if not math.isfinite(at.depth):
        return None
    ahead = camera.project(tuple(point + axis * (1e-3 * at.depth)))
    line = np.array([ahead.x - at.x, ahead.y - at.y])
    length = float(np.linalg.norm(line))
    if not length > 0.02:  # of about a pixel, where it is seen from the side
        return None
    line /= length
    share = float(line @ (x - at.x, y - at.y))
    origin, way = (
        np.array(part) for part in camera.ray(*(np.array([at.x, at.y]) + share * line).tolist())
    )
    slope = float(axis @ way)
    rest = 1 - slope * slope
    if rest < 1e-9:
        return None
    start = origin - point
    far = (float(axis @ start) - slope * float(way @ start)) / rest
    found: Vector = point + far * axis
    return found if math.isfinite(camera.project(tuple(found)).depth) else None

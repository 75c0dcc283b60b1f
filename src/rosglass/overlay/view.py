"""A view controller that moves RViz's camera like hector_rviz_plugins' view controller.

It sets the properties of RViz's own views, ``rviz/Orbit`` in 3D and ``rviz/TopDownOrtho`` in 2D,
so that the mouse works as in any RViz.
"""

from __future__ import annotations

import enum
import logging
import math
import time
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.overlay.orbit import (
    STEEPEST,
    FramePose,
    Orbit,
    Point,
    ease,
    shortest_turn,
)
from rosglass.overlay.property_values import shown
from rosglass.overlay.trackers import FIXED_FRAME
from rosglass.overlay.view_controller_settings import ViewSettings
from rosglass.qt import QtCore, Signal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.overlay.trackers import Frames

__all__ = ["ORBIT", "TOP_DOWN", "CurrentView", "View", "ViewMode", "Views"]


_log = logging.getLogger("rosglass.overlay")
#: RViz's class of the 3D view.
ORBIT = "rviz/Orbit"
#: RViz's class of the 2D view: from above, without perspective.
TOP_DOWN = "rviz/TopDownOrtho"
_TARGET_FRAME = "Target Frame"
_INVERT_Z_AXIS = "Invert Z Axis"
_PROPERTY_NAMES: dict[str, tuple[str, ...]] = {
    ORBIT: (
        *(f"Focal Point/{axis}" for axis in "XYZ"),
        "Distance",
        "Yaw",
        "Pitch",
        _INVERT_Z_AXIS,
        "Field of View",
    ),
    TOP_DOWN: ("X", "Y", "Scale", "Angle"),
}
#: RViz's default vertical field of view, in radians.
_DEFAULT_FIELD_OF_VIEW_RAD = math.pi / 4


class CurrentView(QtCore.QObject):
    """The current view, of any type, converted from and to an `Orbit`; base class of RViz's."""

    #: Another view is shown. Argument: whether :meth:`write` did it.
    changed = Signal(bool)

    def __init__(self) -> None:
        super().__init__()
        self._switching = False
        #: Height of the last 3D focus, because the 2D view has none.
        self._height = 0.0
        self._field_of_view = _DEFAULT_FIELD_OF_VIEW_RAD

    @property
    def kind(self) -> str:
        """RViz's class id of the view."""
        raise NotImplementedError

    @property
    def state(self) -> tuple[Any, ...]:
        """The camera's state: class id, target frame and the view's :data:`_PROPERTY_NAMES`.

        These begin with the focus: x, y and z of :data:`ORBIT`, x and y of :data:`TOP_DOWN`.
        """
        kind = self.kind
        return (
            kind,
            self._get(_TARGET_FRAME),
            *(self._get(name) for name in _PROPERTY_NAMES.get(kind, ())),
        )

    def read(self) -> Orbit:
        """Return where the camera is and what it looks at."""
        kind = self.kind
        if kind not in _PROPERTY_NAMES or self._get(_TARGET_FRAME) != FIXED_FRAME:
            return self._read_camera(kind)
        if kind == TOP_DOWN:
            return self._orbit_from_above(self._get("X"), self._get("Y"))
        x, y, z, distance, yaw, pitch, inverted, self._field_of_view = (
            self._get(name) for name in _PROPERTY_NAMES[ORBIT]
        )
        sign = -1 if inverted else 1
        return Orbit(Point(x, y, z), distance, sign * yaw, sign * pitch)

    def write(self, where: Orbit, kind: str) -> None:
        """Move the camera, in the view with class id `kind`: :data:`ORBIT` or :data:`TOP_DOWN`."""
        if self.kind != kind:
            self._switching = True
            try:
                self._switch_view(kind)
            finally:
                self._switching = False
        if self._get(_TARGET_FRAME) != FIXED_FRAME:
            self._set(_TARGET_FRAME, FIXED_FRAME)
        if kind == TOP_DOWN:
            self._height = where.focus.z
            scale = self._pixels_at_one_metre() / where.distance
            angle = _normalized(where.yaw + math.pi / 2)
            self._set_all(TOP_DOWN, where.focus.x, where.focus.y, scale, angle)
        else:
            sign = -1 if self._get(_INVERT_Z_AXIS) else 1
            yaw, pitch = _normalized(sign * where.yaw), sign * where.pitch
            self._set_all(ORBIT, *where.focus, where.distance, yaw, pitch)

    def request_frame(self) -> None:
        """Request a frame, in a view that does not draw all the time."""

    def close(self) -> None:
        """Release the view; safe to call twice."""

    def _orbit_from_above(self, x: float, y: float) -> Orbit:
        distance = self._pixels_at_one_metre() / max(self._get("Scale"), 1e-9)
        yaw = self._get("Angle") - math.pi / 2
        return Orbit(Point(x, y, self._height), distance, yaw, STEEPEST)

    def _on_current_changed(self) -> None:
        if not self._switching:
            self._height = 0.0
        self.changed.emit(self._switching)

    def _pixels_at_one_metre(self) -> float:
        """Return the pixels per metre of the 3D camera at a distance of one metre."""
        return max(self._height_px(), 1) / (2 * math.tan(self._field_of_view / 2))

    def _set_all(self, kind: str, *values: float) -> None:
        for name, value in zip(_PROPERTY_NAMES[kind], values, strict=False):
            self._set(name, value)

    # Of each 3D view.

    def _read_camera(self, kind: str) -> Orbit:
        """Return the orbit of the camera, for views of any type and target frame."""
        raise NotImplementedError

    def _switch_view(self, kind: str) -> None:
        raise NotImplementedError

    def _height_px(self) -> float:
        """Return the height of the view, in the pixels of the property Scale."""
        raise NotImplementedError

    def _get(self, name: str) -> Any:
        """Return the value of a property of the view, e.g. ``Focal Point/X``."""
        raise NotImplementedError

    def _set(self, name: str, value: Any) -> None:
        raise NotImplementedError


def _normalized(angle: float) -> float:
    """Return an angle in the range 0 to 2 pi, which RViz uses as well."""
    return math.remainder(angle, math.tau) % math.tau


#: The camera after :meth:`View.reset`.
_RESET_ORBIT = Orbit.between(Point(4.0, 0.0, 3.0), Point(0.0, 0.0, 0.0))
#: Maximum distance from the fixed frame's origin. RViz uses 32-bit floats, and its renderer
#: crashes on infinite ones.
_MAX_DISTANCE_M = 1e8
#: Seconds that the camera follows a frame by at once, as a view at rest may not draw for long.
_MAX_STEP_S = 0.1


class ViewMode(enum.IntEnum):
    """The camera's mode, with the values of ``hector_rviz_plugins/ViewMode``."""

    MODE_3D = 0
    MODE_2D = 1


class _Movement(NamedTuple):
    """An animated camera movement; `in_2d` if it ends in the 2D view."""

    start: Orbit
    goal: Orbit
    started: float
    in_2d: bool


class View(QtCore.QObject):
    """Moves the camera to points, between 2D and 3D, and along with a frame.

    Points are in metres. Moving the camera by other means, e.g. with the mouse, ends a movement.
    Shifting it also ends tracking; turning or zooming it does not. The first movement replaces
    other view types (FPS, ThirdPersonFollower) with ``rviz/Orbit``.

    Args:
        current: The current view, whose camera it moves.
        frames: The robot's frames.
        before_frame: Signal that the view is about to draw.
    """

    #: :attr:`mode` has changed.
    mode_changed = Signal()
    #: :attr:`tracked_frame` has changed.
    tracked_frame_changed = Signal()
    #: :attr:`problem` has changed. Argument: the new text.
    problem_changed = Signal(str)

    def __init__(self, current: CurrentView, frames: Frames, before_frame: Any) -> None:
        super().__init__()
        self._frames, self._current = frames, current
        #: The view controller's settings.
        self.settings = ViewSettings()
        self._tracked, self._problem = "", ""
        #: The camera's focus relative to the tracked frame; None: keep the current one.
        self._offset: Point | None = Point(0.0, 0.0, 0.0)
        #: Last pose of the tracked frame; its yaw is the one that the camera has reached.
        self._frame_pose: FramePose | None = None
        self._movement: _Movement | None = None
        #: Pitch to restore when switching back to 3D.
        self._pitch_3d = _RESET_ORBIT.pitch
        #: RViz's camera state after our last change; None to accept any change.
        self._expected_state: tuple[Any, ...] | None = None
        self._fixed_frame = ""
        self._last_mode = self.mode
        self._last_frame = time.monotonic()
        self._closed = False
        before_frame.connect(self._step)
        self._current.changed.connect(self._on_view_changed)

    @property
    def mode(self) -> ViewMode:
        """3D, or 2D: straight from above, without perspective."""
        in_2d = self._current.kind == TOP_DOWN if self._movement is None else self._movement.in_2d
        return ViewMode.MODE_2D if in_2d else ViewMode.MODE_3D

    @property
    def tracked_frame(self) -> str:
        """The frame that the camera follows; empty for none."""
        return self._tracked

    @property
    def is_moving(self) -> bool:
        """True during an animated movement."""
        return self._movement is not None

    @property
    def problem(self) -> str:
        """Why the camera cannot follow the tracked frame; empty if it can."""
        return self._problem

    @property
    def eye(self) -> Point:
        """The camera's position in the fixed frame; in 2D, above the centre of the view."""
        return self.seen.eye

    @property
    def focus(self) -> Point:
        """The point that the camera looks at, in the fixed frame."""
        return self.seen.focus

    @property
    def seen(self) -> Orbit:
        """The camera's position and focus, read from RViz."""
        return self._current.read()

    def move_eye(
        self,
        eye: Sequence[float],
        frame: str = "",
        *,
        animate: bool = True,
        stop_tracking: bool = False,
        switch_to_3d: bool = False,
    ) -> None:
        """Move the camera without turning it.

        Args:
            eye: New position: x, y, z in metres; z is ignored in 2D.
            frame: The frame of `eye`; empty for the fixed frame.
            animate: Whether to move smoothly instead of jumping.
            stop_tracking: Whether to stop following the tracked frame.
            switch_to_3d: Whether to switch to 3D.

        Raises:
            Error: `eye` is not three finite numbers, or too far away, or the frame is unknown.
        """
        position, now = self._in_fixed(eye, frame), self._final_orbit()
        in_2d = self.mode is ViewMode.MODE_2D
        if in_2d and switch_to_3d:
            in_2d, now = False, now._replace(pitch=self._pitch_3d)
        elif in_2d:
            position = Point(position.x, position.y, now.eye.z)
        goal = now._replace(focus=now.focus + (position - now.eye))
        self._store_offset(goal, stop_tracking)
        self._start(goal, animate, in_2d=in_2d)

    def move_eye_and_focus(
        self,
        eye: Sequence[float],
        focus: Sequence[float],
        frame: str = "",
        *,
        animate: bool = True,
        stop_tracking: bool = False,
    ) -> None:
        """Move the camera and the point that it looks at, and switch to 3D.

        Args:
            eye: New position of the camera: x, y, z in metres.
            focus: Point to look at: x, y, z in metres.
            frame: The frame of both; empty for the fixed frame.
            animate: Whether to move smoothly instead of jumping.
            stop_tracking: Whether to stop following the tracked frame.

        Raises:
            Error: A point is not three finite numbers or is too far away, both are equal, or the
                frame is unknown.
        """
        start, end = self._in_fixed(eye, frame), self._in_fixed(focus, frame)
        if start == end:
            raise Error(
                f"eye and focus are both at {shown(list(start))}; the camera must look somewhere"
            )
        goal = Orbit.between(start, end, self._final_orbit().yaw)
        self._store_offset(goal, stop_tracking)
        self._start(goal, animate, in_2d=False)

    def set_mode(self, mode: ViewMode | int, *, animate: bool = True) -> None:
        """Switch between 2D and 3D.

        Args:
            mode: 0 for 3D, 1 for 2D.
            animate: Whether to move smoothly instead of jumping.

        Raises:
            Error: `mode` is neither 0 nor 1.
        """
        if isinstance(mode, bool) or mode not in (0, 1):
            raise Error(f"there is no view mode {shown(mode)}: expected 0 (3D) or 1 (2D)")
        wanted = ViewMode(mode)
        if wanted is self.mode:
            return
        now, in_2d = self._final_orbit(), wanted is ViewMode.MODE_2D
        if in_2d:
            self._pitch_3d = now.pitch
        pitch = STEEPEST if in_2d else self._pitch_3d
        self._start(now._replace(pitch=pitch), animate, in_2d=in_2d)

    def track(self, frame: str) -> None:
        """Follow the position and yaw of a frame with the camera.

        Args:
            frame: Name of the frame; empty to stop following.

        Raises:
            Error: The frame is unknown.
        """
        if not isinstance(frame, str):
            raise Error(f"expected the name of a frame, got {shown(frame)}")
        if frame:
            self._frames.locate(frame)
        if frame == self._tracked:
            return
        self._tracked, self._frame_pose = frame, None
        self._offset = Point(0.0, 0.0, 0.0)
        self._set_problem("")
        self._current.request_frame()
        self.tracked_frame_changed.emit()

    def reset(self) -> None:
        """Show the fixed frame's origin in 3D from (4, 0, 3), and stop tracking."""
        self.end_motion()
        self._write(_RESET_ORBIT, ORBIT)
        self._emit_mode()

    def nudge(self, ahead: float, left: float) -> None:
        """Shift the view in the xy plane; ends movement and tracking.

        Args:
            ahead: Metres in the viewing direction.
            left: Metres to the left of it.

        Raises:
            Error: A distance is not finite, or the new focus is too far away.
        """
        self.end_motion()
        now = self._current.read()
        x, y, _ = now.focus + Point(-ahead, -left, 0.0).rotated(now.yaw)
        focus = self._in_fixed((x, y, now.focus.z), "")
        self._write(now._replace(focus=focus), self._view_class())

    def close(self) -> None:
        """Stop moving the camera; safe to call twice."""
        self._closed = True
        self._movement, self._tracked = None, ""
        self._current.close()

    def request_frame(self) -> None:
        """Request a frame, in a view that does not draw all the time."""
        self._current.request_frame()

    # Movements

    def _store_offset(self, goal: Orbit, stop_tracking: bool) -> None:
        """Store the goal's focus relative to the tracked frame."""
        if stop_tracking:
            self.track("")
        elif self._tracked:
            try:
                self._offset = self._pose_of(self._tracked).to_local(goal.focus)
            except Error:
                self._offset = None

    def _start(self, goal: Orbit, animate: bool, *, in_2d: bool) -> None:
        start, self._frame_pose = self._current.read(), None
        if not animate or not self.settings.animation_duration:
            self._finish(goal, in_2d=in_2d)
            return
        if not (in_2d and self._current.kind == TOP_DOWN):
            self._write(start, ORBIT)
        self._movement = _Movement(start, goal, time.monotonic(), in_2d)
        self._expected_state, self._fixed_frame = self._current.state, self._frames.fixed
        self._current.request_frame()
        self._emit_mode()

    def _finish(self, goal: Orbit, *, in_2d: bool) -> None:
        self._movement = None
        self._write(goal, TOP_DOWN if in_2d else ORBIT)
        self._emit_mode()

    def end_motion(self) -> None:
        """End movement and tracking."""
        self._movement = None
        self.track("")

    def _step(self) -> None:
        now = time.monotonic()
        passed, self._last_frame = min(now - self._last_frame, _MAX_STEP_S), now
        if self._closed or (self._movement is None and not self._tracked):
            self._expected_state = None
            return
        try:
            self._end_if_moved()
            if self._movement is not None:
                self._advance(now)
            elif self._tracked:
                self._follow(min(self.settings.tracking_gain * passed, 1.0))
        except (AttributeError, RuntimeError, TypeError):
            # E.g. another version of RViz that names the views' properties differently.
            _log.exception("RViz's camera cannot be moved")
            self.end_motion()
        self._emit_mode()

    def _advance(self, now: float) -> None:
        if self._tracked:
            self._carry_movement()
        movement = self._movement
        assert movement is not None
        duration = self.settings.animation_duration
        progress = (now - movement.started) / duration if duration else 1.0
        if progress >= 1:
            self._finish(movement.goal, in_2d=movement.in_2d)
        else:
            self._write(movement.start.towards(movement.goal, ease(progress)), self._view_class())

    def _carry_movement(self) -> None:
        """Move start and goal of a movement along with the tracked frame."""
        pose, movement = self._tracked_pose(), self._movement
        if pose is None or movement is None:
            return
        before, self._frame_pose = self._frame_pose or pose, pose
        start, goal = (end.moved_with(before, pose) for end in (movement.start, movement.goal))
        self._movement = movement._replace(start=start, goal=goal)

    def _follow(self, part: float) -> None:
        pose = self._tracked_pose()
        if pose is None:
            return
        now = self._current.read()
        if self._offset is None:
            self._offset = pose.to_local(now.focus)
        yaw = pose.yaw if self._frame_pose is None else self._frame_pose.yaw
        turn = shortest_turn(yaw, pose.yaw) * part
        self._frame_pose = FramePose(pose.point, yaw + turn)
        focus = now.focus.towards(pose.to_fixed(self._offset), part)
        moved = now._replace(focus=focus, yaw=now.yaw + turn)
        if not moved.is_near(now):
            self._write(moved, self._view_class())

    def _tracked_pose(self) -> FramePose | None:
        try:
            pose = self._pose_of(self._tracked)
        except Error as error:
            # Keep the first text: the error may read differently in each frame.
            self._set_problem(self._problem or str(error))
            return None
        self._set_problem("")
        return pose

    def _end_if_moved(self) -> None:
        """End movement or tracking if something else moved the camera since the last frame."""
        before, now = self._expected_state, self._current.state
        fixed, self._fixed_frame = self._fixed_frame, self._frames.fixed
        self._expected_state = now
        if before is None or (before == now and fixed == self._fixed_frame):
            return
        self._movement = None
        if fixed == self._fixed_frame and before[:2] == now[:2] and _is_shifted(before, now):
            self.track("")
        elif fixed == self._fixed_frame and before[1] != now[1]:
            # RViz itself now follows a frame.
            self.track("")

    def _on_view_changed(self, by_us: bool) -> None:
        if by_us or self._closed:
            return
        self._movement = self._expected_state = None
        if self._current.kind not in (ORBIT, TOP_DOWN):
            self.track("")
        self._emit_mode()

    def _emit_mode(self) -> None:
        mode = self.mode
        if mode is not self._last_mode:
            self._last_mode = mode
            self.mode_changed.emit()

    def _set_problem(self, problem: str) -> None:
        if problem != self._problem:
            self._problem = problem
            if problem:
                _log.warning("the camera cannot follow %s: %s", self._tracked, problem)
            self.problem_changed.emit(problem)

    def _in_fixed(self, position: Sequence[float], frame: str) -> Point:
        try:
            x, y, z = (float(number) for number in position)
        except (TypeError, ValueError):
            raise Error(f"expected x, y and z in metres, got {shown(position)}") from None
        if not all(math.isfinite(number) for number in (x, y, z)):
            raise Error(f"expected finite metres, got {shown([x, y, z])}")
        if not isinstance(frame, str):
            raise Error(f"expected the name of a frame, got {shown(frame)}")
        point = Point(x, y, z)
        if frame:
            point = Point(*self._frames.locate(frame).apply_point(point))
        if max(abs(number) for number in point) > _MAX_DISTANCE_M:
            limit = f"{_MAX_DISTANCE_M:g} m"
            raise Error(f"{shown([x, y, z])} is more than {limit} from the fixed frame's origin")
        return point

    def _pose_of(self, frame: str) -> FramePose:
        transform = self._frames.locate(frame)
        x, y, z, w = transform.rotation
        yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        return FramePose(Point(*transform.translation), yaw)

    def _final_orbit(self) -> Orbit:
        return self._current.read() if self._movement is None else self._movement.goal

    def _view_class(self) -> str:
        return TOP_DOWN if self._current.kind == TOP_DOWN else ORBIT

    def _write(self, where: Orbit, kind: str) -> None:
        self._current.write(where, kind)
        # Read it back, because RViz rounds to 32-bit floats.
        self._expected_state = self._current.state


def _is_shifted(before: tuple[Any, ...], now: tuple[Any, ...]) -> bool:
    """Return whether the focus moved between two states of the same view."""
    axes = 2 if now[0] == TOP_DOWN else 3
    return before[2 : 2 + axes] != now[2 : 2 + axes]


_MAX_NAME_LENGTH = 1000


class Views(QtCore.QObject):
    """The view types and saved views; base class of RViz's."""

    #: :attr:`kind` has changed.
    kind_changed = Signal()
    #: :attr:`saved` has changed.
    saved_changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._known = (self.kind, self.saved)
        self._scheduled = False

    @property
    def kinds(self) -> list[str]:
        """Class ids of the available view types, e.g. ``rviz/Orbit``."""
        raise NotImplementedError

    @property
    def kind(self) -> str:
        """Class id of the current view."""
        return self._current_kind()

    @kind.setter
    def kind(self, kind: str) -> None:
        kind = self._known_id(kind)
        # RViz crashes on an unknown type.
        if kind not in self.kinds:
            raise Error(
                f"there is no view type {shown(kind)}{self._hint(kind)}; "
                f"there are {', '.join(self.kinds)}"
            )
        if kind != self.kind:
            self._switch(kind)
        self.emit_changes()

    @property
    def saved(self) -> list[str]:
        """Names of the saved views, in the order of the Views panel; not unique."""
        raise NotImplementedError

    def save(self, name: str) -> None:
        """Save the current view, replacing a saved view of the same name.

        Raises:
            Error: The name is empty, longer than 1000 characters, or not a single line of text.
        """
        if not (isinstance(name, str) and name.strip() and name.isprintable()):
            raise Error(f"expected a name for the view, a text of one line, got {shown(name)}")
        if len(name) > _MAX_NAME_LENGTH:
            raise Error(f"expected a name of at most {_MAX_NAME_LENGTH} characters")
        if name in self.saved:
            self._take(self.saved.index(name))
        self._append(name)
        self.emit_changes()

    def show(self, name: str | int) -> None:
        """Show a saved view.

        Args:
            name: Its name, or its index in :attr:`saved`.

        Raises:
            Error: No such view is saved.
        """
        self._show(self._index(name))
        self.emit_changes()

    def remove(self, name: str | int) -> None:
        """Remove a saved view; see :meth:`show`.

        Raises:
            Error: No such view is saved.
        """
        self._take(self._index(name))
        self.emit_changes()

    def emit_changes(self) -> None:
        """Emit the signals of all changes since the last call."""
        self._scheduled = False
        (kind, saved), self._known = self._known, (self.kind, self.saved)
        if kind != self._known[0]:
            self.kind_changed.emit()
        if saved != self._known[1]:
            self.saved_changed.emit()

    def _hint(self, kind: object) -> str:
        if not isinstance(kind, str) or not kind:
            return ""
        base = kind.lower().rpartition("/")[2]
        like = [one for one in self.kinds if one.lower().endswith("/" + base)]
        return f"; did you mean {like[0]}?" if like else similar(kind, self.kinds)

    def _index(self, name: Any) -> int:
        saved = self.saved
        if isinstance(name, str) and name in saved:
            return saved.index(name)
        if isinstance(name, int) and not isinstance(name, bool) and 0 <= name < len(saved):
            return name
        there = f"saved views: {', '.join(map(repr, saved))}" if saved else "no views are saved"
        raise Error(f"there is no saved view {shown(name)}; {there}")

    def _on_change(self) -> None:
        if not self._scheduled:
            self._scheduled = True
            QtCore.QTimer.singleShot(0, self.emit_changes)

    # Of each 3D view.

    def _known_id(self, kind: Any) -> Any:
        """Return the class id in :attr:`kinds` of a type that has several; others unchanged."""
        return kind

    def _current_kind(self) -> str:
        raise NotImplementedError

    def _switch(self, kind: str) -> None:
        """Change to another type of view."""
        raise NotImplementedError

    def _append(self, name: str) -> None:
        """Save the current view, as the last one."""
        raise NotImplementedError

    def _show(self, index: int) -> None:
        """Show a saved view."""
        raise NotImplementedError

    def _take(self, index: int) -> None:
        """Remove a saved view."""
        raise NotImplementedError

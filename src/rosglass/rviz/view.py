"""RViz's camera, moved as hector_rviz_plugins' view controller moves it.

It steers RViz's own views, ``rviz/Orbit`` in 3D and ``rviz/TopDownOrtho`` in 2D, through their
properties, so that the mouse keeps working as in any RViz.
"""

from __future__ import annotations

import enum
import math
import time
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qt import QtCore, Signal
from rosglass.rviz.frames import FIXED_FRAME
from rosglass.rviz.orbit import STEEPEST, Orbit, Point, ease, shortest_turn

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.rviz.frames import Frames
    from rosglass.rviz.window import Window

__all__ = ["View", "ViewMode"]

_3D, _2D = "rviz/Orbit", "rviz/TopDownOrtho"
#: What the two views are set to at first, and by :meth:`View.reset`.
_START = Orbit.between(Point(4.0, 0.0, 3.0), Point(0.0, 0.0, 0.0))
#: What is taken for somebody else's change of a property, which keeps 32 bits of a number.
_NOTICED = 1e-4


class ViewMode(enum.IntEnum):
    """How the camera looks at the scene; the numbers of ``hector_rviz_plugins/ViewMode``."""

    MODE_3D = 0
    MODE_2D = 1


class View(QtCore.QObject):
    """Moves the camera: to places, between 2D and 3D, along with a frame.

    Places are in metres. Movements take `animation_duration`; one by the mouse ends ours, and one
    that shifts the view ends tracking, too.

    Args:
        window: RViz.
        frames: Where the robot's frames are.
    """

    #: 2D became 3D, or the other way round.
    mode_changed = Signal()
    #: Another frame is tracked, or none.
    tracked_frame_changed = Signal()
    #: Why the tracked frame cannot be followed now; empty when it can.
    problem_changed = Signal(str)

    def __init__(self, window: Window, frames: Frames) -> None:
        super().__init__()
        self._window, self._frames = window, frames
        #: Seconds that a movement takes; 0 jumps.
        self.animation_duration = 1.0
        #: How quickly the camera follows the tracked frame, in 1/s.
        self.tracking_gain = 3.0
        self._tracked, self._problem = "", ""
        #: Where the focus is held, seen from the tracked frame.
        self._offset = Point(0.0, 0.0, 0.0)
        self._last_yaw: float | None = None
        self._start: Orbit | None = None
        self._goal: Orbit | None = None
        self._began = 0.0
        #: Whether the view from above is to be shown once the camera is there.
        self._flatten = False
        #: What 3D returns to.
        self._pitch = _START.pitch
        self._told: Orbit | None = None
        self._last_mode = self.mode
        self._last_frame = time.monotonic()
        window.before_frame.connect(self._step)

    @property
    def mode(self) -> ViewMode:
        """2D, straight from above and without perspective, or 3D."""
        return ViewMode.MODE_2D if self._class() == _2D or self._flattening else ViewMode.MODE_3D

    @property
    def _flattening(self) -> bool:
        return self._flatten and self._goal is not None

    @property
    def tracked_frame(self) -> str:
        """The frame that the camera follows; empty when it follows none."""
        return self._tracked

    @property
    def problem(self) -> str:
        """Why the tracked frame cannot be followed now; empty when it can."""
        return self._problem

    @property
    def eye(self) -> Point:
        """Where the camera is, in the fixed frame; in 2D, above what it shows."""
        return self._read().eye

    @property
    def focus(self) -> Point:
        """What the camera looks at, in the fixed frame."""
        return self._read().focus

    def move_eye(
        self,
        eye: Sequence[float],
        frame: str = "",
        *,
        animate: bool = True,
        stop_tracking: bool = False,
        switch_to_3d: bool = False,
    ) -> None:
        """Move the camera; it keeps looking in the same direction.

        Args:
            eye: x, y, z in metres; in 2D, z counts for nothing.
            frame: The frame they are in; empty for the fixed frame.
            animate: Move there; otherwise jump.
            stop_tracking: Follow no frame any longer.
            switch_to_3d: Show it in 3D.

        Raises:
            Error: They are not three finite numbers, or the frame is not known.
        """
        place, now = self._in_fixed(eye, frame), self._end_of_movement()
        if switch_to_3d and self.mode is ViewMode.MODE_2D:
            now = self._raised(now)
        flat = self.mode is ViewMode.MODE_2D and not switch_to_3d
        if flat:
            place = Point(place.x, place.y, now.eye.z)
        self._set_off(
            now._replace(focus=now.focus + (place - now.eye)), animate, stop_tracking, flat=flat
        )

    def move_eye_and_focus(
        self,
        eye: Sequence[float],
        focus: Sequence[float],
        frame: str = "",
        *,
        animate: bool = True,
        stop_tracking: bool = False,
    ) -> None:
        """Move the camera and what it looks at, in 3D.

        Args:
            eye: x, y, z in metres.
            focus: x, y, z in metres.
            frame: The frame of both; empty for the fixed frame.
            animate: Move there; otherwise jump.
            stop_tracking: Follow no frame any longer.

        Raises:
            Error: They are not three finite numbers each or the same place, or the frame is not
                known.
        """
        start, end = self._in_fixed(eye, frame), self._in_fixed(focus, frame)
        if start == end:
            raise Error(f"eye and focus are both at {tuple(start)}; the camera must look somewhere")
        goal = Orbit.between(start, end, self._end_of_movement().yaw)
        self._set_off(goal, animate, stop_tracking, flat=False)

    def set_mode(self, mode: ViewMode | int, *, animate: bool = True) -> None:
        """Switch between 2D and 3D.

        Args:
            mode: 0 for 3D, 1 for 2D.
            animate: Move there; otherwise jump.

        Raises:
            Error: There is no such mode.
        """
        if mode not in (0, 1) or isinstance(mode, bool):
            raise Error(f"there is no view mode {mode!r}: expected 0 (3D) or 1 (2D)")
        wanted = ViewMode(mode)
        if wanted is self.mode:
            return
        now = self._end_of_movement()
        if wanted is ViewMode.MODE_2D:
            self._pitch = now.pitch
            self._set_off(now._replace(pitch=STEEPEST), animate, False, flat=True)
        else:
            self._set_off(self._raised(now), animate, False, flat=False)

    def track(self, frame: str) -> None:
        """Have the camera follow a frame, and turn with it.

        Args:
            frame: Its name; empty to follow none.

        Raises:
            Error: The frame is not known.
        """
        if frame:
            self._frames.locate(frame)
        if frame == self._tracked:
            return
        self._tracked, self._last_yaw = frame, None
        self._offset = Point(0.0, 0.0, 0.0)
        self._tell_problem("")
        self.tracked_frame_changed.emit()

    def reset(self) -> None:
        """Show the fixed frame's origin in 3D, as at first, and follow nothing."""
        self.track("")
        self._stop()
        self._write(_START)

    def nudge(self, ahead: float, left: float) -> None:
        """Shift the view in the plane of x and y, as seen by the operator, as the keys do it.

        Args:
            ahead: Metres away from the operator.
            left: Metres to the left.
        """
        self._stop()
        now = self._read()
        way = Point(-ahead, -left, 0.0).turned(now.yaw)
        self.track("")
        self._write(now._replace(focus=now.focus + way))

    def _set_off(self, goal: Orbit, animate: bool, stop_tracking: bool, *, flat: bool) -> None:
        start = self._read()
        if stop_tracking:
            self.track("")
        elif self._tracked:
            where, yaw = self._place_of(self._tracked)
            self._offset = (goal.focus - where).turned(-yaw)
        if flat and self._class() == _2D and not animate:
            self._stop()
            self._write(goal)
            return
        if not flat and self._class() == _2D:
            self._use(_3D)
            self._write(start._replace(pitch=STEEPEST))
        self._flatten = flat
        self._start, self._goal, self._began = start, goal, time.monotonic()
        if not animate or self.animation_duration <= 0:
            self._arrive()
        self._tell_mode()

    def _arrive(self) -> None:
        goal, flat = self._goal, self._flatten
        self._stop()
        if goal is None:
            return
        if flat and self._class() != _2D:
            self._use(_2D)
        self._write(goal)

    def _stop(self) -> None:
        self._start = self._goal = None
        self._flatten = False

    def _step(self) -> None:
        now = time.monotonic()
        passed, self._last_frame = now - self._last_frame, now
        self._notice_others()
        if self._goal is not None and self._start is not None:
            progress = (now - self._began) / max(self.animation_duration, 1e-6)
            if progress >= 1:
                self._arrive()
            else:
                self._write(self._start.towards(self._goal, ease(progress)))
        elif self._tracked:
            self._follow(min(self.tracking_gain * passed, 1.0))
        self._tell_mode()

    def _follow(self, part: float) -> None:
        try:
            where, yaw = self._place_of(self._tracked)
        except Error as error:
            self._tell_problem(str(error))
            return
        self._tell_problem("")
        now = self._read()
        turn = 0.0 if self._last_yaw is None else shortest_turn(self._last_yaw, yaw) * part
        self._last_yaw = yaw if self._last_yaw is None else self._last_yaw + turn
        focus = now.focus.towards(where + self._offset.turned(yaw), part)
        moved = now._replace(focus=focus, yaw=now.yaw + turn)
        if moved != now:
            self._write(moved)

    def _notice_others(self) -> None:
        """Stop where somebody else has moved the camera since the last frame."""
        told, now = self._told, self._read()
        if told is None:
            self._told = now
            return
        moved = max(abs(n) for n in now.focus - told.focus) > _NOTICED * max(1.0, now.distance)
        turned = abs(shortest_turn(told.yaw, now.yaw)) + abs(now.pitch - told.pitch) > _NOTICED
        zoomed = abs(now.distance / told.distance - 1) > _NOTICED
        if moved or turned or zoomed:
            self._stop()
            self._told = now
        if moved and self._tracked:
            self.track("")

    def _tell_mode(self) -> None:
        if self.mode is not self._last_mode:
            self._last_mode = self.mode
            self.mode_changed.emit()

    def _tell_problem(self, problem: str) -> None:
        if problem != self._problem:
            self._problem = problem
            self.problem_changed.emit(problem)

    def _in_fixed(self, place: Sequence[float], frame: str) -> Point:
        try:
            x, y, z = (float(number) for number in place)
        except (TypeError, ValueError):
            raise Error(f"expected x, y and z in metres, got {place!r}") from None
        if not all(math.isfinite(number) for number in (x, y, z)):
            raise Error(f"expected finite metres, got {(x, y, z)}")
        if not frame:
            return Point(x, y, z)
        transform = self._frames.locate(frame)
        return Point(*transform.apply_point((x, y, z)))

    def _place_of(self, frame: str) -> tuple[Point, float]:
        """Return where a frame is in the fixed frame, and its yaw in radians."""
        transform = self._frames.locate(frame)
        x, y, z, w = transform.rotation
        yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        return Point(*transform.translation), yaw

    def _end_of_movement(self) -> Orbit:
        return self._read() if self._goal is None else self._goal

    def _raised(self, view: Orbit) -> Orbit:
        """Return a view from above as it is in 3D again."""
        return view._replace(pitch=self._pitch)

    # RViz's own views.

    def _current(self) -> Any:
        return self._window.manager.getViewManager().getCurrent()

    def _class(self) -> str:
        return str(self._current().getClassId())

    def _use(self, kind: str) -> None:
        self._window.manager.getViewManager().setCurrentViewControllerType(kind)

    def _pixels_per_metre(self, distance: float) -> float:
        """Return the scale of the view from above that shows what a camera at a distance shows."""
        height = self._window.view_size()[1] / self._window.view_size()[2]
        return max(height, 1.0) / (2 * distance * math.tan(self._field_of_view / 2))

    #: Radians, of RViz's perspective views unless they are told otherwise.
    _field_of_view = math.pi / 4

    def _read(self) -> Orbit:
        view, kind = self._current(), self._class()
        if kind == _2D:
            x, y = _get(view, "X"), _get(view, "Y")
            height = self._pixels_per_metre(1.0) / max(_get(view, "Scale"), 1e-6)
            yaw = _get(view, "Angle") - math.pi / 2
            return Orbit(Point(x, y, 0.0), height, yaw, STEEPEST)
        if kind == _3D:
            focal = view.subProp("Focal Point")
            focus = Point(*(_get(focal, name) for name in "XYZ"))
            return Orbit(focus, _get(view, "Distance"), _get(view, "Yaw"), _get(view, "Pitch"))
        return self._told or _START

    def _write(self, where: Orbit) -> None:
        if self._class() not in (_2D, _3D):
            self._use(_3D)
        view = self._current()
        if view.subProp("Target Frame").getValue() != FIXED_FRAME:
            view.subProp("Target Frame").setValue(FIXED_FRAME)
        if self._class() == _2D:
            _set(view, X=where.focus.x, Y=where.focus.y, Angle=where.yaw + math.pi / 2)
            _set(view, Scale=self._pixels_per_metre(1.0) / where.distance)
        else:
            _set(view.subProp("Focal Point"), X=where.focus.x, Y=where.focus.y, Z=where.focus.z)
            yaw = math.remainder(where.yaw, math.tau) % math.tau
            _set(view, Distance=where.distance, Yaw=yaw, Pitch=where.pitch)
        self._told = self._read()


def _get(view: Any, name: str) -> float:
    return float(view.subProp(name).getValue())


def _set(view: Any, **values: float) -> None:
    for name, value in values.items():
        view.subProp(name).setValue(value)

"""RViz's camera, moved as hector_rviz_plugins' view controller moves it.

It steers RViz's own views, ``rviz/Orbit`` in 3D and ``rviz/TopDownOrtho`` in 2D, through their
properties, so that the mouse keeps working as in any RViz.
"""

from __future__ import annotations

import enum
import logging
import math
import time
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.errors import Error
from rosglass.qt import QtCore, Signal
from rosglass.rviz.current_view import FLAT, ORBIT, CurrentView
from rosglass.rviz.orbit import STEEPEST, Orbit, Place, Point, ease, shortest_turn
from rosglass.rviz.shown import shown
from rosglass.rviz.view_settings import ViewSettings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.rviz.frames import Frames
    from rosglass.rviz.window import Window

__all__ = ["View", "ViewMode"]

_log = logging.getLogger("rosglass.rviz")
#: What the camera is set to by :meth:`View.reset`.
_START = Orbit.between(Point(4.0, 0.0, 3.0), Point(0.0, 0.0, 0.0))
#: Metres from the fixed frame's origin; RViz's numbers have 32 bits, and its renderer crashes
#: where they are infinite.
_FARTHEST = 1e8


class ViewMode(enum.IntEnum):
    """How the camera looks at the scene; the numbers of ``hector_rviz_plugins/ViewMode``."""

    MODE_3D = 0
    MODE_2D = 1


class _Way(NamedTuple):
    """A movement: from where, to where, since when, and whether 2D is shown at its end."""

    start: Orbit
    goal: Orbit
    began: float
    flat: bool


class View(QtCore.QObject):
    """Moves the camera: to places, between 2D and 3D, along with a frame.

    Places are in metres. A movement ends when somebody else moves the camera, e.g. by the mouse;
    tracking ends when somebody else shifts it, and goes on when it is turned or zoomed only. Other
    views of RViz's (FPS, ThirdPersonFollower) make place for ``rviz/Orbit`` with the first
    movement.

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
        self._frames, self._current = frames, CurrentView(window)
        #: How it is moved.
        self.settings = ViewSettings()
        self._tracked, self._problem = "", ""
        #: Where the focus is held, seen from the tracked frame; None: where it is then.
        self._offset: Point | None = Point(0.0, 0.0, 0.0)
        #: Where the tracked frame was last, its yaw as far as the camera has turned with it.
        self._base: Place | None = None
        self._way: _Way | None = None
        #: What 3D returns to.
        self._pitch = _START.pitch
        #: What RViz's properties were after our last change; None where it does not matter.
        self._left_at: tuple[Any, ...] | None = None
        self._fixed = ""
        self._last_mode = self.mode
        self._last_frame = time.monotonic()
        self._closed = False
        window.before_frame.connect(self._step)
        window.config_loading.connect(self._let_go)
        window.closing.connect(self.close)
        self._current.changed.connect(self._view_changed)

    @property
    def mode(self) -> ViewMode:
        """2D, straight from above and without perspective, or 3D."""
        flat = self._current.kind == FLAT if self._way is None else self._way.flat
        return ViewMode.MODE_2D if flat else ViewMode.MODE_3D

    @property
    def tracked_frame(self) -> str:
        """The frame that the camera follows; empty when it follows none."""
        return self._tracked

    @property
    def is_moving(self) -> bool:
        """Whether a movement is under way."""
        return self._way is not None

    @property
    def problem(self) -> str:
        """Why the tracked frame cannot be followed now; empty when it can."""
        return self._problem

    @property
    def eye(self) -> Point:
        """Where the camera is, in the fixed frame; in 2D, above what it shows."""
        return self.seen.eye

    @property
    def focus(self) -> Point:
        """What the camera looks at, in the fixed frame."""
        return self.seen.focus

    @property
    def seen(self) -> Orbit:
        """Where the camera is and what it looks at, read from RViz at once."""
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
        """Move the camera; it keeps looking in the same direction.

        Args:
            eye: x, y, z in metres; in 2D, z counts for nothing.
            frame: The frame they are in; empty for the fixed frame.
            animate: Move there; otherwise jump.
            stop_tracking: Follow no frame any longer.
            switch_to_3d: Show it in 3D.

        Raises:
            Error: They are not three finite numbers or too far away, or the frame is not known.
        """
        place, now = self._in_fixed(eye, frame), self._end_of_movement()
        flat = self.mode is ViewMode.MODE_2D
        if flat and switch_to_3d:
            flat, now = False, now._replace(pitch=self._pitch)
        elif flat:
            place = Point(place.x, place.y, now.eye.z)
        goal = now._replace(focus=now.focus + (place - now.eye))
        self._hold(goal, stop_tracking)
        self._set_off(goal, animate, flat=flat)

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
            Error: They are not three finite numbers each, too far away or the same place, or the
                frame is not known.
        """
        start, end = self._in_fixed(eye, frame), self._in_fixed(focus, frame)
        if start == end:
            raise Error(
                f"eye and focus are both at {shown(list(start))}; the camera must look somewhere"
            )
        goal = Orbit.between(start, end, self._end_of_movement().yaw)
        self._hold(goal, stop_tracking)
        self._set_off(goal, animate, flat=False)

    def set_mode(self, mode: ViewMode | int, *, animate: bool = True) -> None:
        """Switch between 2D and 3D.

        Args:
            mode: 0 for 3D, 1 for 2D.
            animate: Move there; otherwise jump.

        Raises:
            Error: There is no such mode.
        """
        if isinstance(mode, bool) or mode not in (0, 1):
            raise Error(f"there is no view mode {shown(mode)}: expected 0 (3D) or 1 (2D)")
        wanted = ViewMode(mode)
        if wanted is self.mode:
            return
        now, flat = self._end_of_movement(), wanted is ViewMode.MODE_2D
        if flat:
            self._pitch = now.pitch
        pitch = STEEPEST if flat else self._pitch
        self._set_off(now._replace(pitch=pitch), animate, flat=flat)

    def track(self, frame: str) -> None:
        """Have the camera follow a frame, and turn with it.

        Args:
            frame: Its name; empty to follow none.

        Raises:
            Error: The frame is not known.
        """
        if not isinstance(frame, str):
            raise Error(f"a frame is named by a text, not by {shown(frame)}")
        if frame:
            self._frames.locate(frame)
        if frame == self._tracked:
            return
        self._tracked, self._base = frame, None
        self._offset = Point(0.0, 0.0, 0.0)
        self._tell_problem("")
        self.tracked_frame_changed.emit()

    def reset(self) -> None:
        """Show the fixed frame's origin in 3D from (4, 0, 3), and follow nothing."""
        self._let_go()
        self._write(_START, ORBIT)
        self._tell_mode()

    def nudge(self, ahead: float, left: float) -> None:
        """Shift the view in the plane of x and y, as the keys do it; ends movement and tracking.

        Args:
            ahead: Metres away from the operator.
            left: Metres to the operator's left.

        Raises:
            Error: They are not finite, or lead too far away.
        """
        self._let_go()
        now = self._current.read()
        x, y, _ = now.focus + Point(-ahead, -left, 0.0).turned(now.yaw)
        focus = self._in_fixed((x, y, now.focus.z), "")
        self._write(now._replace(focus=focus), self._kind())

    def close(self) -> None:
        """Leave the camera to RViz; safe to call twice."""
        self._closed = True
        self._way, self._tracked = None, ""
        self._current.close()

    # Movements

    def _hold(self, goal: Orbit, stop_tracking: bool) -> None:
        """Hold the focus where it will be, seen from the tracked frame."""
        if stop_tracking:
            self.track("")
        elif self._tracked:
            try:
                self._offset = self._place_of(self._tracked).seen(goal.focus)
            except Error:
                self._offset = None

    def _set_off(self, goal: Orbit, animate: bool, *, flat: bool) -> None:
        start, self._base = self._current.read(), None
        if not animate or not self.settings.animation_duration:
            self._arrive(goal, flat=flat)
            return
        if not (flat and self._current.kind == FLAT):
            self._write(start, ORBIT)
        self._way = _Way(start, goal, time.monotonic(), flat)
        self._left_at, self._fixed = self._current.state, self._frames.fixed
        self._tell_mode()

    def _arrive(self, goal: Orbit, *, flat: bool) -> None:
        self._way = None
        self._write(goal, FLAT if flat else ORBIT)
        self._tell_mode()

    def _let_go(self) -> None:
        """End movement and tracking."""
        self._way = None
        self.track("")

    def _step(self) -> None:
        now = time.monotonic()
        passed, self._last_frame = now - self._last_frame, now
        if self._closed or (self._way is None and not self._tracked):
            self._left_at = None
            return
        try:
            self._notice_others()
            if self._way is not None:
                self._go_on(now)
            elif self._tracked:
                self._follow(min(self.settings.tracking_gain * passed, 1.0))
        except (AttributeError, RuntimeError, TypeError):
            # As when another version of RViz names the properties of its views another way.
            _log.exception("RViz's camera cannot be moved")
            self._let_go()
        self._tell_mode()

    def _go_on(self, now: float) -> None:
        if self._tracked:
            self._go_along()
        way = self._way
        assert way is not None
        duration = self.settings.animation_duration
        progress = (now - way.began) / duration if duration else 1.0
        if progress >= 1:
            self._arrive(way.goal, flat=way.flat)
        else:
            self._write(way.start.towards(way.goal, ease(progress)), self._kind())

    def _go_along(self) -> None:
        """Have start and goal of a movement go along with the tracked frame."""
        place, way = self._find_tracked(), self._way
        if place is None or way is None:
            return
        before, self._base = self._base or place, place
        start, goal = way.start.carried(before, place), way.goal.carried(before, place)
        self._way = way._replace(start=start, goal=goal)

    def _follow(self, part: float) -> None:
        place = self._find_tracked()
        if place is None:
            return
        now = self._current.read()
        if self._offset is None:
            self._offset = place.seen(now.focus)
        yaw = place.yaw if self._base is None else self._base.yaw
        turn = shortest_turn(yaw, place.yaw) * part
        self._base = Place(place.point, yaw + turn)
        focus = now.focus.towards(place.outside(self._offset), part)
        moved = now._replace(focus=focus, yaw=now.yaw + turn)
        if not moved.is_near(now):
            self._write(moved, self._kind())

    def _find_tracked(self) -> Place | None:
        try:
            place = self._place_of(self._tracked)
        except Error as error:
            # Told once: what is missing may be said in other words with each frame.
            self._tell_problem(self._problem or str(error))
            return None
        self._tell_problem("")
        return place

    def _notice_others(self) -> None:
        """End what somebody else has put an end to since the last frame."""
        before, now = self._left_at, self._current.state
        fixed, self._fixed = self._fixed, self._frames.fixed
        self._left_at = now
        if before is None or (before == now and fixed == self._fixed):
            return
        self._way = None
        if fixed == self._fixed and before[:2] == now[:2] and _is_shifted(before, now):
            self.track("")
        elif fixed == self._fixed and before[1] != now[1]:
            # Somebody has RViz itself follow a frame.
            self.track("")

    def _view_changed(self, by_us: bool) -> None:
        if by_us or self._closed:
            return
        self._way = self._left_at = None
        if self._current.kind not in (ORBIT, FLAT):
            self.track("")
        self._tell_mode()

    def _tell_mode(self) -> None:
        mode = self.mode
        if mode is not self._last_mode:
            self._last_mode = mode
            self.mode_changed.emit()

    def _tell_problem(self, problem: str) -> None:
        if problem != self._problem:
            self._problem = problem
            if problem:
                _log.warning("the camera cannot follow %s: %s", self._tracked, problem)
            self.problem_changed.emit(problem)

    def _in_fixed(self, place: Sequence[float], frame: str) -> Point:
        try:
            x, y, z = (float(number) for number in place)
        except (TypeError, ValueError):
            raise Error(f"expected x, y and z in metres, got {shown(place)}") from None
        if not all(math.isfinite(number) for number in (x, y, z)):
            raise Error(f"expected finite metres, got {shown([x, y, z])}")
        if not isinstance(frame, str):
            raise Error(f"a frame is named by a text, not by {shown(frame)}")
        point = Point(x, y, z)
        if frame:
            point = Point(*self._frames.locate(frame).apply_point(point))
        if max(abs(number) for number in point) > _FARTHEST:
            raise Error(
                f"{shown([x, y, z])} is more than {_FARTHEST:g} m from the fixed frame's origin"
            )
        return point

    def _place_of(self, frame: str) -> Place:
        transform = self._frames.locate(frame)
        x, y, z, w = transform.rotation
        yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        return Place(Point(*transform.translation), yaw)

    def _end_of_movement(self) -> Orbit:
        return self._current.read() if self._way is None else self._way.goal

    def _kind(self) -> str:
        return FLAT if self._current.kind == FLAT else ORBIT

    def _write(self, where: Orbit, kind: str) -> None:
        self._current.write(where, kind)
        # As RViz keeps it, in numbers of 32 bits.
        self._left_at = self._current.state


def _is_shifted(before: tuple[Any, ...], now: tuple[Any, ...]) -> bool:
    """Return whether what is looked at is elsewhere, by the states of the same view."""
    axes = 2 if now[0] == FLAT else 3
    return before[2 : 2 + axes] != now[2 : 2 + axes]

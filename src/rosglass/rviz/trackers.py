"""Points of the scene, and where on the 3D view they are seen."""
# ruff: noqa: N815 - the names of properties and signals are QML's

from __future__ import annotations

import contextlib
import math
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.element import DEFAULT_TIMEOUT
from rosglass.qt import Property, QJSValue, QtCore, QtGui, Signal, is_alive
from rosglass.rviz.camera import Camera
from rosglass.rviz.face import VARIANT, given, place
from rosglass.rviz.shown import shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rosglass.qml.runtime import Runtime
    from rosglass.rviz.frames import Frames
    from rosglass.rviz.window import Window

__all__ = ["Tracker", "Trackers"]

#: Units and metres below which a change is none.
_THRESHOLD = 0.01
#: Seconds without a newer transform after which a frame that has moved is told to be old.
_OLD = DEFAULT_TIMEOUT / 1000
_NAN = (math.nan, math.nan, math.nan)


class Tracker(QtCore.QObject):
    """A point of the scene, followed on the 3D view. Made by :class:`Trackers` only.

    Args:
        owner: Tells it when to look.
        point: x, y, z in metres.
        frame: Whose; empty for the fixed frame.
        scale: Returns how many units of the widget with the 3D view one unit of `position` is.
        runtime: Where errors are thrown; without one, they are raised.
    """

    #: What errors call it.
    CALLED = "tracker"

    #: It is seen elsewhere now.
    positionChanged = Signal(QtGui.QVector3D, arguments=["position"])
    pointChanged = Signal()
    frameChanged = Signal()
    #: Why there is no place for it, or an old one; empty where there is one.
    problemChanged = Signal()
    staleChanged = Signal()

    def __init__(
        self,
        owner: Trackers,
        point: tuple[float, float, float],
        frame: str,
        scale: Callable[[], float],
        runtime: Runtime | None,
    ) -> None:
        super().__init__()
        self._owner, self._point, self._frame = owner, point, frame
        self._scale, self._runtime = scale, runtime
        self._position, self._problem, self._stale = _NAN, "", False
        #: The newest transform of its frame, and when it came.
        self._newest: tuple[int, float] | None = None

    @property
    def follows_frame(self) -> bool:
        """Whether it moves with a frame of the robot."""
        return bool(self._frame)

    def look(self) -> None:
        """Find out where it is seen now."""
        at, problem = _NAN, ""
        stale = bool(self._frame)
        try:
            at, stamp = self._owner.seen(self._point, self._frame, self._scale())
            stale = self._is_old(stamp)
            if stale:
                problem = f"where the frame {self._frame!r} is was not told for {_OLD:g} s"
        except Error as error:
            problem = str(error)
        told = self._stale
        self._stale = stale
        if _differ(at, self._position):
            self._position = at
            self.positionChanged.emit(QtGui.QVector3D(*at))
        if problem != self._problem:
            self._problem = problem
            self.problemChanged.emit()
        if stale != told:
            self.staleChanged.emit()

    def _is_old(self, stamp: int) -> bool:
        # What stands still for ever has no time.
        if not stamp:
            return False
        now = self._owner.steady()
        if self._newest is None or self._newest[0] != stamp:
            self._newest = stamp, now
        return now - self._newest[1] > _OLD

    def move(self, point: Sequence[float] | dict[str, float]) -> None:
        """Follow another point, in the same frame.

        Raises:
            Error: It is no point.
        """
        new = place(point)
        if new != self._point:
            self._point = new
            self.pointChanged.emit()
            self.look()

    def use_frame(self, frame: str) -> None:
        """Have the point mean another frame's; empty for the fixed frame.

        Raises:
            Error: It is no name.
        """
        if not isinstance(frame, str) or len(frame) > 1000:
            raise Error(f"expected the name of a frame, e.g. 'base_link', got {shown(frame)}")
        if frame != self._frame:
            self._frame, self._newest = frame, None
            self.frameChanged.emit()
            self.look()

    def _set_point(self, point: Any) -> None:
        with _answering(self._runtime, "tracker.point"):
            self.move(given(point) if isinstance(point, QJSValue) else point)

    def _set_frame(self, frame: Any) -> None:
        with _answering(self._runtime, "tracker.frame"):
            self.use_frame(given(frame) if isinstance(frame, QJSValue) else frame)

    def _get_point(self) -> QJSValue | tuple[float, float, float]:
        if self._runtime is None:
            return self._point
        return self._runtime.value(dict(zip("xyz", self._point, strict=True)))

    #: x, y and z in metres, of `frame`; may be changed.
    point = Property(QJSValue, _get_point, _set_point, notify=pointChanged)
    #: A frame of the robot that the point moves with; empty for RViz's fixed frame.
    frame = Property(VARIANT, lambda self: self._frame, _set_frame, notify=frameChanged)
    #: x and y in units of the overlay, z the distance from the camera in metres; all NaN while it
    #: is behind the camera.
    position = Property(
        QtGui.QVector3D, lambda self: QtGui.QVector3D(*self._position), notify=positionChanged
    )
    problem = Property(str, lambda self: self._problem, notify=problemChanged)
    #: Whether nothing came of its frame for 3 s; `position` is where it was last then.
    stale = Property(bool, lambda self: self._stale, notify=staleChanged)


class Trackers:
    """All trackers of an RViz, brought up to date before each of its frames.

    Args:
        window: RViz.
        frames: Returns where the robot's frames are; called when a tracker needs one.
    """

    def __init__(self, window: Window, frames: Callable[[], Frames]) -> None:
        self._window, self._frames = window, frames
        self._trackers: list[Tracker] = []
        self._camera: Camera | None = None
        self._scales: dict[Tracker, float] = {}
        window.before_frame.connect(self._before_frame)

    def add(
        self,
        point: Sequence[float],
        frame: str = "",
        scale: Callable[[], float] = lambda: 1.0,
        runtime: Runtime | None = None,
    ) -> Tracker:
        """Follow a point, for as long as the result exists; see :class:`Tracker`.

        Raises:
            Error: It is no point, or no frame.
        """
        made = Tracker(self, place(point), "", scale, runtime)
        if self._camera is not None:
            # Nobody may have asked for it for a while.
            self._camera.update()
        made.use_frame(frame)
        self._trackers.append(made)
        made.look()
        return made

    def remove(self, tracker: Tracker) -> None:
        """Follow it no longer; does nothing when it is not followed."""
        if tracker in self._trackers:
            self._trackers.remove(tracker)

    def let_go(self, runtime: Runtime) -> None:
        """Follow nothing any longer for a QML engine that is about to go."""
        self._trackers = [t for t in self._trackers if is_alive(t) and t._runtime is not runtime]

    def __len__(self) -> int:
        """Return how many are followed."""
        return len(self._trackers)

    def seen(
        self, point: tuple[float, float, float], frame: str, scale: float
    ) -> tuple[tuple[float, float, float], int]:
        """Return where a point is seen and how far away, and the time of that in nanoseconds.

        The time is 0 for what does not move.

        Raises:
            Error: Nobody knows where the frame is.
        """
        if self._camera is None:
            self._camera = Camera(self._window)
        stamp = 0
        if frame:
            there = self._frames().locate(frame)
            stamp = there.stamp.nanoseconds
            x, y, z = there.apply_point(point)
            point = (float(x), float(y), float(z))
        found = self._camera.project(point)
        return (found.x / scale, found.y / scale, found.depth), stamp

    def steady(self) -> float:
        """Return seconds by which ages are told; see :meth:`Session.steady`."""
        return self._frames().steady()

    def _before_frame(self) -> None:
        self._trackers = [tracker for tracker in self._trackers if is_alive(tracker)]
        if not self._trackers or self._camera is None:
            return
        moved = self._camera.update()
        for tracker in list(self._trackers):
            scale = tracker._scale()
            if moved or tracker.follows_frame or self._scales.get(tracker) != scale:
                self._scales[tracker] = scale
                tracker.look()
        self._scales = {t: s for t, s in self._scales.items() if t in self._trackers}


@contextlib.contextmanager
def _answering(runtime: Runtime | None, what: str) -> Iterator[None]:
    """Throw errors where there is JavaScript; otherwise let them through."""
    try:
        yield
    except Error as error:
        if runtime is None:
            raise
        runtime.throw(f"{what}: {error}")


def _differ(new: Sequence[float], old: Sequence[float]) -> bool:
    if math.isnan(new[0]) or math.isnan(old[0]):
        return math.isnan(new[0]) != math.isnan(old[0])
    return any(abs(a - b) > _THRESHOLD for a, b in zip(new, old, strict=True))

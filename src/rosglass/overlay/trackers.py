"""The robot's coordinate frames, and trackers of points in the 3D view."""
# ruff: noqa: N815 - the names of properties and signals are QML's

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm.names import similar
from rosglass.comm.statistics import StampMonitor
from rosglass.errors import Error, LookupException, TransformException
from rosglass.overlay.property_values import shown
from rosglass.overlay.qml_members import VARIANT, errors_to_js, point_of, to_python
from rosglass.qml.elements.element import DEFAULT_TIMEOUT_MS
from rosglass.qml.elements.tf_buffer import TfLink
from rosglass.qt import Property, QJSValue, QtCore, QtGui, Signal, is_alive
from rosglass.tf import Transform

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.node import Node
    from rosglass.comm.time import Time
    from rosglass.overlay.camera import Camera
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import Session
    from rosglass.tf import TransformBuffer

__all__ = ["FIXED_FRAME", "Frames", "Tracker", "Trackers"]


#: Maximum number of frames that an error message lists.
_MAX_NAMED_FRAMES = 8
#: Lifetime in seconds of a cached error message, and the size of the cache.
_EXPLANATION_MAX_AGE_S, _MAX_EXPLANATIONS = 1.0, 100
#: Name of the fixed frame in RViz's properties.
FIXED_FRAME = "<Fixed Frame>"


class Frames(QtCore.QObject):
    """The transforms received by the overlays' node, because RViz's own are not accessible.

    Args:
        session: The session of the overlays.
        fixed_frame: Returns the fixed frame.
        namespace: Namespace of ``tf``; empty for that of the node.
    """

    #: Transforms start or stop being received.
    available_changed = Signal()

    def __init__(
        self, session: Session, fixed_frame: Callable[[], str], namespace: str = "/"
    ) -> None:
        super().__init__()
        self._namespace = namespace
        self._session, self._fixed_frame = session, fixed_frame
        self._tf_link: TfLink | None = None
        self._node: Node | None = None
        #: Error texts for missing frames, each with its creation time.
        self._explanations: dict[tuple[str, str, str], tuple[float, str]] = {}
        session.node_changed.connect(self._on_node_changed)
        self._on_node_changed()

    @property
    def buffer(self) -> TransformBuffer | None:
        """The received transforms; None without a node."""
        return None if self._tf_link is None else self._tf_link.buffer

    @property
    def fixed(self) -> str:
        """The fixed frame."""
        return self._fixed_frame()

    def steady(self) -> float:
        """Return the current time for measuring ages, in seconds; see :meth:`Session.steady`."""
        return self._session.steady()

    @property
    def is_simulated(self) -> bool:
        """True if the robot's time is that of a simulation or a recording."""
        return self._node is not None and self._node.has_simulated_stamps

    def locate(self, frame: str, time: Time | None = None) -> Transform:
        """Return the transform from a frame to the fixed frame.

        Args:
            frame: Name of the frame; empty or :data:`FIXED_FRAME` for the fixed frame itself.
            time: Time of the transform; None for the latest.

        Raises:
            Error: The frame is unknown, or not connected to the fixed frame.
        """
        frame, fixed = frame.lstrip("/"), self.fixed.lstrip("/")
        if frame in ("", FIXED_FRAME, fixed):
            return Transform(frame_id=fixed, child_frame_id=fixed)
        if self._tf_link is None:
            raise LookupException(
                f"the frame {frame!r} is not known yet: there is no connection to the robot"
            )
        if self._tf_link.problem:
            raise Error(f"the frame {frame!r} is not known: {self._tf_link.problem}")
        try:
            return self._tf_link.buffer.lookup_transform(fixed, frame, time)
        except TransformException as error:
            raise type(error)(self._explanation(frame, fixed, error)) from None

    def _explanation(self, frame: str, fixed: str, error: TransformException) -> str:
        """Return :meth:`_explain`'s text, cached for a second: each rendered frame needs it."""
        case, now = (frame, fixed, str(error)), time.monotonic()
        made, text = self._explanations.get(case, (-math.inf, ""))
        if now - made > _EXPLANATION_MAX_AGE_S:
            text = self._explain(frame, fixed, error)
            if len(self._explanations) > _MAX_EXPLANATIONS:
                self._explanations.clear()
            self._explanations[case] = (now, text)
        return text

    def _explain(self, frame: str, fixed: str, error: TransformException) -> str:
        """Return an error text that says which of the two frames is missing."""
        known = [] if self._tf_link is None else sorted(self._tf_link.buffer.tree())
        if not fixed:
            return f"there is no fixed frame to transform {frame!r} into; choose one"
        if not known:
            return f"there is no frame {frame!r}: nothing is received on /tf and /tf_static"
        there = f"there are {', '.join(known[:_MAX_NAMED_FRAMES])}" + (
            ", ..." if known[_MAX_NAMED_FRAMES:] else ""
        )
        if frame not in known:
            return f"there is no frame {frame!r}{similar(frame, known) or f'; {there}'}"
        if fixed not in known:
            return f"{frame!r} cannot be shown: the fixed frame {fixed!r} does not exist; {there}"
        return f"there is no transform from {frame!r} to the fixed frame {fixed!r}: {error}"

    def close(self) -> None:
        """Stop receiving transforms; safe to call twice."""
        link, self._tf_link, self._node = self._tf_link, None, None
        if link is not None:
            link.leave(self)

    def _on_node_changed(self) -> None:
        node = self._session.node
        if node is self._node:
            return
        self.close()
        self._node = node
        if node is not None:
            self._tf_link = TfLink.join(self._session, node, self._namespace, self)
        self.available_changed.emit()


#: Minimum change of a position, in units of the overlay and in metres.
_MIN_CHANGE = 0.01
#: Seconds without a new transform after which a non-static frame is stale.
_STALE_AFTER_S = DEFAULT_TIMEOUT_MS / 1000
_NAN = (math.nan, math.nan, math.nan)


class Tracker(QtCore.QObject):
    """A point of the scene and its position in the 3D view; created by :class:`Trackers` only.

    Args:
        owner: The trackers that update it.
        point: x, y, z in metres.
        frame: The frame of the point; empty for the fixed frame.
        scale: Returns the units of the widget with the 3D view per unit of `position`.
        runtime: The QML runtime that errors are thrown into; None raises them.
    """

    #: Name in error messages.
    CALLED = "tracker"

    #: The position in the view has changed.
    positionChanged = Signal(QtGui.QVector3D, arguments=["position"])
    pointChanged = Signal()
    frameChanged = Signal()
    #: `problem` has changed: why the position is unknown or old, empty otherwise.
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
        #: Stamp of the latest transform in nanoseconds, and its arrival time in seconds, earlier by
        #: what it was late.
        self._latest: tuple[int, float] | None = None
        self._stamps = StampMonitor()

    @property
    def follows_frame(self) -> bool:
        """True if it moves with a frame of the robot."""
        return bool(self._frame)

    def update(self) -> None:
        """Update position, problem and staleness."""
        at, problem = _NAN, ""
        stale = bool(self._frame)
        try:
            at, stamp = self._owner.locate(self._point, self._frame, self._scale())
            stale = self._is_old(stamp)
            if stale:
                problem = f"the frame {self._frame!r} was not updated for {_STALE_AFTER_S:g} s"
        except Error as error:
            problem = str(error)
        before, self._stale = self._stale, stale
        if _has_moved(at, self._position):
            self._position = at
            self.positionChanged.emit(QtGui.QVector3D(*at))
        if problem != self._problem:
            self._problem = problem
            self.problemChanged.emit()
        if stale != before:
            self.staleChanged.emit()

    def _is_old(self, stamp: int) -> bool:
        # Static transforms have no stamp.
        if not stamp:
            return False
        now = self._owner.steady()
        if self._latest is None or self._latest[0] != stamp:
            late = 0.0
            if not self._owner.is_simulated():
                late = self._stamps.add(self._frame.encode(), time.time_ns(), stamp)
            self._latest = stamp, now - late
        return now - self._latest[1] > _STALE_AFTER_S

    def move(self, point: Sequence[float] | dict[str, float]) -> None:
        """Follow another point of the same frame.

        Raises:
            Error: `point` is not a point.
        """
        new = point_of(point)
        if new != self._point:
            self._point = new
            self.pointChanged.emit()
            self.update()

    def use_frame(self, frame: str) -> None:
        """Set the frame that the point moves with; empty for the fixed frame.

        Raises:
            Error: `frame` is not a string of at most 1000 characters.
        """
        if not isinstance(frame, str) or len(frame) > 1000:
            raise Error(f"expected the name of a frame, e.g. 'base_link', got {shown(frame)}")
        if frame != self._frame:
            self._frame, self._latest = frame, None
            self.frameChanged.emit()
            self.update()

    def _set_point(self, point: Any) -> None:
        with errors_to_js(self._runtime, "tracker.point", point):
            self.move(to_python(point))

    def _set_frame(self, frame: Any) -> None:
        with errors_to_js(self._runtime, "tracker.frame", frame):
            self.use_frame(to_python(frame))

    def _get_point(self) -> QJSValue | tuple[float, float, float]:
        if self._runtime is None:
            return self._point
        return self._runtime.value(dict(zip("xyz", self._point, strict=True)))

    #: x, y and z in metres, in `frame`.
    point = Property(QJSValue, _get_point, _set_point, notify=pointChanged)
    #: The frame that the point moves with; empty for RViz's fixed frame.
    frame = Property(VARIANT, lambda self: self._frame, _set_frame, notify=frameChanged)
    #: x and y in units of the overlay, z the distance from the camera in metres; all NaN while
    #: the point is behind the camera.
    position = Property(
        QtGui.QVector3D, lambda self: QtGui.QVector3D(*self._position), notify=positionChanged
    )
    problem = Property(str, lambda self: self._problem, notify=problemChanged)
    #: Whether no transform of the frame arrived for 3 s; `position` is then the last known one.
    stale = Property(bool, lambda self: self._stale, notify=staleChanged)


class Trackers:
    """All trackers of a 3D view, updated before each frame that it draws.

    Args:
        before_frame: Signal that the view is about to draw.
        camera: Returns the view's camera.
        frames: Returns the robot's frames.
    """

    def __init__(
        self, before_frame: Any, camera: Callable[[], Camera], frames: Callable[[], Frames]
    ) -> None:
        self._make_camera, self._frames = camera, frames
        self._trackers: list[Tracker] = []
        self._camera: Camera | None = None
        self._scales: dict[Tracker, float] = {}
        before_frame.connect(self._before_frame)

    def add(
        self,
        point: Sequence[float],
        frame: str = "",
        scale: Callable[[], float] = lambda: 1.0,
        runtime: Runtime | None = None,
    ) -> Tracker:
        """Return a tracker for a point, which works as long as it exists; see :class:`Tracker`.

        Raises:
            Error: `point` is not a point, or `frame` is not a string.
        """
        made = Tracker(self, point_of(point), "", scale, runtime)
        if self._camera is not None:
            # It may be out of date: it is not updated while there are no trackers.
            self._camera.update()
        made.use_frame(frame)
        self._trackers.append(made)
        made.update()
        return made

    def remove(self, tracker: Tracker) -> None:
        """Remove a tracker; do nothing if it was removed before."""
        if tracker in self._trackers:
            self._trackers.remove(tracker)

    def remove_all(self, runtime: Runtime) -> None:
        """Remove all trackers of a QML engine that is about to be destroyed."""
        self._trackers = [t for t in self._trackers if is_alive(t) and t._runtime is not runtime]

    def __len__(self) -> int:
        """Return the number of trackers."""
        return len(self._trackers)

    def locate(
        self, point: tuple[float, float, float], frame: str, scale: float
    ) -> tuple[tuple[float, float, float], int]:
        """Return a point's x and y in the view and its distance, and the transform's stamp.

        The stamp is in nanoseconds, 0 for static transforms and the fixed frame.

        Raises:
            Error: The frame is unknown.
        """
        if self._camera is None:
            self._camera = self._make_camera()
        stamp = 0
        if frame:
            there = self._frames().locate(frame)
            stamp = there.stamp.nanoseconds
            x, y, z = there.apply_point(point)
            point = (float(x), float(y), float(z))
        found = self._camera.project(point)
        return (found.x / scale, found.y / scale, found.depth), stamp

    def steady(self) -> float:
        """Return the current time for measuring ages, in seconds; see :meth:`Session.steady`."""
        return self._frames().steady()

    def is_simulated(self) -> bool:
        """Return whether the robot's time is that of a simulation or a recording."""
        return self._frames().is_simulated

    def _before_frame(self) -> None:
        self._trackers = [tracker for tracker in self._trackers if is_alive(tracker)]
        if not self._trackers or self._camera is None:
            return
        moved = self._camera.update()
        for tracker in list(self._trackers):
            scale = tracker._scale()
            if moved or tracker.follows_frame or self._scales.get(tracker) != scale:
                self._scales[tracker] = scale
                tracker.update()
        self._scales = {t: s for t, s in self._scales.items() if t in self._trackers}


def _has_moved(new: Sequence[float], old: Sequence[float]) -> bool:
    if math.isnan(new[0]) or math.isnan(old[0]):
        return math.isnan(new[0]) != math.isnan(old[0])
    return any(abs(a - b) > _MIN_CHANGE for a, b in zip(new, old, strict=True))

"""``rviz.view`` in QML: the camera."""
# ruff: noqa: N802 N815 - the names of slots, properties and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qt import Property, QJSValue, QtCore, QtGui, Signal, Slot
from rosglass.rviz.face import VARIANT, Face, given, place, taking, text_of
from rosglass.rviz.property_values import shown
from rosglass.rviz.view import ViewMode, ViewSettings

if TYPE_CHECKING:
    from rosglass.qml.runtime import Runtime
    from rosglass.rviz.access import Access
    from rosglass.rviz.orbit import Point

__all__ = ["QmlView"]
#: Qt reads lists of texts into what it has of them already, and so twice.
_LIST: Any = "QVariantList"

#: Metres below which the camera counts as standing still.
_STILL = 1e-4
_FRAME = "the name of a frame, or '' for none"
_MOVES = {
    "frame": str,
    "animate": bool,
    "stopTracking": bool,
    "switchTo3D": bool,
}


class QmlView(Face):
    """The camera; places are in metres, of the fixed frame unless another one is given."""

    CALLED = "rviz.view"

    modeChanged = Signal()
    trackedFrameChanged = Signal()
    problemChanged = Signal()
    #: The camera, or what it looks at, is elsewhere.
    moved = Signal()
    animationDurationChanged = Signal()
    trackingGainChanged = Signal()
    typeChanged = Signal()
    savedViewsChanged = Signal()

    def __init__(self, access: Access, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(runtime, parent)
        self._view, self._views = access.view, access.views
        self._told = self._places()
        self._view.mode_changed.connect(self.modeChanged)
        self._view.tracked_frame_changed.connect(self.trackedFrameChanged)
        self._view.problem_changed.connect(self._on_problem)
        self._views.kind_changed.connect(self.typeChanged)
        self._views.saved_changed.connect(self.savedViewsChanged)
        settings = self._view.settings
        for setting, changed in (
            (ViewSettings.animation_duration, self.animationDurationChanged),
            (ViewSettings.tracking_gain, self.trackingGainChanged),
        ):
            setting.of(settings).valueChanged.connect(changed)
        access.window.before_frame.connect(self._on_frame)

    def _set_mode(self, mode: QJSValue) -> None:
        with self._telling("rviz.view.mode"):
            self._view.set_mode(_mode(mode))

    def _set_tracked(self, frame: Any) -> None:
        with self._telling("rviz.view.trackedFrame"):
            self._view.track(text_of(frame, _FRAME))

    def _set_duration(self, seconds: Any) -> None:
        with self._telling("rviz.view.animationDuration"):
            ViewSettings.animation_duration.give(self._view.settings, _plain(seconds))

    def _set_gain(self, gain: Any) -> None:
        with self._telling("rviz.view.trackingGain"):
            ViewSettings.tracking_gain.give(self._view.settings, _plain(gain))

    def _set_type(self, kind: Any) -> None:
        with self._telling("rviz.view.type"):
            self._views.kind = text_of(kind, "a kind of view, e.g. 'rviz/Orbit'")

    #: 0 in 3D, 1 in 2D, seen from above.
    mode = Property(
        QJSValue, lambda self: QJSValue(int(self._view.mode)), _set_mode, notify=modeChanged
    )
    MODE_3D = Property(int, lambda _self: int(ViewMode.MODE_3D), constant=True)
    MODE_2D = Property(int, lambda _self: int(ViewMode.MODE_2D), constant=True)
    #: The frame that the camera follows; empty for none.
    trackedFrame = Property(
        VARIANT, lambda self: self._view.tracked_frame, _set_tracked, notify=trackedFrameChanged
    )
    #: Why the tracked frame cannot be followed now; empty when it can.
    problem = Property(str, lambda self: self._view.problem, notify=problemChanged)
    eye = Property(QtGui.QVector3D, lambda self: QtGui.QVector3D(*self._view.eye), notify=moved)
    focus = Property(QtGui.QVector3D, lambda self: QtGui.QVector3D(*self._view.focus), notify=moved)
    #: Seconds that a movement takes.
    animationDuration = Property(
        VARIANT,
        lambda self: self._view.settings.animation_duration,
        _set_duration,
        notify=animationDurationChanged,
    )
    #: How quickly the camera follows, in 1/s.
    trackingGain = Property(
        VARIANT,
        lambda self: self._view.settings.tracking_gain,
        _set_gain,
        notify=trackingGainChanged,
    )
    #: The kind of RViz's view, e.g. ``rviz/Orbit``.
    type = Property(VARIANT, lambda self: self._views.kind, _set_type, notify=typeChanged)
    viewTypes = Property(_LIST, lambda self: self._views.kinds, constant=True)
    #: Names of the saved views.
    savedViews = Property(_LIST, lambda self: self._views.saved, notify=savedViewsChanged)

    @taking(1, 2, None)
    def moveEye(self, eye: QJSValue, options: QJSValue | None = None) -> None:
        """Move the camera; it keeps looking in the same direction.

        Args:
            eye: x, y and z.
            options: `frame`, `animate`, `stopTracking`, `switchTo3D`.
        """
        with self._telling("rviz.view.moveEye"):
            how = _options(options, _MOVES)
            self._view.move_eye(
                place(given(eye), "eye"),
                how.get("frame", ""),
                animate=how.get("animate", True),
                stop_tracking=how.get("stopTracking", False),
                switch_to_3d=how.get("switchTo3D", False),
            )

    @taking(2, 3, None)
    def moveEyeAndFocus(
        self, eye: QJSValue, focus: QJSValue, options: QJSValue | None = None
    ) -> None:
        """Move the camera and what it looks at, in 3D.

        Args:
            eye: x, y and z.
            focus: x, y and z.
            options: `frame`, `animate`, `stopTracking`.
        """
        with self._telling("rviz.view.moveEyeAndFocus"):
            how = _options(options, {key: _MOVES[key] for key in list(_MOVES)[:3]})
            self._view.move_eye_and_focus(
                place(given(eye), "eye"),
                place(given(focus), "focus"),
                how.get("frame", ""),
                animate=how.get("animate", True),
                stop_tracking=how.get("stopTracking", False),
            )

    @taking(1, 2, None)
    def setMode(self, mode: QJSValue, animate: QJSValue | None = None) -> None:
        """Switch between 3D (0) and 2D (1); without animation where `animate` is false."""
        with self._telling("rviz.view.setMode"):
            how = given(animate)
            if how is not None and not isinstance(how, bool):
                raise Error(f"animate: expected true or false, got {shown(how)}")
            self._view.set_mode(_mode(mode), animate=how is not False)

    @taking(1, 1, None)
    def track(self, frame: QJSValue) -> None:
        """Have the camera follow a frame, and turn with it; an empty name ends that."""
        with self._telling("rviz.view.track"):
            self._view.track(text_of(frame, _FRAME))

    @Slot()
    def reset(self) -> None:
        """Show the fixed frame's origin in 3D, as at first, and follow nothing."""
        with self._telling("rviz.view.reset"):
            self._view.reset()

    @taking(1, 1, None)
    def saveView(self, name: QJSValue) -> None:
        """Keep what is shown under a name, as the panel Views does."""
        with self._telling("rviz.view.saveView"):
            self._views.save(given(name))

    @taking(1, 1, None)
    def showView(self, name: QJSValue) -> None:
        """Show a saved view; takes its name, or its place."""
        with self._telling("rviz.view.showView"):
            self._views.show(given(name))

    @taking(1, 1, None)
    def removeView(self, name: QJSValue) -> None:
        """Remove a saved view; takes its name, or its place."""
        with self._telling("rviz.view.removeView"):
            self._views.remove(given(name))

    @Slot(str)
    def _on_problem(self, problem: str) -> None:
        del problem
        self.problemChanged.emit()

    def _places(self) -> tuple[Point, Point]:
        seen = self._view.seen
        return seen.eye, seen.focus

    @Slot()
    def _on_frame(self) -> None:
        now = self._places()
        for new, old in zip(now, self._told, strict=True):
            if max(abs(n) for n in new - old) > _STILL:
                self._told = now
                self.moved.emit()
                return


def _plain(value: Any) -> Any:
    return given(value) if isinstance(value, QJSValue) else value


def _mode(value: QJSValue) -> int:
    wanted = given(value)
    if isinstance(wanted, bool) or not isinstance(wanted, int):
        raise Error(f"expected rviz.view.MODE_3D (0) or MODE_2D (1), got {shown(wanted)}")
    return wanted


def _options(given_options: QJSValue | None, known: dict[str, type]) -> dict[str, Any]:
    found = given(given_options)
    if found is None:
        return {}
    if not isinstance(found, dict):
        raise Error(f"options: expected {{{', '.join(known)}}}, got {shown(found)}")
    for name, value in found.items():
        if name not in known:
            raise Error(f"there is no option {shown(name)}; there are {', '.join(known)}")
        if not isinstance(value, known[name]):
            wanted = "a text" if known[name] is str else "true or false"
            raise Error(f"{name}: expected {wanted}, got {shown(value)}")
    return found

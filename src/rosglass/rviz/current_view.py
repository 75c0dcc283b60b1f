"""RViz's current view, read and set through its properties, so that the mouse keeps working."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, Signal
from rosglass.rviz.camera import Camera
from rosglass.rviz.frames import FIXED_FRAME
from rosglass.rviz.host import as_pyside
from rosglass.rviz.orbit import NEAREST, STEEPEST, Orbit, Point
from rosglass.rviz.qt5 import QtCore as Qt5Core
from rosglass.rviz.qt5 import QtWidgets

if TYPE_CHECKING:
    from rosglass.rviz.window import Window

__all__ = ["FLAT", "ORBIT", "CurrentView"]

#: RViz's class of the view in 3D.
ORBIT = "rviz/Orbit"
#: RViz's class of the view from above, without perspective.
FLAT = "rviz/TopDownOrtho"
_TARGET = "Target Frame"
_INVERTED = "Invert Z Axis"
_NAMES: dict[str, tuple[str, ...]] = {
    ORBIT: (
        *(f"Focal Point/{axis}" for axis in "XYZ"),
        "Distance",
        "Yaw",
        "Pitch",
        _INVERTED,
        "Field of View",
    ),
    FLAT: ("X", "Y", "Scale", "Angle"),
}
#: Radians, of RViz's perspective views unless they are told otherwise.
_FIELD_OF_VIEW = math.pi / 4


class CurrentView(QtCore.QObject):
    """The view that RViz shows, whichever it is, as an `Orbit`.

    Args:
        window: RViz.
    """

    #: Another view is the current one; whether by :meth:`write`.
    changed = Signal(bool)

    def __init__(self, window: Window) -> None:
        super().__init__()
        self._window = window
        self._manager: Any = window.manager.getViewManager()
        self._properties: dict[str, Any] = {}
        self._own = False
        #: What is seen from above has no height: that of what was looked at before.
        self._height = 0.0
        self._field_of_view = _FIELD_OF_VIEW
        wrapped = as_pyside(self._manager, QtCore.QObject)
        Qt5Core.QObject.connect(wrapped, Qt5Core.SIGNAL("currentChanged()"), self._changed)

    @property
    def kind(self) -> str:
        """Its class, as RViz names it."""
        return str(self._manager.getCurrent().getClassId())

    @property
    def state(self) -> tuple[Any, ...]:
        """What its properties say: class, target frame, and whatever moves the camera.

        Of :data:`ORBIT`, the focus follows, of :data:`FLAT` its x and y.
        """
        kind = self.kind
        return (kind, self._get(_TARGET), *(self._get(name) for name in _NAMES.get(kind, ())))

    def read(self) -> Orbit:
        """Return what is seen."""
        kind = self.kind
        if kind not in _NAMES or self._get(_TARGET) != FIXED_FRAME:
            return self._seen(kind)
        if kind == FLAT:
            return self._from_above(self._get("X"), self._get("Y"))
        x, y, z, distance, yaw, pitch, inverted, self._field_of_view = (
            self._get(name) for name in _NAMES[ORBIT]
        )
        sign = -1 if inverted else 1
        return Orbit(Point(x, y, z), distance, sign * yaw, sign * pitch)

    def write(self, where: Orbit, kind: str) -> None:
        """Show something.

        Args:
            where: What.
            kind: :data:`ORBIT`, or :data:`FLAT`, which shows it from above.
        """
        if self.kind != kind:
            self._use(kind)
        if self._get(_TARGET) != FIXED_FRAME:
            self._set(_TARGET, FIXED_FRAME)
        if kind == FLAT:
            self._height = where.focus.z
            scale = self._pixels_at_one_metre() / where.distance
            angle = _positive(where.yaw + math.pi / 2)
            self._set_all(FLAT, where.focus.x, where.focus.y, scale, angle)
        else:
            sign = -1 if self._get(_INVERTED) else 1
            yaw, pitch = _positive(sign * where.yaw), sign * where.pitch
            self._set_all(ORBIT, *where.focus, where.distance, yaw, pitch)

    def close(self) -> None:
        """Let go of what is RViz's."""
        self._properties.clear()

    def _from_above(self, x: float, y: float) -> Orbit:
        distance = self._pixels_at_one_metre() / max(self._get("Scale"), 1e-9)
        yaw = self._get("Angle") - math.pi / 2
        return Orbit(Point(x, y, self._height), distance, yaw, STEEPEST)

    def _seen(self, kind: str) -> Orbit:
        """Return what the camera itself says, for views of any kind and of any frame."""
        camera = Camera(self._window)
        eye = Point(*camera.eye)
        if kind == FLAT:
            return self._from_above(eye.x, eye.y)
        width, height, ratio = self._window.view_size()
        ahead = camera.unproject(width / ratio / 2, height / ratio / 2, 0.9)
        if ahead is None:
            return Orbit.between(eye, Point(0.0, 0.0, 0.0))
        way = Point(*ahead) - eye
        view = self._manager.getCurrent()
        names = [str(view.childAt(at).getName()) for at in range(view.numChildren())]
        # As RViz does when it goes on with another view: as far away as the frame it is in.
        distance = self._get("Distance") if "Distance" in names else math.hypot(*eye)
        part = max(distance, NEAREST) / (math.hypot(*way) or 1.0)
        return Orbit.between(eye, eye.towards(ahead, part))

    def _use(self, kind: str) -> None:
        self._own = True
        try:
            self._manager.setCurrentViewControllerType(kind)
        finally:
            self._own = False

    def _changed(self) -> None:
        self._properties.clear()
        # RViz's panels are told later which properties are hidden, by their addresses, and crash
        # when another view has come by then and this one is gone.
        for child in self._window.widget.findChildren(QtWidgets.QTreeView):
            if child.metaObject().className() == "rviz::PropertyTreeWidget":
                Qt5Core.QCoreApplication.sendPostedEvents(child, Qt5Core.QEvent.MetaCall)
        if not self._own:
            self._height = 0.0
        self.changed.emit(self._own)

    def _pixels_at_one_metre(self) -> float:
        """Return how many pixels a metre takes for the camera in 3D, one metre away."""
        return max(self._window.view_size()[1], 1) / (2 * math.tan(self._field_of_view / 2))

    def _property(self, name: str) -> Any:
        found = self._properties.get(name)
        if found is None:
            found = self._manager.getCurrent()
            for part in name.split("/"):
                found = found.subProp(part)
            self._properties[name] = found
        return found

    def _get(self, name: str) -> Any:
        return self._property(name).getValue()

    def _set(self, name: str, value: Any) -> None:
        self._property(name).setValue(value)

    def _set_all(self, kind: str, *values: float) -> None:
        for name, value in zip(_NAMES[kind], values, strict=False):
            self._set(name, value)


def _positive(angle: float) -> float:
    """Return an angle from 0 to 2 pi, as RViz's own mouse leaves it."""
    return math.remainder(angle, math.tau) % math.tau

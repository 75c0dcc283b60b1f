"""RViz's current view, its view types and its saved views."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rosglass.overlay.orbit import (
    MIN_DISTANCE_M,
    Orbit,
    Point,
)
from rosglass.overlay.view import TOP_DOWN, CurrentView, Views
from rosglass.qt import QtCore
from rosglass.rviz.camera import RvizCamera
from rosglass.rviz.host import Hook, as_pyside
from rosglass.rviz.plugins import VIEW, declared
from rosglass.rviz.qt5 import QtCore as Qt5Core

if TYPE_CHECKING:
    from rosglass.rviz.window import Window

__all__ = ["RvizCurrentView", "RvizViews"]


class RvizCurrentView(CurrentView):
    """RViz's current view."""

    def __init__(self, window: Window) -> None:
        super().__init__()
        self._window = window
        self._manager: Any = window.manager.getViewManager()
        self._properties: dict[str, Any] = {}
        wrapped = as_pyside(self._manager, QtCore.QObject)
        Qt5Core.QObject.connect(
            wrapped, Qt5Core.SIGNAL("currentChanged()"), self._on_current_changed
        )

    @property
    def kind(self) -> str:
        """RViz's class id of the view."""
        return str(self._manager.getCurrent().getClassId())

    def close(self) -> None:
        """Release the references to RViz's properties."""
        self._properties.clear()

    def _read_camera(self, kind: str) -> Orbit:
        camera = RvizCamera(self._window)
        eye = Point(*camera.eye)
        if kind == TOP_DOWN:
            return self._orbit_from_above(eye.x, eye.y)
        width, height, ratio = self._window.view_size()
        ahead = camera.unproject(width / ratio / 2, height / ratio / 2, 0.9)
        if ahead is None:
            return Orbit.between(eye, Point(0.0, 0.0, 0.0))
        way = Point(*ahead) - eye
        view = self._manager.getCurrent()
        names = [str(view.childAt(at).getName()) for at in range(view.numChildren())]
        # Like RViz when it switches views: without a distance, use that of the frame's origin.
        distance = self._get("Distance") if "Distance" in names else math.hypot(*eye)
        part = max(distance, MIN_DISTANCE_M) / (math.hypot(*way) or 1.0)
        return Orbit.between(eye, eye.towards(ahead, part))

    def _switch_view(self, kind: str) -> None:
        self._manager.setCurrentViewControllerType(kind)

    def _on_current_changed(self) -> None:
        self._properties.clear()
        self._window.flush_panels()
        super()._on_current_changed()

    def _height_px(self) -> float:
        return float(self._window.view_size()[1])

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


class RvizViews(Views):
    """RViz's view types and saved views."""

    def __init__(self, window: Window) -> None:
        self._window, self._manager = window, window.manager.getViewManager()
        super().__init__()
        self._hook = Hook(self._on_change)
        self._hook.watch(self._manager, "currentChanged()", "configChanged()")

    @property
    def kinds(self) -> list[str]:
        """Class ids of the available view types, e.g. ``rviz/Orbit``."""
        return list(declared(VIEW))

    @property
    def saved(self) -> list[str]:
        """Names of the saved views, in the order of the Views panel; not unique."""
        manager = self._manager
        return [str(manager.getViewAt(at).getName()) for at in range(manager.getNumViews())]

    def _current_kind(self) -> str:
        return str(self._manager.getCurrent().getClassId())

    def _switch(self, kind: str) -> None:
        self._manager.setCurrentViewControllerType(kind)

    def _append(self, name: str) -> None:
        self._manager.copyCurrentToList()
        self._manager.getViewAt(self._manager.getNumViews() - 1).setName(name)

    def _show(self, index: int) -> None:
        self._manager.setCurrentFrom(self._manager.getViewAt(index))

    def _take(self, index: int) -> None:
        # The trees of the panels crash on queued events for a removed view.
        self._window.flush_panels()
        self._manager.takeAt(index).deleteLater()

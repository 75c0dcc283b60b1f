"""The keys of a scene's camera and its ROS interface, while there is a display View Controller."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.overlay.view import ViewMode
from rosglass.overlay.view_controller import ViewKeys, ViewServices
from rosglass.overlay.view_controller_settings import ControllerSetting, ViewSettings
from rosglass.qt import QtCore, Slot, is_alive
from rosglass.scene.access import access_of

if TYPE_CHECKING:
    from rosglass.scene.access import SceneAccess
    from rosglass.scene.view.scene_view import SceneView

__all__ = ["ViewControl", "control_of"]

#: Milliseconds that everything stays after the last display is gone: a config that is loaded, or a
#: reset, has another one soon, and robots need not notice.
_LINGER_MS = 300
#: The settings that displays show, by their names in files.
_SETTINGS: dict[str, ControllerSetting[Any]] = {
    one.name: one for one in vars(ViewSettings).values() if isinstance(one, ControllerSetting)
}


def control_of(view: SceneView) -> ViewControl:
    """Return the control of a view's camera, created on first use."""
    access = access_of(view)
    found: Any = access.findChild(ViewControl)
    return found or ViewControl(access)


class ViewControl(QtCore.QObject):
    """Keys, topics and services of a camera; displays that use it show the same settings.

    Args:
        access: The interface to the view.
    """

    def __init__(self, access: SceneAccess) -> None:
        super().__init__(access)
        self._access = access
        #: The camera.
        self.view = access.view
        self._displays: list[Any] = []
        #: The parts to close.
        self._parts: list[ViewKeys | ViewServices] = []
        #: The topics and services; None while there is no display.
        self.services: ViewServices | None = None
        self._shows = False
        self._end = QtCore.QTimer(self)
        self._end.setSingleShot(True)
        self._end.setInterval(_LINGER_MS)
        self._end.timeout.connect(self._on_end)
        self.view.settings.properties.edited.connect(self._show)
        self.view.problem_changed.connect(self._show)
        self.view.tracked_frame_changed.connect(self._show_frame)
        self.view.mode_changed.connect(self._show_mode)
        parts = self._parts
        self.destroyed.connect(lambda *_: _close(parts))

    def add(self, display: Any) -> None:
        """Begin with the first display, whose settings count; others show the same."""
        first = not self._displays
        self._displays.append(display)
        self._end.stop()
        if first:
            given = {
                name: display.get(name)
                for name, setting in _SETTINGS.items()
                if name in display.saved or display.get(name) != setting.default
            }
            self.view.settings.load(given)
        if not self._parts:
            access = self._access
            services = self.services = ViewServices(self.view, access.session)
            services.problem_changed.connect(self._show)
            services.opened.connect(self._show)
            keys = ViewKeys(access.scene_view, self.view, access.before_frame)
            self._parts += [services, keys]
        if display.mode2D:
            self.set_2d(True)
        self._show_mode()
        if not display.trackedFrame:
            self._show_frame()
        self._show()

    def remove(self, display: Any) -> None:
        """End when no display is left, unless another one is added at once."""
        if display in self._displays:
            self._displays.remove(display)
            if not self._displays and is_alive(self):
                self._end.start()

    def take_settings(self, display: Any) -> None:
        """Apply the settings that the user, or QML, has changed in a display."""
        if not self._shows:
            for name, setting in _SETTINGS.items():
                setting.of(self.view.settings).set(display.get(name))

    def set_2d(self, in_2d: bool) -> None:
        """Set whether the camera looks straight down."""
        if not self._shows:
            self.view.set_mode(ViewMode.MODE_2D if in_2d else ViewMode.MODE_3D)

    @Slot()
    def _on_end(self) -> None:
        _close(self._parts)
        self.services = None
        self.view.settings.load({})

    @Slot()
    def _show(self, *_: Any) -> None:
        """Show settings and status in the displays."""
        services, view = self.services, self.view
        if self._shows or services is None:
            return
        where = services.namespace if services.is_open else "not connected, or switched off"
        follows = view.tracked_frame or "no frame is followed"
        self._shows = True
        try:
            for display in self._displays:
                for name, setting in _SETTINGS.items():
                    display.set(name, setting.of(view.settings).get())
                for row, problem, fine in (
                    ("Robots", services.problem, where),
                    ("Tracked Frame", view.problem, follows),
                ):
                    if problem or row == "Robots" or display.trackedFrame == view.tracked_frame:
                        display.set_status(row, "warn" if problem else "ok", problem or fine)
        finally:
            self._shows = False

    @Slot()
    def _show_mode(self) -> None:
        self._shows = True
        try:
            for display in self._displays:
                display.mode2D = self.view.mode is ViewMode.MODE_2D
        finally:
            self._shows = False

    @Slot()
    def _show_frame(self) -> None:
        for display in self._displays:
            display.trackedFrame = self.view.tracked_frame
        self._show()


def _close(parts: list[ViewKeys | ViewServices]) -> None:
    while parts:
        parts.pop().close()

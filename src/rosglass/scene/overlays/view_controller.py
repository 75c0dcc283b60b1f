"""The display View Controller: the camera's keys, and its ROS topics and services for robots."""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.overlay.view_controller_settings import (
    CONTROLLER_CLASS,
    ControllerSetting,
    ViewSettings,
)
from rosglass.qt import is_alive
from rosglass.scene.configs.settings import Setting
from rosglass.scene.displays.display import Display

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore
    from rosglass.scene.overlays.view_control import ViewControl

__all__ = ["ViewControllerDisplay"]

_TRACKED_FRAME, _MODE_2D = "Tracked Frame", "2D Mode"


def _shared(setting: ControllerSetting[Any]) -> Setting:
    """Return a setting of RViz's view controller as one of the display."""
    return Setting(
        setting.name, setting.kind, setting.default, setting.about, then="_apply", **setting.options
    )


class ViewControllerDisplay(Display):
    """Lets robots and keys move the camera, as hector_rviz_plugins' view controller does.

    ``rosglass rviz`` has the same entry, and the same files.
    """

    TYPE = CONTROLLER_CLASS

    animationDuration = _shared(ViewSettings.animation_duration)
    trackingGain = _shared(ViewSettings.tracking_gain)
    keyboardNavigation = _shared(ViewSettings.keys)
    movementSpeed = _shared(ViewSettings.speed)
    enableTopics = _shared(ViewSettings.topics)
    enableServices = _shared(ViewSettings.services)
    namespace = _shared(ViewSettings.namespace)
    #: State of the camera, which files do not keep.
    trackedFrame = Setting(
        _TRACKED_FRAME, "frame", "",
        "The frame that the camera follows and turns with; empty for none.", then="_track",
    )  # fmt: skip
    mode2D = Setting(
        _MODE_2D, "bool", False, "Look straight down, without perspective.",
        then="_set_mode",
    )  # fmt: skip

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._control: ViewControl | None = None
        super().__init__(parent, runtime)
        self._name = "View Controller"

    # -- the camera ------------------------------------------------------------------------------

    def _wanted(self) -> tuple[Any, ...] | None:
        return (self.scene.parent(),) if self.scene is not None and self.shown else None

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        # Later: few views have one, and it needs much that other displays do not.
        control = import_module("rosglass.scene.overlays.view_control").control_of(wanted[0])
        self._control = control
        self._cleanup["control"] = lambda: control.remove(self)
        control.add(self)
        self._track()

    def _on_closed(self, endpoint: Any) -> None:  # noqa: ARG002 - the base class's signature
        control, self._control = self._control, None
        self._cleanup.pop("control", None)
        if control is not None:
            control.remove(self)
        self.clear_status()

    def leave(self) -> None:
        """Stop being shown."""
        if is_alive(self):
            self._close_endpoint()
        super().leave()

    def _apply(self) -> None:
        if self._control is not None:
            self._control.take_settings(self)

    def _set_mode(self) -> None:
        if self._control is not None:
            self._control.set_2d(self.mode2D)

    def _track(self) -> None:
        """Follow the frame; one that does not exist yet is tried again with later transforms."""
        control = self._control
        if control is None or self.trackedFrame == control.view.tracked_frame:
            return
        try:
            control.view.track(self.trackedFrame)
        except Error as error:
            self.set_status(_TRACKED_FRAME, "warn", str(error))

    def on_transforms(self) -> None:
        """Follow a frame that has not existed before."""
        self._track()

    # -- files -----------------------------------------------------------------------------------

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a file."""
        kept = {name: one for name, one in saved.items() if name not in (_TRACKED_FRAME, _MODE_2D)}
        return super().load_settings(kept)

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file, without what the camera does now."""
        kept = super().save_settings(older, ros)
        for name in (_TRACKED_FRAME, _MODE_2D):
            kept.pop(name, None)
        return kept

"""Overlays that QML and ``.rviz`` files declare: QML files over the view."""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.overlay.property_values import from_plain, to_plain
from rosglass.qml.elements.element import Element
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qt import QtCore, QtQml, Slot, is_alive
from rosglass.scene.configs.settings import Setting
from rosglass.scene.displays.declared import expect_view, find_view
from rosglass.scene.displays.display import Display

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rosglass.qml.engine.runtime import Runtime
    from rosglass.scene.overlays.scene_overlay import SceneOverlay

__all__ = ["OverlayElement", "QmlOverlayDisplay"]

_CONFIGURATION, _CONFIG = "Configuration", "Overlay Configuration"


class QmlOverlayDisplay(Display):
    """An overlay that RViz's config files have, also those of hector_rviz_overlay."""

    TYPE = "rosglass/QmlOverlay"

    path = Setting(
        "Path", "path", "", "QML file; package://name/path for one in a ROS package.",
        then="_schedule",
    )  # fmt: skip
    zIndex = Setting("Z-Index", "int", 0, "Higher numbers are on top.", then="_arrange")
    scale = Setting(
        "Scale", "float", 1.0, "Units of the view per unit of the overlay.", min=0.1, max=10.0,
        then="_arrange",
    )  # fmt: skip
    opacity = Setting("Opacity", "float", 1.0, "Opacity.", min=0.0, max=1.0, then="_arrange")
    liveReload = Setting(
        "Live Reload", "bool", False, "Reload when the file, or one beside it, is saved.",
        then="_arrange",
    )  # fmt: skip

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self.overlay: SceneOverlay | None = None
        #: Values of the properties that the file registers, and its free-form map.
        self._registered: dict[str, Any] = {}
        self._free: dict[str, Any] = {}
        super().__init__(parent, runtime)

    # -- the overlay -----------------------------------------------------------------------------

    def _wanted(self) -> tuple[Any, ...] | None:
        if self.scene is None or not self.path:
            self.set_status("Qml", "warn", "Choose a QML file as Path")
            return None
        return (self.path,)

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        assert self.scene is not None
        view = self.scene.parent()
        try:
            # Later: few configs have overlays, which need much that other displays do not.
            made = import_module("rosglass.scene.overlays.scene_overlay").SceneOverlay
            overlay = self.overlay = made(wanted[0], view, self.name)
            self._cleanup["overlay"] = overlay.close
            overlay.properties.load(self._registered)
            overlay.properties.set_config(self._free)
            self._arrange()
            overlay.problem_changed.connect(self._on_problem)
            overlay.arranged.connect(self._on_arranged)
            overlay.load()
        except Error as error:
            self.set_status("Qml", "error", str(error))
        else:
            self._on_problem(overlay.problem)

    def _on_closed(self, endpoint: Any) -> None:  # noqa: ARG002 - the base class's signature
        overlay, self.overlay = self.overlay, None
        self._cleanup.pop("overlay", None)
        if overlay is not None:
            self._registered = overlay.properties.save()
            self._free = overlay.properties.get_config()
            overlay.close()

    def leave(self) -> None:
        """Stop being shown."""
        if is_alive(self):
            self._close_endpoint()
        super().leave()

    def on_group_enabled(self) -> None:
        """Show or hide it, and say again what is wrong with it."""
        super().on_group_enabled()
        self._arrange()
        if not self.shown:
            return
        if self.overlay is not None and self.overlay.loaded:
            self._on_problem(self.overlay.problem)
        else:
            self._close_endpoint()  # it is tried again: the file may be there now

    def _arrange(self) -> None:
        overlay = self.overlay
        if overlay is not None:
            # First, as each of them is reported to :meth:`_on_arranged`.
            overlay.visible, overlay.watch = self.shown, self.liveReload
            overlay.z, overlay.scale, overlay.opacity = self.zIndex, self.scale, self.opacity

    @Slot(str)
    def _on_problem(self, problem: str) -> None:
        self.set_status("Qml", "error" if problem else "ok", problem or "OK")

    @Slot()
    def _on_arranged(self) -> None:
        # By its own JavaScript, or a program.
        if self.overlay is not None and self.overlay.visible != self.shown:
            self.setProperty("enabled", self.overlay.visible)

    # -- files -----------------------------------------------------------------------------------

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a file, and the ones that the overlay itself keeps in it."""
        refused = super().load_settings(saved)
        registered, free = saved.get(_CONFIGURATION), from_plain(saved.get(_CONFIG))
        self._registered = _as_text(registered) if isinstance(registered, dict) else {}
        self._free = free if isinstance(free, dict) else {}
        return refused

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file, with what the overlay itself keeps in it."""
        kept = super().save_settings(older, ros)
        properties = None if self.overlay is None else self.overlay.properties
        kept[_CONFIGURATION] = self._registered if properties is None else properties.save()
        kept[_CONFIG] = to_plain(self._free if properties is None else properties.get_config())
        return kept


def _as_text(value: Any) -> Any:
    """Return values as text, as RViz gives them: the kinds of the properties read them."""
    if isinstance(value, dict):
        return {str(key): _as_text(inner) for key, inner in value.items()}
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value) if isinstance(value, (int, float)) else value


class OverlayElement(Element):
    """``SceneOverlay`` in QML: an overlay declared inside a ``SceneView``."""

    QML_NAME = "SceneOverlay"

    #: The QML file, relative to the file that declares the overlay, or ``package://name/path``.
    source = Writable(QtCore.QUrl, QtCore.QUrl())
    #: Its name; by default that of the file.
    name = Writable(str, "")
    #: Whether to reload when a file of its folder is saved.
    watch = Writable(bool, False)
    visible = Writable(bool, True, then="_arrange")
    z = Writable(int, 0, then="_arrange")
    scale = Writable(float, 1.0, then="_arrange")
    opacity = Writable(float, 1.0, then="_arrange")
    #: Whether the file is shown.
    loaded = ReadOnly(bool, False)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self.overlay: SceneOverlay | None = None
        self._shown = QtCore.QUrl()
        super().__init__(parent, runtime)

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return "SceneOverlay"

    @Slot()
    def _run_update(self) -> None:
        if not is_alive(self):
            return
        super()._run_update()
        if self.source != self._shown:
            self._shown = QtCore.QUrl(self.source)
            self._show()
        elif self.overlay is not None:
            self.overlay.watch = self.watch

    def _show(self) -> None:
        self._close()
        view = find_view(self)
        if view is None:
            self._shown = QtCore.QUrl()
            expect_view(self, "overlay")
            return
        if self.source.isEmpty():
            return
        # Qt 6 leaves relative URLs as they are written.
        context = QtQml.QQmlEngine.contextForObject(self)
        source = self.source if context is None else context.resolvedUrl(self.source)
        file = source.toLocalFile() if source.isLocalFile() else source.toString()
        try:
            # Later: few views have overlays, which need much that the view does not.
            self.overlay = import_module("rosglass.scene.overlays.scene_overlay").add_overlay(
                view,
                file,
                self.name,
                watch=self.watch,
                z=self.z,
                scale=self.scale,
                opacity=self.opacity,
            )
            self.overlay.visible = self.visible
        except Error as error:
            self._refuse(f"SceneOverlay: {error}")
        else:
            overlay = self.overlay
            assert overlay is not None
            overlay.problem_changed.connect(self._set_problem)
            self._set_problem(overlay.problem)
            self._cleanup["overlay"] = overlay.close
        report(self, loaded=self.overlay is not None and self.overlay.loaded)

    def _close(self) -> None:
        overlay, self.overlay = self.overlay, None
        self._cleanup.pop("overlay", None)
        if overlay is not None:
            overlay.close()
        self._set_problem("")

    def _arrange(self) -> None:
        overlay = self.overlay
        if overlay is None:
            return
        try:
            overlay.z, overlay.scale, overlay.opacity = self.z, self.scale, self.opacity
        except Error as error:
            self._refuse(f"SceneOverlay: {error}")
        overlay.visible = self.visible

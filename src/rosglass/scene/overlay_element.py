"""``SceneOverlay`` in QML: a file over a view, declared inside it."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.element import Element
from rosglass.qml.properties import ReadOnly, Writable, report
from rosglass.qt import QtCore, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.qml.runtime import Runtime
    from rosglass.scene.overlay import SceneOverlay
    from rosglass.scene.scene_view import SceneView

__all__ = ["OverlayElement"]


class OverlayElement(Element):
    """``SceneOverlay`` in QML: an overlay declared inside a ``SceneView``."""

    #: The QML file.
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

    def _find_view(self) -> SceneView | None:
        view: Any = self.parent()
        while view is not None and not hasattr(view, "adopt_display"):
            view = view.parent()
        return view  # type: ignore[no-any-return]

    def _show(self) -> None:
        self._close()
        view = self._find_view()
        if view is None:
            self._refuse("SceneOverlay: put it into a SceneView { }")
            return
        if self.source.isEmpty():
            return
        file = self.source.toLocalFile() if self.source.isLocalFile() else self.source.toString()
        try:
            # Later: few views have overlays, which need much that the view does not.
            self.overlay = import_module("rosglass.scene.overlay").add_overlay(
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

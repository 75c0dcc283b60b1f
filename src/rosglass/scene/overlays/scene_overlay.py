"""QML files over a scene, with the object ``rviz``, as ``rosglass rviz`` shows them over RViz.

The interface is drawn by the window itself, above the 3D view; nothing is copied.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from PySide6.QtQuick import QQuickItem

from rosglass.errors import Error
from rosglass.overlay.live_overlay import LiveOverlay
from rosglass.qml.elements.image_sinks import window_of
from rosglass.qt import QtCore, Slot, is_alive
from rosglass.scene.access import access_of

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from rosglass.scene.view.scene_view import SceneView

__all__ = ["SceneOverlay", "add_overlay"]

#: Z of the lowest overlay, among the items of a view.
_LOWEST_Z = 1000


def add_overlay(
    view: SceneView, file: str | os.PathLike[str], name: str = "", **options: Any
) -> SceneOverlay:
    """Show a QML file over a view, with the object ``rviz``, as over RViz.

    Args:
        view: The view.
        file: The file, or ``package://name/path`` for one in a ROS package.
        name: The overlay's name; by default that of the file.
        options: Options of :class:`SceneOverlay`.

    Raises:
        QmlError: The file is missing, or has errors and is not watched.
    """
    overlay = SceneOverlay(file, view, name, **options)
    try:
        overlay.load()
    except Error:
        overlay.close()
        raise
    return overlay


class SceneOverlay(LiveOverlay):
    """A QML file shown over a scene; :func:`add_overlay` creates it.

    Args:
        file: The QML file; its root must be an Item.
        view: The view.
        name: Its name; by default that of the file.
        watch: Whether to reload when a file in its folder or in `import_paths` is saved.
        import_paths: Additional folders with QML modules, also as ``package://`` URLs.
        options: `z`, `scale` and `opacity` of :class:`rosglass.rviz.Overlay`.

    Raises:
        QmlError: A file or folder does not exist.
    """

    def __init__(
        self,
        file: str | os.PathLike[str],
        view: SceneView,
        name: str = "",
        *,
        watch: bool = False,
        import_paths: Sequence[str | os.PathLike[str]] = (),
        **options: Any,
    ) -> None:
        access = access_of(view)
        super().__init__(
            file,
            access.session,
            name,
            access=access,
            watch=watch,
            import_paths=import_paths,
            **options,
        )
        self._view = view
        #: Holds the root item, and has the overlay's place, scale and opacity.
        self._frame = QQuickItem(view)
        self.area = self._frame
        self._frame.setTransformOrigin(QQuickItem.TransformOrigin.TopLeft)
        self.arranged.connect(self._arrange)
        view.widthChanged.connect(self._arrange)
        view.heightChanged.connect(self._arrange)
        view.destroyed.connect(self._on_end)
        # Later, the bindings of the interface would find half of it deleted.
        application = QtCore.QCoreApplication.instance()
        if application is not None:
            application.aboutToQuit.connect(self._on_end)
        self._arrange()

    def _place(self, root: Any) -> None:
        root.setParentItem(self._frame)
        root.setSize(self._frame.size())
        QtCore.QTimer.singleShot(0, self, self.session.go_on)

    def _windows(self) -> list[Any]:
        window = window_of(self._view) if is_alive(self._view) else None
        return [] if window is None else [window]

    def _close_view(self) -> None:
        for window in self._windows():
            window.close()

    @Slot()
    def _arrange(self) -> None:
        if not (is_alive(self._frame) and is_alive(self._view)):
            return
        self._frame.setZ(_LOWEST_Z + self.z)
        self._frame.setScale(self.scale)
        self._frame.setOpacity(self.opacity)
        self._frame.setVisible(self.visible)
        size = QtCore.QSizeF(self._view.width() / self.scale, self._view.height() / self.scale)
        self._frame.setSize(size)
        if is_alive(self._root):
            self._root.setSize(size)

    @Slot()
    def _on_end(self) -> None:
        self.close()

    def close(self, *, hold: bool = True) -> None:
        """Remove the interface and delete its engine; safe to call twice.

        Args:
            hold: Keep the session's node, which the view needs.
        """
        super().close(hold=hold)
        if is_alive(self._frame):
            self._frame.setVisible(False)
            self._frame.deleteLater()

"""An interface written in QML, drawn over RViz's 3D view."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import QmlError
from rosglass.qml.load_errors import error_list
from rosglass.qml.modules import install
from rosglass.qml.places import interface_file
from rosglass.qt import QtQml, is_alive
from rosglass.rviz.overlay import Overlay
from rosglass.rviz.qml_input import QmlInput
from rosglass.rviz.qt5 import QtCore, QtQuick
from rosglass.rviz.scene import make_scene

if TYPE_CHECKING:
    import os

    import numpy as np
    from numpy.typing import NDArray

    from rosglass.qml.session import Session

__all__ = ["QmlOverlay"]


class QmlOverlay(QmlInput, Overlay):
    """A QML file over RViz's 3D view.

    Args:
        file: The QML file; its root must be a visual item.
        session: The node its QML talks through.
        name: Its name; that of the file by default.
        options: Of :class:`Overlay`.

    Raises:
        QmlError: There is no such file.
        UnsupportedError: Neither OpenGL nor Qt's software renderer can draw here.
    """

    def __init__(
        self, file: str | os.PathLike[str], session: Session, name: str = "", **options: Any
    ) -> None:
        self.file = interface_file(file)
        super().__init__(name or self.file.stem, **options)
        self.session = session
        self.engine = QtQml.QQmlEngine()
        install(self.engine, session)
        self._scene = make_scene()
        self._window = self._scene.window
        self._scene.changed.connect(self.changed)
        self._component: QtQml.QQmlComponent | None = None
        self._root: Any = None
        self._closed = False

    def load(self) -> None:
        """Show the file.

        Raises:
            QmlError: It has errors.
        """
        component = QtQml.QQmlComponent(self.engine, QtCore.QUrl.fromLocalFile(str(self.file)))
        root: Any = None if component.isError() else component.create()
        if root is None:
            raise QmlError(error_list(component.errors(), self.file))
        if not isinstance(root, QtQuick.QQuickItem):
            raise QmlError(
                f"{self.file}:0:0: the root of an overlay must be an Item, e.g. Item {{}}"
            )
        before = (self._root, self._component)
        self._component, self._root = component, root
        self._scene.show_item(root)
        _delete_later(*before)

    def resize(self, width: int, height: int, ratio: float) -> None:
        """Fit the interface to the 3D view."""
        self._scene.resize(width, height, ratio)
        self._ratio = self._scene.factor

    def draw(self) -> NDArray[np.uint32] | None:
        """Render the scene, and read it back."""
        pixels = self._scene.draw()
        self.read_back = self._scene.read_back
        return pixels

    def close(self) -> None:
        """Let the interface, its engine and all its memory go; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._scene.changed.disconnect(self.changed)
        _delete_later(self._root, self._component)
        self._scene.close()
        _delete_later(self.engine)
        self._component = self._root = None


def _delete_later(*items: Any) -> None:
    for item in items:
        if is_alive(item):
            item.deleteLater()

"""An interface written in QML, drawn over RViz's 3D view."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import QmlError
from rosglass.qml.load_errors import error_list
from rosglass.qml.modules import install
from rosglass.qml.places import interface_file
from rosglass.qt import QtQml, is_alive
from rosglass.rviz.gl import keep_context, read_pixels
from rosglass.rviz.overlay import Overlay
from rosglass.rviz.qml_input import QmlInput
from rosglass.rviz.qt5 import QtCore, QtGui, QtQuick

if TYPE_CHECKING:
    import os

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
    """

    def __init__(
        self, file: str | os.PathLike[str], session: Session, name: str = "", **options: Any
    ) -> None:
        self.file = interface_file(file)
        super().__init__(name or self.file.stem, **options)
        self.session = session
        self._pixels = np.zeros((0, 0), np.uint32)
        with keep_context():
            self._surface = QtGui.QOffscreenSurface()
            self._context = QtGui.QOpenGLContext()
            self._context.create()
            self._surface.setFormat(self._context.format())
            self._surface.create()
            self._control = QtQuick.QQuickRenderControl()
            self._window = QtQuick.QQuickWindow(self._control)
            self._window.setColor(QtGui.QColor(0, 0, 0, 0))
            self._context.makeCurrent(self._surface)
            self._control.initialize(self._context)
        self._buffer: Any = None
        self.engine = QtQml.QQmlEngine()
        install(self.engine, session)
        self._component: QtQml.QQmlComponent | None = None
        self._root: Any = None
        self._control.sceneChanged.connect(self.changed)
        self._control.renderRequested.connect(self.changed)

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
        self._component, self._root = component, root
        root.setParentItem(self._window.contentItem())
        self._fit()
        self.changed.emit()

    def resize(self, width: int, height: int, ratio: float) -> None:
        """Fit the interface to the 3D view."""
        self._size, self._ratio = (width, height), ratio
        self._window.setGeometry(0, 0, width, height)
        self._pixels = np.zeros((height, width), np.uint32)
        with keep_context():
            self._context.makeCurrent(self._surface)
            self._buffer = QtGui.QOpenGLFramebufferObject(
                QtCore.QSize(width, height),
                QtGui.QOpenGLFramebufferObject.CombinedDepthStencil,
            )
            self._window.setRenderTarget(self._buffer)
        self._fit()

    def _fit(self) -> None:
        if is_alive(self._root) and self._pixels.size:
            height, width = self._pixels.shape
            self._root.setTransformOrigin(QtQuick.QQuickItem.TopLeft)
            self._root.setScale(self._ratio)
            self._root.setSize(QtCore.QSizeF(width / self._ratio, height / self._ratio))

    def draw(self) -> NDArray[np.uint32] | None:
        """Render the scene, and read it back."""
        height, width = self._pixels.shape
        with keep_context():
            self._context.makeCurrent(self._surface)
            self._control.polishItems()
            self._control.sync()
            self._control.render()
            self._buffer.bind()
            read_pixels(width, height, self._pixels)
        return self._pixels[::-1]

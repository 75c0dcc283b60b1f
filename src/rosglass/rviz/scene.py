"""A scene of QML that no window shows: what it looks like is read into memory."""

from __future__ import annotations

import math
import os
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import UnsupportedError
from rosglass.qt import QtCore, Signal, is_alive
from rosglass.rviz.gl import offscreen, read_pixels
from rosglass.rviz.qt5 import QtCore as Qt5Core
from rosglass.rviz.qt5 import QtGui, QtQuick

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["OpenGLScene", "Scene", "SoftwareScene", "make_scene"]

#: By this property of a context, Qt Quick finds the one scene that it expects a context to have.
_OWNER = "_q_sgrendercontext"


class _Control(QtQuick.QQuickRenderControl):  # type: ignore[misc]
    """Tells Qt Quick which window its scene is seen in: only there, items get keys."""

    panel: Any = None
    #: With a window, a scene would be drawn in units of that one, and not in pixels.
    drawing = False

    def renderWindow(self, offset: Any) -> Any:  # noqa: ARG002, N802 - Qt's
        if self.drawing:
            return None
        return self.panel.window().windowHandle() if is_alive(self.panel) else None


class Scene(QtCore.QObject):
    """A window of Qt Quick that is drawn when it is asked for.

    A unit of the window's size is one of the interface, so that popups and `Window` know how much
    room there is. Its content is scaled instead: texts are drawn sharp at any scale, as they would
    not be if the picture were.
    """

    #: Something in it looks another way now.
    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._control = _Control()
        #: The window; its coordinates, and so those of its events, are units times `factor`.
        self.window: Any = QtQuick.QQuickWindow(self._control)
        self.window.setColor(QtGui.QColor(0, 0, 0, 0))
        #: What to multiply units with for the window's events.
        self.factor = 1.0
        #: Seconds that reading the last picture back took.
        self.read_back = 0.0
        self._item: Any = None
        self._units = Qt5Core.QSizeF(0, 0)
        self._closed = False
        self._control.sceneChanged.connect(self.changed)
        self._control.renderRequested.connect(self.changed)

    def show_in(self, panel: Any) -> None:
        """Say which widget shows it: keys, shortcuts and the mouse's shape are its window's."""
        self._control.panel = panel

    def show_item(self, item: Any) -> None:
        """Show a root item in place of the one before; it gets the window's size."""
        if is_alive(self._item):
            self._item.setParentItem(None)
        self._item = item
        # PySide2 takes it for gone as soon as nobody in Python knows what it was put into.
        self._content = self.window.contentItem()
        item.setParentItem(self._content)
        item.setSize(self._units)
        self.changed.emit()

    def resize(self, width: int, height: int, ratio: float) -> None:
        """Set the size.

        Args:
            width: Pixels of the picture.
            height: Pixels.
            ratio: Pixels for one unit.
        """
        self._units = Qt5Core.QSizeF(width / ratio, height / ratio)
        self._make_room(width, height, ratio)
        content = self.window.contentItem()
        content.setTransformOrigin(QtQuick.QQuickItem.TopLeft)
        content.setScale(self.factor)
        # No window system tells the window its size, of which the popups of Controls ask this item.
        content.setSize(self._units)
        if is_alive(self._item):
            self._item.setSize(self._units)

    def _make_room(self, width: int, height: int, ratio: float) -> None:
        raise NotImplementedError

    def draw(self) -> NDArray[np.uint32]:
        """Return how it looks now.

        Returns:
            Shape (height, width), each pixel 0xAARRGGBB with premultiplied colours; valid until
            the next call.
        """
        raise NotImplementedError

    def close(self) -> None:
        """Let the window go as soon as no event is handled any more; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._control.sceneChanged.disconnect(self.changed)
        self._control.renderRequested.disconnect(self.changed)
        self._let_go()
        for item in (self._control, self.window):
            item.deleteLater()

    def _let_go(self) -> None:
        self._control.invalidate()


class OpenGLScene(Scene):
    """A scene that OpenGL draws, in the one context that all of them share.

    Raises:
        UnsupportedError: There is no OpenGL that Qt can use.
    """

    def __init__(self) -> None:
        self._gl = offscreen()
        super().__init__()
        self._buffer: Any = None
        self._pixels = np.zeros((0, 0), np.uint32)
        with self._gl.current():
            # Several scenes get on well in one context as long as none calls it its own.
            self._gl.context.setProperty(_OWNER, None)
            self._control.initialize(self._gl.context)
            self._gl.context.setProperty(_OWNER, None)

    def _make_room(self, width: int, height: int, ratio: float) -> None:
        self.factor = ratio
        self.window.resize(math.ceil(width / ratio), math.ceil(height / ratio))
        with self._gl.current():
            self._drop_buffer()
            self._buffer = QtGui.QOpenGLFramebufferObject(
                Qt5Core.QSize(width, height),
                QtGui.QOpenGLFramebufferObject.CombinedDepthStencil,
            )
            if not self._buffer.isValid():
                raise UnsupportedError(f"OpenGL makes no buffer of {width}x{height} pixels here")
            self.window.setRenderTarget(self._buffer)
        self._pixels = np.zeros((height, width), np.uint32)

    def draw(self) -> NDArray[np.uint32]:
        """Return how it looks now; see :meth:`Scene.draw`."""
        height, width = self._pixels.shape
        with self._gl.current():
            self._control.polishItems()
            self._control.sync()
            self._control.drawing = True
            self._control.render()
            self._control.drawing = False
            started = time.perf_counter()
            self._buffer.bind()
            read_pixels(width, height, self._pixels)
            self._buffer.release()
            self.read_back = time.perf_counter() - started
        return self._pixels[::-1]

    def _let_go(self) -> None:
        with self._gl.current():
            super()._let_go()
            self._drop_buffer()

    def _drop_buffer(self) -> None:
        # Its memory is given back with the object, while the context is current.
        self.window.setRenderTarget(None)
        self._buffer = None


class SoftwareScene(Scene):
    """A scene that Qt's software renderer draws: no shaders, no particles, no video by OpenGL."""

    def __init__(self) -> None:
        super().__init__()
        self._control.initialize(None)

    def _make_room(self, width: int, height: int, ratio: float) -> None:
        own = self.window.devicePixelRatio()
        self.factor = ratio / own
        # It always draws the whole window, a pixel for each of its units.
        self.window.resize(math.ceil(width / own), math.ceil(height / own))
        self._shape = (height, width)

    def draw(self) -> NDArray[np.uint32]:
        """Return how it looks now; see :meth:`Scene.draw`."""
        self._control.polishItems()
        self._control.sync()
        self._control.drawing = True
        self._image = self._control.grab()
        self._control.drawing = False
        height, width = self._shape
        words = np.frombuffer(self._image.constBits(), np.uint32)
        rows: NDArray[np.uint32] = words.reshape(self._image.height(), -1)[:height, :width]
        return rows


def make_scene() -> Scene:
    """Return a scene, of the software renderer where OpenGL is missing.

    Raises:
        UnsupportedError: Neither can draw here; the message says why.
    """
    if os.environ.get("QSG_RHI", "0") not in ("", "0"):
        raise UnsupportedError("overlays cannot be drawn by Qt's RHI; unset QSG_RHI")
    if _wants_software():
        return SoftwareScene()
    try:
        return OpenGLScene()
    except UnsupportedError:
        # It can be chosen until the first window is made.
        QtQuick.QQuickWindow.setSceneGraphBackend("software")
        if not _wants_software():
            raise
        return SoftwareScene()


def _wants_software() -> bool:
    # Qt looks at the environment when it makes the first window, and tells no sooner.
    named = os.environ.get("QT_QUICK_BACKEND") or os.environ.get("QMLSCENE_DEVICE")
    return (QtQuick.QQuickWindow.sceneGraphBackend() or named) in ("software", "softwarecontext")

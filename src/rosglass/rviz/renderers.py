"""What draws a scene of QML into memory: OpenGL, or Qt's software renderer."""

from __future__ import annotations

import math
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from rosglass.errors import UnsupportedError
from rosglass.rviz.gl import offscreen, read_pixels
from rosglass.rviz.qt5 import QtCore, QtGui

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

__all__ = ["OpenGLRenderer", "Renderer", "SoftwareRenderer"]

#: By this property of a context, Qt Quick finds the one scene that it expects a context to have.
_OWNER = "_q_sgrendercontext"


class Renderer(Protocol):
    """Draws one window of Qt Quick."""

    #: Seconds that reading the last picture back took.
    read_back: float

    def start(self, control: Any, window: Any) -> None:
        """Begin to draw a window; before anything else.

        Args:
            control: The window's QQuickRenderControl, which can be `apart` while it renders.
            window: The window.
        """

    def fit(self, width: int, height: int, ratio: float) -> float:
        """Set the size.

        Args:
            width: Pixels of the picture.
            height: Pixels.
            ratio: Pixels for one unit of the interface.

        Returns:
            What to multiply units of the interface with for those of the window.
        """

    def draw(self) -> NDArray[np.uint32]:
        """Return how the window looks; see :meth:`Scene.draw`."""

    def rest(self) -> None:
        """Let the last picture go: it may be long until the next one."""

    def stop(self) -> None:
        """Let everything go."""


class OpenGLRenderer:
    """Draws by OpenGL, in the one context that all scenes share.

    Raises:
        UnsupportedError: There is no OpenGL that Qt can use.
    """

    def __init__(self) -> None:
        self.read_back = 0.0
        self._gl = offscreen()
        self._control: Any = None
        self._window: Any = None
        self._buffer: Any = None
        self._shape = (0, 0)
        self._pixels: NDArray[np.uint32] | None = None

    def start(self, control: Any, window: Any) -> None:
        """Begin to draw a window."""
        self._control, self._window = control, window
        with self._gl.current():
            # Several scenes get on well in one context as long as none calls it its own.
            self._gl.context.setProperty(_OWNER, None)
            control.initialize(self._gl.context)
            self._gl.context.setProperty(_OWNER, None)

    def fit(self, width: int, height: int, ratio: float) -> float:
        """Set the size; texts and shapes are scaled by the window's pixel ratio.

        Raises:
            UnsupportedError: OpenGL has no buffer of this size.
        """
        self._window.resize(math.ceil(width / ratio), math.ceil(height / ratio))
        with self._gl.current():
            self._drop_buffer()
            self._buffer = QtGui.QOpenGLFramebufferObject(
                QtCore.QSize(width, height),
                QtGui.QOpenGLFramebufferObject.CombinedDepthStencil,
            )
            if not self._buffer.isValid():
                raise UnsupportedError(f"OpenGL makes no buffer of {width}x{height} pixels here")
            self._window.setRenderTarget(self._buffer)
        self._shape, self._pixels = (height, width), None
        return ratio

    def draw(self) -> NDArray[np.uint32]:
        """Render into a buffer, and read all of it: Qt Quick does not tell what has changed."""
        height, width = self._shape
        with self._gl.current():
            self._control.polishItems()
            self._control.sync()
            with self._control.apart():
                self._control.render()
            started = time.perf_counter()
            # Not before: QML that waits for an answer may have it let go meanwhile.
            if self._pixels is None:
                self._pixels = np.empty(self._shape, np.uint32)
            self._buffer.bind()
            read_pixels(width, height, self._pixels)
            self._buffer.release()
            self.read_back = time.perf_counter() - started
        return self._pixels[::-1]

    def rest(self) -> None:
        """Let the last picture go."""
        self._pixels = None

    def stop(self) -> None:
        """Let the buffer and what the scene has in OpenGL go."""
        with self._gl.current():
            self._control.invalidate()
            self._drop_buffer()

    def _drop_buffer(self) -> None:
        # Its memory is given back with the object, while the context is current.
        self._window.setRenderTarget(None)
        self._buffer = None


class SoftwareRenderer:
    """Has Qt's software renderer draw: no shaders, no particles, no video by OpenGL."""

    def __init__(self) -> None:
        self.read_back = 0.0
        self._control: Any = None
        self._window: Any = None
        self._image: Any = None
        self._shape = (0, 0)
        self._units = self._pixels = QtCore.QSize()

    def start(self, control: Any, window: Any) -> None:
        """Begin to draw a window."""
        self._control, self._window = control, window
        control.initialize(None)

    def fit(self, width: int, height: int, ratio: float) -> float:
        """Set the size."""
        own = self._window.devicePixelRatio()
        self._units = QtCore.QSize(math.ceil(width / ratio), math.ceil(height / ratio))
        self._pixels = QtCore.QSize(math.ceil(width / own), math.ceil(height / own))
        self._window.resize(self._units)
        self._shape = (height, width)
        return float(ratio / own)

    def draw(self) -> NDArray[np.uint32]:
        """Draw all of it into an image: Qt's `grab` draws everything anew."""
        self._control.polishItems()
        self._control.sync()
        with self._control.apart(), self._in_pixels():
            self._image = self._control.grab()
        height, width = self._shape
        words = np.frombuffer(self._image.constBits(), np.uint32)
        rows: NDArray[np.uint32] = words.reshape(self._image.height(), -1)[:height, :width]
        return rows

    @contextmanager
    def _in_pixels(self) -> Iterator[None]:
        """Have the window as large as its picture meanwhile, for that is what is drawn of it."""
        if self._units == self._pixels:
            yield
            return
        # QML is not to take note of it.
        blocked = self._window.blockSignals(True)
        self._window.resize(self._pixels)
        try:
            yield
        finally:
            self._window.resize(self._units)
            self._window.blockSignals(blocked)

    def rest(self) -> None:
        """Let the last picture go."""
        self._image = None

    def stop(self) -> None:
        """Let what the scene has in memory go."""
        self._control.invalidate()
        self._image = None

"""The renderers of QML scenes (OpenGL and Qt's software renderer), and the choice between them."""

from __future__ import annotations

import ctypes
import logging
import math
import os
import time
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from rosglass.errors import UnsupportedError
from rosglass.qml.run.renderer_choice import RendererChoice, ask_for_software
from rosglass.rviz.host import ogre
from rosglass.rviz.qt5 import QtCore, QtGui

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

__all__ = [
    "Offscreen",
    "OpenGLRenderer",
    "OverlayRendererChoice",
    "Renderer",
    "SoftwareRenderer",
    "choice",
    "keep_context",
    "offscreen",
    "read_depth",
    "read_pixels",
]


# OpenGL 1.2, "New Tokens".
_BGRA, _UNSIGNED_INT_8_8_8_8_REV = 0x80E1, 0x8367
_DEPTH_COMPONENT, _FLOAT = 0x1902, 0x1406


@cache
def _gl() -> ctypes.CDLL:
    try:
        library = ctypes.CDLL("libGL.so.1")
    except OSError as error:
        raise UnsupportedError(f"OpenGL cannot be loaded: {error}; apt install libgl1") from None
    for name in ("glXGetCurrentDisplay", "glXGetCurrentContext"):
        getattr(library, name).restype = ctypes.c_void_p
    library.glXGetCurrentDrawable.restype = ctypes.c_ulong
    library.glXMakeCurrent.argtypes = [ctypes.c_void_p, ctypes.c_ulong, ctypes.c_void_p]
    library.glReadPixels.argtypes = [*[ctypes.c_int] * 4, *[ctypes.c_uint] * 2, ctypes.c_void_p]
    return library


@contextmanager
def keep_context() -> Iterator[None]:
    """Restore the current OpenGL context at the end, because Ogre expects its own."""
    library = _gl()
    display, context = library.glXGetCurrentDisplay(), library.glXGetCurrentContext()
    drawable = library.glXGetCurrentDrawable()
    try:
        yield
    finally:
        if display and context:
            library.glXMakeCurrent(display, drawable, context)


class Offscreen:
    """The offscreen OpenGL context that all scenes of the process share.

    Raises:
        UnsupportedError: Qt cannot use OpenGL on this screen.
    """

    def __init__(self) -> None:
        self._depth = 0
        wanted = QtGui.QSurfaceFormat.defaultFormat()
        # Qt Quick needs the depth buffer for opaque items, and the stencil buffer for clipping.
        wanted.setDepthBufferSize(24)
        wanted.setStencilBufferSize(8)
        with keep_context():
            #: Qt's context.
            self.context = QtGui.QOpenGLContext()
            self.context.setFormat(wanted)
            made = self.context.create()
            self._surface = QtGui.QOffscreenSurface()
            self._surface.setFormat(self.context.format())
            self._surface.create()
            if not (made and self.context.makeCurrent(self._surface)):
                raise UnsupportedError(
                    "Qt cannot create an OpenGL context here; set QT_QUICK_BACKEND=software"
                )
            self.context.doneCurrent()

    @contextmanager
    def current(self) -> Iterator[None]:
        """Make the context current; may be nested.

        Raises:
            UnsupportedError: The graphics driver has lost the context.
        """
        if self._depth:
            yield
            return
        with keep_context():
            if not self.context.makeCurrent(self._surface):
                raise UnsupportedError(
                    "the graphics driver has lost the OpenGL context of overlays"
                )
            self._depth += 1
            try:
                yield
            finally:
                self._depth -= 1
                self.context.doneCurrent()


@cache
def offscreen() -> Offscreen:
    """Return the context of this process, created on the first call.

    Raises:
        UnsupportedError: Qt cannot use OpenGL on this screen.
    """
    return Offscreen()


def read_pixels(width: int, height: int, into: NDArray[np.uint32]) -> None:
    """Read the current framebuffer from its lower left corner, bottom row first.

    Args:
        width: Width in pixels.
        height: Height in pixels.
        into: Result: array of shape (height, width), each pixel 0xAARRGGBB.
    """
    assert into.shape == (height, width)
    assert into.flags.c_contiguous
    pixels: Any = into.ctypes.data
    _gl().glReadPixels(0, 0, width, height, _BGRA, _UNSIGNED_INT_8_8_8_8_REV, pixels)


def read_depth(x: int, y: int, width: int = 1, height: int = 1) -> NDArray[np.float32]:
    """Read depths from the current framebuffer.

    Args:
        x: Left edge in pixels.
        y: Lower edge in pixels, from the bottom.
        width: Width in pixels.
        height: Height in pixels.

    Returns:
        Array of shape (height, width) from 0 (near plane) to 1 (nothing was drawn), bottom row
        first.
    """
    depths = np.ones((height, width), np.float32)
    _gl().glReadPixels(x, y, width, height, _DEPTH_COMPONENT, _FLOAT, depths.ctypes.data)
    return depths


#: Property of an OpenGL context in which Qt Quick stores the single scene that it expects.
_SCENE_PROPERTY = "_q_sgrendercontext"


class Renderer(Protocol):
    """Draws a Qt Quick window into memory."""

    #: Seconds that :meth:`draw` last spent reading pixels back.
    read_back: float

    def start(self, control: Any, window: Any) -> None:
        """Set the window to draw, and its `_Control`; call this first."""

    def fit(self, width: int, height: int, ratio: float) -> float:
        """Set the size.

        Args:
            width: Width of the frame in pixels.
            height: Its height in pixels.
            ratio: Pixels per unit of the interface.

        Returns:
            Ratio of the window's event coordinates to units of the interface.
        """

    def draw(self) -> NDArray[np.uint32]:
        """Return the rendered frame; see :meth:`Scene.draw`."""

    def release_frame(self) -> None:
        """Release the memory of the last frame."""

    def stop(self) -> None:
        """Release all resources."""


class OpenGLRenderer:
    """Draws with OpenGL, in the context shared by all scenes.

    Raises:
        UnsupportedError: Qt cannot use OpenGL on this screen.
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
        """Set the window to draw."""
        self._control, self._window = control, window
        with self._gl.current():
            # Reset it, so that several scenes can share the context.
            self._gl.context.setProperty(_SCENE_PROPERTY, None)
            control.initialize(self._gl.context)
            self._gl.context.setProperty(_SCENE_PROPERTY, None)

    def fit(self, width: int, height: int, ratio: float) -> float:
        """Set the size; text and shapes are scaled by the window's pixel ratio.

        Raises:
            UnsupportedError: OpenGL cannot create a buffer of this size.
        """
        self._window.resize(math.ceil(width / ratio), math.ceil(height / ratio))
        with self._gl.current():
            self._drop_buffer()
            self._buffer = QtGui.QOpenGLFramebufferObject(
                QtCore.QSize(width, height),
                QtGui.QOpenGLFramebufferObject.CombinedDepthStencil,
            )
            if not self._buffer.isValid():
                raise UnsupportedError(f"OpenGL cannot create a buffer of {width}x{height} pixels")
            self._window.setRenderTarget(self._buffer)
        self._shape, self._pixels = (height, width), None
        return ratio

    def draw(self) -> NDArray[np.uint32]:
        """Render into a buffer, and read all of it, because Qt Quick does not report changes."""
        height, width = self._shape
        with self._gl.current():
            self._control.polishItems()
            self._control.sync()
            with self._control.without_window():
                self._control.render()
            started = time.perf_counter()
            # After rendering: QML that waits for a reply in a nested event loop may release it.
            if self._pixels is None:
                self._pixels = np.empty(self._shape, np.uint32)
            self._buffer.bind()
            read_pixels(width, height, self._pixels)
            self._buffer.release()
            self.read_back = time.perf_counter() - started
        return self._pixels[::-1]

    def release_frame(self) -> None:
        """Release the memory of the last frame."""
        self._pixels = None

    def stop(self) -> None:
        """Release the buffer and the scene's OpenGL resources."""
        with self._gl.current():
            self._control.invalidate()
            self._drop_buffer()

    def _drop_buffer(self) -> None:
        # The caller has made the context current, which deleting the buffer requires.
        self._window.setRenderTarget(None)
        self._buffer = None


class SoftwareRenderer:
    """Draws with Qt's software renderer: no shaders, no particles, no OpenGL video."""

    def __init__(self) -> None:
        self.read_back = 0.0
        self._control: Any = None
        self._window: Any = None
        self._image: Any = None
        self._shape = (0, 0)
        self._units = self._pixels = QtCore.QSize()

    def start(self, control: Any, window: Any) -> None:
        """Set the window to draw."""
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
        """Draw the whole scene into an image."""
        self._control.polishItems()
        self._control.sync()
        with self._control.without_window(), self._in_pixels():
            self._image = self._control.grab()
        height, width = self._shape
        words = np.frombuffer(self._image.constBits(), np.uint32)
        rows: NDArray[np.uint32] = words.reshape(self._image.height(), -1)[:height, :width]
        return rows

    @contextmanager
    def _in_pixels(self) -> Iterator[None]:
        """Resize the window to the size of its frame, to which Qt limits drawing."""
        if self._units == self._pixels:
            yield
            return
        # QML must not see this size.
        blocked = self._window.blockSignals(True)
        self._window.resize(self._pixels)
        try:
            yield
        finally:
            self._window.resize(self._units)
            self._window.blockSignals(blocked)

    def release_frame(self) -> None:
        """Release the memory of the last frame."""
        self._image = None

    def stop(self) -> None:
        """Release the scene's resources."""
        self._control.invalidate()
        self._image = None


class OverlayRendererChoice(RendererChoice):
    """The choice of the process's renderer, made for its first QML overlay."""

    _subject = "overlays"
    _application = "rosglass.rviz.Application"
    _log = logging.getLogger("rosglass.rviz")

    def prefer(self, renderer: str) -> None:
        """Set the user's choice, which overrides Qt's environment variables.

        Args:
            renderer: One of :data:`rosglass.qml.run.renderer_choice.RENDERERS`.

        Raises:
            Error: The renderer is unknown, or Qt uses another one already.
            UnsupportedError: QSG_RHI selects Qt's RHI, which overlays cannot use.
        """
        if os.environ.get("QSG_RHI", "0") not in ("", "0"):
            raise UnsupportedError("overlays cannot be drawn by Qt's RHI; unset QSG_RHI")
        super().prefer(renderer)

    def make(self, import_paths: Sequence[str]) -> Renderer:
        """Return a renderer for a scene; the first call makes the choice.

        Args:
            import_paths: Folders with QML modules that the expected files use.

        Raises:
            UnsupportedError: The user chose OpenGL, and Qt cannot use it here.
        """
        software = self.choose(import_paths) == "software"
        return SoftwareRenderer() if software else OpenGLRenderer()

    def _graphics_device(self) -> str:
        """Return the name of RViz's graphics device, e.g. ``llvmpipe (LLVM 15.0.6, 256 bits)``."""
        capabilities = ogre().Root.getSingleton().getRenderSystem().getCapabilities()
        return str(capabilities.getDeviceName()) or "an unnamed OpenGL"

    def _try_opengl(self) -> None:
        try:
            OpenGLRenderer()
        except UnsupportedError as error:
            if self._wanted != "auto" or not ask_for_software():
                raise
            self.renderer, self.reason = "software", str(error)


#: The renderer choice of this process.
choice = OverlayRendererChoice()

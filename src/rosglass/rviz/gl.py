"""OpenGL beside Ogre: a context of our own, and leaving Ogre's as it was."""

from __future__ import annotations

import contextlib
import ctypes
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import UnsupportedError
from rosglass.rviz.qt5 import QtGui

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

__all__ = ["Offscreen", "keep_context", "offscreen", "read_depth", "read_pixels"]

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


@contextlib.contextmanager
def keep_context() -> Iterator[None]:
    """Make the OpenGL context current again that is so now: Ogre takes it to be its own."""
    library = _gl()
    display, context = library.glXGetCurrentDisplay(), library.glXGetCurrentContext()
    drawable = library.glXGetCurrentDrawable()
    try:
        yield
    finally:
        if display and context:
            library.glXMakeCurrent(display, drawable, context)


class Offscreen:
    """An OpenGL context that draws where nobody sees it, for all scenes of the process.

    Raises:
        UnsupportedError: This screen has no OpenGL that Qt can use.
    """

    def __init__(self) -> None:
        self._depth = 0
        wanted = QtGui.QSurfaceFormat.defaultFormat()
        # Qt Quick sorts what is opaque by depth, and clips with the stencil.
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
                    "Qt can make no OpenGL context here; QT_QUICK_BACKEND=software draws without"
                )
            self.context.doneCurrent()

    @contextlib.contextmanager
    def current(self) -> Iterator[None]:
        """Make it the current context meanwhile; may be nested.

        Raises:
            UnsupportedError: The graphics driver has lost it.
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
    """Return the context of this process, made at the first call.

    Raises:
        UnsupportedError: This screen has no OpenGL that Qt can use.
    """
    return Offscreen()


def read_pixels(width: int, height: int, into: NDArray[np.uint32]) -> None:
    """Read the current framebuffer from its lower left corner; the bottom row comes first.

    Args:
        width: Pixels.
        height: Pixels.
        into: Array of shape (height, width), each pixel 0xAARRGGBB.
    """
    assert into.shape == (height, width)
    assert into.flags.c_contiguous
    pixels: Any = into.ctypes.data
    _gl().glReadPixels(0, 0, width, height, _BGRA, _UNSIGNED_INT_8_8_8_8_REV, pixels)


def read_depth(x: int, y: int, width: int = 1, height: int = 1) -> NDArray[np.float32]:
    """Return depths of the current framebuffer.

    Args:
        x: Left edge in pixels.
        y: Lower edge in pixels, from the bottom.
        width: Pixels.
        height: Pixels.

    Returns:
        Array of shape (height, width) from 0 (near plane) to 1 (nothing was drawn), bottom row
        first.
    """
    depths = np.ones((height, width), np.float32)
    _gl().glReadPixels(x, y, width, height, _DEPTH_COMPONENT, _FLOAT, depths.ctypes.data)
    return depths

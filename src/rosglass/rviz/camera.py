"""Projection of points into RViz's 3D view and back, and screenshots of the view."""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import Error
from rosglass.overlay.camera import Camera, Picker, ProjectedPoint
from rosglass.rviz.host import ogre
from rosglass.rviz.qt5 import QtGui
from rosglass.rviz.rendering import keep_context, read_depth, read_pixels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rosglass.rviz.window import Window

__all__ = ["RvizCamera", "RvizPicker"]


#: Ogre's name of RViz's 3D view; number 0 is a hidden window of one pixel.
_RENDER_TARGET = "OgreWindow(1)"


_BEHIND_CAMERA = ProjectedPoint(math.nan, math.nan, math.nan)


class RvizCamera(Camera):
    """The camera of RViz's 3D view at the last call of :meth:`update`; for the GUI thread only.

    RViz moves its camera between ``before_frame`` and drawing, so a handler of that signal reads
    the camera of the previous frame.
    """

    def __init__(self, window: Window) -> None:
        self._window = window
        self._view_projection: NDArray[np.float64] = np.eye(4)
        self._eye: NDArray[np.float64] = np.zeros(3)
        self._size = (0.0, 0.0)
        self.update()

    @property
    def eye(self) -> tuple[float, float, float]:
        """The camera's position in the fixed frame."""
        x, y, z = self._eye
        return float(x), float(y), float(z)

    def update(self) -> bool:
        """Read the camera from RViz; return whether the projection has changed."""
        viewport = ogre().Root.getSingleton().getRenderTarget(_RENDER_TARGET).getViewport(0)
        camera = viewport.getCamera()
        self._eye = _numbers(camera.getDerivedPosition())
        view = np.eye(4)
        view[:3, :3] = _numbers(camera.getViewMatrix().linear())
        view[:3, 3] = -view[:3, :3] @ self._eye
        whole = _numbers(camera.getProjectionMatrix()) @ view
        # RViz rounds its window's width up to an even number, unlike the widget's.
        ratio = self._window.view_size()[2]
        size = (viewport.getActualWidth() / ratio, viewport.getActualHeight() / ratio)
        same = size == self._size and np.array_equal(whole, self._view_projection)
        self._view_projection, self._size = whole, size
        return not same

    def project(self, point: Sequence[float]) -> ProjectedPoint:
        """Return a point's position in the view.

        Args:
            point: x, y, z in RViz's fixed frame, metres.

        Raises:
            Error: `point` is not three numbers.
        """
        at = _point(point)
        clip = self._view_projection @ np.append(at, 1.0)
        if not (np.isfinite(clip).all() and clip[3] > 0):
            return _BEHIND_CAMERA
        width, height = self._size
        x, y = clip[:2] / clip[3]
        depth = float(np.linalg.norm(at - self._eye))
        return ProjectedPoint(float((x + 1) / 2 * width), float((1 - y) / 2 * height), depth)

    def unproject(self, x: float, y: float, depth: float) -> tuple[float, float, float] | None:
        """Return the point of the fixed frame at a position in the view.

        Args:
            x: Units of the widget with the 3D view, from its left edge.
            y: Units of the widget, from its upper edge.
            depth: Value of OpenGL's depth buffer at this position, 0 to 1.

        Returns:
            x, y, z in metres; None if nothing was drawn there, i.e. at depth 1.
        """
        width, height = self._size
        if not 0 <= depth < 1 or not width or not height:
            return None
        seen = np.array([2 * x / width - 1, 1 - 2 * y / height, 2 * depth - 1, 1.0])
        found = np.linalg.solve(self._view_projection, seen)
        if not np.isfinite(found).all() or not found[3]:
            return None
        a, b, c = found[:3] / found[3]
        return float(a), float(b), float(c)


def _numbers(of: Any) -> NDArray[np.float64]:
    """Return a copy of an Ogre matrix or vector."""
    copied: NDArray[np.float64] = import_module("Ogre.Numpy").view(of).astype(np.float64)
    return copied


def _point(point: Sequence[float]) -> NDArray[np.float64]:
    try:
        at = np.array([float(number) for number in point])
    except (TypeError, ValueError):
        at = np.zeros(0)
    if at.shape != (3,):
        raise Error(f"a point must be three numbers, x, y and z in metres, not {point!r}")
    return at


class RvizPicker(Picker):
    """Picks points and takes screenshots by redrawing RViz's view, which takes milliseconds."""

    def __init__(self, window: Window) -> None:
        self._window = window
        self._busy = False

    def _pick(self, x: float, y: float, radius: float) -> tuple[float, float, float] | None:
        ratio = self._window.view_size()[2]
        width, height = self._size()
        column, row = math.floor(x * ratio), height - 1 - math.floor(y * ratio)
        if not (0 <= column < width and 0 <= row < height):
            return None
        around = math.ceil(radius * ratio)
        left, bottom = max(column - around, 0), max(row - around, 0)
        right, top = min(column + around, width - 1), min(row + around, height - 1)
        depths = self._redraw(
            lambda: read_depth(left, bottom, right - left + 1, top - bottom + 1).astype(float)
        )
        rows, columns = np.nonzero(depths < 1)
        if not len(rows):
            return None
        far = (rows + bottom - row) ** 2 + (columns + left - column) ** 2
        nearest = int(np.argmin(far))
        if far[nearest] > around**2:
            return None
        depth = float(depths[rows[nearest], columns[nearest]])
        seen_x = (int(columns[nearest]) + left + 0.5) / ratio
        seen_y = (height - 0.5 - (int(rows[nearest]) + bottom)) / ratio
        # A new camera: the view was drawn with the current one.
        return RvizCamera(self._window).unproject(seen_x, seen_y, depth)

    def picture(self) -> Any:
        """Return an image of the 3D view with its overlays, a ``QImage``.

        Raises:
            Error: The view cannot be drawn now.
        """
        width, height = self._size()
        pixels = np.zeros((height, width), np.uint32)
        self._redraw(lambda: read_pixels(width, height, pixels))
        rows = np.ascontiguousarray(pixels[::-1])
        image = QtGui.QImage(rows.data, width, height, 4 * width, QtGui.QImage.Format_RGB32)
        return image.copy()

    def window_picture(self) -> Any:
        """Return an image of RViz's window."""
        widget = self._window.widget
        grabbed = widget.grab().toImage()
        # Qt's image does not contain what Ogre draws.
        at = self._window.panel.mapTo(widget, self._window.panel.rect().topLeft())
        painter = QtGui.QPainter(grabbed)
        view = self.picture()
        view.setDevicePixelRatio(grabbed.devicePixelRatio())
        painter.drawImage(at, view)
        painter.end()
        return grabbed

    def _size(self) -> tuple[int, int]:
        target = self._target()
        return int(target.getWidth()), int(target.getHeight())

    @staticmethod
    def _target() -> Any:
        return ogre().Root.getSingleton().getRenderTarget(_RENDER_TARGET)

    def _redraw(self, read: Any) -> Any:
        if self._busy:
            raise Error("the 3D view is being captured already; try again later")
        if not self._window.panel.isVisible():
            raise Error("the 3D view is not visible")
        if QtGui.QOpenGLContext.currentContext() is not None:
            raise Error("this cannot be called while an overlay is being drawn; use Qt.callLater()")
        self._busy = True
        try:
            with keep_context():
                self._target().update(False)
                return read()
        finally:
            self._busy = False

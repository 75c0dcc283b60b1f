"""What is under a pixel of RViz's 3D view, and pictures of it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import Error
from rosglass.rviz.camera import Camera
from rosglass.rviz.gl import keep_context, read_depth, read_pixels
from rosglass.rviz.host import ogre
from rosglass.rviz.qt5 import QtGui
from rosglass.rviz.shown import shown

if TYPE_CHECKING:
    import os

    from rosglass.rviz.window import Window

__all__ = ["Picker"]

_TARGET = "OgreWindow(1)"


class Picker:
    """Draws the 3D view once more, and looks at the result; takes some milliseconds.

    Args:
        window: RViz.
    """

    def __init__(self, window: Window) -> None:
        self._window = window
        self._busy = False

    def pick(self, x: float, y: float, radius: float = 0.0) -> tuple[float, float, float] | None:
        """Return the point that is seen at a place.

        What is translucent (the grid, for instance) and overlays count for nothing.

        Args:
            x: Units of the widget with the 3D view, from its left edge.
            y: The same, from its upper edge.
            radius: How far around to look for what is nearest to the place, in the same units.

        Returns:
            x, y, z in the fixed frame, metres; None where there is nothing, or outside.

        Raises:
            Error: They are no finite numbers, or the 3D view is not drawn now.
        """
        if not all(math.isfinite(number) for number in (x, y, radius)) or not 0 <= radius <= 100:
            raise Error(
                "expected finite x and y, and a radius from 0 to 100, in units of the view, got "
                f"{shown([x, y, radius])[1:-1]}"
            )
        ratio = self._window.view_size()[2]
        width, height = self._size()
        column, row = math.floor(x * ratio), height - 1 - math.floor(y * ratio)
        if not (0 <= column < width and 0 <= row < height):
            return None
        around = math.ceil(radius * ratio)
        left, bottom = max(column - around, 0), max(row - around, 0)
        right, top = min(column + around, width - 1), min(row + around, height - 1)
        depths = self._drawn(
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
        # Made now: what is drawn is drawn by the camera of this moment.
        return Camera(self._window).unproject(seen_x, seen_y, depth)

    def picture(self) -> Any:
        """Return the 3D view with its overlays, a ``QImage``.

        Raises:
            Error: It is not drawn now.
        """
        width, height = self._size()
        pixels = np.zeros((height, width), np.uint32)
        self._drawn(lambda: read_pixels(width, height, pixels))
        rows = np.ascontiguousarray(pixels[::-1])
        image = QtGui.QImage(rows.data, width, height, 4 * width, QtGui.QImage.Format_RGB32)
        return image.copy()

    def screenshot(self, file: str | os.PathLike[str], *, window: bool = False) -> Path:
        """Save a picture of the 3D view with its overlays.

        Args:
            file: Where to; its ending says the format, e.g. ``.png`` or ``.jpg``.
            window: Show RViz's whole window instead, as it is on the screen.

        Returns:
            The file.

        Raises:
            Error: It cannot be written; the error says why.
        """
        path = Path(file).expanduser().absolute()
        known = sorted(
            {bytes(kind).decode() for kind in QtGui.QImageWriter.supportedImageFormats()}
        )
        if path.suffix.lower().lstrip(".") not in known:
            raise Error(f"{path}: the name must end in one of .{', .'.join(known)}")
        if not path.parent.is_dir():
            raise Error(f"{path}: there is no folder {path.parent}; make it first")
        image = self._grab_window() if window else self.picture()
        writer = QtGui.QImageWriter(str(path))
        if not writer.write(image):
            raise Error(f"{path}: the picture could not be written: {writer.errorString()}")
        return path

    def _grab_window(self) -> Any:
        widget = self._window.widget
        grabbed = widget.grab().toImage()
        # Qt knows nothing of what Ogre has drawn.
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
        return ogre().Root.getSingleton().getRenderTarget(_TARGET)

    def _drawn(self, read: Any) -> Any:
        if self._busy:
            raise Error("the 3D view is being looked at already; call it again later")
        if not self._window.panel.isVisible():
            raise Error("the 3D view is not shown now")
        if QtGui.QOpenGLContext.currentContext() is not None:
            raise Error(
                "this cannot be asked while the interface itself is being drawn; use Qt.callLater()"
            )
        self._busy = True
        try:
            with keep_context():
                self._target().update(False)
                return read()
        finally:
            self._busy = False

"""The camera of a 3D view, picking of points under pixels, and screenshots."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.errors import Error
from rosglass.overlay.property_values import shown
from rosglass.qt import QtGui

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

__all__ = ["Camera", "Picker", "ProjectedPoint"]


class ProjectedPoint(NamedTuple):
    """A point projected into the 3D view; all values are NaN behind the camera.

    Attributes:
        x: Units of the widget with the 3D view, from its left edge.
        y: Units of the widget, from its upper edge.
        depth: Metres from the camera.
    """

    x: float
    y: float
    depth: float


class Camera:
    """The camera of a 3D view at the last call of :meth:`update`; base class of each view's."""

    def update(self) -> bool:
        """Read the camera from the view; return whether the projection has changed."""
        raise NotImplementedError

    def project(self, point: Sequence[float]) -> ProjectedPoint:
        """Return a point's position in the view.

        Args:
            point: x, y, z in the fixed frame, metres.
        """
        raise NotImplementedError


class Picker:
    """Picks points and takes screenshots of a 3D view; base class of each view's."""

    def pick(self, x: float, y: float, radius: float = 0.0) -> tuple[float, float, float] | None:
        """Return the point of the scene at a position in the view.

        Ignores overlays and translucent objects such as the grid.

        Args:
            x: Units of the widget with the 3D view, from its left edge.
            y: Units of the widget, from its upper edge.
            radius: Radius in which to search for the nearest object, in the same units.

        Returns:
            x, y, z in the fixed frame, in metres; None if nothing is there, or outside the view.

        Raises:
            Error: An argument is not a finite number, or the 3D view cannot be drawn now.
        """
        if not all(math.isfinite(number) for number in (x, y, radius)) or not 0 <= radius <= 100:
            raise Error(
                "expected finite x and y, and a radius from 0 to 100, in units of the view, got "
                f"{shown([x, y, radius])[1:-1]}"
            )
        return self._pick(x, y, radius)

    def picture(self) -> Any:
        """Return a screenshot of the 3D view with its overlays, a ``QImage``.

        Raises:
            Error: The view cannot be drawn now.
        """
        raise NotImplementedError

    def window_picture(self) -> Any:
        """Return a screenshot of the whole window, a ``QImage``."""
        raise NotImplementedError

    def screenshot(self, file: str | os.PathLike[str], *, window: bool = False) -> Path:
        """Save a screenshot of the 3D view with its overlays.

        Args:
            file: The image file; its suffix determines the format, e.g. ``.png`` or ``.jpg``.
            window: Whether to include the rest of its window.

        Returns:
            The absolute path.

        Raises:
            Error: The view cannot be drawn now, or the file cannot be written.
        """
        path = Path(file).expanduser().absolute()
        known = sorted(
            {bytes(kind.data()).decode() for kind in QtGui.QImageWriter.supportedImageFormats()}
        )
        if path.suffix.lower().lstrip(".") not in known:
            raise Error(f"{path}: the name must end in one of .{', .'.join(known)}")
        if not path.parent.is_dir():
            raise Error(f"{path}: there is no folder {path.parent}; create it first")
        image = self.window_picture() if window else self.picture()
        writer = QtGui.QImageWriter(str(path))
        if not writer.write(image):
            raise Error(f"{path}: the image could not be written: {writer.errorString()}")
        return path

    def _pick(self, x: float, y: float, radius: float) -> tuple[float, float, float] | None:
        raise NotImplementedError

"""RViz's camera: where on the 3D view a point is seen, and what lies behind a pixel."""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rosglass.errors import Error
from rosglass.rviz.host import ogre

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rosglass.rviz.window import Window

__all__ = ["Camera", "Seen"]

#: RViz's main 3D view; number 0 is a hidden window of one pixel.
_TARGET = "OgreWindow(1)"


class Seen(NamedTuple):
    """Where a point is seen.

    Attributes:
        x: Units of the widget with the 3D view, from its left edge; NaN behind the camera.
        y: The same, from its upper edge.
        depth: Metres from the camera; NaN behind it.
    """

    x: float
    y: float
    depth: float


_NOWHERE = Seen(math.nan, math.nan, math.nan)


class Camera:
    """The camera of RViz's 3D view, as it was when :meth:`update` was called last.

    Used in the GUI thread. RViz moves its camera between ``before_frame`` and drawing, so that what
    is read there is one frame old.

    Args:
        window: RViz.
    """

    def __init__(self, window: Window) -> None:
        self._window = window
        self._whole: NDArray[np.float64] = np.eye(4)
        self._eye: NDArray[np.float64] = np.zeros(3)
        self._size = (0.0, 0.0)
        self.update()

    @property
    def eye(self) -> tuple[float, float, float]:
        """Where the camera is, in the fixed frame."""
        x, y, z = self._eye
        return float(x), float(y), float(z)

    def update(self) -> bool:
        """Read where the camera is now; returns whether anything is seen elsewhere than before."""
        viewport = ogre().Root.getSingleton().getRenderTarget(_TARGET).getViewport(0)
        camera = viewport.getCamera()
        self._eye = _numbers(camera.getDerivedPosition())
        view = np.eye(4)
        view[:3, :3] = _numbers(camera.getViewMatrix().linear())
        view[:3, 3] = -view[:3, :3] @ self._eye
        whole = _numbers(camera.getProjectionMatrix()) @ view
        # RViz makes its window's width even; the widget's own may be one less.
        ratio = self._window.view_size()[2]
        size = (viewport.getActualWidth() / ratio, viewport.getActualHeight() / ratio)
        same = size == self._size and np.array_equal(whole, self._whole)
        self._whole, self._size = whole, size
        return not same

    def project(self, point: Sequence[float]) -> Seen:
        """Return where a point is seen.

        Args:
            point: x, y, z in RViz's fixed frame, metres.

        Raises:
            Error: It is not three numbers.
        """
        at = _point(point)
        clip = self._whole @ np.append(at, 1.0)
        if not (np.isfinite(clip).all() and clip[3] > 0):
            return _NOWHERE
        width, height = self._size
        x, y = clip[:2] / clip[3]
        depth = float(np.linalg.norm(at - self._eye))
        return Seen(float((x + 1) / 2 * width), float((1 - y) / 2 * height), depth)

    def unproject(self, x: float, y: float, depth: float) -> tuple[float, float, float] | None:
        """Return the point of the fixed frame that is seen at a place.

        Args:
            x: Units of the widget with the 3D view, from its left edge.
            y: The same, from its upper edge.
            depth: What OpenGL's depth buffer holds there, 0 to 1.

        Returns:
            Metres; None where there is nothing, i.e. depth 1.
        """
        width, height = self._size
        if not 0 <= depth < 1 or not width or not height:
            return None
        seen = np.array([2 * x / width - 1, 1 - 2 * y / height, 2 * depth - 1, 1.0])
        found = np.linalg.solve(self._whole, seen)
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

"""An overlay on its layer: when it is drawn, and what that took."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rosglass.errors import Error
from rosglass.rviz.guard import guarded
from rosglass.rviz.layer import Layer

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rosglass.rviz.overlay import Overlay

__all__ = ["Drawing", "Work"]


class Work(NamedTuple):
    """Milliseconds that overlays took before a frame of RViz."""

    #: Drawing.
    render: float = 0.0
    #: Reading what was drawn by OpenGL.
    read_back: float = 0.0
    #: Finding out what has changed, and where anything is.
    compare: float = 0.0
    #: Handing what has changed to the graphics card.
    upload: float = 0.0

    @property
    def total(self) -> float:
        """All together."""
        return sum(self)


class Drawing:
    """An overlay with the layer that shows it.

    Args:
        overlay: The overlay.
    """

    def __init__(self, overlay: Overlay) -> None:
        self.overlay = overlay
        #: What shows it.
        self.layer = Layer(overlay.name)
        #: Whether it has changed since it was drawn.
        self.dirty = True
        self._size = (0, 0, 0.0)
        self._fits = False
        self._failed = False

    def mark(self) -> None:
        """Have it drawn before the next frame in which it is shown."""
        self.dirty = True

    @property
    def shown(self) -> bool:
        """Whether there is anything to see of it."""
        return self.overlay.visible and self.overlay.opacity > 0

    def before_frame(self, width: int, height: int, ratio: float) -> Work | None:
        """Draw it, if it is shown and has changed.

        Args:
            width: Pixels of the 3D view.
            height: Pixels.
            ratio: Pixels of the screen for one of Qt's.

        Returns:
            What it took; None when there was nothing to do.
        """
        overlay, layer = self.overlay, self.layer
        if not self.shown:
            layer.set_visible(False)
            return None
        size = (width, height, ratio * overlay.scale)
        work = self._draw(size) if self.dirty or size != self._size else None
        layer.set_opacity(overlay.opacity)
        # What failed to be drawn would show what was true before.
        layer.set_visible(not self._failed)
        return work

    def _draw(self, size: tuple[int, int, float]) -> Work:
        overlay, layer = self.overlay, self.layer
        resized = size != self._size or not self._fits
        self._size, self._fits, self.dirty = size, False, False
        started = time.perf_counter()
        done, drawn = False, 0.0
        pixels: NDArray[np.uint32] | None = None
        overlay.read_back, overlay.painted = 0.0, None
        with guarded(overlay, "drawing"):
            if resized:
                overlay.resize(*size)
            self._fits = True
            pixels = overlay.draw()
            _check(pixels, size)
            drawn = time.perf_counter() - started
            if pixels is not None:
                # What failed to be shown before may be anywhere.
                layer.update(pixels, None if self._failed else overlay.painted)
            done = True
        if done and self._failed:
            overlay.tell_problem("")
        self._failed = not done
        if pixels is None or not done:
            return Work(1e3 * (time.perf_counter() - started))
        render = drawn - overlay.read_back
        parts = (render, overlay.read_back, layer.compared, layer.uploaded)
        return Work(*(1e3 * part for part in parts))

    def close(self) -> None:
        """Take it off the view; the overlay is for others to close."""
        self.layer.close()


def _check(pixels: object, size: tuple[int, int, float]) -> None:
    if pixels is None:
        return
    wanted = (size[1], size[0])
    if not (
        isinstance(pixels, np.ndarray) and pixels.dtype == np.uint32 and pixels.shape == wanted
    ):
        kind = f"{pixels.dtype}{pixels.shape}" if isinstance(pixels, np.ndarray) else type(pixels)
        raise Error(f"draw() must return an array of uint32 of shape {wanted}, and returned {kind}")

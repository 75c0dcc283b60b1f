"""The seam between what is drawn over RViz's 3D view and RViz: QML, widgets, or your own."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rosglass.errors import Error
from rosglass.qt import QtCore, Signal
from rosglass.rviz.registered_properties import RegisteredProperties

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rosglass.qt import QtGui
    from rosglass.rviz.tiles import Rect
    from rosglass.rviz.window import Window

__all__ = ["SCALES", "Overlay"]

#: The smallest and the largest scale of an overlay.
SCALES = (0.1, 10.0)


class Overlay(QtCore.QObject):
    """Something drawn over RViz's 3D view, which may take part of its mouse and keys.

    Derive from it to draw with anything: give :meth:`draw` and, where it is to be operated,
    :meth:`deliver`. Everything runs in the GUI thread; what raises is told in the log, and RViz
    goes on.

    Args:
        name: Its name among the overlays of an RViz.
        z: Overlays of higher `z` are above those of lower; among equals, the later one.
        scale: How many pixels of the 3D view one unit of the overlay takes, 0.1 to 10.
        opacity: From 0 (nothing is seen) to 1.

    Raises:
        Error: A number is out of its range, or the name is empty.
    """

    #: What it shows is to be drawn again.
    changed = Signal()
    #: `z`, `scale`, `opacity` or `visible` is another now.
    arranged = Signal()
    #: Something else is in its place, which has neither the mouse nor the keys; itself.
    renewed = Signal(object)
    #: Something is wrong with it, or no longer, if empty.
    problem_changed = Signal(str)

    def __init__(self, name: str, *, z: int = 0, scale: float = 1.0, opacity: float = 1.0) -> None:
        super().__init__()
        if not name:
            raise Error("an overlay needs a name, e.g. 'Dashboard'")
        self.name = name
        #: What it lets be set in RViz's Displays panel, and kept with RViz's config.
        self.properties = RegisteredProperties()
        self._z, self._scale, self._opacity, self._visible = 0, 1.0, 1.0, True
        self._problem = ""
        #: Above all overlays that are no popups.
        self.is_popup = False
        #: While it is shown, nothing below it gets any input, RViz's view included.
        self.is_modal = False
        #: Seconds of the last :meth:`draw` that went into reading back what OpenGL drew.
        self.read_back = 0.0
        #: Where the last :meth:`draw` has painted, if that is known; None for anywhere.
        self.painted: list[Rect] | None = None
        self.z, self.scale, self.opacity = z, scale, opacity

    @property
    def z(self) -> int:
        """Its place in the stack."""
        return self._z

    @z.setter
    def z(self, z: int) -> None:
        if not isinstance(z, int):
            raise Error(f"overlay {self.name}: z must be a whole number, e.g. 1, got {z!r}")
        self._z = z
        self.arranged.emit()

    @property
    def scale(self) -> float:
        """Pixels of the 3D view for one unit."""
        return self._scale

    @scale.setter
    def scale(self, scale: float) -> None:
        if not (_is_number(scale) and SCALES[0] <= scale <= SCALES[1]):
            raise Error(f"overlay {self.name}: scale {scale!r} is not a number from 0.1 to 10")
        self._scale = scale
        self.arranged.emit()

    @property
    def opacity(self) -> float:
        """From 0 (nothing is seen) to 1."""
        return self._opacity

    @opacity.setter
    def opacity(self, opacity: float) -> None:
        if not (_is_number(opacity) and 0 <= opacity <= 1):
            raise Error(f"overlay {self.name}: opacity {opacity!r} is not a number from 0 to 1")
        self._opacity = opacity
        self.arranged.emit()

    @property
    def visible(self) -> bool:
        """Whether it is shown; what is not shown gets no input either."""
        return self._visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        if visible != self._visible:
            self._visible = visible
            self.arranged.emit()

    @property
    def problem(self) -> str:
        """What is wrong with it; empty when nothing is."""
        return self._problem

    def tell_problem(self, problem: str) -> None:
        """Say what is wrong with it, or that nothing is, with an empty text."""
        if problem != self._problem:
            self._problem = problem
            self.problem_changed.emit(problem)

    def attach(self, window: Window) -> None:
        """Be told over which RViz it is shown, before anything else happens to it."""

    def _missing(self, method: str) -> str:
        return f"overlay {self.name}: its class {type(self).__name__} has to give {method}"

    def resize(self, width: int, height: int, ratio: float) -> None:
        """Fit it to the 3D view.

        Args:
            width: Pixels that :meth:`draw` is to draw.
            height: Pixels.
            ratio: Pixels for one unit of the overlay, its scale and the screen's pixel ratio in it.
        """
        raise NotImplementedError(self._missing("resize(width, height, ratio)"))

    def draw(self) -> NDArray[np.uint32] | None:
        """Return what is to be seen, or None for the same as before.

        Returns:
            Array of shape (height, width) as :meth:`resize` asked for, each pixel 0xAARRGGBB with
            premultiplied colours. It is read before the next call.
        """
        raise NotImplementedError(self._missing("draw()"))

    def deliver(self, event: QtCore.QEvent) -> bool:
        """Handle an event of the mouse, of touch or of the keyboard.

        Args:
            event: Its positions are in units of the overlay.

        Returns:
            Whether it was for this overlay; otherwise overlays below and RViz get it.
        """
        del event
        return False

    def leave(self) -> None:
        """Be told that the mouse is over it no longer, and a press has ended without effect."""

    def set_focus(self, focus: bool) -> None:
        """Be told that keys come here from now on, or no longer."""

    def cursor(self) -> QtGui.QCursor | None:
        """Return the mouse's shape over it now; None where it is RViz's."""
        return None

    def close(self) -> None:
        """Let everything go; safe to call twice."""


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and math.isfinite(value)

"""The base class of overlays."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.overlay.registered_properties import RegisteredProperties
from rosglass.qt import QtCore, Signal

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from rosglass.qt import QtGui

__all__ = ["SCALE_LIMITS", "Overlay"]


#: Minimum and maximum scale of an overlay.
SCALE_LIMITS = (0.1, 10.0)


class Overlay(QtCore.QObject):
    """Something drawn over RViz's 3D view that can handle mouse, touch and keyboard input.

    Base class: implement :meth:`resize` and :meth:`draw`, and :meth:`deliver` to handle input. All
    methods run in the GUI thread. Errors they raise are logged, and RViz continues.

    Args:
        name: Name, unique among the overlays of an RViz.
        z: Stacking order: higher values are on top; of equal values, the overlay added last.
        scale: Pixels of the 3D view per unit of the overlay, 0.1 to 10.
        opacity: From 0 (invisible) to 1.

    Raises:
        Error: A number is out of range, or the name is empty.
    """

    #: The overlay has to be drawn again.
    changed = Signal()
    #: `z`, `scale`, `opacity` or `visible` has changed.
    arranged = Signal()
    #: The content was replaced, so that mouse and focus must be released. Argument: the overlay.
    renewed = Signal(object)
    #: :attr:`problem` has changed. Argument: the new text, empty if the problem is solved.
    problem_changed = Signal(str)

    def __init__(self, name: str, *, z: int = 0, scale: float = 1.0, opacity: float = 1.0) -> None:
        super().__init__()
        if not name:
            raise Error("an overlay needs a name, e.g. 'Dashboard'")
        self.name = name
        #: Properties that RViz's Displays panel shows and its config file saves.
        self.properties = RegisteredProperties()
        self._z, self._scale, self._opacity, self._visible = 0, 1.0, 1.0, True
        self._problem = ""
        #: The item of the window that it covers; None if that is the whole window.
        self.area: Any = None
        #: Whether it is above all overlays that are not popups.
        self.is_popup = False
        #: Whether it blocks all input to what is below it, including RViz's view, while visible.
        self.is_modal = False
        #: Seconds that the last :meth:`draw` spent reading pixels back from OpenGL.
        self.read_back = 0.0
        #: Rectangles that the last :meth:`draw` painted, as left, top, right and bottom in pixels;
        #: None if unknown.
        self.painted: Sequence[tuple[int, int, int, int]] | None = None
        self.z, self.scale, self.opacity = z, scale, opacity

    @property
    def z(self) -> int:
        """Stacking order: higher values are on top."""
        return self._z

    @z.setter
    def z(self, z: int) -> None:
        if not isinstance(z, int):
            raise Error(f"overlay {self.name}: z must be a whole number, e.g. 1, got {z!r}")
        self._z = z
        self.arranged.emit()

    @property
    def scale(self) -> float:
        """Pixels of the 3D view per unit of the overlay."""
        return self._scale

    @scale.setter
    def scale(self, scale: float) -> None:
        if not (_is_number(scale) and SCALE_LIMITS[0] <= scale <= SCALE_LIMITS[1]):
            raise Error(f"overlay {self.name}: scale {scale!r} is not a number from 0.1 to 10")
        self._scale = scale
        self.arranged.emit()

    @property
    def opacity(self) -> float:
        """From 0 (invisible) to 1."""
        return self._opacity

    @opacity.setter
    def opacity(self, opacity: float) -> None:
        if not (_is_number(opacity) and 0 <= opacity <= 1):
            raise Error(f"overlay {self.name}: opacity {opacity!r} is not a number from 0 to 1")
        self._opacity = opacity
        self.arranged.emit()

    @property
    def visible(self) -> bool:
        """True if it is shown; a hidden overlay gets no input."""
        return self._visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        if visible != self._visible:
            self._visible = visible
            self.arranged.emit()

    @property
    def problem(self) -> str:
        """Error text of the overlay; empty if it works."""
        return self._problem

    def show_problem(self, problem: str) -> None:
        """Set :attr:`problem`; an empty text clears it."""
        if problem != self._problem:
            self._problem = problem
            self.problem_changed.emit(problem)

    def attach(self, window: Any) -> None:
        """Called before any other method, with the RViz window to draw over."""

    def _missing(self, method: str) -> str:
        return f"overlay {self.name}: its class {type(self).__name__} must implement {method}"

    def resize(self, width: int, height: int, ratio: float) -> None:
        """Set the size to draw.

        Args:
            width: Width in pixels of the array that :meth:`draw` returns.
            height: Height in pixels.
            ratio: Pixels per unit of the overlay: its scale times the screen's pixel ratio.
        """
        raise NotImplementedError(self._missing("resize(width, height, ratio)"))

    def draw(self) -> NDArray[np.uint32] | None:
        """Return the pixels to show, or None if they have not changed.

        Returns:
            Array of shape (height, width) as set by :meth:`resize`, each pixel 0xAARRGGBB with
            premultiplied colours. The caller reads it before the next call.
        """
        raise NotImplementedError(self._missing("draw()"))

    def deliver(self, event: QtCore.QEvent) -> bool:
        """Handle a mouse, touch or keyboard event.

        Args:
            event: The event, with positions in units of the overlay.

        Returns:
            Whether the overlay accepts the event; otherwise the overlays below and RViz get it.
        """
        del event
        return False

    def leave(self) -> None:
        """Called when the mouse has left the overlay: end hovering, and cancel any press."""

    def set_focus(self, focus: bool) -> None:
        """Called when the overlay gets or loses the keyboard focus."""

    def cursor(self) -> QtGui.QCursor | None:
        """Return the mouse cursor at the current position; None for the default one."""
        return None

    def close(self) -> None:
        """Release all resources; safe to call twice."""


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and math.isfinite(value)

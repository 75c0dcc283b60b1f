"""Tools, displays, views, camera and config of a 3D view, for Python and the object ``rviz``."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rosglass.qt import QtCore, Signal, Slot

if TYPE_CHECKING:
    from rosglass.overlay.camera import Picker
    from rosglass.overlay.displays import Displays
    from rosglass.overlay.tools import Tools
    from rosglass.overlay.trackers import Frames, Trackers
    from rosglass.overlay.view import View, Views

__all__ = ["Access"]


#: Milliseconds over which the frame rate is measured.
_MEASUREMENT_PERIOD_MS = 1000


class Access(QtCore.QObject):
    """The seam to a 3D view; use it in the GUI thread only.

    docs/architecture.md, section 6, has the members. Derived classes have the parts, created on
    first use, and the properties that only have a type here.
    """

    #: The view is about to draw.
    before_frame = Signal()
    #: A config file was loaded, which replaces all displays, views and tools. Argument: its path.
    config_loaded = Signal(str)
    #: :attr:`fullscreen` has changed.
    fullscreen_changed = Signal()
    #: :attr:`bare` has changed.
    bare_changed = Signal()
    #: :attr:`fixed_frame` has changed.
    fixed_frame_changed = Signal()
    #: :attr:`frame_rate` has changed.
    frame_rate_changed = Signal()

    if TYPE_CHECKING:

        @property
        def tools(self) -> Tools:
            """The tools."""

        @property
        def displays(self) -> Displays:
            """The displays."""

        @property
        def frames(self) -> Frames:
            """The robot's coordinate frames."""

        @property
        def view(self) -> View:
            """The camera."""

        @property
        def views(self) -> Views:
            """The view types and the saved views."""

        @property
        def picker(self) -> Picker:
            """Picking of 3D points, and screenshots."""

        @property
        def trackers(self) -> Trackers:
            """Trackers of points in the 3D view."""

        #: The frame in which everything is placed.
        fixed_frame: str
        #: Whether the window fills the screen.
        fullscreen: bool
        #: Whether only the 3D view is shown.
        bare: bool

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._frame_rate, self._measured_since = 0.0, time.monotonic()
        self._drawn_before = self._frames_drawn()
        self._timer = QtCore.QTimer(self)
        self._timer.setInterval(_MEASUREMENT_PERIOD_MS)
        self._timer.timeout.connect(self._measure)
        self._timer.start()

    @property
    def frame_rate(self) -> float:
        """Frames drawn in the last second."""
        return self._frame_rate

    def load_config(self, file: str) -> None:
        """Load a ``.rviz`` file from the event loop, after the current event.

        Raises:
            Error: The file is missing or is not an RViz config.
        """
        raise NotImplementedError(f"{type(self).__name__} must implement load_config()")

    def save_config(self, file: str = "") -> None:
        """Save a ``.rviz`` file, by default to the file it was loaded from.

        Raises:
            Error: The file cannot be written, or no config is loaded and no file is given.
        """
        raise NotImplementedError(f"{type(self).__name__} must implement save_config()")

    def close(self) -> None:
        """Stop observing the view and the robot; safe to call twice."""
        self._timer.stop()

    def _frames_drawn(self) -> int:
        """Return how many frames were drawn so far."""
        raise NotImplementedError(f"{type(self).__name__} must implement _frames_drawn()")

    @Slot()
    def _measure(self) -> None:
        now, drawn = time.monotonic(), self._frames_drawn()
        rate = max(drawn - self._drawn_before, 0) / max(now - self._measured_since, 0.001)
        self._drawn_before, self._measured_since = drawn, now
        if round(rate, 1) != self._frame_rate:
            self._frame_rate = round(rate, 1)
            self.frame_rate_changed.emit()

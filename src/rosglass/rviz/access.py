"""Tools, displays, views, camera and config of RViz, for Python and the object ``rviz``."""

from __future__ import annotations

import logging
from functools import cached_property
from typing import TYPE_CHECKING

from rosglass.errors import Error
from rosglass.overlay.access import Access
from rosglass.overlay.trackers import Frames, Trackers
from rosglass.overlay.view import View
from rosglass.qt import QtCore
from rosglass.rviz.camera import RvizCamera, RvizPicker
from rosglass.rviz.displays import RvizDisplays
from rosglass.rviz.host import Hook
from rosglass.rviz.tools import RvizTools
from rosglass.rviz.view import RvizCurrentView, RvizViews
from rosglass.rviz.window import config_file

if TYPE_CHECKING:
    from rosglass.qml.engine.session import Session
    from rosglass.rviz.window import Window

__all__ = ["RvizAccess"]

_log = logging.getLogger("rosglass.rviz")


class RvizAccess(Access):
    """The interface to RViz, ``Application.rviz``."""

    def __init__(self, window: Window, session: Session) -> None:
        self.window, self._session, self._frames = window, session, 0
        super().__init__()
        window.before_frame.connect(self._on_frame)
        window.config_loaded.connect(self.config_loaded)
        window.bare.changed.connect(self.bare_changed)
        # RViz emits the signal before it resizes the window.
        window.fullscreen_changed.connect(
            lambda _: QtCore.QTimer.singleShot(0, self.fullscreen_changed.emit)
        )
        options = window.manager.getRootDisplayGroup().subProp("Global Options")
        # RViz has no signal for a changed fixed frame.
        self._hook = Hook(self.fixed_frame_changed.emit)
        self._hook.watch(options.subProp("Fixed Frame"), "changed()")

    @cached_property
    def tools(self) -> RvizTools:
        """RViz's tools."""
        return RvizTools(self.window)

    @cached_property
    def displays(self) -> RvizDisplays:
        """RViz's displays."""
        return RvizDisplays(self.window)

    @cached_property
    def frames(self) -> Frames:
        """The robot's coordinate frames."""
        return Frames(self._session, lambda: self.fixed_frame)

    @cached_property
    def view(self) -> View:
        """The camera."""
        window = self.window
        view = View(RvizCurrentView(window), self.frames, window.before_frame)
        window.config_loading.connect(view.end_motion)
        window.closing.connect(view.close)
        return view

    @cached_property
    def views(self) -> RvizViews:
        """The view types and the saved views."""
        return RvizViews(self.window)

    @cached_property
    def picker(self) -> RvizPicker:
        """Picking of 3D points, and screenshots."""
        return RvizPicker(self.window)

    @cached_property
    def trackers(self) -> Trackers:
        """Trackers of points in the 3D view."""
        window = self.window
        return Trackers(window.before_frame, lambda: RvizCamera(window), lambda: self.frames)

    @property
    def fixed_frame(self) -> str:
        """RViz's fixed frame."""
        return str(self.window.manager.getFixedFrame())

    @fixed_frame.setter
    def fixed_frame(self, frame: str) -> None:
        if frame == "":
            raise Error("expected the name of a frame, e.g. 'map', got ''")
        self.displays.set("Global Options/Fixed Frame", frame)

    @property
    def fullscreen(self) -> bool:
        """True while RViz fills the screen."""
        return self.window.fullscreen

    @fullscreen.setter
    def fullscreen(self, fullscreen: bool) -> None:
        self.window.fullscreen = fullscreen

    @property
    def bare(self) -> bool:
        """True while RViz's window shows only the 3D view."""
        return self.window.bare.on

    @bare.setter
    def bare(self, bare: bool) -> None:
        self.window.bare.on = bare

    def load_config(self, file: str) -> None:
        """Load a ``.rviz`` file from the event loop, after the current event.

        Raises:
            Error: The file is missing or is not an RViz config.
        """
        path = config_file(file)

        def load() -> None:
            try:
                self.window.flush_panels()
                self.window.load_config(path)
            except Error as error:
                _log.error("rviz.loadConfig: %s", error)

        QtCore.QTimer.singleShot(0, load)

    def save_config(self, file: str = "") -> None:
        """Save RViz's config, by default to the file it was loaded from.

        Raises:
            Error: The folder does not exist, or no config file is loaded and none is given.
        """
        if not (file or self.window.config):
            raise Error("no config file is loaded; give the file to save to")
        self.window.save_config(file)

    def close(self) -> None:
        """Stop observing RViz and the robot; safe to call twice."""
        super().close()
        for name, part in list(self.__dict__.items()):
            if name in ("displays", "frames"):
                part.close()

    def _frames_drawn(self) -> int:
        return self._frames

    def _on_frame(self) -> None:
        self._frames += 1
        self.before_frame.emit()

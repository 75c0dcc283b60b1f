"""RViz itself: its window, its displays, and when it draws."""

from __future__ import annotations

from typing import Any

from rosglass.qt import QtCore, Signal
from rosglass.rviz.host import as_pyside, rviz
from rosglass.rviz.qt5 import QtCore as Qt5Core
from rosglass.rviz.qt5 import QtWidgets

__all__ = ["Window"]


class Window(QtCore.QObject):
    """RViz's window, made in this process.

    RViz registers with the ROS master while it is made, and waits for it without end: find out
    before whether it answers.

    Args:
        config: The ``.rviz`` file; empty for RViz's default one.
    """

    #: RViz is about to draw.
    before_frame = Signal()

    def __init__(self, config: str = "") -> None:
        super().__init__()
        bindings = rviz()
        #: RViz's ``VisualizationFrame``, as its own bindings know it.
        self.frame: Any = bindings.VisualizationFrame()
        self.frame.setSplashPath("")
        self.frame.initialize(config) if config else self.frame.initialize()
        #: RViz's ``VisualizationManager``.
        self.manager: Any = self.frame.getManager()
        #: The window, as PySide2 knows it.
        self.widget = as_pyside(self.frame, QtWidgets.QMainWindow)
        #: The widget with the 3D view.
        self.panel = self._find_panel(QtWidgets.QWidget)
        manager = as_pyside(self.manager, QtCore.QObject)
        self._wrapped = manager
        Qt5Core.QObject.connect(manager, Qt5Core.SIGNAL("preUpdate()"), self.before_frame.emit)

    def _find_panel(self, kind: Any) -> Any:
        found = self.widget.findChildren(kind)
        return next(w for w in found if w.metaObject().className() == "rviz::RenderPanel")

    def view_size(self) -> tuple[int, int, float]:
        """Return width and height of the 3D view in pixels of the screen, and its pixel ratio."""
        ratio = self.panel.devicePixelRatioF()
        return round(self.panel.width() * ratio), round(self.panel.height() * ratio), ratio

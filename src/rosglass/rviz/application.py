"""RViz in this process, with overlays; ``rosglass rviz`` is such a program."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from rosglass.qml.display import require_display
from rosglass.qml.interrupt import QuitOnSignal, end_process_within
from rosglass.qml.session import Session
from rosglass.qt import QtCore, run_event_loop
from rosglass.rviz.host import require_rviz
from rosglass.rviz.qml_overlay import QmlOverlay
from rosglass.rviz.qt5 import QtWidgets
from rosglass.rviz.stack import Stack
from rosglass.rviz.window import Window

if TYPE_CHECKING:
    from rosglass.rviz.overlay import Overlay

__all__ = ["Application"]

_PATIENCE = 1.7


class Application:
    """RViz with its overlays, and the node that they talk through.

    Args:
        config: The ``.rviz`` file; empty for RViz's default one.
        url: The ROS 1 master of RViz and of the overlays; empty for ``ROS_MASTER_URI``.
        session: The node that overlays talk through, instead of one of its own.

    Raises:
        UnsupportedError: RViz, its bindings or a display are missing.
    """

    def __init__(self, config: str = "", *, url: str = "", session: Session | None = None) -> None:
        require_rviz()
        connected = require_display()
        #: The Qt application.
        self.qt: Any = QtCore.QCoreApplication.instance() or QtWidgets.QApplication(["rosglass"])
        connected()
        self._owns_session = session is None
        #: The node that QML talks through.
        self.session = session or Session(url or os.environ.get("ROS_MASTER_URI", ""))
        #: RViz.
        self.window = Window(config)
        #: The overlays, the lowest first.
        self.overlays = Stack(self.window)
        self._closed = False

    def add(self, overlay: Overlay) -> Overlay:
        """Show an overlay.

        Raises:
            Error: There is one of this name.
        """
        self.overlays.add(overlay)
        return overlay

    def add_qml(self, file: str | os.PathLike[str], name: str = "", **options: Any) -> QmlOverlay:
        """Show a QML file over the 3D view.

        Raises:
            QmlError: The file is missing or has errors.
        """
        overlay = QmlOverlay(file, self.session, name, **options)
        overlay.load()
        self.add(overlay)
        return overlay

    def run(self, *, end_process: bool = False) -> int:
        """Show RViz until it is closed; returns the exit code."""
        self.window.widget.show()
        with QuitOnSignal(lambda number: self.quit(128 + number), _PATIENCE):
            code = run_event_loop(self.qt)
            if end_process:
                end_process_within(_PATIENCE, code)
            self.close()
        return code

    def quit(self, code: int = 0) -> None:
        """Have :meth:`run` return; from any thread."""
        self.session.executor.post(lambda: QtCore.QCoreApplication.exit(code))

    def close(self) -> None:
        """Take the overlays down and close the node; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self.overlays.close()
        if self._owns_session:
            self.session.close()

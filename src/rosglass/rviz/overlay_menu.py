"""The menu "Overlays" in RViz's menu bar: add a QML file, show one anew, take one away."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore
from rosglass.rviz.properties import quiet
from rosglass.rviz.qml_overlay import QmlOverlay
from rosglass.rviz.qt5 import QtWidgets

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.rviz.display import Entry
    from rosglass.rviz.entries import Entries
    from rosglass.rviz.window import Window

__all__ = ["OverlayMenu"]

_FILTER = "QML files (*.qml);;All files (*)"


class OverlayMenu(QtCore.QObject):
    """Fills the menu; the lists in it are made when they are opened.

    Args:
        window: RViz.
        entries: Its overlays.
    """

    def __init__(self, window: Window, entries: Entries) -> None:
        super().__init__()
        self._window, self._entries = window, entries
        self._dialog: Any = None
        menu = window.menu("&Overlays")
        self._add = menu.addAction("&Add QML overlay...")
        self._choose = quiet()(lambda *_: self._open())
        self._add.triggered.connect(self._choose)
        self._lists = [
            self._list(menu, "&Reload", self._reload, lambda entry: entry.is_qml),
            self._list(menu, "Re&move", entries.remove, lambda _entry: True),
        ]

    def _list(
        self, menu: Any, title: str, act: Callable[[Entry], None], fits: Callable[[Entry], bool]
    ) -> Any:
        part = QtWidgets.QMenu(title, menu)
        menu.addMenu(part)

        def fill() -> None:
            part.clear()
            for entry in self._entries:
                if entry.alive and fits(entry):
                    # An ampersand would mark a key.
                    name = str(entry.display.getName()).replace("&", "&&")
                    chosen = part.addAction(name)
                    chosen.triggered.connect(quiet()(lambda *_, entry=entry: act(entry)))
            part.setEnabled(bool(part.actions()))

        filled = quiet()(fill)
        menu.aboutToShow.connect(filled)
        return part, filled

    def _open(self) -> None:
        dialog = QtWidgets.QFileDialog(self._window.widget, "Add QML overlay", "", _FILTER)
        dialog.setFileMode(QtWidgets.QFileDialog.ExistingFile)
        dialog.setAttribute(QtCore.Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.fileSelected.connect(quiet()(self._entries.add_qml))
        self._dialog = dialog
        dialog.open()

    @staticmethod
    def _reload(entry: Entry) -> None:
        overlay = entry.overlay
        if isinstance(overlay, QmlOverlay):
            overlay.reload()
        else:
            entry.retry()

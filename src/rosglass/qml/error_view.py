"""What is wrong with an interface, shown over what there is of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, QtQml, is_alive

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["ERRORS", "ERRORS_BELOW", "NO_NODE", "PANEL", "SCRIPT_ENDED", "ErrorView"]

#: The QML file of an item that is no larger than its text, and can be closed.
PANEL = Path(__file__).with_name("ErrorPanel.qml")
#: Headings, by what is below.
ERRORS = "This interface has errors. It is shown once they are mended."
ERRORS_BELOW = "The interface below is the last one without errors."
NO_NODE = "This interface has no node: nothing is received or sent."
SCRIPT_ENDED = "The interface below goes on, but a part of what it should have done was left out."


class ErrorView:
    """Items that show errors, one in each window.

    Args:
        engine: The engine of the interface.
        look: The QML file of such an item, with properties ``heading`` and ``text``.
    """

    def __init__(self, engine: QtQml.QQmlEngine, look: Path) -> None:
        self._engine, self._look = engine, look
        self._component: QtQml.QQmlComponent | None = None
        #: The items, while there are errors.
        self.items: list[Any] = []
        self._contents: list[Any] = []

    def show(self, text: str, windows: Iterable[Any], heading: str) -> None:
        """Show errors; others that are shown already go.

        Args:
            text: The errors.
            windows: Where to show them.
            heading: What they mean for what is below.
        """
        self.hide()
        url = QtCore.QUrl.fromLocalFile(str(self._look))
        component = self._component = QtQml.QQmlComponent(self._engine, url)
        for window in windows:
            item: Any = component.create()
            item.setProperty("heading", heading)
            item.setProperty("text", text)
            # PySide2 takes an item for gone as soon as nobody in Python knows what it is in.
            content = window.contentItem()
            item.setParentItem(content)
            self.items.append(item)
            self._contents.append(content)

    def hide(self) -> None:
        """Show none."""
        for item in (*self.items, self._component):
            if is_alive(item):
                item.deleteLater()
        self.items, self._contents, self._component = [], [], None

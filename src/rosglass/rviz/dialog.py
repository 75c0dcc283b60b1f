"""Dialogs over RViz's 3D view: a title to move them by, a content, and buttons."""

from __future__ import annotations

import enum
from typing import Any

from rosglass.errors import Error
from rosglass.qt import Signal
from rosglass.rviz.popup import MoveBar, Popup
from rosglass.rviz.qt5 import QtCore, QtWidgets
from rosglass.rviz.widget_overlay import make_widget

__all__ = ["Button", "Dialog", "message"]


class Button(enum.Flag):
    """Buttons of a dialog."""

    OK = 1
    CANCEL = 2
    YES = 4
    NO = 8
    CLOSE = 16
    APPLY = 32


_TEXTS = {
    Button.OK: "OK",
    Button.CANCEL: "Cancel",
    Button.YES: "Yes",
    Button.NO: "No",
    Button.CLOSE: "Close",
    Button.APPLY: "Apply",
}


class Dialog(Popup):
    """A popup with title and buttons. It hides itself when one is pressed, other than Apply.

    Args:
        title: What its bar shows, by which it is moved.
        content: The widget in it, or what returns it.
        name: Its name among the overlays; the title by default.
        buttons: Which ones it has, from left to right as in :class:`Button`.
        options: Of :class:`Popup`.

    Raises:
        Error: The content is no widget, or there are no buttons.
    """

    #: The :class:`Button` that was pressed.
    clicked = Signal(object)

    def __init__(
        self,
        title: str,
        content: Any,
        name: str = "",
        *,
        buttons: Button = Button.OK,
        **options: Any,
    ) -> None:
        chosen = [button for button in _TEXTS if button in buttons]
        if not chosen:
            raise Error(f"dialog {title!r} needs a button, e.g. Button.OK")
        inner = make_widget(content, name or title)
        frame = QtWidgets.QFrame()
        frame.setFrameShape(QtWidgets.QFrame.StyledPanel)
        bar = MoveBar(title)
        bar.setAlignment(QtCore.Qt.AlignCenter)
        column = QtWidgets.QVBoxLayout(frame)
        row = QtWidgets.QHBoxLayout()
        row.addStretch()
        #: Its buttons.
        self.buttons: dict[Button, Any] = {}
        for button in chosen:
            made = self.buttons[button] = QtWidgets.QPushButton(_TEXTS[button])
            row.addWidget(made)
        column.addWidget(bar)
        column.addWidget(inner)
        column.addLayout(row)
        super().__init__(frame, name or title, **options)
        bar.popup = self
        for button, made in self.buttons.items():
            made.clicked.connect(lambda *_, button=button: self._click(button))

    def _click(self, button: Button) -> None:
        if button is not Button.APPLY:
            self.visible = False
        self.clicked.emit(button)


def message(
    title: str, text: str, name: str = "", *, buttons: Button = Button.OK, **options: Any
) -> Dialog:
    """Return a dialog that shows a text; modal unless `options` say otherwise."""
    label = QtWidgets.QLabel(text)
    label.setTextFormat(QtCore.Qt.PlainText)
    label.setWordWrap(True)
    label.setMinimumWidth(240)
    return Dialog(title, label, name, buttons=buttons, **{"modal": True, **options})

"""Popups and dialogs over RViz's 3D view."""

from __future__ import annotations

import enum
import logging
import math
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qt import Signal, is_alive
from rosglass.rviz.qt5 import QtCore, QtGui, QtWidgets
from rosglass.rviz.widget_overlay import WidgetOverlay, make_widget

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.overlay.trackers import Tracker, Trackers

__all__ = ["Anchor", "Button", "Dialog", "MoveBar", "Popup", "message"]


_log = logging.getLogger("rosglass.rviz")


class Anchor(enum.Enum):
    """The point of a popup that :meth:`Popup.move` positions, in shares of its width and height."""

    TOP_LEFT = (0.0, 0.0)
    TOP_RIGHT = (1.0, 0.0)
    CENTER = (0.5, 0.5)
    BOTTOM_LEFT = (0.0, 1.0)
    BOTTOM_RIGHT = (1.0, 1.0)
    #: The corner that keeps most of the popup inside the view.
    AUTO = (-1.0, -1.0)


class Popup(WidgetOverlay):
    """A widget of its own size, above all overlays that are not popups, and kept inside the view.

    While the point that it follows is outside the view or behind the camera, it is hidden; a modal
    popup is centred instead.

    Args:
        content: The widget, or a function that returns it.
        name: Its name; by default that of the widget's class.
        modal: Whether to block all input to what is below it, including RViz's view.
        modal_color: Colour in which a modal popup covers everything below it.
        anchor: The point of the popup that :meth:`move` positions.
        light_dismiss: Whether a press outside hides the popup; the press then has no other effect.
        options: Options of :class:`WidgetOverlay`.

    Raises:
        Error: `content` is not a widget, or has a parent.
    """

    #: A press outside has hidden the popup.
    dismissed = Signal()

    def __init__(
        self,
        content: Any,
        name: str = "",
        *,
        modal: bool = False,
        modal_color: Any = None,
        anchor: Anchor = Anchor.CENTER,
        light_dismiss: bool = False,
        **options: Any,
    ) -> None:
        made = make_widget(content, name)
        base = _PopupBackground(made, self._position_content, self._on_press_outside)
        self._stale_shade = _StaleShade(base)
        #: The widget.
        self.content: Any = made
        self._anchor, self._position = anchor, (math.nan, math.nan)
        self._centered = True
        self._tracker: Tracker | None = None
        #: The tracker's problem that the popup shows as its own.
        self._tracker_problem = ""
        self._trackers: Trackers | None = None
        self._light_dismiss = light_dismiss
        super().__init__(base, name or type(made).__name__, **options)
        self.is_popup, self.is_modal = True, modal
        base.accepts_presses = modal or light_dismiss
        if modal:
            base.color = QtGui.QColor(modal_color or QtGui.QColor(80, 80, 80, 180))

    @property
    def anchor(self) -> Anchor:
        """The point of the popup that :meth:`move` positions."""
        return self._anchor

    @anchor.setter
    def anchor(self, anchor: Anchor) -> None:
        self._anchor = anchor
        self._position_content()

    @property
    def place(self) -> tuple[float, float]:
        """The anchor's position, in units from the upper left corner of the view."""
        if not self._centered:
            return self._position
        return self.root.width() / 2, self.root.height() / 2

    def move(self, x: float, y: float) -> None:
        """Move the anchor to a position in the view, and stop following a point.

        Args:
            x: Units from the left edge of the view.
            y: Units from the upper edge.

        Raises:
            Error: The position is not finite.
        """
        if not (math.isfinite(x) and math.isfinite(y)):
            raise Error(f"popup {self.name}: ({x:g}, {y:g}) is not a position")
        self._stop_following()
        self._move_to_point(x, y)

    def follow(
        self, trackers: Trackers, point: Sequence[float] = (0, 0, 0), frame: str = ""
    ) -> None:
        """Follow a point of the scene; an unknown frame becomes the popup's `problem`.

        Args:
            trackers: RViz's trackers, ``app.rviz.trackers``.
            point: x, y, z in metres.
            frame: The frame of the point; empty for RViz's fixed frame.

        Raises:
            Error: `point` is not a point.
        """
        tracker = trackers.add(point, frame, lambda: self.scale)
        self._stop_following()
        self._tracker, self._trackers = tracker, trackers
        tracker.positionChanged.connect(lambda at: self._move_to_point(at.x(), at.y()))
        tracker.problemChanged.connect(self._show_tracker_problem)
        tracker.staleChanged.connect(self._on_stale_changed)
        self._show_tracker_problem()
        at: Any = tracker.position
        self._move_to_point(at.x(), at.y())

    def close(self) -> None:
        """Delete the widgets; safe to call twice."""
        self._stop_following()
        super().close()

    def _stop_following(self) -> None:
        tracker, self._tracker = self._tracker, None
        if tracker is not None and self._trackers is not None:
            self._trackers.remove(tracker)
            self._show_tracker_problem()

    def _show_tracker_problem(self) -> None:
        # Keep a problem of another origin.
        before, self._tracker_problem = (
            self._tracker_problem,
            str(self._tracker.problem) if self._tracker else "",
        )
        if self.problem in ("", before):
            self.show_problem(self._tracker_problem)

    def _on_stale_changed(self) -> None:
        if self._tracker is not None and self._tracker.stale:
            # Unlike other overlays, popups have no entry in the panel to show it.
            _log.warning("popup %s: %s", self.name, self._tracker.problem)
        self._position_content()

    def _move_to_point(self, x: float, y: float) -> None:
        self._position, self._centered = (x, y), False
        self._position_content()

    def _position_content(self) -> None:
        """Position the content in the view, by its size and the position of its anchor."""
        content = self.content
        if not is_alive(content):
            return
        x, y = self.place
        room = content.parentWidget().size()
        seen = self._tracker is None or (0 <= x <= room.width() and 0 <= y <= room.height())
        if self.is_modal and not seen:
            # A modal popup blocks all input, so it must stay visible.
            x, y, seen = room.width() / 2, room.height() / 2, True
        content.setVisible(seen)
        self._stale_shade.setVisible(
            seen and self._tracker is not None and bool(self._tracker.stale)
        )
        if not seen:
            return
        size = content.sizeHint().expandedTo(content.minimumSize()).boundedTo(content.maximumSize())
        across, down = self._anchor.value
        if self._anchor is Anchor.AUTO:
            across = float(x + size.width() > room.width())
            down = float(y + size.height() > room.height())
        left = _clamped(x - across * size.width(), room.width() - size.width())
        top = _clamped(y - down * size.height(), room.height() - size.height())
        for part in (content, self._stale_shade):
            part.setGeometry(left, top, size.width(), size.height())

    def _on_press_outside(self) -> None:
        if self._light_dismiss:
            self.visible = False
            self.dismissed.emit()


class _PopupBackground(QtWidgets.QWidget):  # type: ignore[misc]
    """The widget that fills the view around a popup's content."""

    def __init__(self, content: Any, put: Callable[[], None], pressed: Callable[[], None]) -> None:
        super().__init__()
        self._position_content, self._on_press = put, pressed
        self.color: Any = None
        self.accepts_presses = False
        content.setParent(self)
        # Without its own background, the scene would show through between its widgets.
        content.setAutoFillBackground(True)

    def event(self, event: Any) -> bool:
        """Reposition the content when sizes change, and handle presses."""
        kind = event.type()
        if kind in (QtCore.QEvent.Resize, QtCore.QEvent.LayoutRequest, QtCore.QEvent.Show):
            self._position_content()
        if kind == QtCore.QEvent.MouseButtonPress and self.accepts_presses:
            event.accept()
            self._on_press()
            return True
        return bool(super().event(event))

    def paintEvent(self, event: Any) -> None:  # noqa: N802 - Qt's name
        """Paint the colour that covers everything below a modal popup."""
        if self.color is not None:
            QtGui.QPainter(self).fillRect(event.rect(), self.color)


class _StaleShade(QtWidgets.QWidget):  # type: ignore[misc]
    """A grey shade over a popup whose frame is stale; transparent to the mouse."""

    def __init__(self, base: Any) -> None:
        super().__init__(base)
        self.setAttribute(QtCore.Qt.WA_TransparentForMouseEvents)
        self.hide()

    def paintEvent(self, event: Any) -> None:  # noqa: N802 - Qt's name
        """Paint a half-transparent grey."""
        QtGui.QPainter(self).fillRect(event.rect(), QtGui.QColor(128, 128, 128, 150))


class MoveBar(QtWidgets.QLabel):  # type: ignore[misc]
    """A bar inside a popup's content, by which the user drags the popup."""

    def __init__(self, text: str = "") -> None:
        super().__init__(text)
        #: The popup to move.
        self.popup: Popup | None = None
        self._drag_start: Any = None
        self._anchor_start = (0.0, 0.0)
        self.setCursor(QtCore.Qt.SizeAllCursor)

    def mousePressEvent(self, event: Any) -> None:  # noqa: N802 - Qt's name
        """Start dragging."""
        if self.popup is None or event.button() != QtCore.Qt.LeftButton:
            event.ignore()
            return
        across, down = self.popup.anchor.value
        if self.popup.anchor is Anchor.AUTO:
            # The anchor corner must not change while dragging.
            across = down = 0.0
            self.popup.anchor = Anchor.TOP_LEFT
        box = self.popup.content.geometry()
        self._anchor_start = (box.x() + across * box.width(), box.y() + down * box.height())
        self._drag_start = event.screenPos()

    def mouseMoveEvent(self, event: Any) -> None:  # noqa: N802 - Qt's name
        """Move the popup with the mouse."""
        if self._drag_start is not None and self.popup is not None:
            offset = (event.screenPos() - self._drag_start) / self.popup.scale
            self.popup.move(self._anchor_start[0] + offset.x(), self._anchor_start[1] + offset.y())

    def mouseReleaseEvent(self, event: Any) -> None:  # noqa: N802 - Qt's name
        """Stop dragging."""
        del event
        self._drag_start = None


def _clamped(start: float, most: float) -> int:
    return round(max(min(start, most), 0))


class Button(enum.Flag):
    """The buttons of a dialog."""

    OK = 1
    CANCEL = 2
    YES = 4
    NO = 8
    CLOSE = 16
    APPLY = 32


_BUTTON_TEXTS = {
    Button.OK: "OK",
    Button.CANCEL: "Cancel",
    Button.YES: "Yes",
    Button.NO: "No",
    Button.CLOSE: "Close",
    Button.APPLY: "Apply",
}


class Dialog(Popup):
    """A popup with a title bar and buttons; every button except Apply hides it.

    Args:
        title: Text of the bar by which the user drags the dialog.
        content: The widget in it, or a function that returns it.
        name: Its name among the overlays; by default the title.
        buttons: Its buttons, shown from left to right in the order of :class:`Button`.
        options: Options of :class:`Popup`.

    Raises:
        Error: `content` is not a widget, or there are no buttons.
    """

    #: A button was pressed. Argument: the :class:`Button`.
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
        chosen = [button for button in _BUTTON_TEXTS if button in buttons]
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
        #: The dialog's push buttons.
        self.buttons: dict[Button, Any] = {}
        for button in chosen:
            made = self.buttons[button] = QtWidgets.QPushButton(_BUTTON_TEXTS[button])
            row.addWidget(made)
        column.addWidget(bar)
        column.addWidget(inner)
        column.addLayout(row)
        super().__init__(frame, name or title, **options)
        bar.popup = self
        for button, made in self.buttons.items():
            made.clicked.connect(lambda *_, button=button: self._on_clicked(button))

    def _on_clicked(self, button: Button) -> None:
        if button is not Button.APPLY:
            self.visible = False
        self.clicked.emit(button)


def message(
    title: str, text: str, name: str = "", *, buttons: Button = Button.OK, **options: Any
) -> Dialog:
    """Return a dialog that shows a text; modal unless `options` contain ``modal=False``."""
    label = QtWidgets.QLabel(text)
    label.setTextFormat(QtCore.Qt.PlainText)
    label.setWordWrap(True)
    label.setMinimumWidth(240)
    return Dialog(title, label, name, buttons=buttons, **{"modal": True, **options})

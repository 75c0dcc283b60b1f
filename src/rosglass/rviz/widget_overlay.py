"""Qt widgets as overlays on RViz's 3D view."""

from __future__ import annotations

import logging
import math
import os
import re
import weakref
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import Error
from rosglass.overlay.overlay import Overlay
from rosglass.qml.run.modules import locate
from rosglass.qt import Signal, is_alive
from rosglass.rviz.input import DRAG, KEYS, MOUSE, PRESS, position, releases
from rosglass.rviz.overlay import guarded
from rosglass.rviz.qt5 import QtCore, QtGui, QtWidgets
from rosglass.rviz.tiles import Rect

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from rosglass.rviz.window import Window

__all__ = ["Canvas", "StyleSheet", "WidgetOverlay", "make_widget", "read_style_sheet"]


#: Maximum number of rectangles painted individually; more are replaced by their bounding box.
_MAX_RECTS = 12


class Canvas(QtWidgets.QGraphicsView):  # type: ignore[misc]
    """A graphics view that Qt considers visible, but does not show on the screen.

    Only a visible view is notified which part of an item has changed; the scene's own signal
    reports the whole item, here the root widget.
    """

    #: A part has to be painted again.
    stale = Signal()

    def __init__(self, scene: Any, root: Any) -> None:
        super().__init__(scene)
        self._root = root
        #: The frame: array of shape (height, width), each pixel 0xAARRGGBB with premultiplied
        #: colours.
        self.pixels: NDArray[np.uint32] = np.zeros((0, 0), np.uint32)
        self._stale = QtGui.QRegion()
        self._painting = False
        self.setAttribute(QtCore.Qt.WA_DontShowOnScreen)
        self.setAttribute(QtCore.Qt.WA_ShowWithoutActivating)
        # Qt must not keep the program running for this window.
        self.setAttribute(QtCore.Qt.WA_QuitOnClose, False)
        for part in (self, self.viewport()):
            part.setAttribute(QtCore.Qt.WA_OpaquePaintEvent)
            part.setAttribute(QtCore.Qt.WA_NoSystemBackground)
        self.setFocusPolicy(QtCore.Qt.NoFocus)
        self.setInteractive(False)
        self.setFrameShape(QtWidgets.QFrame.NoFrame)
        self.setHorizontalScrollBarPolicy(QtCore.Qt.ScrollBarAlwaysOff)
        self.setVerticalScrollBarPolicy(QtCore.Qt.ScrollBarAlwaysOff)
        self.setAlignment(QtCore.Qt.AlignLeft | QtCore.Qt.AlignTop)
        self.setRenderHint(QtGui.QPainter.Antialiasing)

    def fit(self, width: int, height: int, ratio: float) -> None:
        """Set the size, and mark everything as changed.

        Args:
            width: Width in pixels.
            height: Height in pixels.
            ratio: Pixels per unit of the scene.
        """
        own = self.devicePixelRatioF()
        self.pixels = np.zeros((height, width), np.uint32)
        self.setTransform(QtGui.QTransform.fromScale(ratio / own, ratio / own))
        self.resize(math.ceil(width / own), math.ceil(height / own))
        self.show()
        self._stale = QtGui.QRegion(self.viewport().rect())

    def paintEvent(self, event: Any) -> None:  # noqa: N802 - Qt's
        """Record the region that Qt asks to be painted."""
        if self._painting:
            super().paintEvent(event)
        else:
            self._stale += event.region()
            self.stale.emit()

    def paint(self) -> list[Rect]:
        """Paint the changed parts, and return their rectangles in :attr:`pixels`."""
        everything, own = QtGui.QRegion(self.viewport().rect()), self.devicePixelRatioF()
        stale, self._stale = self._stale & everything, QtGui.QRegion()
        if stale.isEmpty():
            return []
        if own != round(own) or self._shadows_are_larger():
            stale = everything
        elif stale.rectCount() > _MAX_RECTS:
            stale = QtGui.QRegion(stale.boundingRect())
        # Qt rounds the exposed part of widgets, and would omit a row at the edge.
        more = math.ceil(self.transform().m11()) + 1
        around = QtGui.QRegion()
        for rect in stale.rects():
            around += rect.adjusted(-more, -more, more, more)
        picture = _shared_image(self.pixels.shape, own)
        self._render(around & everything, picture)
        words = np.frombuffer(picture.constBits(), np.uint32).reshape(self.pixels.shape)
        rects = [self._in_pixels(rect, own) for rect in stale.rects()]
        for rect in rects:
            area = slice(rect.top, rect.bottom), slice(rect.left, rect.right)
            self.pixels[area] = words[area]
        return rects

    def _render(self, region: Any, picture: Any) -> None:
        # Draw at the original position, which Qt's shadow effects depend on.
        at = region.boundingRect().topLeft()
        painter = QtGui.QPainter(picture)
        painter.setCompositionMode(QtGui.QPainter.CompositionMode_Source)
        painter.fillRect(region.boundingRect(), QtCore.Qt.transparent)
        painter.end()
        self._painting = True
        try:
            self.viewport().render(picture, at, region, QtWidgets.QWidget.RenderFlags())
        finally:
            self._painting = False

    def _shadows_are_larger(self) -> bool:
        """Return whether effects may exceed the regions that Qt reports: it does not scale them."""
        if self.transform().m11() >= 1:
            return False
        return self._root.findChild(QtWidgets.QGraphicsEffect) is not None

    def _in_pixels(self, rect: Any, own: float) -> Rect:
        height, width = self.pixels.shape
        return Rect(
            math.floor(rect.left() * own),
            math.floor(rect.top() * own),
            min(math.ceil((rect.left() + rect.width()) * own), width),
            min(math.ceil((rect.top() + rect.height()) * own), height),
        )


@lru_cache(maxsize=1)
def _shared_image(shape: tuple[int, int], ratio: float) -> Any:
    """Return the intermediate image that all canvases of a size share."""
    picture = QtGui.QImage(shape[1], shape[0], QtGui.QImage.Format_ARGB32_Premultiplied)
    picture.setDevicePixelRatio(ratio)
    return picture


_log = logging.getLogger("rosglass.rviz")
_URL = re.compile(r"""url\(\s*(["']?)([^"')]+)\1\s*\)""")
_MAX_BYTES = 1 << 20
#: Milliseconds to wait after a change of the file, because editors write in several steps.
_DEBOUNCE_MS = 80


def read_style_sheet(source: str) -> tuple[str, Path | None]:
    """Return a style sheet and its file; None as the file for a literal style sheet.

    Args:
        source: Path of a ``.qss`` file, ``package://package/file.qss``, or a literal style sheet.
            In a file, relative ``url()`` are relative to its folder.

    Raises:
        Error: The file is missing, too large or not UTF-8, or the braces do not match.
    """
    if "{" in source or not source.strip():
        _check(source, "style sheet")
        return source, None
    path = locate(source.strip())
    try:
        size = path.stat().st_size
        if size > _MAX_BYTES:
            raise Error(f"style sheet {path}: {size} bytes are more than a megabyte")
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise Error(f"style sheet {source}: {why}") from None
    _check(text, f"style sheet {path}")
    return _URL.sub(lambda match: _absolute(match, path.parent), text), path


def _absolute(match: re.Match[str], folder: Path) -> str:
    url = match[2].strip()
    if url.startswith(":") or os.path.isabs(url):  # noqa: PTH117 - a URL, no path
        return match[0]
    if url.startswith("package://"):
        return f'url("{locate(url)}")'
    return f'url("{folder / url}")'


def _check(text: str, what: str) -> None:
    """Raise an Error for unbalanced braces, which Qt would only print."""
    bare = re.sub(r"/\*.*?\*/", lambda m: "\n" * m[0].count("\n"), text, flags=re.DOTALL)
    depth = 0
    for number, line in enumerate(bare.split("\n"), 1):
        for letter in line:
            depth += (letter == "{") - (letter == "}")
            if depth not in (0, 1):
                raise Error(f"{what}:{number}: this {letter!r} has no matching brace")
    if depth:
        raise Error(f"{what}: the last '{{' is not closed")


class StyleSheet(QtCore.QObject):  # type: ignore[misc]
    """The style sheet of an overlay, reloaded when its file changes.

    Args:
        name: Name of the overlay, for log messages.
        use: Called with the text of the style sheet.
        failed: Called with the error text.
    """

    def __init__(
        self, name: str, use: Callable[[str], None], failed: Callable[[str], None]
    ) -> None:
        super().__init__()
        self._name, self._use, self._failed = name, use, failed
        #: The path, URL or literal style sheet, as given.
        self.source = ""
        #: Whether the file is watched.
        self.watch = False
        self._path: Path | None = None
        self._watcher: Any = None
        self._debounce_timer = QtCore.QTimer()
        self._debounce_timer.setSingleShot(True)
        self._debounce_timer.setInterval(_DEBOUNCE_MS)
        self._debounce_timer.timeout.connect(self._read)

    def use(self, source: str, *, watch: bool = False, strict: bool = False) -> None:
        """Use another style sheet.

        Args:
            source: See :func:`read_style_sheet`.
            watch: Whether to reload the file when it changes.
            strict: Whether to raise errors instead of reporting them.

        Raises:
            Error: Only if `strict`.
        """
        self.source, self.watch = source, watch
        self._stop_watching()
        self._read(strict=strict)
        if watch and self._path is not None:
            # Many editors replace the file, which changes its folder.
            self._watcher = QtCore.QFileSystemWatcher([str(self._path), str(self._path.parent)])
            self._watcher.fileChanged.connect(self._read_later)
            self._watcher.directoryChanged.connect(self._read_later)

    def _read_later(self, path: str) -> None:
        del path
        self._debounce_timer.start()

    def _read(self, *, strict: bool = False) -> None:
        try:
            text, self._path = read_style_sheet(self.source)
        except Error as error:
            if strict:
                raise
            _log.error("overlay %s: %s", self._name, error)
            self._failed(str(error))
            return
        if self._watcher is not None and str(self._path) not in self._watcher.files():
            self._watcher.addPath(str(self._path))
        self._use(text)

    def _stop_watching(self) -> None:
        watcher, self._watcher = self._watcher, None
        if watcher is not None:
            watcher.deleteLater()

    def close(self) -> None:
        """Stop watching the file."""
        self._debounce_timer.stop()
        self._stop_watching()


_E = QtCore.QEvent
#: Dynamic property of widgets that, with their children, leave wheel events to lower overlays.
IGNORE_WHEEL = "IgnoreWheelEvents"
_OTHER_EVENTS = frozenset({_E.Wheel, _E.ContextMenu, _E.ToolTip, _E.DragLeave})
#: Qt classes that handle context menu events without a menu.
_CLASSES_WITHOUT_MENU = (QtWidgets.QWidget, QtWidgets.QAbstractScrollArea, QtWidgets.QMainWindow)
_INPUT_METHOD = frozenset({_E.InputMethod, _E.InputMethodQuery})


class WidgetOverlay(Overlay):
    """A widget that covers RViz's 3D view, with a transparent background.

    Pass the widget or a function that creates it, or derive from this class and fill an empty
    widget in :meth:`setup`. Labels, frames and empty areas leave the mouse to RViz.

    Args:
        widget: The widget, without a parent, or a function that returns it.
        name: Its name; by default that of the widget's class.
        style_sheet: A ``.qss`` file, ``package://package/file.qss``, or a literal style sheet.
        watch: Whether to reload the style sheet when its file changes.
        options: Options of :class:`Overlay`.

    Raises:
        Error: `widget` is not a widget, has a parent or is shown by another overlay, or the style
            sheet cannot be read.
    """

    def __init__(
        self, widget: Any = None, name: str = "", *, style_sheet: str = "", watch: bool = False,
        **options: Any,
    ) -> None:  # fmt: skip
        made = make_widget(widget, name)
        own = type(self).__name__ if widget is None else type(made).__name__
        super().__init__(name or own, **options)
        #: The widget that fills the view.
        self.root: Any = made
        # Lets errors in the widget's code become the problem of this overlay.
        made.rosglass_overlay = weakref.ref(self)
        made.setAttribute(QtCore.Qt.WA_TranslucentBackground)
        self._buttons = QtCore.Qt.NoButton
        self._mouse_position: Any = None
        self._focus_before: Any = None
        self._popups_open = self._focused = False
        self._panel: Any = None
        self._scene = QtWidgets.QGraphicsScene()
        self._view = _HiddenView(self._scene)
        self._canvas = Canvas(self._scene, made)
        self._canvas.stale.connect(self.changed)
        # Not the scene's `changed`: once that is connected, Qt repaints whole items.
        self._canvas.stale.connect(self._update_popups)
        self._proxy = self._scene.addWidget(made)
        # Otherwise Qt always paints the whole widget.
        self._proxy.setFlag(QtWidgets.QGraphicsItem.ItemUsesExtendedStyleOption)
        # Widgets of an inactive window neither show nor handle the keyboard focus.
        QtCore.QCoreApplication.sendEvent(self._scene, QtCore.QEvent(_E.WindowActivate))
        self._style = StyleSheet(self.name, self._use_style, self.show_problem)
        if widget is None:
            self.setup(made)
            _show_children(made)
        if style_sheet:
            self._style.use(style_sheet, watch=watch, strict=True)

    def setup(self, root: Any) -> None:
        """Fill the empty root widget, e.g. with a layout; for derived classes."""

    @property
    def style_sheet(self) -> str:
        """The style sheet: a ``.qss`` file, a ``package://`` URL, or a literal style sheet.

        If it cannot be read, the error is logged and becomes the :attr:`problem`, and the old style
        sheet stays.
        """
        return self._style.source

    @style_sheet.setter
    def style_sheet(self, source: str) -> None:
        self._style.use(source, watch=self._style.watch)

    def _use_style(self, text: str) -> None:
        if is_alive(self.root):
            self.root.setStyleSheet(text)
            self.show_problem("")

    # Drawing

    def resize(self, width: int, height: int, ratio: float) -> None:
        """Set the size of the widget."""
        units = QtCore.QRectF(0, 0, width / ratio, height / ratio)
        with guarded(self, "changing its size"):
            self._scene.setSceneRect(units)
            self._view.fit(units)
            self._proxy.setGeometry(units)
        self._canvas.fit(width, height, ratio)

    def draw(self) -> NDArray[np.uint32] | None:
        """Paint the changed parts."""
        if not is_alive(self._scene):
            return None
        with guarded(self, "painting"):
            self.painted = self._canvas.paint()
        return self._canvas.pixels if self.painted else None

    # Input

    def attach(self, window: Window) -> None:
        """Connect to RViz's window."""
        self._panel = window.panel

    def deliver(self, event: Any) -> bool:
        """Send an event to the widget under the mouse or with the keyboard focus."""
        kind = event.type()
        if not is_alive(self._scene):
            return False
        if kind in KEYS or kind in _INPUT_METHOD:
            return self._deliver_key(event)
        if kind not in MOUSE and kind not in DRAG and kind not in _OTHER_EVENTS:
            return False
        if kind == _E.ContextMenu and event.reason() == QtGui.QContextMenuEvent.Keyboard:
            return self._open_menu_by_key(event)
        at = position(event)
        if at is not None:
            self._mouse_position = at
            self._view.align_with_screen(event, at)
        if kind == _E.Wheel and _has_parent_with(self._widget_at(at), _ignores_wheel):
            return False
        opened = bool(self._popups())
        if kind in PRESS and not opened:
            _focus_clicked(self._widget_at(at))
        self._remember_focus(opened)
        taken = self._view.send(event)
        if not is_alive(self._scene):
            return taken
        if kind in PRESS:
            # Qt marks presses as accepted even if no widget uses them. A press outside of a popup
            # closes it.
            taken = opened or self._scene.mouseGrabberItem() is not None
            # A context menu opens with the event after the press.
            opens_menu = event.button() == QtCore.Qt.RightButton
            taken = taken or (opens_menu and _has_parent_with(self._widget_at(at), _has_menu))
        if kind in MOUSE:
            self._buttons = event.buttons() if taken or kind not in PRESS else self._buttons
        if kind == _E.MouseMove and event.buttons() == QtCore.Qt.NoButton:
            # Accept moves while a popup is open: Qt closes it when the mouse leaves the scene.
            taken = opened or _has_parent_with(self._widget_at(at), _handles_hover)
        return taken

    def _deliver_key(self, event: Any) -> bool:
        receiver = self._focus_widget()
        self._remember_focus(bool(self._popups()))
        event.setAccepted(False)
        if event.type() in (_E.KeyPress, _E.KeyRelease):
            self._align_with_focus(receiver)
            QtCore.QCoreApplication.sendEvent(self._scene, event)
        elif receiver is not None:
            QtCore.QCoreApplication.sendEvent(receiver, event)
        return bool(event.isAccepted())

    def _open_menu_by_key(self, event: Any) -> bool:
        receiver = self._focus_widget()
        if receiver is None:
            return False
        self._align_with_focus(receiver)
        at = receiver.inputMethodQuery(QtCore.Qt.ImCursorRectangle)
        at = at.center() if isinstance(at, QtCore.QRect) else receiver.rect().center()
        made = QtGui.QContextMenuEvent(event.reason(), at, receiver.mapToGlobal(at))
        made.setAccepted(False)
        QtCore.QCoreApplication.sendEvent(receiver, made)
        return bool(made.isAccepted())

    def _focus_widget(self) -> Any:
        """Return the widget with the keyboard focus; None if there is none."""
        shown = _as_proxy(self._scene.focusItem())
        return None if shown is None else shown.widget().focusWidget() or shown.widget()

    def _remember_focus(self, opened: bool) -> None:
        """Remember the focus widget before a popup opens, because Qt does not restore it."""
        if not opened:
            self._focus_before = self._focus_widget() or self._focus_before

    def _align_with_focus(self, receiver: Any) -> None:
        """Align the view with the screen at a widget, so that menus opened by key appear there."""
        if receiver is not None and is_alive(self._panel):
            shown = receiver.window().graphicsProxyWidget()
            middle = receiver.mapTo(receiver.window(), receiver.rect().center())
            at = shown.mapToScene(QtCore.QPointF(middle))
            seen = self._panel.mapToGlobal((at * self.scale).toPoint())
            self._view.move(seen - at.toPoint())

    def leave(self) -> None:
        """End hovering, and cancel presses."""
        if not is_alive(self._scene):
            return
        viewport = self._view.viewport()
        held, self._buttons = self._buttons, QtCore.Qt.NoButton
        for event in releases(held):
            if is_alive(self._scene):
                QtCore.QCoreApplication.sendEvent(viewport, event)
        if not is_alive(self._scene):
            return
        self._mouse_position = None
        QtCore.QCoreApplication.sendEvent(viewport, QtCore.QEvent(_E.Leave))

    def set_focus(self, focus: bool) -> None:
        """Give the keyboard focus to the widget that had it last, or take it away."""
        self._focused = focus
        if is_alive(self._scene):
            event = QtGui.QFocusEvent(_E.FocusIn if focus else _E.FocusOut)
            QtCore.QCoreApplication.sendEvent(self._scene, event)

    def cursor(self) -> Any:
        """Return the cursor of the widget under the mouse; None for the default one."""
        widget = None if self._mouse_position is None else self._widget_at(self._mouse_position)
        if widget is None or widget.cursor().shape() == QtCore.Qt.ArrowCursor:
            return None
        return widget.cursor()

    def _popups(self) -> list[Any]:
        """Return the open menus and combo box lists."""
        windows = QtWidgets.QApplication.topLevelWidgets()
        opened = [w for w in windows if w.windowType() == QtCore.Qt.Popup and w.isVisible()]
        embedded = [w for w in opened if w.graphicsProxyWidget() is not None]
        return [w for w in embedded if w.graphicsProxyWidget().scene() is self._scene]

    def _update_popups(self, *_: Any) -> None:
        """Keep popups inside the 3D view, and restore the focus when the last one closes."""
        popups = self._popups()
        opened, self._popups_open = self._popups_open, bool(popups)
        if popups:
            self._fit(popups)
        elif opened and self._focused and is_alive(self._focus_before):
            holder = self._focus_widget()
            if holder is None or holder.window() is not self.root:
                self._focus_before.setFocus(QtCore.Qt.PopupFocusReason)

    def _fit(self, popups: list[Any]) -> None:
        # Qt has fitted them to the screen instead.
        room = self._scene.sceneRect()
        for popup in popups:
            shown, opener = popup.graphicsProxyWidget(), popup.parentWidget()
            box = shown.mapRectToScene(shown.rect())
            fit = QtCore.QRectF(box.topLeft(), box.size().boundedTo(room.size()))
            if fit.left() < 0 and opener in popups:
                # Move a submenu to the other side of its menu.
                menu = opener.graphicsProxyWidget()
                fit.moveLeft(menu.mapRectToScene(menu.rect()).right())
            fit.moveLeft(max(0.0, min(fit.left(), room.width() - fit.width())))
            fit.moveTop(max(0.0, min(fit.top(), room.height() - fit.height())))
            if fit != box:
                shown.setGeometry(
                    QtCore.QRectF(shown.pos() + fit.topLeft() - box.topLeft(), fit.size())
                )

    def _widget_at(self, at: Any) -> Any:
        item = _as_proxy(self._scene.itemAt(at, QtGui.QTransform()))
        top = None if item is None else item.widget()
        if top is None:
            return None
        return top.childAt(item.mapFromScene(at).toPoint()) or top

    def close(self) -> None:
        """Delete the widgets; safe to call twice."""
        self._style.close()
        if is_alive(self._scene):
            self._canvas.stale.disconnect(self.changed)
            self._canvas.stale.disconnect(self._update_popups)
            self._canvas.setScene(None)
            self._canvas.deleteLater()
            self._view.setScene(None)
            self._scene.deleteLater()
            self._view.deleteLater()


class _HiddenView(QtWidgets.QGraphicsView):  # type: ignore[misc]
    """A hidden graphics view that converts widget events to scene events."""

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.setFrameShape(QtWidgets.QFrame.NoFrame)
        self.setHorizontalScrollBarPolicy(QtCore.Qt.ScrollBarAlwaysOff)
        self.setVerticalScrollBarPolicy(QtCore.Qt.ScrollBarAlwaysOff)
        self.setAlignment(QtCore.Qt.AlignLeft | QtCore.Qt.AlignTop)
        self.viewport().setMouseTracking(True)

    def fit(self, units: Any) -> None:
        """Set the size to that of the scene."""
        size = units.size().toSize()
        self.resize(size)
        # Qt does not lay out hidden widgets.
        self.viewport().resize(size)

    def send(self, event: Any) -> bool:
        """Send an event to the scene; return whether it is accepted."""
        event.setAccepted(False)
        if event.type() in DRAG or event.type() == _E.DragLeave:
            # QApplication sends drag events to the widget under the cursor, not to the hidden view.
            self.viewportEvent(event)
        else:
            QtCore.QCoreApplication.sendEvent(self.viewport(), event)
        return bool(event.isAccepted())

    def align_with_screen(self, event: Any, at: Any) -> None:
        """Move the view so that the event's screen position matches its position in the view."""
        kind = event.type()
        if kind in MOUSE:
            seen = event.screenPos().toPoint()
        elif kind == _E.Wheel:
            seen = event.globalPosition().toPoint()
        elif kind in (_E.ContextMenu, _E.ToolTip):
            seen = event.globalPos()
        else:
            seen = QtGui.QCursor.pos()
        self.move(seen - at.toPoint())


def make_widget(widget: Any, name: str) -> Any:
    """Return the widget of an overlay.

    Args:
        widget: The widget, a function that returns it, or None for an empty one.
        name: Name of the overlay, for errors.

    Raises:
        Error: It is not a widget, has a parent, or is shown by another overlay.
    """
    if widget is None:
        return QtWidgets.QWidget()
    made = widget
    if not isinstance(made, QtWidgets.QWidget) and callable(made):
        made = made()
    if not isinstance(made, QtWidgets.QWidget):
        raise Error(
            f"overlay {name or widget!r}: {made!r} is not a QWidget of PySide2; pass one, or a "
            "function that returns one"
        )
    if made.parentWidget() is not None:
        raise Error(f"overlay {name or made!r}: the widget has a parent; pass one without a parent")
    if made.graphicsProxyWidget() is not None:
        raise Error(f"overlay {name or made!r}: another overlay shows the widget already")
    return made


def _show_children(root: Any) -> None:
    """Show the children of a visible widget, except for explicitly hidden ones."""
    shown_on_purpose = QtCore.Qt.WA_WState_ExplicitShowHide
    for child in root.children():
        if (
            child.isWidgetType()
            and not child.isWindow()
            and not child.testAttribute(shown_on_purpose)
        ):
            child.show()


def _as_proxy(item: Any) -> Any:
    """Return a scene item as a QGraphicsProxyWidget; None if it is not one."""
    found = None if item is None else item.toGraphicsObject()
    return found if isinstance(found, QtWidgets.QGraphicsProxyWidget) else None


def _focus_clicked(widget: Any) -> None:
    """Focus a widget, or its first parent, that accepts focus by a click.

    Qt does this only for events from the window system.
    """
    while widget is not None:
        if widget.isEnabled() and widget.focusPolicy() & QtCore.Qt.ClickFocus:
            widget.setFocus(QtCore.Qt.MouseFocusReason)
            return
        widget = widget.parentWidget()


def _has_parent_with(widget: Any, predicate: Callable[[Any], bool]) -> bool:
    """Return whether a predicate is true for a widget or one of its parents."""
    while widget is not None:
        if predicate(widget):
            return True
        widget = widget.parentWidget()
    return False


def _has_menu(widget: Any) -> bool:
    """Return whether the right mouse button opens a menu of a widget."""
    policy = widget.contextMenuPolicy()
    if policy == QtCore.Qt.ActionsContextMenu:
        return bool(widget.actions())
    if policy == QtCore.Qt.DefaultContextMenu:
        classes = (c for c in type(widget).__mro__ if c not in _CLASSES_WITHOUT_MENU)
        return any("contextMenuEvent" in vars(c) for c in classes)
    return bool(policy == QtCore.Qt.CustomContextMenu)


def _ignores_wheel(widget: Any) -> bool:
    return bool(widget.property(IGNORE_WHEEL))


def _handles_hover(widget: Any) -> bool:
    return bool(
        widget.hasMouseTracking()
        or widget.testAttribute(QtCore.Qt.WA_Hover)
        or widget.focusPolicy() != QtCore.Qt.NoFocus
        or widget.testAttribute(QtCore.Qt.WA_SetCursor)
    )

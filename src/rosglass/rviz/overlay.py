"""The base class of overlays, their classes in ``.rviz`` files, and what guards RViz from them."""

from __future__ import annotations

import contextlib
import logging
import math
import re
import sys
import threading
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.errors import Error
from rosglass.qt import QtCore, Signal, is_alive
from rosglass.rviz.qt5 import QtWidgets
from rosglass.rviz.registered_properties import RegisteredProperties

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import TracebackType

    import numpy as np
    from numpy.typing import NDArray

    from rosglass.qt import QtGui
    from rosglass.rviz.tiles import Rect
    from rosglass.rviz.window import Window

__all__ = [
    "QML_CLASS",
    "REFERENCE_QML_CLASS",
    "SCALES",
    "Overlay",
    "class_id_of",
    "guarded",
    "log_uncaught_errors",
    "maker_of",
    "register",
]


#: The smallest and the largest scale of an overlay.
SCALES = (0.1, 10.0)


class Overlay(QtCore.QObject):
    """Something drawn over RViz's 3D view, which may take part of its mouse and keys.

    Derive from it to draw with anything: give :meth:`draw` and, where it is to be operated,
    :meth:`deliver`. Everything runs in the GUI thread; errors are logged, and RViz
    goes on.

    Args:
        name: Its name among the overlays of an RViz.
        z: Overlays of higher `z` are above those of lower; among equals, the later one.
        scale: How many pixels of the 3D view one unit of the overlay takes, 0.1 to 10.
        opacity: From 0 (nothing is seen) to 1.

    Raises:
        Error: A number is out of its range, or the name is empty.
    """

    #: What it shows is to be drawn again.
    changed = Signal()
    #: `z`, `scale`, `opacity` or `visible` is another now.
    arranged = Signal()
    #: Something else is in its place, which has neither the mouse nor the keys; itself.
    renewed = Signal(object)
    #: Something is wrong with it, or no longer, if empty.
    problem_changed = Signal(str)

    def __init__(self, name: str, *, z: int = 0, scale: float = 1.0, opacity: float = 1.0) -> None:
        super().__init__()
        if not name:
            raise Error("an overlay needs a name, e.g. 'Dashboard'")
        self.name = name
        #: What it lets be set in RViz's Displays panel, and kept with RViz's config.
        self.properties = RegisteredProperties()
        self._z, self._scale, self._opacity, self._visible = 0, 1.0, 1.0, True
        self._problem = ""
        #: Above all overlays that are no popups.
        self.is_popup = False
        #: While it is shown, nothing below it gets any input, RViz's view included.
        self.is_modal = False
        #: Seconds of the last :meth:`draw` that went into reading back what OpenGL drew.
        self.read_back = 0.0
        #: Where the last :meth:`draw` has painted, if that is known; None for anywhere.
        self.painted: list[Rect] | None = None
        self.z, self.scale, self.opacity = z, scale, opacity

    @property
    def z(self) -> int:
        """Its order: overlays of higher values are above those of lower."""
        return self._z

    @z.setter
    def z(self, z: int) -> None:
        if not isinstance(z, int):
            raise Error(f"overlay {self.name}: z must be a whole number, e.g. 1, got {z!r}")
        self._z = z
        self.arranged.emit()

    @property
    def scale(self) -> float:
        """Pixels of the 3D view for one unit."""
        return self._scale

    @scale.setter
    def scale(self, scale: float) -> None:
        if not (_is_number(scale) and SCALES[0] <= scale <= SCALES[1]):
            raise Error(f"overlay {self.name}: scale {scale!r} is not a number from 0.1 to 10")
        self._scale = scale
        self.arranged.emit()

    @property
    def opacity(self) -> float:
        """From 0 (nothing is seen) to 1."""
        return self._opacity

    @opacity.setter
    def opacity(self, opacity: float) -> None:
        if not (_is_number(opacity) and 0 <= opacity <= 1):
            raise Error(f"overlay {self.name}: opacity {opacity!r} is not a number from 0 to 1")
        self._opacity = opacity
        self.arranged.emit()

    @property
    def visible(self) -> bool:
        """Whether it is shown; what is not shown gets no input either."""
        return self._visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        if visible != self._visible:
            self._visible = visible
            self.arranged.emit()

    @property
    def problem(self) -> str:
        """What is wrong with it; empty when nothing is."""
        return self._problem

    def tell_problem(self, problem: str) -> None:
        """Say what is wrong with it, or that nothing is, with an empty text."""
        if problem != self._problem:
            self._problem = problem
            self.problem_changed.emit(problem)

    def attach(self, window: Window) -> None:
        """Called first, with the RViz that it is shown over."""

    def _missing(self, method: str) -> str:
        return f"overlay {self.name}: its class {type(self).__name__} has to give {method}"

    def resize(self, width: int, height: int, ratio: float) -> None:
        """Fit it to the 3D view.

        Args:
            width: Pixels that :meth:`draw` is to draw.
            height: Pixels.
            ratio: Pixels for one unit of the overlay, its scale and the screen's pixel ratio in it.
        """
        raise NotImplementedError(self._missing("resize(width, height, ratio)"))

    def draw(self) -> NDArray[np.uint32] | None:
        """Return what is to be seen, or None for the same as before.

        Returns:
            Array of shape (height, width) as :meth:`resize` asked for, each pixel 0xAARRGGBB with
            premultiplied colours. It is read before the next call.
        """
        raise NotImplementedError(self._missing("draw()"))

    def deliver(self, event: QtCore.QEvent) -> bool:
        """Handle an event of the mouse, of touch or of the keyboard.

        Args:
            event: Its positions are in units of the overlay.

        Returns:
            Whether it was for this overlay; otherwise overlays below and RViz get it.
        """
        del event
        return False

    def leave(self) -> None:
        """Called when the mouse has left it, and a press has ended without effect."""

    def set_focus(self, focus: bool) -> None:
        """Called when it gets or loses the keyboard focus."""

    def cursor(self) -> QtGui.QCursor | None:
        """Return the mouse's shape over it now; None where it is RViz's."""
        return None

    def close(self) -> None:
        """Release everything; safe to call twice."""


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and math.isfinite(value)


_T = TypeVar("_T", bound="type[Overlay]")
#: Class id of a QML file.
QML_CLASS = "rosglass/QmlOverlay"
#: What hector_rviz_overlay calls it.
REFERENCE_QML_CLASS = "hector_rviz_overlay_controls/QmlOverlay"
_CLASS_ID = re.compile(r"[A-Za-z_]\w*/[A-Za-z_]\w*\Z", re.ASCII)
_makers: dict[str, Callable[[str], Overlay]] = {}
_ids: dict[type[Any], str] = {}


def register(kind: _T, class_id: str = "", make: Callable[[str], Overlay] | None = None) -> _T:
    """Register a class of overlays, so that a ``.rviz`` file restores them; also as a decorator.

    Do it before the file is loaded.

    Args:
        kind: The class.
        class_id: Its name in files, e.g. ``my_robot/Gauges``; the Python package and the class by
            default.
        make: Returns a new one of a name; the class itself, called with the name, by default.

    Raises:
        Error: It is no class of overlays, or the class id is taken or not valid.
    """
    if not isinstance(kind, type) or not issubclass(kind, Overlay):
        raise Error(f"{kind!r:.80} is no class derived from rosglass.rviz.Overlay")
    name = class_id or _own_id(kind)
    if not _CLASS_ID.match(name):
        raise Error(f"the class id {name!r} is not of the form package/Class")
    taken = next((one for one, taken in _ids.items() if taken == name and one is not kind), None)
    if name in {QML_CLASS, REFERENCE_QML_CLASS} or taken is not None:
        whose = taken.__qualname__ if taken is not None else "QML files"
        raise Error(f"the class id {name!r} is that of {whose}; give another one")
    _makers[name] = make or (lambda overlay_name: kind(name=overlay_name))
    _ids[kind] = name
    return kind


def class_id_of(kind: type[Overlay]) -> str:
    """Return the class id of a class, registered or not."""
    return _ids.get(kind) or _own_id(kind)


def maker_of(class_id: str) -> Callable[[str], Overlay] | None:
    """Return what makes an overlay of a class id; None for ids that are not registered."""
    return _makers.get(class_id)


def _own_id(kind: type[Any]) -> str:
    package = kind.__module__.partition(".")[0]
    if package == "__main__":
        package = re.sub(r"\W", "_", Path(sys.argv[0] or "program").stem, flags=re.ASCII)
    return f"{package}/{kind.__name__}"


_log = logging.getLogger("rosglass.rviz")
#: Names of variables that may hold the overlay that a function belongs to, the best first.
_OWNER_NAMES = ("self", "overlay", "panel", "popup", "dialog", "root", "widget")


@contextlib.contextmanager
def guarded(overlay: Overlay, doing: str) -> Iterator[None]:
    """Catch what an overlay raises, in its methods, slots and paint events, and log it.

    Args:
        overlay: Whose code runs.
        doing: What it does, e.g. ``drawing``.
    """
    last = ""

    def report(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        nonlocal last
        # An open menu runs an event loop of its own, with everything else in it.
        owner = _owner(trace) or overlay
        text = f"{_describe(kind, error, trace)} (while {doing})"
        if text != last:
            _report(owner, text, (kind, error, trace))
        last = text

    before = sys.excepthook
    # Qt's bindings hand to it what is raised in virtual functions and slots.
    sys.excepthook = report
    try:
        yield
    except Exception as error:
        report(type(error), error, error.__traceback__)
    finally:
        sys.excepthook = before


def log_uncaught_errors() -> Callable[[], None]:
    """Log exceptions of slots and virtual functions, for which PyQt5 would abort the process.

    It becomes the problem of the overlay that the traceback points to. A hook of the program's own
    is called as well.

    Returns:
        Ends it.
    """
    before = sys.excepthook

    def report(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        owner = _owner(trace)
        if owner is not None:
            _report(owner, _describe(kind, error, trace), (kind, error, trace))
        if before is not sys.__excepthook__:
            before(kind, error, trace)
        elif owner is None:
            _log.error("%s", _describe(kind, error, trace), exc_info=(kind, error, trace))

    sys.excepthook = report

    def end() -> None:
        if sys.excepthook is report:
            sys.excepthook = before

    return end


def _report(overlay: Overlay, text: str, raised: Any) -> None:
    # What is drawn anew raises anew with each frame, and a timer each time.
    level = logging.DEBUG if text == overlay.problem else logging.ERROR
    _log.log(level, "overlay %s: %s", overlay.name, text, exc_info=raised)
    overlay.tell_problem(text)


def _describe(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> str:
    try:
        frames = traceback.extract_tb(trace)
    except RecursionError:
        # There is no room left to look at it.
        frames = traceback.StackSummary()
    place = f"{frames[-1].filename}:{frames[-1].lineno}: " if frames else ""
    return f"{place}{kind.__name__}: {error}"


def _owner(trace: TracebackType | None) -> Overlay | None:
    """Return the overlay whose code has raised: the innermost one that a function knows."""
    found: Overlay | None = None
    while trace is not None and threading.current_thread() is threading.main_thread():
        known = trace.tb_frame.f_locals
        for name in _OWNER_NAMES:
            owner = _overlay_of(known.get(name))
            if owner is not None:
                found = owner
                break
        trace = trace.tb_next
    return found


def _overlay_of(thing: object) -> Overlay | None:
    """Return an overlay itself, or the one that shows a widget."""
    if isinstance(thing, Overlay):
        return thing if is_alive(thing) and hasattr(thing, "name") else None
    widget: Any = thing
    while isinstance(widget, QtWidgets.QWidget) and is_alive(widget):
        shown_by = getattr(widget, "rosglass_overlay", None)
        if shown_by is not None:
            return _overlay_of(shown_by())
        widget = widget.parentWidget()
    return None

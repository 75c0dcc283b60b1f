"""RViz goes on whatever is raised: it is told in the log, and as the problem of its overlay."""

from __future__ import annotations

import contextlib
import logging
import sys
import threading
import traceback
from typing import TYPE_CHECKING, Any

from rosglass.qt import is_alive
from rosglass.rviz.overlay import Overlay
from rosglass.rviz.qt5 import QtWidgets

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import TracebackType

__all__ = ["guarded", "log_what_is_raised"]

_log = logging.getLogger("rosglass.rviz")
#: Names by which a function may know the overlay that it was written for, the most telling first.
_OWN = ("self", "overlay", "panel", "popup", "dialog", "root", "widget")


@contextlib.contextmanager
def guarded(overlay: Overlay, doing: str) -> Iterator[None]:
    """Keep what an overlay raises, itself or in a slot or paintEvent of its own, from going on.

    Args:
        overlay: Whose code runs.
        doing: What it does, e.g. ``drawing``.
    """
    last = ""

    def tell(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        nonlocal last
        # A menu that is open runs everything else meanwhile.
        owner = _owner(trace) or overlay
        text = f"{_what(kind, error, trace)} (while {doing})"
        if text != last:
            _tell(owner, text, (kind, error, trace))
        last = text

    before = sys.excepthook
    # Qt's bindings hand to it what is raised in virtual functions and slots.
    sys.excepthook = tell
    try:
        yield
    except Exception as error:
        tell(type(error), error, error.__traceback__)
    finally:
        sys.excepthook = before


def log_what_is_raised() -> Callable[[], None]:
    """Keep PyQt5 from aborting the process when something raises in a slot or virtual function.

    It is the problem of the overlay that it belongs to, where the traceback tells. A hook that the
    program has of its own hears of everything, too.

    Returns:
        Ends it.
    """
    before = sys.excepthook

    def tell(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        owner = _owner(trace)
        if owner is not None:
            _tell(owner, _what(kind, error, trace), (kind, error, trace))
        if before is not sys.__excepthook__:
            before(kind, error, trace)
        elif owner is None:
            _log.error("%s", _what(kind, error, trace), exc_info=(kind, error, trace))

    sys.excepthook = tell

    def end() -> None:
        if sys.excepthook is tell:
            sys.excepthook = before

    return end


def _tell(overlay: Overlay, text: str, raised: Any) -> None:
    # What is drawn anew raises anew with each frame, and a timer each time.
    level = logging.DEBUG if text == overlay.problem else logging.ERROR
    _log.log(level, "overlay %s: %s", overlay.name, text, exc_info=raised)
    overlay.tell_problem(text)


def _what(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> str:
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
        for name in _OWN:
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

"""Overlays over RViz: their class ids in ``.rviz`` files, and the logging of their errors."""

from __future__ import annotations

import contextlib
import logging
import re
import sys
import threading
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.errors import Error
from rosglass.overlay.overlay import Overlay
from rosglass.qt import is_alive
from rosglass.rviz.qt5 import QtWidgets

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import TracebackType

__all__ = [
    "QML_CLASS",
    "REFERENCE_QML_CLASS",
    "class_id_of",
    "factory_of",
    "guarded",
    "log_uncaught_errors",
    "register",
]


_T = TypeVar("_T", bound="type[Overlay]")


#: Class id of QML overlays.
QML_CLASS = "rosglass/QmlOverlay"


#: hector_rviz_overlay's class id of QML overlays.
REFERENCE_QML_CLASS = "hector_rviz_overlay_controls/QmlOverlay"


_CLASS_ID = re.compile(r"[A-Za-z_]\w*/[A-Za-z_]\w*\Z", re.ASCII)


_factories: dict[str, Callable[[str], Overlay]] = {}


_class_ids: dict[type[Any], str] = {}


def register(kind: _T, class_id: str = "", make: Callable[[str], Overlay] | None = None) -> _T:
    """Register an overlay class, so that ``.rviz`` files loaded later restore it; also a decorator.

    Args:
        kind: The class.
        class_id: Its name in files, e.g. ``my_robot/Gauges``; by default the Python package and the
            class name.
        make: Factory that returns a new overlay of the given name; defaults to the class itself.

    Raises:
        Error: `kind` is not an overlay class, or the class id is taken or invalid.
    """
    if not isinstance(kind, type) or not issubclass(kind, Overlay):
        raise Error(f"{kind!r:.80} is not a class derived from rosglass.rviz.Overlay")
    name = class_id or _default_class_id(kind)
    if not _CLASS_ID.match(name):
        raise Error(f"the class id {name!r} is not of the form package/Class")
    taken = next(
        (one for one, taken in _class_ids.items() if taken == name and one is not kind), None
    )
    if name in {QML_CLASS, REFERENCE_QML_CLASS} or taken is not None:
        whose = taken.__qualname__ if taken is not None else "QML files"
        raise Error(f"the class id {name!r} is used by {whose} already; choose another one")
    _factories[name] = make or (lambda overlay_name: kind(name=overlay_name))
    _class_ids[kind] = name
    return kind


def class_id_of(kind: type[Overlay]) -> str:
    """Return the class id of a class, registered or not."""
    return _class_ids.get(kind) or _default_class_id(kind)


def factory_of(class_id: str) -> Callable[[str], Overlay] | None:
    """Return the factory of a class id; None if it is not registered."""
    return _factories.get(class_id)


def _default_class_id(kind: type[Any]) -> str:
    package = kind.__module__.partition(".")[0]
    if package == "__main__":
        package = re.sub(r"\W", "_", Path(sys.argv[0] or "program").stem, flags=re.ASCII)
    return f"{package}/{kind.__name__}"


_log = logging.getLogger("rosglass.rviz")


#: Local variables that may hold a function's overlay, in order of preference.
_OWNER_NAMES = ("self", "overlay", "panel", "popup", "dialog", "root", "widget")


@contextlib.contextmanager
def guarded(overlay: Overlay, activity: str) -> Iterator[None]:
    """Catch and log the exceptions of an overlay's methods, slots and paint events.

    Args:
        overlay: The overlay whose code runs.
        activity: The action for the log, e.g. ``drawing``.
    """
    last = ""

    def report(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        nonlocal last
        # An open menu runs a nested event loop, so the exception may be another overlay's.
        owner = _owner(trace) or overlay
        text = f"{_describe(kind, error, trace)} (while {activity})"
        if text != last:
            _log_problem(owner, text, (kind, error, trace))
        last = text

    before = sys.excepthook
    # Qt's bindings pass exceptions of virtual functions and slots to the hook.
    sys.excepthook = report
    try:
        yield
    except Exception as error:  # an overlay's mistake ends neither RViz nor other overlays
        report(type(error), error, error.__traceback__)
    finally:
        sys.excepthook = before


def log_uncaught_errors() -> Callable[[], None]:
    """Log exceptions of slots and virtual functions; PyQt5 would abort the process for them.

    An exception becomes the problem of the overlay found in the traceback. The program's own
    ``sys.excepthook`` is called as well.

    Returns:
        A function that restores the previous hook.
    """
    before = sys.excepthook

    def report(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        owner = _owner(trace)
        if owner is not None:
            _log_problem(owner, _describe(kind, error, trace), (kind, error, trace))
        if before is not sys.__excepthook__:
            before(kind, error, trace)
        elif owner is None:
            _log.error("%s", _describe(kind, error, trace), exc_info=(kind, error, trace))

    sys.excepthook = report

    def end() -> None:
        if sys.excepthook is report:
            sys.excepthook = before

    return end


def _log_problem(overlay: Overlay, text: str, raised: Any) -> None:
    # Frames and timers repeat the same error.
    level = logging.DEBUG if text == overlay.problem else logging.ERROR
    _log.log(level, "overlay %s: %s", overlay.name, text, exc_info=raised)
    overlay.show_problem(text)


def _describe(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> str:
    try:
        frames = traceback.extract_tb(trace)
    except RecursionError:
        # No stack is left for reading the traceback.
        frames = traceback.StackSummary()
    location = f"{frames[-1].filename}:{frames[-1].lineno}: " if frames else ""
    return f"{location}{kind.__name__}: {error}"


def _owner(trace: TracebackType | None) -> Overlay | None:
    """Return the overlay whose code raised: the one found in the innermost frame."""
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
    """Return `thing` if it is an overlay, or the overlay that shows the widget `thing`."""
    if isinstance(thing, Overlay):
        return thing if is_alive(thing) and hasattr(thing, "name") else None
    widget: Any = thing
    while isinstance(widget, QtWidgets.QWidget) and is_alive(widget):
        shown_by = getattr(widget, "rosglass_overlay", None)
        if shown_by is not None:
            return _overlay_of(shown_by())
        widget = widget.parentWidget()
    return None

"""RViz goes on whatever is raised: it is told in the log, and as the problem of its overlay."""

from __future__ import annotations

import contextlib
import logging
import sys
import traceback
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.rviz.overlay import Overlay

__all__ = ["guarded", "log_what_is_raised"]

_log = logging.getLogger("rosglass.rviz")


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
        frames = traceback.extract_tb(trace)
        place = f"{frames[-1].filename}:{frames[-1].lineno}: " if frames else ""
        text = f"{place}{kind.__name__}: {error} (while {doing})"
        if text != last:
            # What is drawn anew raises anew with each frame.
            known = text == overlay.problem
            _log.log(
                logging.DEBUG if known else logging.ERROR,
                "overlay %s: %s",
                overlay.name,
                text,
                exc_info=(kind, error, trace),
            )
            overlay.tell_problem(text)
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

    Returns:
        Ends it.
    """
    before = sys.excepthook
    if before is not sys.__excepthook__:
        # The program has one of its own.
        return lambda: None
    sys.excepthook = _tell_raised

    def end() -> None:
        if sys.excepthook is _tell_raised:
            sys.excepthook = before

    return end


def _tell_raised(kind: type[BaseException], error: BaseException, trace: Any) -> None:
    _log.error("%s: %s", kind.__name__, error, exc_info=(kind, error, trace))

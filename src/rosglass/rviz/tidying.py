"""Memory that overlays leave behind as they come and go, given back."""

from __future__ import annotations

import ctypes
import gc
from functools import cache
from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Tidying"]

#: Milliseconds after which an overlay that came has been drawn, and one that went is gone.
_WAIT = 3000


class Tidying(QtCore.QObject):
    """Gives memory back a little later, once for all that has happened until then."""

    def __init__(self) -> None:
        super().__init__()
        self._gone = False
        self._timer = QtCore.QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(_WAIT)
        self._timer.timeout.connect(self._tidy)

    def came(self) -> None:
        """Give back what an overlay needed only to come."""
        if not self._timer.isActive():
            self._timer.start()

    def went(self) -> None:
        """Give back all that an overlay had: its parts refer to each other.

        Left to Python, that takes hundreds of overlays, by which memory is in pieces.
        """
        self._gone = True
        self.came()

    @Slot()
    def _tidy(self) -> None:
        gone, self._gone = self._gone, False
        if gone:
            gc.collect()
        trim = _trim()
        if trim is not None:
            trim(0)


@cache
def _trim() -> Callable[[int], Any] | None:
    """Return glibc's function that gives back what `free` keeps; other systems have none."""
    found: Callable[[int], Any] | None = getattr(ctypes.CDLL(None), "malloc_trim", None)
    return found

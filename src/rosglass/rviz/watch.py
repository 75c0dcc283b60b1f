"""RViz's C++ objects: signals whose arguments Python cannot get, and their classes."""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, Slot
from rosglass.rviz.host import as_pyside, pyqt
from rosglass.rviz.qt5 import QtCore as Qt5Core

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["AfterEvent", "Hook", "address", "class_of", "is_a", "type_name"]


class Hook(QtCore.QObject):
    """Calls a function for signals, at once, without their arguments.

    Args:
        call: Called in the middle of whatever RViz does: it may look, and must change nothing.
    """

    def __init__(self, call: Callable[[], None]) -> None:
        super().__init__()
        self._call = call

    def watch(self, sender: Any, *signals: str) -> None:
        """Call for signals of an object, from RViz's bindings, from now on."""
        wrapped = as_pyside(sender, QtCore.QObject)
        for signal in signals:
            Qt5Core.QObject.connect(wrapped, Qt5Core.SIGNAL(signal), self, Qt5Core.SLOT("_on()"))

    @Slot()
    def _on(self) -> None:
        self._call()


def address(item: Any) -> int:
    """Return the address of an object of RViz, unique among those that exist now."""
    return int(pyqt("sip").unwrapinstance(item))


def class_of(item: Any) -> str:
    """Return the C++ class of an object of RViz, e.g. ``rviz::GridDisplay``."""
    return str(as_pyside(item, QtCore.QObject).metaObject().className())


def is_a(item: Any, kind: str) -> bool:
    """Return whether an object of RViz is of a C++ class, or of one derived from it."""
    return bool(as_pyside(item, QtCore.QObject).inherits(kind))


def type_name(item: Any) -> str:
    """Return the C++ class of an object of RViz that :func:`class_of` may not know.

    Returns:
        As compilers write it, e.g. ``N4rviz10FailedToolE``.
    """
    # Itanium C++ ABI, section 2.5.2 "Virtual Table Components" and 2.9.5 "RTTI Layout".
    word = ctypes.sizeof(ctypes.c_void_p)
    table = ctypes.c_void_p.from_address(address(item)).value or 0
    info = ctypes.c_void_p.from_address(table - word).value or 0
    name: bytes = ctypes.c_char_p.from_address(info + word).value or b""
    return name.decode()


class AfterEvent:
    """Calls a function once RViz is done with the event that it is handling.

    RViz handles other events while it loads a file or duplicates displays, timers included, and
    then goes on. Only what is deleted later waits for so long.

    Args:
        call: The function; called once, however often it was asked for until it has returned.
    """

    def __init__(self, call: Callable[[], None]) -> None:
        self._call = call
        self._token: QtCore.QObject | None = None

    def ask(self) -> None:
        """Have it called."""
        if self._token is None:
            # Python must hold it while C++ deletes it.
            token = self._token = QtCore.QObject()
            token.destroyed.connect(self._on_destroyed)
            token.deleteLater()

    def _on_destroyed(self, *_: Any) -> None:
        try:
            self._call()
        finally:
            self._token = None

"""Choice of the Qt binding; all other modules import Qt from here.

PySide6 (Qt 6) is the default. PySide2 (Qt 5) is used if a Qt 5 binding is already loaded, as inside
RViz, or if the environment variable ``ROSGLASS_QT`` is ``pyside2``. Two Qt builds in one process
overwrite each other's symbols, so a second one is refused.
"""

from __future__ import annotations

import builtins
import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rosglass.errors import UnsupportedError
from rosglass.interrupts import InterruptsDeferred

__all__ = [
    "BINDING",
    "QT6",
    "Property",
    "QJSValue",
    "QtCore",
    "QtGui",
    "QtQml",
    "QtQuick",
    "Signal",
    "Slot",
    "address",
    "choose_binding",
    "import_plainly",
    "is_alive",
    "is_valid",
    "optional",
    "run_event_loop",
    "send_deferred_deletes",
]

#: Binding -> major version of its Qt. PyQt is never chosen, but shows which Qt is loaded.
_QT_OF = {"PySide6": 6, "PyQt6": 6, "PySide2": 5, "PyQt5": 5}
_INSTALL_QT5 = (
    "Qt 5 comes with the system's own Python; on Debian and Ubuntu: sudo apt install "
    "python3-pyside2.qtquick python3-pyside2.qtmultimedia qml-module-qtquick-controls2 "
    "qml-module-qtquick-layouts qml-module-qtquick-window2 qml-module-qtmultimedia"
)


def choose_binding(loaded: frozenset[str], wanted: str = "") -> str:
    """Return the binding to use.

    Args:
        loaded: Bindings whose QtCore has been imported in this process.
        wanted: The value of ``ROSGLASS_QT``: ``pyside6``, ``pyside2`` or empty.

    Raises:
        UnsupportedError: `wanted` is unknown, or needs a different Qt than the loaded one.
    """
    known = {"pyside6": "PySide6", "pyside2": "PySide2"}
    if wanted and wanted.lower() not in known:
        raise UnsupportedError(f"ROSGLASS_QT is {wanted!r}; it must be pyside6 or pyside2")
    choice = known.get(wanted.lower(), "")
    if not choice:
        qt5 = any(_QT_OF[name] == 5 for name in loaded)
        choice = "PySide2" if qt5 else "PySide6"
    clash = sorted(name for name in loaded if _QT_OF[name] != _QT_OF[choice])
    if clash:
        raise UnsupportedError(
            f"{choice} cannot be loaded: this process already uses {', '.join(clash)}, and two Qt "
            "versions in one process crash; unset ROSGLASS_QT or import rosglass.qt first"
        )
    return choice


def _refuse_broken_binding(binding: str, version: tuple[int, ...]) -> None:
    """Refuse a binding that is known to crash the interpreter, or to show what is out of date.

    On Python 3.11 or older, PySide6 6.12 releases a reference to None too often in each call that
    returns nothing; after some thousand calls the interpreter aborts. From 6.8.3 to 6.10,
    ``QQmlEngine.clearComponentCache()`` keeps files that are in use: an interface that is loaded
    again is the old one.
    """
    if binding == "PySide6" and version[:2] < (6, 11):
        raise UnsupportedError(
            f"PySide6 {'.'.join(map(str, version))} goes on with the old interface when a QML file "
            'is saved; install a newer one with: pip install -U "PySide6-Essentials>=6.11,<6.12"'
        )
    if binding == "PySide6" and version[:2] == (6, 12) and sys.version_info < (3, 12):
        raise UnsupportedError(
            f"PySide6 {'.'.join(map(str, version))} corrupts reference counts on Python "
            f"{sys.version_info[0]}.{sys.version_info[1]} and would abort this program after a "
            'while; install another one with: pip install "PySide6-Essentials<6.12" '
            '"PySide6-Addons<6.12"'
        )


_loaded = frozenset(name for name in _QT_OF if f"{name}.QtCore" in sys.modules)
#: Name of the binding in use, ``PySide6`` or ``PySide2``.
BINDING = choose_binding(_loaded, os.environ.get("ROSGLASS_QT", ""))
#: Whether this is Qt 6.
QT6 = _QT_OF[BINDING] == 6


def _load(module: str = "") -> Any:
    """Import a module that every installation of the binding needs.

    Raises:
        UnsupportedError: It is missing in PySide2; for PySide6, the caller names the package.
    """
    try:
        return import_module(f"{BINDING}.{module}" if module else BINDING)
    except ModuleNotFoundError as error:
        if QT6:
            raise
        raise UnsupportedError(f"{error}; {_INSTALL_QT5}") from None


if TYPE_CHECKING:
    import shiboken6 as _shiboken
    from PySide6 import QtCore, QtGui, QtQml, QtQuick
else:
    with InterruptsDeferred():
        _refuse_broken_binding(BINDING, tuple(_load().__version_info__[:3]))
        QtCore, QtGui = _load("QtCore"), _load("QtGui")
        QtQml, QtQuick = _load("QtQml"), _load("QtQuick")
        _shiboken = import_module("shiboken6" if QT6 else "shiboken2")

Signal, Slot, Property = QtCore.Signal, QtCore.Slot, QtCore.Property
QJSValue = QtQml.QJSValue


def optional(module: str) -> Any:
    """Return an optional Qt module, e.g. ``QtMultimedia``; None if it is not installed."""
    try:
        return import_module(f"{BINDING}.{module}")
    except ImportError:
        return None


def import_plainly() -> None:
    """Restore Python's own import of modules from PySide's; for programs of rosglass itself.

    After each import, PySide 6 reads the source of the module to see whether it uses PySide: a
    tenth of the time until the first frame of ``rosglass view``. Only ``from __feature__ import``,
    which would fail from now on, needs this.
    """
    builtins.__import__ = getattr(builtins, "__orig_import__", builtins.__import__)


#: Returns what :func:`is_alive` does for a QObject that is not None: a function of Qt's bindings,
#: for code that runs for every message.
is_valid = _shiboken.isValid


def is_alive(item: QtCore.QObject | None) -> bool:
    """Return whether a QObject still exists on the C++ side."""
    return item is not None and bool(_shiboken.isValid(item))


def address(item: Any) -> int:
    """Return the address of the C++ object."""
    return int(_shiboken.getCppPointer(item)[0])


def run_event_loop(loop: QtCore.QCoreApplication | QtCore.QEventLoop) -> int:
    """Run an event loop until it exits; return the exit code."""
    return int(loop.exec() if QT6 else loop.exec_())


def send_deferred_deletes() -> None:
    """Process all pending ``deleteLater()`` calls now instead of in the event loop."""
    QtCore.QCoreApplication.sendPostedEvents(None, int(QtCore.QEvent.Type.DeferredDelete))

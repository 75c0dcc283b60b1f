"""RViz's, Ogre's and Qt 5's bindings: the only module that imports them and converts their objects.

RViz's bindings are made for PyQt5, our interfaces for PySide2; both use the same Qt, and an object
of one is wrapped anew for the other (reference: docs/architecture.md, section 6). Functions without
bindings are called by their names in the C++ library (Itanium C++ ABI).
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import importlib.util
import sys
from functools import cache
from importlib.machinery import PathFinder
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.errors import UnsupportedError
from rosglass.qt import BINDING, QtCore, Slot
from rosglass.rviz.qt5 import QtCore as Qt5Core
from rosglass.rviz.requirements import PACKAGES, require_bindings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import ModuleType

__all__ = [
    "AfterEvent",
    "Hook",
    "address",
    "as_pyqt",
    "as_pyside",
    "class_of",
    "cpp_function",
    "is_a",
    "ogre",
    "ogre_overlay",
    "pyqt",
    "require_rviz",
    "rviz",
    "type_name",
]


_T = TypeVar("_T", bound=QtCore.QObject)
_BINDINGS = "rviz.librviz_sip"


def require_rviz() -> None:
    """Load the bindings.

    Raises:
        UnsupportedError: They are missing or broken, or this process uses another Qt than RViz;
            the message says what to install.
    """
    require_bindings()
    if BINDING != "PySide2":
        raise UnsupportedError(
            f"RViz uses Qt 5, and this process {BINDING} already: import rosglass.rviz first, or "
            "set ROSGLASS_QT=pyside2"
        )
    rviz()
    ogre_overlay()


def _load(name: str) -> ModuleType:
    with _advising(name):
        return importlib.import_module(name)


@contextlib.contextmanager
def _advising(name: str) -> Iterator[None]:
    """Turn an ImportError into what to install."""
    try:
        yield
    except ImportError as error:
        raise UnsupportedError(
            f"{name} is installed but cannot be loaded: {error}; install anew what it comes with: "
            f"sudo apt install --reinstall --no-install-recommends {PACKAGES}"
        ) from None


@cache
def rviz() -> Any:
    """Return RViz's bindings (``rviz.bindings``)."""
    # The package itself would load each module that PyQt5 has.
    package = importlib.util.find_spec("rviz")
    places = (package and package.submodule_search_locations) or ()
    found = PathFinder.find_spec(_BINDINGS, list(places))
    if found is None or found.loader is None or _BINDINGS in sys.modules:
        return _load("rviz").bindings
    with _advising("rviz"):
        made = importlib.util.module_from_spec(found)
        sys.modules[_BINDINGS] = made
        found.loader.exec_module(made)
    return made.rviz


@cache
def pyqt(module: str = "QtCore") -> Any:
    """Return a module of PyQt5, which RViz's bindings take and give."""
    return _load(f"PyQt5.{module}")


@cache
def ogre() -> Any:
    """Return Ogre's bindings; its singletons are RViz's once RViz has made its renderer."""
    return _load("Ogre")


@cache
def ogre_overlay() -> Any:
    """Return the bindings of Ogre's overlays."""
    _load("Ogre")
    return _load("Ogre.Overlay")


def as_pyside(item: Any, kind: type[_T]) -> _T:
    """Return the PySide2 wrapper of an object that RViz's bindings gave.

    Args:
        item: The object.
        kind: What it is for us, e.g. ``QtWidgets.QWidget``.
    """
    shiboken = importlib.import_module("shiboken2")
    wrapped: _T = shiboken.wrapInstance(int(pyqt("sip").unwrapinstance(item)), kind)
    return wrapped


def as_pyqt(item: QtCore.QObject, kind: Any) -> Any:
    """Return the PyQt5 wrapper of one of our objects, e.g. to give it to RViz.

    Args:
        item: The object.
        kind: PyQt5's class for it.
    """
    shiboken = importlib.import_module("shiboken2")
    return pyqt("sip").wrapinstance(int(shiboken.getCppPointer(item)[0]), kind)


@cache
def _library(name: str) -> ctypes.CDLL:
    """Return a library that RViz has loaded.

    Raises:
        UnsupportedError: It has not.
    """
    for line in Path("/proc/self/maps").read_text().splitlines():
        file = line.split(maxsplit=5)[-1]
        if Path(file).name.startswith(f"{name}.so"):
            return ctypes.CDLL(file)
    raise UnsupportedError(f"RViz's bindings come without {name}: they are none of RViz 1")


def cpp_function(library: str, symbol: str, result: Any = None) -> Any:
    """Return a function.

    Args:
        library: Its library, such as ``librviz``.
        symbol: Its name there.
        result: The type in ctypes of what it returns; None for nothing.

    Raises:
        UnsupportedError: This RViz has it not.
    """
    try:
        found = _library(library)[symbol]
    except AttributeError:
        raise UnsupportedError(
            f"{library} has no {symbol}: it was built for another C++ library than GNU's"
        ) from None
    found.restype = result
    return found


class Hook(QtCore.QObject):
    """Calls a function for each signal of an RViz object, at once, without its arguments.

    Args:
        call: Called in the middle of whatever RViz does: it may look, and must change nothing.
    """

    def __init__(self, call: Callable[[], None]) -> None:
        super().__init__()
        self._call = call

    def watch(self, sender: Any, *signals: str) -> None:
        """Connect signals of an object of RViz's bindings."""
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
        """Schedule the call."""
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

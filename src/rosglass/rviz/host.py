"""The bindings of RViz, Ogre and PyQt5, which only this module imports.

RViz's bindings use PyQt5, rosglass uses PySide2. Both share one Qt, and this module converts the
wrappers of objects (docs/architecture.md, section 6). C++ functions without bindings are called by
their mangled names (Itanium C++ ABI).
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
    "as_pyside",
    "class_of",
    "cpp_function",
    "is_a",
    "mangled_class_of",
    "ogre",
    "ogre_overlay",
    "pyqt",
    "require_rviz",
    "rviz",
]


_T = TypeVar("_T", bound=QtCore.QObject)
_BINDINGS = "rviz.librviz_sip"


def require_rviz() -> None:
    """Load the bindings.

    Raises:
        UnsupportedError: They are missing or broken, or this process uses a Qt other than RViz's;
            the message says what to install.
    """
    require_bindings()
    if BINDING != "PySide2":
        raise UnsupportedError(
            f"RViz uses Qt 5, but this process has {BINDING}: import rosglass.rviz first, or "
            "set ROSGLASS_QT=pyside2"
        )
    rviz()
    ogre_overlay()


def _load(name: str) -> ModuleType:
    with _advising(name):
        return importlib.import_module(name)


@contextlib.contextmanager
def _advising(name: str) -> Iterator[None]:
    """Turn an ImportError into an error that says what to install."""
    try:
        yield
    except ImportError as error:
        raise UnsupportedError(
            f"{name} is installed but cannot be loaded: {error}; reinstall its packages: "
            f"sudo apt install --reinstall --no-install-recommends {PACKAGES}"
        ) from None


@cache
def rviz() -> Any:
    """Return RViz's bindings (``rviz.bindings``)."""
    # Importing the package itself would load all modules of PyQt5.
    package = importlib.util.find_spec("rviz")
    folders = (package and package.submodule_search_locations) or ()
    found = PathFinder.find_spec(_BINDINGS, list(folders))
    if found is None or found.loader is None or _BINDINGS in sys.modules:
        return _load("rviz").bindings
    with _advising("rviz"):
        made = importlib.util.module_from_spec(found)
        sys.modules[_BINDINGS] = made
        found.loader.exec_module(made)
    return made.rviz


@cache
def pyqt(module: str = "QtCore") -> Any:
    """Return a module of PyQt5, for arguments and results of RViz's bindings."""
    return _load(f"PyQt5.{module}")


@cache
def ogre() -> Any:
    """Return Ogre's bindings, which share RViz's singletons once RViz has created its renderer."""
    return _load("Ogre")


@cache
def ogre_overlay() -> Any:
    """Return the bindings of Ogre's overlays."""
    _load("Ogre")
    return _load("Ogre.Overlay")


def as_pyside(item: Any, kind: type[_T]) -> _T:
    """Return the PySide2 wrapper of a PyQt5 object.

    Args:
        item: The object, from RViz's bindings.
        kind: PySide2's class for it, e.g. ``QtWidgets.QWidget``.
    """
    shiboken = importlib.import_module("shiboken2")
    wrapped: _T = shiboken.wrapInstance(int(pyqt("sip").unwrapinstance(item)), kind)
    return wrapped


@cache
def _library(name: str) -> ctypes.CDLL:
    """Return a C++ library that RViz has loaded.

    Raises:
        UnsupportedError: It is not loaded.
    """
    for line in Path("/proc/self/maps").read_text().splitlines():
        file = line.split(maxsplit=5)[-1]
        if Path(file).name.startswith(f"{name}.so"):
            return ctypes.CDLL(file)
    raise UnsupportedError(f"RViz's bindings have not loaded {name}: they are not those of RViz 1")


def cpp_function(library: str, symbol: str, result: Any = None) -> Any:
    """Return a C++ function.

    Args:
        library: Its library, e.g. ``librviz``.
        symbol: Its mangled name.
        result: The ctypes type of its result; None for void.

    Raises:
        UnsupportedError: The library does not have it.
    """
    try:
        found = _library(library)[symbol]
    except AttributeError:
        raise UnsupportedError(
            f"{library} has no {symbol}: it was not built with GNU's C++ library"
        ) from None
    found.restype = result
    return found


class Hook(QtCore.QObject):
    """Connects signals of RViz objects to a function, without the signals' arguments.

    Args:
        call: Called immediately, in the middle of RViz's work, so it must not change RViz.
    """

    def __init__(self, call: Callable[[], None]) -> None:
        super().__init__()
        self._call = call

    def watch(self, sender: Any, *signals: str) -> None:
        """Connect signals of an RViz object."""
        wrapped = as_pyside(sender, QtCore.QObject)
        for signal in signals:
            Qt5Core.QObject.connect(wrapped, Qt5Core.SIGNAL(signal), self, Qt5Core.SLOT("_on()"))

    @Slot()
    def _on(self) -> None:
        self._call()


def address(item: Any) -> int:
    """Return the address of an RViz object, unique among existing objects."""
    return int(pyqt("sip").unwrapinstance(item))


def class_of(item: Any) -> str:
    """Return the C++ class of an RViz object, e.g. ``rviz::GridDisplay``, from Qt's metaobject."""
    return str(as_pyside(item, QtCore.QObject).metaObject().className())


def is_a(item: Any, kind: str) -> bool:
    """Return whether an RViz object is an instance of a C++ class, or of a derived class."""
    return bool(as_pyside(item, QtCore.QObject).inherits(kind))


def mangled_class_of(item: Any) -> str:
    """Return the mangled C++ class name of an RViz object, e.g. ``N4rviz10FailedToolE``.

    Unlike :func:`class_of`, it also knows classes without a metaobject.
    """
    # Itanium C++ ABI, section 2.5.2 "Virtual Table Components" and 2.9.5 "RTTI Layout".
    word = ctypes.sizeof(ctypes.c_void_p)
    table = ctypes.c_void_p.from_address(address(item)).value or 0
    info = ctypes.c_void_p.from_address(table - word).value or 0
    name: bytes = ctypes.c_char_p.from_address(info + word).value or b""
    return name.decode()


class AfterEvent:
    """Calls a function after RViz has finished handling the current event.

    RViz runs a nested event loop while it loads a file or duplicates displays. Timers fire in it,
    but deferred deletion waits until it has ended.

    Args:
        call: The function; requests made until it has returned are merged into one call.
    """

    def __init__(self, call: Callable[[], None]) -> None:
        self._call = call
        self._token: QtCore.QObject | None = None

    def schedule(self) -> None:
        """Schedule the call."""
        if self._token is None:
            # Python must keep its wrapper until C++ has deleted the object.
            token = self._token = QtCore.QObject()
            token.destroyed.connect(self._on_destroyed)
            token.deleteLater()

    def _on_destroyed(self, *_: Any) -> None:
        try:
            self._call()
        finally:
            self._token = None

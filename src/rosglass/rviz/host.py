"""RViz's and Ogre's bindings: the only module that imports them, and converts their objects.

RViz's bindings are made for PyQt5, our interfaces for PySide2; both use the same Qt, and an object
of one is wrapped anew for the other (reference: docs/architecture.md, section 6).
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import sys
from functools import cache
from importlib.machinery import PathFinder
from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.errors import UnsupportedError
from rosglass.qt import BINDING, QtCore
from rosglass.rviz.requirements import PACKAGES, require_bindings

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import ModuleType

__all__ = ["as_pyqt", "as_pyside", "ogre", "ogre_overlay", "pyqt", "require_rviz", "rviz"]

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

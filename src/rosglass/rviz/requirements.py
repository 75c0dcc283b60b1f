"""Checks for the packages that RViz overlays need; importable without any of them."""

from __future__ import annotations

import sys
from importlib.machinery import PathFinder
from pathlib import Path

import rosglass
from rosglass.errors import UnsupportedError
from rosglass.extras import install_command

__all__ = ["PACKAGES", "require_bindings"]

#: Packages of Debian 12 that RViz overlays need, in addition to rosglass.
PACKAGES = (
    "rviz python3-rviz python3-ogre-1.12 python3-pyqt5 python3-pyside2.qtcore "
    "python3-pyside2.qtgui python3-pyside2.qtwidgets python3-pyside2.qtqml "
    "python3-pyside2.qtquick python3-pyside2.qtopengl python3-pyside2.qtmultimedia "
    "python3-pyside2.qtmultimediawidgets qml-module-qtquick2 qml-module-qtquick-window2 "
    "qml-module-qtquick-layouts qml-module-qtquick-controls2 qml-module-qtmultimedia"
)
_MODULES = (
    "rviz",
    "Ogre",
    "Ogre.Overlay",
    "PyQt5",
    "shiboken2",
    *(f"PySide2.Qt{name}" for name in ("Core", "Gui", "Widgets", "Qml", "Quick", "OpenGL")),
)
#: Folder of Debian's Python packages.
_SYSTEM = Path("/usr/lib/python3/dist-packages")


def require_bindings() -> None:
    """Check that this Python has the bindings of RViz, Ogre and Qt 5.

    Raises:
        UnsupportedError: Some are missing; the message says what to install and how to run.
    """
    missing = [name for name in _MODULES if not _has(name)]
    if missing:
        raise UnsupportedError(_advice(missing))


def _has(name: str) -> bool:
    """Return whether a module exists, without importing its package."""
    path: list[str] | None = None
    found = ""
    for part in name.split("."):
        found = f"{found}.{part}" if found else part
        spec = PathFinder.find_spec(found, path)
        if spec is None:
            return False
        path = list(spec.submodule_search_locations or ())
    return True


def _advice(missing: list[str]) -> str:
    lacks = ", ".join(_without_parts(missing))
    lines = [f"RViz needs the system's Python; this one, {sys.executable}, lacks {lacks}."]
    installed = (_SYSTEM / "rviz").exists() and any(_SYSTEM.glob("PySide2/QtWidgets*.so"))
    own_python = _is_system_python()
    if own_python or not installed:
        lines.append(f"Install it (Debian 12): sudo apt install --no-install-recommends {PACKAGES}")
    if not own_python:
        ready = Path(rosglass.__file__).parents[2] / ".venv-system" / "bin" / "rosglass"
        if ready.exists():
            lines.append(f"Run: {ready} rviz ...")
        else:
            lines += [
                "Create an environment from the system's Python, once:",
                "    /usr/bin/python3 -m venv --system-site-packages ~/rosglass-rviz",
                f"    ~/rosglass-rviz/bin/{install_command('images')}",
                "Run: ~/rosglass-rviz/bin/rosglass rviz ...",
            ]
    return "\n".join(lines)


def _without_parts(missing: list[str]) -> list[str]:
    """Return missing packages, and missing modules of existing packages."""
    packages = {name.partition(".")[0] for name in missing}
    absent = {package for package in packages if not _has(package)}
    return sorted(absent | {name for name in missing if name.partition(".")[0] not in absent})


def _is_system_python() -> bool:
    """Return whether this Python uses Debian's Python packages."""
    return any(Path(entry) == _SYSTEM for entry in sys.path)

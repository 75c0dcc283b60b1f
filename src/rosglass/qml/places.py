"""Finding what an interface is told to use: its file, and folders of modules."""

# Unlike pathlib's, these never raise.
# ruff: noqa: PTH112, PTH113, PTH208

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from rosglass.comm.names import similar
from rosglass.errors import QmlError

__all__ = ["import_folder", "interface_file", "locate", "near"]

_PACKAGE = "package://"
_REMOTE = ("http://", "https://", "ftp://")


def locate(place: str | os.PathLike[str]) -> Path:
    """Return the path of a file or folder, which may be in a ROS package.

    Args:
        place: A path, or ``package://name/path``; packages are found by ``ROS_PACKAGE_PATH``,
            ``AMENT_PREFIX_PATH`` and ``CMAKE_PREFIX_PATH``.

    Raises:
        QmlError: The environment knows no such package.
    """
    text = os.fspath(place)
    if not text.startswith(_PACKAGE):
        return Path(text).absolute()
    package, _, rest = text.removeprefix(_PACKAGE).partition("/")
    if not package:
        raise QmlError(f"{text}: expected package://name/path")
    from rosglass.interfaces.folders import workspace  # noqa: PLC0415 - few need it

    folder = workspace(os.environ).package(package)
    if not folder:
        raise QmlError(
            f"{text}: there is no package {package!r} in ROS_PACKAGE_PATH, AMENT_PREFIX_PATH and "
            "CMAKE_PREFIX_PATH; source its workspace first"
        )
    return Path(folder, rest).absolute()


def interface_file(place: str | os.PathLike[str]) -> Path:
    """Return the path of a QML file.

    Args:
        place: See :func:`locate`.

    Raises:
        QmlError: There is no such file, or it is none of QML.
    """
    if os.fspath(place).lower().startswith(_REMOTE):
        raise QmlError(f"{os.fspath(place)}: interfaces are run from files of this machine only")
    path = locate(place)
    shown = path if os.fspath(place).startswith(_PACKAGE) else place
    if os.path.isdir(path):
        inside = sorted(file.name for file in path.glob("*.qml"))
        hint = f"name a file in it: {', '.join(inside[:5])}" if inside else "it has no QML files"
        raise QmlError(f"{shown}: this is a folder; {hint}")
    if not os.path.isfile(path):
        raise QmlError(f"{shown}: there is no such file{near(path)}")
    if path.suffix == ".rviz":
        raise QmlError(f"{shown}: a config file of RViz, no QML file: rosglass rviz {shown}")
    if path.suffix != ".qml":
        raise QmlError(f"{shown}: not a QML file, whose name would end in .qml")
    return path


def near(path: Path) -> str:
    """Return a hint at a file that may be meant, empty where there is none."""
    with suppress(OSError, ValueError):
        return similar(path.name, (n for n in os.listdir(path.parent) if n.endswith(path.suffix)))
    return ""


def import_folder(place: str | os.PathLike[str]) -> Path:
    """Return the path of a folder that holds QML modules.

    Args:
        place: See :func:`locate`.

    Raises:
        QmlError: There is no such folder.
    """
    path = locate(place)
    if not os.path.isdir(path):
        raise QmlError(f"{os.fspath(place)}: there is no such folder to import QML modules from")
    return path

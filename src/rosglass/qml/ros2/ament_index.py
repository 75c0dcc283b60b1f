"""The singleton ``AmentIndex`` of ``Ros2 1.0``: where packages are."""
# ruff: noqa: N802 - the names of slots are QML's

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING, TypeVar

from rosglass.errors import Error
from rosglass.qml.file_access import FOLDER_PATIENCE, within
from rosglass.qt import QtCore, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["AmentIndex"]

_T = TypeVar("_T")
_log = logging.getLogger("rosglass.qml")
#: Where an install space lists its packages; ament's resource index, section "File System Index".
_LIST = "share/ament_index/resource_index/packages"


class AmentIndex(QtCore.QObject):
    """The packages in the install spaces that ``AMENT_PREFIX_PATH`` names, the first one winning.

    Without ROS 2 there are none. Install spaces that cannot be read are named in the log.
    """

    @Slot(str, result=str)
    def getPackageShareDirectory(self, package: str) -> str:
        """Return a package's folder of shared files; empty when there is no such package."""
        prefix = self.getPackagePrefix(package)
        return os.path.join(prefix, "share", package) if prefix else ""  # noqa: PTH118

    @Slot(str, result=str)
    def getPackagePrefix(self, package: str) -> str:
        """Return the install space that a package is in; empty when there is none."""
        if not package or "/" in package or package.startswith("."):
            return ""
        return _look(lambda: _prefix(package), "")

    @Slot(result="QStringList")
    def getPackages(self) -> list[str]:
        """Return the names of all packages, sorted."""
        return _look(_packages, [])


def _look(search: Callable[[], _T], otherwise: _T) -> _T:
    try:
        return within(FOLDER_PATIENCE, "a folder in AMENT_PREFIX_PATH", search)
    except Error as error:
        _log.error("AmentIndex: %s", error)
        return otherwise


def _prefix(package: str) -> str:
    # Unlike pathlib's, this never raises.
    found = (
        prefix
        for prefix in _prefixes()
        if os.path.isfile(os.path.join(prefix, _LIST, package))  # noqa: PTH113, PTH118
    )
    return next(found, "")


def _packages() -> list[str]:
    names: set[str] = set()
    for prefix in _prefixes():
        folder = os.path.join(prefix, _LIST)  # noqa: PTH118
        try:
            names.update(os.listdir(folder))  # noqa: PTH208
        except (FileNotFoundError, NotADirectoryError):
            continue
        except OSError as error:
            _log.warning("AmentIndex: %s cannot be read: %s", folder, error.strerror)
    return sorted(name for name in names if not name.startswith("."))


def _prefixes() -> list[str]:
    return [path for path in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if path]

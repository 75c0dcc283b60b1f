"""The singleton ``AmentIndex`` of ``Ros2 1.0``: where packages are."""
# ruff: noqa: N802 - the names of slots are QML's

from __future__ import annotations

import os
from pathlib import Path

from rosglass.qt import QtCore, Slot

__all__ = ["AmentIndex"]

#: Where an install space lists its packages; ament's resource index, section "File System Index".
_LIST = "share/ament_index/resource_index/packages"


class AmentIndex(QtCore.QObject):
    """The packages in the install spaces that ``AMENT_PREFIX_PATH`` names, the first one winning.

    Without ROS 2 there are none.
    """

    @Slot(str, result=str)
    def getPackageShareDirectory(self, package: str) -> str:
        """Return a package's folder of shared files; empty when there is no such package."""
        prefix = self.getPackagePrefix(package)
        return str(Path(prefix, "share", package)) if prefix else ""

    @Slot(str, result=str)
    def getPackagePrefix(self, package: str) -> str:
        """Return the install space that a package is in; empty when there is none."""
        if not package or "/" in package or package.startswith("."):
            return ""
        found = (prefix for prefix in _prefixes() if Path(prefix, _LIST, package).is_file())
        return next(found, "")

    @Slot(result="QStringList")
    def getPackages(self) -> list[str]:
        """Return the names of all packages, sorted."""
        lists = [path for prefix in _prefixes() if (path := Path(prefix, _LIST)).is_dir()]
        names = {entry.name for path in lists for entry in path.iterdir()}
        return sorted(name for name in names if not name.startswith("."))


def _prefixes() -> list[str]:
    return [path for path in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if path]

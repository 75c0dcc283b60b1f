"""Noticing that files of an interface changed."""

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING

from rosglass.qt import QtCore, Signal

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

__all__ = ["Watcher"]

_log = logging.getLogger("rosglass.qml")
_SUFFIXES = (".qml", ".js", ".mjs")
#: Milliseconds without further changes after which an editor has finished saving.
_DEBOUNCE = 80
#: Files and folders that are looked at: a file in a home folder must not stop the interface.
_MOST = 2000


class Watcher(QtCore.QObject):
    """Watches every QML and JavaScript file under some folders.

    Args:
        folders: The folders; hidden folders in them are left out.
    """

    #: Files were written, came or went.
    changed = Signal()

    def __init__(self, *folders: Path) -> None:
        super().__init__()
        self._roots = folders
        self._watcher = QtCore.QFileSystemWatcher(self)
        self._pause = QtCore.QTimer(self)
        self._pause.setSingleShot(True)
        self._pause.setInterval(_DEBOUNCE)
        self._pause.timeout.connect(self._look)
        self._watcher.fileChanged.connect(self._soon)
        self._watcher.directoryChanged.connect(self._soon)
        self._full = False
        self._stamps = self._scan()

    def _soon(self, path: str) -> None:  # noqa: ARG002 - all folders are looked at
        self._pause.start()

    def _look(self) -> None:
        stamps = self._scan()
        if stamps != self._stamps:
            self._stamps = stamps
            self.changed.emit()

    def _scan(self) -> dict[str, tuple[int, int]]:
        """Return time and size of every file, and watch those that are not watched.

        Editors save by renaming, after which the new file is not watched yet.
        """
        stamps = {path: stamp for root in self._roots for path, stamp in self._files(root)}
        folders = {os.path.dirname(path) for path in stamps}  # noqa: PTH120
        folders.update(map(str, self._roots))
        watched = {*self._watcher.files(), *self._watcher.directories()}
        missing = [path for path in (*stamps, *folders) if path not in watched]
        if missing:
            self._watcher.addPaths(missing)
        return stamps

    def _files(self, root: Path) -> Iterator[tuple[str, tuple[int, int]]]:
        left = _MOST
        for folder, folders, names in os.walk(root):
            folders[:] = sorted(f for f in folders if not f.startswith(".") and f != "__pycache__")
            left -= 1
            for name in names:
                if not name.endswith(_SUFFIXES) and name != "qmldir":
                    continue
                path = os.path.join(folder, name)  # noqa: PTH118 - QFileSystemWatcher speaks text
                try:
                    status = os.stat(path)  # noqa: PTH116
                except OSError:
                    continue
                left -= 1
                yield path, (status.st_mtime_ns, status.st_size)
            if left <= 0:
                if not self._full:
                    self._full = True
                    _log.warning("%s has too many files to watch them all", root)
                return

"""Style sheets for widgets: from a file, from a ROS package, or written out."""

from __future__ import annotations

import logging
import os
import re
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.places import locate
from rosglass.rviz.qt5 import QtCore

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

__all__ = ["StyleSheet", "read_style_sheet"]

_log = logging.getLogger("rosglass.rviz")
_URL = re.compile(r"""url\(\s*(["']?)([^"')]+)\1\s*\)""")
_MOST = 1 << 20
#: Milliseconds after a change of the file: editors write in several steps.
_DEBOUNCE = 80


def read_style_sheet(source: str) -> tuple[str, Path | None]:
    """Return a style sheet, and the file that it was read from; None where it is written out.

    Args:
        source: Path of a ``.qss`` file, ``package://package/file.qss``, or the style sheet itself.
            Relative ``url()`` in a file are taken from the file's folder.

    Raises:
        Error: The file is missing, too large, or no text; its braces do not match.
    """
    if "{" in source or not source.strip():
        _check(source, "style sheet")
        return source, None
    path = locate(source.strip())
    try:
        size = path.stat().st_size
        if size > _MOST:
            raise Error(f"style sheet {path}: {size} bytes are more than a megabyte")
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise Error(f"style sheet {source}: {why}") from None
    _check(text, f"style sheet {path}")
    return _URL.sub(lambda match: _absolute(match, path.parent), text), path


def _absolute(match: re.Match[str], folder: Path) -> str:
    url = match[2].strip()
    if url.startswith(":") or os.path.isabs(url):  # noqa: PTH117 - a URL, no path
        return match[0]
    if url.startswith("package://"):
        return f'url("{locate(url)}")'
    return f'url("{folder / url}")'


def _check(text: str, what: str) -> None:
    """Find what Qt would only print."""
    bare = re.sub(r"/\*.*?\*/", lambda m: "\n" * m[0].count("\n"), text, flags=re.DOTALL)
    depth = 0
    for number, line in enumerate(bare.split("\n"), 1):
        for letter in line:
            depth += (letter == "{") - (letter == "}")
            if depth not in (0, 1):
                raise Error(f"{what}:{number}: this {letter!r} has no counterpart")
    if depth:
        raise Error(f"{what}: the last '{{' is not closed")


class StyleSheet(QtCore.QObject):  # type: ignore[misc]
    """A style sheet in use, read anew when its file changes.

    Args:
        name: Of the overlay, for messages.
        use: Called with the text.
        failed: Called with what is wrong.
    """

    def __init__(
        self, name: str, use: Callable[[str], None], failed: Callable[[str], None]
    ) -> None:
        super().__init__()
        self._name, self._use, self._failed = name, use, failed
        #: As it was given.
        self.source = ""
        #: Whether the file is watched.
        self.watch = False
        self._path: Path | None = None
        self._watcher: Any = None
        self._pause = QtCore.QTimer()
        self._pause.setSingleShot(True)
        self._pause.setInterval(_DEBOUNCE)
        self._pause.timeout.connect(self._read)

    def use(self, source: str, *, watch: bool = False, strict: bool = False) -> None:
        """Use another one.

        Args:
            source: See :func:`read_style_sheet`.
            watch: Whether to read the file anew when it changes.
            strict: Whether to raise what is wrong, instead of telling it.

        Raises:
            Error: Only if `strict`.
        """
        self.source, self.watch = source, watch
        self._stop_watching()
        self._read(strict=strict)
        if watch and self._path is not None:
            # Editors replace the file; its folder tells of that.
            self._watcher = QtCore.QFileSystemWatcher([str(self._path), str(self._path.parent)])
            self._watcher.fileChanged.connect(self._soon)
            self._watcher.directoryChanged.connect(self._soon)

    def _soon(self, path: str) -> None:
        del path
        self._pause.start()

    def _read(self, *, strict: bool = False) -> None:
        try:
            text, self._path = read_style_sheet(self.source)
        except Error as error:
            if strict:
                raise
            _log.error("overlay %s: %s", self._name, error)
            self._failed(str(error))
            return
        if self._watcher is not None and str(self._path) not in self._watcher.files():
            self._watcher.addPath(str(self._path))
        self._use(text)

    def _stop_watching(self) -> None:
        watcher, self._watcher = self._watcher, None
        if watcher is not None:
            watcher.deleteLater()

    def close(self) -> None:
        """Watch nothing any longer."""
        self._pause.stop()
        self._stop_watching()

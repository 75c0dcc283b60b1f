"""What of an interface in QML is drawn by OpenGL alone, and not by Qt's software renderer."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.qt import QtQml

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from collections.abc import Set as AbstractSet

__all__ = ["need_in_file", "need_in_items"]

#: Qt's classes, and what they are in QML: those of Qt 5.15's "Qt Quick Software Adaptation", those
#: that draw by OpenGL themselves, and layers, which leave holes in what is below them.
_CLASSES = {
    "QQuickShaderEffect": "ShaderEffect",
    "QQuickShaderEffectSource": "layer|ShaderEffectSource",
    "QQuickParticlePainter": "QtQuick.Particles",
    "QQuick3DViewport": "View3D",
    "QQuickWebEngineView": "WebEngineView",
    "QQuickFramebufferObject": "QQuickFramebufferObject",
}
#: Cameras of robots are painted where video is not drawn; nothing else that a VideoOutput shows is.
#: ImagePublisher takes pictures of items, which have no transparency with the software renderer.
_WRITTEN = re.compile(
    r"\b(ShaderEffect|ShaderEffectSource|MultiEffect|RectangularShadow|View3D|WebEngineView|layer"
    r"|MediaPlayer|Video|Camera|CaptureSession|ImagePublisher)\s*\{"
    r"|\b(layer\.enabled)\b"
    r"|^[ \t]*import\s+(QtGraphicalEffects|Qt5Compat\.GraphicalEffects|QtQuick\.Effects"
    r"|QtQuick\.Particles|QtQuick3D|QtQuick\.Scene3D|Qt3D|QtWebEngine|QtWebView|QtLocation"
    r"|QtGraphs|QtDataVisualization)\b",
    re.MULTILINE,
)
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_USED = re.compile(r"\b([A-Z]\w*)\s*\{|[\"']([\w./-]+\.qml)[\"']")
_FOLDER = re.compile(r"^[ \t]*import\s+[\"']([^\"'\n\0]+)[\"']", re.MULTILINE)
_MODULE = re.compile(r"^[ \t]*import\s+([A-Za-z][\w.]*)\s*([\d.]*)", re.MULTILINE)
_LISTED = re.compile(r"^[ \t]*(?:singleton\s+)?([A-Z]\w*)\s+[\d.]+\s+(\S+\.qml)\s*$", re.MULTILINE)


def need_in_items(root: Any, file: Path) -> str:
    """Return the first item that only OpenGL draws, as ``place: what``; empty for none.

    Args:
        root: What to look through.
        file: The interface that it is of.
    """
    items = [root]
    while items:
        item = items.pop()
        for name, written in _CLASSES.items():
            if item.inherits(name):
                return f"{_place(item, written, file)}: {written.replace('|', ' or ')}"
        items += item.childItems()
    return ""


def need_in_file(file: Path, import_paths: Sequence[str]) -> str:
    """Return what a file, or one that it uses, may come to show that only OpenGL draws.

    Args:
        file: The file.
        import_paths: Folders with QML modules.

    Returns:
        ``place: what``; empty for nothing.
    """
    for path, text in _files(file, [Path(folder) for folder in import_paths]):
        found = _WRITTEN.search(text)
        if found is not None:
            kind = found.lastindex or 0
            return f"{path}:{_line(text, found.start(kind))}: {found[kind]}"
    return ""


def _files(file: Path, import_paths: Sequence[Path]) -> Iterator[tuple[Path, str]]:
    """Iterate over a file and those that it uses, of its folders and of modules, with texts."""
    waiting, seen = [file], {file}
    folders: dict[Path, _Folder] = {}
    while waiting:
        path = waiting.pop()
        text = _read(path)
        yield path, text
        places = [path.parent, *(_plain(path.parent / name) for name in _FOLDER.findall(text))]
        modules = _MODULE.findall(text)
        places += [p for name, version in modules for p in _places(name, version, import_paths)]
        for place in places:
            if place not in folders:
                folders[place] = _Folder(place)
            found = folders[place].used(text) - seen
            waiting += sorted(found)
            seen |= found


def _places(module: str, version: str, import_paths: Sequence[Path]) -> list[Path]:
    """Return where a module may be, as Qt 5 looks for it."""
    place = module.replace(".", "/")
    major = version.partition(".")[0]
    names = [place, f"{place}.{version}", f"{place}.{major}"] if version else [place]
    return [path / name for path in import_paths for name in names if (path / name).is_dir()]


class _Folder:
    """A folder with QML files: of an interface, or a module's."""

    _names: AbstractSet[str] = frozenset()

    def __init__(self, path: Path) -> None:
        self._path = path
        with suppress(OSError):
            self._names = set(os.listdir(path))  # noqa: PTH208 - faster, of hundreds of files
        self._listed = dict(_LISTED.findall(_read(path / "qmldir")))

    def used(self, text: str) -> set[Path]:
        """Return its files for the types and files that are named in a text."""
        found = set()
        for kind, source in _USED.findall(text):
            name = source or self._listed.get(kind, f"{kind}.qml")
            if name in self._names:
                found.add(self._path / name)
            elif "/" in name and (self._path / name).is_file():
                found.add(_plain(self._path / name))
        return found


def _plain(path: Path) -> Path:
    """Return the one name of a place, as addresses have it: folders may import each other."""
    return Path(os.path.normpath(path))


def _read(path: Path) -> str:
    """Return a file's text without its comments, each line where it is."""
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
    return _COMMENT.sub(lambda comment: "\n" * comment[0].count("\n"), text)


def _place(item: Any, written: str, file: Path) -> str:
    """Return where an item is written in the interface, with the line if it is found."""
    while item is not None:
        context = QtQml.QQmlEngine.contextForObject(item)
        path = Path("" if context is None else context.baseUrl().toLocalFile())
        # What JavaScript makes of a text claims to be of a file `inline`.
        if path.is_relative_to(file.parent) and path.is_file():
            text = _read(path)
            found = re.search(rf"\b({written})\b", text)
            return str(path) if found is None else f"{path}:{_line(text, found.start())}"
        item = item.parentItem()
    return str(file)


def _line(text: str, index: int) -> int:
    return text.count("\n", 0, index) + 1

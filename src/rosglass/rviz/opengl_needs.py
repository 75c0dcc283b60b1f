"""What of an interface in QML is drawn by OpenGL alone, and not by Qt's software renderer."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.qt import QtQml

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

__all__ = ["need_in_file", "need_in_items"]

#: Qt's classes, and what they are in QML: those of Qt 5.15's "Qt Quick Software Adaptation", those
#: that draw by OpenGL themselves, and layers, which leave holes in what is below them.
_CLASSES = {
    "QQuickShaderEffect": "ShaderEffect",
    "QQuickShaderEffectSource": "layer|ShaderEffectSource",
    "QQuickParticlePainter": "QtQuick.Particles",
    "QDeclarativeVideoOutput": "VideoOutput",
    "QQuick3DViewport": "View3D",
    "QQuickWebEngineView": "WebEngineView",
    "QQuickFramebufferObject": "QQuickFramebufferObject",
}
_WRITTEN = re.compile(
    r"\b(ShaderEffect|ShaderEffectSource|VideoOutput|View3D|WebEngineView|layer)\s*\{"
    r"|\b(layer\.enabled)\b"
    r"|^[ \t]*import\s+(QtGraphicalEffects|QtQuick\.Particles|QtQuick3D|QtWebEngine)\b",
    re.MULTILINE,
)
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_USED = re.compile(r"\b([A-Z]\w*)\s*\{|[\"']([\w./-]+\.qml)[\"']")
_FOLDER = re.compile(r"^[ \t]*import\s+[\"']([\w./-]+)[\"']", re.MULTILINE)
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
    while waiting:
        path = waiting.pop()
        text = _read(path)
        yield path, text
        folders = [path.parent, *(path.parent / name for name in _FOLDER.findall(text))]
        modules = _MODULE.findall(text)
        folders += [f for name, version in modules for f in _folders(name, version, import_paths)]
        found = {place for folder in folders for place in _used(text, folder)}
        waiting += sorted(one for one in found - seen if one.is_file())
        seen |= found


def _folders(module: str, version: str, import_paths: Sequence[Path]) -> list[Path]:
    """Return where a module may be, as Qt 5 looks for it."""
    place = module.replace(".", "/")
    major = version.partition(".")[0]
    names = [place, f"{place}.{version}", f"{place}.{major}"] if version else [place]
    return [path / name for path in import_paths for name in names if (path / name).is_dir()]


def _used(text: str, folder: Path) -> Iterator[Path]:
    """Iterate over the files that a folder may have for the types and files named in a text."""
    listed = dict(_LISTED.findall(_read(folder / "qmldir")))
    for kind, source in _USED.findall(text):
        yield (folder / (source or listed.get(kind, f"{kind}.qml"))).resolve()


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

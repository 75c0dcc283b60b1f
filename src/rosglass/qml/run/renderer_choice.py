"""Choice of Qt Quick's renderer: OpenGL, or Qt's software renderer.

Qt chooses one for the whole process when the first window or image of Qt Quick is created. By
then, only the files show what needs OpenGL. Where OpenGL runs on the CPU, Qt's software renderer is
several times as fast.
"""

from __future__ import annotations

import logging
import os
import re
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error, QmlError
from rosglass.qml.run.modules import interface_file
from rosglass.qt import QtGui, QtQml, QtQuick

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from collections.abc import Set as AbstractSet


__all__ = [
    "RENDERERS",
    "RendererChoice",
    "ask_for_software",
    "choice",
    "imported_folders",
    "imported_modules",
    "need_in_file",
    "need_in_items",
    "taken_renderer",
]

#: Qt classes that need OpenGL -> their names in QML: those of Qt 5.15's "Qt Quick Software
#: Adaptation", those that call OpenGL themselves, and layers, which cut holes in items below.
_CLASSES = {
    "QQuickShaderEffect": "ShaderEffect",
    "QQuickShaderEffectSource": "layer|ShaderEffectSource",
    "QQuickParticlePainter": "QtQuick.Particles",
    "QQuick3DViewport": "View3D",
    "QQuickWebEngineView": "WebEngineView",
    "QQuickFramebufferObject": "QQuickFramebufferObject",
}
#: QML that needs OpenGL. The software renderer draws robots' cameras, but nothing else that a
#: VideoOutput shows; with it, ImagePublisher's grabs of items have no transparency.
_WRITTEN = re.compile(
    r"\b(ShaderEffect|ShaderEffectSource|MultiEffect|RectangularShadow|View3D|WebEngineView|layer"
    r"|MediaPlayer|Video|Camera|CaptureSession|ImagePublisher)\s*\{"
    r"|\b(layer\.enabled)\b"
    r"|^[ \t]*import\s+(QtGraphicalEffects|Qt5Compat\.GraphicalEffects|QtQuick\.Effects"
    r"|QtQuick\.Particles|QtQuick3D|QtQuick\.Scene3D|Qt3D|QtWebEngine|QtWebView|QtLocation"
    r"|QtGraphs|QtDataVisualization|RosScene)\b",
    re.MULTILINE,
)
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_USED = re.compile(r"\b([A-Z]\w*)\s*\{|[\"']([\w./-]+\.qml)[\"']")
_FOLDER = re.compile(r"^[ \t]*import\s+[\"']([^\"'\n\0]+)[\"']", re.MULTILINE)
_MODULE = re.compile(r"^[ \t]*import\s+([A-Za-z][\w.]*)\s*([\d.]*)", re.MULTILINE)
_LISTED = re.compile(r"^[ \t]*(?:singleton\s+)?([A-Z]\w*)\s+[\d.]+\s+(\S+\.qml)\s*$", re.MULTILINE)


def need_in_items(root: Any, file: Path) -> str:
    """Return the first item that only OpenGL can draw, as ``place: what``; empty for none.

    Args:
        root: The root object to search.
        file: The interface that it belongs to.
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
    """Return the first use of something that only OpenGL draws, in a file and those it uses.

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


def imported_modules(file: Path, import_paths: Sequence[str], text: str | None = None) -> set[str]:
    """Return the QML modules that a file imports, and those of the files that it uses.

    Args:
        file: The file.
        import_paths: Folders with QML modules.
        text: Its text; None for what is in the file.
    """
    files = _files(file, [Path(folder) for folder in import_paths], text)
    return {name for _, found in files for name, _ in _MODULE.findall(found)}


def imported_folders(file: Path, import_paths: Sequence[str]) -> Iterator[tuple[str, str, Path]]:
    """Yield name, version and folder of what a file imports; without a name, folders of files.

    Args:
        file: The file.
        import_paths: Folders with QML modules.
    """
    text, paths = _read(file), [Path(folder) for folder in import_paths]
    yield "", "", file.parent
    for name in _FOLDER.findall(text):
        yield "", "", _plain(file.parent / name)
    for name, version in _MODULE.findall(text):
        for folder in _places(name, version, paths):
            yield name, version, folder


def _files(
    file: Path, import_paths: Sequence[Path], first: str | None = None
) -> Iterator[tuple[Path, str]]:
    """Yield a file and the files it uses, from its folders and from modules, with their texts."""
    waiting, seen = [file], {file}
    folders: dict[Path, _Folder] = {}
    while waiting:
        path = waiting.pop()
        text = _read(path) if first is None else first
        first = None
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
    """Return the folders in which Qt 5 looks for a module."""
    place = module.replace(".", "/")
    major = version.partition(".")[0]
    names = [place, f"{place}.{version}", f"{place}.{major}"] if version else [place]
    return [path / name for path in import_paths for name in names if (path / name).is_dir()]


class _Folder:
    """A folder with QML files, of an interface or a module."""

    _names: AbstractSet[str] = frozenset()

    def __init__(self, path: Path) -> None:
        self._path = path
        with suppress(OSError):  # Qt reports it
            self._names = set(os.listdir(path))  # noqa: PTH208 - faster, of hundreds of files
        self._listed = dict(_LISTED.findall(_read(path / "qmldir")))

    def used(self, text: str) -> set[Path]:
        """Return the folder's files for the types and files named in a text."""
        found = set()
        for kind, source in _USED.findall(text):
            name = source or self._listed.get(kind, f"{kind}.qml")
            if name in self._names:
                found.add(self._path / name)
            elif "/" in name and (self._path / name).is_file():
                found.add(_plain(self._path / name))
        return found


def _plain(path: Path) -> Path:
    """Return the canonical path of a file or folder: folders may import each other."""
    return Path(os.path.normpath(path))


def _read(path: Path) -> str:
    """Return a file's text without comments, with unchanged line numbers."""
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
    return _COMMENT.sub(lambda comment: "\n" * comment[0].count("\n"), text)


def _place(item: Any, written: str, file: Path) -> str:
    """Return where the interface declares an item, with the line if it is found."""
    while item is not None:
        context = QtQml.QQmlEngine.contextForObject(item)
        path = Path("" if context is None else context.baseUrl().toLocalFile())
        # For objects that JavaScript creates from a text, Qt reports a file `inline`.
        if path.is_relative_to(file.parent) and path.is_file():
            text = _read(path)
            found = re.search(rf"\b({written})\b", text)
            return str(path) if found is None else f"{path}:{_line(text, found.start())}"
        item = item.parentItem()
    return str(file)


def _line(text: str, index: int) -> int:
    return text.count("\n", 0, index) + 1


#: The options for users.
RENDERERS = ("auto", "opengl", "software")
#: Names of Mesa's OpenGL renderers that run on the CPU.
_COMPUTED = ("llvmpipe", "softpipe", "swrast", "software rasterizer")
#: Environment variables that Qt reads when it creates its first window.
_VARIABLES = ("QT_QUICK_BACKEND", "QMLSCENE_DEVICE")
#: Environment variables by which users of Qt 6 select Vulkan or a version of OpenGL.
_RHI_VARIABLES = ("QSG_RHI_BACKEND", "QSG_RHI")
_SOFTWARE = ("software", "softwarecontext")
#: GL_RENDERER, for glGetString().
_GL_RENDERER = 0x1F01

_NAMES = {"opengl": "OpenGL", "software": "Qt's software renderer"}
_BEFORE = "something of Qt Quick that was made before has chosen it"


class RendererChoice:
    """The process's choice of a renderer, made for its first QML interface."""

    #: The drawn thing in messages, and the class that errors refer users to.
    _subject = "interfaces"
    _application = "rosglass.qml.Application"
    _log = logging.getLogger("rosglass.qml")

    def __init__(self) -> None:
        self._wanted = "auto"
        self._expected: list[Path] = []
        #: "opengl" or "software"; empty before the choice.
        self.renderer = ""
        #: Reason for the choice.
        self.reason = ""

    def prefer(self, renderer: str) -> None:
        """Set the user's choice, which overrides Qt's environment variables.

        Args:
            renderer: One of :data:`RENDERERS`.

        Raises:
            Error: The renderer is unknown, or Qt has already chosen another one.
        """
        if renderer not in RENDERERS:
            raise Error(f"renderer {renderer!r}: expected one of {', '.join(RENDERERS)}")
        taken = self.renderer or taken_renderer()
        if renderer in ("auto", taken):
            self._wanted = renderer
            return
        if taken:
            raise Error(
                f"renderer {renderer!r}: the first window of Qt Quick in this process has chosen "
                f"{taken} for all; make the {self._application} before it"
            )
        self._wanted = renderer
        for variable in _VARIABLES:
            os.environ.pop(variable, None)
        if renderer == "software" and not ask_for_software():
            raise Error(
                "renderer 'software': something of Qt Quick in this process has chosen opengl for "
                f"all; make the {self._application} before it"
            )

    def expect(self, file: str | os.PathLike[str]) -> None:
        """Add a file that will be shown later, whose needs are also considered."""
        if self.renderer:
            return
        with suppress(QmlError):  # showing it reports the problem
            self._expected.append(interface_file(file))

    def choose(self, import_paths: Sequence[str]) -> str:
        """Return the renderer; the first call makes the choice.

        Args:
            import_paths: Folders with QML modules for the expected files.

        Raises:
            UnsupportedError: OpenGL was requested, but Qt cannot use it here.
        """
        if not self.renderer:
            self.renderer, self.reason = self._choose(import_paths)
            if self.renderer == "software" and not ask_for_software():
                self.renderer, self.reason = "opengl", _BEFORE
            if self.renderer == "opengl":
                self._try_opengl()
            if self.renderer == "software":
                # No render thread: it would need the GIL to paint images, while the GUI thread
                # holds the GIL and waits for it, a deadlock.
                os.environ["QSG_RENDER_LOOP"] = "basic"
            name = _NAMES[self.renderer]
            self._log.info("%s are drawn by %s: %s", self._subject, name, self.reason)
        return self.renderer

    def missing_warning(self, need: str) -> str:
        """Return the warning for an interface that needs OpenGL, with the software renderer."""
        return (
            f"{need} is not drawn, or wrongly: Qt's software renderer draws all {self._subject} "
            f"here ({self.reason}); start with --renderer opengl, or Application(renderer='opengl')"
        )

    def _choose(self, import_paths: Sequence[str]) -> tuple[str, str]:
        if self._wanted != "auto":
            return self._wanted, "it was requested"
        taken = taken_renderer()
        if taken:
            return taken, _BEFORE
        for variable in (*_VARIABLES, *_RHI_VARIABLES):
            if os.environ.get(variable):
                kind = "software" if os.environ[variable] in _SOFTWARE else "opengl"
                return kind, f"{variable}={os.environ[variable]}"
        device = self._graphics_device()
        if not device:
            return "software", "there is no OpenGL here"
        if not any(name in device.lower() for name in _COMPUTED):
            return "opengl", device
        need = next(filter(None, (need_in_file(f, import_paths) for f in self._expected)), "")
        if need:
            return "opengl", f"{need} needs it; {device} computes it, which is slow"
        return "software", f"no graphics card, OpenGL would be computed by {device}"

    def _graphics_device(self) -> str:
        """Return the OpenGL renderer, e.g. ``llvmpipe (LLVM 15.0.6, 256 bits)``; "" for none.

        On Windows and macOS, where Qt does not use OpenGL, a general description.
        """
        if not sys.platform.startswith(("linux", "freebsd")):
            return "what Qt chooses here"
        surface = QtGui.QOffscreenSurface()
        surface.create()
        context = QtGui.QOpenGLContext()
        if not (context.create() and context.makeCurrent(surface)):
            return ""
        device = str(context.functions().glGetString(_GL_RENDERER) or "an unnamed OpenGL")
        context.doneCurrent()
        return device

    def _try_opengl(self) -> None:
        """Use the software renderer if OpenGL is unavailable, or raise UnsupportedError."""


#: The choice of this process, for its own windows.
choice = RendererChoice()


def taken_renderer() -> str:
    """Return the renderer that Qt has chosen for the process; empty before it chooses."""
    if not any(window.inherits("QQuickWindow") for window in QtGui.QGuiApplication.allWindows()):
        return ""
    backend = QtQuick.QQuickWindow.sceneGraphBackend()
    return "software" if backend in _SOFTWARE else "opengl"


def ask_for_software() -> bool:
    """Select the software renderer unless it is too late; return whether it is in use."""
    window = QtQuick.QQuickWindow
    if window.sceneGraphBackend() not in _SOFTWARE:
        window.setSceneGraphBackend("software")
    return window.sceneGraphBackend() in _SOFTWARE

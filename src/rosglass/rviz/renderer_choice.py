"""Which of Qt Quick's renderers draws overlays: OpenGL, or Qt's own, without a graphics card.

Qt takes one for the whole process when the first window, or picture, of Qt Quick is made: only the
files tell by then what will be in it. Where the screen's OpenGL is computed by the processor
itself, Qt's own renderer is several times as fast.
"""

from __future__ import annotations

import logging
import os
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.errors import Error, QmlError, UnsupportedError
from rosglass.qml.places import interface_file
from rosglass.rviz.host import ogre
from rosglass.rviz.opengl_needs import need_in_file
from rosglass.rviz.qt5 import QtGui, QtQuick
from rosglass.rviz.renderers import OpenGLRenderer, SoftwareRenderer

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from rosglass.rviz.renderers import Renderer

__all__ = ["RENDERERS", "RendererChoice", "choice"]

_log = logging.getLogger("rosglass.rviz")
#: What a user can ask for.
RENDERERS = ("auto", "opengl", "software")
#: What Mesa's OpenGL without a graphics card calls itself.
_COMPUTED = ("llvmpipe", "softpipe", "swrast", "software rasterizer")
#: What Qt looks at when it makes its first window.
_VARIABLES = ("QT_QUICK_BACKEND", "QMLSCENE_DEVICE")
_SOFTWARE = ("software", "softwarecontext")


class RendererChoice:
    """The one choice of a process, made with its first overlay in QML."""

    def __init__(self) -> None:
        self._wanted = "auto"
        self._expected: list[Path] = []
        #: "opengl" or "software"; empty before it is made.
        self.renderer = ""
        #: Why that one.
        self.reason = ""

    def prefer(self, renderer: str) -> None:
        """Take note of what the user wants, which counts for more than what Qt's variables say.

        Args:
            renderer: One of :data:`RENDERERS`.

        Raises:
            Error: There is no such renderer, or Qt has chosen another one already.
            UnsupportedError: Qt is told to use its RHI, which overlays cannot.
        """
        if renderer not in RENDERERS:
            raise Error(f"renderer {renderer!r}: expected one of {', '.join(RENDERERS)}")
        if os.environ.get("QSG_RHI", "0") not in ("", "0"):
            raise UnsupportedError("overlays cannot be drawn by Qt's RHI; unset QSG_RHI")
        taken = self.renderer or _taken()
        if renderer in ("auto", taken):
            self._wanted = renderer
            return
        if taken:
            raise Error(
                f"renderer {renderer!r}: the first window of Qt Quick in this process has chosen "
                f"{taken} for all; make the rosglass.rviz.Application before it"
            )
        self._wanted = renderer
        for variable in _VARIABLES:
            os.environ.pop(variable, None)
        if renderer == "software" and not _ask_for_software():
            raise Error(
                "renderer 'software': something of Qt Quick in this process has chosen opengl for "
                "all; make the rosglass.rviz.Application before it"
            )

    def expect(self, file: str | os.PathLike[str]) -> None:
        """Take note of a file that is to be shown sooner or later; what it needs counts as well."""
        if self.renderer:
            return
        with suppress(QmlError):
            self._expected.append(interface_file(file))

    def make(self, import_paths: Sequence[str]) -> Renderer:
        """Return what draws a scene; the first call chooses for all.

        Args:
            import_paths: Folders with QML modules that the expected files use.

        Raises:
            UnsupportedError: OpenGL was asked for, and Qt cannot use it here.
        """
        if not self.renderer:
            self.renderer, self.reason = self._choose(import_paths)
            if self.renderer == "software" and not _ask_for_software():
                self.renderer, self.reason = "opengl", _BEFORE
            if self.renderer == "opengl":
                self._try_opengl()
            _log.info("overlays are drawn by %s: %s", _NAMES[self.renderer], self.reason)
        return SoftwareRenderer() if self.renderer == "software" else OpenGLRenderer()

    def _choose(self, import_paths: Sequence[str]) -> tuple[str, str]:
        if self._wanted != "auto":
            return self._wanted, "it was asked for"
        taken = _taken()
        if taken:
            return taken, _BEFORE
        for variable in _VARIABLES:
            if os.environ.get(variable) in _SOFTWARE:
                return "software", f"{variable}={os.environ[variable]}"
        device = _graphics_device()
        if not any(name in device.lower() for name in _COMPUTED):
            return "opengl", device
        need = next(filter(None, (need_in_file(f, import_paths) for f in self._expected)), "")
        if need:
            return "opengl", f"{need} needs it; {device} computes it, which is slow"
        return "software", f"no graphics card, OpenGL would be computed by {device}"

    def _try_opengl(self) -> None:
        try:
            OpenGLRenderer()
        except UnsupportedError as error:
            if self._wanted != "auto" or not _ask_for_software():
                raise
            self.renderer, self.reason = "software", str(error)

    def tell_missing(self, need: str) -> str:
        """Return what to say of an interface that needs OpenGL, and does not get it."""
        return (
            f"{need} is not drawn, or wrongly: Qt's software renderer draws all overlays here "
            f"({self.reason}); start with --renderer opengl, or Application(renderer='opengl')"
        )


_NAMES = {"opengl": "OpenGL", "software": "Qt's software renderer"}
_BEFORE = "something of Qt Quick that was made before has chosen it"
#: That of this process.
choice = RendererChoice()


def _taken() -> str:
    """Return which renderer Qt has taken for the process; empty as long as it has taken none."""
    if not any(window.inherits("QQuickWindow") for window in QtGui.QGuiApplication.allWindows()):
        return ""
    backend = QtQuick.QQuickWindow.sceneGraphBackend()
    return "software" if backend in _SOFTWARE else "opengl"


def _ask_for_software() -> bool:
    """Return whether the process has the software renderer, taken now if it is not too late."""
    window = QtQuick.QQuickWindow
    if window.sceneGraphBackend() not in _SOFTWARE:
        window.setSceneGraphBackend("software")
    return window.sceneGraphBackend() in _SOFTWARE


def _graphics_device() -> str:
    """Return what draws RViz's 3D view, e.g. ``llvmpipe (LLVM 15.0.6, 256 bits)``."""
    capabilities = ogre().Root.getSingleton().getRenderSystem().getCapabilities()
    return str(capabilities.getDeviceName())

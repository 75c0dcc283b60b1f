"""Which of Qt Quick's renderers draws: OpenGL, or Qt's own, without a graphics card.

Qt takes one for the whole process when the first window, or picture, of Qt Quick is made: only the
files tell by then what will be in it. Where the screen's OpenGL is computed by the processor
itself, Qt's own renderer is several times as fast.
"""

from __future__ import annotations

import logging
import os
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.errors import Error, QmlError
from rosglass.qml.opengl_needs import need_in_file
from rosglass.qml.places import interface_file
from rosglass.qt import QtGui, QtQuick

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

__all__ = ["RENDERERS", "RendererChoice", "ask_for_software", "choice", "taken_renderer"]

#: What a user can ask for.
RENDERERS = ("auto", "opengl", "software")
#: What Mesa's OpenGL without a graphics card calls itself.
_COMPUTED = ("llvmpipe", "softpipe", "swrast", "software rasterizer")
#: What Qt looks at when it makes its first window.
_VARIABLES = ("QT_QUICK_BACKEND", "QMLSCENE_DEVICE")
#: What users of Qt 6 ask for Vulkan or a certain OpenGL with.
_RHI_VARIABLES = ("QSG_RHI_BACKEND", "QSG_RHI")
_SOFTWARE = ("software", "softwarecontext")
#: OpenGL's name of the string that says what draws.
_GL_RENDERER = 0x1F01

_NAMES = {"opengl": "OpenGL", "software": "Qt's software renderer"}
_BEFORE = "something of Qt Quick that was made before has chosen it"


class RendererChoice:
    """The one choice of a process, made with its first interface in QML."""

    #: What is drawn, and where errors send users, for the log.
    _subject = "interfaces"
    _application = "rosglass.qml.Application"
    _log = logging.getLogger("rosglass.qml")

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
        """Take note of a file that is to be shown sooner or later; what it needs counts as well."""
        if self.renderer:
            return
        with suppress(QmlError):
            self._expected.append(interface_file(file))

    def choose(self, import_paths: Sequence[str]) -> str:
        """Return the renderer; the first call chooses for all.

        Args:
            import_paths: Folders with QML modules that the expected files use.

        Raises:
            UnsupportedError: OpenGL was asked for, and Qt cannot use it here.
        """
        if not self.renderer:
            self.renderer, self.reason = self._choose(import_paths)
            if self.renderer == "software" and not ask_for_software():
                self.renderer, self.reason = "opengl", _BEFORE
            if self.renderer == "opengl":
                self._try_opengl()
            if self.renderer == "software":
                # A thread that draws would need Python for pictures, and the GUI thread waits for
                # it with Python's lock: neither would go on.
                os.environ["QSG_RENDER_LOOP"] = "basic"
            name = _NAMES[self.renderer]
            self._log.info("%s are drawn by %s: %s", self._subject, name, self.reason)
        return self.renderer

    def tell_missing(self, need: str) -> str:
        """Return what to say of an interface that needs OpenGL, and does not get it."""
        return (
            f"{need} is not drawn, or wrongly: Qt's software renderer draws all {self._subject} "
            f"here ({self.reason}); start with --renderer opengl, or Application(renderer='opengl')"
        )

    def _choose(self, import_paths: Sequence[str]) -> tuple[str, str]:
        if self._wanted != "auto":
            return self._wanted, "it was asked for"
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
        """Return what draws the screen, e.g. ``llvmpipe (LLVM 15.0.6, 256 bits)``; "" for nothing.

        Where Qt does not draw by OpenGL anyway, on Windows and macOS, what it does draw by.
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
        """Raise UnsupportedError, or take the software renderer, where OpenGL cannot be used."""


#: That of the process, for windows of its own.
choice = RendererChoice()


def taken_renderer() -> str:
    """Return which renderer Qt has taken for the process; empty as long as it has taken none."""
    if not any(window.inherits("QQuickWindow") for window in QtGui.QGuiApplication.allWindows()):
        return ""
    backend = QtQuick.QQuickWindow.sceneGraphBackend()
    return "software" if backend in _SOFTWARE else "opengl"


def ask_for_software() -> bool:
    """Return whether the process has the software renderer, taken now if it is not too late."""
    window = QtQuick.QQuickWindow
    if window.sceneGraphBackend() not in _SOFTWARE:
        window.setSceneGraphBackend("software")
    return window.sceneGraphBackend() in _SOFTWARE

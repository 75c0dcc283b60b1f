"""Which of Qt Quick's renderers draws overlays: OpenGL, or Qt's own, without a graphics card."""

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING

from rosglass.errors import UnsupportedError
from rosglass.qml.renderer_choice import RendererChoice, ask_for_software
from rosglass.rviz.host import ogre
from rosglass.rviz.renderers import OpenGLRenderer, SoftwareRenderer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.rviz.renderers import Renderer

__all__ = ["OverlayRendererChoice", "choice"]


class OverlayRendererChoice(RendererChoice):
    """The one choice of a process, made with its first overlay in QML."""

    _subject = "overlays"
    _application = "rosglass.rviz.Application"
    _log = logging.getLogger("rosglass.rviz")

    def prefer(self, renderer: str) -> None:
        """Take note of what the user wants, which counts for more than what Qt's variables say.

        Args:
            renderer: One of :data:`rosglass.qml.renderer_choice.RENDERERS`.

        Raises:
            Error: There is no such renderer, or Qt has chosen another one already.
            UnsupportedError: Qt is told to use its RHI, which overlays cannot.
        """
        if os.environ.get("QSG_RHI", "0") not in ("", "0"):
            raise UnsupportedError("overlays cannot be drawn by Qt's RHI; unset QSG_RHI")
        super().prefer(renderer)

    def make(self, import_paths: Sequence[str]) -> Renderer:
        """Return what draws a scene; the first call chooses for all.

        Args:
            import_paths: Folders with QML modules that the expected files use.

        Raises:
            UnsupportedError: OpenGL was asked for, and Qt cannot use it here.
        """
        software = self.choose(import_paths) == "software"
        return SoftwareRenderer() if software else OpenGLRenderer()

    def _graphics_device(self) -> str:
        """Return what draws RViz's 3D view, e.g. ``llvmpipe (LLVM 15.0.6, 256 bits)``."""
        capabilities = ogre().Root.getSingleton().getRenderSystem().getCapabilities()
        return str(capabilities.getDeviceName()) or "an unnamed OpenGL"

    def _try_opengl(self) -> None:
        try:
            OpenGLRenderer()
        except UnsupportedError as error:
            if self._wanted != "auto" or not ask_for_software():
                raise
            self.renderer, self.reason = "software", str(error)


#: That of this process.
choice = OverlayRendererChoice()

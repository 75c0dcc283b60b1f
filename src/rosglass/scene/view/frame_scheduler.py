"""Schedules the frames of a view, and owns its renderers.

It is drawn when something has changed. Where the processor draws, changes of the scene wait after a
frame for as long as that took, so that QML has half of the time.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

from PySide6.QtQuick import QQuickWindow, QSGRendererInterface
from shiboken6 import Shiboken

from rosglass.qt import QtCore, Slot
from rosglass.scene.render.renderer import Frame, SceneRenderer

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["NO_GPU", "FrameScheduler", "close_renderers"]

NO_GPU = (
    "The 3D view needs OpenGL, Vulkan, Metal or Direct3D, which this program does not have: Qt "
    "draws with its software renderer. Unset QT_QUICK_BACKEND; without a graphics card, Mesa's "
    "llvmpipe will do (on Debian: sudo apt install libgl1-mesa-dri)."
)
#: The longest pause after a frame, in seconds.
_MAX_PAUSE_S = 0.5
#: Renderers of views that are gone, until C++ has deleted them.
_ORPHANS: list[SceneRenderer] = []


class FrameScheduler(QtCore.QObject):
    """Requests the frames of a view, and has its renderers.

    Attributes:
        renderers: Those that C++ still has: letting go of one too early frees it twice.
        began: When the window began its frame, by the clock of :func:`time.monotonic`.
        next_picture: Time before which no other frame is drawn.

    Args:
        view: The ``SceneView``.
    """

    def __init__(self, view: Any) -> None:
        super().__init__(view)
        self._view = view
        self.renderers: list[SceneRenderer] = []
        #: The one that draws in the GUI thread, as Qt's basic render loop does; None elsewhere.
        self._drawing: SceneRenderer | None = None
        #: Frames drawn by renderers that no longer exist.
        self._painted = 0
        self.began = self.next_picture = 0.0
        #: True if a frame of this view is part of the window's frame.
        self._is_in_frame = False
        #: True while a change waits until the next frame.
        self._is_late = False
        self._later = QtCore.QTimer(self)
        self._later.setSingleShot(True)
        self._later.timeout.connect(self._draw_late)
        #: Connections to the window: to each frame, and to the end of the first one until then.
        self._frames: list[Any] = []
        self._first_frame: Any = None
        view.windowChanged.connect(self.use_window)

    def create_renderer(
        self, take_frame: Callable[[], Frame], on_problem: Callable[[str], None]
    ) -> SceneRenderer:
        """Return a new renderer; called in the render thread.

        Args:
            take_frame: Returns what is drawn.
            on_problem: Called with why nothing can be drawn; empty once it can.
        """
        made = SceneRenderer(take_frame, on_problem)
        self.renderers.append(made)
        self._drawing = made if QtCore.QThread.currentThread() == self.thread() else None
        # C++ deletes the one of the window before later.
        QtCore.QTimer.singleShot(0, self, self._drop_renderers)
        return made

    def begin(self) -> None:
        """Note that a frame of the view becomes part of the window's frame."""
        if self.draws_in_software != self._view.scene.draws_in_software:
            QtCore.QTimer.singleShot(0, self, self._report_device)
        self._is_in_frame, self._is_late = True, False

    @property
    def draws_in_software(self) -> bool:
        """True if the CPU draws."""
        return any(one.draws_in_software for one in self.renderers)

    @property
    def is_complete(self) -> bool:
        """True if the last frame showed everything: new data is uploaded over several frames."""
        return all(one.is_complete for one in self.renderers if Shiboken.isValid(one))

    @property
    def pictures_drawn(self) -> int:
        """Number of drawn frames."""
        return self._painted + sum(one.count for one in self.renderers)

    def request_picture(self) -> None:
        """Draw changes; if the CPU draws, QML has half of the time.

        Movements by the user are drawn at once.
        """
        now = time.monotonic()
        if now >= self.next_picture or self._view.is_moved_by_user(now):
            self.draw()
            return
        self._is_late = True
        if not self._later.isActive():
            self._later.start(math.ceil(1000 * (self.next_picture - now)))

    @Slot()
    def draw(self) -> None:
        """Draw the next frame; if the GUI thread draws, with only one frame of the window."""
        renderer = self._drawing
        if renderer is not None and Shiboken.isValid(renderer) and self._view.isVisible():
            renderer.draw_again()
        else:
            self._view.update()

    @Slot()
    def _draw_late(self) -> None:
        if self._is_late:
            self.request_picture()

    @Slot()
    def _on_frame(self) -> None:
        self.began = time.monotonic()

    @Slot()
    def _on_frame_swapped(self) -> None:
        if self._is_in_frame:
            self._is_in_frame = False
            if self._view.scene.draws_in_software:
                now = time.monotonic()
                self.next_picture = now + min(now - self.began, _MAX_PAUSE_S)

    @Slot()
    def _take_mouse(self) -> None:
        # After the window's first frame, as PySide then makes all of Qt's enumerations, in 12 ms.
        self._view.setAcceptedMouseButtons(QtCore.Qt.MouseButton.AllButtons)
        self._forget_first_frame()

    def _forget_first_frame(self) -> None:
        # Where another thread draws, the ends of further frames may be on their way already.
        first, self._first_frame = self._first_frame, None
        if first is not None:
            QtCore.QObject.disconnect(first)

    @Slot()
    def _report_device(self) -> None:
        self._view.scene.set_draws_in_software(self.draws_in_software)

    @Slot()
    def _drop_renderers(self) -> None:
        """Drop the renderers that C++ has deleted, e.g. those of a window that it has left."""
        for one in self.renderers:
            if not Shiboken.isValid(one):
                one.close()
                self._painted += one.count
        self.renderers[:] = [one for one in self.renderers if Shiboken.isValid(one)]

    @Slot(QQuickWindow)
    def use_window(self, window: QQuickWindow | None) -> None:
        """Draw in another window; None for none."""
        while self._frames:
            QtCore.QObject.disconnect(self._frames.pop())
        self._forget_first_frame()
        self._free_devices()
        self._drawing = None
        if window is None:
            return
        self._frames.append(window.sceneGraphInvalidated.connect(self._free_devices))
        self._frames.append(window.afterAnimating.connect(self._on_frame))
        self._frames.append(window.frameSwapped.connect(self._on_frame_swapped))
        self._first_frame = window.afterFrameEnd.connect(self._take_mouse)
        api = window.rendererInterface().graphicsApi()
        self._view.set_problem(NO_GPU if api == QSGRendererInterface.GraphicsApi.Software else "")

    @Slot()
    def _free_devices(self) -> None:
        """Release resources of the graphics device before its window is destroyed."""
        if self._drawing is not None:
            for renderer in self.renderers:
                renderer.close()


def close_renderers(renderers: list[SceneRenderer]) -> None:
    """Release the renderers' resources on the device, once the view is destroyed."""
    kept = list(renderers)
    for renderer in kept:
        # C++ has deleted it before or does so a little later, with the scene graph; what Python has
        # made on the device is freed by neither.
        renderer.close()
    _ORPHANS.extend(kept)
    _ORPHANS[:] = [one for one in _ORPHANS if Shiboken.isValid(one)]

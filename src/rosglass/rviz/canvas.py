"""A scene of widgets, painted into a picture: only where it has changed."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.qt import Signal
from rosglass.rviz.qt5 import QtCore, QtGui, QtWidgets
from rosglass.rviz.tiles import Rect

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Canvas"]

#: Rectangles that are painted one by one; of more, what is around them is.
_MOST = 12


class Canvas(QtWidgets.QGraphicsView):  # type: ignore[misc]
    """A view of a scene that is seen nowhere, though Qt takes it for visible.

    Only a visible view hears which part of an item has changed: the scene's own signal names the
    whole item, here the widget that fills everything.

    Args:
        scene: The scene.
        root: The widget that fills it.
    """

    #: Something looks another way now.
    stale = Signal()

    def __init__(self, scene: Any, root: Any) -> None:
        super().__init__(scene)
        self._root = root
        #: The picture: shape (height, width), each pixel 0xAARRGGBB with premultiplied colours.
        self.pixels: NDArray[np.uint32] = np.zeros((0, 0), np.uint32)
        self._stale = QtGui.QRegion()
        self._painting = False
        self.setAttribute(QtCore.Qt.WA_DontShowOnScreen)
        self.setAttribute(QtCore.Qt.WA_ShowWithoutActivating)
        # A program may end with its last window.
        self.setAttribute(QtCore.Qt.WA_QuitOnClose, False)
        for part in (self, self.viewport()):
            part.setAttribute(QtCore.Qt.WA_OpaquePaintEvent)
            part.setAttribute(QtCore.Qt.WA_NoSystemBackground)
        self.setFocusPolicy(QtCore.Qt.NoFocus)
        self.setInteractive(False)
        self.setFrameShape(QtWidgets.QFrame.NoFrame)
        self.setHorizontalScrollBarPolicy(QtCore.Qt.ScrollBarAlwaysOff)
        self.setVerticalScrollBarPolicy(QtCore.Qt.ScrollBarAlwaysOff)
        self.setAlignment(QtCore.Qt.AlignLeft | QtCore.Qt.AlignTop)
        self.setRenderHint(QtGui.QPainter.Antialiasing)

    def fit(self, width: int, height: int, ratio: float) -> None:
        """Set the size; all of it is painted next time.

        Args:
            width: Pixels.
            height: Pixels.
            ratio: Pixels for one unit of the scene.
        """
        own = self.devicePixelRatioF()
        self.pixels = np.zeros((height, width), np.uint32)
        self.setTransform(QtGui.QTransform.fromScale(ratio / own, ratio / own))
        self.resize(math.ceil(width / own), math.ceil(height / own))
        self.show()
        self._stale = QtGui.QRegion(self.viewport().rect())

    def paintEvent(self, event: Any) -> None:  # noqa: N802 - Qt's
        """Take note of what Qt would have painted now, unless it is painted."""
        if self._painting:
            super().paintEvent(event)
        else:
            self._stale += event.region()
            self.stale.emit()

    def paint(self) -> list[Rect]:
        """Paint what has changed, and return where that is in :attr:`pixels`."""
        everything, own = QtGui.QRegion(self.viewport().rect()), self.devicePixelRatioF()
        stale, self._stale = self._stale & everything, QtGui.QRegion()
        if stale.isEmpty():
            return []
        if own != round(own) or self._shadows_are_larger():
            stale = everything
        elif stale.rectCount() > _MOST:
            stale = QtGui.QRegion(stale.boundingRect())
        # Qt rounds what is exposed of widgets, and would leave out a row at the edge.
        more = math.ceil(self.transform().m11()) + 1
        around = QtGui.QRegion()
        for rect in stale.rects():
            around += rect.adjusted(-more, -more, more, more)
        picture = _scratch(self.pixels.shape, own)
        self._render(around & everything, picture)
        words = np.frombuffer(picture.constBits(), np.uint32).reshape(self.pixels.shape)
        rects = [self._in_pixels(rect, own) for rect in stale.rects()]
        for rect in rects:
            place = slice(rect.top, rect.bottom), slice(rect.left, rect.right)
            self.pixels[place] = words[place]
        return rects

    def _render(self, region: Any, picture: Any) -> None:
        # Shadows would be elsewhere if it were drawn elsewhere than where it is.
        at = region.boundingRect().topLeft()
        painter = QtGui.QPainter(picture)
        painter.setCompositionMode(QtGui.QPainter.CompositionMode_Source)
        painter.fillRect(region.boundingRect(), QtCore.Qt.transparent)
        painter.end()
        self._painting = True
        try:
            self.viewport().render(picture, at, region, QtWidgets.QWidget.RenderFlags())
        finally:
            self._painting = False

    def _shadows_are_larger(self) -> bool:
        """Return whether effects may reach further than Qt knows: it does not scale them down."""
        if self.transform().m11() >= 1:
            return False
        return self._root.findChild(QtWidgets.QGraphicsEffect) is not None

    def _in_pixels(self, rect: Any, own: float) -> Rect:
        height, width = self.pixels.shape
        return Rect(
            math.floor(rect.left() * own),
            math.floor(rect.top() * own),
            min(math.ceil((rect.left() + rect.width()) * own), width),
            min(math.ceil((rect.top() + rect.height()) * own), height),
        )


@lru_cache(maxsize=1)
def _scratch(shape: tuple[int, int], ratio: float) -> Any:
    """Return the picture of a size that all canvases paint into before they take what they need."""
    picture = QtGui.QImage(shape[1], shape[0], QtGui.QImage.Format_ARGB32_Premultiplied)
    picture.setDevicePixelRatio(ratio)
    return picture

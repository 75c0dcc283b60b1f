"""Pictures of items: grabbed by the renderer in its own time, turned into pixels anywhere."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.qml.item_window import window_of
from rosglass.qt import QT6, QtCore, QtGui, QtQuick, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

__all__ = ["GRABBED", "ItemGrab", "pixels_of"]

#: Encodings that a grabbed picture can be turned into: Qt's format, and channels.
GRABBED = {
    "rgb8": ("Format_RGB888", 3),
    "bgr8": ("Format_BGR888", 3),
    "rgba8": ("Format_RGBA8888", 4),
    "mono8": ("Format_RGB888", 1),
}
#: Shares of red, green and blue in grey (ITU-R BT.601), as OpenCV and ROS's drivers have them.
_GREY = (0.299, 0.587, 0.114)


class ItemGrab:
    """One picture of an item, which the renderer takes with its next frame.

    Args:
        item: The item.
        size: Width and height of the picture in pixels; None for the item's on the screen.
        done: Told the picture, on the GUI thread.

    Attributes:
        problem: Why there will be no picture; empty when one can come.
        size: Width and height that the picture shall have, pixels.
    """

    def __init__(
        self,
        item: QtQuick.QQuickItem,
        size: tuple[int, int] | None,
        done: Callable[[ItemGrab, QtGui.QImage], None],
    ) -> None:
        self._item: Any = item
        self._done = done
        self._result: Any = None
        self.window = window = window_of(item)
        self.size = (0, 0)
        self.problem = ""
        if window is None or not window.isVisible():
            self.problem = "the item is in no window that is shown"
            return
        ratio = window.effectiveDevicePixelRatio()
        self.size = size or (round(item.width() * ratio), round(item.height() * ratio))
        if min(self.size) < 1:
            self.problem = f"the item is {item.width():g}x{item.height():g} pixels"
            return
        # Qt 6 multiplies what it is asked for by the ratio, Qt 5 does not.
        scale = ratio if QT6 else 1.0
        wanted = QtCore.QSize(*(max(1, -(-side // scale)) for side in self.size))
        result: Any = item.grabToImage(wanted)
        if result is None or not result:
            self.problem = "Qt cannot draw the item apart from its window"
            return
        self._result = result
        result.ready.connect(self._ready)

    @property
    def is_possible(self) -> bool:
        """Whether the picture can still come: the item is there, and in the same window."""
        return self._result is not None and is_alive(self._item) and is_alive(self.window)

    def cancel(self) -> None:
        """Tell nobody."""
        self._result = None

    def _ready(self) -> None:
        result, self._result = self._result, None
        if result is not None:
            self._done(self, result.image())


def pixels_of(image: QtGui.QImage, size: tuple[int, int], encoding: str) -> NDArray[Any]:
    """Return the pixels of a grabbed picture; on any thread.

    Where an encoding has no transparency, what is transparent is black.

    Args:
        image: What was grabbed.
        size: Width and height wanted, pixels.
        encoding: One of :data:`GRABBED`.

    Returns:
        Rows x columns (x channels) of bytes, top row first.
    """
    import numpy as np  # noqa: PLC0415 - not before somebody wants a picture

    formats = QtGui.QImage.Format
    if (image.width(), image.height()) != size:
        modes = QtCore.Qt.AspectRatioMode.IgnoreAspectRatio
        smooth = QtCore.Qt.TransformationMode.SmoothTransformation
        image = image.scaled(*size, modes, smooth)
    name, channels = GRABBED[encoding]
    if encoding != "rgba8" and image.hasAlphaChannel():
        # Premultiplied colours without their alpha are the picture before black.
        image = image.convertToFormat(formats.Format_ARGB32_Premultiplied)
        image.reinterpretAsFormat(formats.Format_RGB32)
    image = image.convertToFormat(getattr(formats, name))
    width, height = size
    rows = np.frombuffer(image.constBits(), np.uint8, image.bytesPerLine() * height)
    held = 4 if encoding == "rgba8" else 3
    pixels = rows.reshape(height, -1)[:, : width * held].reshape(height, width, held)
    if channels > 1:
        return np.array(pixels)
    return np.rint(pixels.astype(np.float32) @ np.array(_GREY, np.float32)).astype(np.uint8)

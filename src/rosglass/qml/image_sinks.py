"""What shows pictures: a video sink (Qt 6), a video surface (Qt 5), or an :class:`ImageItem`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import UnsupportedError
from rosglass.qml.image_item import ImageItem
from rosglass.qml.item_window import window_of
from rosglass.qt import QT6, QtCore, QtQuick, is_alive, optional

if TYPE_CHECKING:
    from rosglass.qml.image_rendering import Picture

__all__ = ["Sink"]

#: Pixels to which the size of an item is rounded up: resizing it changes little.
_STEP = 8


class Sink:
    """Shows the pictures of one viewer; used on the GUI thread.

    Args:
        item: What QML gave.

    Raises:
        UnsupportedError: It shows no pictures.
    """

    def __init__(self, item: QtCore.QObject) -> None:
        multimedia: Any = optional("QtMultimedia")
        self._multimedia = multimedia
        self.item: Any = item
        #: Whether it takes video frames; otherwise it takes images.
        self.takes_video = not isinstance(item, ImageItem)
        kind = "QVideoSink" if QT6 else "QAbstractVideoSurface"
        video = multimedia is not None and isinstance(item, getattr(multimedia, kind))
        if self.takes_video and not video:
            owner = "a VideoOutput's videoSink" if QT6 else "set by VideoOutput.source"
            raise UnsupportedError(
                f"videoSink must be {owner} or an ImageItem, got {item.metaObject().className()}"
            )
        self._layout: Any = None

    @property
    def is_alive(self) -> bool:
        """Whether it still exists."""
        return is_alive(self.item)

    def room(self) -> tuple[int, int] | None:
        """Return the width and height in pixels that it has on the screen, rounded up generously.

        None when that cannot be told: nobody knows what becomes of the pictures then.
        """
        item = self.item if isinstance(self.item, ImageItem) else self.item.parent()
        window = window_of(item) if isinstance(item, QtQuick.QQuickItem) else None
        if window is None:
            return None
        place = item.mapRectToScene(QtCore.QRectF(0, 0, item.width(), item.height()))
        ratio = window.effectiveDevicePixelRatio()
        sides = [
            -(-round(side * ratio) // _STEP) * _STEP for side in (place.width(), place.height())
        ]
        if not all(sides):
            return None
        turned = (item.property("orientation") or 0) % 180
        return (sides[1], sides[0]) if turned else (sides[0], sides[1])

    def show(self, picture: Picture) -> bool:
        """Show a picture; return false when it was made for another kind of sink.

        Raises:
            UnsupportedError: The surface takes no such pictures.
        """
        made = picture.video if self.takes_video else picture.image
        if made is None:
            return False
        if not self.takes_video:
            self.item.present(made)
        elif QT6:
            self.item.setVideoFrame(made)
        else:
            self._present(made)
        return True

    def clear(self) -> None:
        """Take the picture off the screen."""
        if not self.is_alive:
            return
        if not self.takes_video:
            self.item.present(None)
        elif QT6:
            self.item.setVideoFrame(self._multimedia.QVideoFrame())
        else:
            self.item.stop()

    def _present(self, video: Any) -> None:
        layout = (video.size(), video.pixelFormat())
        surface = self.item
        if surface.isActive() and layout != self._layout:
            surface.stop()
        if not surface.isActive():
            self._layout = layout
            if not surface.start(self._multimedia.QVideoSurfaceFormat(*layout)):
                raise UnsupportedError(
                    f"the video surface takes no pictures of {layout[1].name.decode()}; "
                    "show them in an ImageItem"
                )
        surface.present(video)

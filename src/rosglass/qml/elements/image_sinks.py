"""Sinks that show images: video sinks (Qt 6), video surfaces (Qt 5), and :class:`ImageItem`."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.errors import UnsupportedError
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qt import QT6, Property, QtCore, QtGui, QtQml, QtQuick, Signal, is_alive, optional

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosglass.qml.elements.image_rendering import Picture


__all__ = ["ImageItem", "Sink", "all_items", "grab", "is_loading", "is_painted", "window_of"]


def window_of(item: QtQuick.QQuickItem) -> QtQuick.QQuickWindow | None:
    """Return the window that an item is in, or None.

    PySide treats the item as the owner of the result of ``item.window()``: it would destroy the
    window's wrapper together with the item's, despite other references.
    """
    for window in QtGui.QGuiApplication.allWindows():
        if isinstance(window, QtQuick.QQuickWindow):
            content = window.contentItem()
            # None in a window that is being destroyed.
            if content is not None and (content is item or content.isAncestorOf(item)):
                return window
    return None


def all_items() -> Iterator[QtQuick.QQuickItem]:
    """Yield the items of all windows."""
    for window in QtGui.QGuiApplication.allWindows():
        if isinstance(window, QtQuick.QQuickWindow):
            yield from _items_of(window)


def _items_of(window: QtQuick.QQuickWindow) -> Iterator[QtQuick.QQuickItem]:
    items = [window.contentItem()]
    while items:
        item = items.pop()
        yield item
        items += item.childItems()


def grab(window: QtQuick.QQuickWindow) -> QtGui.QImage:
    """Return an image of a window that shows everything.

    A ``SceneView`` (``is_complete``) uploads large data over several frames.
    """
    drawn = -1
    while True:
        image = window.grabWindow()
        views: list[Any] = [
            item for item in _items_of(window) if not getattr(item, "is_complete", True)
        ]
        before, drawn = drawn, sum(view.pictures_drawn() for view in views)
        if not views or drawn == before:  # such as a view that is hidden
            return image


def is_loading(window: QtQuick.QQuickWindow) -> bool:
    """Return whether a ``SceneView`` in a window still reads files, such as the robot's meshes."""
    return any(getattr(item, "is_loading", False) is True for item in _items_of(window))


def is_painted(window: QtQuick.QQuickWindow) -> bool:
    """Return whether Qt's software renderer, without video and shaders, draws a window."""
    kinds = QtQuick.QSGRendererInterface.GraphicsApi
    return window.rendererInterface().graphicsApi() in (kinds.Software, kinds.OpenVG)


#: The QML file of the item that paints a VideoOutput's images.
_PAINTED_VIDEO = Path(__file__).with_name("PaintedVideo.qml")
#: An item's size is rounded up to multiples of this, in pixels, so that resizing has few steps.
_STEP = 8
_NOT_DRAWN = "Qt's software renderer draws no VideoOutput, and its images cannot be painted"


class Sink:
    """Shows the images of one viewer; used on the GUI thread.

    A VideoOutput needs the graphics card. In a window that Qt's software renderer draws, an
    :class:`ImageItem` inside it paints the images of its video sink.

    Args:
        item: The value of ``videoSink`` or ``videoSurface`` in QML.
        source: The element whose images it shows; used to find Qt 5's VideoOutput.

    Raises:
        UnsupportedError: The item cannot show images.
    """

    def __init__(self, item: QtCore.QObject, source: QtCore.QObject | None = None) -> None:
        multimedia: Any = optional("QtMultimedia")
        self._multimedia = multimedia
        self.item: Any = item
        self._source = source
        #: Whether the sink takes video frames; otherwise it takes images.
        self.takes_video = not isinstance(item, ImageItem)
        kind = "QVideoSink" if QT6 else "QAbstractVideoSurface"
        video = multimedia is not None and isinstance(item, getattr(multimedia, kind))
        if self.takes_video and not video:
            owner = "a VideoOutput's videoSink" if QT6 else "set by VideoOutput.source"
            raise UnsupportedError(
                f"videoSink must be {owner} or an ImageItem, got {item.metaObject().className()}"
            )
        self._layout: Any = None
        self._output: Any = None
        self._painter: Any = None
        self._component: Any = None

    @property
    def is_alive(self) -> bool:
        """True while the item exists."""
        return is_alive(self.item)

    def room(self) -> tuple[int, int] | None:
        """Return its width and height on the screen in pixels, rounded up; None if unknown.

        The size is unknown if the item that shows the images cannot be found.
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

    def is_painted(self) -> bool:
        """Return whether a video sink's images must be painted to be visible."""
        output = self._find_output() if self.takes_video else None
        window = window_of(output) if output is not None else None
        return window is not None and is_painted(window)

    def show(self, picture: Picture) -> bool:
        """Show an image; return false if it was made for another type of sink.

        Raises:
            UnsupportedError: The surface does not accept such images.
        """
        painted = self.is_painted()
        made = picture.video if self.takes_video else picture.image
        if made is None or (painted and picture.image is None):
            return False
        if painted:
            self._find_painter().present(picture.image)
        elif is_alive(self._painter):
            self._painter.present(None)
        if not self.takes_video:
            self.item.present(made)
        elif QT6:
            self.item.setVideoFrame(made)
        else:
            self._present(made)
        return True

    def clear(self) -> None:
        """Remove the image from the screen; the item keeps its implicit size."""
        if is_alive(self._painter):
            self._painter.present(None)
        if not self.is_alive:
            return
        if not self.takes_video:
            self.item.present(None)
            return
        output = self._find_output()
        size = None if output is None else (output.implicitWidth(), output.implicitHeight())
        if QT6:
            self.item.setVideoFrame(self._multimedia.QVideoFrame())
        else:
            self.item.stop()
        if size is not None and all(size):
            output.setImplicitWidth(size[0])
            output.setImplicitHeight(size[1])

    def _find_output(self) -> Any:
        """Return the VideoOutput that a video sink belongs to; None until it is found."""
        if not is_alive(self._output):
            self._output = None
            if QT6:
                owner = self.item.parent()
                self._output = owner if isinstance(owner, QtQuick.QQuickItem) else None
            elif self._source is not None:
                # Qt 5's surface has no reference to its owner.
                self._output = next(
                    (
                        item
                        for item in all_items()
                        if item.inherits("QDeclarativeVideoOutput")
                        and item.property("source") is self._source
                    ),
                    None,
                )
        return self._output

    def _find_painter(self) -> Any:
        """Return the item that paints in a VideoOutput; created for the first image.

        Raises:
            UnsupportedError: The VideoOutput's engine does not have our types.
        """
        if not is_alive(self._painter):
            context = QtQml.QQmlEngine.contextForObject(self._output)
            engine = None if context is None else context.engine()
            if engine is None:
                raise UnsupportedError(f"{_NOT_DRAWN}: it is in no QML engine; use an ImageItem")
            url = QtCore.QUrl.fromLocalFile(str(_PAINTED_VIDEO))
            # Keep the component as long as its item: dropping it destroys the item.
            self._component = QtQml.QQmlComponent(engine, url)
            painter: Any = self._component.create()
            if painter is None:
                raise UnsupportedError(f"{_NOT_DRAWN}: {self._component.errorString().strip()}")
            painter.setProperty("clockwise", QT6)
            painter.setParentItem(self._output)
            self._painter = painter
        return self._painter

    def _present(self, video: Any) -> None:
        layout = (video.size(), video.pixelFormat())
        surface = self.item
        if surface.isActive() and layout != self._layout:
            surface.stop()
        if not surface.isActive():
            self._layout = layout
            if not surface.start(self._multimedia.QVideoSurfaceFormat(*layout)):
                raise UnsupportedError(
                    f"the video surface takes no images of {layout[1].name.decode()}; "
                    "show them in an ImageItem"
                )
        surface.present(video)


class ImageItem(QtQuick.QQuickPaintedItem):
    """An item that paints the newest image.

    Replaces a VideoOutput where that shows nothing: software rendering, offscreen, overlays,
    installations without QtMultimedia. It is its own ``videoSink``.
    """

    sourceChanged = Signal()

    @QtCore.QEnum
    class FillMode(IntEnum):
        """How an image of another aspect ratio fills the item; names and numbers of VideoOutput."""

        Stretch = 0
        PreserveAspectFit = 1
        PreserveAspectCrop = 2

    videoSink = Property(QtCore.QObject, lambda self: self, constant=True)
    source = Writable(QtCore.QObject, read=lambda self: self._source, write="_set_source")
    fillMode = Writable(int, 1, then="update")  # PreserveAspectFit
    hasFrame = ReadOnly(bool, False)

    _fillMode: int

    def __init__(self, parent: QtQuick.QQuickItem | None = None) -> None:
        super().__init__(parent)
        self._image: QtGui.QImage | None = None
        self._source: QtCore.QObject | None = None
        # PySide 6.11 never frees the Python half of an object created by QML.
        state = self.__dict__
        self.destroyed.connect(lambda: state.update(_image=None, _source=None))

    def present(self, image: QtGui.QImage | None) -> None:
        """Show an image, or clear the item with None; on the GUI thread only."""
        self._image = image
        if report(self, hasFrame=image is not None):
            self.update()

    def paint(self, painter: QtGui.QPainter) -> None:
        """Paint the image; Qt calls it on the render thread while the GUI thread waits."""
        image = self._image
        if image is None:
            return
        target, source = self._place(image)
        smooth = QtGui.QPainter.RenderHint.SmoothPixmapTransform
        painter.setRenderHint(smooth, self._is_smooth(target, source))
        painter.drawImage(target, image, source)

    def _is_smooth(self, target: QtCore.QRectF, source: QtCore.QRectF) -> bool:  # noqa: ARG002 - for subclasses
        """Return whether pixels are mixed where a part of the image is drawn."""
        return self.smooth()

    def _place(self, image: QtGui.QImage) -> tuple[QtCore.QRectF, QtCore.QRectF]:
        """Return the target rectangle and the part of the image drawn in it."""
        width, height = self.width(), self.height()
        whole = QtCore.QRectF(0, 0, image.width(), image.height())
        target = QtCore.QRectF(0, 0, width, height)
        if self._fillMode == self.FillMode.Stretch or not width or not height:
            return target, whole
        ratios = (width / image.width(), height / image.height())
        scale = min(ratios) if self._fillMode == self.FillMode.PreserveAspectFit else max(ratios)
        shown = QtCore.QSizeF(
            min(width, image.width() * scale), min(height, image.height() * scale)
        )
        target = QtCore.QRectF(QtCore.QPointF(0, 0), shown)
        target.moveCenter(QtCore.QPointF(width / 2, height / 2))
        part = QtCore.QRectF(QtCore.QPointF(0, 0), shown / scale)
        part.moveCenter(whole.center())
        return target, part

    def _set_source(self, source: QtCore.QObject | None) -> None:
        if source is self._source:
            return
        before = self._source
        # When an interface ends, QML may destroy the source before this item.
        if before is not None and is_alive(before) and before.property("videoSink") is self:
            before.setProperty("videoSink", None)
        self._source = source
        if source is not None:
            source.setProperty("videoSink", self)
        self.sourceChanged.emit()

"""Converts received images to video frames and images for displays, each step only once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import Error, UnsupportedError
from rosglass.extras import install_command
from rosglass.images import DEPTH_ENCODINGS, DepthColors, View, convert, reduce
from rosglass.images.depth import GreyLevels, GreyRange
from rosglass.images.encodings import PixelFormat
from rosglass.qt import QT6, QtCore, QtGui, optional

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from rosglass.comm.time import Time
    from rosglass.images.encodings import Frame, RawImage


__all__ = [
    "IMAGE_FORMATS",
    "VIDEO_FORMATS",
    "Look",
    "Picture",
    "Renderer",
    "VideoFrame",
    "to_image",
    "whole_frame",
]

_MULTIMEDIA = optional("QtMultimedia")
_ImageFormat = QtGui.QImage.Format
_IMAGE = {
    PixelFormat.RGBX: _ImageFormat.Format_RGBX8888,
    PixelFormat.RGBA: _ImageFormat.Format_RGBA8888,
    PixelFormat.BGRA: _ImageFormat.Format_ARGB32,
    PixelFormat.GRAY8: _ImageFormat.Format_Grayscale8,
    PixelFormat.GRAY16: _ImageFormat.Format_Grayscale16,
}
_VIDEO: dict[PixelFormat, Any] = {}
if _MULTIMEDIA is not None and QT6:
    _names = _MULTIMEDIA.QVideoFrameFormat.PixelFormat
    _VIDEO = {
        PixelFormat.RGBX: _names.Format_RGBX8888,
        PixelFormat.RGBA: _names.Format_RGBA8888,
        PixelFormat.BGRA: _names.Format_BGRA8888,
        PixelFormat.GRAY8: _names.Format_Y8,
        PixelFormat.GRAY16: _names.Format_Y16,
        PixelFormat.UYVY: _names.Format_UYVY,
        PixelFormat.YUYV: _names.Format_YUYV,
        PixelFormat.NV12: _names.Format_NV12,
        PixelFormat.NV21: _names.Format_NV21,
    }
#: Encodings that can be painted.
IMAGE_FORMATS = frozenset(_IMAGE)
#: Encodings for video sinks; empty without QtMultimedia. PySide2 cannot fill the planes of a
#: frame, so it needs an image first.
VIDEO_FORMATS = frozenset(_VIDEO if QT6 or _MULTIMEDIA is None else _IMAGE)


def to_image(frame: Frame) -> QtGui.QImage:
    """Return a frame as an image that shares its memory."""
    plane = frame.planes[0]
    # Rows of a QImage start at multiples of 4 bytes.
    if plane.strides[0] % 4 or not plane.flags.c_contiguous:
        padded = np.zeros((plane.shape[0], -(-plane.shape[1] // 4) * 4), np.uint8)
        padded[:, : plane.shape[1]] = plane
        plane = padded
    return QtGui.QImage(
        plane.data, frame.width, frame.height, plane.strides[0], _IMAGE[frame.format]
    )


class VideoFrame:
    """Builds a video frame; usable from any thread.

    Pass :attr:`allocate` to :func:`rosglass.images.convert`, and the result to :meth:`finish`.

    Raises:
        UnsupportedError: QtMultimedia is not installed.
    """

    def __init__(self) -> None:
        if _MULTIMEDIA is None:
            raise UnsupportedError(
                "a video sink needs QtMultimedia, which is not installed; install it with: "
                f"{install_command('camera')}, or show the image in an ImageItem"
            )
        self._video: Any = None
        #: Returns the memory of a new RGBX frame; None if Qt does not allow filling it.
        self.allocate = self._allocate if QT6 else None

    def finish(self, frame: Frame) -> Any:
        """Return `frame` as a ``QVideoFrame``, copying only planes that are not in it already."""
        if not QT6:
            kinds = (_ImageFormat.Format_RGB32, _ImageFormat.Format_ARGB32)
            image = to_image(frame).convertToFormat(kinds[frame.has_alpha])
            return _MULTIMEDIA.QVideoFrame(image)
        filled = False
        if self._video is not None:
            target = np.frombuffer(self._video.bits(0), np.uint8)
            filled = np.may_share_memory(target, frame.planes[0])
        if not filled:
            self._release()
            maps = self._map(frame.format, frame.width, frame.height)
            for plane, (memory, stride) in zip(frame.planes, maps, strict=True):
                rows = np.ndarray((plane.shape[0], stride), np.uint8, memory)
                rows[:, : plane.shape[1]] = plane
        video = self._video
        self._release()
        return video

    def _allocate(self, width: int, height: int) -> NDArray[np.uint8]:
        """Return the memory of a new RGBX frame, as an array of rows x columns x 4."""
        memory, stride = self._map(PixelFormat.RGBX, width, height)[0]
        pixels: NDArray[np.uint8] = np.ndarray(
            (height, width, 4), np.uint8, memory, 0, (stride, 4, 1)
        )
        return pixels

    def _map(self, format: PixelFormat, width: int, height: int) -> list[tuple[Any, int]]:
        """Create the frame and return the memory and stride of each of its planes."""
        layout = _MULTIMEDIA.QVideoFrameFormat(QtCore.QSize(width, height), _VIDEO[format])
        video = _MULTIMEDIA.QVideoFrame(layout)
        if not video.map(_MULTIMEDIA.QVideoFrame.MapMode.WriteOnly):
            raise UnsupportedError(
                f"Qt cannot make a {width}x{height} video frame of {format.value}"
            )
        self._video = video
        return [(video.bits(i), video.bytesPerLine(i)) for i in range(video.planeCount())]

    def _release(self) -> None:
        if self._video is not None:
            self._video.unmap()
        self._video = None


_WHOLE = View()
#: Factor by which a reduced image may be smaller than its size on the screen.
_UNSEEN = 1.05
#: Maximum number of colour settings whose automatic range is kept; a slider creates many.
_MOST_COLORS = 8


@dataclass(frozen=True, slots=True)
class Look:
    """The settings of a viewer's view; viewers with equal looks share their images.

    Attributes:
        video: Whether the viewer needs video frames; otherwise images.
        view: The visible part and its rotation.
        colors: Colour map, nearest and farthest depth for depth images; or how their numbers are
            shown as greys; None for greys of fixed depths.
        interval: Seconds between two images; 0 for all images.
        room: Width and height of the image on the screen, pixels, before rotation; larger
            images are reduced to about this size. None keeps their size.
        painted: Whether each video frame also needs an image, because only images are drawn.
    """

    video: bool = True
    view: View = _WHOLE
    colors: tuple[str, float | None, float | None] | GreyRange | None = None
    interval: float = 0.0
    room: tuple[int, int] | None = None
    painted: bool = False

    @property
    def kinds(self) -> set[bool]:
        """The formats that are needed: true for video frames, false for images."""
        return {self.video, self.video and not self.painted}

    def factor(self, image: RawImage) -> int:
        """Return the factor by which an image can be reduced without a visible difference."""
        if self.room is None or self.view.region is not None or self.view.zoom > 1:
            return 1
        ratio = min(image.width / self.room[0], image.height / self.room[1])
        return max(1, int(ratio * _UNSEEN))


@dataclass(frozen=True, slots=True)
class Picture:
    """A converted image for viewers.

    Attributes:
        frame: Its size, encoding and stamps; its planes may share the memory of `video`.
        video: The ``QVideoFrame``; None if not needed.
        image: The ``QImage``; None if not needed.
        received: Time of arrival.
        late: Seconds that it was delayed in transit.
        made: When it was ready, in seconds of the clock that measures ages.
        whole: The received image, if `frame` is smaller.
    """

    frame: Frame
    video: Any
    image: QtGui.QImage | None
    received: Time
    late: float
    made: float
    whole: RawImage | None = None


def whole_frame(picture: Picture, look: Look) -> Frame:
    """Return an image as a viewer shows it, at the received resolution."""
    if picture.whole is None:
        return picture.frame
    return look.view.apply(convert(picture.whole, IMAGE_FORMATS, picture.received))


class Renderer:
    """Converts the images of one stream; used by its thread only.

    Args:
        clock: The clock that measures ages.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        #: The depth colours adapt to the images, separately for each setting.
        self._colors: dict[Any, DepthColors | GreyLevels] = {}

    def render(
        self, image: RawImage, received: Time, late: float, looks: Iterable[Look]
    ) -> tuple[dict[Look, Picture], dict[Look, str]]:
        """Convert an image for each of the given looks.

        Args:
            image: The image as received.
            received: Time of arrival.
            late: Seconds that it was delayed in transit.
            looks: The wanted looks.

        Returns:
            The images, and the reasons for looks that this image cannot be shown with.

        Raises:
            DecodeError: The image is inconsistent.
            UnsupportedError: The image cannot be shown at all.
        """
        groups: dict[Any, dict[View, list[Look]]] = {}
        for look in looks:
            group = groups.setdefault((look.colors, look.factor(image)), {})
            group.setdefault(look.view, []).append(look)
        made: dict[Look, Picture] = {}
        failed: dict[Look, str] = {}
        for (colors, factor), views in groups.items():
            small = reduce(image, factor)
            kinds = {kind for members in views.values() for look in members for kind in look.kinds}
            # An unmodified image can be converted directly into the display's memory.
            straight = VideoFrame() if kinds == {True} and [*views] == [_WHOLE] else None
            frame = self._convert(small, received, colors, kinds, straight)
            for view, members in views.items():
                try:
                    seen = view.apply(frame)
                except Error as error:
                    failed |= dict.fromkeys(members, str(error))
                    continue
                wanted = {kind for look in members for kind in look.kinds}
                video = (straight or VideoFrame()).finish(seen) if True in wanted else None
                painted = to_image(seen) if False in wanted else None
                whole = image if small is not image else None
                picture = Picture(seen, video, painted, received, late, self._clock(), whole)
                made |= dict.fromkeys(members, picture)
        return made, failed

    def _convert(
        self,
        image: RawImage,
        received: Time,
        colors: Any,
        kinds: set[bool],
        straight: VideoFrame | None,
    ) -> Frame:
        allocate = None if straight is None else straight.allocate
        if colors is not None and image.encoding in DEPTH_ENCODINGS:
            painter = self._colors.get(colors)
            if painter is None:
                while len(self._colors) >= _MOST_COLORS:
                    del self._colors[next(iter(self._colors))]
                grey = isinstance(colors, GreyRange)
                painter = GreyLevels(colors) if grey else DepthColors(*colors)
                self._colors[colors] = painter
            if isinstance(painter, GreyLevels):
                return painter.convert(image, received)
            return painter.convert(image, received, allocate)
        accept = VIDEO_FORMATS if kinds == {True} else IMAGE_FORMATS
        if len(kinds) == 2:
            accept = IMAGE_FORMATS & VIDEO_FORMATS
        return convert(image, accept, received, allocate)

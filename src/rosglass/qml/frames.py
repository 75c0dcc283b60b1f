"""Pictures for Qt: video frames for a video sink or surface, images for painting."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import UnsupportedError
from rosglass.images.encodings import PixelFormat
from rosglass.qt import QT6, QtCore, QtGui, optional

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rosglass.images.encodings import Frame

__all__ = ["IMAGE_FORMATS", "VIDEO_FORMATS", "VideoFrame", "to_image"]

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
#: What can be painted.
IMAGE_FORMATS = frozenset(_IMAGE)
#: What a video sink takes; empty without QtMultimedia. PySide2 cannot fill the planes of a frame,
#: so there it goes by way of an image.
VIDEO_FORMATS = frozenset(_VIDEO if QT6 or _MULTIMEDIA is None else _IMAGE)


def to_image(frame: Frame) -> QtGui.QImage:
    """Return a frame as an image that shares its memory."""
    plane = frame.planes[0]
    # Rows of an image begin at multiples of 4 bytes.
    if plane.strides[0] % 4 or not plane.flags.c_contiguous:
        padded = np.zeros((plane.shape[0], -(-plane.shape[1] // 4) * 4), np.uint8)
        padded[:, : plane.shape[1]] = plane
        plane = padded
    return QtGui.QImage(
        plane.data, frame.width, frame.height, plane.strides[0], _IMAGE[frame.format]
    )


class VideoFrame:
    """A video frame in the making; usable from any thread.

    Pass :attr:`allocate` to :func:`rosglass.images.convert`, and what that returns to
    :meth:`finish`.

    Raises:
        UnsupportedError: QtMultimedia is not installed.
    """

    def __init__(self) -> None:
        if _MULTIMEDIA is None:
            raise UnsupportedError(
                "a video sink needs QtMultimedia, which is not installed; install it with: "
                'pip install "rosglass[camera]", or show the picture in an ImageItem'
            )
        self._video: Any = None
        #: Gives the memory of a new RGBX frame; None where Qt does not let it be filled.
        self.allocate = self._allocate if QT6 else None

    def finish(self, frame: Frame) -> Any:
        """Return the ``QVideoFrame`` of `frame`, copying only what is not in it already."""
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
        """Return the memory of a new RGBX frame, as rows x columns x 4."""
        memory, stride = self._map(PixelFormat.RGBX, width, height)[0]
        pixels: NDArray[np.uint8] = np.ndarray(
            (height, width, 4), np.uint8, memory, 0, (stride, 4, 1)
        )
        return pixels

    def _map(self, format: PixelFormat, width: int, height: int) -> list[tuple[Any, int]]:
        """Make the frame and return memory and stride of each of its planes."""
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

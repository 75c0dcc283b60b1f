"""Region, zoom, mirroring and rotation of a frame for display, and saving it to a file."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rosglass.errors import UnsupportedError
from rosglass.images.encodings import PixelFormat, opencv, to_rgbx

if TYPE_CHECKING:
    from rosglass.images.encodings import Frame

__all__ = ["FILE_TYPES", "View", "save"]


_PIXEL_BYTES = {
    PixelFormat.RGBX: 4,
    PixelFormat.RGBA: 4,
    PixelFormat.BGRA: 4,
    PixelFormat.GRAY8: 1,
    PixelFormat.GRAY16: 2,
}


@dataclass(frozen=True, slots=True)
class View:
    """The view of an image: a region, whose centre is zoomed, mirrored and rotated.

    Attributes:
        rotation: Rotation clockwise in degrees, a multiple of 90.
        mirrored: Whether left and right are swapped.
        flipped: Whether top and bottom are swapped.
        region: x, y, width and height of the part to show, in pixels of the received image; None
            for all of it.
        zoom: Zoom factor: 2 shows the centre half of width and height. Pixels are not scaled; the
            display does that.

    Raises:
        UnsupportedError: The rotation is not a multiple of 90, the region is empty, or the zoom is
            below 1.
    """

    rotation: int = 0
    mirrored: bool = False
    flipped: bool = False
    region: tuple[int, int, int, int] | None = None
    zoom: float = 1.0

    def __post_init__(self) -> None:
        if self.rotation % 90:
            raise UnsupportedError(
                f"the image cannot be rotated by {self.rotation} degrees; give a multiple of 90"
            )
        if self.region is not None:
            x, y, width, height = self.region
            if x < 0 or y < 0 or width < 1 or height < 1:
                raise UnsupportedError(
                    f"the region x={x} y={y} {width}x{height} is not part of an image; give "
                    "x and y from 0, width and height from 1"
                )
        if not 1 <= self.zoom < float("inf"):
            raise UnsupportedError(
                f"the image cannot be enlarged {self.zoom} times; give 1 or more"
            )

    def apply(self, frame: Frame) -> Frame:
        """Return the view of a frame; shares its memory if it is not mirrored or rotated.

        Raises:
            UnsupportedError: The region is not within the image, or OpenCV is not installed.
        """
        turned = self.rotation % 360
        moves = turned or self.mirrored or self.flipped
        if self.region is not None:
            frame = _crop(frame, *self.region)
        if self.zoom > 1:
            frame = _crop(frame, *_center_region(frame.width, frame.height, self.zoom))
        if not moves:
            return frame
        if frame.format not in _PIXEL_BYTES:
            frame = to_rgbx(frame)
        rows, size = frame.planes[0], _PIXEL_BYTES[frame.format]
        pixels = rows.view(np.uint16) if size == 2 else rows
        if size == 4:
            pixels = rows.reshape(frame.height, frame.width, 4)
        cv2 = opencv()
        if self.mirrored or self.flipped:
            both = self.mirrored and self.flipped
            pixels = cv2.flip(pixels, -1 if both else int(self.mirrored))
        if turned:
            names = {90: "90_CLOCKWISE", 180: "180", 270: "90_COUNTERCLOCKWISE"}
            pixels = cv2.rotate(pixels, getattr(cv2, f"ROTATE_{names[turned]}"))
        height, width = pixels.shape[:2]
        plane = np.ascontiguousarray(pixels).reshape(height, -1).view(np.uint8)
        return replace(frame, width=width, height=height, planes=(plane,))


def _center_region(width: int, height: int, zoom: float) -> tuple[int, int, int, int]:
    """Return the centre region at even coordinates, which needs no conversion of YUV."""
    x, y = (round(size * (1 - 1 / zoom) / 4) * 2 for size in (width, height))
    x, y = min(x, (width - 1) // 4 * 2), min(y, (height - 1) // 4 * 2)
    return x, y, width - 2 * x, height - 2 * y


def _crop(frame: Frame, x: int, y: int, width: int, height: int) -> Frame:
    if x + width > frame.width or y + height > frame.height:
        raise UnsupportedError(
            f"the region x={x} y={y} {width}x{height} is not within the image of "
            f"{frame.width}x{frame.height} pixels"
        )
    if frame.format in {PixelFormat.NV12, PixelFormat.NV21}:
        if not (x % 2 or y % 2 or width % 2 or height % 2):
            luma, chroma = frame.planes
            planes = (
                luma[y : y + height, x : x + width],
                chroma[y // 2 : (y + height) // 2, x : x + width],
            )
            return replace(frame, width=width, height=height, planes=planes)
        frame = to_rgbx(frame)
    elif frame.format not in _PIXEL_BYTES and (x % 2 or width % 2):
        frame = to_rgbx(frame)
    size = _PIXEL_BYTES.get(frame.format, 2)
    plane = frame.planes[0][y : y + height, x * size : (x + width) * size]
    return replace(frame, width=width, height=height, planes=(plane,))


#: File extensions that :func:`save` supports.
FILE_TYPES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp", ".bmp")
_DEEP = (".png", ".tif", ".tiff")
_JPEG_QUALITY = 95


def save(frame: Frame, path: str | Path) -> Path:
    """Save a frame to a file of the type given by its extension (:data:`FILE_TYPES`).

    The file is written atomically. 16-bit greys (depth in millimetres) keep all bits; PNG and TIFF
    keep transparency.

    Args:
        frame: The frame.
        path: The file; an existing one is replaced.

    Returns:
        The absolute path.

    Raises:
        UnsupportedError: The type is unknown or cannot store the image, the file cannot be
            written, or OpenCV is not installed.
    """
    file = Path(path).expanduser().absolute()
    kind = file.suffix.lower()
    if kind not in FILE_TYPES:
        raise UnsupportedError(
            f"{file}: an image cannot be saved as {kind or 'a file without an ending'!r}; "
            f"these work: {', '.join(FILE_TYPES)}"
        )
    if frame.format is PixelFormat.GRAY16 and kind not in _DEEP:
        raise UnsupportedError(
            f"{file}: {kind} cannot hold 16-bit greys such as depths; save it as .png or .tiff"
        )
    cv2 = opencv()
    settings = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY] if kind in {".jpg", ".jpeg"} else []
    try:
        good, data = cv2.imencode(kind, _pixels(frame, kind in _DEEP), settings)
    except cv2.error as error:
        raise UnsupportedError(f"{file}: the image cannot be saved: {error}") from None
    if not good:
        raise UnsupportedError(f"{file}: the image cannot be saved as {kind}")
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    try:
        part.write_bytes(data)
        part.replace(file)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise UnsupportedError(f"{file}: cannot be written: {error.strerror}") from None
    return file


def _pixels(frame: Frame, alpha: bool) -> np.ndarray[tuple[int, ...], np.dtype[np.generic]]:
    """Return the pixels in OpenCV's channel order."""
    if frame.format is PixelFormat.GRAY8:
        return frame.planes[0]
    if frame.format is PixelFormat.GRAY16:
        return np.ascontiguousarray(frame.planes[0]).view(np.uint16)
    if frame.format not in {PixelFormat.RGBX, PixelFormat.RGBA, PixelFormat.BGRA}:
        frame = to_rgbx(frame)
    pixels = frame.planes[0].reshape(frame.height, frame.width, 4)
    if frame.format is not PixelFormat.BGRA:
        pixels = pixels[..., [2, 1, 0, 3]]
    return np.ascontiguousarray(pixels if alpha and frame.has_alpha else pixels[..., :3])

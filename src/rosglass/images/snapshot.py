"""Snapshots: a picture into a file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rosglass.errors import UnsupportedError
from rosglass.images.encodings import opencv, to_rgbx
from rosglass.images.frame import PixelFormat

if TYPE_CHECKING:
    from rosglass.images.frame import Frame

__all__ = ["FILE_TYPES", "save"]

#: Kinds of files, by the end of their names.
FILE_TYPES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp", ".bmp")
_DEEP = (".png", ".tif", ".tiff")
_JPEG_QUALITY = 95


def save(frame: Frame, path: str | Path) -> Path:
    """Write a picture to a file; its name tells the kind (:data:`FILE_TYPES`).

    The file appears whole or not at all. 16-bit greys (depth in millimetres) keep all their bits;
    transparency is kept in PNG and TIFF.

    Args:
        frame: The picture.
        path: The file; one that exists is replaced.

    Returns:
        Its absolute path.

    Raises:
        UnsupportedError: The kind is unknown or cannot hold the picture, the file cannot be
            written, or OpenCV is not installed.
    """
    file = Path(path).expanduser().absolute()
    kind = file.suffix.lower()
    if kind not in FILE_TYPES:
        raise UnsupportedError(
            f"{file}: a picture cannot be saved as {kind or 'a file without an ending'!r}; "
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
        raise UnsupportedError(f"{file}: the picture cannot be saved: {error}") from None
    if not good:
        raise UnsupportedError(f"{file}: the picture cannot be saved as {kind}")
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    try:
        part.write_bytes(data)
        part.replace(file)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise UnsupportedError(f"{file}: cannot be written: {error.strerror}") from None
    return file


def _pixels(frame: Frame, alpha: bool) -> np.ndarray[tuple[int, ...], np.dtype[np.generic]]:
    """Return the pixels in OpenCV's order of channels."""
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

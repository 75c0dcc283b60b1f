"""How a picture is looked at: a region of it, enlarged, mirrored, turned."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rosglass.errors import UnsupportedError
from rosglass.images.encodings import opencv, to_rgbx
from rosglass.images.frame import PixelFormat

if TYPE_CHECKING:
    from rosglass.images.frame import Frame

__all__ = ["View"]

_PIXEL_BYTES = {
    PixelFormat.RGBX: 4,
    PixelFormat.RGBA: 4,
    PixelFormat.BGRA: 4,
    PixelFormat.GRAY8: 1,
    PixelFormat.GRAY16: 2,
}


@dataclass(frozen=True, slots=True)
class View:
    """How a picture is looked at: the region is cut out, its middle enlarged, mirrored, turned.

    Attributes:
        rotation: Degrees clockwise, a multiple of 90.
        mirrored: Whether left and right change places.
        flipped: Whether top and bottom change places.
        region: x, y, width and height of the part to show, pixels of the picture as received;
            None shows it whole.
        zoom: How many times the middle is enlarged: 2 shows the middle half of width and height.
            Pixels are left as they are: enlarging them is the display's work.

    Raises:
        UnsupportedError: The rotation is no multiple of 90, the region is empty, or the zoom is
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
                f"a picture cannot be turned by {self.rotation} degrees; give a multiple of 90"
            )
        if self.region is not None:
            x, y, width, height = self.region
            if x < 0 or y < 0 or width < 1 or height < 1:
                raise UnsupportedError(
                    f"the region x={x} y={y} {width}x{height} is no part of a picture; give "
                    "x and y from 0, width and height from 1"
                )
        if not 1 <= self.zoom < float("inf"):
            raise UnsupportedError(
                f"a picture cannot be enlarged {self.zoom} times; give 1 or more"
            )

    def apply(self, frame: Frame) -> Frame:
        """Return the picture as it is looked at; shares its memory where nothing moves.

        Raises:
            UnsupportedError: The region is not within the picture, or OpenCV is not installed.
        """
        turned = self.rotation % 360
        moves = turned or self.mirrored or self.flipped
        if self.region is not None:
            frame = _cut(frame, *self.region)
        if self.zoom > 1:
            frame = _cut(frame, *_middle(frame.width, frame.height, self.zoom))
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


def _middle(width: int, height: int, zoom: float) -> tuple[int, int, int, int]:
    """Return the middle of a picture, at even places: those cost no conversion of YUV."""
    x, y = (round(size * (1 - 1 / zoom) / 4) * 2 for size in (width, height))
    x, y = min(x, (width - 1) // 4 * 2), min(y, (height - 1) // 4 * 2)
    return x, y, width - 2 * x, height - 2 * y


def _cut(frame: Frame, x: int, y: int, width: int, height: int) -> Frame:
    if x + width > frame.width or y + height > frame.height:
        raise UnsupportedError(
            f"the region x={x} y={y} {width}x{height} is not within the picture of "
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

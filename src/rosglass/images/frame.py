"""What every picture looks like inside rosglass: as received, and ready to be shown."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rosglass.comm.time import Time

__all__ = ["Frame", "PixelFormat", "RawImage"]


class PixelFormat(Enum):
    """Memory layouts that a display takes as they are; bytes in order of rising address."""

    RGBX = "rgbx"
    RGBA = "rgba"
    BGRA = "bgra"
    GRAY8 = "gray8"
    GRAY16 = "gray16"
    UYVY = "uyvy"
    YUYV = "yuyv"
    NV12 = "nv12"
    NV21 = "nv21"


@dataclass(frozen=True, slots=True)
class RawImage:
    """The parts of a ``sensor_msgs/msg/Image`` that conversion needs.

    Attributes:
        width: Columns, pixels.
        height: Rows, pixels.
        encoding: Encoding name as in ``sensor_msgs/image_encodings.hpp``.
        step: Bytes from one row to the next.
        data: The pixels.
        big_endian: Whether pixels of more than one byte are big endian.
        stamp: When the picture was taken, None when the header says nothing.
        frame_id: Coordinate frame of the camera.
    """

    width: int
    height: int
    encoding: str
    step: int
    data: Any
    big_endian: bool = False
    stamp: Time | None = None
    frame_id: str = ""


@dataclass(frozen=True, slots=True)
class Frame:
    """A picture that can be shown without another conversion.

    Attributes:
        format: Layout of the planes.
        width: Columns, pixels.
        height: Rows, pixels.
        planes: One array of rows x bytes per plane; they may share the received buffer.
        encoding: Encoding it was received in.
        stamp: When the picture was taken, None when the header says nothing.
        received: When it arrived, None when it was made here.
    """

    format: PixelFormat
    width: int
    height: int
    planes: tuple[NDArray[np.uint8], ...] = field(repr=False)
    encoding: str = ""
    stamp: Time | None = None
    received: Time | None = None

    @property
    def has_alpha(self) -> bool:
        """Whether pixels can be transparent."""
        return self.format in {PixelFormat.RGBA, PixelFormat.BGRA}

    @property
    def is_color(self) -> bool:
        """Whether it has colours."""
        return self.format not in {PixelFormat.GRAY8, PixelFormat.GRAY16}

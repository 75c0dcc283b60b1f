"""Image encodings: received images, frames for a display, and the conversion in at most one pass.

Names follow ROS's ``sensor_msgs/image_encodings.hpp``. Images that a display accepts as they are
share the received buffer.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import DecodeError, UnsupportedError
from rosglass.extras import install_command

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from rosglass.comm.time import Time

    Array = NDArray[Any]

__all__ = [
    "ANY_FORMAT",
    "ENCODINGS",
    "MAX_PIXELS",
    "Encoding",
    "Frame",
    "PixelFormat",
    "RawImage",
    "convert",
    "opencv",
    "pixels_of",
    "reduce",
    "to_rgbx",
]


class PixelFormat(Enum):
    """Memory layouts that a display accepts; bytes in order of rising address."""

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
    """The fields of a ``sensor_msgs/msg/Image`` that conversion needs.

    Attributes:
        width: Number of columns in pixels.
        height: Number of rows in pixels.
        encoding: Encoding name as in ``sensor_msgs/image_encodings.hpp``.
        step: Distance between rows in bytes.
        data: The pixels.
        big_endian: Whether values of more than one byte are big-endian.
        stamp: Time of the image; None if the header has none.
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
    """An image that can be displayed without further conversion.

    Attributes:
        format: Layout of the planes.
        width: Number of columns in pixels.
        height: Number of rows in pixels.
        planes: One array of rows x bytes per plane; they may share the received buffer.
        encoding: Encoding as received.
        stamp: Time of the image; None if the header has none.
        received: Time of reception; None if it was created here.
        frame_id: Coordinate frame of the camera.
    """

    format: PixelFormat
    width: int
    height: int
    planes: tuple[NDArray[np.uint8], ...] = field(repr=False)
    encoding: str = ""
    stamp: Time | None = None
    received: Time | None = None
    frame_id: str = ""

    @classmethod
    def of(
        cls,
        image: RawImage,
        format: PixelFormat,
        planes: tuple[NDArray[np.uint8], ...],
        received: Time | None,
    ) -> Frame:
        """Return the frame of a received image whose pixels were converted."""
        size = image.width, image.height
        return cls(format, *size, planes, image.encoding, image.stamp, received, image.frame_id)

    @property
    def has_alpha(self) -> bool:
        """True if pixels have an alpha channel."""
        return self.format in {PixelFormat.RGBA, PixelFormat.BGRA}

    @property
    def is_color(self) -> bool:
        """True if pixels have colours, not only a brightness."""
        return self.format not in {PixelFormat.GRAY8, PixelFormat.GRAY16}


#: The formats of a display that accepts all.
ANY_FORMAT = frozenset(PixelFormat)
#: Larger images are refused: they are corrupt, or would exhaust the memory of the operator's PC.
MAX_PIXELS = 1 << 26
_IMAGE = "sensor_msgs/msg/Image"


@dataclass(frozen=True, slots=True)
class Encoding:
    """The memory layout of an encoding, and its conversion for a display.

    Attributes:
        channels: Values per pixel (2 for packed YUV 4:2:2).
        size: Bytes per value.
        direct: Format in which a display accepts the pixels unchanged; None if there is none.
        code: Name of OpenCV's conversion to RGBA; empty if `direct` is always accepted.
        special: Conversion function to use instead.
        rows: Rows in memory per row of pixels, as a fraction: (3, 2) for planar 4:2:0, (3, 1) for
            planar 4:4:4, whose chroma rows are twice as long.
    """

    channels: int
    size: int = 1
    direct: PixelFormat | None = None
    code: str = ""
    special: Callable[[Array], tuple[PixelFormat, Array]] | None = None
    rows: tuple[int, int] = (1, 1)


def _high_bytes(pixels: Array) -> Array:
    return (pixels >> 8).astype("u1")


def _depth_in_millimetres(pixels: Array) -> tuple[PixelFormat, Array]:
    """Convert metres to millimetres; 0 means unknown, as in 16UC1 depth images (REP 118)."""
    known = np.isfinite(pixels) & (pixels > 0)
    out = np.zeros(pixels.shape, np.uint16)
    np.clip(np.where(known, pixels, 0) * 1000, 1, 65535, out=out, where=known, casting="unsafe")
    return PixelFormat.GRAY16, out


def _two_channels(pixels: Array) -> tuple[PixelFormat, Array]:
    """Show two channels of unknown meaning as red and green."""
    out = np.zeros((*pixels.shape[:2], 4), np.uint8)
    out[..., :2] = pixels
    out[..., 3] = 255
    return PixelFormat.RGBX, out


def _nv24(pixels: Array) -> tuple[PixelFormat, Array]:
    height, width = pixels.shape[0] // 3, pixels.shape[1]
    chroma = np.lib.stride_tricks.as_strided(
        pixels[height:], (height, width, 2), (2 * pixels.strides[0], 2, 1)
    )
    cv2 = opencv()
    luma = pixels[:height]
    u, v = cv2.split(chroma)
    # OpenCV has no 4:4:4 of this range: each pixel becomes a pair of 4:2:2, of which one is kept.
    pairs = cv2.merge([luma, u, luma, v]).reshape(height, 2 * width, 2)
    twice = _to_rgba(pairs, "YUV2RGBA_YUY2").view(np.uint32)
    return PixelFormat.RGBX, twice.reshape(height, 2 * width)[:, ::2].copy()


def _wide(code: str, format: PixelFormat) -> Callable[[Array], tuple[PixelFormat, Array]]:
    """Return a conversion of 16-bit colours that keeps the high bytes."""

    def convert_wide(pixels: Array) -> tuple[PixelFormat, Array]:
        return format, _to_rgba(_high_bytes(pixels), code)

    return convert_wide


#: All supported encodings.
ENCODINGS: dict[str, Encoding] = {
    "rgb8": Encoding(3, code="RGB2RGBA"),
    "bgr8": Encoding(3, code="BGR2RGBA"),
    "8UC3": Encoding(3, code="BGR2RGBA"),
    "rgba8": Encoding(4, direct=PixelFormat.RGBA),
    "bgra8": Encoding(4, direct=PixelFormat.BGRA),
    "8UC4": Encoding(4, direct=PixelFormat.BGRA),
    "mono8": Encoding(1, direct=PixelFormat.GRAY8),
    "8UC1": Encoding(1, direct=PixelFormat.GRAY8),
    "8UC2": Encoding(2, special=_two_channels),
    "mono16": Encoding(1, 2, direct=PixelFormat.GRAY16),
    "16UC1": Encoding(1, 2, direct=PixelFormat.GRAY16),
    "32FC1": Encoding(1, 4, special=_depth_in_millimetres),
    "rgb16": Encoding(3, 2, special=_wide("RGB2RGBA", PixelFormat.RGBX)),
    "bgr16": Encoding(3, 2, special=_wide("BGR2RGBA", PixelFormat.RGBX)),
    "rgba16": Encoding(4, 2, special=_wide("", PixelFormat.RGBA)),
    "bgra16": Encoding(4, 2, special=_wide("", PixelFormat.BGRA)),
    "yuv422": Encoding(2, direct=PixelFormat.UYVY, code="YUV2RGBA_UYVY"),
    "uyvy": Encoding(2, direct=PixelFormat.UYVY, code="YUV2RGBA_UYVY"),
    "yuv422_yuy2": Encoding(2, direct=PixelFormat.YUYV, code="YUV2RGBA_YUY2"),
    "yuyv": Encoding(2, direct=PixelFormat.YUYV, code="YUV2RGBA_YUY2"),
    "nv12": Encoding(1, direct=PixelFormat.NV12, code="YUV2RGBA_NV12", rows=(3, 2)),
    "nv21": Encoding(1, direct=PixelFormat.NV21, code="YUV2RGBA_NV21", rows=(3, 2)),
    "nv24": Encoding(1, special=_nv24, rows=(3, 1)),
}
for _order in ("rggb", "bggr", "gbrg", "grbg"):
    _code = f"Bayer{_order.upper()}2RGBA"
    ENCODINGS[f"bayer_{_order}8"] = Encoding(1, code=_code)
    ENCODINGS[f"bayer_{_order}16"] = Encoding(1, 2, special=_wide(_code, PixelFormat.RGBX))


@cache
def opencv() -> Any:
    """Import OpenCV when it is first needed, and return it.

    Raises:
        UnsupportedError: It is not installed.
    """
    try:
        return import_module("cv2")
    except ImportError:
        raise UnsupportedError(
            "this image needs OpenCV, which is not installed; "
            f"install it with: {install_command('camera')}"
        ) from None


def _to_rgba(pixels: Array, code: str, out: Array | None = None) -> Array:
    if not code:
        return pixels
    cv2 = opencv()
    try:
        rgba: Array = cv2.cvtColor(pixels, getattr(cv2, f"COLOR_{code}"), dst=out)
    except cv2.error as error:
        raise DecodeError(
            _IMAGE, f"cannot convert pixels of shape {pixels.shape}: {error}"
        ) from None
    return rgba


def pixels_of(image: RawImage, encoding: Encoding) -> Array:
    """Return the pixels as rows x columns (x channels), sharing the received buffer.

    Raises:
        DecodeError: Sizes, step and data are inconsistent.
    """
    rows, remainder = divmod(image.height * encoding.rows[0], encoding.rows[1])
    row_bytes = image.width * encoding.channels * encoding.size
    size = memoryview(image.data).nbytes
    if image.width < 1 or image.height < 1:
        raise DecodeError(_IMAGE, f"the image is {image.width}x{image.height} pixels", "width")
    if image.width * image.height > MAX_PIXELS:
        raise DecodeError(
            _IMAGE,
            f"{image.width}x{image.height} pixels are more than {MAX_PIXELS} can be shown",
            "width",
        )
    if remainder or (encoding.direct in _EVEN_WIDTH and image.width % 2):
        raise DecodeError(
            _IMAGE,
            f"{image.encoding} needs an even width and height, not {image.width}x{image.height}",
            "width",
        )
    if image.step < row_bytes:
        raise DecodeError(
            _IMAGE,
            f"{image.width} pixels of {image.encoding} need {row_bytes} bytes per row, "
            f"step is {image.step}",
            "step",
        )
    # Some drivers omit the padding of the last row.
    needed = image.step * (rows - 1) + row_bytes
    if size < needed:
        raise DecodeError(
            _IMAGE,
            f"{image.width}x{image.height} {image.encoding} with step {image.step} needs "
            f"{needed} bytes, data has {size}",
            "data",
        )
    dtype = {1: "u1", 2: "u2", 4: "f4"}[encoding.size]
    order = ">" if image.big_endian else "<"
    shape: tuple[int, ...] = (rows, image.width)
    strides: tuple[int, ...] = (image.step, encoding.channels * encoding.size)
    if encoding.channels > 1:
        shape, strides = (*shape, encoding.channels), (*strides, encoding.size)
    pixels: Array = np.ndarray(shape, np.dtype(order + dtype), image.data, 0, strides)
    if encoding.size > 1 and image.big_endian == (sys.byteorder == "little"):
        pixels = pixels.astype(pixels.dtype.newbyteorder("="))
    return pixels


_EVEN_WIDTH = {PixelFormat.UYVY, PixelFormat.YUYV, PixelFormat.NV12, PixelFormat.NV21}


def _rows_of_bytes(pixels: Array) -> NDArray[np.uint8]:
    """View pixels as rows x bytes; copies only if the values of a row are not adjacent."""
    if not pixels[0].flags.c_contiguous:
        pixels = np.ascontiguousarray(pixels)
    width = pixels[0].nbytes
    values = pixels.reshape(pixels.shape[0], -1) if pixels.flags.c_contiguous else pixels
    return np.lib.stride_tricks.as_strided(
        values.view(np.uint8), (pixels.shape[0], width), (pixels.strides[0], 1)
    )


def to_rgbx(frame: Frame) -> Frame:
    """Convert a YUV or 8-bit grey frame to RGBX.

    Raises:
        UnsupportedError: OpenCV is not installed, or the format is another.
    """
    cv2 = opencv()
    layout, width = frame.format, frame.width
    if layout in {PixelFormat.NV12, PixelFormat.NV21}:
        code = getattr(cv2, f"COLOR_YUV2RGBA_{layout.name}")
        out = cv2.cvtColorTwoPlane(
            frame.planes[0], frame.planes[1].reshape(frame.height // 2, width // 2, 2), code
        )
    elif layout in {PixelFormat.UYVY, PixelFormat.YUYV}:
        code = "UYVY" if layout is PixelFormat.UYVY else "YUY2"
        out = _to_rgba(frame.planes[0].reshape(frame.height, width, 2), f"YUV2RGBA_{code}")
    elif layout is PixelFormat.GRAY8:
        out = _to_rgba(frame.planes[0], "GRAY2RGBA")
    else:
        raise UnsupportedError(f"an image of {layout.value} cannot be converted to RGBX")
    return replace(frame, format=PixelFormat.RGBX, planes=(_rows_of_bytes(out),))


def convert(
    image: RawImage,
    accept: frozenset[PixelFormat] = ANY_FORMAT,
    received: Time | None = None,
    allocate: Callable[[int, int], Array] | None = None,
) -> Frame:
    """Convert an image for display.

    Depth in metres (32FC1) becomes millimetres, as in 16UC1 depth images; 16-bit colours keep their
    high bytes; 8UC3 and 8UC4 are BGR(A) as in OpenCV; 8UC2 is displayed as red and green.

    Args:
        image: The image as received.
        accept: Formats that all displays accept; RGBX, RGBA, BGRA, GRAY8 and GRAY16 are always
            assumed.
        received: Time of reception.
        allocate: Returns memory for an image of a width and height, as rows x columns x RGBX; used
            if colours are converted, to write them directly to the display's memory.

    Raises:
        UnsupportedError: The encoding is not supported.
        DecodeError: Sizes, step and data are inconsistent.
    """
    encoding = ENCODINGS.get(image.encoding)
    if encoding is None:
        raise UnsupportedError(
            f"image encoding {image.encoding[:40]!r} cannot be shown; "
            f"these can: {', '.join(sorted(ENCODINGS))}"
        )
    pixels = pixels_of(image, encoding)
    if encoding.special is not None:
        layout, out = encoding.special(pixels)
    elif encoding.direct is not None and (not encoding.code or encoding.direct in accept):
        layout, out = encoding.direct, pixels
    else:
        memory = None if allocate is None else allocate(image.width, image.height)
        layout, out = PixelFormat.RGBX, _to_rgba(pixels, encoding.code, memory)
    rows = _rows_of_bytes(out)
    planes: tuple[NDArray[np.uint8], ...] = (rows,)
    if layout in {PixelFormat.NV12, PixelFormat.NV21}:
        planes = (rows[: image.height], rows[image.height :])
    return Frame.of(image, layout, planes, received)


#: Encodings whose pixels can be averaged. Depths cannot: 0 is unknown, not near. YUV is small
#: anyway.
_REDUCIBLE = frozenset({"rgb8", "bgr8", "rgba8", "bgra8", "mono8", "8UC1", "8UC3", "8UC4"})


def reduce(image: RawImage, factor: int) -> RawImage:
    """Reduce width and height of an image by a factor, averaging pixels.

    An image whose encoding does not allow it, or that is too small, is returned unchanged.

    Raises:
        DecodeError: Sizes, step and data are inconsistent.
        UnsupportedError: OpenCV is not installed.
    """
    width, height = image.width // factor, image.height // factor
    if factor < 2 or image.encoding not in _REDUCIBLE or not width or not height:
        return image
    cv2 = opencv()
    pixels = pixels_of(image, ENCODINGS[image.encoding])
    # Remaining columns and rows would shift all others by a fraction of a pixel.
    pixels = pixels[: height * factor, : width * factor]
    small = cv2.resize(pixels, (width, height), interpolation=cv2.INTER_AREA)
    return replace(image, width=width, height=height, step=small.strides[0], data=small.reshape(-1))

"""Image encodings: from a camera's pixels to something a display takes, in at most one pass.

Names follow ROS's ``sensor_msgs/image_encodings.hpp``. What can be shown as it is shares the
received buffer.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import DecodeError, UnsupportedError
from rosglass.images.frame import Frame, PixelFormat, RawImage

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
    "convert",
    "opencv",
    "pixels_of",
    "to_rgbx",
]

#: A display that takes everything.
ANY_FORMAT = frozenset(PixelFormat)
#: Larger pictures are refused: they are garbage, or would fill the memory of the operator's PC.
MAX_PIXELS = 1 << 26
_IMAGE = "sensor_msgs/msg/Image"


@dataclass(frozen=True, slots=True)
class Encoding:
    """How pixels lie in memory and how they get onto a display.

    Attributes:
        channels: Values per pixel (2 for packed YUV 4:2:2).
        size: Bytes per value.
        direct: Layout under which a display takes the pixels unchanged, None when there is none.
        code: Name of OpenCV's conversion to RGBA, empty when `direct` is always accepted.
        special: Conversion by a function of this module instead.
        rows: Rows in memory per row of pixels, as a fraction: (3, 2) for planar 4:2:0, (3, 1) for
            planar 4:4:4, whose rows of chroma are twice as long.
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
    """Turn metres into millimetres; 0 means unknown, as in 16UC1 depth images (REP 118)."""
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
    # OpenCV knows no 4:4:4 of this range: each pixel becomes a pair of 4:2:2, of which one is kept.
    pairs = cv2.merge([luma, u, luma, v]).reshape(height, 2 * width, 2)
    twice = _to_rgba(pairs, "YUV2RGBA_YUY2").view(np.uint32)
    return PixelFormat.RGBX, twice.reshape(height, 2 * width)[:, ::2].copy()


def _wide(code: str, format: PixelFormat) -> Callable[[Array], tuple[PixelFormat, Array]]:
    """Return a conversion of 16-bit colours that keeps the high bytes."""

    def convert_wide(pixels: Array) -> tuple[PixelFormat, Array]:
        return format, _to_rgba(_high_bytes(pixels), code)

    return convert_wide


#: Every encoding that can be shown.
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
    """Return OpenCV; imported late because it takes its time.

    Raises:
        UnsupportedError: It is not installed.
    """
    try:
        return import_module("cv2")
    except ImportError:
        raise UnsupportedError(
            "this picture needs OpenCV, which is not installed; "
            'install it with: pip install "rosglass[camera]"'
        ) from None


def _to_rgba(pixels: Array, code: str, out: Array | None = None) -> Array:
    if not code:
        return pixels
    cv2 = opencv()
    try:
        rgba: Array = cv2.cvtColor(pixels, getattr(cv2, f"COLOR_{code}"), dst=out)
    except cv2.error as error:
        raise DecodeError(_IMAGE, f"cannot convert a picture of {pixels.shape}: {error}") from None
    return rgba


def pixels_of(image: RawImage, encoding: Encoding) -> Array:
    """Return the pixels as rows x columns (x channels), sharing the received buffer.

    Raises:
        DecodeError: Sizes, step and data contradict each other.
    """
    rows, remainder = divmod(image.height * encoding.rows[0], encoding.rows[1])
    row_bytes = image.width * encoding.channels * encoding.size
    size = memoryview(image.data).nbytes
    if image.width < 1 or image.height < 1:
        raise DecodeError(_IMAGE, f"the picture is {image.width}x{image.height} pixels", "width")
    if image.width * image.height > MAX_PIXELS:
        raise DecodeError(
            _IMAGE,
            f"{image.width}x{image.height} pixels are more than {MAX_PIXELS} can be shown",
            "width",
        )
    if remainder or (encoding.direct in _EVEN_WIDTH and image.width % 2):
        raise DecodeError(
            _IMAGE,
            f"{image.encoding} needs even sizes, the picture is {image.width}x{image.height}",
            "width",
        )
    if image.step < row_bytes:
        raise DecodeError(
            _IMAGE,
            f"{image.width} pixels of {image.encoding} need {row_bytes} bytes per row, "
            f"step is {image.step}",
            "step",
        )
    # Some drivers leave out the padding of the last row.
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
    """View pixels as rows x bytes; copies only when a row's values are not adjacent."""
    if not pixels[0].flags.c_contiguous:
        pixels = np.ascontiguousarray(pixels)
    width = pixels[0].nbytes
    values = pixels.reshape(pixels.shape[0], -1) if pixels.flags.c_contiguous else pixels
    return np.lib.stride_tricks.as_strided(
        values.view(np.uint8), (pixels.shape[0], width), (pixels.strides[0], 1)
    )


def to_rgbx(frame: Frame) -> Frame:
    """Return a picture of YUV, or of 8-bit grey, as RGBX.

    Raises:
        UnsupportedError: OpenCV is not installed, or the layout is another.
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
        raise UnsupportedError(f"a picture of {layout.value} cannot be made RGBX")
    return replace(frame, format=PixelFormat.RGBX, planes=(_rows_of_bytes(out),))


def convert(
    image: RawImage,
    accept: frozenset[PixelFormat] = ANY_FORMAT,
    received: Time | None = None,
    allocate: Callable[[int, int], Array] | None = None,
) -> Frame:
    """Make a picture showable.

    Depth in metres (32FC1) becomes millimetres, like 16UC1 depth images; 16-bit colours keep their
    high bytes; 8UC3 and 8UC4 are taken for BGR(A) as OpenCV does; 8UC2 is shown as red and green.

    Args:
        image: The picture as received.
        accept: Layouts that all its displays take; RGBX, RGBA, BGRA, GRAY8 and GRAY16 are always
            assumed.
        received: When it arrived.
        allocate: Gives memory for a picture of a width and height, as rows x columns x RGBX; used
            when colours must be converted, so that they land where the display wants them.

    Raises:
        UnsupportedError: The encoding cannot be shown.
        DecodeError: Sizes, step and data contradict each other.
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
    return Frame(
        layout,
        image.width,
        image.height,
        planes,
        image.encoding,
        image.stamp,
        received,
    )

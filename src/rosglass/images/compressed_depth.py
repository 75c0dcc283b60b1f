"""The transport ``compressedDepth``: depth pictures sent as PNG or RVL.

Format: compressed_depth_image_transport of image_transport_plugins. A header of 12 bytes (kind,
and the two parameters of the inverse-depth quantisation as floats) comes before the file.

RVL is A. D. Wilson's codec ("Fast Lossless Depth Image Compression", ISS 2017): runs of zeros and
of differences to the previous depth, as numbers of 3-bit digits in 4-bit nibbles, nibbles in 32-bit
words.
"""

from __future__ import annotations

import math
import struct
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import DecodeError, UnsupportedError
from rosglass.images.compressed import decompress
from rosglass.images.encodings import MAX_PIXELS
from rosglass.images.frame import RawImage

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rosglass.comm.time import Time

__all__ = ["decompress_depth"]

_TYPE = "sensor_msgs/msg/CompressedImage"
#: Nibbles of the longest number that makes sense: 33 bits.
_MAX_DIGITS = 11


def decode_rvl(data: Any, count: int) -> NDArray[np.uint16]:
    """Decode RVL.

    Args:
        data: The words.
        count: How many depths to expect.

    Raises:
        DecodeError: The data end early, or hold more than `count` depths.
    """
    view = memoryview(data).cast("B")
    words = np.frombuffer(view, "<u4", len(view) // 4)
    # The first nibble is the highest of its word.
    stream = words.astype(">u4").view(np.uint8)
    nibbles = np.empty(stream.size * 2, np.uint8)
    nibbles[0::2], nibbles[1::2] = stream >> 4, stream & 15
    ends = np.flatnonzero(nibbles < 8)
    starts = np.empty_like(ends)
    if ends.size:
        starts[0], starts[1:] = 0, ends[:-1] + 1
    lengths = ends - starts + 1
    if lengths.size and int(lengths.max()) > _MAX_DIGITS:
        raise DecodeError(_TYPE, "the RVL data are corrupt: a number has no end", "data")
    values = np.zeros(ends.size, np.int64)
    for digit in range(int(lengths.max()) if lengths.size else 0):
        longer = np.flatnonzero(lengths > digit) if digit else slice(None)
        values[longer] |= (nibbles[starts[longer] + digit] & 7).astype(np.int64) << 3 * digit
    return _unroll(values, count)


def _unroll(values: NDArray[np.int64], count: int) -> NDArray[np.uint16]:
    """Put runs of zeros and differences in their places."""
    runs: list[int] = []
    is_difference = np.ones(values.size, bool)
    at = pixels = 0
    while pixels < count:
        if at + 2 > values.size:
            raise DecodeError(_TYPE, f"the RVL data end after {pixels} of {count} depths", "data")
        zeros, others = int(values[at]), int(values[at + 1])
        is_difference[at : at + 2] = False
        at += 2 + others
        pixels += zeros + others
        if not zeros + others or pixels > count or at > values.size:
            raise DecodeError(
                _TYPE, f"the RVL data are corrupt after {pixels} of {count} depths", "data"
            )
        runs += (zeros, others)
    zigzag = values[:at][is_difference[:at]]
    depths = np.cumsum((zigzag >> 1) ^ -(zigzag & 1))
    out = np.zeros(count, np.uint16)
    out[np.repeat(np.arange(len(runs)) % 2 == 1, runs)] = depths.astype(np.uint16)
    return out


_HEADER = struct.Struct("<iff")
_RVL_SIZE = struct.Struct("<II")
#: Pixels that few bytes may stand for: a camera that is covered sends nothing but one run of zeros.
_ALWAYS_ALLOWED = 1 << 22
#: Pixels per byte beyond that; cameras' pictures are noise.
_MAX_RVL_RATIO = 4096
_ENCODINGS = {"16UC1": "16UC1", "mono16": "16UC1", "32FC1": "32FC1"}


def decompress_depth(
    data: Any, format: str, stamp: Time | None = None, frame_id: str = ""
) -> RawImage:
    """Decode a depth picture to 16UC1 (millimetres) or 32FC1 (metres, NaN where unknown).

    Args:
        data: The message's ``data``.
        format: The message's ``format``, such as ``16UC1; compressedDepth rvl``.
        stamp: When the picture was taken.
        frame_id: Coordinate frame of the camera.

    Raises:
        UnsupportedError: The format is unknown, or OpenCV is not installed.
        DecodeError: The data are corrupt, or claim a size that they cannot justify.
    """
    camera, _, coded = format.partition(";")
    encoding = _ENCODINGS.get(camera.strip())
    # Publishers before RVL said "compressedDepth" or nothing.
    kind = coded.strip().removeprefix("compressedDepth").strip() or "png"
    if encoding is None or kind not in {"png", "rvl"}:
        raise UnsupportedError(
            f"compressed depth of format {format[:60]!r} cannot be shown; these can: "
            "'16UC1; compressedDepth png', '32FC1; compressedDepth rvl' and so on"
        )
    view = memoryview(data).cast("B")
    if len(view) <= _HEADER.size:
        raise DecodeError(_TYPE, f"the depth picture is cut off: {len(view)} bytes", "data")
    _, a, b = _HEADER.unpack_from(view)
    body = view[_HEADER.size :]
    depths = _png(body) if kind == "png" else _rvl(body)
    height, width = depths.shape
    pixels: NDArray[Any] = depths
    if encoding == "32FC1":
        if not (math.isfinite(a) and math.isfinite(b) and a > 0):
            raise DecodeError(_TYPE, f"depth cannot be restored with parameters {a}, {b}", "data")
        pixels = _metres(a, b)[depths]
    return RawImage(
        width,
        height,
        encoding,
        pixels.strides[0],
        pixels.reshape(-1).view(np.uint8),
        stamp=stamp,
        frame_id=frame_id,
    )


def _png(body: memoryview) -> NDArray[np.uint16]:
    picture = decompress(body)
    if picture.encoding != "mono16":
        raise DecodeError(
            _TYPE, f"depth must be sent as 16-bit grey, this is {picture.encoding}", "data"
        )
    pixels: NDArray[np.uint16] = picture.data.view(np.uint16)
    return pixels.reshape(picture.height, picture.width)


def _rvl(body: memoryview) -> NDArray[np.uint16]:
    if len(body) < _RVL_SIZE.size:
        raise DecodeError(_TYPE, "the RVL data are cut off before the picture's size", "data")
    width, height = _RVL_SIZE.unpack_from(body)
    count = width * height
    if not 0 < count <= min(MAX_PIXELS, max(_ALWAYS_ALLOWED, _MAX_RVL_RATIO * len(body))):
        raise DecodeError(
            _TYPE, f"{len(body)} bytes cannot be a picture of {width}x{height} pixels", "data"
        )
    return decode_rvl(body[_RVL_SIZE.size :], count).reshape(height, width)


@lru_cache(maxsize=4)
def _metres(a: float, b: float) -> NDArray[np.float32]:
    """Return the depth that each quantised inverse depth stands for; NaN for none."""
    inverse = np.arange(65536, dtype=np.float32) - np.float32(b)
    known = inverse > 0
    known[0] = False
    out = np.full(65536, np.nan, np.float32)
    np.divide(np.float32(a), inverse, out=out, where=known)
    return out

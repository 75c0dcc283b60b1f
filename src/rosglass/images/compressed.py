"""Compression, and the transports ``compressed`` and ``compressedDepth``.

The ``format`` field's grammar is that of ROS's compressed_image_transport: ``jpeg``, ``png``, or
``<encoding of the camera>; jpeg compressed <order of the encoded channels>``. It is filled in the
same way for compression, so that subscribers restore the encoding.

The format of depth images is that of compressed_depth_image_transport of image_transport_plugins. A
header of 12 bytes (kind, and the two parameters of the inverse-depth quantisation as floats)
precedes the file.

RVL is A. D. Wilson's codec ("Fast Lossless Depth Image Compression", ISS 2017): runs of zeros and
of differences to the previous depth, as numbers of 3-bit digits in 4-bit nibbles, nibbles in 32-bit
words.
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import DecodeError, UnsupportedError
from rosglass.images.encodings import MAX_PIXELS, RawImage, opencv

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rosglass.comm.time import Time

__all__ = [
    "COMPRESSIBLE",
    "PictureHeader",
    "compress",
    "decompress",
    "decompress_depth",
    "read_header",
]


_TYPE = "sensor_msgs/msg/CompressedImage"
_JPEG, _PNG = b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n"
_TIFF = (b"II*\0", b"MM\0*")
#: Largest compression ratio. Deflate reaches 1032; JPEG's end-of-block runs reach more, but no
#: camera image does.
_MAX_RATIO = 4096
_COLOR = re.compile(r"^(rgb|bgr)a?(8|16)$")
_MOSAIC = re.compile(r"^(bayer_(?:rggb|bggr|gbrg|grbg))(8|16)$")


@dataclass(frozen=True, slots=True)
class PictureHeader:
    """The header of an image file.

    Attributes:
        kind: ``jpeg``, ``png`` or ``tiff``.
        width: Number of columns in pixels.
        height: Number of rows in pixels.
    """

    kind: str
    width: int
    height: int


def read_header(data: Any) -> PictureHeader:
    """Read an image's kind and size without decoding it.

    Raises:
        UnsupportedError: It is neither JPEG, PNG nor TIFF.
        DecodeError: It is truncated or malformed.
    """
    view = memoryview(data).cast("B")
    if view[:3] == _JPEG:
        return _jpeg_header(view)
    if view[:8] == _PNG:
        if len(view) < 33 or bytes(view[12:16]) != b"IHDR":
            raise DecodeError(_TYPE, "the PNG file has no complete header", "data", len(view))
        return PictureHeader("png", *struct.unpack_from(">II", view, 16))
    if bytes(view[:4]) in _TIFF:
        return _tiff_header(view)
    if not view:
        raise DecodeError(_TYPE, "the image is empty", "data", 0)
    start = bytes(view[:4]).hex(" ")
    raise UnsupportedError(
        f"compressed images must be JPEG, PNG or TIFF; this one starts with the bytes {start}"
    )


def _jpeg_header(view: memoryview) -> PictureHeader:
    """Read the markers up to the frame header (ITU-T T.81, annex B)."""
    at = 2
    while at + 9 < len(view):
        if view[at] != 0xFF:
            raise DecodeError(_TYPE, "the JPEG file is corrupt: no marker", "data", at)
        marker = view[at + 1]
        if marker == 0xFF:
            at += 1
            continue
        if 0xC0 <= marker <= 0xCF and marker not in {0xC4, 0xC8, 0xCC}:
            height, width = struct.unpack_from(">HH", view, at + 5)
            return PictureHeader("jpeg", width, height)
        at += 2 + int.from_bytes(view[at + 2 : at + 4], "big")
    raise DecodeError(_TYPE, "the JPEG file is cut off before its size", "data", len(view))


#: Fields of a TIFF image (TIFF 6.0), and the sizes of their values' types.
_WIDTH, _HEIGHT, _BITS, _SAMPLES, _TILE_WIDTH, _TILE_HEIGHT = 256, 257, 258, 277, 322, 323
_SHORT, _LONG = 3, 4
_MAX_TIFF_FIELDS = 1000


def _tiff_header(view: memoryview) -> PictureHeader:
    """Read the fields of the first image that decide how much memory it takes."""
    order = "<" if bytes(view[:1]) == b"I" else ">"
    values = {_WIDTH: 0, _HEIGHT: 0, _BITS: 1, _SAMPLES: 1, _TILE_WIDTH: 0, _TILE_HEIGHT: 0}
    try:
        (start,) = struct.unpack_from(f"{order}I", view, 4)
        (count,) = struct.unpack_from(f"{order}H", view, start)
        for number in range(min(count, _MAX_TIFF_FIELDS)):
            at = start + 2 + 12 * number
            field, kind, length = struct.unpack_from(f"{order}HHI", view, at)
            if field in values and length and kind in (_SHORT, _LONG):
                code = "H" if kind == _SHORT else "I"
                at += 8
                if length * struct.calcsize(f"={code}") > 4:
                    (at,) = struct.unpack_from(f"{order}I", view, at)
                values[field] = max(struct.unpack_from(f"{order}{min(length, 4)}{code}", view, at))
    except struct.error:
        raise DecodeError(_TYPE, "the TIFF file is cut off", "data", len(view)) from None
    width, height = values[_WIDTH], values[_HEIGHT]
    area = max(width * height, values[_TILE_WIDTH] * values[_TILE_HEIGHT])
    if area * values[_BITS] * values[_SAMPLES] > 32 * MAX_PIXELS:
        raise DecodeError(
            _TYPE,
            f"the TIFF file declares {width}x{height} pixels of {values[_SAMPLES]} times "
            f"{values[_BITS]} bits, in tiles of {values[_TILE_WIDTH]}x{values[_TILE_HEIGHT]}; "
            f"{4 * MAX_PIXELS} bytes are the most",
            "data",
        )
    return PictureHeader("tiff", width, height)


def _check(header: PictureHeader, view: memoryview) -> None:
    pixels = header.width * header.height
    size = f"{header.width}x{header.height}"
    if not pixels:
        raise DecodeError(_TYPE, f"the image is {size} pixels", "data")
    if pixels > min(MAX_PIXELS, _MAX_RATIO * len(view)):
        raise DecodeError(
            _TYPE, f"{len(view)} bytes cannot be an image of {size} pixels", "data", 0
        )
    # libjpeg fills a truncated image with grey and reports success.
    if header.kind == "jpeg" and not _has_end(view):
        raise DecodeError(_TYPE, "the JPEG file is cut off", "data", len(view))


#: A marker among compressed pixels: neither a stuffed 0xFF byte, nor a restart, nor a fill byte.
_MARKER = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")
_NO_FILL = re.compile(rb"[^\xff]")
_START_OF_SCAN, _END = 0xDA, 0xD9
#: Real images have less than a thousand.
_MAX_MARKERS = 20_000
#: Markers between two scans that have a length.
_SEGMENTS = frozenset({0xC4, 0xDA, 0xDB, 0xDC, 0xDD, *range(0xE0, 0xF0), 0xFE})


def _has_end(view: memoryview) -> bool:
    """Return whether a JPEG image has its end marker, whatever stands behind that.

    Segments are skipped by their length: thumbnails in them have ends of their own.
    """
    at, in_pixels = 2, False
    for _ in range(_MAX_MARKERS):
        if in_pixels:
            found = _MARKER.search(view, at)
            place = -1 if found is None else found.end() - 1
        else:
            found = _NO_FILL.search(view, at)
            place = -1 if found is None or found.start() == at else found.start()
        if place < 0:
            break
        marker = view[place]
        if marker == _END:
            return True
        at = place + 1
        if not in_pixels or marker in _SEGMENTS:
            at += int.from_bytes(view[at : at + 2], "big")
        in_pixels = in_pixels or marker == _START_OF_SCAN
    return False


def decompress(
    data: Any, format: str = "", stamp: Time | None = None, frame_id: str = ""
) -> RawImage:
    """Decode a JPEG, PNG or TIFF image.

    Args:
        data: The bytes of the file.
        format: The message's ``format`` field, with the order of the colour channels, or the
            camera's Bayer pattern.
        stamp: Time of the image.
        frame_id: Coordinate frame of the camera.

    Raises:
        UnsupportedError: It is neither JPEG, PNG nor TIFF, or OpenCV is not installed.
        DecodeError: It is corrupt, or declares a size that is too large for its data.
    """
    view = memoryview(data).cast("B")
    header = read_header(view)
    _check(header, view)
    cv2 = opencv()
    try:
        pixels = cv2.imdecode(np.frombuffer(view, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        raise DecodeError(_TYPE, f"the {header.kind} file is corrupt: {error}", "data") from None
    if pixels is None:
        raise DecodeError(_TYPE, f"the {header.kind} file is corrupt", "data")
    channels = 1 if pixels.ndim == 2 else pixels.shape[2]
    return RawImage(
        pixels.shape[1],
        pixels.shape[0],
        _encoding(format, channels, pixels.itemsize),
        pixels.strides[0],
        pixels.reshape(-1).view(np.uint8),
        stamp=stamp,
        frame_id=frame_id,
    )


def _encoding(format: str, channels: int, size: int) -> str:
    """Return the encoding of decoded pixels, of which OpenCV returns blue first."""
    bits = 8 * size
    camera, separator, coded = format.partition(";")
    if channels == 1 and bits == 32:
        return "32FC1"  # only TIFF has it
    if channels == 1:
        # A camera's mosaic is compressed as it is.
        mosaic = _MOSAIC.match(camera.strip())
        if mosaic and separator and "compressed mono" not in coded:
            return f"{mosaic[1]}{bits}"
        return f"mono{bits}"
    # Publishers without "compressed bgr..." encoded red-first pixels unchanged, so that the decoded
    # "blue" is red.
    swapped = bool(separator) and _COLOR.match(camera.strip()) and "compressed bgr" not in coded
    order = "rgb" if swapped and camera.strip().startswith("rgb") else "bgr"
    return f"{order}{'a' if channels == 4 else ''}{bits}"


#: OpenCV's conversion to the channel order that it encodes, by encoding.
COMPRESSIBLE = {"rgb8": "RGB2BGR", "bgr8": "", "rgba8": "RGBA2BGRA", "mono8": ""}
_CODED = {"rgb8": "bgr8", "bgr8": "bgr8", "rgba8": "bgra8", "mono8": ""}


def compress(
    pixels: NDArray[Any], encoding: str, kind: str = "jpeg", quality: int = 90
) -> tuple[bytes, str]:
    """Encode an image as JPEG or PNG.

    Args:
        pixels: Rows x columns (x channels) of bytes.
        encoding: Their encoding, one of :data:`COMPRESSIBLE`.
        kind: ``jpeg`` or ``png``.
        quality: JPEG quality, 1 to 100.

    Returns:
        The bytes of the file, and the message's ``format`` field.

    Raises:
        UnsupportedError: The kind or encoding is not supported, or OpenCV is not installed.
    """
    if encoding not in COMPRESSIBLE:
        known = ", ".join(COMPRESSIBLE)
        raise UnsupportedError(f"{encoding!r} cannot be compressed here; these can: {known}")
    if kind not in {"jpeg", "png"}:
        raise UnsupportedError(f"images are compressed as 'jpeg' or 'png', not {kind!r}")
    if kind == "jpeg" and encoding == "rgba8":
        raise UnsupportedError("JPEG has no transparency: use png for rgba8, or rgb8 for JPEG")
    if not 1 <= quality <= 100:
        raise UnsupportedError(f"the quality of a JPEG image is 1 to 100, not {quality}")
    cv2 = opencv()
    code = COMPRESSIBLE[encoding]
    if code:
        pixels = cv2.cvtColor(pixels, getattr(cv2, f"COLOR_{code}"))
    settings = [cv2.IMWRITE_JPEG_QUALITY, quality] if kind == "jpeg" else []
    try:
        good, data = cv2.imencode(".jpg" if kind == "jpeg" else ".png", pixels, settings)
    except cv2.error as error:
        raise UnsupportedError(f"the image cannot be encoded as {kind}: {error}") from None
    if not good:
        raise UnsupportedError(f"the image cannot be encoded as {kind}")
    return data.tobytes(), f"{encoding}; {kind} compressed {_CODED[encoding]}"


#: Number of nibbles of the longest valid number, of 33 bits.
_MAX_DIGITS = 11


def decode_rvl(data: Any, count: int) -> NDArray[np.uint16]:
    """Decode RVL.

    Args:
        data: The encoded data.
        count: Number of depths.

    Raises:
        DecodeError: The data has fewer or more depths.
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
    """Expand runs of zeros and differences."""
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
#: Number of pixels that is always allowed: a covered camera sends a single run of zeros.
_MIN_RVL_LIMIT = 1 << 22
#: Largest number of pixels per byte beyond that; camera images are noisy.
_MAX_RVL_RATIO = 4096
_ENCODINGS = {"16UC1": "16UC1", "mono16": "16UC1", "32FC1": "32FC1"}


def decompress_depth(
    data: Any, format: str, stamp: Time | None = None, frame_id: str = ""
) -> RawImage:
    """Decode a depth image to 16UC1 (millimetres) or 32FC1 (metres, NaN where unknown).

    Args:
        data: The message's ``data``.
        format: The message's ``format``, such as ``16UC1; compressedDepth rvl``.
        stamp: Time of the image.
        frame_id: Coordinate frame of the camera.

    Raises:
        UnsupportedError: The format is unknown, or OpenCV is not installed.
        DecodeError: The data is corrupt, or declares a size that is too large for it.
    """
    camera, _, coded = format.partition(";")
    encoding = _ENCODINGS.get(camera.strip())
    # Publishers before RVL send "compressedDepth" or nothing.
    kind = coded.strip().removeprefix("compressedDepth").strip() or "png"
    if encoding is None or kind not in {"png", "rvl"}:
        raise UnsupportedError(
            f"compressed depth of format {format[:60]!r} cannot be shown; these can: "
            "'16UC1; compressedDepth png', '32FC1; compressedDepth rvl' and so on"
        )
    view = memoryview(data).cast("B")
    if len(view) <= _HEADER.size:
        raise DecodeError(_TYPE, f"the depth image is cut off: {len(view)} bytes", "data")
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
        raise DecodeError(_TYPE, "the RVL data are cut off before the image's size", "data")
    width, height = _RVL_SIZE.unpack_from(body)
    count = width * height
    if not 0 < count <= min(MAX_PIXELS, max(_MIN_RVL_LIMIT, _MAX_RVL_RATIO * len(body))):
        raise DecodeError(
            _TYPE, f"{len(body)} bytes cannot be an image of {width}x{height} pixels", "data"
        )
    return decode_rvl(body[_RVL_SIZE.size :], count).reshape(height, width)


@lru_cache(maxsize=4)
def _metres(a: float, b: float) -> NDArray[np.float32]:
    """Return the depth for each quantised inverse depth; NaN for unknown ones."""
    inverse = np.arange(65536, dtype=np.float32) - np.float32(b)
    known = inverse > 0
    known[0] = False
    out = np.full(65536, np.nan, np.float32)
    np.divide(np.float32(a), inverse, out=out, where=known)
    return out

"""The transport ``compressed``: pictures sent as JPEG or PNG.

The ``format`` field's grammar is that of ROS's compressed_image_transport: ``jpeg``, ``png``, or
``<encoding of the camera>; jpeg compressed <order of the encoded channels>``.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import DecodeError, UnsupportedError
from rosglass.images.encodings import MAX_PIXELS, opencv
from rosglass.images.frame import RawImage

if TYPE_CHECKING:
    from rosglass.comm.time import Time

__all__ = ["PictureHeader", "decompress", "read_header"]

_TYPE = "sensor_msgs/msg/CompressedImage"
_JPEG, _PNG = b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n"
#: Decoded bytes that one byte of a file can stand for. Deflate reaches 1032; JPEG's end-of-block
#: runs reach more, but no camera's picture comes near it.
_MAX_RATIO = 4096
_COLOR = re.compile(r"^(rgb|bgr)a?(8|16)$")


@dataclass(frozen=True, slots=True)
class PictureHeader:
    """What the first bytes of a picture file say.

    Attributes:
        kind: ``jpeg`` or ``png``.
        width: Columns, pixels.
        height: Rows, pixels.
    """

    kind: str
    width: int
    height: int


def read_header(data: Any) -> PictureHeader:
    """Read a picture's kind and size without decoding it.

    Raises:
        UnsupportedError: It is neither JPEG nor PNG.
        DecodeError: It is cut off or malformed.
    """
    view = memoryview(data).cast("B")
    if view[:3] == _JPEG:
        return _jpeg_header(view)
    if view[:8] == _PNG:
        if len(view) < 33 or bytes(view[12:16]) != b"IHDR":
            raise DecodeError(_TYPE, "the PNG file has no complete header", "data", len(view))
        return PictureHeader("png", *struct.unpack_from(">II", view, 16))
    if not view:
        raise DecodeError(_TYPE, "the picture is empty", "data", 0)
    start = bytes(view[:4]).hex(" ")
    raise UnsupportedError(
        f"compressed pictures must be JPEG or PNG; this one starts with the bytes {start}"
    )


def _jpeg_header(view: memoryview) -> PictureHeader:
    """Walk the markers up to the frame header (ITU-T T.81, annex B)."""
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


def _check(header: PictureHeader, view: memoryview) -> None:
    pixels = header.width * header.height
    size = f"{header.width}x{header.height}"
    if not pixels:
        raise DecodeError(_TYPE, f"the picture is {size} pixels", "data")
    if pixels > min(MAX_PIXELS, _MAX_RATIO * len(view)):
        raise DecodeError(
            _TYPE, f"{len(view)} bytes cannot be a picture of {size} pixels", "data", 0
        )
    # libjpeg fills a cut-off picture with grey and calls it a success.
    if header.kind == "jpeg" and bytes(view[-64:]).rfind(b"\xff\xd9") < 0:
        raise DecodeError(_TYPE, "the JPEG file is cut off", "data", len(view))


def decompress(
    data: Any, format: str = "", stamp: Time | None = None, frame_id: str = ""
) -> RawImage:
    """Decode a JPEG or PNG picture.

    Args:
        data: The file's bytes.
        format: The message's ``format`` field; tells the order of the colour channels.
        stamp: When the picture was taken.
        frame_id: Coordinate frame of the camera.

    Raises:
        UnsupportedError: It is neither JPEG nor PNG, or OpenCV is not installed.
        DecodeError: It is corrupt, or claims a size that its bytes cannot justify.
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
    """Return the encoding of decoded pixels; OpenCV gives blue first."""
    bits = 8 * size
    if channels == 1:
        return f"mono{bits}"
    # Publishers that do not say "compressed bgr..." handed the encoder red-first pixels as they
    # were, so that the decoder's "blue" is red.
    camera, separator, coded = format.partition(";")
    swapped = bool(separator) and _COLOR.match(camera.strip()) and "compressed bgr" not in coded
    order = "rgb" if swapped and camera.strip().startswith("rgb") else "bgr"
    return f"{order}{'a' if channels == 4 else ''}{bits}"

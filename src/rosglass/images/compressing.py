"""The other way round: pixels into a ``CompressedImage``.

The ``format`` field is filled as ROS's compressed_image_transport fills it, so that its
subscribers give the pixels back in the encoding they had.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import UnsupportedError
from rosglass.images.encodings import opencv

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["COMPRESSIBLE", "compress"]

#: OpenCV's conversion to the order of channels that it encodes, by encoding.
COMPRESSIBLE = {"rgb8": "RGB2BGR", "bgr8": "", "rgba8": "RGBA2BGRA", "mono8": ""}
_CODED = {"rgb8": "bgr8", "bgr8": "bgr8", "rgba8": "bgra8", "mono8": ""}


def compress(
    pixels: NDArray[Any], encoding: str, kind: str = "jpeg", quality: int = 90
) -> tuple[bytes, str]:
    """Encode a picture as a file.

    Args:
        pixels: Rows x columns (x channels) of bytes.
        encoding: What they are, one of :data:`COMPRESSIBLE`.
        kind: ``jpeg`` or ``png``.
        quality: Of a JPEG picture, 1 to 100.

    Returns:
        The file, and the text for the message's ``format`` field.

    Raises:
        UnsupportedError: There is no such file, or OpenCV is not installed.
    """
    if encoding not in COMPRESSIBLE:
        known = ", ".join(COMPRESSIBLE)
        raise UnsupportedError(f"{encoding!r} cannot be compressed here; these can: {known}")
    if kind not in {"jpeg", "png"}:
        raise UnsupportedError(f"pictures are compressed as 'jpeg' or 'png', not {kind!r}")
    if kind == "jpeg" and encoding == "rgba8":
        raise UnsupportedError("JPEG has no transparency: use png for rgba8, or rgb8 for JPEG")
    if not 1 <= quality <= 100:
        raise UnsupportedError(f"the quality of a JPEG picture is 1 to 100, not {quality}")
    cv2 = opencv()
    code = COMPRESSIBLE[encoding]
    if code:
        pixels = cv2.cvtColor(pixels, getattr(cv2, f"COLOR_{code}"))
    settings = [cv2.IMWRITE_JPEG_QUALITY, quality] if kind == "jpeg" else []
    try:
        good, data = cv2.imencode(".jpg" if kind == "jpeg" else ".png", pixels, settings)
    except cv2.error as error:
        raise UnsupportedError(f"the picture cannot be encoded as {kind}: {error}") from None
    if not good:
        raise UnsupportedError(f"the picture cannot be encoded as {kind}")
    return data.tobytes(), f"{encoding}; {kind} compressed {_CODED[encoding]}"

"""Making a picture smaller before anything else is done with it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rosglass.images.encodings import ENCODINGS, opencv, pixels_of

if TYPE_CHECKING:
    from rosglass.images.frame import RawImage

__all__ = ["reduce"]

#: Encodings whose pixels may be averaged as they are. Depths may not: 0 is not near. YUV travels
#: to the display in few bytes anyway.
_PLAIN = frozenset({"rgb8", "bgr8", "rgba8", "bgra8", "mono8", "8UC1", "8UC3", "8UC4"})


def reduce(image: RawImage, factor: int) -> RawImage:
    """Return a picture with a `factor`-th of its width and height, each pixel a mean of many.

    A picture whose encoding does not allow it is returned as it is, and so is one of which
    nothing would be left.

    Raises:
        DecodeError: Sizes, step and data contradict each other.
        UnsupportedError: OpenCV is not installed.
    """
    width, height = image.width // factor, image.height // factor
    if factor < 2 or image.encoding not in _PLAIN or not width or not height:
        return image
    cv2 = opencv()
    pixels = pixels_of(image, ENCODINGS[image.encoding])
    # What is left over at the right and below would shift all others by a fraction.
    pixels = pixels[: height * factor, : width * factor]
    small = cv2.resize(pixels, (width, height), interpolation=cv2.INTER_AREA)
    return replace(image, width=width, height=height, step=small.strides[0], data=small.reshape(-1))

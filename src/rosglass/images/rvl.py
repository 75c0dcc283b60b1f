"""RVL, the lossless depth codec of image_transport_plugins.

A. D. Wilson, "Fast Lossless Depth Image Compression", ISS 2017: runs of zeros and of differences to
the previous depth, as numbers of 3-bit digits in 4-bit nibbles, nibbles in 32-bit words.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import DecodeError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["decode_rvl"]

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

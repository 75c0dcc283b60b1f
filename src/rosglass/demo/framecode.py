"""A line of black and white squares in the image that a program can read back from the screen.

It encodes the time and the sequence number of the image, so that the latency from the robot to
the pixels can be measured without trusting any software in between.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rosglass.errors import Error

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["BITS", "SQUARE", "FrameCode", "FrameCodeError", "draw", "read"]

_TIME_BITS, _NUMBER_BITS, _CHECK_BITS = 28, 16, 8
#: Squares in the line.
BITS = _TIME_BITS + _NUMBER_BITS + _CHECK_BITS
#: Side of a square in pixels of the image.
SQUARE = 8
# Not quite black and white: easier on the eye, and still easy to distinguish.
_BLACK, _WHITE = 28, 226
_UNIT_NS = 10_000
_WRAP = 1 << _TIME_BITS


class FrameCodeError(Error):
    """No frame code could be read."""


@dataclass(frozen=True)
class FrameCode:
    """The content of the squares.

    Attributes:
        time: Time of the image in units of 10 µs, modulo 2**28 (about 45 minutes).
        number: The image's sequence number, modulo 65536.
    """

    time: int
    number: int

    @classmethod
    def at(cls, nanoseconds: int, number: int) -> FrameCode:
        """Return the code of image `number` taken at a system time."""
        return cls(nanoseconds // _UNIT_NS % _WRAP, number % (1 << _NUMBER_BITS))

    def age(self, nanoseconds: int) -> float:
        """Return the image's age in seconds at a system time; valid below 45 minutes."""
        return (nanoseconds // _UNIT_NS - self.time) % _WRAP * _UNIT_NS * 1e-9


def _check(time: int, number: int) -> int:
    value = 0x5A
    for byte in (*time.to_bytes(4, "big"), *number.to_bytes(2, "big")):
        value = (value * 31 + byte) & 0xFF
    return value


def draw(picture: npt.NDArray[np.uint8], code: FrameCode, x: int, y: int) -> None:
    """Paint the squares into `picture`, the first one's upper left corner at the pixel x, y."""
    word = (code.time << _NUMBER_BITS | code.number) << _CHECK_BITS
    word |= _check(code.time, code.number)
    bits = np.array([word >> (BITS - 1 - k) & 1 for k in range(BITS)], np.uint8)
    line = np.repeat(np.where(bits, _WHITE, _BLACK).astype(np.uint8), SQUARE)
    picture[y : y + SQUARE, x : x + BITS * SQUARE] = line[None, :, None]


def read(row: npt.NDArray[np.uint8]) -> FrameCode:
    """Decode the squares.

    Args:
        row: Brightness along the middle of the line, from its first to its last square, at any
            scale of at least one value per square.

    Raises:
        FrameCodeError: The row is too short, or the code is incomplete or disturbed (for instance
            an
        image half replaced by the next one).
    """
    if row.ndim != 1 or row.size < BITS:
        raise FrameCodeError(f"expected at least {BITS} values in one row, got shape {row.shape}")
    centres = ((np.arange(BITS) + 0.5) * row.size / BITS).astype(int)
    word = 0
    for value in row[centres]:
        word = word << 1 | int(value > 127)
    check = word & ((1 << _CHECK_BITS) - 1)
    number = word >> _CHECK_BITS & ((1 << _NUMBER_BITS) - 1)
    time = word >> (_CHECK_BITS + _NUMBER_BITS)
    if check != _check(time, number):
        raise FrameCodeError("the squares do not hold a frame code: checksum differs")
    return FrameCode(time, number)

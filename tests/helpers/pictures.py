"""Compares images of 3D scenes: positions and colours of shapes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: RViz's background.
BACKGROUND = (48, 48, 48)
_HUES = ("red", "yellow", "green", "cyan", "blue", "magenta")


class Patch(NamedTuple):
    """The pixels of one hue in an image.

    Attributes:
        count: Pixels.
        left, top, right, bottom: The box around it, in pixels.
    """

    count: int
    left: int
    top: int
    right: int
    bottom: int


def drawn(picture: NDArray[np.uint8]) -> NDArray[Any]:
    """Return which pixels differ from the background."""
    found: NDArray[Any] = np.abs(picture.astype(np.int16) - BACKGROUND).max(axis=2) > 12
    return found


def unmatched(
    one: NDArray[np.uint8], other: NDArray[np.uint8], within: int = 3, tolerance: int = 36
) -> NDArray[Any]:
    """Return which drawn pixels of an image have no similar one nearby in another image.

    Args:
        one: The image.
        other: The other image, of the same size.
        within: Pixels that count as near, in each direction.
        tolerance: By how much red, green and blue may differ.
    """
    rows, columns = np.nonzero(drawn(one))
    wanted = one[rows, columns].astype(np.int16)
    padded = np.pad(other.astype(np.int16), ((within, within), (within, within), (0, 0)))
    best = np.full(len(rows), 255, np.int16)
    for down in range(2 * within + 1):
        for right in range(2 * within + 1):
            there = padded[rows + down, columns + right]
            best = np.minimum(best, np.abs(there - wanted).max(axis=1))
    out = np.zeros(one.shape[:2], bool)
    out[rows, columns] = best > tolerance
    return out


def patches(picture: NDArray[np.uint8], least: int = 30) -> dict[str, Patch]:
    """Return an image's pixels of each hue; hues of fewer pixels are left out."""
    colours = picture.astype(np.float32)
    high, low = colours.max(axis=2), colours.min(axis=2)
    span = np.maximum(high - low, 1)
    red, green, blue = colours[..., 0], colours[..., 1], colours[..., 2]
    hue = np.where(
        high == red,
        (green - blue) / span,
        np.where(high == green, 2 + (blue - red) / span, 4 + (red - green) / span),
    )
    # Only what is clearly of a hue: others are one or the other by a shade.
    is_coloured = (high - low > 0.5 * high) & (high - low > 40) & (np.abs(hue % 1 - 0.5) > 0.2)
    found = {}
    number = np.round(hue).astype(int) % 6
    for index, name in enumerate(_HUES):
        found[name] = is_coloured & (number == index)
    out = {}
    for name, mask in found.items():
        rows, columns = np.nonzero(mask)
        if len(rows) >= least:
            box = (columns.min(), rows.min(), columns.max(), rows.max())
            out[name] = Patch(len(rows), *map(int, box))
    return out

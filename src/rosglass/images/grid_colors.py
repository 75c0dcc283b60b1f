"""RViz's colours of occupancy grids."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["grid_colors"]

#: RViz's colour of cells that are unknown (-1).
_UNKNOWN = (0x70, 0x89, 0x86, 255)


def grid_colors(scheme: str) -> NDArray[np.uint8]:
    """Return RViz's colours of the 256 values of a cell, (256, 4) RGBA.

    Values are those of ``nav_msgs/OccupancyGrid``: 0 free to 100 occupied, -1 (255) unknown; what
    is not allowed is green (101 to 127) and red to yellow (-128 to -2).

    Args:
        scheme: ``map``, ``costmap`` or ``raw``.
    """
    value = np.arange(256)
    out = np.full((256, 4), 255, np.uint8)
    if scheme == "raw":
        out[:, :3] = value[:, np.newaxis]
        return out
    share = value[:101] * 255 // 100
    if scheme == "map":
        out[:101, :3] = (255 - share)[:, np.newaxis]
    else:
        out[:101, 0], out[:101, 1], out[:101, 2] = share, 0, 255 - share
        out[0] = 0
        out[99], out[100] = (0, 255, 255, 255), (255, 0, 255, 255)
    out[101:128] = (0, 255, 0, 255)
    out[128:255, 0], out[128:255, 2] = 255, 0
    out[128:255, 1] = 255 * (value[128:255] - 128) // (254 - 128)
    out[255] = _UNKNOWN
    return out

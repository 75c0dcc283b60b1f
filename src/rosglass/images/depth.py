"""Depth images in colours, black where the depth is unknown; images of numbers in greys."""

from __future__ import annotations

from collections import deque
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rosglass.errors import UnsupportedError
from rosglass.images.encodings import ENCODINGS, Frame, PixelFormat, opencv, pixels_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from rosglass.comm.time import Time
    from rosglass.images.encodings import RawImage

__all__ = ["COLOR_MAPS", "DEPTH_ENCODINGS", "DepthColors", "GreyLevels", "GreyRange"]

#: Colour maps, from near to far.
COLOR_MAPS = ("turbo", "viridis", "jet", "gray")
#: Encodings that can hold depths.
DEPTH_ENCODINGS = ("16UC1", "mono16", "32FC1")
#: Percentage of the depths that the automatic range excludes at each end, as noise.
_OUTLIERS_PERCENT = 2.0
#: Smoothing factor of the automatic range, against flickering.
_SMOOTHING = 0.15
_SAMPLES = 20_000
_MIN_SPAN = 0.01


@cache
def _palette(name: str) -> NDArray[np.uint32]:
    """Return 256 colours as RGBX, and black for unknown depths."""
    ramp = np.arange(256, dtype=np.uint8)
    colors = np.zeros((257, 4), np.uint8)
    if name == "gray":
        colors[:256, :3] = ramp[:, None]
    else:
        cv2 = opencv()
        bgr = cv2.applyColorMap(ramp, getattr(cv2, f"COLORMAP_{name.upper()}"))
        colors[:256, :3] = bgr.reshape(256, 3)[:, ::-1]
    colors[:, 3] = 255
    return colors.view(np.uint32).ravel()


class DepthColors:
    """Colors the depth images of a camera.

    Args:
        colors: Name of the colour map, one of :data:`COLOR_MAPS`.
        near: Depth of the first colour in metres; None to follow the images.
        far: Depth of the last colour in metres; None to follow the images.

    Raises:
        UnsupportedError: The colour map is unknown, or the range is empty.
    """

    def __init__(
        self, colors: str = "turbo", near: float | None = None, far: float | None = None
    ) -> None:
        if colors not in COLOR_MAPS:
            raise UnsupportedError(
                f"colour map {colors!r} is unknown; known are: {', '.join(COLOR_MAPS)}"
            )
        for name, value in (("near", near), ("far", far)):
            if value is not None and not 0 <= value < float("inf"):
                raise UnsupportedError(
                    f"the depth {name} must be a finite distance in metres from 0, not {value}"
                )
        if near is not None and far is not None and not near < far:
            raise UnsupportedError(
                f"depths cannot be coloured from {near} m to {far} m: far must be beyond near"
            )
        self._colors, self._near, self._far = colors, near, far
        self._seen: tuple[float, float] | None = None

    @property
    def range(self) -> tuple[float, float]:
        """Depths of the first and the last colour in metres."""
        near, far = self._seen or (0.0, 1.0)
        near = near if self._near is None else self._near
        far = far if self._far is None else self._far
        if far - near >= _MIN_SPAN or None not in {self._near, self._far}:
            return near, far
        # A wall seen head-on has one depth: the fixed end stays.
        return (max(0.0, far - _MIN_SPAN), far) if self._near is None else (near, near + _MIN_SPAN)

    def convert(
        self,
        image: RawImage,
        received: Time | None = None,
        allocate: Callable[[int, int], NDArray[Any]] | None = None,
    ) -> Frame:
        """Color an image of 16UC1 (millimetres), mono16 (the same) or 32FC1 (metres).

        Args:
            image: The image as received.
            received: Time of reception.
            allocate: Returns memory for an image of a width and height, as rows x columns x RGBX.

        Raises:
            UnsupportedError: The encoding has no depths.
            DecodeError: Sizes, step and data are inconsistent.
        """
        if image.encoding not in DEPTH_ENCODINGS:
            raise UnsupportedError(
                f"image encoding {image.encoding[:40]!r} holds no depths; "
                f"these do: {', '.join(DEPTH_ENCODINGS)}"
            )
        depths = pixels_of(image, ENCODINGS[image.encoding])
        unit = 1.0 if image.encoding == "32FC1" else 0.001
        if self._near is None or self._far is None:
            self._update_range(depths, unit)
        near, far = (limit / unit for limit in self.range)
        palette = _palette(self._colors)
        if unit == 1.0:
            colors = palette[_steps(depths, near, far)]
        else:
            every = np.arange(65536, dtype=np.float32)
            colors = palette[_steps(every, near, far)][depths]
        rgbx = colors.view(np.uint8).reshape(image.height, image.width, 4)
        if allocate is not None:
            memory = allocate(image.width, image.height)
            memory[...] = rgbx
            rgbx = memory
        rows = np.lib.stride_tricks.as_strided(
            rgbx, (image.height, image.width * 4), (rgbx.strides[0], 1)
        )
        return Frame.of(image, PixelFormat.RGBX, (rows,), received)

    def _update_range(self, depths: NDArray[Any], unit: float) -> None:
        """Adapt the automatic range to an image."""
        stride = max(1, int((depths.size / _SAMPLES) ** 0.5))
        some = depths[::stride, ::stride]
        some = some[np.isfinite(some) & (some > 0)]
        if not some.size:
            return
        near, far = (
            float(v) * unit
            for v in np.percentile(some, [_OUTLIERS_PERCENT, 100 - _OUTLIERS_PERCENT])
        )
        if self._seen is not None:
            near = self._seen[0] + _SMOOTHING * (near - self._seen[0])
            far = self._seen[1] + _SMOOTHING * (far - self._seen[1])
        self._seen = near, far


class GreyRange(NamedTuple):
    """The mapping of numbers to greys by :class:`GreyLevels`.

    Attributes:
        low: Value shown as black; None to follow the images.
        high: Value shown as white; None to follow the images.
        window: Images over whose extremes the medians are what is followed.
    """

    low: float | None = None
    high: float | None = None
    window: int = 5


class GreyLevels:
    """Shows images of one number per pixel in greys, from black to white, as RViz does.

    Args:
        range: The numbers that are black and white.
    """

    def __init__(self, range: GreyRange) -> None:
        self._range = range
        self._extremes: deque[tuple[float, float]] = deque(maxlen=max(range.window, 1))

    def convert(self, image: RawImage, received: Time | None = None) -> Frame:
        """Convert an image of 16UC1, mono16 or 32FC1; numbers that are not finite become black.

        Raises:
            UnsupportedError: The encoding is another.
            DecodeError: Sizes, step and data are inconsistent.
        """
        if image.encoding not in DEPTH_ENCODINGS:
            raise UnsupportedError(
                f"image encoding {image.encoding[:40]!r} has no range of greys; "
                f"these do: {', '.join(DEPTH_ENCODINGS)}"
            )
        numbers = pixels_of(image, ENCODINGS[image.encoding])
        finite = None if numbers.dtype.kind == "u" else np.isfinite(numbers)
        low, high, _ = self._range
        if low is None or high is None:
            known = numbers if finite is None else numbers[finite]
            if known.size:
                self._extremes.append((float(known.min()), float(known.max())))
            middle = np.median(self._extremes, axis=0) if self._extremes else (0.0, 1.0)
            low = float(middle[0]) if low is None else low
            high = float(middle[1]) if high is None else high
        if high > low:
            scale = 255 / (high - low)
            with np.errstate(over="ignore"):
                greys = numbers * np.float32(scale) - np.float32(low * scale)
            np.clip(greys, 0, 255, out=greys)
            if finite is not None:
                greys[~finite] = 0
        else:
            greys = np.zeros(numbers.shape, np.float32)
        rows = greys.astype(np.uint8)
        return Frame.of(image, PixelFormat.GRAY8, (rows,), received)


def _steps(depths: NDArray[Any], near: float, far: float) -> NDArray[np.uint16]:
    """Return the index of each depth's colour; 256 where the depth is unknown."""
    scale = 255.0 / (far - near)
    steps = depths * np.float32(scale)
    steps -= np.float32(near * scale)
    np.clip(steps, 0, 255, out=steps)
    # Comparisons with NaN are false.
    known = (depths > 0) & (depths < np.inf)
    np.copyto(steps, np.float32(256), where=~known)
    numbers: NDArray[np.uint16] = steps.astype(np.uint16)
    return numbers

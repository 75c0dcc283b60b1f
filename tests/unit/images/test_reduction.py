"""Images are reduced by averaging, where their encoding allows it."""

from __future__ import annotations

import numpy as np
import pytest

from rosglass.errors import DecodeError
from rosglass.images import RawImage, convert, reduce


def image(pixels: np.ndarray, encoding: str, padding: int = 0) -> RawImage:
    height, width = pixels.shape[:2]
    rows = pixels.reshape(height, -1)
    rows = np.hstack([rows, np.full((height, padding), 255, rows.dtype)])
    return RawImage(width, height, encoding, rows.strides[0], rows.reshape(-1), frame_id="lens")


@pytest.mark.parametrize(("encoding", "channels"), [("rgb8", 3), ("bgra8", 4), ("mono8", 1)])
@pytest.mark.parametrize("padding", [0, 7])
@pytest.mark.parametrize("factor", [2, 3])
def test_each_pixel_is_the_mean_of_many(
    encoding: str, channels: int, padding: int, factor: int
) -> None:
    # One column and row are left over.
    height, width = 4 * factor + 1, 6 * factor + 1
    pixels = np.random.default_rng(1).integers(0, 256, (height, width, channels)).astype(np.uint8)
    small = reduce(image(pixels, encoding, padding), factor)
    assert (small.width, small.height, small.frame_id) == (6, 4, "lens")
    blocks = pixels[: 4 * factor, : 6 * factor].reshape(4, factor, 6, factor, channels)
    found = np.frombuffer(small.data, np.uint8).reshape(4, 6, channels)
    np.testing.assert_allclose(found, blocks.mean((1, 3)), atol=1)
    assert convert(small).width == 6


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1", "uyvy", "bayer_rggb8", "nv12", "rgb99"])
def test_others_stay_as_they_are(encoding: str) -> None:
    whole = RawImage(16, 12, encoding, 64, bytes(64 * 18))
    assert reduce(whole, 2) is whole


def test_something_is_always_left() -> None:
    whole = image(np.zeros((3, 40), np.uint8), "mono8")
    assert reduce(whole, 4) is whole
    assert reduce(whole, 1) is whole


def test_inconsistent_image_is_rejected() -> None:
    with pytest.raises(DecodeError, match="data has 10"):
        reduce(RawImage(16, 12, "rgb8", 48, bytes(10)), 2)

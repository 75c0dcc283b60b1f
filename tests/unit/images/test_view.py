"""Turned, mirrored, cut: every pixel where it belongs, in every layout."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest

from rosglass.errors import UnsupportedError
from rosglass.images import Frame, PixelFormat, RawImage, View, convert, save

if TYPE_CHECKING:
    from pathlib import Path

W, H = 12, 6
RNG = np.random.default_rng(5)


def frame(encoding: str) -> Frame:
    channels, size = {
        "rgba8": (4, 1), "bgra8": (4, 1), "rgb8": (3, 1), "mono8": (1, 1), "mono16": (1, 2),
        "uyvy": (2, 1), "yuyv": (2, 1), "nv12": (1, 1), "nv21": (1, 1),
    }[encoding]  # fmt: skip
    rows = H * 3 // 2 if encoding.startswith("nv") else H
    data = RNG.integers(0, 256, rows * W * channels * size).astype(np.uint8)
    return convert(RawImage(W, H, encoding, W * channels * size, data))


def pixels(picture: Frame) -> np.ndarray:
    """Red, green, blue or grey of each pixel."""
    rows = [np.ascontiguousarray(plane) for plane in picture.planes]
    shape = (picture.height, picture.width)
    layout = picture.format
    if layout in {PixelFormat.NV12, PixelFormat.NV21}:
        return cv2.cvtColor(np.vstack(rows), getattr(cv2, f"COLOR_YUV2RGB_{layout.name}"))
    if layout in {PixelFormat.UYVY, PixelFormat.YUYV}:
        code = "UYVY" if layout is PixelFormat.UYVY else "YUY2"
        return cv2.cvtColor(rows[0].reshape(*shape, 2), getattr(cv2, f"COLOR_YUV2RGB_{code}"))
    if layout is PixelFormat.GRAY8:
        return rows[0]
    if layout is PixelFormat.GRAY16:
        return rows[0].view(np.uint16)
    out = rows[0].reshape(*shape, 4)
    return out[..., [2, 1, 0]] if layout is PixelFormat.BGRA else out[..., :3]


ENCODINGS = ["rgba8", "bgra8", "rgb8", "mono8", "mono16", "uyvy", "yuyv", "nv12", "nv21"]


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("rotation", [0, 90, 180, 270, -90, 450])
@pytest.mark.parametrize(("mirrored", "flipped"), [(0, 0), (1, 0), (0, 1), (1, 1)])
def test_turned_and_mirrored(encoding: str, rotation: int, mirrored: int, flipped: int) -> None:
    picture = frame(encoding)
    expected = pixels(picture)
    expected = expected[:, ::-1] if mirrored else expected
    expected = expected[::-1] if flipped else expected
    expected = np.rot90(expected, -rotation // 90)
    out = View(rotation, bool(mirrored), bool(flipped)).apply(picture)
    assert (out.width, out.height) == (expected.shape[1], expected.shape[0])
    np.testing.assert_array_equal(pixels(out), expected)


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("region", [(2, 2, 6, 4), (1, 1, 5, 3), (0, 0, W, H), (11, 5, 1, 1)])
def test_cut(encoding: str, region: tuple[int, int, int, int]) -> None:
    picture = frame(encoding)
    x, y, width, height = region
    out = View(region=region).apply(picture)
    expected = pixels(picture)[y : y + height, x : x + width]
    np.testing.assert_array_equal(pixels(out), expected)
    turned = View(90, True, region=region).apply(picture)
    np.testing.assert_array_equal(pixels(turned), np.rot90(expected[:, ::-1], -1))


@pytest.mark.parametrize("encoding", ["rgba8", "mono16", "uyvy", "nv12"])
def test_nothing_is_copied_where_nothing_moves(encoding: str) -> None:
    picture = frame(encoding)
    assert View().apply(picture) is picture
    out = View(region=(2, 2, 6, 4)).apply(picture)
    assert out.format is picture.format
    assert all(np.shares_memory(a, b) for a, b in zip(out.planes, picture.planes, strict=True))


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"rotation": 45}, "45 degrees; give a multiple of 90"),
        ({"region": (-1, 0, 2, 2)}, "x=-1 y=0 2x2 is not part of an image"),
        ({"region": (0, 0, 0, 2)}, "0x2 is not part of an image"),
        ({"region": (8, 0, 5, 2)}, "not within the image of 12x6"),
        ({"region": (0, 5, 2, 2)}, "not within the image of 12x6"),
    ],
)
def test_impossible_views_are_reported(fields: dict, reason: str) -> None:
    with pytest.raises(UnsupportedError, match=reason):
        View(**fields).apply(frame("rgba8"))


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("suffix", [".png", ".TIFF", ".bmp"])
def test_saved_exactly(tmp_path: Path, encoding: str, suffix: str) -> None:
    if encoding == "mono16" and suffix == ".bmp":
        return
    picture = frame(encoding)
    file = save(picture, tmp_path / f"picture{suffix}")
    assert list(tmp_path.iterdir()) == [file]
    back = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    if encoding in {"rgba8", "bgra8"} and suffix != ".bmp":
        alpha = picture.planes[0].reshape(H, W, 4)[..., 3]
        np.testing.assert_array_equal(back[..., 3], alpha)
    back = back[..., 2::-1] if back.ndim == 3 else back
    np.testing.assert_array_equal(back, pixels(picture))


def test_saved_as_jpeg_and_of_a_part(tmp_path: Path) -> None:
    grey = convert(RawImage(32, 32, "rgb8", 96, np.full(3072, 90, np.uint8)))
    part = View(region=(4, 4, 16, 8)).apply(grey)
    back = cv2.imread(str(save(part, tmp_path / "a.jpg")))
    assert back.shape == (8, 16, 3)
    np.testing.assert_allclose(back.astype(int), 90, atol=2)


def test_unsaveable_view_is_reported(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedError, match=r"\.gif'.*these work: \.png"):
        save(frame("rgb8"), tmp_path / "a.gif")
    with pytest.raises(UnsupportedError, match="without an ending"):
        save(frame("rgb8"), tmp_path / "a")
    with pytest.raises(UnsupportedError, match="16-bit greys"):
        save(frame("mono16"), tmp_path / "a.jpg")
    with pytest.raises(UnsupportedError, match="cannot be written: No such file"):
        save(frame("rgb8"), tmp_path / "nowhere" / "a.png")
    (tmp_path / "b.png").mkdir()
    with pytest.raises(UnsupportedError, match="cannot be written"):
        save(frame("rgb8"), tmp_path / "b.png")
    assert [path.name for path in tmp_path.iterdir()] == ["b.png"]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_zoom_shows_the_middle(encoding: str) -> None:
    picture = frame(encoding)
    seen = View(zoom=2).apply(picture)
    # Beginning at even places, so that no layout needs to be converted.
    assert (seen.width, seen.height) == (W - 2 * 4, H - 2 * 2)
    assert seen.format is picture.format
    np.testing.assert_array_equal(pixels(seen), pixels(picture)[2:4, 4:8])


@pytest.mark.parametrize("zoom", [1, 1.01, 3, 1000, 1e300])
@pytest.mark.parametrize("size", [(1, 1), (2, 3), (64, 48), (641, 1)])
def test_any_zoom_leaves_something(zoom: float, size: tuple[int, int]) -> None:
    width, height = size
    picture = convert(RawImage(width, height, "mono8", width, bytes(width * height)))
    seen = View(zoom=zoom).apply(picture)
    assert 1 <= seen.width <= width
    assert 1 <= seen.height <= height
    assert zoom < 3 or width < 5 or seen.width < width


@pytest.mark.parametrize("zoom", [0.5, 0, -1, float("nan"), float("inf")])
def test_impossible_zooms_are_refused(zoom: float) -> None:
    with pytest.raises(UnsupportedError, match="give 1 or more"):
        View(zoom=zoom)


def test_zoom_is_within_the_region() -> None:
    picture = frame("mono8")
    seen = View(region=(2, 0, 8, 4), zoom=2).apply(picture)
    np.testing.assert_array_equal(pixels(seen), pixels(picture)[0:4, 2:10][0:4, 2:6])

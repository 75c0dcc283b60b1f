"""Depths in colours: the right ones, black where unknown, steady."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rosglass.errors import DecodeError, UnsupportedError
from rosglass.images import COLOR_MAPS, DepthColors, RawImage
from rosglass.images.depth import GreyLevels, GreyRange

W, H = 64, 8


def millimetres(values: np.ndarray, big_endian: bool = False) -> RawImage:
    data = values.astype(">u2" if big_endian else "<u2").tobytes()
    return RawImage(W, H, "16UC1", 2 * W, data, big_endian)


def metres(values: np.ndarray) -> RawImage:
    return RawImage(W, H, "32FC1", 4 * W, values.astype("<f4").tobytes())


def ramp() -> np.ndarray:
    return np.tile(np.linspace(1000, 3000, W).round(), (H, 1))


def colors(frame: object) -> np.ndarray:
    return frame.planes[0].reshape(H, W, 4)


@pytest.mark.parametrize("name", COLOR_MAPS)
def test_colours_of_a_fixed_range(name: str) -> None:
    steps = (np.clip((ramp() - 1500) / 1000, 0, 1) * 255).astype(np.uint8)
    if name == "gray":
        expected = np.repeat(steps[..., None], 3, 2)
    else:
        bgr = cv2.applyColorMap(steps, getattr(cv2, f"COLORMAP_{name.upper()}"))
        expected = bgr[..., ::-1]
    for image in (millimetres(ramp()), millimetres(ramp(), True), metres(ramp() / 1000)):
        out = colors(DepthColors(name, 1.5, 2.5).convert(image))
        # Rounding may fall into the neighbouring step.
        difference = np.abs(out[..., :3].astype(int) - expected).max(2)
        assert (difference <= 12).all()
        assert (difference == 0).mean() > 0.8
        assert (out[..., 3] == 255).all()


def test_gray_from_0_to_1_is_the_scaling_of_qml_ros_plugin() -> None:
    values = np.zeros((H, W), np.float32)
    values[0, :6] = [0.0, 0.25, 0.5, 1.0, 2.0, np.nan]
    shown = colors(DepthColors("gray", 0.0, 1.0).convert(metres(values)))
    assert shown[0, :6, 0].tolist() == [0, 63, 127, 255, 255, 0]


def test_unknown_depths_are_black() -> None:
    depths = ramp()
    depths[0] = 0
    out = colors(DepthColors("viridis").convert(millimetres(depths)))
    assert not out[0, :, :3].any()
    assert out[1:, :, :3].any(axis=2).all()
    floats = ramp() / 1000
    floats[0] = np.tile([np.nan, np.inf, -np.inf, -1.0], W // 4)
    out = colors(DepthColors("viridis").convert(metres(floats)))
    assert not out[0, :, :3].any()
    assert out[1:, :, :3].any(axis=2).all()


def test_range_ignores_outliers_and_is_steady() -> None:
    view = DepthColors()
    depths = np.tile(np.linspace(1000, 3000, W), (H, 1))
    depths[0, :3] = [1, 65535, 65535]
    view.convert(millimetres(depths))
    near, far = view.range
    assert near == pytest.approx(1.0, abs=0.1)
    assert far == pytest.approx(3.0, abs=0.1)
    view.convert(millimetres(depths * 2))
    assert far < view.range[1] < 4.0
    for _ in range(60):
        view.convert(millimetres(depths * 2))
    assert view.range[1] == pytest.approx(6.0, abs=0.2)
    before = view.range
    view.convert(millimetres(np.zeros((H, W))))
    assert view.range == before


@pytest.mark.parametrize(("near", "far"), [(None, None), (None, 2.0), (2.0, None), (5.0, None)])
def test_image_of_one_depth(near: float | None, far: float | None) -> None:
    view = DepthColors("gray", near, far)
    out = colors(view.convert(millimetres(np.full((H, W), 2000))))
    assert len(np.unique(out[..., 0])) == 1
    assert view.range[1] > view.range[0]
    assert near in {None, view.range[0]}
    assert far in {None, view.range[1]}


def test_colours_land_in_the_display_s_memory() -> None:
    memory = np.zeros((H, W + 8, 4), np.uint8)[:, :W]
    frame = DepthColors().convert(millimetres(ramp()), allocate=lambda width, height: memory)
    assert np.shares_memory(frame.planes[0], memory)
    np.testing.assert_array_equal(memory, colors(DepthColors().convert(millimetres(ramp()))))


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("rainbow",), "'rainbow' is unknown; known are: turbo"),
        (("jet", 2.0, 2.0), "far must be beyond near"),
        (("jet", -1.0), "must be a finite distance"),
        (("jet", float("nan")), "must be a finite distance"),
        (("jet", 0.0, float("inf")), "must be a finite distance"),
    ],
)
def test_bad_settings_are_reported(arguments: tuple, reason: str) -> None:
    with pytest.raises(UnsupportedError, match=reason):
        DepthColors(*arguments)


def test_other_images_are_reported() -> None:
    with pytest.raises(UnsupportedError, match="'rgb8' holds no depths"):
        DepthColors().convert(RawImage(2, 2, "rgb8", 6, bytes(12)))
    with pytest.raises(DecodeError, match="step is 3"):
        DepthColors().convert(RawImage(2, 2, "16UC1", 3, bytes(12)))


def greys(frame: object) -> np.ndarray:
    assert frame.planes[0].shape == (H, W)
    return frame.planes[0].astype(int)


def test_greys_of_a_fixed_range_are_clipped() -> None:
    expected = np.clip((ramp() - 1500) / 1000, 0, 1) * 255
    for image, scale in (
        (millimetres(ramp()), 1),
        (millimetres(ramp(), True), 1),
        (metres(ramp() / 1000), 1000),
    ):
        shown = GreyLevels(GreyRange(1500 / scale, 2500 / scale)).convert(image)
        assert np.abs(greys(shown) - expected).max() <= 1


def test_black_and_white_follow_the_median_of_the_extremes() -> None:
    levels = GreyLevels(GreyRange(window=3))
    shown = greys(levels.convert(millimetres(ramp())))
    assert (shown[0, 0], shown[0, -1]) == (0, 255)
    outlier = ramp()
    outlier[0, 0] = 60000
    shown = greys(levels.convert(millimetres(ramp())))
    shown = greys(levels.convert(millimetres(outlier)))
    assert (shown[0, 0], shown[0, -1]) == (255, 255), "one picture does not change the range"
    levels.convert(millimetres(outlier))
    assert greys(levels.convert(millimetres(outlier)))[0, -1] < 20, "most of them do"


def test_numbers_that_are_not_finite_and_empty_ranges_are_black() -> None:
    some = ramp() / 1000
    some[0, :4] = np.nan, np.inf, -np.inf, 3e38
    shown = greys(GreyLevels(GreyRange(1, 3)).convert(metres(some)))
    assert shown[0, :4].tolist() == [0, 0, 0, 255]
    assert shown[1, -1] == 255
    for numbers in (np.full((H, W), np.nan), np.full((H, W), 2.0)):
        assert not greys(GreyLevels(GreyRange()).convert(metres(numbers))).any()
    assert not greys(GreyLevels(GreyRange(5, 1)).convert(metres(some))).any()


def test_greys_are_for_one_number_per_pixel() -> None:
    with pytest.raises(UnsupportedError, match="'rgb8' has no range of greys"):
        GreyLevels(GreyRange()).convert(RawImage(W, H, "rgb8", 3 * W, bytes(3 * W * H)))

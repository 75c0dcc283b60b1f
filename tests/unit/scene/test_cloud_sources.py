"""Clouds from laser scans, depth images and the old PointCloud."""

from __future__ import annotations

from math import cos, inf, nan, pi, sin
from typing import Any

import numpy as np
import pytest

from rosglass.errors import DecodeError
from rosglass.messages import load
from rosglass.scene.data.cloud_sources import (
    OcclusionBuffer,
    cloud_from_columns,
    cloud_from_depth_image,
    cloud_from_laser_scan,
    cloud_from_point_cloud,
)
from rosglass.tf import Transform


def message(name: str, value: dict[str, Any], ros: int) -> Any:
    """Return a message as it is received."""
    kind = load(f"sensor_msgs/msg/{name}", ros=ros)
    return kind.decode(kind.encode(value))


# ---- columns


def test_columns_become_float32_and_packed_colors_stay() -> None:
    columns = {
        "x": [1, 2],
        "y": np.array([3.5, 4]),
        "z": (5, 6),
        "rgb": np.array([7, 8], np.uint32),
    }
    cloud = cloud_from_columns(columns, ["a warning"])
    assert cloud.positions().tolist() == [[1, 3.5, 5], [2, 4, 6]]
    assert cloud.values("rgb").tolist() == [7, 8]
    assert np.shares_memory(cloud.vertex_data().data, cloud.data)
    assert cloud.warnings == ("a warning",)


def test_columns_that_do_not_fit_are_refused() -> None:
    with pytest.raises(DecodeError, match="no field 'z'"):
        cloud_from_columns({"x": [1], "y": [1]})
    assert cloud_from_columns({}).point_count == 0


# ---- PointCloud

OLD: dict[str, Any] = {
    "points": [{"x": 1, "y": 2, "z": 3}, {"x": 4, "y": 5, "z": nan}],
    "channels": [
        {"name": "intensity", "values": [7, 8]},
        {"name": "short", "values": [7]},
        {"name": "x", "values": [7, 8]},
        {"name": "intensity", "values": [9, 9]},
    ],
}


@pytest.mark.parametrize("ros", [0, 1, 2])
def test_legacy_point_cloud(ros: int) -> None:
    cloud = cloud_from_point_cloud(message("PointCloud", OLD, ros) if ros else OLD)
    assert cloud.positions()[0].tolist() == [1, 2, 3]
    assert cloud.finite_count == 1
    assert cloud.layout.channels == ["intensity", "x", "y", "z"]
    assert cloud.values("intensity").tolist() == [7, 8]
    assert len(cloud.warnings) == 3
    assert "'short' has 1 values for 2 points" in cloud.warnings[0]
    assert "'x' is in use" in cloud.warnings[1]


def test_empty_or_malformed_legacy_point_cloud() -> None:
    assert cloud_from_point_cloud({"points": [], "channels": []}).point_count == 0
    many = [{"name": f"c{i}", "values": []} for i in range(300)]
    assert "300 channels" in cloud_from_point_cloud({"points": [], "channels": many}).warnings[0]
    for changes in (
        {"points": 5},
        {"points": [{"x": 1}]},
        {"points": [{"x": "a", "y": 1, "z": 1}]},
        {"channels": None},
        {"channels": [{"name": "a", "values": 5}]},
        {"channels": [{"name": "a", "values": ["b"]}]},
    ):
        with pytest.raises(DecodeError, match="PointCloud"):
            cloud_from_point_cloud(OLD | changes)


# ---- LaserScan


def scan(ranges: list[float], intensities: list[float] = [], **changes: Any) -> dict[str, Any]:  # noqa: B006
    return {
        "angle_min": 0.0,
        "angle_max": pi,
        "angle_increment": pi / 4,
        "time_increment": 0.01,
        "range_min": 0.5,
        "range_max": 10.0,
        "ranges": ranges,
        "intensities": intensities,
        **changes,
    }


@pytest.mark.parametrize("ros", [1, 2])
def test_scan_becomes_points_within_its_limits(ros: int) -> None:
    ranges = [2.0, 0.4, 3.0, 10.0, 0.5, nan, inf, -inf]
    received = message("LaserScan", scan(ranges, [float(i) for i in range(8)]), ros)
    cloud = cloud_from_laser_scan(received)
    expected = [(2, 0, 0), (3 * cos(pi / 2), 3 * sin(pi / 2), 0), (-0.5, 0, 0)]
    assert np.allclose(cloud.positions(), expected, atol=1e-6)
    assert cloud.values("intensity").tolist() == [0, 2, 4]
    assert not cloud.warnings


def test_infinite_limits_and_wrong_numbers_of_intensities() -> None:
    cloud = cloud_from_laser_scan(scan([1.0, inf, 1e30], [1.0], range_max=inf))
    assert cloud.point_count == 2
    assert cloud.layout.channels == ["x", "y", "z"]
    assert "1 intensities for 3 ranges" in cloud.warnings[0]
    assert cloud_from_laser_scan(scan([])).point_count == 0


def test_motion_during_a_scan() -> None:
    received = scan([2.0] * 5, angle_increment=0.0)
    start = Transform((0, 0, 0), (0, 0, 0, 1))
    # It moves by 4 m along y and turns by 180 degrees about z.
    end = Transform((0, 4, 0), (0, 0, 1, 0))
    cloud = cloud_from_laser_scan(received, start, end)
    expected = [(2 * cos(k * pi / 4), k + 2 * sin(k * pi / 4), 0) for k in range(5)]
    assert np.allclose(cloud.positions(), expected, atol=1e-5)
    # The other sign is the same rotation.
    half = cos(pi / 8), sin(pi / 8)
    quarter = [Transform(rotation=(0, 0, s * half[1], s * half[0])) for s in (1, -1)]
    clouds = [cloud_from_laser_scan(received, start, one).positions() for one in quarter]
    assert np.allclose(*clouds, atol=1e-6)
    still = cloud_from_laser_scan(received, end, end)
    assert np.allclose(still.positions(), [(-2, 4, 0)] * 5, atol=1e-5)
    assert cloud_from_laser_scan(scan([2.0]), start, end).point_count == 1


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"angle_min": nan}, "angle_min"),
        ({"angle_increment": inf}, "angle_increment"),
        ({"range_max": nan}, "range_max"),
        ({"range_min": "a"}, "range_min"),
        ({"ranges": 5}, "ranges"),
        ({"ranges": ["a"]}, "ranges"),
        ({"intensities": [[1.0]]}, "intensities"),
    ],
)
def test_bad_scans_are_refused(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(DecodeError, match=rf"LaserScan\.{field}"):
        cloud_from_laser_scan(scan([1.0]) | changes)


# ---- depth images


def image(pixels: np.ndarray, encoding: str, **changes: Any) -> dict[str, Any]:
    return {
        "height": pixels.shape[0],
        "width": pixels.shape[1],
        "encoding": encoding,
        "is_bigendian": 0,
        "step": pixels[0].nbytes,
        "data": pixels.tobytes(),
        **changes,
    }


def camera(ros: int = 2, **changes: Any) -> dict[str, Any]:
    roi = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}
    p = [100.0, 0, 2, 0, 0, 50.0, 1, 0, 0, 0, 1, 0]
    info = {"p" if ros == 2 else "P": p, "roi": roi, "binning_x": 0, "binning_y": 0}
    return info | changes


DEPTH = np.array([[1000, 0, 2000, 0], [0, 0, 0, 500]], np.uint16)
POINTS = [(-0.02, -0.02, 1.0), (0.0, -0.04, 2.0), (0.005, 0.0, 0.5)]


@pytest.mark.parametrize("ros", [1, 2])
def test_depths_in_millimetres(ros: int) -> None:
    for encoding in ("16UC1", "mono16"):
        depth = message("Image", image(DEPTH, encoding), ros)
        info = message("CameraInfo", camera(ros), ros)
        cloud = cloud_from_depth_image(depth, info)
        assert np.allclose(cloud.positions(), POINTS)
        assert cloud.values("rgb").tolist() == [0xFFFFFF] * 3


def test_depths_in_metres() -> None:
    metres = np.where(DEPTH, DEPTH / 1000, nan).astype(np.float32)
    metres[1, 0] = inf
    assert np.allclose(cloud_from_depth_image(image(metres, "32FC1"), camera()).positions(), POINTS)


def test_binning_and_region_of_the_calibration() -> None:
    roi = {"x_offset": 1, "y_offset": 2}
    cloud = cloud_from_depth_image(image(DEPTH, "16UC1"), camera(roi=roi, binning_x=2, binning_y=1))
    # fx 50, fy 50, cx 0.5, cy -1: pixels are twice as wide
    assert np.allclose(cloud.positions()[0], (-0.5 / 50, 1 / 50, 1.0))


@pytest.mark.parametrize(
    ("encoding", "channels", "colors"),
    [
        ("rgb8", 3, [0x000102, 0x060708, 0x151617]),
        ("bgr8", 3, [0x020100, 0x080706, 0x171615]),
        ("rgba8", 4, [0x000102, 0x08090A, 0x1C1D1E]),
        ("bgra8", 4, [0x020100, 0x0A0908, 0x1E1D1C]),
        ("mono8", 1, [0x000000, 0x020202, 0x070707]),
    ],
)
def test_color_image_colors_the_points(encoding: str, channels: int, colors: list[int]) -> None:
    pixels = np.arange(8 * channels, dtype=np.uint8).reshape(2, 4, channels)
    cloud = cloud_from_depth_image(image(DEPTH, "16UC1"), camera(), image(pixels, encoding))
    assert cloud.values("rgb").tolist() == colors


@pytest.mark.parametrize(
    ("depth", "info", "color", "text"),
    [
        ({"encoding": "rgb8"}, {}, None, "16UC1, mono16 or 32FC1"),
        ({"width": 5}, {}, None, "step"),
        ({"width": 0}, {}, None, "width"),
        ({"data": b"12"}, {}, None, "data"),
        ({}, {"p": [0.0] * 12}, None, r"CameraInfo.p\[0\].*not calibrated"),
        ({}, {"p": [1.0] * 11}, None, "12 finite numbers"),
        ({}, {"p": [nan] * 12}, None, "12 finite numbers"),
        ({}, {"binning_x": -1}, None, "binning_x"),
        ({}, {"roi": None}, None, "x_offset"),
        ({}, {}, {"encoding": "yuv422"}, "colours are one of mono8"),
        ({}, {}, {"width": 2, "height": 4}, "2x4 pixels, the depth image 4x2"),
    ],
)
def test_bad_depth_images_are_refused(
    depth: dict[str, Any], info: dict[str, Any], color: dict[str, Any] | None, text: str
) -> None:
    pixels = np.zeros((2, 4, 3), np.uint8)
    colored = None if color is None else image(pixels, "rgb8") | color
    with pytest.raises(DecodeError, match=text):
        cloud_from_depth_image(image(DEPTH, "16UC1") | depth, camera() | info, colored)


# ---- occlusion compensation


class RvizLayers:
    """RViz's Occlusion Compensation, pixel by pixel."""

    def __init__(self, timeout_s: float) -> None:
        self.timeout_s = timeout_s
        self.kept: dict[int, tuple[float, float, int]] = {}

    def add(self, depths: np.ndarray, colors: np.ndarray, now_s: float) -> list[tuple[float, int]]:
        """Return depth and colour of all points of an image."""
        found = []
        for pixel, (depth, color) in enumerate(zip(depths.tolist(), colors.tolist(), strict=True)):
            if pixel in self.kept and self.kept[pixel][1] < now_s:
                del self.kept[pixel]
            kept = self.kept.get(pixel)
            if depth == 0:
                found += [(kept[0], kept[2])] if kept else []
                continue
            found.append((depth, color))
            if kept and depth < kept[0] - 0.01:
                found.append((kept[0], kept[2]))
            else:
                half = (color >> 1) & 0x7F7F7F
                self.kept[pixel] = (depth, now_s + self.timeout_s, half)
        return found


def test_hidden_points_are_those_of_rviz() -> None:
    random = np.random.default_rng(1)
    ours, theirs = OcclusionBuffer(3.0), RvizLayers(3.0)
    info = camera()
    for now_s in range(30):
        depths = random.integers(0, 4, 20) * 500 + random.integers(0, 30, 20)
        depths[random.random(20) < 0.3] = 0
        rgb = random.integers(0, 256, (20, 3)).astype(np.uint8)
        depth = image(depths.astype("<u2").reshape(4, 5), "16UC1")
        color = image(rgb.reshape(4, 5, 3), "rgb8")
        cloud, hidden = ours.add(depth, info, color, float(now_s))
        packed = (rgb.astype(int) @ (0x10000, 0x100, 1)).astype(int)
        expected = theirs.add(depths / 1000, packed, float(now_s))
        found = zip(cloud.column("z").tolist(), cloud.values("rgb").tolist(), strict=True)
        assert sorted((round(z, 4), int(c)) for z, c in found) == sorted(
            (round(z, 4), c) for z, c in expected
        )
        assert hidden == len(expected) - np.count_nonzero(depths)
        # Hidden ones come last.
        order = [int(c) in set(packed.tolist()) for c in cloud.values("rgb").tolist()]
        assert order[: len(order) - hidden] == [True] * (len(order) - hidden)


def test_another_camera_has_seen_nothing() -> None:
    buffer = OcclusionBuffer()
    far = image(np.full((2, 2), 4000, "<u2"), "16UC1")
    near = image(np.full((2, 2), 1000, "<u2"), "16UC1")
    info = camera()
    assert buffer.add(far, info, None, 0.0)[1] == 0
    assert buffer.add(near, info, None, 1.0)[1] == 4
    other = camera(binning_x=2)
    assert buffer.add(near, other, None, 2.0)[1] == 0
    assert buffer.add(far, other, None, 2.0)[1] == 0
    buffer.reset()
    assert buffer.add(near, other, None, 3.0)[1] == 0

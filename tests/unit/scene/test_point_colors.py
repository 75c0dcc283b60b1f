"""Colours of points: RViz's transformers, their choice, and the formulas of the shader."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from point_clouds import packed_color, point_cloud2, random_points

from rosglass.scene.data.point_clouds import Channel, Cloud
from rosglass.scene.render.point_colors import (
    COLOR_TRANSFORMERS,
    AxisColor,
    FlatColor,
    Intensity,
    Mono8,
    PointColors,
    Rgb8,
    RgbF32,
    choose_color_transformer,
    rainbow,
    supported_color_transformers,
)

RED, YELLOW, GREEN = [255, 0, 0, 255], [255, 255, 0, 255], [0, 255, 0, 255]
CYAN, BLUE, MAGENTA = [0, 255, 255, 255], [0, 0, 255, 255], [255, 0, 255, 255]
WHITE = [255] * 4


def cloud(columns: dict[str, Any], **options: Any) -> Cloud:
    count = len(next(iter(columns.values())))
    return Cloud.from_message(point_cloud2(random_points(count) | columns, **options))


def intensities(*values: float) -> Cloud:
    return cloud({"intensity": np.array(values, np.float32)})


def shader(colors: PointColors, position: np.ndarray, channel: Any) -> list[float]:
    """Compute one colour step by step as the docstring of Coloring says."""
    if colors.mode == "flat":
        return [*colors.first, 1.0]
    if colors.mode == "bgra":
        blue, green, red, alpha = (byte / 255 for byte in channel)
        return [red, green, blue, alpha if colors.per_point_alpha else 1.0]
    value = channel
    if colors.mode == "axis":
        value = float(np.dot(colors.axis, [*position, 1.0]))
    part = (value - colors.low) / (colors.high - colors.low) if colors.high != colors.low else 0.0
    if not abs(part) < 1e30:
        part = 0.0
    part = min(max(part, 0.0), 1.0)
    if colors.mode == "gradient":
        pairs = zip(colors.first, colors.last, strict=True)
        return [a * (1 - part) + b * part for a, b in pairs] + [1.0]
    h = 5 * (part if colors.invert else 1 - part)
    rgb = (max(1 - h, h - 3), min(h - 1, 5 - h), 3 - h)
    return [min(max(component, 0.0), 1.0) for component in rgb] + [1.0]


# Made by hand from the hue circle: 300 degrees (magenta) at 0 to 0 degrees (red) at 1.
def test_rainbow_goes_from_magenta_to_red() -> None:
    parts = np.array([0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1], np.float32)
    expected = [
        (1, 0, 1),
        (0.5, 0, 1),
        (0, 0, 1),
        (0, 0.5, 1),
        (0, 1, 1),
        (0, 1, 0.5),
        (0, 1, 0),
        (0.5, 1, 0),
        (1, 1, 0),
        (1, 0.5, 0),
        (1, 0, 0),
    ]
    assert np.allclose(rainbow(parts), expected, atol=1e-6)


# ---- choice

FLOAT = np.zeros(2, np.float32)
ANY = ["AxisColor", "FlatColor", "Intensity"]


@pytest.mark.parametrize(
    ("columns", "supported", "default"),
    [
        ({}, ANY, "Intensity"),
        ({"intensity": FLOAT}, ANY, "Intensity"),
        ({"rgb": FLOAT, "intensity": FLOAT}, [*ANY, "MONO8", "RGB8"], "RGB8"),
        ({"rgba": FLOAT.view(np.uint32)}, [*ANY, "MONO8", "RGB8"], "RGB8"),
        ({"rgb": FLOAT.astype(np.uint16)}, ANY, "Intensity"),
        ({"r": FLOAT, "g": FLOAT, "b": FLOAT}, [*ANY, "RGBF32"], "Intensity"),
        ({"r": FLOAT, "g": FLOAT}, ANY, "Intensity"),
        ({"r": FLOAT.astype(np.uint8), "g": FLOAT, "b": FLOAT}, ANY, "Intensity"),
    ],
)
def test_choice_of_the_transformer(
    columns: dict[str, Any], supported: list[str], default: str
) -> None:
    layout = cloud(columns | {"pad": FLOAT}).layout
    assert supported_color_transformers(layout) == supported
    assert choose_color_transformer(layout) == default
    assert choose_color_transformer(layout, "FlatColor") == "FlatColor"
    for name in {*COLOR_TRANSFORMERS, "none", ""} - {*supported}:
        assert choose_color_transformer(layout, name) == default


# ---- transformers


def test_intensity_goes_from_red_to_magenta_over_the_range_of_the_cloud() -> None:
    found = intensities(10, 20, 30, 40, 50, 60)
    colors = Intensity().colors(found)
    assert colors.bounds == (10, 60)
    assert colors.of_points(found).tolist() == [RED, YELLOW, GREEN, CYAN, BLUE, MAGENTA]
    inverted = Intensity(invert_rainbow=True).colors(found)
    assert inverted.of_points(found).tolist() == [MAGENTA, BLUE, CYAN, GREEN, YELLOW, RED]


def test_intensity_with_two_colors_and_fixed_bounds() -> None:
    found = intensities(-5, 0, 50, 100, 900)
    colors = Intensity(
        use_rainbow=False,
        min_color=(0, 0, 1),
        max_color=(1, 1, 0, 0.5),
        autocompute_intensity_bounds=False,
        min_intensity=0,
        max_intensity=100,
    ).colors(found)
    blue, middle, yellow = [0, 0, 255, 255], [128, 128, 128, 255], [255, 255, 0, 255]
    assert colors.of_points(found).tolist() == [blue, blue, middle, yellow, yellow]
    assert colors.bounds == (0, 100)


def test_defaults_are_those_of_rviz() -> None:
    assert Intensity() == Intensity(
        "intensity", True, False, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), True, 0.0, 4096.0
    )
    assert AxisColor() == AxisColor("Z", True, -10.0, 10.0, True)
    assert FlatColor() == FlatColor((1.0, 1.0, 1.0))


def test_equal_intensities_have_the_color_of_the_minimum() -> None:
    found = intensities(7, 7, 7)
    for transformer, color in (
        (Intensity(), RED),
        (Intensity(invert_rainbow=True), MAGENTA),
        (Intensity(use_rainbow=False), [0, 0, 0, 255]),
    ):
        assert transformer.colors(found).of_points(found).tolist() == [color] * 3


def test_values_that_are_not_finite_have_the_color_of_the_minimum() -> None:
    found = intensities(1, np.nan, np.inf, -np.inf, 3)
    colors = Intensity().colors(found)
    assert colors.bounds == (1, 3)
    assert colors.of_points(found).tolist() == [RED, RED, RED, RED, MAGENTA]


def test_missing_channel_makes_white_points_and_a_warning() -> None:
    found = cloud({"ring": np.zeros(2, np.uint16)})
    colors = Intensity().colors(found)
    assert colors.of_points(found).tolist() == [WHITE] * 2
    assert "no readable channel 'intensity'" in colors.warning
    assert "its fields are ring, x, y, z" in colors.warning
    assert "rgb" in Rgb8().colors(found).warning
    assert "float32" in RgbF32().colors(found).warning
    empty = Cloud.from_message(point_cloud2(random_points(1)) | {"width": 0, "data": b""})
    for transformer in COLOR_TRANSFORMERS.values():
        nothing = transformer().colors(empty)
        assert nothing.warning == ""
        assert nothing.of_points(empty).shape == (0, 4)


def test_intensity_and_intensities_are_the_same() -> None:
    found = cloud({"intensities": np.array([1, 2], np.float32)})
    assert Intensity().colors(found).channel == Channel(("intensities",))
    found = intensities(1, 2)
    assert Intensity("intensities").colors(found).channel == Channel(("intensity",))


def test_packed_colors_and_their_alpha() -> None:
    bits = np.array([packed_color(1, 2, 3, 4), packed_color(250, 128, 0, 255)], np.uint32)
    found = cloud({"rgb": bits.view(np.float32)})
    colors = Rgb8().colors(found)
    assert not colors.per_point_alpha
    assert colors.of_points(found).tolist() == [[1, 2, 3, 255], [250, 128, 0, 255]]
    found = cloud({"rgba": bits})
    colors = Rgb8().colors(found)
    assert colors.per_point_alpha
    assert colors.of_points(found).tolist() == [[1, 2, 3, 4], [250, 128, 0, 255]]
    grey = Mono8().colors(found)
    assert grey.of_points(found).tolist() == [[2, 2, 2, 4], [150, 150, 150, 255]]
    vertices = found.vertex_data(grey.channel)
    assert vertices.data.reshape(2, 16)[:, 12:].tolist() == [[2, 2, 2, 4], [150, 150, 150, 255]]


def test_separate_colors() -> None:
    columns = {"r": [1.0, 0.0], "g": [0.5, 0.0], "b": [0.0, 1.0]}
    found = cloud({name: np.array(value, np.float32) for name, value in columns.items()})
    colors = RgbF32().colors(found)
    assert colors.of_points(found).tolist() == [[255, 128, 0, 255], [0, 0, 255, 255]]


def line(*heights: float) -> Cloud:
    z = np.array(heights, np.float32)
    return Cloud.from_message(point_cloud2({"x": z * 0, "y": z * 2, "z": z}))


def test_colors_along_an_axis() -> None:
    found = line(0, 1, 2, 3, 4, 5)
    expected = [RED, YELLOW, GREEN, CYAN, BLUE, MAGENTA]
    assert AxisColor().colors(found).of_points(found).tolist() == expected
    along_y = AxisColor("Y").colors(found)
    assert along_y.bounds == (0, 10)
    assert along_y.of_points(found).tolist() == expected
    fixed = AxisColor(autocompute_value_bounds=False, min_value=0, max_value=10).colors(found)
    assert fixed.bounds == (0, 10)
    assert fixed.of_points(found)[5].tolist() == [0, 255, 128, 255]
    equal = AxisColor(autocompute_value_bounds=False, min_value=2, max_value=2).colors(found)
    assert equal.of_points(found).tolist() == [RED] * 3 + [MAGENTA] * 3
    level = AxisColor("X").colors(found)
    assert level.of_points(found).tolist() == [RED] * 6


def test_axis_of_the_fixed_frame() -> None:
    found = line(0, 1, 2, 3, 4, 5)
    # The cloud's z is the fixed frame's -x, 100 km away.
    transform = np.array([[0, 0, -1, 1e5], [0, 1, 0, 0], [1, 0, 0, 5], [0, 0, 0, 1]], float)
    colors = AxisColor("X").colors(found, transform)
    assert colors.bounds == (99995, 100000)
    expected = [MAGENTA, BLUE, CYAN, GREEN, YELLOW, RED]
    assert colors.of_points(found).tolist() == expected
    manual = AxisColor("X", False, 99995, 100000).colors(found, transform)
    assert manual.of_points(found).tolist() == expected
    own = AxisColor("Z", use_fixed_frame=False).colors(found, transform)
    assert own.of_points(found).tolist() == expected[::-1]


def test_shaders_formulas_give_the_same_colors() -> None:
    random = np.random.default_rng(3)
    columns = random_points(60) | {
        "intensity": random.normal(0, 50, 60).astype(np.float32),
        "rgba": random.integers(0, 1 << 32, 60, np.uint32),
    }
    columns["intensity"][:3] = np.nan, np.inf, -np.inf
    found = Cloud.from_message(point_cloud2(columns))
    transform = np.linalg.qr(random.normal(size=(4, 4)))[0]
    for transformer in (
        FlatColor((0.2, 0.4, 0.6)),
        Rgb8(),
        Mono8(),
        Intensity(),
        Intensity(invert_rainbow=True),
        Intensity("x", use_rainbow=False, min_color=(1, 0, 0.5)),
        Intensity(autocompute_intensity_bounds=False, min_intensity=20, max_intensity=-30),
        Intensity(autocompute_intensity_bounds=False, min_intensity=5, max_intensity=5),
        AxisColor(),
        AxisColor("Y", False, 1.0, 1.0),
    ):
        colors = transformer.colors(found, transform)
        vertices = found.vertex_data(colors.channel)
        rows = vertices.data.reshape(60, vertices.stride)
        channels: Any = [0.0] * 60
        if vertices.channel >= 0:
            channels = np.ascontiguousarray(rows[:, vertices.channel : vertices.channel + 4])
            channels = channels if vertices.channel_is_bytes else channels.view("<f4")[:, 0]
        expected = [
            shader(colors, position, channel)
            for position, channel in zip(found.positions(), channels, strict=True)
        ]
        difference = colors.of_points(found) - np.array(expected) * 255
        assert np.abs(difference).max() < 1.01, transformer

"""The image of a plot's lines."""

from __future__ import annotations

import numpy as np
import pytest

from rosglass.controls.plots.raster import Background, Curve, Raster, outline

WIDTH, HEIGHT = 60, 40
EMPTY, COLORS = Background(0, 0, ()), np.array([1, 2, 3], np.uint32)


def drawn(low: np.ndarray, high: np.ndarray, first: int = 0, most: int = 5) -> np.ndarray:
    """Return the pixels of lines, whose values are pixels from the bottom."""
    raster = made()
    raster.draw(extents(low, high, most), COLORS, [], EMPTY, first, 0)
    return pixels(raster)


def made() -> Raster:
    return Raster(WIDTH, HEIGHT)


def extents(low: np.ndarray, high: np.ndarray, most: int = 5) -> object:
    count = len(low)
    return outline(
        low, high, np.full(count, HEIGHT - 0.5), np.ones(count), np.zeros(count, bool),
        np.full(count, most),
    )  # fmt: skip


def pixels(raster: Raster) -> np.ndarray:
    return raster.pixels.copy()


def empty(lines: int = 1) -> tuple[np.ndarray, np.ndarray]:
    return np.full((lines, WIDTH), np.inf), np.full((lines, WIDTH), -np.inf)


def test_extents_fill_their_columns() -> None:
    low, high = empty()
    low[0, 10], high[0, 10] = 5, 20
    shown = drawn(low, high)
    column = HEIGHT - 1 - np.flatnonzero(shown[:, 10])
    assert sorted(column) == list(range(5, 21))
    assert np.count_nonzero(shown) == 16


def test_neighbours_and_distant_samples_are_connected() -> None:
    low, high = empty()
    for at, value in ((10, 5), (11, 30), (15, 10), (30, 10)):
        low[0, at] = high[0, at] = value
    shown = drawn(low, high)
    assert shown[:, 10:16].any(axis=0).all()
    # Without a break from row to row.
    for at in (10, 11, 12, 13, 14):
        rows = [np.flatnonzero(shown[:, one]) for one in (at, at + 1)]
        assert rows[0].min() <= rows[1].max() + 1
        assert rows[1].min() <= rows[0].max() + 1
    assert not shown[:, 16:30].any()


def test_nan_is_a_gap_however_short() -> None:
    low, high = empty()
    low[0, 10] = high[0, 10] = low[0, 12] = high[0, 12] = 7
    low[0, 11] = high[0, 11] = np.nan
    assert not drawn(low, high)[:, 11].any()


@pytest.mark.parametrize("value", [1e300, -1e300, np.inf, -np.inf])
def test_line_to_far_away_stays_in_its_columns(value: float) -> None:
    low, high = empty()
    low[0, 10] = high[0, 10] = 20
    low[0, 14] = high[0, 14] = value
    shown = drawn(low, high)
    assert shown[HEIGHT - 21, 10]
    assert not shown[:, :10].any()
    assert not shown[:, 15:].any()


def test_scrolling_paints_what_painting_anew_does() -> None:
    random = np.random.default_rng(3)
    low, high = empty(3)
    values = random.integers(0, HEIGHT, (3, 400))
    raster, first = made(), 0
    for end in range(WIDTH, 400, 7):
        moved = end - WIDTH - first
        first = end - WIDTH
        low[:] = values[:, first:end]
        high[:] = low + 3
        fresh = WIDTH - moved - 1 if moved else 0
        shown = extents(low, high)
        raster.draw(shown, COLORS, [], EMPTY, first, fresh)
        # The first column is still connected with the one that has left the image.
        assert np.array_equal(pixels(raster)[:, 1:], drawn(low, high, first)[:, 1:])


def test_later_lines_cover_earlier_ones() -> None:
    random = np.random.default_rng(4)
    low, high = empty(150)
    low[:] = random.integers(-20, HEIGHT + 20, low.shape)
    high[:] = low + random.integers(0, 8, low.shape)
    colors = np.arange(1, 151, dtype=np.uint32)
    raster = made()
    raster.draw(extents(low, high, most=0), colors, [], EMPTY, 0, 0)
    wanted = np.zeros((HEIGHT, WIDTH), np.uint32)
    for line in range(150):
        for column in range(WIDTH):
            top, bottom = (HEIGHT - 1 - int(end[line, column]) for end in (high, low))
            wanted[max(top, 0) : max(bottom + 1, 0), column] = colors[line]
    assert np.array_equal(pixels(raster), wanted)


def test_image_that_moves_to_the_end_of_its_memory_is_the_same() -> None:
    low, high = empty()
    low[:] = high[:] = np.arange(WIDTH) % HEIGHT
    raster = made()
    raster.draw(extents(low, high), COLORS, [], EMPTY, 0, 0)
    whole, first = pixels(raster), 0
    for moved in (1, WIDTH - 1, WIDTH // 2, WIDTH - 2, 3):
        before, first = pixels(raster), first + moved
        raster.draw(extents(*empty()), COLORS, [], EMPTY, first, WIDTH - moved)
        assert np.array_equal(pixels(raster)[:, :-moved], before[:, moved:])
        assert not pixels(raster)[:, -moved:].any()
    raster.draw(extents(low, high), COLORS, [], EMPTY, first, 0)
    assert np.array_equal(pixels(raster), whole)


def test_curve_is_drawn_inside_the_image_only() -> None:
    raster = made()
    angle = np.linspace(0, 2 * np.pi, 200)
    x, y = 30 + 60 * np.cos(angle), 20 + 15 * np.sin(angle)
    x[50] = np.nan
    raster.draw(extents(*empty()), COLORS, [Curve(x, y, 9)], EMPTY, 0, 0)
    shown = pixels(raster)
    assert set(np.unique(shown)) == {0, 9}
    assert shown[5, 20] == 9
    raster.draw(extents(*empty()), COLORS, [Curve(x * 1e9, y * 1e9, 9)], EMPTY, 0, 0)


def test_grid_is_below_the_lines() -> None:
    rows = Background(4, 5, (3, -1, HEIGHT))
    raster = made()
    low, high = empty()
    low[0, 10], high[0, 10] = 0, HEIGHT
    raster.draw(extents(low, high), COLORS, [], rows, 0, 0)
    shown = pixels(raster)
    assert shown[3, 9] == 5
    assert shown[4, 9] == 4
    assert (shown[:, 10] == 1).all()

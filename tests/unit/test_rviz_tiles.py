"""The tiles of an interface over RViz's view that are not transparent."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rosglass.rviz.tiles import (
    Rect,
    changed_tiles,
    cover,
    covered_tiles,
    trimmed,
    uncovered,
    update_covered,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray


def picture(width: int, height: int, *rects: tuple[int, int, int, int]) -> NDArray[np.uint32]:
    pixels = np.zeros((height, width), np.uint32)
    for left, top, right, bottom in rects:
        pixels[top:bottom, left:right] = 0xFF00FF00
    return pixels


def painted(rects: list[Rect], width: int, height: int) -> NDArray[np.int64]:
    """How often each pixel is in a rectangle."""
    times = np.zeros((height, width), np.int64)
    for rect in rects:
        assert 0 <= rect.left < rect.right <= width
        assert 0 <= rect.top < rect.bottom <= height
        times[rect.top : rect.bottom, rect.left : rect.right] += 1
    return times


def test_one_opaque_pixel_covers_a_tile() -> None:
    pixels = picture(50, 40)
    pixels[39, 49] = 0x000001
    covered = covered_tiles(pixels)
    assert covered.shape == (5, 7)
    assert covered.sum() == 1
    assert covered[4, 6]


def test_changed_tiles_are_those_that_differ() -> None:
    before = picture(100, 70, (0, 0, 100, 70))
    now = before.copy()
    assert not changed_tiles(now, before).any()
    now[16, 47] ^= 1
    assert np.argwhere(changed_tiles(now, before)).tolist() == [[2, 5]]
    # The bottom row comes first, as OpenGL gives it.
    assert np.argwhere(changed_tiles(now[::-1], before[::-1])).tolist() == [[6, 5]]


def test_only_where_it_may_differ_a_frame_is_compared() -> None:
    before = picture(100, 70)
    now = picture(100, 70, (0, 0, 100, 70))
    changed = changed_tiles(now, before, [Rect(17, 20, 18, 21), Rect(90, 60, 100, 70)])
    assert np.argwhere(changed).tolist() == [[2, 2], [7, 11], [7, 12], [8, 11], [8, 12]]
    assert not changed_tiles(before, before.copy(), [Rect(0, 0, 100, 70)]).any()
    assert not changed_tiles(now, before, []).any()


def test_panel_is_one_rectangle_cut_at_the_edge() -> None:
    pixels = picture(100, 70, (32, 48, 100, 70))
    assert cover(covered_tiles(pixels), 100, 70) == [(32, 48, 100, 70)]
    assert cover(covered_tiles(picture(100, 70)), 100, 70) == []


# Other tests may use the processor at the same time.
@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(
    st.integers(1, 200),
    st.integers(1, 200),
    st.lists(st.tuples(*[st.integers(0, 199)] * 4), max_size=12),
    st.integers(1, 20),
    st.sampled_from([0, 300, 5000]),
)
def test_rectangles_cover_everything_once_and_are_few(
    width: int, height: int, places: list[tuple[int, int, int, int]], most: int, worth: int
) -> None:
    pixels = picture(width, height, *places)
    tiles = covered_tiles(pixels)
    rects = cover(tiles, width, height, most=most, worth=worth)
    times = painted(rects, width, height)
    assert times.max(initial=0) <= 1
    assert (times[pixels != 0] == 1).all()
    assert len(rects) <= most
    more = uncovered(tiles, rects)
    assert more is not None
    assert more >= 0


def test_neighbours_are_joined_where_that_is_cheaper_but_never_over_a_third() -> None:
    pixels = picture(320, 320, (0, 0, 32, 32), (48, 0, 80, 32), (240, 240, 272, 272))
    tiles = covered_tiles(pixels)
    assert len(cover(tiles, 320, 320)) == 3
    assert sorted(cover(tiles, 320, 320, worth=600)) == [(0, 0, 80, 32), (240, 240, 272, 272)]
    assert len(cover(tiles, 320, 320, worth=500)) == 3


@settings(deadline=None)
@given(
    st.lists(st.tuples(*[st.integers(0, 99)] * 4), max_size=5),
    st.lists(st.tuples(*[st.integers(0, 99)] * 4), max_size=5),
)
def test_coverage_is_kept_up_to_date(
    first: list[tuple[int, int, int, int]], second: list[tuple[int, int, int, int]]
) -> None:
    before, now = picture(99, 90, *first), picture(99, 90, *second)
    covered = covered_tiles(before)
    update_covered(covered, now, cover(changed_tiles(now, before), 99, 90, most=3))
    assert (covered == covered_tiles(now)).all()


def test_uncovered_returns_waste_or_none_if_incomplete() -> None:
    tiles = covered_tiles(picture(64, 64, (0, 0, 16, 16)))
    assert uncovered(tiles, [Rect(0, 0, 32, 32)]) == 12
    assert uncovered(tiles, [Rect(16, 0, 32, 32)]) is None
    assert uncovered(tiles, []) is None
    assert uncovered(tiles & False, []) == 0


def test_empty_edges_are_trimmed() -> None:
    pixels = picture(64, 64, (17, 10, 42, 31))
    assert trimmed(pixels, Rect(16, 8, 48, 32)) == (17, 10, 42, 31)
    assert trimmed(pixels, Rect(16, 8, 40, 24)) == (17, 10, 40, 24)
    # A tile at most, for more is not looked at.
    assert trimmed(pixels, Rect(0, 0, 64, 64)) == (8, 8, 56, 56)
    assert trimmed(pixels, Rect(48, 48, 64, 64)) == (48, 48, 64, 64)


@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(
    st.integers(1, 60),
    st.integers(1, 60),
    st.lists(st.tuples(*[st.integers(0, 59)] * 4), max_size=4),
)
def test_nothing_that_is_seen_is_trimmed(
    width: int, height: int, places: list[tuple[int, int, int, int]]
) -> None:
    pixels = picture(width, height, *places)
    rects = cover(covered_tiles(pixels), width, height)
    inner = [trimmed(pixels, rect) for rect in rects]
    assert (painted(inner, width, height)[pixels != 0] == 1).all()
    assert sum(rect.area for rect in inner) <= sum(rect.area for rect in rects)


def test_it_needs_neither_qt_nor_rviz() -> None:
    program = "import sys, rosglass.rviz.tiles; print([m for m in sys.modules if 'Side' in m])"
    loaded = subprocess.check_output([sys.executable, "-c", program], text=True)
    assert loaded.strip() == "[]"

"""The layout of graphs in layers."""

from __future__ import annotations

import itertools
import random

import pytest

from rosglass.controls.lists.layered_layout import Layout, lay_out


def crossings(layout: Layout) -> int:
    """Return how many connections between neighbouring columns cross."""
    parts = [part for route in layout.routes.values() for part in itertools.pairwise(sorted(route))]
    return sum(
        a[0][0] == b[0][0] and (a[0][1] - b[0][1]) * (a[1][1] - b[1][1]) < -1e-9
        for a, b in itertools.combinations(parts, 2)
    )


def test_a_chain_is_a_straight_line() -> None:
    layout = lay_out("abc", [("a", "b"), ("b", "c")])
    assert layout.columns == {"a": 0, "b": 1, "c": 2}
    assert set(layout.rows.values()) == {0.0}
    assert layout.routes["a", "b"] == [(0, 0.0), (1, 0.0)]


def test_an_edge_over_several_columns_passes_each() -> None:
    layout = lay_out("abc", [("a", "b"), ("b", "c"), ("a", "c")])
    assert [column for column, _ in layout.routes["a", "c"]] == [0, 1, 2]
    assert abs(layout.routes["a", "c"][1][1] - layout.rows["b"]) >= 1


def test_crossings_are_removed() -> None:
    layout = lay_out("abcxyz", [("a", "z"), ("b", "y"), ("c", "x")])
    assert crossings(layout) == 0


def test_cycles_are_drawn_backwards() -> None:
    layout = lay_out("abc", [("a", "b"), ("b", "c"), ("c", "a")])
    assert sorted(layout.columns.values()) == [0, 1, 2]
    assert layout.routes["c", "a"][0][0] == layout.columns["c"]


def test_edges_to_itself_and_to_unknown_vertices_are_ignored() -> None:
    layout = lay_out(["a"], [("a", "a"), ("a", "nowhere")])
    assert layout.routes == {}
    assert lay_out((), ()).columns == {}


@pytest.mark.parametrize("seed", range(5))
def test_vertices_of_a_column_are_apart(seed: int) -> None:
    random.seed(seed)
    names = [f"n{number}" for number in range(60)]
    edges = [(random.choice(names), random.choice(names)) for _ in range(150)]
    layout = lay_out(names, edges)
    for column in set(layout.columns.values()):
        rows = sorted(layout.rows[name] for name in names if layout.columns[name] == column)
        assert all(b - a >= 1 - 1e-9 for a, b in itertools.pairwise(rows))
    assert min(row for route in layout.routes.values() for _, row in route) >= 0
    for (start, stop), route in layout.routes.items():
        assert route[0] == (layout.columns[start], layout.rows[start])
        assert route[-1] == (layout.columns[stop], layout.rows[stop])
    assert lay_out(reversed(names), reversed(edges)).rows == layout.rows

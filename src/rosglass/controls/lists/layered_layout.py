"""Layout of a directed graph in layers, from left to right: Sugiyama's method.

grandalf does this, too, but is GPL; the layouts of networkx do not avoid crossings, and Graphviz is
a program that has to be installed.
"""

from __future__ import annotations

import itertools
from bisect import bisect_right
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

__all__ = ["Layout", "lay_out"]

#: Points in columns between their ends that all edges together pass; with more, all are straight.
_MAX_BENDS = 1000
#: Passes over all layers that reduce crossings, and that straighten edges.
_ORDER_PASSES, _SHIFT_PASSES = 8, 8


class Layout:
    """The places of the vertices and edges of a graph.

    Attributes:
        columns: Column of each vertex, from 0 on.
        rows: Middle of each vertex on the other axis; vertices of one column are at least 1 apart,
            the smallest is 0.
        routes: For each edge the (column, row) that it passes, with both ends; one in each column,
            unless the graph is so large that its edges are straight.
    """

    def __init__(
        self,
        columns: Mapping[str, int],
        rows: Mapping[str, float],
        routes: Mapping[tuple[str, str], Sequence[tuple[int, float]]],
    ) -> None:
        self.columns, self.rows, self.routes = columns, rows, routes


def lay_out(vertices: Iterable[str], edges: Iterable[tuple[str, str]]) -> Layout:
    """Lay out a graph; the same graph is always laid out alike.

    Args:
        vertices: Names of the vertices; edges between others are ignored.
        edges: Names of two vertices each, from left to right where cycles allow.
    """
    names = sorted(set(vertices))
    known = set(names)
    wanted = sorted({(a, b) for a, b in edges if a in known and b in known and a != b})
    forward = _without_cycles(names, wanted)
    columns = _columns(names, set(forward.values()))
    # Each edge becomes a chain of vertices, one in each column that it passes.
    layers: list[list[str]] = [[] for _ in range(max(columns.values(), default=-1) + 1)]
    for name in names:
        layers[columns[name]].append(name)
    left: dict[str, list[str]] = {}
    right: dict[str, list[str]] = {}
    chains: dict[tuple[str, str], list[str]] = {}
    ahead = sorted(set(forward.values()))
    is_bent = sum(columns[b] - columns[a] - 1 for a, b in ahead) <= _MAX_BENDS
    for start, stop in ahead:
        chain = [start]
        for column in range(columns[start] + 1, columns[stop]) if is_bent else ():
            chain.append(f"{start}\0{stop}\0{column}")
            layers[column].append(chain[-1])
        chain.append(stop)
        for a, b in itertools.pairwise(chain):
            right.setdefault(a, []).append(b)
            left.setdefault(b, []).append(a)
        chains[start, stop] = chain
    _reduce_crossings(layers, left, right)
    rows = _straighten(layers, left, right)
    place = {name: at for at, layer in enumerate(layers) for name in layer}
    routes = {}
    for edge in wanted:
        chain = chains[forward[edge]]
        points = [(place[name], rows[name]) for name in chain]
        routes[edge] = points if forward[edge] == edge else points[::-1]
    return Layout(columns, {name: rows[name] for name in names}, routes)


def _without_cycles(
    names: Sequence[str], edges: Sequence[tuple[str, str]]
) -> dict[tuple[str, str], tuple[str, str]]:
    """Return for each edge itself or, if it closes a cycle, its reverse."""
    below: dict[str, list[str]] = {name: [] for name in names}
    for start, stop in edges:
        below[start].append(stop)
    done: set[str] = set()
    found = {edge: edge for edge in edges}
    # First from where nothing leads to, so that these are at the left.
    entered = {stop for _, stop in edges}
    for root in sorted(names, key=lambda name: name in entered):
        path: dict[str, None] = {}
        waiting: list[tuple[str, bool]] = [(root, False)]
        while waiting:
            name, is_left = waiting.pop()
            if is_left:
                path.pop(name, None)
                done.add(name)
                continue
            if name in done or name in path:
                continue
            path[name] = None
            waiting.append((name, True))
            for other in reversed(below[name]):
                if other in path:
                    found[name, other] = (other, name)
                elif other not in done:
                    waiting.append((other, False))
    return found


def _columns(names: Sequence[str], edges: Iterable[tuple[str, str]]) -> dict[str, int]:
    """Return the column of each vertex: right of all that lead to it, and near what it leads to."""
    before: dict[str, list[str]] = {name: [] for name in names}
    after: dict[str, list[str]] = {name: [] for name in names}
    for start, stop in edges:
        before[stop].append(start)
        after[start].append(stop)
    columns = dict.fromkeys(names, 0)
    missing = {name: len(above) for name, above in before.items()}
    ready = [name for name in names if not missing[name]]
    order = []
    while ready:
        name = ready.pop()
        order.append(name)
        for other in after[name]:
            columns[other] = max(columns[other], columns[name] + 1)
            missing[other] -= 1
            if not missing[other]:
                ready.append(other)
    for name in reversed(order):
        if after[name] and not before[name]:
            columns[name] = min(columns[other] for other in after[name]) - 1
    return columns


def _reduce_crossings(
    layers: list[list[str]], left: Mapping[str, list[str]], right: Mapping[str, list[str]]
) -> None:
    """Order each layer by the mean place of the neighbours, alternately left and right."""
    places = {name: at for layer in layers for at, name in enumerate(layer)}
    best, fewest = [list(layer) for layer in layers], _crossings(layers, right, places)
    for turn in range(_ORDER_PASSES):
        neighbours = left if turn % 2 == 0 else right
        for layer in layers if turn % 2 == 0 else reversed(layers):
            means = {name: _mean(neighbours.get(name, ()), places, places[name]) for name in layer}
            layer.sort(key=means.__getitem__)
            places.update((name, at) for at, name in enumerate(layer))
        crossings = _crossings(layers, right, places)
        if crossings < fewest:
            best, fewest = [list(layer) for layer in layers], crossings
    layers[:] = best


def _crossings(
    layers: Sequence[Sequence[str]], right: Mapping[str, list[str]], places: Mapping[str, int]
) -> int:
    """Return the number of crossings between neighbouring layers."""
    count = 0
    for layer in layers:
        ends = [places[b] for a in layer for b in sorted(right.get(a, ()), key=places.__getitem__)]
        # Inversions, by insertion into a sorted list.
        seen: list[int] = []
        for end in ends:
            at = bisect_right(seen, end)
            count += len(seen) - at
            seen.insert(at, end)
    return count


def _straighten(
    layers: Sequence[Sequence[str]], left: Mapping[str, list[str]], right: Mapping[str, list[str]]
) -> dict[str, float]:
    """Return rows that are near those of the neighbours, at least 1 apart within a layer."""
    tallest = max(map(len, layers), default=0)
    rows = {
        name: at + (tallest - len(layer)) / 2 for layer in layers for at, name in enumerate(layer)
    }
    for turn in range(_SHIFT_PASSES):
        neighbours = left if turn % 2 == 0 else right
        for layer in layers if turn % 2 == 0 else reversed(layers):
            wanted = [_mean(neighbours.get(name, ()), rows, rows[name]) for name in layer]
            # Those that want to be above each other share the space around their mean.
            blocks: list[list[float]] = []  # sum of what they want less their place; count
            for at, row in enumerate(wanted):
                blocks.append([row - at, 1])
                while (
                    len(blocks) > 1
                    and blocks[-2][0] / blocks[-2][1] > blocks[-1][0] / blocks[-1][1]
                ):
                    total, count = blocks.pop()
                    blocks[-1][0] += total
                    blocks[-1][1] += count
            at = 0
            for total, count in blocks:
                for _ in range(int(count)):
                    rows[layer[at]] = total / count + at
                    at += 1
    lowest = min(rows.values(), default=0.0)
    return {name: row - lowest for name, row in rows.items()}


def _mean(names: Iterable[str], places: Mapping[str, float], otherwise: float) -> float:
    found = [places[name] for name in names]
    return sum(found) / len(found) if found else otherwise

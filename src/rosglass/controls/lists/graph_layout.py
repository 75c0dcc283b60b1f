"""The element ``GraphLayout``: nodes and topics of the robot, laid out as a graph."""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.names import hidden
from rosglass.controls.lists.layered_layout import Layout, lay_out
from rosglass.controls.lists.row_model import RowModel
from rosglass.controls.lists.texts import copy_text, joined
from rosglass.controls.lists.topic_rows import read_topics
from rosglass.controls.topics.graph_watch import GraphReader
from rosglass.qml.engine.dialect import resolve_namespace
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qt import QtCore, Slot

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.comm.node import Node

__all__ = ["GraphLayout"]

#: Nodes, topics and connections that are drawn at most; a filter finds the others.
_MAX_VERTICES, _MAX_EDGES = 400, 1000
#: Names that nearly every node is connected to.
_HIDE = ["/rosout", "/rosout_agg", "/parameter_events", "/clock"]
_SEGMENT_ROLES = ("key", "start", "stop", "x1", "y1", "x2", "y2", "leaves", "enters")
_ROLES = ("key", "name", "isNode", "column", "line", "conflict", "detail")


class _Wanted(NamedTuple):
    """The choice of nodes and topics to draw.

    Attributes:
        filter: Text that names contain, in small letters; what is connected is drawn, too.
        within: Namespace with a slash at its end, of nodes or topics; ``/`` for all.
        hide: Names of nodes and topics that are left out.
        with_hidden: Whether hidden names are included.
        with_topics: Whether topics are drawn; otherwise nodes are connected directly.
    """

    filter: str
    within: str
    hide: frozenset[str]
    with_hidden: bool
    with_topics: bool


class _Drawn(NamedTuple):
    """Vertices and segments by key, the layout, and the number of vertices that are left out."""

    vertices: dict[str, dict[str, Any]]
    segments: dict[str, dict[str, Any]]
    layout: Layout
    omitted: int


class GraphLayout(GraphReader):
    """The graph of nodes and topics. See its page in ``docs/controls``."""

    #: Text that names of nodes or topics contain; what is connected to these is drawn, too.
    filter = Writable(str, "", then="_read")
    #: Namespace of nodes or topics; empty for all.
    ns = Writable(str, "", then="_read")
    #: Names of nodes and topics that are left out.
    hide = Writable(list, _HIDE, lambda names: [str(name) for name in names], then="_read")
    #: Whether hidden names are included, such as topics of actions.
    showHidden = Writable(bool, False, then="_read")
    #: Whether topics are drawn; otherwise nodes are connected directly.
    showTopics = Writable(bool, True, then="_read")
    #: Nodes and topics, for a Repeater.
    items = ReadOnly(QtCore.QObject, read=lambda self: self._model)
    #: The parts of all connections, each between two columns, for a Repeater.
    segments = ReadOnly(QtCore.QObject, read=lambda self: self._segments)
    #: Number of columns and lines.
    columns = ReadOnly(int, 0)
    lines = ReadOnly(int, 0)
    #: Number of nodes and topics that are drawn, and that are not, as there are too many.
    count = ReadOnly(int, 0)
    omitted = ReadOnly(int, 0)
    #: Counts layouts, so that bindings on functions of the models are evaluated again.
    version = ReadOnly(int, 0)

    _HOLDS = ("_model", "_segments", "_drawn")
    _READ_INTERVAL_MS = 500

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._model = RowModel(self, _ROLES)
        self._segments = RowModel(self, _SEGMENT_ROLES)
        self._drawn = _Drawn({}, {}, lay_out((), ()), 0)

    def _reading(self, node: Node) -> Callable[[], _Drawn]:
        within = resolve_namespace(node, self.ns).rstrip("/") + "/" if self.ns else "/"
        wanted = _Wanted(
            self.filter.strip().lower(),
            within,
            frozenset(self.hide),
            self.showHidden,
            self.showTopics,
        )
        return lambda: _draw(node, wanted)

    def _on_read(self, result: _Drawn) -> None:
        self._drawn = result
        self._model.show(result.vertices)
        self._segments.show(result.segments)
        layout = result.layout
        report(
            self,
            columns=max(layout.columns.values(), default=-1) + 1,
            lines=int(max(layout.rows.values(), default=-1)) + 1,
            count=len(result.vertices),
            omitted=result.omitted,
            version=self.version + 1,
        )

    @Slot(str, int, int, result=str)
    def neighbour(self, key: str, right: int, down: int) -> str:
        """Return the nearest node or topic in a direction; or `key` itself.

        Args:
            key: Key of a node or topic; if it is not drawn, the first one is returned.
            right: 1 for those at the right, -1 at the left, 0 for the same column.
            down: 1 for those below, -1 above.
        """
        columns, rows = self._drawn.layout.columns, self._drawn.layout.rows
        if key not in columns:
            return min(columns, key=lambda one: (columns[one], rows[one]), default="")
        column, row = columns[key], rows[key]
        if right:
            found = [one for one in columns if (columns[one] - column) * right > 0]
            return min(
                found,
                key=lambda one: (abs(columns[one] - column), abs(rows[one] - row)),
                default=key,
            )
        found = [one for one in columns if columns[one] == column and (rows[one] - row) * down > 0]
        return min(found, key=lambda one: abs(rows[one] - row), default=key)

    @Slot(str)
    def copy(self, key: str) -> None:
        """Copy the name of a node or topic."""
        copy_text(_name(key))


def _name(key: str) -> str:
    return key.partition(" ")[2]


def _draw(node: Node, wanted: _Wanted) -> _Drawn:
    """Return the graph, laid out."""
    topics = {
        name: topic
        for name, topic in read_topics(node).items()
        if name not in wanted.hide and (wanted.with_hidden or not hidden(name))
    }
    nodes = {one.full for one in node.nodes()}
    for topic in topics.values():
        nodes.update(topic.publishers, topic.subscribers)
    nodes = {
        one for one in nodes if one not in wanted.hide and (wanted.with_hidden or not hidden(one))
    }
    edges = [
        edge
        for name, topic in topics.items()
        for edge in (
            *((f"node {one}", f"topic {name}") for one in topic.publishers if one in nodes),
            *((f"topic {name}", f"node {one}") for one in topic.subscribers if one in nodes),
        )
    ]
    keys = {f"node {one}" for one in nodes} | {f"topic {one}" for one in topics}
    if wanted.filter or wanted.within != "/":
        found = {
            key
            for key in keys
            if wanted.filter in _name(key).lower() and _name(key).startswith(wanted.within)
        }
        keys = found | {other for a, b in edges for other in (a, b) if a in found or b in found}
        edges = [(a, b) for a, b in edges if a in found or b in found]
    if not wanted.with_topics:
        keys = {key for key in keys if key.startswith("node ")}
        edges = list(_joined_at_topics(edges))
    drawn = sorted(keys)[:_MAX_VERTICES]
    kept = set(drawn)
    edges = [(a, b) for a, b in edges if a in kept and b in kept]
    if len(edges) > _MAX_EDGES:
        # Nothing could be seen in so many lines.
        drawn, edges = [], []
    layout = lay_out(drawn, edges)
    published: dict[str, list[str]] = {}
    subscribed: dict[str, list[str]] = {}
    for name, topic in topics.items():
        for ends, one in ((published, topic.publishers), (subscribed, topic.subscribers)):
            for end in dict.fromkeys(one):
                ends.setdefault(end, []).append(name)
    vertices = {}
    for key in drawn:
        name = _name(key)
        found_topic = topics.get(name) if key.startswith("topic ") else None
        detail = (
            f"publishes {joined(published.get(name, ())) or 'nothing'}; subscribes to "
            f"{joined(subscribed.get(name, ())) or 'nothing'}"
            if found_topic is None
            else f"{joined(found_topic.types)}: from "
            f"{joined(found_topic.publishers) or 'no publisher'} to "
            f"{joined(found_topic.subscribers) or 'no subscriber'}"
        )
        vertices[key] = {
            "name": name, "isNode": found_topic is None, "column": layout.columns[key],
            "line": layout.rows[key], "detail": detail,
            "conflict": "" if found_topic is None else found_topic.conflict,
        }  # fmt: skip
    return _Drawn(vertices, _segments_of(layout), layout, len(keys) - len(drawn))


def _segments_of(layout: Layout) -> dict[str, dict[str, Any]]:
    """Return the parts of all connections; -1 or 1 is the side where they leave or enter a box."""
    found: dict[str, dict[str, Any]] = {}
    for (start, stop), route in layout.routes.items():
        side = 1 if route[-1][0] > route[0][0] else -1
        for at, ((x1, y1), (x2, y2)) in enumerate(itertools.pairwise(route)):
            found[f"{start}\n{stop}\n{at}"] = {
                "start": start, "stop": stop, "x1": x1, "y1": y1, "x2": x2, "y2": y2,
                "leaves": side if at == 0 else 0, "enters": -side if at == len(route) - 2 else 0,
            }  # fmt: skip
    return found


def _joined_at_topics(edges: Iterable[tuple[str, str]]) -> set[tuple[str, str]]:
    """Return the connections between nodes that lead through a topic."""
    sources: dict[str, list[str]] = {}
    sinks: dict[str, list[str]] = {}
    for a, b in edges:
        if b.startswith("topic "):
            sources.setdefault(b, []).append(a)
        else:
            sinks.setdefault(a, []).append(b)
    found: set[tuple[str, str]] = set()
    for topic, ends in sources.items():
        for a in ends:
            found.update((a, b) for b in sinks.get(topic, ()) if a != b)
            if len(found) > _MAX_EDGES:
                return found
    return found

"""The element ``TopicRows``: all topics of the robot as a tree, with what is wrong with each."""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.names import hidden
from rosglass.controls.lists.row_model import RowModel
from rosglass.controls.lists.texts import copy_text, joined
from rosglass.controls.topics.graph_watch import GraphReader
from rosglass.qml.engine.dialect import resolve_namespace
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qt import QtCore, Slot

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rosglass.comm.graph import EndpointInfo
    from rosglass.comm.node import Node

__all__ = ["Topic", "TopicRows", "conflicts", "read_topics"]

#: Topics that are shown at once, and conflicts of one topic.
_MAX_TOPICS, _MAX_CONFLICTS = 5000, 5
_ROLES = ("key", "name", "depth", "folds", "open", "isTopic", "topic", "type", "publishers",
          "subscribers", "publishedBy", "subscribedBy", "conflict", "topics")  # fmt: skip


class Topic(NamedTuple):
    """A topic in the graph.

    Attributes:
        types: Its types in full; more than one is a conflict.
        publishers: Full names of the nodes that publish it.
        subscribers: Full names of the nodes that subscribe to it.
        conflict: Which of them do not match each other and why, in words; empty if all match.
    """

    types: tuple[str, ...]
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]
    conflict: str


def conflicts(
    publishers: Sequence[EndpointInfo], subscriptions: Sequence[EndpointInfo]
) -> list[str]:
    """Return why publishers and subscriptions of a topic do not match, in words.

    Endpoints that are alike are named together: a topic of 100 nodes has 10,000 pairs.
    """
    found = []
    types: dict[str, list[str]] = {}
    for end in (*publishers, *subscriptions):
        if end.type and end.type != "*":
            types.setdefault(end.type, []).append(end.node.full)
    if len(types) > 1:
        uses = (f"{joined(sorted(set(nodes)), 3)} has {name}" for name, nodes in types.items())
        found.append(f"types differ: {'; '.join(uses)}")
    for requested, sinks in _alike(subscriptions).items():
        for offered, sources in _alike(publishers).items():
            conflict = requested[0].incompatibility(offered[0])
            if not conflict and requested[1] == offered[1]:
                hashes = {requested[2], offered[2]} - {""}
                conflict = "they define the type differently" if len(hashes) > 1 else ""
            if conflict:
                names = f"{joined(sinks, 3)} may get nothing from {joined(sources, 3)}"
                found.append(f"{names}: {conflict}")
    return found


def _alike(ends: Sequence[EndpointInfo]) -> dict[tuple[Any, str, str], list[str]]:
    """Return the names of nodes by QoS profile, type and hash of their endpoints."""
    found: dict[tuple[Any, str, str], dict[str, None]] = {}
    for end in ends:
        found.setdefault((end.qos, end.type, end.type_hash), {})[end.node.full] = None
    return {alike: list(names) for alike, names in found.items()}


def read_topics(node: Node) -> dict[str, Topic]:
    """Return all topics by name, sorted; may take milliseconds, so not on the GUI thread.

    Raises:
        NodeClosedError: The node is closed.
    """
    found = {}
    for name, types in node.topics().items():
        publishers, subscriptions = node.publishers(name), node.subscriptions(name)
        wrong = conflicts(publishers, subscriptions)
        text = "\n".join(wrong[:_MAX_CONFLICTS])
        if len(wrong) > _MAX_CONFLICTS:
            text += f"\nand {len(wrong) - _MAX_CONFLICTS:,} more conflicts"
        found[name] = Topic(
            tuple(types),
            tuple(sorted(end.node.full for end in publishers)),
            tuple(sorted(end.node.full for end in subscriptions)),
            text,
        )
    return found


class TopicRows(GraphReader):
    """The topics of the robot as the rows of a tree. See its page in ``docs/controls``."""

    #: Text that names or types of topics contain; empty for all topics.
    filter = Writable(str, "", then="_show")
    #: Namespace of the topics; empty for all.
    ns = Writable(str, "", then="_show")
    #: Whether hidden topics are included, such as those of actions.
    showHidden = Writable(bool, False, then="_show")
    #: The rows, for a ListView.
    rows = ReadOnly(QtCore.QObject, read=lambda self: self._model)
    #: Topics that match, and all topics.
    count = ReadOnly(int, 0)
    total = ReadOnly(int, 0)

    _HOLDS = ("_model", "_topics", "_lines")

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._model = RowModel(self, _ROLES)
        self._topics: dict[str, Topic] = {}
        #: Namespaces that are folded, and topics whose details are shown.
        self._folded: set[str] = set()
        self._opened: set[str] = set()

    # -- the graph -------------------------------------------------------------------------------

    def _reading(self, node: Node) -> Callable[[], dict[str, Topic]]:
        return lambda: read_topics(node)

    def _on_read(self, result: dict[str, Topic]) -> None:
        self._topics = result
        self._show()

    # -- the rows --------------------------------------------------------------------------------

    @Slot(str)
    def toggle(self, key: str) -> None:
        """Fold or unfold a row."""
        keys = self._folded if key.endswith("/") else self._opened
        keys.symmetric_difference_update({key})
        self._show()

    @Slot(str)
    def copy(self, key: str) -> None:
        """Copy the name of a row's topic or namespace."""
        copy_text(key.rstrip("/"))

    def _show(self) -> None:
        within = ""
        if self.ns:
            within = resolve_namespace(self.node, self.ns).rstrip("/") + "/"
        text = self.filter.strip().lower()
        of_ns = {
            name: topic
            for name, topic in self._topics.items()
            if name.startswith(within) and (self.showHidden or not hidden(name))
        }
        matching = {
            name: topic
            for name, topic in of_ns.items()
            if not text or text in name.lower() or any(text in one.lower() for one in topic.types)
        }
        shown = dict(list(matching.items())[:_MAX_TOPICS])
        rows = self._rows_of(shown, bool(text))
        if len(matching) > len(shown):
            rows["#more"] = _row(f"and {len(matching) - len(shown):,} more: enter a filter", 0)
        self._model.show(rows)
        report(self, count=len(matching), total=len(of_ns))

    def _rows_of(self, topics: Mapping[str, Topic], unfolded: bool) -> dict[str, dict[str, Any]]:
        rows: dict[str, dict[str, Any]] = {}
        counts: dict[str, int] = {}
        for name in topics:
            for space in _namespaces(name):
                counts[space] = counts.get(space, 0) + 1
        # A topic comes before the namespace of its name, and that before its topics.
        for name in sorted(topics, key=lambda name: name.split("/")):
            spaces = _namespaces(name)
            is_visible = True
            for depth, space in enumerate(spaces):
                is_open = unfolded or space not in self._folded
                if is_visible and space not in rows:
                    rows[space] = _row(
                        space.rstrip("/").rpartition("/")[2], depth, folds=True, open=is_open,
                        topics=counts[space],
                    )  # fmt: skip
                is_visible = is_visible and is_open
            if is_visible:
                rows[name] = self._topic_row(name, topics[name], len(spaces))
        return rows

    def _topic_row(self, name: str, topic: Topic, depth: int) -> dict[str, Any]:
        return _row(
            name.rpartition("/")[2],
            depth,
            folds=True,
            open=name in self._opened,
            isTopic=True,
            topic=name,
            type=joined(topic.types),
            publishers=len(topic.publishers),
            subscribers=len(topic.subscribers),
            publishedBy=joined(topic.publishers),
            subscribedBy=joined(topic.subscribers),
            conflict=topic.conflict,
            topics=1,
        )


def _namespaces(name: str) -> list[str]:
    """Return the keys of a topic's namespaces: ``/arm/`` and ``/arm/left/`` for a topic in both."""
    parts = name.split("/")[1:-1]
    return ["/" + "/".join(parts[: at + 1]) + "/" for at in range(len(parts))]


def _row(name: str, depth: int, **roles: Any) -> dict[str, Any]:
    return {
        "name": name, "depth": depth, "folds": False, "open": False, "isTopic": False,
        "topic": "", "type": "", "publishers": 0, "subscribers": 0, "publishedBy": "",
        "subscribedBy": "", "conflict": "", "topics": 0, **roles,
    }  # fmt: skip

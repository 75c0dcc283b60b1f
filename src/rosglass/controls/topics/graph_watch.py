"""The element ``GraphWatch``: the ROS graph for controls, without a call for every node of it."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.elements.element import Element, single_shot
from rosglass.qml.engine.properties import ReadOnly
from rosglass.qt import QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["GraphWatch"]

#: Milliseconds in which changes are collected: while robots start, there are hundreds.
_COLLECT_MS = 200


class GraphWatch(Element):
    """Observes the ROS graph. See its page in ``docs/controls``."""

    #: Nodes or endpoints have appeared or left: at most five times a second.
    changed = Signal()

    #: Full names that several nodes have, with their number.
    duplicateNodes: Any = ReadOnly("QVariantMap", notify="changed", read="_get_duplicates")  # type: ignore[arg-type]
    #: Full name of this program's node; empty without one.
    nodeName = ReadOnly(str, notify="changed", read="_get_node_name")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._collecting = single_shot(self, self._announce)

    def _get_duplicates(self) -> dict[str, int]:
        return dict(self._session.duplicate_nodes) if self._session is not None else {}

    def _get_node_name(self) -> str:
        node = self.node
        return "" if node is None else f"{node.namespace.rstrip('/')}/{node.name}"

    @Slot(str, result="QStringList")
    def namespaces(self, topic: str) -> list[str]:
        """Return the namespaces in which other nodes use a topic, in alphabetical order.

        Args:
            topic: Its name within each namespace.
        """
        node, end, mine = self.node, "/" + topic.strip("/"), self._get_node_name()
        if node is None:
            return []
        try:
            return sorted(
                name.removesuffix(end) or "/"
                for name in node.topics()
                if name.endswith(end)
                and any(
                    one.node.full != mine
                    for one in (*node.publishers(name), *node.subscriptions(name))
                )
            )
        except Error:  # the node has just been closed
            return []

    def _update(self) -> None:
        super()._update()
        self.changed.emit()

    @Slot()
    def _on_graph(self) -> None:
        if not self._collecting.isActive():
            self._collecting.start(_COLLECT_MS)

    @Slot()
    def _announce(self, *_: Any) -> None:
        if is_alive(self):
            self.changed.emit()

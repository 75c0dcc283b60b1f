"""The ROS graph for controls: the element ``GraphWatch``, and the base of elements that show it."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.errors import Error
from rosglass.qml.elements.element import Element, single_shot
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Node
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["GraphReader", "GraphWatch"]

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

    @Slot("QStringList", "QStringList", result="QVariantMap")
    def topicsWithin(self, namespaces: list[str], types: list[str]) -> dict[str, list[str]]:
        """Return the topics of some types by namespace, each in alphabetical order.

        A topic belongs to the innermost of the namespaces: ``/arm/state`` to ``/arm``, not to
        ``/``. Namespaces without such topics are left out.

        Args:
            namespaces: Absolute ones, such as ``/arm``.
            types: Names such as ``sensor_msgs/msg/Imu``.
        """
        node, wanted, known = self.node, {*types}, {*namespaces}
        found: dict[str, list[str]] = {}
        try:
            topics = node.topics() if node is not None else {}
        except Error:  # the node has just been closed
            return {}
        for name in sorted(topics):
            if wanted.isdisjoint(topics[name]):
                continue
            inside = name.rpartition("/")[0]
            while inside and inside not in known:
                inside = inside.rpartition("/")[0]
            if (inside or "/") in known:
                found.setdefault(inside or "/", []).append(name)
        return found

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


class GraphReader(Element):
    """Base of elements that show the ROS graph, which is read on the worker thread."""

    #: Shortest time between two readings, in milliseconds.
    _READ_INTERVAL_MS: ClassVar[int] = 250

    #: Whether the robot is not connected, so that the graph shown is that of before.
    stale = ReadOnly(bool, True)

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._is_reading = self._is_outdated = False
        self._pause = single_shot(self, self._read)

    @abstractmethod
    def _reading(self, node: Node) -> Callable[[], Any]:
        """Return a function that reads what is shown, for the worker thread."""

    @abstractmethod
    def _on_read(self, result: Any) -> None:
        """Show what was read."""

    def _update(self) -> None:
        super()._update()
        self._read()
        self._update_stale()

    @Slot()
    def _on_graph(self) -> None:
        self._read()

    @Slot()
    def _on_connection(self) -> None:
        self._read()
        self._update_stale()

    @Slot()
    def _read(self) -> None:
        """Read the graph; again after a pause if it is being read, or was just now."""
        node, session = self.node, self._session
        if node is None or session is None:
            return
        if self._is_reading or self._pause.isActive():
            self._is_outdated = True
            return
        self._is_reading, self._is_outdated = True, False
        session.background(self._reading(node), weak_callback(self._end_reading))

    def _end_reading(self, result: Any) -> None:
        if not is_alive(self):
            return
        self._is_reading = False
        if not isinstance(result, Error) and not self._disconnected():
            self._on_read(result)
        self._update_stale()
        if self._is_outdated:
            self._pause.start(self._READ_INTERVAL_MS)

    def _get_problem(self) -> str:
        # Not logged: the session does that.
        return self._disconnected() if self._session is not None else ""

    def _update_stale(self) -> None:
        self._announce_problem()
        report(self, stale=self._disconnected() != "")

"""The element ``LiveTopic``: the subscription of a control, which finds its topic by type."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.errors import Error
from rosglass.interfaces.names import join_name
from rosglass.qml.elements.subscription import Subscription
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qt import QJSValue, Signal

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.comm.qos import QoS

__all__ = ["LiveTopic"]


def _type_names(names: list[str]) -> list[str]:
    try:
        return [join_name(str(name)) for name in names]
    except Error as error:
        raise ValueError(f"has an invalid type name: {error}") from None


class LiveTopic(Subscription):
    """Receives the topic of a control. See its page in ``docs/elements``.

    A :class:`~rosglass.qml.elements.subscription.Subscription` which, without a ``topic``, takes
    the first one in the graph (in alphabetical order) that has one of ``types``, and keeps it until
    it is gone. Messages of another type are not passed on, as their fields would be missing.
    """

    nsChanged = Signal()

    #: Message types that the control shows; empty for all.
    types = Writable(list, [], _type_names, then="_check_types")
    #: Namespace of relative topic names, and of the topics to select from.
    ns = Writable(str, read="_get_namespace", write="_set_namespace")
    #: Topics that have one of the types, in alphabetical order.
    candidates = ReadOnly(list, [])

    _types: list[str]
    _candidates: list[str]
    _mismatch = ""

    def _wanted(self) -> tuple[Node, str, str, QoS] | None:
        node = self.node
        if self._topic or node is None:
            return super()._wanted()
        chosen = self._select(node)
        return (node, chosen, self._wanted_type, self._profile) if chosen and self.enabled else None

    def _select(self, node: Node) -> str:
        """Return the topic to receive: the present one while it exists."""
        within = self._get_namespace().rstrip("/") + "/" if self._namespace else "/"
        try:
            topics = node.topics()
        except Error:
            return self._resolved
        found = sorted(
            name
            for name, types in topics.items()
            if name.startswith(within) and not set(self._types).isdisjoint(types)
        )
        report(self, candidates=found)
        if self._resolved in found or not found:
            return self._resolved
        return found[0]

    def _on_graph(self) -> None:
        super()._on_graph()
        if not self._topic:
            self._schedule()

    def _check_types(self) -> None:
        self._resolved = self._resolved if self._topic else ""
        self._schedule()

    def _get_message(self) -> QJSValue:
        return QJSValue() if self._refuses_type() else super()._get_message()

    def _get_problem(self) -> str:
        return super()._get_problem() or self._refuses_type()

    def _refuses_type(self) -> str:
        """Return why messages of the topic's type are not passed on; empty if they are."""
        if not self._types or not self._found_type or self._found_type in self._types:
            return ""
        shown = " or ".join(self._types)
        return f"{self._resolved} has the type {self._found_type}, which is not {shown}"

    def _is_old(self) -> bool:
        return bool(self._refuses_type()) or super()._is_old()

"""What the singletons tell about the graph: nodes, topics, services, actions."""
# ruff: noqa: N802 - the names of slots are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.singleton import RosSingleton, full_type
from rosglass.qt import QJSValue, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.graph import EndpointInfo
    from rosglass.comm.node import Node

__all__ = ["GraphSingleton"]

#: What an action is made of has names with this in them.
_HIDDEN = "/_action/"


class GraphSingleton(RosSingleton):
    """The graph as it is now; ``graphChanged`` tells of changes. Empty while there is no node."""

    @Slot(result="QStringList")
    @Slot(str, result="QStringList")
    def queryTopics(self, datatype: str = "") -> list[str]:
        """Return the topics, those of one type if given."""
        return _of_type(self._topics(), full_type(datatype))

    @Slot(result=QJSValue)
    def getTopicNamesAndTypes(self) -> QJSValue:
        """Return an object from topic names to lists of types."""
        return self._spelled(self._topics())

    @Slot(str, result="QStringList")
    def getTopicTypes(self, topic: str) -> list[str]:
        """Return the types announced for a topic."""
        return self._types("getTopicTypes", topic, self._topics())

    @Slot(result="QStringList")
    @Slot(str, result="QStringList")
    def queryServices(self, datatype: str = "") -> list[str]:
        """Return the services but those that actions are made of; of one type if given."""
        return _of_type(self._services(), full_type(datatype, "srv"))

    @Slot(result=QJSValue)
    def getServiceNamesAndTypes(self) -> QJSValue:
        """Return an object from service names to lists of types."""
        return self._spelled(self._services())

    @Slot(str, result="QStringList")
    def getServiceTypes(self, name: str) -> list[str]:
        """Return the types announced for a service."""
        return self._types("getServiceTypes", name, self._services())

    @Slot(result="QStringList")
    @Slot(str, result="QStringList")
    def queryActions(self, datatype: str = "") -> list[str]:
        """Return the actions, those of one type if given."""
        return _of_type(self._actions(), full_type(datatype, "action"))

    @Slot(result=QJSValue)
    def getActionNamesAndTypes(self) -> QJSValue:
        """Return an object from action names to lists of types."""
        return self._spelled(self._actions())

    @Slot(str, result="QStringList")
    def getActionTypes(self, name: str) -> list[str]:
        """Return the types announced for an action."""
        return self._types("getActionTypes", name, self._actions())

    @Slot(result="QStringList")
    def queryNodes(self) -> list[str]:
        """Return the full names of all nodes."""
        found: list[str] = self._ask(
            "queryNodes", lambda node: [name.full for name in node.nodes()], []
        )
        return found

    @Slot(str, result=QJSValue)
    def getPublishersInfo(self, topic: str) -> QJSValue:
        """Return ``{node, type, typeHash, qos}`` of each publisher of a topic."""
        found = self._ask(
            "getPublishersInfo", lambda node: node.publishers(node.resolve(topic)), []
        )
        return self._endpoints(found)

    @Slot(str, result=QJSValue)
    def getSubscriptionsInfo(self, topic: str) -> QJSValue:
        """Return ``{node, type, typeHash, qos}`` of each subscription of a topic."""
        found = self._ask(
            "getSubscriptionsInfo", lambda node: node.subscriptions(node.resolve(topic)), []
        )
        return self._endpoints(found)

    @Slot(str, result=QJSValue)
    def getNodeInfo(self, name: str) -> QJSValue:
        """Return what a node publishes, subscribes, serves and calls.

        Args:
            name: The node's full name.

        Returns:
            ``{publishers, subscriptions, services, clients}``, each a list of ``{name, type}``.
        """
        found = self._ask("getNodeInfo", lambda node: node.endpoints(name), [])
        kinds = {
            "publisher": "publishers",
            "subscription": "subscriptions",
            "service server": "services",
            "service client": "clients",
        }
        info: dict[str, list[dict[str, str]]] = {kind: [] for kind in kinds.values()}
        for one in sorted(found, key=lambda one: one.name):
            kind = info[kinds[one.kind.value]]
            kind.append({"name": one.name, "type": self._spell(one.type)})
        return self._runtime.value(info)

    def _endpoints(self, found: list[EndpointInfo]) -> QJSValue:
        runtime = self._runtime
        infos = runtime.value(
            [
                {"node": one.node.full, "type": self._spell(one.type), "typeHash": one.type_hash}
                for one in found
            ]
        )
        for index, one in enumerate(found):
            infos.property(index).setProperty("qos", runtime.qos(one.qos))
        return infos

    def _topics(self) -> dict[str, list[str]]:
        return _shown(self._ask("topics", lambda node: node.topics(), {}))

    def _services(self) -> dict[str, list[str]]:
        return _shown(self._ask("services", lambda node: node.services(), {}))

    def _actions(self) -> dict[str, list[str]]:
        return _shown(self._ask("actions", lambda node: node.actions(), {}))

    def _types(self, what: str, name: str, known: dict[str, list[str]]) -> list[str]:
        node = self._node(what)
        try:
            types = known.get(node.resolve(name), []) if node is not None else []
        except Error as error:
            self._runtime.throw(f"{self.NAME}.{what}: {error}")
            return []
        return [self._spell(kind) for kind in types]

    def _ask(self, what: str, ask: Callable[[Node], Any], otherwise: Any) -> Any:
        node = self._node(what)
        if node is None:
            return otherwise
        try:
            return ask(node)
        except Error as error:
            self._log(logging.WARNING, f"{self.NAME}.{what}: {error}")
            return otherwise

    def _spelled(self, known: dict[str, list[str]]) -> QJSValue:
        return self._runtime.value(
            {name: [self._spell(kind) for kind in types] for name, types in known.items()}
        )

    def _spell(self, type: str) -> str:
        """Return a type's name as this module spells it."""
        return self.DIALECT.type_name(type) if "/" in type else type


def _shown(known: dict[str, list[str]]) -> dict[str, list[str]]:
    return {name: types for name, types in sorted(known.items()) if _HIDDEN not in name}


def _of_type(known: dict[str, list[str]], wanted: str) -> list[str]:
    return [name for name, types in known.items() if not wanted or wanted in types]

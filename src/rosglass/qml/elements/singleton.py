"""The base classes of ``Ros`` and ``Ros2``: node, log, graph, and functions for values."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import os
import re
import socket
from abc import abstractmethod
from contextlib import suppress
from typing import TYPE_CHECKING, Any, ClassVar

import rosglass
from rosglass.errors import Error, InvalidNameError, TypeNotFoundError
from rosglass.interfaces.names import split_name
from rosglass.qml.elements.yaml_io import Io
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.log import log_from_qml
from rosglass.qml.engine.properties import ReadOnly, Writable
from rosglass.qml.engine.runtime import Runtime, own_runtime
from rosglass.qml.engine.to_js import constants_of
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive
from rosglass.wires.zenoh.options import shown_url

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.graph import EndpointInfo
    from rosglass.comm.node import Node
    from rosglass.messages import ActionType, Message, MessageType, ServiceType
    from rosglass.qml.engine.session import Session


__all__ = [
    "GraphSingleton",
    "RosSingleton",
    "ValueFunctions",
    "check_type",
    "full_type",
    "is_list",
    "strings",
]

_log = logging.getLogger("rosglass.qml")
_SHORT = re.compile(r"([A-Za-z]\w*)/([A-Za-z]\w*)\Z")


class RosSingleton(QtCore.QObject):
    """Base of ``Ros`` and ``Ros2``, one per engine; all of a session share its node."""

    #: The module whose format its values have.
    DIALECT: ClassVar[Dialect] = Dialect.ROS2
    #: Its name in QML.
    NAME: ClassVar[str] = "Ros2"

    initialized = Signal()
    connectionChanged = Signal()
    urlChanged = Signal()
    #: Nodes, topics, services or actions appeared or disappeared.
    graphChanged = Signal()

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._bound: Runtime | None = None
        # If QML only connects to signals, nothing else looks the runtime up.
        QtCore.QTimer.singleShot(0, self._bind)

    @Slot()
    def _bind(self) -> None:
        if is_alive(self):
            try:
                _ = self._runtime
            except Error as error:
                _log.error("%s", error)

    @property
    def _runtime(self) -> Runtime:
        if self._bound is None:
            self._bound = own_runtime(self)
            self._listen(self._bound.session)
        return self._bound

    def _listen(self, session: Session) -> None:
        """Forward the session's signals."""
        session.initialized.connect(self.initialized)
        session.connection_changed.connect(self.connectionChanged)
        session.url_changed.connect(self.urlChanged)
        session.graph_changed.connect(self.graphChanged)

    @property
    def _session(self) -> Session:
        return self._runtime.session

    def _node(self, what: str) -> Node | None:
        """Return the node; without one, log a debug message and return None."""
        node = self._session.node
        if node is None:
            self._log(logging.DEBUG, f"{self.NAME}.{what}: there is no node yet")
        return node

    # The node.

    @Slot(result=bool)
    def isInitialized(self) -> bool:
        """Return whether init() was called and no shutdown has followed."""
        return self._session.is_initialized

    @Slot(result=bool)
    def ok(self) -> bool:
        """Return whether there is a node, or one is being created; false after a failure."""
        return self._session.state not in {"uninitialized", "failed"}

    @Slot(result=str)
    def getName(self) -> str:
        """Return the node's base name; empty before init."""
        return self._session.name

    @Slot(result=str)
    def getNamespace(self) -> str:
        """Return the node's namespace; empty before init."""
        return self._session.namespace

    @Slot(str, result=str)
    def getEnvironmentVariable(self, name: str) -> str:
        """Return an environment variable; empty if it is not set."""
        return os.environ.get(name, "")

    def _set_url(self, url: str) -> None:
        self._session.url = url

    url = Writable(str, read=lambda self: shown_url(self._session.url), write="_set_url")
    connectionState = ReadOnly(
        str, read=lambda self: self._session.state, notify="connectionChanged"
    )
    connectionDetail = ReadOnly(
        str, read=lambda self: self._session.detail, notify="connectionChanged"
    )
    hostname = Property(str, lambda _: socket.gethostname(), constant=True)

    # Logging.

    @Slot(QJSValue)
    @Slot(QJSValue, str)
    def debug(self, message: QJSValue, name: str = "") -> None:
        """Log a debug message."""
        self._log(logging.DEBUG, message.toString(), name)

    @Slot(QJSValue)
    @Slot(QJSValue, str)
    def info(self, message: QJSValue, name: str = "") -> None:
        """Log a message."""
        self._log(logging.INFO, message.toString(), name)

    @Slot(QJSValue)
    @Slot(QJSValue, str)
    def warn(self, message: QJSValue, name: str = "") -> None:
        """Log a warning."""
        self._log(logging.WARNING, message.toString(), name)

    @Slot(QJSValue)
    @Slot(QJSValue, str)
    def error(self, message: QJSValue, name: str = "") -> None:
        """Log an error."""
        self._log(logging.ERROR, message.toString(), name)

    @Slot(QJSValue)
    @Slot(QJSValue, str)
    def fatal(self, message: QJSValue, name: str = "") -> None:
        """Log a fatal error."""
        self._log(logging.CRITICAL, message.toString(), name)

    @abstractmethod
    def _check_topic(self, topic: str) -> None:
        """Raise InvalidNameError unless `topic` is a valid name of a topic, service or action."""

    def _offer(
        self,
        function: str,
        kind: type[Any],
        name: str,
        type_name: str,
        given: Callable[[], object],
    ) -> QtCore.QObject | None:
        """Return a server that exists while JavaScript refers to it; errors are thrown.

        Args:
            function: The function's name in QML.
            kind: Class of the server.
            name: Name of the service or action.
            type_name: Type of the service or action.
            given: Returns the functions that handle requests or goals.
        """
        try:
            self._check_topic(name)
            functions = given()
        except Error as error:
            self._runtime.throw(f"{self.NAME}.{function}: {error}")
            return None
        server = kind(None, self._runtime)
        server.configure(name, type_name, functions)
        return self._runtime.keep(server)

    def _log(self, level: int, message: str, name: str = "") -> None:
        log_from_qml(name, level, message, self._runtime.caller())


def check_type(type_name: str, name: str) -> None:
    """Raise InvalidNameError unless `type_name` may be a type; callers handle empty ones.

    Args:
        type_name: The argument for the type.
        name: The argument for the name of the topic, service or action.
    """
    if not type_name:
        return
    try:
        split_name(type_name)
    except InvalidNameError as error:
        try:
            split_name(name)
        except InvalidNameError:
            raise error from None
        raise InvalidNameError(f"{error}. Are name and type swapped?") from None


def is_list(value: QJSValue | None) -> bool:
    """Return whether a value is an array."""
    return value is not None and value.isArray()


def strings(value: QJSValue) -> list[str]:
    """Return an array's elements as texts."""
    count = value.property("length").toInt()
    return [value.property(index).toString() for index in range(count)]


def full_type(name: str, kind: str = "msg") -> str:
    """Return ``pkg/msg/Type`` for ``pkg/Type``; `kind` is ``msg``, ``srv`` or ``action``."""
    match = _SHORT.match(name)
    return f"{match[1]}/{kind}/{match[2]}" if match else name


#: Part of the names of an action's topics and services.
_HIDDEN = "/_action/"


class GraphSingleton(RosSingleton):
    """The current graph, with ``graphChanged``; empty while there is no node."""

    @Slot(result="QStringList")
    @Slot(str, result="QStringList")
    def queryTopics(self, datatype: str = "") -> list[str]:
        """Return the topics, or only those of one type."""
        return _of_type(self._topics(), full_type(datatype))

    @Slot(result=QJSValue)
    def getTopicNamesAndTypes(self) -> QJSValue:
        """Return an object of topic names to lists of types."""
        return self._spelled(self._topics())

    @Slot(str, result="QStringList")
    def getTopicTypes(self, topic: str) -> list[str]:
        """Return the types announced for a topic."""
        return self._types("getTopicTypes", topic, self._topics())

    @Slot(result="QStringList")
    @Slot(str, result="QStringList")
    def queryServices(self, datatype: str = "") -> list[str]:
        """Return the services, or only those of one type, without those of actions."""
        return _of_type(self._services(), full_type(datatype, "srv"))

    @Slot(result=QJSValue)
    def getServiceNamesAndTypes(self) -> QJSValue:
        """Return an object of service names to lists of types."""
        return self._spelled(self._services())

    @Slot(str, result="QStringList")
    def getServiceTypes(self, name: str) -> list[str]:
        """Return the types announced for a service."""
        return self._types("getServiceTypes", name, self._services())

    @Slot(result="QStringList")
    @Slot(str, result="QStringList")
    def queryActions(self, datatype: str = "") -> list[str]:
        """Return the actions, or only those of one type."""
        return _of_type(self._actions(), full_type(datatype, "action"))

    @Slot(result=QJSValue)
    def getActionNamesAndTypes(self) -> QJSValue:
        """Return an object of action names to lists of types."""
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
        """Return the publishers, subscriptions, services and service clients of a node.

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
        if not name:  # a field that is still empty
            return []
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
        """Return a type's name in this module's spelling."""
        return self.DIALECT.type_name(type) if "/" in type else type


def _shown(known: dict[str, list[str]]) -> dict[str, list[str]]:
    return {name: types for name, types in sorted(known.items()) if _HIDDEN not in name}


def _of_type(known: dict[str, list[str]], wanted: str) -> list[str]:
    return [name for name, types in known.items() if not wanted or wanted in types]


class ValueFunctions(GraphSingleton):
    """Functions for empty messages, constants, times and files, in the module's style."""

    @Slot(str, result=QJSValue)
    def createEmptyMessage(self, type_name: str) -> QJSValue:
        """Return a message with default values; undefined for an unknown type."""
        return self._empty("createEmptyMessage", type_name, "message")

    @Slot(str, result=QJSValue)
    def createEmptyServiceRequest(self, type_name: str) -> QJSValue:
        """Return a service's request with default values; undefined for an unknown type."""
        return self._empty("createEmptyServiceRequest", type_name, "service")

    @Slot(str, result=QJSValue)
    def createEmptyActionGoal(self, type_name: str) -> QJSValue:
        """Return an action's goal with default values; undefined for an unknown type."""
        return self._empty("createEmptyActionGoal", type_name, "action")

    def _empty(self, function: str, type_name: str, wanted: str) -> QJSValue:
        try:
            found = self._load(type_name, wanted == "action")
            parts: dict[str, MessageType] = getattr(found, "parts", {"message": found})
            first = {"message": "message", "service": "request", "action": "goal"}[wanted]
            if first not in parts:
                raise InvalidNameError(f"{type_name} is not a {wanted} type")
            message: Message = parts[first].create()
            return self._runtime.message(message, self.DIALECT)
        except Error as error:
            self._log(logging.WARNING, f"{self.NAME}.{function}: {error}")
            return QJSValue()

    @Slot(str, result=QJSValue)
    def constants(self, type_name: str) -> QJSValue:
        """Return the constants of a message type by name.

        For services and actions, they are grouped as ``request``, ``response``, ``goal``,
        ``result`` and ``feedback``; an unknown type throws.
        """
        return self._parts("constants", type_name, lambda kind: constants_of(kind.definition))

    @Slot(str, result=QJSValue)
    def documentation(self, type_name: str) -> QJSValue:
        """Return the documentation of a type, its fields and its constants.

        Services and actions are grouped as in :meth:`constants`; an unknown type throws.
        """
        return self._parts("documentation", type_name, self._document)

    def _document(self, kind: MessageType) -> dict[str, Any]:
        definition = kind.definition
        values = constants_of(definition)
        return {
            "type": self.DIALECT.type_name(definition.name),
            "comment": definition.comment,
            "fields": {
                field.name: {
                    "type": str(field.type),
                    "comment": field.comment,
                    "unit": field.unit,
                    "default": _plain(field.default),
                }
                for field in definition.fields
            },
            "constants": {
                constant.name: {
                    "type": constant.type,
                    "value": values[constant.name],
                    "comment": constant.comment,
                }
                for constant in definition.constants
            },
        }

    def _parts(self, function: str, type_name: str, show: Any) -> QJSValue:
        try:
            found = self._load(type_name)
        except Error as error:
            self._runtime.throw(f"{self.NAME}.{function}: {error}")
            return QJSValue()
        parts: dict[str, MessageType] | None = getattr(found, "parts", None)
        if parts is None:
            return self._runtime.value(show(found))
        return self._runtime.value({name: show(part) for name, part in parts.items()})

    def _load(self, name: str, action: bool = False) -> MessageType | ServiceType | ActionType:
        """Return a type from the module's ROS version if it exists there, otherwise the other."""
        # ROS 1 names actions after their message, pkg/DoAction.
        names = [name.removesuffix("Action"), name] if action else [name]
        tries = [(ros, one) for ros in (self.DIALECT.ros, 3 - self.DIALECT.ros) for one in names]
        for ros, one in tries:
            with suppress(TypeNotFoundError):  # the next one may exist
                return rosglass.load(one, ros=ros)
        return rosglass.load(name, ros=self.DIALECT.ros)

    # Times.

    @Slot(QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, result=QJSValue)
    def time(self, first: QJSValue, second: QJSValue | None = None) -> QJSValue:
        """Create a time from seconds, seconds and nanoseconds, decimal text, or a Date."""
        return self._create_time("time", first, second)

    @Slot(QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, result=QJSValue)
    def duration(self, first: QJSValue, second: QJSValue | None = None) -> QJSValue:
        """Create a duration from seconds, seconds and nanoseconds, or decimal text."""
        return self._create_time("duration", first, second)

    def _create_time(self, kind: str, first: QJSValue, second: QJSValue | None) -> QJSValue:
        runtime = self._runtime
        made = runtime.create_time(self.DIALECT, kind, first, second or QJSValue())
        if made.isError():
            runtime.throw(f"{self.NAME}.{kind}: {made.property('message').toString()}")
            return QJSValue()
        return made

    # Files.

    def _get_io(self) -> QtCore.QObject:
        found: QtCore.QObject | None = getattr(self, "_io", None)
        if found is None:
            found = self._io = Io(self._runtime, self.DIALECT, self)
        return found

    io = Property(QtCore.QObject, _get_io, constant=True)


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value

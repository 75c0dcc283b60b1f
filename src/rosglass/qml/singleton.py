"""What the singletons of both modules have in common: the node's life, its name, its log."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import os
import re
from abc import abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.errors import Error, InvalidNameError
from rosglass.qml.dialect import Dialect
from rosglass.qml.log import log_from_qml
from rosglass.qml.runtime import Runtime, own_runtime
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Node
    from rosglass.qml.session import Session

__all__ = ["RosSingleton", "check_type", "full_type", "is_list", "strings"]

_log = logging.getLogger("rosglass.qml")
_SHORT = re.compile(r"([A-Za-z]\w*)/([A-Za-z]\w*)\Z")


class RosSingleton(QtCore.QObject):
    """Base of ``Ros`` and ``Ros2``; one per engine, all of a session sharing its node."""

    #: Whose habits its values follow.
    DIALECT: ClassVar[Dialect] = Dialect.ROS2
    #: What QML calls it.
    NAME: ClassVar[str] = "Ros2"

    initialized = Signal()
    connectionChanged = Signal()
    urlChanged = Signal()
    #: Nodes, topics, services or actions appeared or went.
    graphChanged = Signal()

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._bound: Runtime | None = None
        # QML may only listen; without this, nothing would ever ask for the runtime.
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
        """Pass the session's signals on."""
        session.initialized.connect(self.initialized)
        session.connection_changed.connect(self.connectionChanged)
        session.url_changed.connect(self.urlChanged)
        session.graph_changed.connect(self.graphChanged)

    @property
    def _session(self) -> Session:
        return self._runtime.session

    def _node(self, what: str) -> Node | None:
        """Return the node; None, with a line in the log for developers, when there is none."""
        node = self._session.node
        if node is None:
            self._log(logging.DEBUG, f"{self.NAME}.{what}: there is no node yet")
        return node

    # The node.

    @Slot(result=bool)
    def isInitialized(self) -> bool:
        """Return whether a node was asked for and not shut down again."""
        return self._session.is_initialized

    @Slot(result=bool)
    def ok(self) -> bool:
        """Return whether there is a node, or one is being made; false after a failure."""
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
        """Return a variable of the environment; empty when it is not set."""
        return os.environ.get(name, "")

    def _set_url(self, url: str) -> None:
        self._session.url = url

    def _get_hostname(self) -> str:
        import platform  # noqa: PLC0415 - few interfaces ask

        return platform.node()

    url = Property(str, lambda self: self._session.url, _set_url, notify=urlChanged)
    connectionState = Property(str, lambda self: self._session.state, notify=connectionChanged)
    connectionDetail = Property(str, lambda self: self._session.detail, notify=connectionChanged)
    hostname = Property(str, _get_hostname, constant=True)

    # Logging.

    @Slot(QJSValue)
    @Slot(QJSValue, str)
    def debug(self, message: QJSValue, name: str = "") -> None:
        """Log a message for developers."""
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
        """Log an error after which the program is of no use."""
        self._log(logging.CRITICAL, message.toString(), name)

    @abstractmethod
    def _check_topic(self, topic: str) -> None:
        """Raise InvalidNameError unless this can be the name of a topic, service or action."""

    def _offer(
        self,
        function: str,
        kind: type[Any],
        name: str,
        type_name: str,
        given: Callable[[], object],
    ) -> QtCore.QObject | None:
        """Return a server that lives as long as JavaScript holds it; what is wrong throws.

        Args:
            function: What QML calls.
            kind: The server's class.
            name: Name of the service or action.
            type_name: Its type.
            given: Returns the functions that answer.
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
    """Raise InvalidNameError unless this can be a type's name; empty texts are the caller's.

    Args:
        type_name: What was given as the type.
        name: What was given beside it, as the name of a topic, service or action.
    """
    from rosglass.interfaces.names import split_name  # noqa: PLC0415 - not needed at start-up

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
    """Return whether QML gave an array."""
    return value is not None and value.isArray()


def strings(value: QJSValue) -> list[str]:
    """Return an array's elements as texts."""
    count = value.property("length").toInt()
    return [value.property(index).toString() for index in range(count)]


def full_type(name: str, kind: str = "msg") -> str:
    """Return ``pkg/msg/Type`` for ``pkg/Type``; `kind` is ``msg``, ``srv`` or ``action``."""
    match = _SHORT.match(name)
    return f"{match[1]}/{kind}/{match[2]}" if match else name

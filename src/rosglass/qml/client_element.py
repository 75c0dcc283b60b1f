"""What clients of services and of actions have in common: being there again and again."""

from __future__ import annotations

import logging
from abc import abstractmethod
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error, TypeNotFoundError
from rosglass.qml.element import RETRY, Element
from rosglass.qt import QtCore, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.handle import Handle
    from rosglass.comm.node import Node
    from rosglass.messages import MessageType
    from rosglass.qml.dialect import Dialect
    from rosglass.qml.runtime import Runtime
    from rosglass.qt import QJSValue

__all__ = ["PATIENCE", "ClientElement", "given_fields", "named"]

#: Milliseconds that is waited for a server.
PATIENCE = 10_000
#: Milliseconds in which looking for a server is not worth a warning.
_LOOKING = 2000


class ClientElement(Element):
    """Has a client of something while there is a node, and a new one after the next init.

    Args:
        runtime: The engine's runtime.
        name: Name of what it is a client of, as in QML.
        type_name: Full type name; empty takes the one that the server announces.
        dialect: Whose habits values follow.
    """

    def __init__(self, runtime: Runtime, name: str, type_name: str, dialect: Dialect) -> None:
        super().__init__(None, runtime)
        self._name, self._type, self._dialect = name, type_name, dialect
        self._patience = PATIENCE
        self._client: Any = None
        self._watch: Handle | None = None
        self._have: Node | None = None
        self._ready = False

    @abstractmethod
    def _create(self, node: Node, type_name: str | None) -> Any:
        """Return a new client; runs on the worker thread."""

    @abstractmethod
    def _submit_waiting(self) -> None:
        """Send what waits for a client that knows its type."""

    @abstractmethod
    def _fail_all(self, error: Error) -> None:
        """End everything that has no answer yet."""

    @abstractmethod
    def _ready_changed(self) -> None:
        """Tell QML that :attr:`_ready` changed."""

    def _update(self) -> None:
        node = self.node
        if node is self._have:
            return
        self._withdraw()
        self._have = node
        if node is not None:
            self._connect(node, self._type or None)

    def _connect(self, node: Node, type_name: str | None) -> None:
        def done(result: Any) -> None:
            if isinstance(result, TypeNotFoundError):
                self._say(f"{self._name}: {result}")
                self._fetch(node)
            elif isinstance(result, Error):
                self._say(f"{self._name}: {result}")
                self._fail_all(result)
            else:
                self._made(result)

        self._make(lambda: self._create(node, type_name), lambda: self._have is node, done)

    def _fetch(self, node: Node) -> None:
        """Ask the robot for a type that nobody here knows."""
        session = self._session
        assert session is not None

        def again() -> None:
            if is_alive(self) and self._have is node and self._client is None:
                self._connect(node, self._type)

        try:
            promise = node.fetch_type_async(self._type)
        except Error:
            _later(again)
        else:
            promise.on_done(
                lambda got: again() if got.exception() is None else _later(again), session.executor
            )

    def _made(self, client: Any) -> None:
        session = self._session
        assert session is not None
        self._client = client
        self._watch = client.on_ready_change(self._on_ready, session.executor)
        self._at_end["client"] = lambda: session.background(client.close)
        # What has just begun to look for its server need not have found it.
        self._say(client.problem, logging.DEBUG)
        QtCore.QTimer.singleShot(_LOOKING, lambda: self._insist(client))
        self._on_ready(client.ready)
        self._submit_waiting()

    def _insist(self, client: Any) -> None:
        """Log what keeps it from its server, unless that was found soon."""
        if is_alive(self) and self._client is client:
            self._tell(self._problem, logging.WARNING)

    def _on_ready(self, ready: bool) -> None:
        if not is_alive(self) or self._client is None:
            return
        self._say(self._client.problem)
        self._submit_waiting()
        if ready != self._ready:
            self._ready = ready
            self._ready_changed()

    def _withdraw(self) -> None:
        client, self._client = self._client, None
        watch, self._watch = self._watch, None
        self._at_end.pop("client", None)
        if watch is not None:
            watch.close()
        if client is not None and self._session is not None:
            self._session.background(client.close)
            self._fail_all(Error(f"{self._name}: the node was shut down"))
        if self._ready:
            self._ready = False
            self._ready_changed()


def named(name: str, error: BaseException) -> str:
    """Return an error's text with the name of what it is about in it."""
    text = str(error)
    return text if name in text else f"{name}: {text}"


def given_fields(value: QJSValue, type: MessageType, dialect: Dialect) -> dict[str, object]:
    """Return the fields of a request or goal that QML gave; errors as of ``fields_from_js``."""
    from rosglass.messages.schema import schema_of  # noqa: PLC0415 - loaded by now
    from rosglass.qml.from_js import fields_from_js  # noqa: PLC0415

    if value.isUndefined() or value.isNull():
        return {}
    return fields_from_js(value, schema_of(type.definition), dialect=dialect)


def _later(job: Callable[[], None]) -> None:
    QtCore.QTimer.singleShot(RETRY, job)

"""The base of service and action clients: created, connected, and created again by each node."""

from __future__ import annotations

import logging
from abc import abstractmethod
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error, TypeNotFoundError
from rosglass.qml.element import RETRY_MS, Element
from rosglass.qml.properties import report
from rosglass.qt import QtCore, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.handle import Handle
    from rosglass.comm.node import Node
    from rosglass.messages import MessageType
    from rosglass.qml.dialect import Dialect
    from rosglass.qml.runtime import Runtime
    from rosglass.qt import QJSValue

__all__ = ["CONNECTION_TIMEOUT_MS", "ClientElement", "given_fields", "named"]

#: Time that requests wait for a server.
CONNECTION_TIMEOUT_MS = 10_000
#: Time in which a server that is not found is not worth a warning.
_SEARCH_MS = 2000


class ClientElement(Element):
    """Has a client of a service or an action while there is a node.

    Args:
        runtime: The engine's runtime.
        name: Name of the service or action, as in QML.
        type_name: Full type name; empty takes the one that the server announces.
        dialect: How values are written in QML.
    """

    def __init__(self, runtime: Runtime, name: str, type_name: str, dialect: Dialect) -> None:
        super().__init__(None, runtime)
        self._name, self._type, self._dialect = name, type_name, dialect
        self._watch: Handle | None = None

    @property
    def label(self) -> str:
        """What error messages call this element."""
        return self._name

    @abstractmethod
    def _submit_waiting(self) -> None:
        """Send the requests that waited until the client knows its type."""

    @abstractmethod
    def _fail_all(self, error: Error) -> None:
        """End every request that has no answer yet."""

    def _wanted(self) -> tuple[Node] | None:
        return None if self.node is None else (self.node,)

    def _on_create_failed(self, error: Error) -> None:
        self._set_problem(f"{self._name}: {error}")
        if isinstance(error, TypeNotFoundError) and self.node is not None:
            self._fetch_type(self.node)
        else:
            self._fail_all(error)

    def _fetch_type(self, node: Node) -> None:
        """Request a type that is unknown here from the robot."""

        def again() -> None:
            if is_alive(self) and self.node is node:
                self._create_again()

        try:
            promise = node.fetch_type_async(self._type)
        except Error:
            _later(again)
        else:
            promise.on_done(
                lambda got: again() if got.exception() is None else _later(again), self._executor
            )

    def _on_created(self, endpoint: Any) -> None:
        self._watch = endpoint.on_ready_change(self._weak(self._on_ready), self._executor)
        # A client that has just started to look for its server has not found it yet.
        self._set_problem(endpoint.problem, logging.DEBUG)
        QtCore.QTimer.singleShot(_SEARCH_MS, lambda: self._warn(endpoint))
        self._on_ready(endpoint.ready)
        self._submit_waiting()

    def _warn(self, client: Any) -> None:
        """Log why there is no server, unless it was found soon."""
        if is_alive(self) and self._endpoint is client:
            self._log(self._problem, logging.WARNING)

    def _on_ready(self, ready: bool) -> None:
        if not is_alive(self) or self._endpoint is None:
            return
        self._set_problem(self._endpoint.problem)
        self._submit_waiting()
        self._set_ready(ready)

    def _set_ready(self, ready: bool) -> None:
        """Announce whether a server is connected."""
        report(self, ready=ready)

    def _on_closed(self, endpoint: Any) -> None:
        watch, self._watch = self._watch, None
        if watch is not None:
            watch.close()
        if endpoint is not None:
            self._fail_all(Error(f"{self._name}: the node was shut down"))
        self._set_ready(False)


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
    QtCore.QTimer.singleShot(RETRY_MS, job)

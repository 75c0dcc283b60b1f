"""The singleton ``Service`` of ``Ros 1.0``."""
# ruff: noqa: N802 - the names of slots are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from rosglass.errors import Error
from rosglass.qml.dialect import Dialect
from rosglass.qml.log import log_from_qml
from rosglass.qml.runtime import own_runtime
from rosglass.qml.service_client import ServiceClient
from rosglass.qml.session import NOT_INITIALIZED
from rosglass.qml.singleton import full_type
from rosglass.qml.waiting import MOST_WAITING, wait_for
from rosglass.qt import QJSValue, QtCore, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.messages import Message
    from rosglass.qml.runtime import Runtime

__all__ = ["Service"]

#: Milliseconds that a call waits for a server; one that exists takes that long to be found.
_PATIENCE = 5000


class Service(QtCore.QObject):
    """Calls services without a client object."""

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._clients: dict[tuple[str, str], ServiceClient] = {}

    @Slot(str, str, result=QJSValue)
    @Slot(str, str, QJSValue, result=QJSValue)
    def call(self, service: str, type_name: str, request: QJSValue | None = None) -> QJSValue:
        """Call a service and return the response; the interface lives on meanwhile.

        Returns:
            The response; true when its type has no fields; false when the call failed, which is
            logged with the reason.
        """
        runtime = self._runtime()
        answer: list[Message | Error] = []
        refused = False
        client = self._client(runtime, service, type_name)

        def begin(end: Callable[[], None]) -> None:
            def done(result: Message | Error) -> None:
                answer.append(result)
                end()

            nonlocal refused
            refused = not client.send(QJSValue() if request is None else request, done)
            if refused:
                end()

        caller = runtime.caller()
        if wait_for(runtime.session, begin):
            if refused and not answer:
                # It throws what does not fit.
                return QJSValue()
            why = "" if runtime.session.is_initialized else f": {NOT_INITIALIZED}"
            result = answer[0] if answer else Error(f"{service} was not called to the end{why}")
        else:
            result = Error(
                f"{service} is called, but not waited for: {MOST_WAITING} calls wait already, for "
                "robots that do not answer; use Service.callAsync() where many may wait"
            )
        if isinstance(result, Error):
            log_from_qml("", logging.ERROR, f"Service.call: {result}", caller)
        return client.shown(result)

    @Slot(str, str)
    @Slot(str, str, QJSValue)
    @Slot(str, str, QJSValue, QJSValue)
    def callAsync(
        self,
        service: str,
        type_name: str,
        request: QJSValue | None = None,
        callback: QJSValue | None = None,
    ) -> None:
        """Call a service; `callback` is told what :meth:`call` returns."""
        client = self._client(self._runtime(), service, type_name)
        client.sendRequestAsync(QJSValue() if request is None else request, callback)

    def _runtime(self) -> Runtime:
        return own_runtime(self)

    def _client(self, runtime: Runtime, service: str, type_name: str) -> ServiceClient:
        # Made once: finding a server may take longer than calling it.
        key = (service, full_type(type_name, "srv"))
        client = self._clients.get(key)
        if client is None or not is_alive(client):
            client = self._clients[key] = ServiceClient(runtime, *key, Dialect.ROS1)
            client.setParent(self)
            client.setProperty("connectionTimeout", _PATIENCE)
        return client

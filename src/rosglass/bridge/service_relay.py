"""Relaying one service: offered in one world, called in the other."""

from __future__ import annotations

import logging
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from rosglass.bridge.status import RelayStatus
from rosglass.comm import IMMEDIATE
from rosglass.errors import Error, NodeClosedError
from rosglass.messages import ServiceTranslation

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.bridge.side import Side
    from rosglass.comm import ServiceClient, ServiceServer
    from rosglass.messages import Message, ServiceType

__all__ = ["ServiceRelay", "notes"]

_log = logging.getLogger("rosglass.bridge")


class ServiceRelay:
    """Offers in one world a service that a server in the other offers.

    Args:
        source: Where the server is.
        target: Where it is to be called.
        service: Its name at the source.
        other: Its name at the target.
        kind: Name of its type at the source, when it is not told there; empty to be told.
        timeout: Seconds that the server has to answer.
    """

    def __init__(
        self,
        source: Side,
        target: Side,
        service: str,
        other: str,
        *,
        kind: str = "",
        timeout: float = 10.0,
    ) -> None:
        self._source, self._target = source, target
        self.service, self.other = service, other
        self._kind, self._timeout = kind, timeout
        self._client: ServiceClient | None = None
        self._server: ServiceServer | None = None
        self._translation: ServiceTranslation | None = None
        self._type: ServiceType | None = None
        self._problem = ""
        self._count = self._refused = 0

    def follow(self, wake: Callable[[], None]) -> None:
        """Do what is to be done; on the bridge's thread."""
        try:
            if self._client is None:
                self._client = self._source.node.create_service_client(
                    self.service, self._kind or None
                )
                self._client.on_ready_change(lambda _: wake(), IMMEDIATE)
            if self._server is None and self._client.type is not None and not self._problem:
                self._serve(self._client.type)
        except NodeClosedError:
            return
        except Error as error:
            if str(error) != self._problem:
                self._problem = str(error)
                _log.warning("%s is not relayed: %s", self.service, error)

    def _serve(self, kind: ServiceType) -> None:
        offered = kind
        if self._source.node.wire != self._target.node.wire:
            self._translation = ServiceTranslation(kind)
            self._target.teach(self._translation)
            offered = self._translation.type
        self._type = kind
        self._server = self._target.node.create_service_server(
            self.other, offered, self._call, executor=IMMEDIATE
        )

    def _call(self, request: Message) -> Future[Message]:
        """Call the server; the caller is answered, or told the error, when it has answered."""
        answer: Future[Message] = Future()
        answer.set_running_or_notify_cancel()
        client, translation = self._client, self._translation
        assert client is not None
        try:
            asked = request if translation is None else translation.request.convert(request)
            call = client.call_async(asked, timeout=self._timeout)
        except Error as error:
            self._fail(answer, error)
            return answer

        def done(call: Future[Any]) -> None:
            try:
                told = call.result()
                if translation is not None:
                    told = translation.response.convert(told)
            except Exception as error:
                self._fail(answer, error)
            else:
                self._count += 1
                answer.set_result(told)

        call.add_done_callback(done)
        return answer

    def _fail(self, answer: Future[Message], error: BaseException) -> None:
        self._refused += 1
        answer.set_exception(error)

    def status(self) -> RelayStatus:
        """Return how it is doing."""
        kind, translation = self._type, self._translation
        problem = self._problem
        if not problem and self._client is not None:
            problem = self._client.problem
        return RelayStatus(
            "service",
            self.service,
            self.other,
            "->" if self._source.number == 0 else "<-",
            "" if kind is None else kind.name,
            translation.type.name if translation is not None else kind.name if kind else "",
            count=self._count,
            refused=self._refused,
            notes=() if translation is None else notes(translation),
            problem=problem,
        )

    def close(self) -> None:
        """Stop relaying; calls on their way are told so. Safe to call twice."""
        if self._server is not None:
            self._server.close()
        if self._client is not None:
            self._client.close()


def notes(translation: ServiceTranslation) -> tuple[str, ...]:
    """Say what a translation loses, and makes up."""
    told = []
    for name, part in (("request", translation.request), ("response", translation.response)):
        told += [f"left out of the {name}: {path}" for path in part.left_out]
    if translation.derived:
        told.append(f"ROS {translation.type.ros} has no such type of its own")
    return tuple(told)

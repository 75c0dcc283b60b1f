"""Relaying one service: offered in one world, called in the other."""

from __future__ import annotations

from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from rosglass.bridge.offered_relay import OfferedRelay
from rosglass.comm import IMMEDIATE, ServiceClient, ServiceServer
from rosglass.errors import Error
from rosglass.messages import ServiceTranslation, ServiceType

if TYPE_CHECKING:
    from rosglass.messages import Message

__all__ = ["ServiceRelay"]


class ServiceRelay(OfferedRelay[ServiceClient, ServiceServer, ServiceType, ServiceTranslation]):
    """Offers in one world a service that a server in the other offers.

    Arguments as for :class:`OfferedRelay`.
    """

    KIND = "service"
    PARTS = ("request", "response")

    def _ask(self) -> ServiceClient:
        return self._source.node.create_service_client(self.name, self._kind or None)

    def _type_of(self, client: ServiceClient) -> ServiceType | None:
        return client.type

    def _translate(self, kind: ServiceType) -> ServiceTranslation:
        return ServiceTranslation(kind)

    def _offer(self, kind: ServiceType) -> ServiceServer:
        node = self._target.node
        return node.create_service_server(self.other, kind, self._call, executor=IMMEDIATE)

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

    def close(self) -> None:
        """Stop relaying; calls on their way are told so. Safe to call twice."""
        if self._server is not None:
            self._server.close()
        if self._client is not None:
            self._client.close()

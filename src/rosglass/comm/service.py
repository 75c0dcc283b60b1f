"""Services: calling them, and offering them."""

from __future__ import annotations

from abc import abstractmethod
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from rosglass.comm.node import Executor, Handle

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from rosglass.comm.qos import QoS
    from rosglass.messages import Message, ServiceType

__all__ = ["Call", "ServiceClient", "ServiceServer"]


class Call(Future["Message"]):
    """A service call on its way.

    A :class:`concurrent.futures.Future`: ``result(timeout)`` waits for the response, ``cancel()``
    gives the call up (the server is not told: ROS has no such message). It can be awaited in
    asyncio, too. Its callbacks run in the thread that completes it; pass `executor` to
    :meth:`on_done` for another.
    """

    def __await__(self) -> Generator[Any, None, Message]:
        import asyncio  # noqa: PLC0415 - only for those who use it

        return asyncio.wrap_future(self).__await__()

    def on_done(self, callback: Callable[[Call], None], executor: Executor) -> None:
        """Call `callback` with this call on `executor` once it has ended, one way or another."""
        self.add_done_callback(lambda _: executor.post(lambda: callback(self)))


class ServiceClient(Handle):
    """Calls a service; made by :meth:`Node.create_service_client`.

    Attributes:
        name: Absolute service name.
        type: The service type.
        qos: The quality of service of requests and replies.
    """

    name: str
    type: ServiceType
    qos: QoS

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} [{self.type.name}]>"

    @property
    @abstractmethod
    def ready(self) -> bool:
        """Whether a server is there."""

    @property
    @abstractmethod
    def problem(self) -> str:
        """Why the service cannot be called, in words; empty when all is well."""

    @property
    @abstractmethod
    def pending(self) -> int:
        """Calls that have not ended."""

    @abstractmethod
    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait up to `timeout` seconds (None: for ever) for a server; return whether it is there.

        Raises:
            NodeClosedError: The client is closed, or gets closed meanwhile.
        """

    @abstractmethod
    def call(
        self, request: Message | dict[str, Any] | None = None, /, *, timeout: float | None = 10.0
    ) -> Message:
        """Call the service and wait for its response.

        Args:
            request: A message or a dict of fields; missing fields, and None, get the defaults.
            timeout: Seconds to wait in all, for the server to appear and to answer; None for ever.

        Raises:
            ConversionError: A value does not fit its field; nothing is sent.
            ServiceUnavailableError: No server appeared within the time.
            TimeoutError: The server did not answer within the time.
            ServiceError: The server says that it failed.
            NodeClosedError: The client is closed, or gets closed meanwhile.
        """

    @abstractmethod
    def call_async(
        self, request: Message | dict[str, Any] | None = None, /, *, timeout: float | None = 10.0
    ) -> Call:
        """Call the service and return at once; the call carries the response or the error.

        A request for which there is no server yet waits for one, and is sent as soon as it is
        there. Arguments and errors as in :meth:`call`; a ConversionError is raised here already.
        """

    @abstractmethod
    def on_ready_change(
        self, callback: Callable[[bool], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with :attr:`ready` whenever it changes."""


class ServiceServer(Handle):
    """Offers a service; made by :meth:`Node.create_service_server`.

    Attributes:
        name: Absolute service name.
        type: The service type.
        qos: The quality of service of requests and replies.
    """

    name: str
    type: ServiceType
    qos: QoS

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} [{self.type.name}]>"

    @property
    @abstractmethod
    def problem(self) -> str:
        """Why some clients cannot be served, in words; empty when all is well."""

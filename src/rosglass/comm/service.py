"""Calling services."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any

from rosglass.comm.node import Executor, Handle
from rosglass.comm.promise import Promise
from rosglass.comm.rclpy_names import hint_at_members

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.qos import QoS
    from rosglass.messages import Message, ServiceType

__all__ = ["Call", "ServiceClient"]


class Call(Promise["Message"]):
    """A service call on its way: the promise of the response.

    ``result(timeout)`` waits for it, ``await call`` does in asyncio, :meth:`on_done` calls back.
    ``cancel()`` gives the call up: a request that waits for a server is not sent any more, and
    the response to one that was sent is dropped (the server is not told: ROS has no such message).
    """


@hint_at_members
class ServiceClient(Handle):
    """Calls a service; made by :meth:`Node.create_service_client`.

    Attributes:
        name: Absolute service name.
        type: The service type; None while it is not discovered yet.
        qos: The quality of service of requests and replies.
    """

    name: str
    type: ServiceType | None
    qos: QoS

    def __repr__(self) -> str:
        kind = self.type.name if self.type is not None else "type not known yet"
        return f"<{type(self).__name__} {self.name} [{kind}]>"

    @property
    @abstractmethod
    def ready(self) -> bool:
        """Whether a server is there that understands the requests."""

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

        Callbacks may do this, too, as long as the server does not need their thread. Where
        nothing may wait, as on a user interface's thread, take :meth:`call_async`.

        Args:
            request: A message or a dict of fields; missing fields, and None, get the defaults.
            timeout: Seconds to wait in all, for the server to appear and to answer; None for ever.

        Raises:
            ConversionError: A value does not fit its field; nothing is sent.
            ServiceUnavailableError: No server appeared within the time; nothing was sent.
            TimeoutError: The server did not answer within the time; it may still do what it was
                asked to.
            ServiceError: The server says that it failed, or its response cannot be decoded.
            ConnectionLostError: The server went away before it answered.
            UnsupportedError: The calling thread is one that the answer needs.
            NodeClosedError: The client is closed, or gets closed meanwhile.
        """

    @abstractmethod
    def call_async(
        self, request: Message | dict[str, Any] | None = None, /, *, timeout: float | None = 10.0
    ) -> Call:
        """Call the service and return at once; the call carries the response or the error.

        A request for which there is no server yet waits for one, and is sent as soon as it is
        there. Requests are sent in the order of the calls; not in ROS 1, unless the client is
        persistent: there each call has a connection of its own, and they run side by side.
        Arguments and errors as in :meth:`call`; a ConversionError is raised here already, unless
        the type is not known yet.
        """

    @abstractmethod
    def on_ready_change(
        self, callback: Callable[[bool], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with :attr:`ready` whenever it changes, to and fro.

        Args:
            callback: Told the new value.
            executor: Where it runs; None for the node's own dispatcher thread.
        """

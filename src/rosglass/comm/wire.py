"""The seam below the client layer: writers, readers, requesters, repliers, calls, and the graph.

A wire moves bytes and reports endpoints. What ROS means by them (names, types, QoS, callbacks,
deadlines) is defined once, in :mod:`rosglass.comm`. TCPROS implements the four
endpoints; DDS, Zenoh and ``local://`` also the :class:`Middleware` of ROS 2 nodes.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

from rosglass.comm.handle import Handle
from rosglass.comm.promise import Promise
from rosglass.errors import ConversionError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rosglass.comm.graph import EndpointInfo, Graph, NodeName, Status
    from rosglass.errors import Error
    from rosglass.interfaces import Definition
    from rosglass.messages import Message, ServiceType  # noqa: F401 - the base of Call

    Buffer = bytes | bytearray | memoryview

__all__ = [
    "CALL_DROPPED",
    "SERVER_LEFT",
    "Call",
    "Middleware",
    "OnRequest",
    "OnSample",
    "PendingCall",
    "Reader",
    "Replier",
    "RequestId",
    "Requester",
    "Writer",
    "encode_request",
]


class OnSample(Protocol):
    """Receives samples; called on the wire's thread, must return at once."""

    def __call__(
        self,
        data: bytes | memoryview,
        received: int,
        sent: int | None,
        gid: bytes,
        sequence: int,
        hash: str,
    ) -> None:
        """Receive a sample.

        Args:
            data: The payload, with its encapsulation header. A read-only view keeps the
                middleware's buffer alive.
            received: System time of reception in nanoseconds since the Unix epoch.
            sent: The publisher's time stamp in the same unit; None if there is none.
            gid: Identity of the publisher; empty if unknown.
            sequence: The publisher's sequence number; -1 if unknown.
            hash: The publisher's RIHS01 type hash; empty if it has none.
        """


class Writer(Handle):
    """Sends the samples of one publisher."""

    #: Identity of the publisher, as readers receive it with samples; empty if unknown.
    gid: bytes = b""
    #: Why some subscribers receive nothing, or not everything, in words; empty if all is well. The
    #: publisher reports which subscriptions in the graph do not match.
    problem: str = ""
    #: Writes the wire's sequence number into an encoded message, given and returned in parts; None
    #: if messages have none.
    number: Callable[[Sequence[Buffer]], Sequence[Buffer]] | None = None

    @abstractmethod
    def write(self, data: bytes | bytearray) -> None:
        """Send a payload, which begins with its encapsulation header if the format has one."""

    def write_parts(self, parts: Sequence[Buffer]) -> None:
        """Send a payload given in parts, which the caller may change as soon as this returns.

        The first part begins like the payload of :meth:`write`; views are contiguous bytes. Wires
        that can send big payloads without another copy override this.
        """
        self.write(b"".join(parts))

    def match(self, subscriptions: Sequence[EndpointInfo]) -> None:
        """Update the matching subscriptions, for middlewares that address them individually.

        Called on every change of the graph, never on a thread of the middleware.
        """

    def subscribers(self) -> list[EndpointInfo] | None:
        """Return the connected subscribers; called from any thread.

        None on wires where only the graph says which subscriptions match.
        """
        return None

    def changes(self) -> list[list[EndpointInfo]]:
        """Return the subscribers after each change since the last call, the current ones last.

        For wires with :meth:`subscribers`, as one may connect and leave between two calls.
        """
        return []

    def lost(self) -> int:
        """Return how many messages were dropped for newer ones because a subscriber is slow."""
        return 0

    def assert_liveliness(self) -> None:
        """Assert the publisher's liveliness; does nothing if the middleware cannot."""


class Reader(Handle):
    """Receives the samples of one subscription."""

    #: The problem with the received data, in words, and already logged; empty if there is none.
    problem: str = ""

    def set_eager(self, eager: bool) -> None:
        """Set whether samples are delivered one by one, which is the default.

        A reader that is not eager may deliver samples in batches, several times a second, so that
        a topic that no consumer waits for costs next to nothing.
        """

    def flush(self) -> None:
        """Deliver the samples held back, in the calling thread."""

    def lost(self) -> int:
        """Return how many samples the middleware reports as lost, of those without sequence number.

        Gaps in sequence numbers are counted by the subscription.
        """
        return 0

    def lateness(self, publisher: bytes) -> int:
        """Return how late a publisher's last sample was by its arrival, in nanoseconds.

        For samples without a stamp; 0 if that is unknown.
        """
        return 0

    def alive(self) -> int | None:
        """Return how many publishers asserted their liveliness in time; None if unknown."""
        return None


#: Reasons that a requester gives for a call that will never be answered; any other reason is a
#: server's refusal.
SERVER_LEFT, CALL_DROPPED = "its server went away", "its server ended the call without a reply"


class Call(Promise["Message"]):
    """The promise of a service's response.

    ``result(timeout)`` waits for it, ``await call`` does so in asyncio, :meth:`on_done` calls back.
    ``cancel()`` cancels the call: a request that waits for a server is not sent, and the response
    to a sent one is ignored (the server is not notified: ROS has no message for that).
    """


@dataclass(eq=False, kw_only=True, slots=True)
class PendingCall:
    """A call that has not ended; its client owns it, and enforces its deadline.

    The layers below receive it by reference, and keep their state of the call here.

    Attributes:
        number: Identifies it among the client's calls; ascending.
        call: The caller's promise.
        on_reply: Called with the call, its response, and the reason if there is none.
        value: The encoded request, or the value to encode while the type is unknown.
        type: The type it is encoded for; None while that is unknown.
        max_size: Largest size of a request in bytes; None for no limit.
        made: Monotonic time of the call.
        deadline: Monotonic time at which it ends without response; None for no limit.
        server_only: True if it ends at its deadline, or after it, only while there is no server.
        private: Whether the caller waits in :meth:`ServiceClient.call`: its end runs no callback.
        timer: Ends it at its deadline; None in :meth:`ServiceClient.call`, which does so itself.
        waiting: Whether its request waits to be sent; see :class:`PendingCalls`.
        sent: Monotonic time at which its request was sent, None before.
        answered: Whether a reply, or the reason for a missing one, was received.
        requester: The requester of the wire that sent it; None before.
        servers: Identities of the servers in the graph at that time.
        lost_at: Monotonic time when the last of them left; None while one may answer.
        route: Private data of the wire; None when it has none.
    """

    number: int
    call: Call
    on_reply: Callable[[PendingCall, bytes | memoryview | None, str | Error], None]
    value: Any
    type: ServiceType | None
    max_size: int | None
    made: float
    deadline: float | None
    server_only: bool
    private: bool
    timer: Handle | None = None
    waiting: bool = False
    sent: float | None = None
    answered: bool = False
    requester: Requester | None = None
    servers: frozenset[bytes | str] = frozenset()
    lost_at: float | None = None
    route: Any = None

    def left(self) -> float | None:
        """Return the seconds until its response is useless, above 0; None for no limit."""
        if self.deadline is None or self.server_only:
            return None
        return max(0.001, self.deadline - time.monotonic())

    def answer(self, data: bytes | memoryview) -> None:
        """End the call with its response, with its encapsulation header; on any thread."""
        self.on_reply(self, data, "")

    def fail(self, reason: str | Error) -> None:
        """End the call without response; on any thread.

        Args:
            reason: :data:`SERVER_LEFT`, :data:`CALL_DROPPED`, why the server refused it, or the
                error with which the call ends.
        """
        self.on_reply(self, None, reason)

    def encode(self, kind: ServiceType) -> bytes:
        """Return the request's bytes for a type that may have been discovered after the call.

        Raises:
            ConversionError: A value does not fit its field.
        """
        if self.type is not kind:
            value = self.value
            if self.type is not None:
                value = self.type.request.decode(value).to_dict()
            self.value, self.type = encode_request(kind, value, self.max_size), kind
        return bytes(self.value)


def encode_request(kind: ServiceType, value: Any, max_size: int | None) -> bytes:
    """Return the encoded request; raises ConversionError."""
    data = kind.request.encode(value)
    if max_size is not None and len(data) > max_size:
        limit = f"at most {max_size} bytes, as its server takes no larger request"
        raise ConversionError("", f"{len(data)} bytes", limit, kind.request.name)
    return data


class Requester(Handle):
    """Sends the requests of one service client."""

    #: Why some servers in the graph cannot be called, in words; empty if all can.
    problem: str = ""
    #: Called from any thread when the result of :meth:`ready` may have changed; set by the client.
    #: Without such calls, a server is discovered up to a second late.
    changed: Callable[[], None] | None = None

    @abstractmethod
    def ready(self) -> bool:
        """Return whether a server is connected, so that a request sent now is not lost."""

    @abstractmethod
    def send(self, pending: PendingCall, data: bytes | bytearray) -> None:
        """Send a request.

        The wire ends the call with the reply, which may arrive before this returns. That of a
        private call may be handled in the middle of receiving, as it only runs fast code of ours.

        Args:
            pending: The call; its number is higher than those of earlier requests. The client ends
                it at its deadline; the middleware may drop the request then.
            data: The payload with its encapsulation header.
        """

    def is_reply_lost(self, pending: PendingCall) -> bool:
        """Return whether every server that was sent a request has left since, even if it is back.

        For middlewares that lose replies sent in between, without knowing.
        """
        return False

    @abstractmethod
    def forget(self, pending: PendingCall) -> None:
        """Drop the reply to a request if it still arrives."""


@dataclass(frozen=True)
class RequestId:
    """Identifies the request that a reply answers.

    Attributes:
        client: Identity of the client.
        sequence: The client's sequence number of the request.
        handle: Private to the wire.
    """

    client: bytes
    sequence: int
    handle: object = field(default=None, compare=False, repr=False)


class OnRequest(Protocol):
    """Receives requests; called on the wire's thread, must return at once."""

    def __call__(self, request: RequestId, data: bytes | memoryview) -> None:
        """Receive a request, to be answered at any time, or never, with :meth:`Replier.reply`."""


class Replier(Handle):
    """Receives the requests of one service server and sends the replies."""

    #: Why some clients in the graph cannot be served, in words; empty if all can.
    problem: str = ""
    #: Whether receiving a request only queues it for another thread, so that it may run in the
    #: middle of receiving. Set by the server.
    quick: bool = False
    #: Whether :meth:`fail` reaches the client.
    reports_failures: bool = False
    #: Largest response in bytes; None for no limit.
    max_reply: int | None = None
    #: Whether a ServiceError raised by the callback is an answer, as in rospy, not a failure.
    has_refusals: bool = False

    @abstractmethod
    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Answer a request; ignores clients that have left."""

    def fail(
        self, request: RequestId, reason: str, instead: bytes | bytearray | None = None
    ) -> None:
        """Report to the client that the service failed, if the wire can.

        Args:
            request: The request.
            reason: The reason of the failure.
            instead: A response to clients that no failure reaches; None to let them wait.
        """
        if instead is not None:
            self.reply(request, instead)

    def describe_failure(self, error: BaseException) -> str:
        """Return the reason given to :meth:`fail` for an exception of the service's callback."""
        return f"{type(error).__name__}: {error}"

    def abandoned(self, request: RequestId) -> bool:
        """Return whether the client of a request has left, so that its answer is useless."""
        return False

    def client_name(self, request: RequestId) -> str:
        """Return the name of a request's client, for messages."""
        return f"client {request.client.hex()}"


class Middleware(ABC):
    """A connection to a ROS 2 domain.

    Attributes:
        matches_qos: Whether endpoints with incompatible profiles exchange nothing.
        matches_hashes: Whether endpoints with the same type name but different type hashes exchange
            nothing.
        keeps_byte_order: Whether big-endian payloads are delivered unchanged.
        wire: Wire format of the payloads, ``cdr`` or ``ros1``.
    """

    matches_qos: bool
    matches_hashes: bool = True
    keeps_byte_order: bool = True
    wire: str = "cdr"
    #: Whether a service's hash in the graph may be that of its request's type.
    announces_requests: bool = False
    #: Whether :meth:`describe_type` is supported.
    describes_types: bool = False

    @abstractmethod
    def open(self, graph: Graph, changed: Callable[[], None]) -> None:
        """Join the domain: keep `graph` up to date, and call `changed` when :meth:`status` changes.

        Returns without waiting for an answer; both are updated from the middleware's threads.

        Raises:
            ConnectionLostError: Impossible on this machine, e.g. the address to listen on is taken.
        """

    @abstractmethod
    def status(self) -> Status:
        """Return the state of the connection."""

    def unnamed(self) -> int:
        """Return how many discovered programs have not announced their nodes yet."""
        return 0

    @abstractmethod
    def announce(self, node: NodeName) -> Handle:
        """Show a node in the graph until the handle is closed."""

    @abstractmethod
    def create_writer(self, endpoint: EndpointInfo) -> Writer:
        """Announce a publisher and return its writer.

        Args:
            endpoint: The endpoint, without GID, which the middleware assigns. A service's type is
                named ``pkg/srv/Type``, or ``pkg/action/Type_SendGoal`` and the like.
        """

    @abstractmethod
    def create_reader(self, endpoint: EndpointInfo, on_sample: OnSample) -> Reader:
        """Announce a subscription, which delivers samples to `on_sample`.

        Samples of a type with the same name but another hash are delivered, too; the subscription
        decides whether it can decode them.
        """

    @abstractmethod
    def create_requester(self, endpoint: EndpointInfo) -> Requester:
        """Announce a service client, which ends the calls that it sends."""

    @abstractmethod
    def create_replier(self, endpoint: EndpointInfo, on_request: OnRequest) -> Replier:
        """Announce a service server, which delivers requests to `on_request`."""

    def endpoint_conflicts(self, endpoint: EndpointInfo) -> Mapping[str, str]:
        """Return why a remote endpoint cannot match any of ours, apart from its profile.

        Returns:
            The conflict in words for each policy, as :meth:`QoS.conflicts` does.
        """
        return {}

    def describe_type(self, endpoint: EndpointInfo, timeout: float) -> Definition | None:
        """Return the message definition that a publisher or subscription announces itself.

        Waits for its answer; called on a thread of its own.

        Returns:
            The definition; None if it announces none.

        Raises:
            TimeoutError: It does not answer within `timeout` seconds.
            DefinitionError: The announced type is not a ROS 2 message.
        """
        return None

    @abstractmethod
    def poll(self) -> None:
        """Do periodic work; called about once a second on the node's thread."""

    @abstractmethod
    def close(self) -> None:
        """Leave the domain; safe to call twice. There are no callbacks afterwards."""

"""The small seam that ROS 2's middlewares share: writers, readers, and news of the graph.

A :class:`Middleware` moves bytes and tells who is there. What ROS 2 means by it (names, types,
profiles that match or not, callbacks) is :mod:`rosglass.ros2.node`'s business, once for all.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from rosglass.comm.handle import Handle

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rosglass.comm.graph import EndpointInfo, Graph, NodeName, Status
    from rosglass.errors import Error
    from rosglass.interfaces import Definition

    Buffer = bytes | bytearray | memoryview

__all__ = [
    "CALL_DROPPED",
    "SERVER_LEFT",
    "Middleware",
    "OnReply",
    "OnRequest",
    "OnSample",
    "Reader",
    "Replier",
    "RequestId",
    "Requester",
    "Writer",
]


class OnSample(Protocol):
    """Takes a received sample; called on the middleware's thread, must return at once."""

    def __call__(
        self,
        data: bytes | memoryview,
        received: int,
        sent: int | None,
        gid: bytes,
        sequence: int,
        hash: str,
    ) -> None:
        """Take a sample.

        Args:
            data: The payload, with its encapsulation header. A read-only view keeps the
                middleware's buffer alive for as long as it lives itself.
            received: System time of reception, nanoseconds since the Unix epoch.
            sent: The publisher's time stamp in the same unit, None when there is none.
            gid: Identity of the publisher, empty when unknown.
            sequence: The publisher's running number, -1 when unknown.
            hash: The publisher's RIHS01 type hash, empty when it has none.
        """


class Writer(Handle):
    """Sends the samples of one publisher."""

    #: Identity of the publisher, as readers are told it with samples; empty when unknown.
    gid: bytes = b""
    #: Why some subscribers get nothing, or not all, in words; empty when all is well. The graph is
    #: not considered: it is for the publisher to say which subscriptions there do not match.
    problem: str = ""
    #: Puts the wire's running number into a message that was encoded here, given and returned in
    #: parts; None where messages bear none.
    number: Callable[[Sequence[Buffer]], Sequence[Buffer]] | None = None

    @abstractmethod
    def write(self, data: bytes | bytearray) -> None:
        """Send a payload, which begins with its encapsulation header where the format has one."""

    def write_parts(self, parts: Sequence[Buffer]) -> None:
        """Send a payload that comes in parts, which may change as soon as this returns.

        The first begins as the payload of :meth:`write`; views are contiguous and of bytes. For
        middlewares that take big payloads without another copy; all others join them.
        """
        self.write(b"".join(parts))

    def match(self, subscriptions: Sequence[EndpointInfo]) -> None:
        """Take note of the subscriptions in the graph that want these samples.

        For middlewares that must address them one way or the other; called on every change of
        the graph, never on a thread of the middleware.
        """

    def subscribers(self) -> list[EndpointInfo] | None:
        """Return the subscribers that are connected; called from any thread.

        None on wires where the graph alone tells which subscriptions match.
        """
        return None

    def changes(self) -> list[list[EndpointInfo]]:
        """Return the subscribers after each change since the last call, those of now last.

        For wires with :meth:`subscribers`: one may come and go between two looks.
        """
        return []

    def lost(self) -> int:
        """Return how many messages made room for newer ones because a subscriber is slow."""
        return 0

    def assert_liveliness(self) -> None:
        """Show that the publisher is alive; nothing where the middleware has no word for it."""


class Reader(Handle):
    """Receives the samples of one subscription."""

    def set_eager(self, eager: bool) -> None:
        """Say whether samples are handed on as they come, which is how a reader starts.

        A reader that is not eager may hand samples on in batches, several times a second, so that
        a topic that no consumer waits for costs next to nothing.
        """

    def flush(self) -> None:
        """Hand on, in the calling thread, what waits to be handed on."""

    def lost(self) -> int:
        """Return how many samples the middleware knows to be lost, those without number only.

        Gaps in the running numbers of samples that were handed on are counted by who takes them.
        """
        return 0

    def alive(self) -> int | None:
        """Return how many publishers asserted their liveliness in time; None where unknown."""
        return None


#: What a requester gives as the reason when nobody will answer any more; by all other reasons
#: somebody said no.
SERVER_LEFT, CALL_DROPPED = "its server went away", "its server ended the call without a reply"


class OnReply(Protocol):
    """Takes the reply to a request; called on the middleware's thread, must return at once."""

    def __call__(self, number: int, data: bytes | memoryview | None, error: str | Error) -> None:
        """Take a reply.

        Args:
            number: What :meth:`Requester.send` was given with the request.
            data: The response with its encapsulation header; None when there is none.
            error: Why there is none, :data:`SERVER_LEFT` and :data:`CALL_DROPPED` among others, or
                the error with which the call ends.
        """


class Requester(Handle):
    """Sends the requests of one service client."""

    #: Why some servers in the graph cannot be called, in words; empty when all can.
    problem: str = ""
    #: Called, from any thread, when what :meth:`ready` returns may have changed; set by whoever
    #: created it. Without such calls, a server is noticed up to a second late.
    changed: Callable[[], None] | None = None
    #: Returns whether taking the reply to the request with a number runs none but our own code, and
    #: at once: it may be taken in the middle of receiving then. Set by the requester's owner.
    quick: Callable[[int], bool] | None = None

    @abstractmethod
    def ready(self) -> bool:
        """Return whether a server is linked, so that a request sent now is not lost."""

    @abstractmethod
    def send(self, number: int, data: bytes | bytearray, timeout: float | None) -> None:
        """Send a request.

        Args:
            number: What the reply will bear, above those of the requests before. The reply may
                come before this returns.
            data: The payload with its encapsulation header.
            timeout: Seconds after which the reply is of no use any more, None for never. The
                caller keeps the time; the middleware may forget the request then.
        """

    def stranded(self, number: int) -> bool:
        """Return whether everyone who was sent a request has left since, even if they are back.

        For middlewares that lose what a server sends meanwhile, and do not know whether it did.
        """
        return False

    @abstractmethod
    def forget(self, number: int) -> None:
        """Drop the reply to a request, should it still come."""


@dataclass(frozen=True)
class RequestId:
    """Which request a reply answers.

    Attributes:
        client: Identity of the client that asked.
        sequence: The client's number for the request.
        handle: What the middleware needs besides; nobody else looks into it.
    """

    client: bytes
    sequence: int
    handle: object = field(default=None, compare=False, repr=False)


class OnRequest(Protocol):
    """Takes a request; called on the middleware's thread, must return at once."""

    def __call__(self, request: RequestId, data: bytes | memoryview) -> None:
        """Take a request, to be answered at any time, or never, with :meth:`Replier.reply`."""


class Replier(Handle):
    """Receives the requests of one service server and sends the replies."""

    #: Why some clients in the graph cannot be served, in words; empty when all can.
    problem: str = ""
    #: Whether taking a request only puts it aside for another thread: it may be taken in the
    #: middle of receiving then. Set by whoever created the replier.
    quick: bool = False
    #: Whether :meth:`fail` tells anything.
    tells_failures: bool = False
    #: Most bytes that a response may have; None for any number.
    max_reply: int | None = None
    #: Whether a ServiceError that the callback raises is an answer, as in rospy, and no failure.
    has_refusals: bool = False

    @abstractmethod
    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Answer a request; a client that is gone is no error."""

    def fail(self, request: RequestId, reason: str) -> None:
        """Tell the client that no response will come, where the middleware can say so."""

    def describe_failure(self, error: Exception) -> str:
        """Return what :meth:`fail` tells of an exception that the service's callback raised."""
        return f"{type(error).__name__}: {error}"

    def abandoned(self, request: RequestId) -> bool:
        """Return whether the client of a request has gone, so that its answer is of no use."""
        return False

    def client_name(self, request: RequestId) -> str:
        """Return who sent a request, for people."""
        return f"client {request.client.hex()}"


class Middleware(ABC):
    """A connection to a ROS 2 domain.

    Attributes:
        matches_qos: Whether a writer and a reader with incompatible profiles exchange nothing.
        matches_hashes: Whether endpoints whose types have one name but different hashes exchange
            nothing.
        keeps_byte_order: Whether big-endian payloads arrive as such.
        wire: Format of the payloads, ``cdr`` or ``ros1``.
    """

    matches_qos: bool
    matches_hashes: bool = True
    keeps_byte_order: bool = True
    wire: str = "cdr"
    #: Whether a service's hash in the graph may be that of its request's type.
    announces_requests: bool = False
    #: Whether :meth:`describe_type` can tell anything.
    describes_types: bool = False

    @abstractmethod
    def open(self, graph: Graph, changed: Callable[[], None]) -> None:
        """Start: put what appears into `graph`, call `changed` when :meth:`status` changes.

        Returns without waiting for anyone to answer; both are told from the middleware's threads.

        Raises:
            ConnectionLostError: This machine cannot do it, e.g. the address to listen on is taken.
        """

    @abstractmethod
    def status(self) -> Status:
        """Return the state of the connection."""

    def unnamed(self) -> int:
        """Return how many programs are there that have not said yet which nodes they have."""
        return 0

    @abstractmethod
    def announce(self, node: NodeName) -> Handle:
        """Show a node in the graph until the handle is closed."""

    @abstractmethod
    def create_writer(self, endpoint: EndpointInfo) -> Writer:
        """Announce a publisher and return its sending end.

        Args:
            endpoint: What it is to be, without identity: that comes from here. A service's type is
                called ``pkg/srv/Type``, or ``pkg/action/Type_SendGoal`` and the like.
        """

    @abstractmethod
    def create_reader(self, endpoint: EndpointInfo, on_sample: OnSample) -> Reader:
        """Announce a subscription and hand what arrives to `on_sample`.

        Samples whose type has the same name but another hash are handed over too: whether they
        can be understood is for the caller to say.
        """

    @abstractmethod
    def create_requester(self, endpoint: EndpointInfo, on_reply: OnReply) -> Requester:
        """Announce a service client, whose replies `on_reply` takes; return its sending end."""

    @abstractmethod
    def create_replier(self, endpoint: EndpointInfo, on_request: OnRequest) -> Replier:
        """Announce a service server, whose requests `on_request` takes."""

    def conflicts(self, endpoint: EndpointInfo) -> Mapping[str, str]:
        """Say what keeps a publisher or subscription from all of ours, besides its profile.

        Returns:
            The conflict in words for each policy, as :meth:`QoS.conflicts` does.
        """
        return {}

    def describe_type(self, endpoint: EndpointInfo, timeout: float) -> Definition | None:
        """Return the definition of a message that a publisher or subscription itself announces.

        Waits for its answer; called on a thread of its own.

        Returns:
            None when it announces none.

        Raises:
            TimeoutError: It does not answer within `timeout` seconds.
            DefinitionError: What it announces is no message of ROS 2.
        """
        return None

    @abstractmethod
    def poll(self) -> None:
        """Do what has to be done now and then; called about once a second on a thread of ours."""

    @abstractmethod
    def close(self) -> None:
        """Leave the domain; safe to call twice. Nothing is called back afterwards."""

"""What can be seen of the other nodes: names, endpoints, connection state."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from rosglass.comm.qos import QoS

__all__ = ["ConnectionState", "EndpointInfo", "EndpointKind", "NodeName", "Status"]


class EndpointKind(Enum):
    """What a node offers or uses at a name."""

    PUBLISHER = "publisher"
    SUBSCRIPTION = "subscription"
    SERVICE_SERVER = "service server"
    SERVICE_CLIENT = "service client"


@dataclass(frozen=True, slots=True, order=True)
class NodeName:
    """A node's name and namespace.

    Attributes:
        namespace: Absolute namespace, ``/`` for the root.
        name: Base name without slashes.
    """

    namespace: str
    name: str

    @property
    def full(self) -> str:
        """Full name, e.g. ``/arm/gripper``."""
        return f"{self.namespace.rstrip('/')}/{self.name}"

    def __str__(self) -> str:
        return self.full


@dataclass(frozen=True, slots=True)
class EndpointInfo:
    """A publisher, subscription, service server or service client seen in the graph.

    Attributes:
        kind: What it is.
        name: Topic or service name, absolute.
        type: Type name, ``pkg/msg/Type``.
        node: The node it belongs to.
        qos: Its quality of service as announced.
        type_hash: RIHS01 hash (REP 2016) or md5 (ROS 1); empty when not announced. Over DDS, ROS 2
            nodes announce a service by the hash of its request, and
        response_hash: that of its response; empty when it is not announced apart.
        gid: Identity of the endpoint, as bytes; empty when the world has none.
    """

    kind: EndpointKind
    name: str
    type: str
    node: NodeName
    qos: QoS = field(default_factory=QoS)
    type_hash: str = ""
    gid: bytes = b""
    response_hash: str = ""


class ConnectionState(Enum):
    """Whether the world a node lives in can be reached."""

    CONNECTING = "connecting"
    CONNECTED = "connected"
    LOST = "lost"
    CLOSED = "closed"


@dataclass(frozen=True, slots=True)
class Status:
    """A node's connection, as shown to a person.

    Attributes:
        state: The state.
        detail: One line saying what was tried and what happens next, e.g.
            ``no router at tcp/127.0.0.1:7447, retrying every second``.
        killed: Whether another node asked this one to end, as ``rosnode kill`` does, and has not
            taken its name.
    """

    state: ConnectionState
    detail: str = ""
    killed: bool = False

    def __str__(self) -> str:
        return f"{self.state.name}: {self.detail}" if self.detail else self.state.name

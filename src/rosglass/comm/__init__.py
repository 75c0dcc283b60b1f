"""What a robot offers: the abstract node and everything the worlds have in common."""

from rosglass.comm.graph import ConnectionState, EndpointInfo, EndpointKind, NodeName, Status
from rosglass.comm.node import Executor, Handle, Node, Publisher
from rosglass.comm.qos import Durability, History, Liveliness, QoS, Reliability
from rosglass.comm.subscription import Sample, Statistics, Subscription
from rosglass.comm.time import Duration, Time

__all__ = [
    "ConnectionState",
    "Durability",
    "Duration",
    "EndpointInfo",
    "EndpointKind",
    "Executor",
    "Handle",
    "History",
    "Liveliness",
    "Node",
    "NodeName",
    "Publisher",
    "QoS",
    "Reliability",
    "Sample",
    "Statistics",
    "Status",
    "Subscription",
    "Time",
]

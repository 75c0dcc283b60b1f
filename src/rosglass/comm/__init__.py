"""What a robot offers: the abstract node and everything the worlds have in common."""

from rosglass.comm.executor import IMMEDIATE, Dispatcher
from rosglass.comm.graph import ConnectionState, EndpointInfo, EndpointKind, NodeName, Status
from rosglass.comm.listeners import Listeners
from rosglass.comm.node import Executor, Handle, Node, Publisher
from rosglass.comm.qos import Durability, History, Liveliness, QoS, Reliability
from rosglass.comm.subscription import Sample, Statistics, Subscription
from rosglass.comm.time import Duration, Time
from rosglass.comm.worker import Worker

__all__ = [
    "IMMEDIATE",
    "ConnectionState",
    "Dispatcher",
    "Durability",
    "Duration",
    "EndpointInfo",
    "EndpointKind",
    "Executor",
    "Handle",
    "History",
    "Listeners",
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
    "Worker",
]

"""What a robot offers: the abstract node and everything the worlds have in common."""

from rosglass.comm.action import (
    ActionClient,
    ActionResult,
    ActionServer,
    CancelAnswer,
    ClientGoal,
    GoalStatus,
    ServerGoal,
)
from rosglass.comm.clock import Clock, ClockChange, Jump, Timer
from rosglass.comm.executor import IMMEDIATE, Dispatcher
from rosglass.comm.graph import ConnectionState, EndpointInfo, EndpointKind, NodeName, Status
from rosglass.comm.listeners import Listeners
from rosglass.comm.node import Answer, Executor, Handle, Node, Publisher
from rosglass.comm.parameters import (
    ParameterClient,
    ParameterDescriptor,
    ParameterEvent,
    Parameters,
    ParameterType,
    ParameterValue,
    Range,
    SetResult,
)
from rosglass.comm.promise import Promise
from rosglass.comm.qos import BEST_AVAILABLE, Durability, History, Liveliness, QoS, Reliability
from rosglass.comm.service import Call, ServiceClient, ServiceServer
from rosglass.comm.subscription import Sample, Statistics, Subscription
from rosglass.comm.time import Duration, Time
from rosglass.comm.timers import Timers
from rosglass.comm.worker import Worker

__all__ = [
    "BEST_AVAILABLE",
    "IMMEDIATE",
    "ActionClient",
    "ActionResult",
    "ActionServer",
    "Answer",
    "Call",
    "CancelAnswer",
    "ClientGoal",
    "Clock",
    "ClockChange",
    "ConnectionState",
    "Dispatcher",
    "Durability",
    "Duration",
    "EndpointInfo",
    "EndpointKind",
    "Executor",
    "GoalStatus",
    "Handle",
    "History",
    "Jump",
    "Listeners",
    "Liveliness",
    "Node",
    "NodeName",
    "ParameterClient",
    "ParameterDescriptor",
    "ParameterEvent",
    "ParameterType",
    "ParameterValue",
    "Parameters",
    "Promise",
    "Publisher",
    "QoS",
    "Range",
    "Reliability",
    "Sample",
    "ServerGoal",
    "ServiceClient",
    "ServiceServer",
    "SetResult",
    "Statistics",
    "Status",
    "Subscription",
    "Time",
    "Timer",
    "Timers",
    "Worker",
]

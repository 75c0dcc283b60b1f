"""The abstract node and everything that ROS 1 and ROS 2 have in common."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosglass.comm.action_client import (
        ActionClient,
        ActionResult,
        CancelAnswer,
        ClientGoal,
        GoalStatus,
    )
    from rosglass.comm.action_server import ActionServer, ServerGoal
    from rosglass.comm.clock import Clock, ClockChange, Jump, Timer
    from rosglass.comm.events import (
        DeadlineMissed,
        IncompatibleQoS,
        LivelinessChanged,
        LivelinessLost,
        Matched,
        SamplesLost,
    )
    from rosglass.comm.executor import IMMEDIATE, Dispatcher, LoopExecutor, executor_for
    from rosglass.comm.graph import ConnectionState, EndpointInfo, EndpointKind, NodeName, Status
    from rosglass.comm.handle import Executor, Handle
    from rosglass.comm.inbox import INBOX_LIMIT, Sample
    from rosglass.comm.lifecycle import LifecycleClient, State, Transition, TransitionEvent
    from rosglass.comm.listeners import Listeners
    from rosglass.comm.names import anonymous_name
    from rosglass.comm.node import Node
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
    from rosglass.comm.publisher import Publisher
    from rosglass.comm.qos import BEST_AVAILABLE, Durability, History, Liveliness, QoS, Reliability
    from rosglass.comm.service_client import ServiceClient
    from rosglass.comm.service_server import Answer, ServiceServer
    from rosglass.comm.statistics import Statistics
    from rosglass.comm.subscription import Subscription
    from rosglass.comm.time import Duration, Time
    from rosglass.comm.timers import Timers, Worker
    from rosglass.comm.wire import Call

__all__ = [
    "BEST_AVAILABLE",
    "IMMEDIATE",
    "INBOX_LIMIT",
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
    "DeadlineMissed",
    "Dispatcher",
    "Durability",
    "Duration",
    "EndpointInfo",
    "EndpointKind",
    "Executor",
    "GoalStatus",
    "Handle",
    "History",
    "IncompatibleQoS",
    "Jump",
    "LifecycleClient",
    "Listeners",
    "Liveliness",
    "LivelinessChanged",
    "LivelinessLost",
    "LoopExecutor",
    "Matched",
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
    "SamplesLost",
    "ServerGoal",
    "ServiceClient",
    "ServiceServer",
    "SetResult",
    "State",
    "Statistics",
    "Status",
    "Subscription",
    "Time",
    "Timer",
    "Timers",
    "Transition",
    "TransitionEvent",
    "Worker",
    "anonymous_name",
    "executor_for",
]

_HOMES = {
    "names": ("anonymous_name",),
    "action_client": (
        "ActionClient",
        "ActionResult",
        "CancelAnswer",
        "ClientGoal",
        "GoalStatus",
    ),
    "action_server": (
        "ActionServer",
        "ServerGoal",
    ),
    "clock": (
        "Clock",
        "ClockChange",
        "Jump",
        "Timer",
    ),
    "events": (
        "DeadlineMissed",
        "IncompatibleQoS",
        "LivelinessChanged",
        "LivelinessLost",
        "Matched",
        "SamplesLost",
    ),
    "executor": (
        "Dispatcher",
        "IMMEDIATE",
        "LoopExecutor",
        "executor_for",
    ),
    "graph": (
        "ConnectionState",
        "EndpointInfo",
        "EndpointKind",
        "NodeName",
        "Status",
    ),
    "inbox": (
        "INBOX_LIMIT",
        "Sample",
    ),
    "lifecycle": (
        "LifecycleClient",
        "State",
        "Transition",
        "TransitionEvent",
    ),
    "listeners": ("Listeners",),
    "handle": (
        "Executor",
        "Handle",
    ),
    "node": ("Node",),
    "parameters": (
        "ParameterClient",
        "ParameterDescriptor",
        "ParameterEvent",
        "Parameters",
        "ParameterType",
        "ParameterValue",
        "Range",
        "SetResult",
    ),
    "promise": ("Promise",),
    "publisher": ("Publisher",),
    "qos": (
        "BEST_AVAILABLE",
        "Durability",
        "History",
        "Liveliness",
        "QoS",
        "Reliability",
    ),
    "service_client": ("ServiceClient",),
    "service_server": (
        "Answer",
        "ServiceServer",
    ),
    "statistics": ("Statistics",),
    "subscription": ("Subscription",),
    "time": (
        "Duration",
        "Time",
    ),
    "timers": (
        "Timers",
        "Worker",
    ),
    "wire": ("Call",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    # Imported on first use: a user interface needs few of them before its first frame.
    if name not in _HOME_OF:
        raise AttributeError(f"module 'rosglass.comm' has no attribute {name!r}")
    value: object = getattr(import_module(f"rosglass.comm.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)

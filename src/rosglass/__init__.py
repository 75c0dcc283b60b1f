"""Operator screens for ROS robots, in QML and Python.

Connects to ROS 1 and ROS 2 without ROS installed, with any message type. Start with
:func:`connect` and :func:`load`, or with ``rosglass --help``.
"""

from __future__ import annotations

# No imports before the command can handle Ctrl-C; type checkers know this name.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from rosglass import bags as bags
    from rosglass import images as images
    from rosglass import tf as tf
    from rosglass.comm import Duration, Node, QoS, Time
    from rosglass.connection import connect
    from rosglass.errors import (
        ArgumentError,
        BagError,
        BoundError,
        ConnectionLostError,
        ConnectivityException,
        ConversionError,
        CyclicTypeError,
        DecodeError,
        DefinitionConflictError,
        DefinitionError,
        Error,
        ExtrapolationException,
        FieldPathError,
        GoalRejectedError,
        InvalidArgumentException,
        InvalidNameError,
        LookupException,
        MasterError,
        NodeClosedError,
        NoPictureError,
        ParameterError,
        QmlError,
        QmlSyntaxError,
        RosArgumentError,
        ServiceError,
        ServiceUnavailableError,
        TimeoutError,  # noqa: A004 - also a builtin TimeoutError
        TimeoutException,
        TransformException,
        TransitionError,
        TypeNotFoundError,
        UnsupportedError,
    )
    from rosglass.interfaces import Library
    from rosglass.messages import ActionType, Message, MessageType, ServiceType, load

__version__ = "0.1.0"

__all__ = [
    "ActionType",
    "ArgumentError",
    "BagError",
    "BoundError",
    "ConnectionLostError",
    "ConnectivityException",
    "ConversionError",
    "CyclicTypeError",
    "DecodeError",
    "DefinitionConflictError",
    "DefinitionError",
    "Duration",
    "Error",
    "ExtrapolationException",
    "FieldPathError",
    "GoalRejectedError",
    "InvalidArgumentException",
    "InvalidNameError",
    "Library",
    "LookupException",
    "MasterError",
    "Message",
    "MessageType",
    "NoPictureError",
    "Node",
    "NodeClosedError",
    "ParameterError",
    "QmlError",
    "QmlSyntaxError",
    "QoS",
    "RosArgumentError",
    "ServiceError",
    "ServiceType",
    "ServiceUnavailableError",
    "Time",
    "TimeoutError",
    "TimeoutException",
    "TransformException",
    "TransitionError",
    "TypeNotFoundError",
    "UnsupportedError",
    "__version__",
    "connect",
    "load",
]

_HOMES = {
    "rosglass.comm": ("Duration", "Node", "QoS", "Time"),
    "rosglass.connection": ("connect",),
    "rosglass.interfaces": ("Library",),
    "rosglass.messages": ("ActionType", "Message", "MessageType", "ServiceType", "load"),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}


#: Also available as attributes: `rosglass.comm.IMMEDIATE`.
_PACKAGES = (
    "bags",
    "bridge",
    "cockpit",
    "comm",
    "connection",
    "controls",
    "demo",
    "errors",
    "interfaces",
    "images",
    "messages",
    "qml",
    "qt",
    "ros1",
    "ros2",
    "rviz",
    "scene",
    "tf",
    "wires",
)


def __getattr__(name: str) -> object:
    # Imported on first use, so that `import rosglass` and `rosglass --help` stay fast.
    from importlib import import_module  # noqa: PLC0415

    if name in _PACKAGES:
        return import_module(f"rosglass.{name}")
    module = _HOME_OF.get(name, "rosglass.errors" if name in __all__ else "")
    if not module:
        text = f"module 'rosglass' has no attribute {name!r}"
        instead = import_module("rosglass.comm.rclpy_names").hint_at_function(name)
        if instead:
            raise AttributeError(f"{text}: use {instead}")
        raise AttributeError(text, name=name, obj=import_module(__name__))
    value: object = getattr(import_module(module), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)

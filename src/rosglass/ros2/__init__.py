"""ROS 2's protocols above a wire: topics, services, actions, parameters, types.

Import from the modules: those of :mod:`rosglass.wires.zenoh` import the ``eclipse-zenoh`` package,
those of :mod:`rosglass.wires.dds` ``cyclonedds``, the others neither.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosglass.comm.graph import Graph
    from rosglass.comm.wire import Middleware, Writer
    from rosglass.ros2.node import Ros2Node

__all__ = ["Graph", "Middleware", "Ros2Node", "Writer"]

_HOME_OF = {
    "Graph": "rosglass.comm.graph",
    "Middleware": "rosglass.comm.wire",
    "Ros2Node": "rosglass.ros2.node",
    "Writer": "rosglass.comm.wire",
}


def __getattr__(name: str) -> object:
    # Imported on first use: checking a name must not wait for the node's imports.
    if name not in _HOME_OF:
        raise AttributeError(f"module 'rosglass.ros2' has no attribute {name!r}")
    value: object = getattr(import_module(_HOME_OF[name]), name)
    globals()[name] = value
    return value

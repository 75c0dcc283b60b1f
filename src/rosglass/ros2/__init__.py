"""ROS 2 on the wire: names, the graph, topics, over one small middleware seam.

Import what you need from the modules: those of :mod:`rosglass.ros2.zenoh` bring in the
``eclipse-zenoh`` package, those of :mod:`rosglass.ros2.dds` ``cyclonedds``, the others neither.
"""

from rosglass.ros2.graph import Graph
from rosglass.ros2.middleware import Middleware, Writer
from rosglass.ros2.node import Ros2Node

__all__ = ["Graph", "Middleware", "Ros2Node", "Writer"]

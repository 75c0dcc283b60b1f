"""ROS 2 on the wire: names, the graph, topics, over one small middleware seam.

Import what you need from the modules: :mod:`rosglass.ros2.zenoh` brings in the ``eclipse-zenoh``
package, the others do not.
"""

from rosglass.ros2.graph import Graph
from rosglass.ros2.middleware import Middleware, Writer
from rosglass.ros2.node import Ros2Node

__all__ = ["Graph", "Middleware", "Ros2Node", "Writer"]

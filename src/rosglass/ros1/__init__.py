"""ROS 1 on the wire: the master's and the nodes' XML-RPC APIs, TCPROS, actionlib.

Nothing of ROS is needed on this machine. Import what you need from the modules.
"""

from rosglass.ros1.node import Ros1Node

__all__ = ["Ros1Node"]

"""ROS 1 on the wire: the master's and the nodes' XML-RPC APIs, TCPROS, actionlib.

Nothing of ROS is needed on this machine. Import what you need from the modules.
"""

from rosglass.ros1.actionlib import CommState, TerminalState
from rosglass.ros1.node import Ros1Node
from rosglass.ros1.parameter_server import ParameterServer, ParameterSubscription

__all__ = ["CommState", "ParameterServer", "ParameterSubscription", "Ros1Node", "TerminalState"]

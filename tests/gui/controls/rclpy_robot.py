"""Run by rclpy's Python: a node ``/arm`` with parameters, two services and an action.

It refuses speeds above 1 by a callback; ``/silent`` never answers; others do not know the type of
``/count``. Ends when its input ends.
"""

import sys
import threading

import rclpy
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.action import ActionServer
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger
from test_msgs.action import Fibonacci


def main():
    rclpy.init()
    node, group = Node("arm"), ReentrantCallbackGroup()
    over = threading.Event()
    allowed = FloatingPointRange(from_value=0.0, to_value=2.0, step=0.25)
    node.declare_parameter(
        "speed", 0.5, ParameterDescriptor(description="m/s", floating_point_range=[allowed])
    )
    node.declare_parameter("serial", "A-7", ParameterDescriptor(read_only=True))
    node.declare_parameter("gains", [1.0, 2.0])
    node.declare_parameter(
        "mode", "slow", ParameterDescriptor(additional_constraints="One of: slow, fast")
    )

    def check(parameters):
        fast = any(one.name == "speed" and one.value > 1 for one in parameters)
        return SetParametersResult(successful=not fast, reason="too fast" if fast else "")

    node.add_on_set_parameters_callback(check)

    def silent(_, response):
        over.wait(60)
        return response

    def lamp(request, response):
        response.success, response.message = request.data, "<b>as you say</b>"
        return response

    node.create_service(Trigger, "silent", silent, callback_group=group)
    node.create_service(SetBool, "lamp", lamp, callback_group=group)

    ActionServer(node, Fibonacci, "count", lambda goal: Fibonacci.Result(), callback_group=group)
    executor = MultiThreadedExecutor(4)
    executor.add_node(node)
    spinning = threading.Thread(target=executor.spin, daemon=True)
    spinning.start()
    sys.stdin.read()
    over.set()


main()

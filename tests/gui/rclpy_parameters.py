"""Run by rclpy's Python: a robot that declares its parameter a while after its services answer.

Arguments: the parameter's value, and its greatest one. Reads lines: ``declare``, ``end``.
"""

import sys
import threading

import rclpy
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node


def main(value, highest):
    rclpy.init()
    node = Node("robot")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinning = threading.Thread(target=executor.spin)
    spinning.start()
    print("ready", flush=True)
    for line in sys.stdin:
        if line.strip() != "declare":
            break
        allowed = FloatingPointRange(from_value=0.0, to_value=highest)
        described = ParameterDescriptor(description="m/s", floating_point_range=[allowed])
        node.declare_parameter("max_speed", value, described)
        print("declared", flush=True)
    executor.shutdown()
    spinning.join()
    node.destroy_node()
    rclpy.shutdown()


main(*map(float, sys.argv[1:]))

"""Run by rclpy's Python: a lifecycle node ``/lidar``, whose first activation fails.

A node ``/navigation`` publishes ``/cmd_vel``, and has the service ``/halt``. Ends with its input.
"""

import sys
import threading

import rclpy
from geometry_msgs.msg import Twist
from rclpy.executors import MultiThreadedExecutor
from rclpy.lifecycle import Node, TransitionCallbackReturn
from std_srvs.srv import SetBool


class Lidar(Node):
    attempts = 0

    def on_configure(self, state):
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        self.attempts += 1
        failed = self.attempts == 1
        return TransitionCallbackReturn.FAILURE if failed else TransitionCallbackReturn.SUCCESS


def main():
    rclpy.init()
    lidar, navigation = Lidar("lidar"), rclpy.create_node("navigation")
    keep = navigation.create_publisher(Twist, "/cmd_vel", 1)
    sink = navigation.create_subscription(Twist, "/cmd_vel", lambda _: None, 1)

    def halt(request, response):
        response.success, response.message = True, ""
        return response

    navigation.create_service(SetBool, "halt", halt)
    executor = MultiThreadedExecutor(2)
    for node in (lidar, navigation):
        executor.add_node(node)
    threading.Thread(target=executor.spin, daemon=True).start()
    sys.stdin.read()
    del keep, sink
    rclpy.shutdown()


main()

"""A lifecycle node of rclpy: ``rclpy_lifecycle.py NAME``; activating it fails at first."""

from __future__ import annotations

import sys

import rclpy
from rclpy.lifecycle import Node, TransitionCallbackReturn


class Camera(Node):
    """Its hardware is missing at the first attempt to activate it."""

    attempts = 0

    def on_activate(self, state):
        self.attempts += 1
        if self.attempts == 1:
            return TransitionCallbackReturn.FAILURE
        return super().on_activate(state)


rclpy.init()
node = Camera(sys.argv[1])
print("ready", flush=True)
rclpy.spin(node)

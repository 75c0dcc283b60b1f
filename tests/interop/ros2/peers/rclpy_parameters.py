"""Prints as JSON what a node of rclpy reads out of a parameter file: its only argument."""

import json
import sys

import rclpy
from rclpy.node import Node

rclpy.init(args=["--ros-args", "--params-file", sys.argv[1]])
node = Node(
    "arm",
    automatically_declare_parameters_from_overrides=True,
    start_parameter_services=False,
    enable_rosout=False,
)
found = {name: value.value for name, value in node._parameter_overrides.items()}
print(json.dumps({name: list(v) if hasattr(v, "tolist") else v for name, v in found.items()}))

"""A node of rclpy with a parameter of each kind; prints its members, then what is set, as JSON."""

import json

import rclpy
import rclpy.node
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("robot")
    for name, value in (
        ("gain", 1.5), ("gains", [1.5, 2.5]), ("label", "a"), ("count", 3), ("on", True)
    ):  # fmt: skip
        node.declare_parameter(name, value)
    node.declare_parameter("any", 1.5, ParameterDescriptor(dynamic_typing=True))

    def on_set(parameters: list) -> SetParametersResult:
        for parameter in parameters:
            print(json.dumps([parameter.name, parameter.value], default=list), flush=True)
        return SetParametersResult(successful=True)

    members = [name for name in dir(rclpy.node.Node) if not name.startswith("_")]
    print(json.dumps(members), flush=True)
    node.add_on_set_parameters_callback(on_set)
    rclpy.spin(node)


main()

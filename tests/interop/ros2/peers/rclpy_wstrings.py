"""A node of rclpy that prints each WStrings it gets on /asked, and publishes it on /answered."""

import json

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from test_msgs.msg import WStrings

# Nothing is lost, in whatever order the nodes find each other.
KEPT = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("wstrings")
    publisher = node.create_publisher(WStrings, "/answered", KEPT)

    def on_message(message: WStrings) -> None:
        texts = [message.wstring_value, *message.unbounded_sequence_of_wstrings]
        print(json.dumps(texts), flush=True)
        publisher.publish(message)

    node.create_subscription(WStrings, "/asked", on_message, KEPT)
    rclpy.spin(node)


main()

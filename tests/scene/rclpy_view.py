"""A robot's program with rclpy: prints the type of a service, then what a latched topic says."""

import json
import sys

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

service, topic = sys.argv[1:]
rclpy.init()
node = rclpy.create_node("robot_with_rclpy")
while not (types := dict(node.get_service_names_and_types()).get(service)):
    rclpy.spin_once(node, timeout_sec=0.1)
print(json.dumps(types), flush=True)
node.create_subscription(
    String,
    topic,
    lambda message: print(json.dumps(message.data), flush=True),
    QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL),
)
rclpy.spin(node)

"""New rclpy clients, one after the other, that call once as soon as they find their server.

`rclpy_clients.py SERVICE COUNT`, with the Python of .venv-rclpy. All belong to one node, as a
program's do. Each prints a line: `answered`, `lost` (no answer within 8 s), or `unready`.
"""

import sys

import rclpy
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node("caller")
for _ in range(int(sys.argv[2])):
    client = node.create_client(Trigger, sys.argv[1])
    if client.wait_for_service(20):
        future = client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(node, future, timeout_sec=8)
        print("answered" if future.done() else "lost", flush=True)
    else:
        print("unready", flush=True)
    node.destroy_client(client)

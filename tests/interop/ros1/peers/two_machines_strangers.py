"""A master and nodes on one machine, and a stranger on another one of the network.

``two_machines_strangers.py HOME``, to be run as root of a network namespace. The first node
announces the loopback interface, as nodes do without ROS_IP where there is no route elsewhere; the
second one an address of the network. Prints what the stranger could do to each of them.
"""

from __future__ import annotations

import json
import socket
import sys
from pathlib import Path
from urllib.parse import urlsplit

from inside import core_of
from rosmaster import RosMaster
from two_machines import HERE, THERE, Cable
from waiting import eventually

import rosglass

#: Calls a port of the operator's machine, and prints whether it could.
KNOCK = f"""
import socket, sys
try:
    socket.create_connection(({HERE!r}, int(sys.argv[1])), 5).close()
    print("open", flush=True)
except ConnectionRefusedError:
    print("closed", flush=True)
"""
#: A publisher that is registered nowhere, and lists itself: prints who asks for its topic.
FORGE = f"""
import sys, threading, xmlrpc.client, xmlrpc.server
server = xmlrpc.server.SimpleXMLRPCServer(({THERE!r}, 4000), logRequests=False)
def request_topic(*arguments):
    print("asked", flush=True)
    return [0, "", 0]
server.register_function(request_topic, "requestTopic")
threading.Thread(target=server.serve_forever, daemon=True).start()
node = xmlrpc.client.ServerProxy(sys.argv[1])
for _ in range(40):
    node.publisherUpdate("/master", "/emergency_stop/state", ["http://{THERE}:4000/"])
print("forged", flush=True)
threading.Event().wait()
"""

seen: dict[str, object] = {}
with Cable() as cable, RosMaster(Path(sys.argv[1])) as master:
    url = f"ros1://127.0.0.1:{master.port}"

    def ports(node: rosglass.Node) -> list[int]:
        """Return the ports of a node's API and of its topics."""
        api = urlsplit(master.call("lookupNode", f"/{node.name}"))
        return [int(api.port or 0), int(core_of(node).address[1])]

    with rosglass.connect(url, "own", own_services=False) as own:
        own.create_publisher("/cmd_vel", "geometry_msgs/Twist")
        eventually(lambda: own.publishers("/cmd_vel"))
        seen["announced"] = own.address
        seen["knocks"] = [
            cable.start(sys.executable, "-c", KNOCK, str(port)).communicate()[0].decode().strip()
            for port in ports(own)
        ]
        for port in ports(own):
            socket.create_connection(("127.0.0.1", port), 5).close()

    with rosglass.connect(f"{url}?ip={HERE}", "cockpit", own_services=False) as cockpit:
        state = cockpit.create_subscription("/emergency_stop/state", "std_msgs/Bool")
        eventually(lambda: cockpit.subscriptions("/emergency_stop/state"))
        api = master.call("lookupNode", "/cockpit")
        stranger = cable.start(sys.executable, "-c", FORGE, api, ready="forged")
        # A later update, which is the master's.
        robot = cockpit.create_publisher("/emergency_stop/state", "std_msgs/Bool")
        eventually(lambda: state.publisher_count() == 1, lambda: state.problem)
        seen["problem"] = state.problem
        robot.publish(data=True)
        state.wait(30)
        stranger.kill()
        seen["asked"] = stranger.communicate()[0].decode().split()
print(json.dumps(seen))

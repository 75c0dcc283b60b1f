"""A robot with roscore and rospy, and an operator on another machine.

``two_machines_ros1.py teleop|command|idle SECONDS HOME``, to be run as root of a network namespace,
which is the operator's. The cable is unplugged for so long, while the operator drives, by a profile
for commands or another, or says nothing.
Then the operator sends a stop. Prints what the robot received, and what the operator saw.
"""

from __future__ import annotations

import json
import sys
import time
import xmlrpc.client
from contextlib import suppress
from pathlib import Path

from two_machines import THERE, Cable
from waiting import eventually

import rosglass
from rosglass.comm import IMMEDIATE
from rosglass.wires.tcpros import connection

MASTER, PORT = f"http://{THERE}:11311", "11311"
ROBOT = """
import sys, time, rospy, std_msgs.msg, geometry_msgs.msg, std_srvs.srv
rospy.init_node("robot")
log = open(sys.argv[1], "w", buffering=1)
def drive(message):
    log.write("%f %f\\n" % (time.time(), message.linear.x))
rospy.Subscriber("/cmd_vel", geometry_msgs.msg.Twist, drive)
rospy.Service("/stop", std_srvs.srv.SetBool, lambda r: std_srvs.srv.SetBoolResponse(r.data, ""))
words = rospy.Publisher("/word", std_msgs.msg.String, queue_size=10)
rate = rospy.Rate(50)
while not rospy.is_shutdown():
    words.publish("here")
    rate.sleep()
"""


def answers() -> bool:
    """Return whether the master answers."""
    with suppress(OSError), xmlrpc.client.ServerProxy(MASTER) as master:
        return bool(master.getPid("/test"))
    return False


what, seconds, home = sys.argv[1], float(sys.argv[2]), Path(sys.argv[3])
env = {
    "PATH": "/usr/bin:/bin", "HOME": str(home), "ROS_HOME": str(home), "LANG": "C.UTF-8",
    "ROS_LOG_DIR": str(home / "log"), "ROS_MASTER_URI": MASTER, "ROS_IP": THERE,
}  # fmt: skip
got = home / "got"
got.touch()


def commands(since: float) -> list[tuple[float, float]]:
    """Return when the robot got which commands."""
    lines = [line.split() for line in got.read_text().splitlines(keepends=True) if line[-1] == "\n"]
    return [(float(at), float(x)) for at, x in lines if float(at) > since]


# A connection on which nothing is said for 3 s would be given up, rather than for 14 s.
connection._KEEPALIVE = (("TCP_KEEPIDLE", 1), ("TCP_KEEPINTVL", 1), ("TCP_KEEPCNT", 2))

with Cable() as cable:
    cable.start("/usr/bin/rosmaster", "--core", "-p", PORT, env=env)
    eventually(answers)
    cable.start("/usr/bin/python3", "-c", ROBOT, str(got), env=env)
    node = rosglass.connect(f"ros1://{THERE}:{PORT}", "operator", own_services=False)
    states: list[str] = []
    node.on_status_change(lambda status: states.append(status.state.name), IMMEDIATE)
    words = node.create_subscription("/word")
    client = node.create_service_client("/stop")
    qos = rosglass.QoS.command() if what == "command" else rosglass.QoS(1)
    publisher = node.create_publisher("/cmd_vel", "geometry_msgs/Twist", qos)

    def drive(until: float, speed: float) -> int:
        """Publish 20 times a second; return how often."""
        count = 0
        while time.monotonic() < until:
            publisher.publish(linear={"x": speed})
            count += 1
            time.sleep(0.05)
        return count

    eventually(lambda: publisher.subscription_count() and client.ready and words.take())
    drive(time.monotonic() + 0.5, 1.0)
    eventually(lambda: commands(0.0))
    states.clear()
    cable.unplug()
    cut = time.monotonic()
    sent = drive(cut + seconds, 2.0) if what != "idle" else 0
    time.sleep(max(0.0, cut + seconds - time.monotonic()))
    count = publisher.subscription_count()
    back = time.time()
    if what == "teleop":
        publisher.publish(linear={"x": 0.0})
    cable.plug()
    if what == "idle":
        publisher.publish(linear={"x": 0.0})

    def is_stopped() -> bool:
        """Return whether the robot got the stop; a command is repeated until then."""
        if what == "command":
            publisher.publish(linear={"x": 0.0})
        return any(x == 0.0 for _, x in commands(back))

    eventually(is_stopped)
    late = commands(back)
    eventually(lambda: node.status().state.name == "CONNECTED" and client.ready)
    while words.take() is not None:
        pass
    fresh = words.wait(20) is not None
    print(
        json.dumps(
            {
                "sent": sent,
                "old": sum(x == 2.0 for _, x in late),
                "dropped": publisher.dropped,
                "stopped": next(at for at, x in late if x == 0.0) - back,
                "last": late[-1][1],
                "subscribers": count,
                "states": states,
                "fresh": fresh,
                "call": client.call({"data": True}, timeout=10).success,
                "problems": [words.problem, client.problem],
            }
        )
    )
    node.close()

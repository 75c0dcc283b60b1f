"""The rospy side of benchmarks/ros1_services.py, run by the distribution's own Python.

rospy_services.py serve: offer /rospy until standard input closes.
rospy_services.py call: for each line "SERVICE each|persistent COUNT PAUSE", print the times that
so many calls took, in microseconds.
"""

import json
import sys
import time

import rospy
from std_srvs.srv import SetBool, SetBoolResponse


def main():
    """Do it."""
    role = sys.argv[1]
    rospy.init_node(f"rospy_{role}", disable_signals=True)
    if role == "serve":
        service = rospy.Service(
            "/rospy", SetBool, lambda request: SetBoolResponse(request.data, "ok")
        )
        print("ready", flush=True)
        sys.stdin.read()
        service.shutdown()
        return
    proxies = {}
    print("ready", flush=True)
    for line in sys.stdin:
        name, how, count, pause = line.split()
        if (name, how) not in proxies:
            rospy.wait_for_service(name)
            proxies[name, how] = rospy.ServiceProxy(name, SetBool, persistent=how == "persistent")
        call, taken = proxies[name, how], []
        for _ in range(int(count)):
            begun = time.perf_counter()
            call(True)
            taken.append((time.perf_counter() - begun) * 1e6)
            time.sleep(float(pause))
        print(json.dumps(taken), flush=True)


main()

"""Types that only a rospy node has."""

from __future__ import annotations

from waiting import eventually

import rosglass
from rosglass.interfaces import Library

STATE = "my_robot/State"
TEXT = f"""# How it does.
uint8 IDLE=0
uint8 state
my_robot/Part part
{"=" * 80}
MSG: my_robot/Part
int8 a
"""


def test_a_type_that_only_rospy_has_is_fetched(connect, start_rospy):
    peer = start_rospy("owner")
    value = {"state": 2, "part": {"a": -1}}
    md5 = peer.call("publish_own", topic="/state", type=STATE, text=TEXT, value=value, latch=True)
    node = connect("reader", library=Library())
    found = node.fetch_type(STATE, timeout=30)
    assert (found.name, found.md5) == ("my_robot/msg/State", md5)
    assert found.definition.text.startswith("# How it does.")
    assert node.fetch_type("my_robot/msg/State", hash=md5, node="/owner") == found
    eventually(lambda: peer.call("connections", topic="/state") == 0)
    (end,) = node.ask_publishers("/state", 30)
    assert (end.type_hash, end.qos) == (md5, rosglass.QoS.latched())
    assert node.create_subscription("/state", STATE).wait(30).message().part.a == -1


def test_an_action_and_a_service_of_rospy_are_fetched(connect, start_rospy):
    peer = start_rospy("server")
    peer.call("action_server", name="/work")
    peer.call("serve", service="/work/reset", type="std_srvs/Trigger")
    node = connect("asking")
    action = node.fetch_type("actionlib/Test", timeout=30)
    assert action.name == "actionlib/action/Test"
    assert action.md5 == rosglass.load("actionlib/action/Test", ros=1).md5
    service = node.fetch_type("std_srvs/Trigger", node="/server", timeout=30)
    assert service == rosglass.load("std_srvs/srv/Trigger", ros=1)

"""Bridges that together form a ring: what goes round must come to a stop."""

from __future__ import annotations

import os
import sys

import pytest
from waiting import eventually, nothing_happens

from rosglass.bridge import Bridge
from rosglass.comm import QoS
from rosglass.errors import InvalidNameError

STRING = "std_msgs/msg/String"
MANY = QoS(depth=1000)


def problems(*bridges):
    return [one.problem for bridge in bridges for one in bridge.status().relays if one.problem]


def test_three_worlds_in_a_ring(bridge, connect, start_master):
    """A message gets everywhere, nowhere twice, and a service is not kept alive by itself."""
    third = start_master().url
    rules = (["/ring->"], ["/ask->"])
    back = (["/ring<-"], ["/ask<-"])
    # From the first master to the router, to the third network, and back to the first.
    first = connect("ros1", "first").url
    made = [
        bridge(*rules),
        bridge(*back, urls=(third, "")),
        bridge(*rules, urls=(third, first)),
    ]
    one, two = connect("ros1", "one"), connect("ros2", "two")
    three = connect("ros1", "three", third)
    ears = [node.create_subscription("/ring", STRING, qos=MANY) for node in (one, two, three)]
    server = one.create_service_server("/ask", "std_srvs/Trigger", lambda _: {"message": "yes"})
    talker = one.create_publisher("/ring", STRING, MANY)

    def arrives():
        talker.publish(data="hello?")
        return ears[2].wait(0.1)

    eventually(arrives)
    eventually(lambda: sum("form a ring" in problem for problem in problems(*made)) == 2,
             what=lambda: str([one.status() for one in made]))  # fmt: skip
    talker.publish(data="begin")
    for ear in ears:
        while ear.wait(30).message().data != "begin":
            pass
    for number in range(20):
        talker.publish(data=str(number))
    for ear in ears:
        found = [ear.wait(30).message().data for _ in range(20)]
        assert found == [str(number) for number in range(20)]
        assert ear.wait(0.7) is None
    client = three.create_service_client("/ask", "std_srvs/Trigger")
    assert client.call(timeout=30).message == "yes"
    server.close()
    eventually(lambda: not any(node.service_servers("/ask") for node in (one, two, three)))


def test_two_commands_there_and_back(master, router, connect, start_program):
    """Two bridges between the same networks, one each way, whatever they are called."""
    url = master.url
    command = (sys.executable, "-m", "rosglass.cli", "bridge", "--topic", "/circle->")
    for name, urls in (("there", (url, router.url)), ("back", (router.url, url))):
        start_program(*command, "--node-name", name, *urls, env=dict(os.environ))
    one, two = connect("ros1", "one"), connect("ros2", "two")
    ears = [node.create_subscription("/circle", STRING, qos=MANY) for node in (one, two)]
    talkers = [node.create_publisher("/circle", STRING, MANY) for node in (one, two)]
    for number in (0, 1):

        def crosses(number=number):
            talkers[number].publish(data="hello?")
            sample = ears[1 - number].wait(0.1)
            return sample is not None

        eventually(crosses)
    eventually(lambda: all(talker.subscription_count() == 2 for talker in talkers))
    nothing_happens(1)  # what is on its way, and what goes round until the bridges know each other
    for ear in ears:
        while ear.wait(0.0) is not None:
            pass
    for number in range(20):
        talkers[number % 2].publish(data=str(number))
    for ear in ears:
        found = [ear.wait(30).message().data for _ in range(20)]
        assert sorted(found, key=int) == [str(number) for number in range(20)]
        assert ear.wait(0.7) is None


def test_a_bridge_has_one_name(connect):
    with pytest.raises(InvalidNameError, match="these are left and right"):
        Bridge(connect("ros1", "left"), connect("ros2", "right"), ["*"])

"""A master that is killed, comes late, hangs or forgets; and nodes that take each other's name."""

from __future__ import annotations

import logging
import os
import signal
import threading
import time
from operator import le

import pytest
from usage import open_files
from waiting import eventually

import rosglass
from rosglass.comm import ConnectionState

#: An address that no machine has (TEST-NET-1).
NOWHERE = "192.0.2.1"


@pytest.fixture
def own_master(start_master):
    """A master that a test may kill."""
    return start_master()


def registered(master, topic):
    """Return who publishes and who subscribes to a topic, as the master has it."""
    publishers, subscribers, _ = master.call("getSystemState")
    return dict(publishers).get(topic, []), dict(subscribers).get(topic, [])


def test_restarted_master_lists_us_again_and_messages_go_on_until_then(
    own_master, connect, start_rospy
):
    peer = start_rospy("peer", master=own_master)
    node = connect("panel", url=own_master.url)
    commands = node.create_publisher("/commands", "std_msgs/Int32")
    words = node.create_subscription("/words")
    node.create_service_server("/reset", "std_srvs/Empty", lambda _: None)
    peer.call("subscribe", topic="/commands", type="std_msgs/Int32", reports=False)
    peer.call("publish", topic="/words", type="std_msgs/String", value={"data": "w"}, rate=50,
              count=0)  # fmt: skip
    eventually(commands.subscription_count)
    words.wait(30)
    joined = []
    words.on_matched(joined.append)

    def go_on(count):
        """See that messages arrive both ways."""
        before = peer.call("count", topic="/commands")
        for number in range(count):
            commands.publish(data=number)
        eventually(lambda: peer.call("count", topic="/commands") == before + count)
        while words.take() is not None:
            pass
        words.wait(30)

    go_on(3)
    own_master.kill()
    eventually(lambda: node.status().state is ConnectionState.LOST)
    assert "does not answer" in node.status().detail
    go_on(3)
    own_master.start()
    eventually(lambda: registered(own_master, "/commands")[0] == ["/panel"])
    eventually(lambda: registered(own_master, "/words")[1] == ["/panel"])
    eventually(lambda: dict(own_master.call("getSystemState")[2]).get("/reset") == ["/panel"])
    eventually(lambda: node.status().state is ConnectionState.CONNECTED)
    go_on(3)
    # rospy does not register again: its connections are the ones from before.
    assert registered(own_master, "/words")[0] == []
    assert commands.subscription_count() == words.publisher_count() == 1
    assert [event.change for event in joined] == [1]
    assert words.problem == ""

    # New nodes are found by both sides.
    late = connect("late", url=own_master.url)
    late.create_publisher("/words", "std_msgs/String")
    receiver = late.create_subscription("/commands")
    eventually(lambda: words.publisher_count() == 2)
    eventually(lambda: commands.subscription_count() == 2)
    commands.publish(data=7)
    assert receiver.wait(30).message().data == 7


def test_a_master_that_starts_late_is_found(own_master, connect, tool):
    own_master.kill()
    node = connect("early", url=own_master.url, wait=False)
    statuses = []
    node.on_status_change(statuses.append)
    publisher = node.create_publisher("/early", "std_msgs/Empty")
    subscription = node.create_subscription("/early")
    eventually(lambda: "Connection refused" in node.status().detail)
    assert node.status().state is ConnectionState.CONNECTING
    own_master.start()
    eventually(lambda: statuses and statuses[-1].state is ConnectionState.CONNECTED)
    eventually(publisher.subscription_count)
    publisher.publish()
    subscription.wait(30)


def test_a_master_that_hangs_holds_up_neither_topics_nor_closing(own_master, connect):
    one, two = connect("one", url=own_master.url), connect("two", url=own_master.url)
    publisher = one.create_publisher("/count", "std_msgs/Int32")
    subscription = two.create_subscription("/count")
    eventually(publisher.subscription_count)
    pid = own_master.pid
    os.kill(pid, signal.SIGSTOP)
    try:
        publisher.publish(data=1)
        assert subscription.wait(30).message().data == 1
        left = []
        publisher.on_matched(left.append)
        subscription.close()  # its connection ends at once, whatever the master does
        eventually(lambda: [event.change for event in left] == [1, -1])
        eventually(lambda: one.status().state is ConnectionState.LOST)
        assert "no answer in time" in one.status().detail
        new = connect("three", url=own_master.url, wait=False)
        for node in (new, two, one):
            began = time.monotonic()
            node.close()
            assert time.monotonic() - began < 4
            assert node.status().state is ConnectionState.CLOSED
    finally:
        os.kill(pid, signal.SIGCONT)
    # Once it answers again, it learns that the node has left.
    eventually(lambda: registered(own_master, "/count") == ([], []), timeout=30)


def test_closing_while_connecting_leaves_nothing_behind(own_master, connect):
    for delay in [0.0, 0.001, 0.002, 0.003, 0.005, 0.01, 0.02, 0.03] * 4:
        node = connect("hasty", url=own_master.url, wait=False)
        node.create_publisher("/hasty", "std_msgs/Empty")
        node.create_subscription("/hasty")
        node.create_service_server("/hasty/reset", "std_srvs/Empty", lambda _: None)
        threading.Event().wait(delay)
        node.close()
    assert [part for part in own_master.call("getSystemState") if part] == []


def test_many_nodes_come_and_go_without_a_trace(own_master, connect):
    def cycle():
        node = rosglass.connect(own_master.url, "brief")
        publisher = node.create_publisher("/brief", "std_msgs/Empty")
        subscription = node.create_subscription("/brief")
        if publisher.subscription_count() == 0:
            subscription.close()
        node.close()

    def traces():
        return threading.active_count(), open_files()

    for _ in range(5):
        cycle()
    before = traces()
    for _ in range(300):
        cycle()
    eventually(lambda: all(map(le, traces(), before)), what=lambda: f"{before} became {traces()}")
    assert [part for part in own_master.call("getSystemState") if part] == []


def test_registration_that_the_master_lost_is_renewed(own_master, connect):
    node = connect("panel", url=own_master.url)
    node.create_publisher("/one", "std_msgs/Empty")
    node.create_publisher("/two", "std_msgs/Empty")
    node.create_subscription("/three", "std_msgs/Empty")
    eventually(lambda: registered(own_master, "/three")[1])
    # As `rosnode cleanup` does when a node seems to be gone for a moment.
    api = own_master.call("lookupNode", "/panel")
    own_master.call("unregisterPublisher", "/one", api, caller="/panel")
    own_master.call("unregisterSubscriber", "/three", api, caller="/panel")
    eventually(lambda: registered(own_master, "/one")[0] == ["/panel"])
    eventually(lambda: registered(own_master, "/three")[1] == ["/panel"])
    assert registered(own_master, "/two")[0] == ["/panel"]


def test_publishers_are_found_though_the_master_cannot_call_us(own_master, connect):
    # Nothing leads to that address: calls of the master's get lost.
    node = connect("behind_a_firewall", url=f"ros1://127.0.0.1:{own_master.port}?ip={NOWHERE}")
    subscription = node.create_subscription("/talk")
    eventually(lambda: registered(own_master, "/talk")[1])
    talker = connect("talker", url=own_master.url)
    publisher = talker.create_publisher("/talk", "std_msgs/Int32")
    eventually(publisher.subscription_count)
    publisher.publish(data=3)
    assert subscription.wait(30).message().data == 3


@pytest.mark.parametrize("peer", ["rosglass", "rospy", "roscpp"])
def test_the_older_of_two_nodes_of_a_name_ends(own_master, connect, request, peer):
    older = connect("twin", url=own_master.url)
    statuses, done = [], threading.Event()
    older.on_status_change(lambda status: (statuses.append(status), done.set()))
    older.create_publisher("/old", "std_msgs/Empty")
    eventually(lambda: registered(own_master, "/old")[0])
    if peer == "rosglass":
        newer = connect("twin", url=own_master.url)
        newer.create_publisher("/new", "std_msgs/Empty")
    else:
        start = request.getfixturevalue(f"start_{peer}")
        newer = start("twin", master=own_master)
    eventually(lambda: older.status().state is ConnectionState.CLOSED)
    done.wait(30)
    assert statuses[-1] == older.status()
    assert "same name" in statuses[-1].detail or "has the name /twin now" in statuses[-1].detail
    with pytest.raises(rosglass.NodeClosedError, match="/twin is closed"):
        older.create_publisher("/late", "std_msgs/Empty")
    if peer == "rosglass":
        eventually(lambda: registered(own_master, "/new")[0] == ["/twin"])
        assert newer.status().state is ConnectionState.CONNECTED
    eventually(lambda: registered(own_master, "/old")[0] == [])


def test_a_node_on_the_port_of_one_that_was_killed_does_not_end_in_its_place(
    own_master, connect, caplog
):
    caplog.set_level(logging.INFO, "rosglass.ros1")
    node = connect("panel", url=own_master.url)
    publish = ("registerPublisher", "/old", "std_msgs/Empty")
    own_master.call(*publish, own_master.call("lookupNode", "/panel"), caller="/killed")
    own_master.call(*publish, "http://127.0.0.1:1/", caller="/killed")  # it is started again
    eventually(lambda: "/panel: ignored, as it has its name: closed by /master" in caplog.text)
    assert "[/killed] Reason: new node registered with same name" in caplog.text
    assert node.status().state is ConnectionState.CONNECTED


def test_node_ends_although_the_master_cannot_reach_it_to_report_its_name_taken(
    own_master, connect
):
    older = connect("twin", url=f"ros1://127.0.0.1:{own_master.port}?ip={NOWHERE}")
    older.create_publisher("/old", "std_msgs/Empty")
    eventually(lambda: registered(own_master, "/old")[0])
    newer = connect("twin", url=own_master.url)
    newer.create_publisher("/new", "std_msgs/Empty")
    eventually(lambda: older.status().state is ConnectionState.CLOSED)
    uri = own_master.call("lookupNode", "/twin")
    assert f"{uri} has the name /twin now" in older.status().detail
    assert newer.status().state is ConnectionState.CONNECTED


_FORK = """
import os, sys, threading, rosglass

def wait(condition):
    for _ in range(3000):
        if condition():
            return
        threading.Event().wait(0.01)
    sys.exit("not in time")

node = rosglass.connect(sys.argv[1], "parent")
publisher = node.create_publisher("/forked", "std_msgs/Int32")
subscription = node.create_subscription("/forked")
wait(publisher.subscription_count)
inner, outer = os.pipe()
child = os.fork()
if not child:
    os.close(outer)
    try:
        publisher.publish(data=1)
    except rosglass.NodeClosedError as error:
        assert "after a fork" in str(error)
    else:
        sys.exit("published")
    assert node.status().state.value == "closed"
    node.close()
    with rosglass.connect(sys.argv[1], "child") as own:
        wait(lambda: own.status().state.value == "connected")
    os.read(inner, 1)  # it lives on, with all that it has inherited
    sys.exit(0)
os.close(inner)
publisher.publish(data=2)
assert subscription.wait(30).message().data == 2
subscription.close()
wait(lambda: not publisher.subscription_count())
os.write(outer, b"x")
assert os.waitpid(child, 0)[1] == 0
assert node.status().state.value == "connected"
print('{"done": true}', flush=True)
# It ends without closing anything.
"""


def test_a_fork_keeps_nothing_alive_and_an_end_without_closing_leaves_nothing(own_master, start):
    process = start("-c", _FORK, own_master.url)
    assert process.event("done")
    assert process.popen.wait(30) == 0
    assert "".join(process.output) == ""
    assert [part for part in own_master.call("getSystemState") if part] == []

"""Topics when peers die, are slow, send garbage, or leave while they are being connected."""

from __future__ import annotations

import gc
import socket
import struct
import threading
import time

import pytest
from tcpros import publisher_address, topics_of
from usage import open_files
from waiting import eventually, nothing_happens

import rosglass
from rosglass.comm import IMMEDIATE
from rosglass.messages import MessageType, OpaqueType
from rosglass.wires.tcpros.connection import encode_header, parse_header

STRING = "std_msgs/String"


def dial(node, published, **fields):
    """Connect to a node of ours as a subscriber would; return the socket and the answer."""
    sock = socket.create_connection(publisher_address(node, published))
    sock.settimeout(10)
    if fields:
        sock.sendall(encode_header({"callerid": "/raw", "topic": published} | fields))
    return sock


def answer_of(sock):
    """Return the connection header that a node answers with."""
    (size,) = struct.unpack("<I", sock.recv(4, socket.MSG_WAITALL))
    return parse_header(sock.recv(size, socket.MSG_WAITALL))


def test_killed_publisher_is_reported_and_replaced(connect, start_rospy):
    node = connect("follower")
    subscription = node.create_subscription("/killed", STRING)
    plan = {"topic": "/killed", "type": STRING, "rate": 50, "count": 0}
    first = start_rospy("killed")
    first.call("publish", value={"data": "first"}, **plan)
    assert subscription.wait(30).message().data == "first"
    first.end()
    eventually(
        lambda: (
            "/killed was lost" in subscription.problem
            or "cannot be received" in subscription.problem
        )
    )
    assert subscription.publisher_count() == 0
    second = start_rospy("killed")  # the same name on other ports
    second.call("publish", value={"data": "second"}, **plan)
    eventually(lambda: (s := subscription.wait(1)) and s.message().data == "second")
    eventually(lambda: not subscription.problem, what=lambda: subscription.problem)


def test_messages_flow_on_while_the_master_is_killed_and_restarted(
    start_master, connect, start_rospy
):
    master = start_master()
    node = connect("steady", url=master.url)
    peer = start_rospy("steady_peer", master=master)
    peer.call("publish", topic="/a", type=STRING, value={"data": "x"}, rate=50, count=0)
    subscription = node.create_subscription("/a", STRING)
    assert subscription.wait(30)
    master.kill()
    eventually(lambda: node.status().state.value == "lost")
    for _ in range(20):
        assert subscription.wait(30)
    assert subscription.problem == ""
    master.start()
    eventually(lambda: node.status().state.value == "connected")
    # rospy does not register again: the new master never names it, and we keep it all the same.
    eventually(lambda: ["/a", ["/steady"]] in master.call("getSystemState")[1])
    other = connect("newcomer", url=master.url)
    publisher = other.create_publisher("/a", STRING)
    eventually(lambda: subscription.publisher_count() == 2)
    publisher.publish(data="new")
    eventually(lambda: (s := subscription.wait(1)) and s.message().data == "new")
    assert subscription.publisher_count() == 2


def test_subscribers_that_come_and_go_between_two_looks_are_not_missed(connect):
    node = connect("busy")
    publisher = node.create_publisher("/brief", STRING)
    changes, late, held, go_on = [], [], threading.Event(), threading.Event()
    publisher.on_matched(lambda event: changes.append((event.change, event.count)))

    def hold_up(_):
        held.set()
        go_on.wait(30)

    # In the thread that looks.
    publisher.on_matched(hold_up, IMMEDIATE)
    with dial(node, "/brief", md5sum="*", type="*"):
        assert held.wait(30)
        for _ in range(3):
            with dial(node, "/brief", md5sum="*", type="*"):
                eventually(lambda: publisher.subscription_count() == 2)
            eventually(lambda: publisher.subscription_count() == 1)
        go_on.set()
        eventually(lambda: len(changes) == 7, what=lambda: changes)
        # The check that reports it is over; a new listener is first notified of what is there.
        held.clear(), go_on.clear()
        with dial(node, "/brief", md5sum="*", type="*"):
            assert held.wait(30)
            publisher.on_matched(lambda event: late.append((event.change, event.count)))
        eventually(lambda: publisher.subscription_count() == 1)
        go_on.set()
        eventually(lambda: len(changes) == 9, what=lambda: changes)
    eventually(lambda: len(changes) == 10, what=lambda: changes)
    eventually(lambda: len(late) == 4, what=lambda: late)
    assert late == [(1, 1), (1, 2), (-1, 1), (-1, 0)]
    assert changes == [(1, 1), *4 * [(1, 2), (-1, 1)], (-1, 0)]


def test_slow_subscriber_is_reported_and_does_not_block_others(connect):
    node, other = connect("fast"), connect("listener")
    publisher = node.create_publisher("/fast", "std_msgs/UInt8MultiArray", 5)
    slow = dial(node, "/fast", md5sum="*", type="*")
    got = []
    other.create_subscription("/fast", raw_callback=got.append, executor=IMMEDIATE)
    eventually(lambda: publisher.subscription_count() == 2)
    data = publisher.type.encode({"data": bytes(1_000_000)})
    for number in range(60):
        publisher.publish_serialized(data)
        eventually(lambda wanted=number: len(got) > wanted)
    assert publisher.dropped >= 40
    assert all(link.waiting() <= 6 for link in topics_of(node).published()["/fast"].links())
    eventually(lambda: "/raw is too slow" in publisher.problem)
    slow.close()
    eventually(lambda: publisher.problem == "" and publisher.subscription_count() == 1)


@pytest.mark.parametrize("garbage", [b"\xff" * 100, b"GET / HTTP/1.1\r\n\r\n", b"\0" * 4])
def test_garbage_is_hung_up_on_and_others_go_on(garbage, connect):
    node = connect("robust")
    publisher = node.create_publisher("/robust", STRING)
    subscription = node.create_subscription("/robust")
    eventually(lambda: publisher.subscription_count() == 1)
    with dial(node, "/robust") as sock:
        sock.sendall(garbage)
        assert sock.recv(10) == b""
    publisher.publish(data="on")
    assert subscription.wait(30).message().data == "on"


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"type": STRING}, "no md5sum"),
        ({"md5sum": "0" * 32, "type": STRING}, f"md5 {'0' * 32}"),
        ({"md5sum": "*", "type": "std_msgs/Int32"}, "subscribes to std_msgs/Int32"),
        ({"topic": "/nowhere", "md5sum": "*"}, "does not publish /nowhere"),
    ],
)
def test_insufficient_header_is_refused_by_name(fields, reason, connect):
    node = connect("strict")
    publisher = node.create_publisher("/strict", STRING)
    with dial(node, "/strict", **fields) as sock:
        assert reason in answer_of(sock)["error"]
        assert sock.recv(10) == b""
    if "topic" not in fields:
        eventually(lambda: reason in publisher.problem)


def test_an_md5_mismatch_names_both_definitions(connect):
    node, other = connect("ours"), connect("theirs")
    theirs = MessageType.from_text("test_msgs/msg/Other", "int32 theirs\n", ros=1)
    ours = MessageType.from_text("test_msgs/msg/Other", "int32 ours\n", ros=1)
    other.create_publisher("/mismatch", theirs)
    subscription = node.create_subscription("/mismatch", ours)
    problem = eventually(lambda: subscription.problem)
    for part in (theirs.md5, ours.md5, "int32 theirs", "int32 ours", "/theirs"):
        assert part in problem
    assert subscription.publisher_count() == 0


def test_undefinable_messages_are_relayed_as_bytes(connect):
    source, relay, sink = connect("source"), connect("relay"), connect("sink")
    secret = OpaqueType("secret_msgs/Thing", "a" * 32, text="no definition {", ros=1)
    sent = source.create_publisher("/secret", secret, rosglass.QoS.latched())
    sent.publish_serialized(b"\1\2\3")
    sample = relay.create_subscription("/secret").wait(30)
    assert (bytes(sample.data), sample.type) == (b"\1\2\3", secret)
    again = relay.create_publisher("/passed_on", sample.type, rosglass.QoS.latched())
    again.publish_serialized(sample)
    end = sink.create_subscription("/passed_on").wait(30)
    assert (bytes(end.data), end.type.text) == (b"\1\2\3", "no definition {")
    with pytest.raises(rosglass.TypeNotFoundError, match="md5"):
        relay.create_publisher("/nothing", OpaqueType("secret_msgs/Thing", ros=1))


def test_a_definition_with_a_broken_line_is_used_if_the_rest_has_its_md5(connect):
    source, sink = connect("source"), connect("sink")
    whole = MessageType.from_text("secret_msgs/Level", "float64 data\n", ros=1)
    broken = OpaqueType("secret_msgs/Level", whole.md5, text="float64 data\n\\n\n", ros=1)
    sent = source.create_publisher("/broken", broken, rosglass.QoS.latched())
    sent.publish_serialized(whole.encode(data=2.5))
    assert sink.create_subscription("/broken").wait(30).message().data == 2.5


def test_latched_messages_of_each_publisher_of_a_node_reach_late_subscriptions(connect):
    node = connect("static")
    first = node.create_publisher("/static", STRING, rosglass.QoS.latched())
    second = node.create_publisher("/static", STRING, rosglass.QoS.latched())
    for text in ("old", "a"):
        first.publish(data=text)
    second.publish(data="b")
    for reader in (node, node, connect("late")):
        subscription = reader.create_subscription("/static")
        assert {subscription.wait(30).message().data for _ in range(2)} == {"a", "b"}
    first.close()
    assert connect("later").create_subscription("/static").wait(30).message().data == "b"


def test_creating_and_closing_a_thousand_times_leaves_nothing(connect, monkeypatch):
    monkeypatch.setattr("rosglass.wires.tcpros.core._IDLE_TIMEOUT_S", 0.5)
    node = connect("busy")
    publisher = node.create_publisher("/busy", STRING)

    def cycle():
        subscription = node.create_subscription("/busy")
        again = node.create_publisher("/busy/again", STRING)
        subscription.close()
        again.close()

    def things():
        return threading.active_count(), open_files()

    for _ in range(20):
        cycle()
    eventually(lambda: publisher.subscription_count() == 0)
    nothing_happens(1.0)  # threads of the pool without a job end

    def alive():
        gc.collect()
        kinds = [type(one).__name__ for one in gc.get_objects()]
        return kinds.count("PublisherLink"), kinds.count("Connection")

    # Earlier tests of this process may have left some, whose failures pytest keeps.
    before, alive_before = things(), alive()
    for number in range(1000):
        cycle()
        if number % 50 == 49:
            eventually(lambda: publisher.subscription_count() == 0, timeout=30)
    eventually(
        lambda: all(now <= then for now, then in zip(things(), before, strict=True)),
        timeout=30,
        what=lambda: f"{things()}, {before} before",
    )

    eventually(
        lambda: all(now < then + 20 for now, then in zip(alive(), alive_before, strict=True)),
        what=lambda: f"{alive()} readings and connections, {alive_before} before",
    )
    # What was closed and made again is registered at last.
    subscription = node.create_subscription("/busy")
    eventually(lambda: publisher.subscription_count() == 1)
    publisher.publish(data="x")
    assert subscription.wait(30)


def test_closing_while_connecting(connect, start_master):
    publisher = connect("there").create_publisher("/closing", STRING)
    for number in range(10):
        node = connect(f"closing{number}", wait=number % 2 == 0)
        subscription = node.create_subscription("/closing")
        time.sleep(number * 0.003)
        began = time.monotonic()
        node.close()
        assert time.monotonic() - began < 5
        assert subscription.closed
        assert subscription.wait() is None
    publisher.close()


def test_unresolvable_host_name_is_reported_with_the_fix(connect, master):
    node = connect("lost")
    subscription = node.create_subscription("/unknown_host")
    eventually(lambda: ["/unknown_host", ["/lost"]] in master.call("getSystemState")[1])
    master.call("registerPublisher", "/unknown_host", STRING, "http://no-such-host.invalid:1/")
    problem = eventually(lambda: subscription.problem)
    assert "no-such-host.invalid" in problem
    assert "ROS_HOSTNAME" in problem

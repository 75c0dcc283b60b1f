"""The graph as rospy, roscpp and ROS 1's commands make it and see it; relays of any type."""

from __future__ import annotations

import threading

import pytest
from tcpros import publisher_address
from waiting import eventually

from rosglass.comm import EndpointKind, NodeName


def test_nodes_topics_and_services_come_and_go(connect, start_rospy, start_roscpp):
    node = connect("panel", "/ops")
    changed = threading.Event()
    node.on_graph_change(changed.set)
    peer, other = start_rospy("camera"), start_roscpp("base")
    peer.call("publish", topic="/image", type="sensor_msgs/Image")
    peer.call("subscribe", topic="/words", type="*", reports=False)
    eventually(lambda: {"/image", "/words"} <= node.topics().keys())
    eventually(lambda: {NodeName("/", "camera"), NodeName("/", "base")} <= set(node.nodes()))
    assert changed.is_set()
    assert NodeName("/ops", "panel") in node.nodes()  # although it has registered nothing
    assert node.topics()["/image"] == ["sensor_msgs/msg/Image"]
    assert node.topics()["/words"] == []  # its type is unknown so far
    (image,) = node.publishers("/image")
    assert (image.node.full, image.type) == ("/camera", "sensor_msgs/msg/Image")
    (words,) = node.subscriptions("/words")
    assert words.node.full == "/camera"
    ends = {(end.kind, end.name) for end in node.endpoints("/camera")}
    assert (EndpointKind.PUBLISHER, "/image") in ends
    assert (EndpointKind.SUBSCRIPTION, "/words") in ends
    assert (EndpointKind.SERVICE_SERVER, "/camera/get_loggers") in ends
    assert node.endpoints("/camera") == node.endpoints(NodeName("/", "camera"))

    # The type is known as soon as a node announces it.
    changed.clear()
    other_words = connect("talker").create_publisher("/words", "std_msgs/String")
    eventually(lambda: node.topics()["/words"] == ["std_msgs/msg/String"])
    eventually(changed.is_set)
    other_words.close()
    peer.call("unpublish", topic="/image")
    eventually(lambda: "/image" not in node.topics())
    other.end()


def test_a_node_that_was_killed_stays_until_it_is_cleaned_up_and_is_named(
    connect, start_rospy, tool
):
    node = connect("panel")
    peer = start_rospy("doomed")
    peer.call("publish", topic="/pulse", type="std_msgs/Empty", value={}, rate=20, count=0)
    subscription = node.create_subscription("/pulse")
    subscription.wait(30)
    peer.end()
    eventually(lambda: subscription.publisher_count() == 0)
    eventually(lambda: "Connection refused" in subscription.problem)
    assert NodeName("/", "doomed") in node.nodes()  # as `rosnode list` has it
    assert "/doomed" in tool("rosnode", "list")
    assert "/doomed" in tool("rosnode", "cleanup", stdin="y\n")
    eventually(lambda: NodeName("/", "doomed") not in node.nodes())
    eventually(lambda: "refused" not in subscription.problem, what=lambda: subscription.problem)
    # Its successor is found.
    again = start_rospy("doomed")
    again.call("publish", topic="/pulse", type="std_msgs/Empty", value={}, rate=20, count=0)
    while subscription.take() is not None:
        pass
    subscription.wait(30)
    again.end()


def test_rosnode_shows_our_connections_by_node_and_port(connect, start_rospy, tool):
    node, peer = connect("panel"), start_rospy("peer")
    publisher = node.create_publisher("/out", "std_msgs/Empty")
    subscription = node.create_subscription("/in", "std_msgs/Empty")
    peer.call("subscribe", topic="/out", type="std_msgs/Empty", reports=False)
    peer.call("publish", topic="/in", type="std_msgs/Empty")
    eventually(publisher.subscription_count)
    eventually(subscription.publisher_count)
    info = tool("rosnode", "info", "/panel")
    inbound, outbound = (
        info.partition(f"* topic: {topic}\n")[2].splitlines()[:3] for topic in ("/in", "/out")
    )
    assert inbound[0].split()[:3] == ["*", "to:", "/peer"]
    assert outbound[0].split()[:3] == ["*", "to:", "/peer"]
    (_, ours), theirs = publisher_address(node, "/out"), peer.call("names")[0]
    assert theirs == "/peer"
    assert outbound[1].startswith(f"    * direction: outbound ({ours} - 127.0.0.1:")
    assert inbound[1].startswith("    * direction: inbound (")
    peer.end()


def test_udp_is_refused_and_tcp_taken_in_its_place(connect, roscpp_peer):
    node = connect("panel")
    publisher = node.create_publisher("/by_udp", "std_msgs/String")
    roscpp_peer.call("subscribe_udp", topic="/by_udp", fallback=True)
    eventually(publisher.subscription_count)
    publisher.publish(data="by TCP")
    assert roscpp_peer.event("udp") == "by TCP"
    only = node.create_publisher("/only", "std_msgs/String")
    roscpp_peer.call("subscribe_udp", topic="/only", fallback=False)
    eventually(lambda: node.subscriptions("/only"))
    only.publish(data="not received")
    assert roscpp_peer.call("udp_sources", topic="/only") == 0
    assert only.subscription_count() == 0
    assert node.status().state.value == "connected"


@pytest.mark.parametrize("kind", ["geometry_msgs/PoseStamped", "sensor_msgs/LaserScan"])
def test_we_relay_what_we_need_not_know(connect, rospy_peer, kind):
    node = connect("relay")
    passed = []
    topic = f"/{kind.replace('/', '_')}"

    def pass_on(sample):
        if not passed:
            passed.append(node.create_publisher(f"{topic}/out", sample.type))
        passed[0].publish_serialized(sample)

    source = node.create_subscription(f"{topic}/in", raw_callback=pass_on)
    header = {"seq": 1, "stamp": {"secs": 2, "nsecs": 3}, "frame_id": "map"}
    rospy_peer.call("subscribe", topic=f"{topic}/out", type=kind)
    rospy_peer.call("publish", topic=f"{topic}/in", type=kind, value={"header": header},
                    rate=20, count=0)  # fmt: skip
    received = rospy_peer.event("received")
    while received["topic"] != f"{topic}/out":  # the last ones of the type before
        received = rospy_peer.event("received")
    assert received["value"]["header"]["frame_id"] == "map"
    assert received["header"]["type"] == kind
    assert received["header"]["callerid"] == "/relay"
    rospy_peer.call("unpublish", topic=f"{topic}/in")
    rospy_peer.call("unsubscribe", topic=f"{topic}/out")
    source.close()


def test_a_relay_of_rospy_that_names_no_type_is_understood_when_we_give_one(connect, rospy_peer):
    node = connect("panel")
    source = node.create_publisher("/relayed/in", "std_msgs/String")
    rospy_peer.call("relay", source="/relayed/in", target="/relayed/out")
    typed = node.create_subscription("/relayed/out", "std_msgs/String")
    untyped = node.create_subscription("/relayed/out")
    eventually(source.subscription_count)
    eventually(typed.publisher_count)

    def relayed():
        # rospy reports a connection as ready, and sends messages only a moment later.
        source.publish(data="whatever")
        return typed.wait(0.5)

    assert eventually(relayed).message().data == "whatever"
    # With the type known for the topic, or not: it must not stay silent without a reason.
    eventually(lambda: untyped.problem or untyped.type)
    if untyped.type is None:
        assert "does not say what it publishes on /relayed/out" in untyped.problem
        assert "give the type" in untyped.problem

"""ROS 1's own commands used on our nodes, as a user would."""

from __future__ import annotations

import pytest
from waiting import eventually

import rosglass


@pytest.fixture
def node(connect):
    return connect("cockpit", "/ops")


def test_rostopic_list_and_info_show_our_topics(node, tool, master):
    node.create_publisher("speed", "std_msgs/Float64")
    node.create_subscription("orders", "std_msgs/String")
    eventually(lambda: "/ops/orders" in node.topics())
    listed = tool("rostopic", "list", "-v")
    assert "* /ops/speed [std_msgs/Float64] 1 publisher" in listed
    assert "* /ops/orders [std_msgs/String] 1 subscriber" in listed
    assert tool("rostopic", "type", "/ops/speed") == "std_msgs/Float64\n"
    info = tool("rostopic", "info", "/ops/speed")
    assert "Type: std_msgs/Float64" in info
    assert "* /ops/cockpit (http://127.0.0.1:" in info
    assert tool("rostopic", "find", "std_msgs/Float64") == "/ops/speed\n"


def test_rostopic_echo_prints_what_we_publish(node, tool):
    publisher = node.create_publisher("word", "std_msgs/String", rosglass.QoS.latched())
    publisher.publish(data="Grüße")
    assert tool("rostopic", "echo", "-n1", "-p", "/ops/word").splitlines()[1].endswith(",Grüße")
    pose = node.create_publisher("pose", "geometry_msgs/PoseStamped", rosglass.QoS.latched())
    pose.publish(header={"frame_id": "map"}, pose={"position": {"x": 1.5}})
    assert tool("rostopic", "echo", "-n1", "/ops/pose/pose/position/x") == "1.5\n---\n"


def test_rostopic_hz_and_bw_measure_us(node, start_tool):
    publisher = node.create_publisher("fast", "std_msgs/String")
    rate, bandwidth = (
        start_tool("rostopic", "hz", "/ops/fast"),
        start_tool("rostopic", "bw", "/ops/fast"),
    )

    def measured():
        publisher.publish(data="x" * 100)
        printed = "".join(rate.output), "".join(bandwidth.output)
        return "average rate: " in printed[0] and "average: " in printed[1]

    eventually(measured, timeout=20, what=lambda: "".join(rate.output + bandwidth.output))


def test_rostopic_pub_reaches_us(node, start_tool):
    subscription = node.create_subscription("orders")
    start_tool("rostopic", "pub", "-r", "10", "/ops/orders", "geometry_msgs/Twist",
               "{linear: {x: 0.5}, angular: {z: -1.0}}")  # fmt: skip
    message = subscription.wait(30).message()
    assert message.linear.x == 0.5
    assert message.angular.z == -1.0
    assert subscription.type.name == "geometry_msgs/msg/Twist"


def test_a_latched_rostopic_pub_reaches_us(node, start_tool):
    start_tool("rostopic", "pub", "-l", "/ops/plan", "std_msgs/Int32", "7")
    assert node.create_subscription("plan", "std_msgs/Int32").wait(30).message().data == 7


def test_rosnode_lists_pings_and_shows_our_node(node, tool):
    publisher = node.create_publisher("speed", "std_msgs/Float64")
    node.create_subscription("commands", "std_msgs/String")
    reader = node.create_subscription("speed")
    eventually(publisher.subscription_count)
    eventually(reader.publisher_count)
    eventually(lambda: "/ops/commands" in node.topics())
    assert "/ops/cockpit" in tool("rosnode", "list").splitlines()
    assert "xmlrpc reply from http://127.0.0.1:" in tool(
        "rosnode", "ping", "-c", "1", "/ops/cockpit"
    )
    info = tool("rosnode", "info", "/ops/cockpit")
    assert " * /ops/speed [std_msgs/Float64]" in info
    assert " * /ops/commands [unknown type]" in info  # it asks for published types only
    assert "Pid: " in info
    assert "* topic: /ops/speed" in info
    assert "transport: TCPROS" in info
    assert "* direction: outbound" in info
    assert "* direction: inbound" in info


def test_rosnode_kill_ends_our_node_only(connect, tool):
    victim, other = connect("victim"), connect("other")
    victim.create_publisher("/left", "std_msgs/Empty")
    other.create_publisher("/right", "std_msgs/Empty")
    eventually(lambda: "/left" in other.topics())
    assert "killed" in tool("rosnode", "kill", "/victim")
    eventually(lambda: victim.status().state.value == "closed")
    eventually(lambda: "/left" not in other.topics())
    assert other.status().state.value == "connected"


def test_rosnode_cleanup_finds_nothing_of_a_closed_node(connect, tool):
    node, other = connect("short"), connect("watcher")
    node.create_publisher("/gone", "std_msgs/Empty")
    node.create_subscription("/gone_too", "std_msgs/Empty")
    eventually(lambda: "/gone" in other.topics())
    node.close()
    eventually(lambda: "/gone" not in other.topics())
    assert "/short" not in tool("rosnode", "list")
    tool("rosnode", "cleanup", stdin="y\n")


def test_rosbag_records_us_and_plays_to_us(node, start_tool, tool, tmp_path):
    words = node.create_publisher("words", "std_msgs/String")
    map_ = node.create_publisher("map", "nav_msgs/OccupancyGrid", rosglass.QoS.latched())
    grid = {"info": {"width": 2, "height": 1, "resolution": 0.25}, "data": [-1, 100]}
    map_.publish(grid)
    bag = tmp_path / "ours.bag"
    # It ends by itself with the fifth message of each.
    recorder = start_tool("rosbag", "record", "-l", "5", "-O", str(bag), "/ops/words", "/ops/map")
    eventually(lambda: words.subscription_count() and map_.subscription_count())
    for number in range(5):
        words.publish(data=f"word {number}")
        if number:
            map_.publish(grid)
    recorder.popen.wait(30)
    info = tool("rosbag", "info", str(bag))
    assert "messages:    10" in info
    assert "nav_msgs/OccupancyGrid" in info
    words.close()
    map_.close()
    subscription, latched = node.create_subscription("words"), node.create_subscription("map")
    start_tool("rosbag", "play", "--quiet", "-d", "1", str(bag))
    assert [subscription.wait(30).message().data for _ in range(5)] == [
        f"word {number}" for number in range(5)
    ]
    sample = latched.wait(30)
    assert list(sample.message().data) == [-1, 100]
    assert sample.message().info.resolution == 0.25

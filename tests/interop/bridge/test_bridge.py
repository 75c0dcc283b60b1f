"""A bridge between a rosmaster with rospy nodes and a Zenoh router with ROS 2 nodes."""

from __future__ import annotations

from concurrent.futures import Future

import pytest
from waiting import eventually, nothing_happens

import rosglass
from rosglass import Library, ServiceError
from rosglass.bridge import Bridge, survey
from rosglass.comm import Durability, QoS
from rosglass.messages import MessageType
from rosglass.wires.zenoh.router import Router

STRING, IMAGE = "std_msgs/msg/String", "sensor_msgs/msg/Image"


def relays(bridge):
    return {(one.name, one.direction): one for one in bridge.status().relays}


def begun(bridge):
    """Return what is relayed, and not only refused with a reason."""
    return {key for key, one in relays(bridge).items() if not one.problem}


def test_from_ros1(bridge, connect, rospy_peer):
    bridge(["/talk_one"])
    listener = connect("ros2", "listener").create_subscription(
        "/talk_one", STRING, qos=QoS(depth=100)
    )
    rospy_peer.call("publish", topic="/talk_one", type="std_msgs/String")
    eventually(lambda: rospy_peer.call("connections", topic="/talk_one"), what="the bridge is away")
    for number in range(20):
        rospy_peer.call(
            "publish", topic="/talk_one", type="std_msgs/String", value={"data": f"ü{number}"}
        )
    found = [listener.wait(30).message().data for _ in range(20)]
    assert found == [f"ü{number}" for number in range(20)]


def test_to_ros1(bridge, connect, rospy_peer):
    made = bridge(["/talk_two"])
    talker = connect("ros2", "talker").create_publisher("/talk_two", "geometry_msgs/PoseStamped")
    rospy_peer.call("subscribe", topic="/talk_two", type="geometry_msgs/PoseStamped")
    eventually(talker.subscription_count, what="the bridge is away")
    stamp = {"sec": 12, "nanosec": 34}
    talker.publish(header={"stamp": stamp, "frame_id": "map"}, pose={"position": {"x": 1.5}})
    value = rospy_peer.event("received")["value"]
    assert value["header"] == {"seq": 0, "stamp": {"secs": 12, "nsecs": 34}, "frame_id": "map"}
    assert value["pose"]["position"]["x"] == 1.5
    eventually(lambda: relays(made)["/talk_two", "<-"].count == 1)


@pytest.mark.parametrize("way", ["->", "<-"])
def test_images(bridge, connect, rospy_peer, way):
    name = "/picture_there" if way == "->" else "/picture_back"
    bridge(["/picture_*"])
    node = connect("ros2", "viewer")
    shape = {"width": 1920, "height": 1080, "step": 5760, "encoding": "rgb8"}
    if way == "->":
        viewer = node.create_subscription(name, IMAGE)
        data = {"data": {"repeat": 7, "length": 6_220_800}}
        rospy_peer.call("publish", topic=name, type="sensor_msgs/Image", latch=True,
                        value=shape | data)  # fmt: skip
        found = viewer.wait(30).message()
        assert (found.width, found.data[-1], len(found.data)) == (1920, 7, 6_220_800)
    else:
        camera = node.create_publisher(name, IMAGE)
        rospy_peer.call("subscribe", topic=name, type="sensor_msgs/Image")
        eventually(camera.subscription_count)
        camera.publish(shape | {"data": bytes([7]) * 6_220_800})
        value = rospy_peer.event("received")["value"]
        assert (value["width"], value["data"][0]) == (1920, 6_220_800)


def test_latched_both_ways(bridge, connect, rospy_peer):
    made = bridge(["/map_*"])
    rospy_peer.call(
        "publish", topic="/map_one", type="std_msgs/String", value={"data": "one"}, latch=True
    )
    node = connect("ros2", "walls")
    keeper = node.create_publisher("/map_two", STRING, QoS.latched())
    keeper.publish(data="two")
    eventually(lambda: {("/map_one", "->"), ("/map_two", "<-")} <= relays(made).keys())
    eventually(lambda: node.publishers("/map_one"))
    eventually(lambda: all(one.count for one in made.status().relays))
    (end,) = node.publishers("/map_one")
    assert end.qos.durability is Durability.TRANSIENT_LOCAL
    late = node.create_subscription("/map_one", STRING, qos=QoS.latched())
    assert late.wait(30).message().data == "one"
    rospy_peer.call("subscribe", topic="/map_two", type="std_msgs/String")
    assert rospy_peer.event("received")["value"] == {"data": "two"}
    # A latched message goes with its publisher.
    keeper.close()
    eventually(lambda: ("/map_two", "<-") not in relays(made))
    ours = connect("ros1", "latecomer").create_subscription("/map_two", STRING)
    assert ours.wait(0.5) is None


def test_several_latched_publishers_stay_apart(bridge, connect):
    made = bridge(["/tf_static"])
    texts = [f"frame {number}" for number in range(3)]
    for number, text in enumerate(texts):
        node = connect("ros2", f"broadcaster{number}")
        keeper = node.create_publisher("/tf_static", "tf2_msgs/TFMessage", QoS.latched())
        keeper.publish(transforms=[{"child_frame_id": text}])
    eventually(lambda: made.status().count == 3, what=lambda: str(made.status()))
    late = connect("ros1", "late").create_subscription("/tf_static")
    found = {late.wait(30).message().transforms[0].child_frame_id for _ in range(3)}
    assert found == set(texts)


def test_nothing_comes_back(bridge, connect):
    """Two bridges beside each other: each message arrives once, nowhere twice."""
    first, second = bridge(["*"]), bridge(["*"])
    one, two = connect("ros1", "echo_one"), connect("ros2", "echo_two")
    # ROS 1 and ROS 2 nodes both publish and subscribe.
    ends = [node.create_publisher("/echo", STRING, QoS(depth=100)) for node in (one, two)]
    ears = [node.create_subscription("/echo", STRING, qos=QoS(depth=1000)) for node in (one, two)]

    def relaying():
        return [
            sum(("/echo", way) in relays(bridge) for bridge in (first, second))
            for way in ("->", "<-")
        ]

    eventually(lambda: relaying() == [1, 1], timeout=20, what=lambda: str(relaying()))
    eventually(lambda: all(end.subscription_count() >= 2 for end in ends))
    nothing_happens(1)
    for number in range(10):
        ends[0].publish(data=f"one {number}")
        ends[1].publish(data=f"two {number}")
    expected = sorted(f"{word} {number}" for word in ("one", "two") for number in range(10))
    for ear in ears:
        found = [ear.wait(30).message().data for _ in range(20)]
        assert sorted(found) == expected
        assert ear.wait(0.7) is None


def test_another_bridge_takes_over(bridge, connect):
    first = bridge(["/shared"])
    one, two = connect("ros1", "share_one"), connect("ros2", "share_two")
    talker = one.create_publisher("/shared", STRING)
    listener = two.create_subscription("/shared", STRING)
    eventually(lambda: relays(first))
    eventually(lambda: two.publishers("/shared"))
    second = bridge(["/shared", "/later"])
    one.create_publisher("/later", STRING)
    two.create_subscription("/later", STRING)
    # What appears later is relayed later: by then it would have begun.
    eventually(lambda: begun(second) == {("/later", "->")}, second.status)
    first.close()
    eventually(lambda: ("/shared", "->") in begun(second))

    def heard():
        talker.publish(data="again")
        return listener.wait(0.1)

    eventually(heard)


def test_directions_and_names(bridge, connect):
    made = bridge(["/left->/right", "/stop<-"])
    one, two = connect("ros1", "named_one"), connect("ros2", "named_two")
    talkers = [
        node.create_publisher(topic, STRING)
        for node, topic in ((one, "/left"), (two, "/right"), (one, "/stop"), (two, "/stop"))
    ]
    listener = two.create_subscription("/right", STRING)
    eventually(lambda: set(relays(made)) == {("/left", "->"), ("/stop", "<-")})
    assert relays(made)["/left", "->"].other == "/right"

    def heard():
        talkers[0].publish(data="over")
        return listener.wait(0.1)

    assert eventually(heard).message().data == "over"


def test_a_type_given_beforehand(bridge, connect):
    """Not even the first message is missed."""
    bridge(["/cmd->"], types={"/cmd": "geometry_msgs/Twist"})
    listener = connect("ros2", "wheels").create_subscription("/cmd", "geometry_msgs/msg/Twist")
    eventually(listener.publisher_count)
    one = connect("ros1", "stick")
    eventually(lambda: one.subscriptions("/cmd"))
    talker = one.create_publisher("/cmd", "geometry_msgs/Twist")
    eventually(talker.subscription_count)
    talker.publish(linear={"x": 0.5})
    assert listener.wait(30).message().linear.x == 0.5


def test_services_of_ros1(bridge, connect, rospy_peer):
    made = bridge(services=["/arm/*"])
    for service, fails in (("/arm/set", ""), ("/arm/broken", "refusal")):
        rospy_peer.call(
            "serve",
            service=service,
            type="std_srvs/SetBool",
            returns={"success": True, "message": "set"},
            fails=fails,
        )
    node = connect("ros2", "caller")
    client = node.create_service_client("/arm/set", "std_srvs/srv/SetBool")
    answer = client.call({"data": True}, timeout=30)
    assert (answer.success, answer.message) == (True, "set")
    assert rospy_peer.event("served")["request"] == {"data": True}
    broken = node.create_service_client("/arm/broken", "std_srvs/srv/SetBool")
    with pytest.raises(ServiceError, match="not homed"):
        broken.call({"data": True}, timeout=30)
    eventually(lambda: relays(made)["/arm/broken", "->"].refused == 1)
    rospy_peer.call("unserve", service="/arm/set")
    rospy_peer.call("unserve", service="/arm/broken")


def test_services_of_ros2(bridge, connect, rospy_peer):
    bridge(services=["/sum", "/never"], timeout=1.0)
    node = connect("ros2", "server")
    node.create_service_server(
        "/sum", "example_interfaces/srv/AddTwoInts", lambda asked: {"sum": asked.a + asked.b}
    )
    node.create_service_server("/never", "std_srvs/srv/Trigger", lambda _: Future())
    adder = connect("ros1", "adder").create_service_client("/sum")
    found = adder.call({"a": 2, "b": -5}, timeout=30)
    assert found.sum == -3
    (error,) = rospy_peer.call("call", service="/never", type="std_srvs/Trigger")
    assert "within 1 s" in error


def test_a_service_that_both_offer_is_left_alone(bridge, connect):
    one, two = connect("ros1", "offer_one"), connect("ros2", "offer_two")
    for node in (one, two):
        node.create_service_server("/both", "std_srvs/Trigger", lambda _: {"success": True})
    eventually(lambda: one.service_servers("/both") and two.service_servers("/both"))
    made = bridge(services=["/both"])
    eventually(lambda: len(made.status().relays) == 2)
    for relay in made.status().relays:
        assert "offers it there already" in relay.problem
    assert one.create_service_client("/both").call().success


def test_untranslatable_message_is_refused_and_logged(bridge, connect, caplog):
    made = bridge(["/late"])
    talker = connect("ros2", "past").create_publisher("/late", "std_msgs/msg/Header")
    listener = connect("ros1", "present").create_subscription("/late")
    eventually(talker.subscription_count)
    for _ in range(3):
        talker.publish(stamp={"sec": -1})
    eventually(lambda: relays(made)["/late", "<-"].refused == 3)
    assert "stamp.sec" in relays(made)["/late", "<-"].problem
    assert caplog.text.count("a message is not relayed") == 1
    talker.publish(frame_id="fine")
    assert listener.wait(30).message().frame_id == "fine"


def test_survey(connect, rospy_peer):
    one, two = connect("ros1", "survey_one"), connect("ros2", "survey_two")
    rospy_peer.call("publish", topic="/seen/one", type="std_msgs/Time")
    connect("ros2", "seen").create_publisher("/seen/two", "visualization_msgs/msg/Marker")
    eventually(lambda: one.publishers("/seen/one") and two.publishers("/seen/two"))
    found = {entry.name: entry for entry in survey(one, two, ["/seen/*"], ["/seen/*"])}
    assert found["/seen/one"].other_type == "builtin_interfaces/msg/Time"
    assert found["/seen/one"].direction == "->"
    assert "mesh_file" in found["/seen/two"].notes[0]


def test_an_unused_topic_costs_nothing(bridge, connect):
    made = bridge(["/heavy"])
    one, two = connect("ros1", "heavy_one"), connect("ros2", "heavy_two")
    talker = one.create_publisher("/heavy", STRING)
    eventually(lambda: two.publishers("/heavy"))
    eventually(lambda: talker.subscription_count() == 0)
    listener = two.create_subscription("/heavy", STRING)
    eventually(talker.subscription_count)
    talker.publish(data="wanted")
    assert listener.wait(30).message().data == "wanted"
    eventually(lambda: relays(made)["/heavy", "->"].count == 1)


def test_the_master_restarts(bridge, connect, start_master, start_rospy):
    master = start_master()
    url = master.url
    bridge(["/steady"], urls=(url, ""))
    two = connect("ros2", "steady_two")
    peer = start_rospy("steady_peer", master=master)
    peer.call(
        "publish", topic="/steady", type="std_msgs/String", value={"data": "."}, rate=20, count=0
    )
    listener = two.create_subscription("/steady", STRING)
    assert listener.wait(30)
    master.kill()
    while listener.take():
        pass
    assert listener.wait(30), "connections outlive the master"
    master.start()
    again = start_rospy("steady_again", master=master)
    again.call(
        "publish", topic="/steady", type="std_msgs/String", value={"data": "new"}, rate=20, count=0
    )

    def heard():
        sample = listener.wait(0.5)
        return sample is not None and sample.message().data == "new"

    eventually(heard)


def test_the_router_restarts(bridge, connect, rospy_peer, free_port):
    where = f"tcp/127.0.0.1:{free_port}"
    with Router(where) as router:
        bridge(["/lasting"], urls=("", router.url))
        listener = connect("ros2", "lasting", router.url).create_subscription("/lasting", STRING)
        rospy_peer.call(
            "publish",
            topic="/lasting",
            type="std_msgs/String",
            value={"data": "."},
            rate=20,
            count=0,
        )
        assert listener.wait(30)
    with Router(where):
        again = connect("ros2", "lasting_again", router.url)
        late = again.create_subscription("/lasting", STRING)
        assert late.wait(30)
    rospy_peer.call("unpublish", topic="/lasting")


def test_a_ros2_client_that_is_not_ours(bridge, start_peer, router, rospy_peer, peer_values):
    bridge(["/chatter", "/orders"])
    rospy_peer.call("subscribe", topic="/chatter", type="std_msgs/String")
    peer = start_peer("sdk", router, publish={"/chatter": STRING}, subscribe={"/orders": STRING})
    value = rospy_peer.event("received", 30)["value"]
    assert value == {"data": peer_values.VALUES[STRING]["data"]}
    rospy_peer.call("unsubscribe", topic="/chatter")
    rospy_peer.call(
        "publish", topic="/orders", type="std_msgs/String", value={"data": "from rospy"},
        rate=10, count=0,
    )  # fmt: skip
    assert peer.event("received", 30) == "/orders"
    rospy_peer.call("unpublish", topic="/orders")


def test_a_chain_of_bridges(bridge, connect, start_master):
    """A second bridge relays topics of the first one on to a third network."""
    far = start_master().url
    bridge(["*"])
    bridge(["*"], urls=(far, ""))
    talker = connect("ros1", "near").create_publisher("/chain", STRING)
    listener = connect("ros1", "far", far).create_subscription("/chain", STRING)

    def heard():
        talker.publish(data="far away")
        return listener.wait(0.1)

    assert eventually(heard, timeout=30).message().data == "far away"


@pytest.mark.parametrize("kind", ["ros1", "dds"])
def test_bridges_between_two_masters_or_two_ros_2_networks(bridge, connect, router, request, kind):
    """Between networks of one ROS version, messages pass unchanged, also those of unknown types."""
    if kind == "ros1":
        ours, other = "", request.getfixturevalue("start_master")().url
        near, world = connect("ros1", "pair_near"), "ros1"
    else:
        pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
        ours = router.url
        other = f"dds://?domain={request.getfixturevalue('dds_domain')}"
        near, world = connect("ros2", "pair_near"), "ros2"
    far = connect(world, "pair_far", other)
    bridge(["/pair"], ["/pair/*"], urls=(ours, other))
    text = "int32 number\nstring[] words\n"
    kind_of_ones_own = MessageType.from_text("own_msgs/msg/Own", text, 1 if kind == "ros1" else 2)
    talker = near.create_publisher("/pair", kind_of_ones_own)
    listener = far.create_subscription("/pair", kind_of_ones_own)
    far.create_service_server("/pair/go", "std_srvs/srv/Trigger", lambda _: {"message": "gone"})

    def heard():
        talker.publish(number=7, words=["a", "b"])
        return listener.wait(0.1)

    found = eventually(heard, timeout=30).message()
    assert (found.number, list(found.words)) == (7, ["a", "b"])
    client = near.create_service_client("/pair/go", "std_srvs/srv/Trigger")
    assert client.call(timeout=30).message == "gone"


def test_from_ros1_to_dds(bridge, connect, rospy_peer, dds_domain):
    pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
    url = f"dds://?domain={dds_domain}"
    bridge(["/far/*"], ["/far/*"], urls=("", url))
    node = connect("ros2", "dds_viewer", url)
    viewer = node.create_subscription("/far/picture", IMAGE)
    data = {"width": 640, "data": {"repeat": 9, "length": 640 * 480 * 3}}
    rospy_peer.call(
        "publish", topic="/far/picture", type="sensor_msgs/Image", value=data, latch=True
    )
    found = viewer.wait(30).message()
    assert (found.width, found.data[-1], len(found.data)) == (640, 9, 640 * 480 * 3)
    node.create_service_server("/far/go", "std_srvs/srv/Trigger", lambda _: {"message": "gone"})
    (response,) = rospy_peer.call("call", service="/far/go", type="std_srvs/Trigger", timeout=30)
    assert response == {"success": False, "message": "gone"}


def test_a_publisher_comes_back_with_another_type(bridge, connect):
    made = bridge(["/changed"])
    two = connect("ros2", "changed_two")
    listeners = {
        name: two.create_subscription("/changed", name)
        for name in (STRING, "geometry_msgs/msg/Point")
    }
    for name, value in ((STRING, {"data": "x"}), ("geometry_msgs/msg/Point", {"x": 1.0})):
        one = connect("ros1", f"changed_{len(value)}_{name[:3]}")
        talker = one.create_publisher("/changed", name)

        def heard(name=name, value=value, talker=talker):
            talker.publish(value)
            return listeners[name].wait(0.1)

        eventually(heard, timeout=30, what=lambda: str(made.status()))
        talker.close()


def test_untranslatable_type_is_logged_once(bridge, connect, caplog):
    made = bridge(["/case", "/later"])
    kind = MessageType.from_text("own_msgs/msg/Case", "int8 a\nint8 A\n", ros=1)
    one = connect("ros1", "case")
    talker = one.create_publisher("/case", kind)
    eventually(lambda: "differ only in case" in str(made.status()))
    assert "differ only in case" in relays(made)["/case", "->"].problem
    eventually(lambda: talker.subscription_count() == 0)
    # By the time that another topic is relayed, it would have been tried again.
    later = one.create_publisher("/later", STRING)
    connect("ros2", "late").create_subscription("/later", STRING)
    eventually(lambda: ("/later", "->") in begun(made))
    eventually(later.subscription_count)
    assert caplog.text.count("differ only in case") == 1


def test_closing(bridge, connect):
    """In any order, twice, with both networks gone."""
    made = bridge(["*"], ["*"])
    one, two = connect("ros1", "close_one"), connect("ros2", "close_two")
    one.create_publisher("/closing", STRING).publish(data="x")
    two.create_service_server("/closing/go", "std_srvs/srv/Trigger", lambda _: {})
    eventually(lambda: ("/closing", "->") in relays(made) and ("/closing/go", "<-") in relays(made))
    eventually(lambda: one.service_servers("/closing/go"))
    made.close()
    made.close()
    eventually(lambda: not one.service_servers("/closing/go"))
    nodes = connect("ros1", "last_bridge"), connect("ros2", "last_bridge")
    other = Bridge(*nodes, ["*"], ["*"])
    for node in nodes:
        node.close()
    other.close()


def test_the_version_in_use_is_taken(bridge, connect, router):
    """Humble's Range has no variance, Jazzy's has: who is there must understand it."""
    bridge(["/sonar"])
    node = rosglass.connect(router.url, "humble", library=Library(distribution="humble"))
    with node:
        listener = node.create_subscription("/sonar", "sensor_msgs/msg/Range")
        assert listener.type.rihs01 != rosglass.load("sensor_msgs/msg/Range").rihs01
        talker = connect("ros1", "sonar").create_publisher("/sonar", "sensor_msgs/Range")
        eventually(talker.subscription_count)

        def heard():
            talker.publish(range=1.5)
            return listener.wait(0.1)

        assert eventually(heard, timeout=15, what=lambda: listener.problem).message().range == 1.5


def test_one_thousand_messages_a_second(bridge, connect):
    """Nothing of a burst gets lost, and the order stays."""
    made = bridge(["/burst"])
    talker = connect("ros1", "burst").create_publisher("/burst", STRING, QoS(depth=2000))
    listener = connect("ros2", "burst_two").create_subscription(
        "/burst", STRING, qos=QoS(depth=2000)
    )
    eventually(lambda: talker.subscription_count() and listener.publisher_count())

    def heard():
        talker.publish(data="first")
        return listener.wait(0.2)

    eventually(heard)
    while listener.wait(0.5):
        pass
    for number in range(1000):
        talker.publish(data=str(number))
    found = [listener.wait(30).message().data for _ in range(1000)]
    assert found == [str(number) for number in range(1000)]
    assert relays(made)["/burst", "->"].dropped == 0


def test_a_single_command_from_the_shell(bridge, connect, tool):
    bridge(["*"])
    listener = connect("ros2", "once").create_subscription("/once", "geometry_msgs/msg/Twist")
    tool("rostopic", "pub", "-1", "/once", "geometry_msgs/Twist", "{linear: {x: 0.25}}")
    assert listener.wait(30).message().linear.x == 0.25
    assert listener.wait(0.5) is None


def test_a_service_called_from_the_shell(bridge, connect, tool):
    bridge(services=["*"])
    server = connect("ros2", "shell_server")
    server.create_service_server(
        "/shell/set", "std_srvs/srv/SetBool", lambda asked: {"success": asked.data, "message": "ok"}
    )
    eventually(lambda: "/shell/set" in tool("rosservice", "list"))
    assert tool("rosservice", "type", "/shell/set").strip() == "std_srvs/SetBool"
    output = tool("rosservice", "call", "/shell/set", "true")
    assert "success: True" in output
    assert "ok" in output

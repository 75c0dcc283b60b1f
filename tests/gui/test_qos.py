"""Quality of service in QML: every policy, there and back, and incompatible profiles."""

from __future__ import annotations

from typing import Any

import pytest

from rosglass.comm.qos import BEST_AVAILABLE, Durability, Liveliness, QoS, Reliability
from rosglass.comm.time import Duration

EVERY_WIRE = pytest.mark.parametrize("url", ["zenoh", "dds", "ros1"], indirect=True, scope="module")
ALL = """Ros2.QoS().reliable().transient_local().keep_last(7).deadline(250).lifespan(1500.5)
    .liveliness_manual_by_topic().liveliness_lease_duration(2000)"""


def test_a_publisher_offers_every_policy(running: Any, wait: Any) -> None:
    running.load(
        f"QtObject {{ property var p: Ros2.createPublisher('/a', 'std_msgs/msg/Bool', {ALL}) }}"
    )
    wait(lambda: running.world.publishers)
    assert running.world.publishers[0].qos == QoS(
        depth=7,
        durability=Durability.TRANSIENT_LOCAL,
        deadline=Duration(250_000_000),
        lifespan=Duration(1_500_500_000),
        liveliness=Liveliness.MANUAL_BY_TOPIC,
        lease_duration=Duration(2_000_000_000),
    )


def test_a_subscription_asks_for_what_is_available(
    running: Any, wait: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked_for: list[QoS] = []
    node = running.session.node
    create = node.create_subscription

    def subscribe(*given: Any, **options: Any) -> Any:
        asked_for.append(options["qos"])
        return create(*given, **options)

    monkeypatch.setattr(node, "create_subscription", subscribe)
    running.load(
        "Subscription { topic: '/a'; messageType: 'std_msgs/msg/Bool'; "
        "qos: Ros2.QoS().best_available() }"
    )
    wait(lambda: asked_for)
    asked = asked_for[0]
    assert asked.reliability is Reliability.BEST_AVAILABLE
    assert asked.durability is Durability.BEST_AVAILABLE
    assert asked.liveliness is Liveliness.BEST_AVAILABLE
    assert asked.deadline == asked.lease_duration == BEST_AVAILABLE


@pytest.mark.both_qt
def test_every_policy_can_be_read(bench: Any) -> None:
    read = """const q = CODE
        return [q.reliability, q.durability, q.liveliness, q.deadlineMs, q.lifespanMs, q.leaseMs]"""
    assert bench.run(read.replace("CODE", ALL)) == [
        "reliable",
        "transient_local",
        "manual_by_topic",
        250,
        1500.5,
        2000,
    ]
    left = (
        "Ros2.QoS().reliability_system_default().durability_system_default().liveliness_automatic()"
    )
    assert bench.run(read.replace("CODE", left)) == [
        "system_default",
        "system_default",
        "automatic",
        0,
        0,
        0,
    ]


@pytest.mark.both_qt
def test_a_profile_comes_back_as_it_was_given(running: Any) -> None:
    script = f"""const p = Ros2.createPublisher('/a', 'std_msgs/msg/Bool', {ALL})
        const q = p.qos
        return [q.deadlineMs, q.lifespanMs, q.leaseMs, q.liveliness, q.depth()]"""
    assert running.run(script) == [250, 1500.5, 2000, "manual_by_topic", 7]


def test_graph_shows_every_policy(running: Any, wait: Any) -> None:
    profile = QoS(deadline=Duration(10_000_000), lease_duration=Duration(20_000_000))
    running.robot.create_publisher("/a", "std_msgs/msg/Bool", profile)
    script = """const q = Ros2.getPublishersInfo('/a')[0].qos
        return [q.deadlineMs, q.lifespanMs, q.leaseMs, q.liveliness]"""
    assert running.run(script) == [10, 0, 20, "automatic"]


@pytest.mark.parametrize(
    "wrong",
    [
        "deadline(-1)",
        "deadline('soon')",
        "deadline(NaN)",
        "deadline(1e300)",
        "lifespan({})",
        "liveliness_lease_duration(undefined).deadline(null)",
    ],
)
def test_invalid_limits_are_refused(running: Any, wrong: str) -> None:
    script = f"""try {{ Ros2.createPublisher('/a', 'std_msgs/msg/Bool', Ros2.QoS().{wrong}) }}
        catch (e) {{ return e.message }}"""
    assert "milliseconds" in running.run(script)


def test_a_profile_that_clashes_is_a_problem_on_both_sides(running: Any, wait: Any) -> None:
    root: Any = running.load("""QtObject {
        property var publisher: Ros2.createPublisher(
            "/a", "std_msgs/msg/Bool", Ros2.QoS().best_effort())
        property Subscription subscription: Subscription {
            topic: "/b"; messageType: "std_msgs/msg/Bool"; qos: Ros2.QoS().reliable()
        }
        property int changes: 0
        Component.onCompleted: publisher.problemChanged.connect(() => changes += 1)
        function offered() { return publisher.problem }
        function asked() { return subscription.problem }
    }""")
    wait(lambda: running.world.publishers and running.world.subscriptions)
    assert root.offered() == root.asked() == ""
    running.robot.create_subscription("/a", "std_msgs/msg/Bool", print, QoS(depth=1))
    best_effort = QoS(depth=1, reliability=Reliability.BEST_EFFORT)
    running.robot.create_publisher("/b", "std_msgs/msg/Bool", best_effort)
    clash = "reliability: reliable requested, best effort offered"
    wait(lambda: clash in root.offered() and clash in root.asked())
    assert root.property("changes") == 1


@EVERY_WIRE
def test_ros_1_0_receives_what_was_latched_before(live: Any, wait: Any) -> None:
    """As in ROS 1, of any robot: maps and missions are published once."""
    latched = live.robot.create_publisher("/map_name", "std_msgs/msg/String", QoS.latched())
    latched.publish(data="yard")
    plain = live.robot.create_publisher("/chat", "std_msgs/msg/String", QoS.sensor_data())
    wait(lambda: len(live.session.node.publishers("/map_name")) == 1)
    live.module = "Ros 1.0"
    root: Any = live.load("""QtObject {
        id: root
        property Subscriber typed: Subscriber { topic: "/map_name"; messageType: "std_msgs/String" }
        property Subscriber found: Subscriber { topic: "/map_name"; queueSize: 0 }
        property var made: Ros.subscribe("/map_name", 1)
        property Subscriber chat: Subscriber { topic: "/chat" }
        property var texts: [typed, found, made, chat].map(s => s.message ? s.message.data : "")
        property var problems: [typed, found, made, chat].map(s => s.problem)
    }""")
    wait(lambda: root.property("texts").toVariant()[:3] == ["yard"] * 3)
    wait(lambda: plain.subscription_count() == 1)
    plain.publish(data="hello")
    wait(lambda: root.property("texts").toVariant()[3] == "hello")
    assert root.property("problems").toVariant() == [""] * 4


@EVERY_WIRE
def test_a_volatile_subscription_says_that_messages_are_kept(live: Any, wait: Any) -> None:
    latched = live.robot.create_publisher("/map_name", "std_msgs/msg/String", QoS.latched())
    latched.publish(data="yard")
    wait(lambda: len(live.session.node.publishers("/map_name")) == 1)
    root: Any = live.load("""QtObject {
        property Subscription plain: Subscription { topic: "/map_name" }
        property Subscription asking: Subscription {
            topic: "/map_name"; qos: Ros2.QoS().reliable().transient_local()
        }
        property var best: Ros2.createSubscription("/map_name", Ros2.BestAvailableQoS())
        property var texts: [plain, asking, best].map(s => s.message ? s.message.data : "")
        property string problem: plain.problem
    }""")
    if live.session.node.wire == "ros1":
        wait(lambda: root.property("texts").toVariant() == ["yard"] * 3)
        assert root.property("problem") == ""
        return
    wait(lambda: root.property("texts").toVariant()[1:] == ["yard"] * 2)
    add = "with qos: Ros2.QoS().reliable().transient_local()"
    wait(lambda: add in root.property("problem"))
    assert "of /robot are kept for late subscriptions" in root.property("problem")
    latched.publish(data="yard, again")
    wait(lambda: root.property("texts").toVariant() == ["yard, again"] * 3)
    wait(lambda: root.property("problem") == "")


def test_publishers_are_counted_that_match(running: Any, wait: Any) -> None:
    """As rclcpp's get_publisher_count()."""
    best_effort = QoS(depth=1, reliability=Reliability.BEST_EFFORT)
    running.robot.create_publisher("/b", "std_msgs/msg/Bool", best_effort)
    running.robot.create_publisher("/b", "std_msgs/msg/Bool")
    root: Any = running.load("""QtObject {
        property Subscription reliable: Subscription { topic: "/b"; qos: Ros2.QoS().reliable() }
        property Subscription any: Subscription { topic: "/b" }
        property Subscription off: Subscription { topic: "/b"; enabled: false }
        function counts() {
            return JSON.stringify([reliable, any, off].map(s => s.getPublisherCount()))
        }
    }""")
    wait(lambda: root.counts() == "[1,2,0]")


@EVERY_WIRE
def test_image_that_was_latched_before_is_shown(live: Any, wait: Any) -> None:
    picture = {"width": 1, "height": 1, "encoding": "rgb8", "step": 3, "data": [1, 2, 3]}
    publisher = live.robot.create_publisher("/plan", "sensor_msgs/msg/Image", QoS.latched())
    publisher.publish(picture)
    wait(lambda: len(live.session.node.publishers("/plan")) == 1)
    root: Any = live.load(
        """Item {
            property bool shown: plan.subscribed && !plan.stale
            ImageItem { id: view }
            ImageTransportSubscription { id: plan; topic: "/plan"; videoSink: view.videoSink }
        }""",
        "import QtQuick 2.15",
    )
    wait(lambda: root.property("shown"))

"""Quality of service, and types that only some know, on every wire of ROS 2; ROS 1 has neither."""

from __future__ import annotations

from functools import partial

import pytest
from waiting import at_rate

import rosglass
from rosglass import Duration, QoS
from rosglass.comm import Durability, Liveliness, Reliability
from rosglass.interfaces import Library
from rosglass.messages import OpaqueType

pytestmark = pytest.mark.parametrize("wire", ["local", "dds", "zenoh"], indirect=True)

TEXT, TWIST = "std_msgs/msg/String", "geometry_msgs/msg/Twist"
BEST_EFFORT = QoS(reliability=Reliability.BEST_EFFORT)
SHORT = Duration.from_seconds(0.2)


# -- profiles that do not match --------------------------------------------------------------------


def test_incompatible_profiles_are_reported_to_both_sides(
    wire, robot, console, topic, eventually, caplog
):
    subscription = console.create_subscription(topic, TEXT, qos=QoS.latched())
    publisher = robot.create_publisher(topic, TEXT, BEST_EFFORT)
    assert publisher.problem == ""
    ours, theirs, problems = [], [], []
    subscription.on_incompatible_qos(ours.append)
    publisher.on_incompatible_qos(theirs.append)
    publisher.on_problem_change(problems.append)
    for events in (ours, theirs):
        (event,) = eventually(lambda events=events: events)
        assert event.endpoint.name == topic
        assert event.policies == ("reliability", "durability")
        assert event.problem == (
            "reliability: reliable requested, best effort offered; "
            "durability: transient local requested, volatile offered"
        )
        assert event.total == 1
    for side, peer in ((subscription, "robot"), (publisher, "console")):
        problem = f"/{peer} does not match (reliability: reliable requested"
        eventually(lambda side=side, problem=problem: problem in side.problem)
    if wire.name != "zenoh":  # which leaves it to its users
        assert "nothing is received" in subscription.problem
        assert "it receives nothing from us; offer what it requests" in publisher.problem
        assert (subscription.publisher_count(), publisher.subscription_count()) == (0, 0)
        publisher.publish(data="x")
        assert subscription.wait(0.3) is None
    else:
        assert "received without that guarantee" in subscription.problem
        assert "it is served without that guarantee" in publisher.problem
        eventually(publisher.subscription_count)
        assert eventually(lambda: publisher.publish(data="x") or subscription.wait(0.1))
    assert publisher.problem in caplog.text
    # The next one lacks less.
    second = robot.create_publisher(topic, TEXT)
    eventually(lambda: len(ours) == 2)
    assert (ours[1].policies, ours[1].total) == (("durability",), 2)
    second.close()
    subscription.close()
    eventually(lambda: problems[-1:] == [""], lambda: problems)


def test_publisher_names_subscriptions_of_other_types(robot, console, topic, eventually):
    publisher = robot.create_publisher(topic, TEXT)
    console.create_subscription(topic, TWIST)
    reason = f"/console subscribes to {TWIST} here, not {TEXT}: it receives nothing"
    eventually(lambda: reason in publisher.problem, lambda: publisher.problem)
    assert publisher.subscription_count() == 0


# -- what is available -----------------------------------------------------------------------------


def test_best_available_follows_the_present_endpoints(robot, console, topic, eventually):
    robot.create_publisher(topic, TEXT, BEST_EFFORT)
    eventually(lambda: console.publishers(topic))
    subscription = console.create_subscription(topic, TEXT, qos=QoS.best_available(7))
    assert subscription.qos == QoS(7, Reliability.BEST_EFFORT)
    alone = console.create_publisher(f"{topic}_other", TEXT, QoS.best_available())
    assert alone.qos == QoS.latched(10)
    usual = console.create_subscription(f"{topic}_third", TEXT, qos=QoS.system_default())
    assert usual.qos == QoS()


def test_best_available_adapts_to_new_endpoints(robot, console, topic, eventually):
    latched = robot.create_publisher(topic, TEXT, QoS.latched())
    latched.publish(data="kept")
    eventually(lambda: console.publishers(topic))
    subscription = console.create_subscription(topic, TEXT, qos=QoS.best_available())
    assert subscription.qos.durability is Durability.TRANSIENT_LOCAL
    assert subscription.wait(30).message().data == "kept"
    fast = robot.create_publisher(topic, TEXT, BEST_EFFORT)
    eventually(lambda: subscription.qos == BEST_EFFORT)
    eventually(lambda: fast.subscription_count() == 1)
    assert subscription.publisher_count() == 2
    received = []

    def arrived():
        fast.publish(data="fast")
        while (sample := subscription.take()) is not None:
            received.append(sample.message().data)
        return "fast" in received

    eventually(arrived)
    latched.publish(data="more")
    while "more" not in received:
        received.append(subscription.wait(30).message().data)
    assert received.count("more") == 1
    assert "kept" not in received, "what was received once does not come again"
    assert subscription.problem == ""


def test_publisher_with_best_available_serves_every_subscription(robot, console, topic, eventually):
    strict = console.create_subscription(topic, TEXT, qos=QoS.latched())
    loose = console.create_subscription(topic, TEXT, qos=BEST_EFFORT)
    eventually(lambda: len(robot.subscriptions(topic)) == 2)
    publisher = robot.create_publisher(topic, TEXT, QoS.best_available())
    eventually(lambda: publisher.subscription_count() == 2)
    assert publisher.problem == ""
    received = set()

    def arrived():
        publisher.publish(data="x")
        received.update(s for s in (strict, loose) if s.take() is not None)
        return len(received) == 2

    eventually(arrived)


# -- liveliness ------------------------------------------------------------------------------------


def test_manual_liveliness_is_kept_by_showing_it_and_lost_by_silence(
    wire, robot, console, topic, eventually
):
    manual = QoS(liveliness=Liveliness.MANUAL_BY_TOPIC, lease_duration=SHORT)
    subscription = console.create_subscription(topic, TEXT, qos=manual)
    publisher = robot.create_publisher(topic, TEXT, manual)
    changes, lost = [], []
    subscription.on_liveliness_change(changes.append)
    publisher.on_liveliness_lost(lost.append)
    eventually(publisher.subscription_count)
    # Only DDS has a word for it; elsewhere, messages are what shows it.
    show = (
        publisher.assert_liveliness if wire.name == "dds" else partial(publisher.publish, data="x")
    )

    def alive():
        show()
        return bool(changes) and changes[-1].alive == 1

    eventually(alive)
    count = len(changes)
    for _ in at_rate(0.02, 30):
        show()
    assert len(changes) == count or changes[-1].alive == 1
    eventually(lambda: changes[-1].change == -1 and lost)
    assert (changes[-1].alive, changes[-1].not_alive) == (0, 1)
    publisher.publish(data="x")
    eventually(lambda: changes[-1].change == 1)


# -- several types, and unknown ones ---------------------------------------------------------------


def test_several_types_on_one_topic(robot, console, topic, eventually):
    texts, twists = (robot.create_publisher(topic, name) for name in (TEXT, TWIST))
    # Over DDS, publishers are seen before their node's name is.
    eventually(lambda: [end.node.full for end in console.publishers(topic)] == ["/robot"] * 2)
    unsure = console.create_subscription(topic)
    problem = eventually(lambda: unsure.problem)
    assert f"published with several types ({TWIST} by /robot, {TEXT} by /robot)" in problem
    assert f"create_subscription('{topic}', '{TWIST}')" in problem
    assert unsure.type is None
    chosen = {name: console.create_subscription(topic, name) for name in (TEXT, TWIST)}
    eventually(lambda: texts.subscription_count() == twists.subscription_count() == 1)
    received = {}

    def arrived():
        texts.publish(data="x")
        twists.publish(linear={"x": 2.0})
        for name, subscription in chosen.items():
            sample = subscription.take()
            if sample is not None:
                received[name] = sample.message()
        return len(received) == 2

    eventually(arrived)
    assert received[TEXT].data == "x"
    assert received[TWIST].linear.x == 2.0
    texts.close()
    eventually(lambda: unsure.type and unsure.type.name == TWIST)
    eventually(lambda: unsure.problem == "")


def test_relay_passes_on_a_type_that_it_does_not_know(connect, topic, eventually):
    library = Library()
    library.add_text("secret_msgs/msg/Thing", "string text\nint32[] numbers\n")
    secret = rosglass.load("secret_msgs/msg/Thing", library=library)
    source, relay, sink = connect("source"), connect("relay"), connect("sink")
    first = source.create_publisher(f"{topic}/a", secret)
    taken = relay.create_subscription(f"{topic}/a", OpaqueType(secret.name))
    value = {"text": "x", "numbers": [1, 2, 3]}
    sample = eventually(lambda: first.publish(value) or taken.wait(0.1))
    assert sample.type == OpaqueType(secret.name, secret.rihs01)
    with pytest.raises(rosglass.TypeNotFoundError, match="only bytes"):
        sample.message()
    second = relay.create_publisher(f"{topic}/b", sample.type)
    with pytest.raises(rosglass.TypeNotFoundError, match="only bytes"):
        second.publish(text="x")
    final = sink.create_subscription(f"{topic}/b", secret)
    (endpoint,) = eventually(lambda: sink.publishers(f"{topic}/b"))
    assert (endpoint.type, endpoint.type_hash) == (secret.name, secret.rihs01)
    eventually(second.subscription_count)
    got = eventually(lambda: second.publish_serialized(sample) or final.wait(0.1))
    assert got.message() == secret.create(value)
    assert final.problem == ""
    relay.create_publisher(f"{topic}/c", OpaqueType(secret.name)).publish_serialized(sample)
    other_hash = "RIHS01_" + "b" * 64
    other = relay.create_publisher(f"{topic}/d", OpaqueType(secret.name, other_hash))
    reason = f"{topic}/d: type hash: .*{other_hash}.*{secret.rihs01}"
    with pytest.raises(rosglass.ConversionError, match=reason):
        other.publish_serialized(sample)

"""Quality of service, events, relays and local delivery, the same over Zenoh and DDS."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial

import pytest
from waiting import at_rate, eventually

import rosglass
from rosglass import Duration, QoS
from rosglass.comm import IMMEDIATE, Durability, Liveliness, Reliability
from rosglass.interfaces import Library
from rosglass.messages import OpaqueType

STRING, TWIST = "std_msgs/msg/String", "geometry_msgs/msg/Twist"
BEST_EFFORT = QoS(reliability=Reliability.BEST_EFFORT)
SHORT = Duration.from_seconds(0.2)

pytestmark = pytest.mark.peers


@pytest.fixture(params=["zenoh", "dds"])
def world(request):
    return request.param


@pytest.fixture
def link(world, request):
    """Connect a node to the world: ``link("name")``."""
    if world == "dds":
        return request.getfixturevalue("dds_connect")
    # Each test has topics of its own, but not each world: a domain of its own does it.
    return partial(request.getfixturevalue("connect"), options="?domain=11")


@pytest.fixture
def nodes(link):
    return link("talker"), link("listener")


@pytest.fixture
def topic(request):
    """A topic that no other test uses."""
    return f"/{request.node.originalname}"


def told(events):
    # Over DDS an endpoint is seen before the name of its node.
    return [(e.change, e.count) for e in events]


def test_both_sides_tell_who_comes_and_goes(nodes, topic):
    talker, listener = nodes
    subscription = listener.create_subscription(topic, STRING)
    ours, theirs = [], []
    subscription.on_matched(ours.append)
    publisher = talker.create_publisher(topic, STRING)
    publisher.on_matched(theirs.append)
    eventually(lambda: told(ours) == told(theirs) == [(1, 1)])
    assert ours[0].endpoint.gid == listener.publishers(topic)[0].gid
    assert theirs[0].endpoint.gid == talker.subscriptions(topic)[0].gid
    assert (subscription.publisher_count(), publisher.subscription_count()) == (1, 1)
    publisher.close()
    eventually(lambda: told(ours)[1:] == [(-1, 0)])
    second = talker.create_publisher(topic, STRING)
    eventually(lambda: told(ours)[2:] == [(1, 1)])
    second.on_matched(theirs.append)
    eventually(lambda: told(theirs)[1:] == [(1, 1)])
    subscription.close()
    eventually(lambda: told(theirs)[2:] == [(-1, 0)])


def test_profiles_that_do_not_match_are_told_to_both(world, nodes, topic):
    talker, listener = nodes
    wanted = QoS.latched()
    subscription = listener.create_subscription(topic, STRING, qos=wanted)
    publisher = talker.create_publisher(topic, STRING, BEST_EFFORT)
    ours, theirs = [], []
    subscription.on_incompatible_qos(ours.append)
    publisher.on_incompatible_qos(theirs.append)
    for events in (ours, theirs):
        (event,) = eventually(lambda events=events: events)
        assert event.endpoint.name == topic
        assert event.policies == ("reliability", "durability")
    for side, peer in ((subscription, "talker"), (publisher, "listener")):
        problem = f"/{peer} does not match (reliability: reliable requested"
        eventually(lambda side=side, problem=problem: problem in side.problem)
    if world == "dds":
        assert "nothing is received" in subscription.problem
        assert (subscription.publisher_count(), publisher.subscription_count()) == (0, 0)
        publisher.publish(data="x")
        assert subscription.wait(0.3) is None
    else:
        assert "without that guarantee" in subscription.problem
        eventually(publisher.subscription_count)

        def arrived():
            publisher.publish(data="x")
            return subscription.wait(0.1)

        eventually(arrived)


def test_what_is_available_adapts_to_who_comes(nodes, topic):
    talker, listener = nodes
    latched = talker.create_publisher(topic, STRING, QoS.latched())
    latched.publish(data="kept")
    eventually(lambda: listener.publishers(topic))
    subscription = listener.create_subscription(topic, STRING, qos=QoS.best_available())
    assert subscription.qos.durability is Durability.TRANSIENT_LOCAL
    assert subscription.wait(30).message().data == "kept"
    fast = talker.create_publisher(topic, STRING, BEST_EFFORT)
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


def test_a_publisher_of_what_is_available_serves_everybody(nodes, topic):
    talker, listener = nodes
    strict = listener.create_subscription(topic, STRING, qos=QoS.latched())
    loose = listener.create_subscription(topic, STRING, qos=BEST_EFFORT)
    eventually(lambda: len(talker.subscriptions(topic)) == 2)
    publisher = talker.create_publisher(topic, STRING, QoS.best_available())
    eventually(lambda: publisher.subscription_count() == 2)
    assert publisher.problem == ""
    received = set()

    def arrived():
        publisher.publish(data="x")
        received.update(s for s in (strict, loose) if s.take() is not None)
        return len(received) == 2

    eventually(arrived)


def test_deadlines_are_watched_on_both_sides(nodes, topic):
    talker, listener = nodes
    qos = QoS(deadline=SHORT)
    subscription = listener.create_subscription(topic, STRING, qos=qos)
    publisher = talker.create_publisher(topic, STRING, qos)
    eventually(publisher.subscription_count)
    publisher.publish(data="x")
    missed, skipped = [], []
    subscription.on_deadline_missed(missed.append)
    publisher.on_deadline_missed(skipped.append)
    eventually(lambda: len(missed) >= 2 and len(skipped) >= 2)
    assert missed[-1].total == sum(event.change for event in missed)


def test_manual_liveliness_is_kept_by_sending_and_lost_by_silence(world, nodes, topic):
    talker, listener = nodes
    manual = QoS(liveliness=Liveliness.MANUAL_BY_TOPIC, lease_duration=SHORT)
    subscription = listener.create_subscription(topic, STRING, qos=manual)
    publisher = talker.create_publisher(topic, STRING, manual)
    changes, lost = [], []
    subscription.on_liveliness_change(changes.append)
    publisher.on_liveliness_lost(lost.append)
    eventually(publisher.subscription_count)
    show = publisher.assert_liveliness if world == "dds" else partial(publisher.publish, data="x")

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


def test_a_relay_passes_on_a_type_that_it_does_not_know(link, topic):
    library = Library()
    library.add_text("secret_msgs/msg/Thing", "string text\nint32[] numbers\n")
    secret = rosglass.load("secret_msgs/msg/Thing", library=library)
    source, relay, sink = link("source"), link("relay"), link("sink")
    first = source.create_publisher(f"{topic}/a", secret)
    taken = relay.create_subscription(f"{topic}/a", OpaqueType(secret.name))
    sample = None
    value = {"text": "x", "numbers": [1, 2, 3]}

    def arrived():
        nonlocal sample
        first.publish(value)
        sample = taken.wait(0.1)
        return sample

    eventually(arrived)
    assert sample.type == OpaqueType(secret.name, secret.rihs01)
    with pytest.raises(rosglass.TypeNotFoundError, match="only bytes"):
        sample.message()
    second = relay.create_publisher(f"{topic}/b", sample.type)
    final = sink.create_subscription(f"{topic}/b", secret)
    (endpoint,) = eventually(lambda: sink.publishers(f"{topic}/b"))
    assert (endpoint.type, endpoint.type_hash) == (secret.name, secret.rihs01)
    eventually(second.subscription_count)
    got = None

    def passed_on():
        nonlocal got
        second.publish_serialized(sample)
        got = final.wait(0.1)
        return got

    eventually(passed_on)
    assert got.message() == secret.create(value)
    assert final.problem == ""


def test_local_messages_come_once_and_can_be_left_out(link, topic):
    first, second = link("first"), link("second")
    publisher = first.create_publisher(topic, STRING, 100)
    seen = {"own": [], "other": [], "never": []}
    arguments = {"qos": 100, "executor": IMMEDIATE}
    for name, node in (("own", first), ("other", second), ("never", first)):
        node.create_subscription(
            topic,
            STRING,
            lambda m, name=name: seen[name].append(m.data),
            ignore_local=name == "never",
            **arguments,
        )
    eventually(lambda: publisher.subscription_count() == 3)
    for node in (first, second):
        eventually(lambda node=node: node.publishers(topic))

    def linked():
        publisher.publish(data="ready?")
        return seen["own"] and seen["other"]

    eventually(linked)
    texts = [str(number) for number in range(20)]
    for text in texts:
        publisher.publish(data=text)
    for name in ("own", "other"):
        eventually(lambda name=name: "19" in seen[name])
    # A second copy of any would come before this.
    publisher.publish(data="end")
    texts.append("end")
    for name in ("own", "other"):
        eventually(lambda name=name: "end" in seen[name])
    for name in ("own", "other"):
        assert [text for text in seen[name] if text != "ready?"] == texts
    assert seen["never"] == []


def test_several_types_on_one_topic(nodes, topic):
    talker, listener = nodes
    texts, twists = (talker.create_publisher(topic, name) for name in (STRING, TWIST))
    eventually(lambda: len(listener.publishers(topic)) == 2)
    unsure = listener.create_subscription(topic)
    eventually(lambda: "published with several types" in unsure.problem)
    chosen = {name: listener.create_subscription(topic, name) for name in (STRING, TWIST)}
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
    assert received[STRING].data == "x"
    assert received[TWIST].linear.x == 2.0
    texts.close()
    eventually(lambda: unsure.type and unsure.type.name == TWIST)


def test_the_last_message_of_a_topic_comes_at_once(nodes, topic):
    talker, listener = nodes
    qos = replace(QoS.latched(), deadline=Duration.from_seconds(60))
    talker.create_publisher(topic, STRING, qos).publish(data="kept")
    eventually(lambda: listener.publishers(topic))
    assert listener.wait_for_message(topic, timeout=30).data == "kept"
    with pytest.raises(rosglass.TimeoutError, match=f"nobody publishes {topic}_; did you mean"):
        listener.wait_for_message(f"{topic}_", timeout=0.1)


def test_what_nobody_waits_for_is_there_when_somebody_looks(nodes, topic):
    talker, listener = nodes
    publisher = talker.create_publisher(topic, STRING)
    subscription = listener.create_subscription(topic, STRING, qos=1)
    eventually(publisher.subscription_count)
    began = time.monotonic()
    behind = []
    for number in at_rate(0.005, 500):
        publisher.publish(data=str(number))
        if number % 50 == 49:
            sample = subscription.take()
            if sample is not None:
                behind.append(number - int(sample.message().data))
    assert behind
    assert sorted(behind)[len(behind) // 2] <= 10, "the newest, although nobody was waiting"
    statistics = subscription.statistics()
    assert statistics.received >= 0.9 * 500
    frequency = 500 / (time.monotonic() - began)
    assert statistics.frequency == pytest.approx(frequency, rel=0.3)
    assert statistics.lost == 0
    assert statistics.latency.seconds < 2

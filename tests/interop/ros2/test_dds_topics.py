"""Topics over DDS, both ways: Cyclone DDS's own Python API with real types, and dora-rs."""

from __future__ import annotations

import importlib.util
import json
import pickle
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from waiting import at_rate, eventually

import rosglass
from rosglass.comm import IMMEDIATE, Durability, Duration, History, QoS, Reliability

PEERS = Path(__file__).parent / "peers"
STRING, INT32 = "std_msgs/msg/String", "std_msgs/msg/Int32"
TWIST, IMAGE = "geometry_msgs/msg/Twist", "sensor_msgs/msg/Image"
TYPES = [STRING, TWIST, IMAGE]
KEEP_ALL = QoS(history=History.KEEP_ALL)
BEST_EFFORT = QoS(reliability=Reliability.BEST_EFFORT)

pytestmark = pytest.mark.peers


@pytest.fixture
def cyclone(start, dds_domain):
    """Start Cyclone DDS's own API in the module's domain; ended after the test."""
    started = []

    def cyclone(**plan: Any) -> Any:
        plan["domain"] = dds_domain
        process = start(str(PEERS / "cyclone_topics_peer.py"), json.dumps(plan))
        started.append(process)
        process.event("ready")
        return process

    yield cyclone
    for process in started:
        process.end()


@pytest.fixture(scope="module", params=["cyclone", "dora"])
def both_ways(request, start, dds_domain, interfaces):
    """A peer that publishes and subscribes to everything."""
    script = {"cyclone": "cyclone_topics_peer.py", "dora": "dora_peer.py"}[request.param]
    if request.param == "dora" and importlib.util.find_spec("dora") is None:
        pytest.skip('dora-rs is not installed: pip install "rosglass[peers]"')
    plan = {
        "domain": dds_domain,
        "profile": "dds",
        "interfaces": str(interfaces),
        "publish": {topic("from", name): name for name in TYPES},
        "subscribe": {topic("to", name): name for name in TYPES},
    }
    process = start(str(PEERS / script), json.dumps(plan))
    process.event("ready")
    yield process
    process.end()


def topic(direction: str, type_name: str) -> str:
    return f"/{direction}/{type_name.rpartition('/')[2].lower()}"


def understood(sample: Any) -> bool:
    try:
        sample.type.validate(sample.data)
    except rosglass.DecodeError:
        return False
    return True


def linked(publisher: Any) -> Any:
    """Wait until a publisher has a subscription, also on the wire."""
    eventually(publisher.subscription_count, what="a subscription")
    time.sleep(0.2)
    return publisher


# -- with peers ----------------------------------------------------------------------------------


@pytest.mark.parametrize("type_name", TYPES)
def test_we_receive_what_the_peer_publishes(dds_connect, both_ways, type_name, peer_values):
    node = dds_connect("cockpit")
    subscription = node.create_subscription(topic("from", type_name), type_name)
    sample = subscription.wait(30)
    assert sample is not None, (
        subscription.problem,
        node.status(),
        node.publishers(subscription.topic),
        both_ways.output,
    )
    sample.type.validate(sample.data)
    received = peer_values.summary(sample.message().to_dict())
    assert received == peer_values.summary(peer_values.VALUES[type_name])
    assert 0 <= (sample.received - sample.sent).seconds < 30
    following = subscription.wait(30)
    assert following.publisher == sample.publisher
    assert len(sample.publisher) == 16
    assert [end.gid for end in node.publishers(subscription.topic)] == [sample.publisher]


@pytest.mark.parametrize("type_name", TYPES)
def test_the_peer_receives_what_we_publish(dds_connect, both_ways, type_name, peer_values):
    publisher = dds_connect("cockpit").create_publisher(topic("to", type_name), type_name)
    eventually(publisher.subscription_count, what="the peer's subscription in our graph")
    received: dict[str, Any] = {}

    def arrived():
        publisher.publish(peer_values.VALUES[type_name])
        while not both_ways.events.empty():
            event = both_ways.events.get()
            received[event.get("received")] = event.get("value")
        return publisher.topic in received

    eventually(arrived, what=lambda: f"our message at the peer, which said: {both_ways.output}")
    assert received[publisher.topic] == peer_values.summary(peer_values.VALUES[type_name])


def test_the_last_message_of_a_latched_peer_comes_late_but_comes(dds_connect, cyclone):
    plan = {"qos": {"latched": True, "depth": 2}, "texts": True, "count": 5, "period": 0}
    process = cyclone(publish={"/latched": STRING}, **plan)
    process.event("published")
    node = dds_connect("late")
    early = node.create_subscription("/latched", STRING)
    eventually(early.publisher_count, what="the peer's publisher")
    # Only as long as no other reader in this process asks for latched data: until it has heard how
    # far the peer is, Cyclone DDS gives one reader what is sent again for another.
    assert early.wait(0.5) is None
    latched = node.create_subscription("/latched", STRING, qos=QoS.latched(10))
    wanted = [latched.wait(30).message().data for _ in range(2)]
    assert wanted == ["3", "4"]
    assert latched.wait(0.3) is None


def test_our_last_latched_message_reaches_a_late_peer(dds_connect, cyclone):
    publisher = dds_connect("cockpit").create_publisher("/map", STRING, QoS.latched(2))
    for text in ("gone", "second", "last"):
        publisher.publish(data=text)
    process = cyclone(subscribe={"/map": STRING}, qos={"latched": True, "depth": 0})
    received = [process.event("value")["data"] for _ in range(2)]
    assert received == ["second", "last"]


@pytest.mark.parametrize("qos", [{"best_effort": True}, {}, {"deadline": 1, "lease": 1}])
def test_profiles_that_match_exchange_everything(dds_connect, cyclone, qos):
    ours = QoS(
        reliability=Reliability.BEST_EFFORT if "best_effort" in qos else Reliability.RELIABLE,
        history=History.KEEP_ALL,
        deadline=Duration.from_seconds(1) if "deadline" in qos else None,
        lease_duration=Duration.from_seconds(1) if "lease" in qos else None,
    )
    # Readers and writers that keep less than all lose samples when a machine is busy.
    plan = {"texts": True, "count": 50, "period": 0.002, "asked": True, "qos": {"depth": 0, **qos}}
    process = cyclone(publish={"/a": STRING}, subscribe={"/b": STRING}, **plan)
    node = dds_connect("cockpit")
    subscription = node.create_subscription("/a", STRING, qos=ours)
    publisher = node.create_publisher("/b", STRING, ours)
    eventually(lambda: subscription.publisher_count() and publisher.subscription_count())
    process.event("linked")
    process.ask(begin=True)
    for number in at_rate(0.002, 50):
        publisher.publish(data=str(number))
    expected = [str(number) for number in range(50)]
    assert [process.event("value")["data"] for _ in expected] == expected
    assert [subscription.wait(30).message().data for _ in expected] == expected


@pytest.mark.parametrize(
    ("offered", "requested", "policy"),
    [
        ({"best_effort": True}, QoS(), "reliability"),
        ({}, QoS.latched(), "durability"),
        ({}, QoS(deadline=Duration.from_seconds(1)), "deadline"),
        ({"xcdr2": True}, QoS(), "data representation: XCDR2 alone offered"),
    ],
)
def test_profiles_that_do_not_match_are_explained(dds_connect, cyclone, offered, requested, policy):
    cyclone(publish={"/odd": STRING}, qos=offered)
    subscription = dds_connect("cockpit").create_subscription("/odd", STRING, qos=requested)
    problem = eventually(lambda: subscription.problem, what="an explanation")
    assert policy in problem
    assert "nothing is received" in problem
    assert subscription.wait(0.3) is None
    assert subscription.publisher_count() == 0


def test_a_subscription_with_another_encoding_is_explained(dds_connect, cyclone):
    cyclone(subscribe={"/odd": STRING}, qos={"xcdr2": True})
    publisher = dds_connect("cockpit").create_publisher("/odd", STRING)
    problem = eventually(lambda: publisher.problem, what="an explanation")
    assert "data representation: XCDR2 alone requested" in problem
    assert "it receives nothing from us" in problem
    assert publisher.subscription_count() == 0


def test_old_samples_are_not_delivered_after_their_lifespan(dds_connect, cyclone):
    brief = QoS(
        depth=5,
        durability=Durability.TRANSIENT_LOCAL,
        lifespan=Duration.from_seconds(0.5),
    )
    publisher = dds_connect("cockpit").create_publisher("/brief", STRING, brief)
    publisher.publish(data="old")
    time.sleep(0.6)
    process = cyclone(subscribe={"/brief": STRING}, qos={"latched": True})
    eventually(publisher.subscription_count)
    publisher.publish(data="new")
    assert process.event("value")["data"] == "new"


def test_another_type_on_the_topic_is_named_and_not_received(dds_connect, cyclone):
    cyclone(publish={"/mixed": INT32})
    cyclone(publish={"/mixed": STRING})
    subscription = dds_connect("cockpit").create_subscription("/mixed", STRING)
    problem = eventually(lambda: INT32 in subscription.problem and subscription.problem)
    assert STRING in problem
    texts = {subscription.wait(30).message().data for _ in range(10)}
    assert texts == {"Grüße, robot"}


def test_rubbish_is_refused_and_does_not_affect_others(dds_connect, cyclone, caplog):
    # Where a text should begin with its length, there is one beyond the end.
    cyclone(publish={"/noisy": STRING}, rubbish=[0, 1, 50, 5000], period=0.02)
    cyclone(publish={"/noisy": STRING}, period=0.02)
    node = dds_connect("cockpit")
    texts: list[str] = []
    node.create_subscription("/noisy", STRING, lambda message: texts.append(message.data))
    refused: list[bool] = []
    node.create_subscription(
        "/noisy", STRING, raw_callback=lambda sample: refused.append(not understood(sample))
    )
    eventually(lambda: texts.count("Grüße, robot") >= 20 and sum(refused) > 10)
    assert set(texts) == {"Grüße, robot"}
    warnings = [record for record in caplog.records if "/noisy" in record.getMessage()]
    assert 1 <= len(warnings) <= 2


def test_a_peer_that_is_killed_leaves_and_another_takes_over(dds_connect, cyclone):
    subscription = dds_connect("cockpit").create_subscription("/relay", STRING)
    first = cyclone(publish={"/relay": STRING}, period=0.01)
    one = subscription.wait(30)
    first.end()
    while subscription.wait(0.5) is not None:
        pass
    cyclone(publish={"/relay": STRING}, period=0.01)
    two = subscription.wait(30)
    assert two is not None
    assert two.publisher != one.publisher


# -- between our own ------------------------------------------------------------------------------


def test_big_messages_arrive_whole_and_are_not_copied(dds_connect):
    subscription = dds_connect("screen").create_subscription("/camera", IMAGE, qos=KEEP_ALL)
    publisher = linked(dds_connect("robot").create_publisher("/camera", IMAGE, KEEP_ALL))
    pixels = np.random.default_rng(1).integers(0, 256, 6_220_800, np.uint8)
    fields = {"height": 1080, "width": 1920, "step": 5760, "encoding": "rgb8"}
    for _ in range(3):
        publisher.publish(data=pixels, **fields)
    samples = [subscription.wait(30) for _ in range(3)]
    for sample in samples:
        assert isinstance(sample.data, memoryview)
        assert sample.data.readonly
        message = sample.message()
        assert np.shares_memory(message.data, np.frombuffer(sample.data, np.uint8))
        assert np.array_equal(message.data, pixels)
        assert message.width == 1920
    kept = pickle.loads(pickle.dumps(samples[0]))
    assert kept == samples[0]
    assert hash(kept.data) == hash(samples[0].data)


def test_best_effort_is_fresh(dds_connect):
    got: list[int] = []
    dds_connect("hears").create_subscription(
        "/scan",
        STRING,
        raw_callback=lambda sample: got.append(sample.received_ns - sample.sent_ns),
        qos=BEST_EFFORT,
        executor=IMMEDIATE,
    )
    publisher = linked(dds_connect("talks").create_publisher("/scan", STRING, BEST_EFFORT))
    for _ in at_rate(0.005, 50):
        publisher.publish(data="x")
    eventually(lambda: len(got) == 50)
    assert sorted(got)[25] < 1_000_000_000

"""Publishing and subscribing, on every wire."""

from __future__ import annotations

import asyncio
import re
import threading
import time

import numpy as np
import pytest
from waiting import at_rate

import rosglass
from rosglass import Duration, QoS
from rosglass.comm import IMMEDIATE, History, Liveliness, LivelinessLost, Matched, NodeName, Sample

TEXT, TWIST, IMAGE = "std_msgs/msg/String", "geometry_msgs/msg/Twist", "sensor_msgs/msg/Image"
HEADER = "std_msgs/msg/Header"
KEEP_ALL = QoS(history=History.KEEP_ALL)


@pytest.fixture
def link(robot, console, topic, eventually):
    """Make a publisher of the robot and a subscription of the console that are connected."""

    def link(kind=TEXT, callback=None, qos=10, **options):
        subscription = console.create_subscription(topic, kind, callback, qos, **options)
        publisher = robot.create_publisher(topic, kind or TEXT, qos)
        eventually(
            lambda: publisher.subscription_count() and subscription.publisher_count(),
            lambda: (publisher.problem, subscription.problem, subscription.hint),
        )
        return publisher, subscription

    return link


def test_messages_come_once_and_in_order_and_none_is_lost_at_full_speed(link, eventually):
    received = []
    publisher, subscription = link(
        callback=lambda message: received.append(message.data), qos=KEEP_ALL
    )
    for number in range(5000):
        publisher.publish(data=str(number))
    eventually(lambda: len(received) >= 5000, lambda: len(received))
    assert received == [str(number) for number in range(5000)]
    assert subscription.statistics().dropped == 0


def test_messages_of_several_publishers_arrive_in_order(connect, robot, console, topic, eventually):
    subscription = console.create_subscription(topic, TEXT, qos=KEEP_ALL)
    publishers = [
        node.create_publisher(topic, TEXT, KEEP_ALL)
        for node in (robot, robot, connect("other"), console)
    ]
    eventually(lambda: all(publisher.subscription_count() for publisher in publishers))
    eventually(lambda: subscription.publisher_count() >= 3)  # ROS 1 counts two of a node as one
    for number in range(50):
        for index, publisher in enumerate(publishers):
            publisher.publish(data=f"{index} {number}")
    heard = [subscription.wait(30).message().data for _ in range(200)]
    for index in range(4):
        own = [text for text in heard if text.startswith(f"{index} ")]
        assert own == [f"{index} {number}" for number in range(50)]


def test_node_receives_its_own_messages(robot, topic, eventually):
    subscription = robot.create_subscription(topic, TEXT)
    publisher = robot.create_publisher(topic, TEXT)
    eventually(lambda: publisher.subscription_count() == 1)
    for text in ("hello", "end"):  # a second copy of the first would come before this
        publisher.publish(data=text)
        assert subscription.wait(30).message().data == text


def test_image_outlives_the_node_that_received_it(link, console):
    publisher, subscription = link(IMAGE)
    publisher.publish(data=np.arange(100_000, dtype=np.uint8))
    pixels = subscription.wait(30).message().data
    console.close()
    publisher.close()
    assert np.array_equal(pixels, np.arange(100_000, dtype=np.uint8))


@pytest.mark.parametrize("given", ["fields", "dict", "message", "bytes", "sample"])
def test_all_forms_of_messages_can_be_published(link, wire, given):
    publisher, subscription = link(TWIST)
    message = publisher.type.create(linear={"x": 1.5})
    if given == "fields":
        publisher.publish(linear={"x": 1.5})
    elif given == "dict":
        publisher.publish({"linear": {"x": 1.5}})
    elif given == "message":
        publisher.publish(message)
    else:
        publisher.publish_serialized(publisher.type.encode(message, wire=publisher_wire(wire)))
    sample = subscription.wait(30)
    if given == "sample":
        publisher.publish_serialized(sample)
        sample = subscription.wait(30)
    assert sample.message().linear.x == 1.5
    assert sample.type.name == TWIST


def publisher_wire(wire):
    return "ros1" if wire.is_ros1 else "cdr"


@pytest.mark.parametrize(
    ("arguments", "fields", "message"),
    [
        ((None,), {}, "a message, a dict or keyword fields"),
        (({"data": 7},), {}, "data: expected"),
        (({"text": "x"},), {}, "text"),
        (({"data": "x"},), {"data": "y"}, "either a message or keyword fields"),
        (("hello",), {}, "expected"),
    ],
)
def test_invalid_message_is_refused_and_not_sent(link, arguments, fields, message):
    publisher, subscription = link()
    with pytest.raises(rosglass.ConversionError, match=message):
        publisher.publish(*arguments, **fields)
    publisher.publish(data="next")
    assert subscription.wait(30).message().data == "next"


@pytest.mark.parametrize("data", ["text", None, 3])
def test_only_bytes_and_samples_are_sent_as_they_are(robot, topic, data):
    publisher = robot.create_publisher(topic, TEXT)
    with pytest.raises(rosglass.ConversionError, match=f"{TEXT}.* bytes"):
        publisher.publish_serialized(data)


def test_buffer_may_be_reused_as_soon_as_it_is_sent(link, wire):
    publisher, subscription = link()
    buffer = bytearray(publisher.type.encode({"data": "first"}, wire=publisher_wire(wire)))
    publisher.publish_serialized(memoryview(buffer))
    buffer[-6:] = bytes(6)
    assert subscription.wait(30).message().data == "first"


def test_sample_of_another_type_is_not_passed_on(link, robot, topic):
    publisher, subscription = link()
    publisher.publish(data="x")
    sample = subscription.wait(30)
    with pytest.raises(rosglass.ConversionError, match=f"expected a sample of {TWIST}"):
        robot.create_publisher(f"{topic}_other", TWIST).publish_serialized(sample)
    other = "cdr" if sample.wire == "ros1" else "ros1"
    with pytest.raises(rosglass.ConversionError, match=f"wire: .*{other}"):
        publisher.publish_serialized(sample._replace(wire=other))
    assert subscription.wait(0.1) is None


def test_closed_publisher_raises(link, eventually):
    publisher, subscription = link()
    publisher.close()
    publisher.close()
    for use in (
        lambda: publisher.publish(data="x"),
        lambda: publisher.publish_serialized(b"x"),
        publisher.assert_liveliness,
    ):
        with pytest.raises(rosglass.NodeClosedError, match="is closed; create another one"):
            use()
    assert publisher.subscription_count() == 0
    assert publisher.hint == ""
    eventually(lambda: subscription.publisher_count() == 0)


def test_subscription_without_type_takes_the_publishers(link, eventually):
    received = []
    publisher, subscription = link(None, received.append)
    publisher.publish(data="hello")
    eventually(lambda: received)
    assert subscription.type.name == TEXT
    assert received[0].data == "hello"


def test_subscription_without_type_waits_for_the_first_publisher(robot, console, topic, eventually):
    subscription = console.create_subscription(topic)
    assert subscription.type is None
    assert "has no publisher" in eventually(lambda: subscription.hint)
    robot.create_publisher(topic, TEXT, QoS.latched()).publish(data="first")
    eventually(lambda: subscription.type is not None)
    assert subscription.type.name == TEXT


def test_latched_message_reaches_late_subscriptions(robot, console, topic):
    publisher = robot.create_publisher(topic, TEXT, QoS.latched())
    publisher.publish(data="old")
    publisher.publish(data="latest")
    for _ in range(2):
        with console.create_subscription(topic, TEXT, qos=QoS.latched()) as subscription:
            assert subscription.wait(30).message().data == "latest"
    assert console.wait_for_message(topic, timeout=30).data == "latest"


def test_big_messages_come_whole(link):
    # Zenoh drops a big message for a receiver under load that does not keep all.
    publisher, subscription = link(IMAGE, qos=KEEP_ALL)
    data = bytes(range(256)) * 12000
    publisher.publish(width=1000, height=1024, step=3000, encoding="rgb8", data=data)
    message = subscription.wait(30).message()
    assert (message.width, len(message.data)) == (1000, len(data))
    assert bytes(message.data) == data


def test_raw_callback_gets_bytes_and_stamps(link, eventually, wire):
    received = []
    publisher, _ = link(raw_callback=received.append)
    publisher.publish(data="x")
    eventually(lambda: received)
    sample = received[0]
    assert isinstance(sample, Sample)
    assert sample.wire == publisher_wire(wire)
    assert bytes(sample.data) == bytes(publisher.type.encode({"data": "x"}, wire=sample.wire))
    assert sample.received_ns > 1_600_000_000_000_000_000


def test_callbacks_run_where_they_are_asked_to(link, eventually):
    threads = []
    publisher, _ = link(callback=lambda _: threads.append(threading.current_thread().name))
    publisher.publish(data="x")
    eventually(lambda: threads)
    assert threads == ["console callbacks"]


def test_failing_callback_does_not_end_the_subscription(link, eventually, caplog):
    received = []

    def fail(message):
        received.append(message.data)
        raise ValueError("of the user's")

    publisher, _ = link(callback=fail)
    for text in ("a", "b"):
        publisher.publish(data=text)
        eventually(lambda text=text: text in received)
    assert "of the user's" in caplog.text


def test_immediate_callbacks_come_without_another_thread(link, eventually):
    received = []
    publisher, _ = link(callback=lambda m: received.append(m.data), executor=IMMEDIATE)
    publisher.publish(data="x")
    eventually(lambda: received == ["x"])


def test_messages_are_taken_one_by_one_or_the_latest(link, eventually):
    publisher, subscription = link(qos=5)
    for number in range(8):
        publisher.publish(data=str(number))
    eventually(lambda: subscription.statistics().received == 8, subscription.statistics)
    assert subscription.take().message().data == "3"
    assert subscription.take_latest().message().data == "7"
    assert subscription.take() is None
    assert subscription.statistics().dropped == 6


def test_waiter_is_called_once(link, eventually):
    publisher, subscription = link(qos=5)
    woken = []
    assert subscription.add_waiter(lambda: woken.append(subscription.take().message().data))
    publisher.publish(data="a")
    eventually(lambda: woken == ["a"], woken)
    publisher.publish(data="b")
    eventually(lambda: subscription.statistics().received == 2)
    assert not subscription.add_waiter(lambda: woken.append("one is ready"))
    assert subscription.take().message().data == "b"
    assert subscription.add_waiter(lambda: woken.append("closed"))
    subscription.close()
    assert not subscription.add_waiter(lambda: woken.append("it is closed"))
    assert woken == ["a", "closed"]


def test_messages_without_a_waiting_reader_are_there_on_demand(link):
    publisher, subscription = link(qos=1)
    began = time.monotonic()
    behind = []
    for number in at_rate(0.005, 120):
        publisher.publish(data=str(number))
        if number % 20 == 19 and (sample := subscription.take()) is not None:
            behind.append(number - int(sample.message().data))
    frequency = 120 / (time.monotonic() - began)
    assert sorted(behind)[len(behind) // 2] <= 10, "the newest, although no reader was waiting"
    statistics = subscription.statistics()
    assert statistics.received >= 0.9 * 120
    assert statistics.frequency == pytest.approx(frequency, rel=0.3)
    assert statistics.lost == 0


def test_async_iteration(link):
    publisher, subscription = link()

    async def receive():
        found = []
        publisher.publish(data="a")
        async for sample in subscription:
            found.append(sample.message().data)
            if len(found) == 2:
                return found
            publisher.publish(data="b")
        return found

    assert asyncio.run(asyncio.wait_for(receive(), 30)) == ["a", "b"]


def test_ignore_local_leaves_out_what_this_node_publishes(robot, console, topic, eventually):
    received = []
    robot.create_subscription(
        topic, TEXT, lambda m: received.append(m.data), QoS.latched(5), ignore_local=True
    )
    own = robot.create_publisher(topic, TEXT, QoS.latched(5))
    other = console.create_publisher(topic, TEXT, QoS.latched(5))
    eventually(other.subscription_count)
    own.publish(data="own")
    other.publish(data="other")
    eventually(lambda: received)
    assert received == ["other"]


def test_ignore_local_leaves_out_what_a_closed_publisher_sent_last(
    robot, console, topic, eventually
):
    # Without a callback, samples wait in the wire for the subscription to look.
    subscription = robot.create_subscription(topic, TEXT, ignore_local=True)
    hearing = console.create_subscription(topic, TEXT)
    own = robot.create_publisher(topic, TEXT)
    eventually(own.subscription_count)
    eventually(hearing.publisher_count)
    own.publish(data="own")
    own.close()
    eventually(lambda: hearing.statistics().received)
    assert subscription.statistics().received == 0


def test_publishers_that_come_and_go_are_reported(connect, robot, console, topic, eventually):
    events = []
    subscription = console.create_subscription(topic, TEXT)
    subscription.on_matched(lambda e: events.append((e.change, e.count, e.total)))
    first = robot.create_publisher(topic, TEXT)
    eventually(lambda: events == [(1, 1, 1)], lambda: events)
    assert connect("wrong").create_publisher(topic, TWIST)
    assert connect("second").create_publisher(topic, TEXT)
    eventually(lambda: events[1:] == [(1, 2, 2)], lambda: events)
    eventually(lambda: "geometry_msgs" in subscription.problem, lambda: subscription.problem)
    assert subscription.publisher_count() == 2
    first.close()
    eventually(lambda: events[2:] == [(-1, 1, 2)], lambda: events)
    subscription.close()
    assert subscription.publisher_count() == 0


def test_publisher_reports_matched_and_unmatched_subscriptions(robot, console, topic, eventually):
    publisher = robot.create_publisher(topic, TEXT)
    events, before = [], console.create_subscription(topic, TEXT)
    eventually(lambda: [end.node for end in robot.subscriptions(topic)] == [name_of(console)])
    eventually(lambda: publisher.subscription_count() == 1)
    handle = publisher.on_matched(events.append)
    eventually(lambda: events)
    before.close()
    eventually(lambda: len(events) == 2)
    console.create_subscription(topic, TEXT)
    eventually(lambda: len(events) == 3)
    assert [(e.endpoint.node, e.change, e.count, e.total) for e in events] == [
        (name_of(console), 1, 1, 1),
        (name_of(console), -1, 0, 1),
        (name_of(console), 1, 1, 2),
    ]
    assert (publisher.problem, publisher.dropped) == ("", 0)
    handle.close()
    console.create_subscription(topic, TEXT).close()
    eventually(lambda: publisher.subscription_count() == 1)
    assert len(events) == 3


def name_of(node):
    return NodeName(node.namespace, node.name)


def test_publisher_without_subscriptions_hints_at_a_name_that_is_alike(
    robot, console, topic, eventually
):
    console.create_subscription(f"{topic}/cmd_vel", TEXT)
    publisher = robot.create_publisher(f"{topic}/cmd_vle", TEXT)
    eventually(lambda: "did you mean" in publisher.hint, lambda: publisher.hint)
    assert publisher.hint == (f"{topic}/cmd_vle has no subscriber; did you mean {topic}/cmd_vel?")
    console.create_subscription(f"{topic}/cmd_vle", TEXT)
    eventually(lambda: publisher.hint == "")
    publisher.close()
    assert publisher.hint == ""


@pytest.fixture
def miss_deadlines(robot, topic, eventually):
    """Wait until another publisher of the robot has missed deadlines of 0.05 s."""
    other = robot.create_publisher(
        f"{topic}_pausing", TEXT, QoS(deadline=Duration.from_seconds(0.05))
    )
    events = []
    other.on_deadline_missed(events.append)

    def miss_deadlines(count):
        before = len(events)
        other.publish(data="x")
        eventually(lambda: len(events) >= before + count)

    return miss_deadlines


def test_publisher_that_pauses_misses_its_deadline(robot, topic, eventually, miss_deadlines):
    profile = QoS(deadline=Duration.from_seconds(0.05))
    publisher = robot.create_publisher(topic, TEXT, profile)
    events = []
    publisher.on_deadline_missed(events.append)
    miss_deadlines(2)
    assert events == [], "time runs from the first message"
    publisher.publish(data="x")
    eventually(lambda: len(events) >= 2)
    assert events[-1].total == sum(event.change for event in events)
    publisher.close()
    count = len(events)
    miss_deadlines(3)
    assert len(events) <= count + 1


def test_publishers_that_are_there_already_are_reported_first(link, eventually):
    _, subscription = link()
    for _ in range(2):
        events = []
        subscription.on_matched(lambda e, seen=events: seen.append((e.change, e.count)))
        eventually(lambda seen=events: seen == [(1, 1)])


@pytest.fixture
def hold(topic, eventually):
    """Let the thread of a node that looks at publishers and subscriptions look no more."""
    free = threading.Event()

    def hold(node, other):
        held = threading.Event()
        # That thread calls this itself, after it has looked, and waits until it returns.
        node.on_graph_change(lambda: (held.set(), free.wait(60)), executor=IMMEDIATE)
        assert other.create_publisher(f"{topic}_other", TEXT)
        eventually(held.is_set)
        return free

    yield hold
    free.set()


@pytest.mark.parametrize("brief", ["publisher", "subscription"])
def test_endpoint_that_appears_and_leaves_between_two_polls_is_reported(
    robot, console, topic, eventually, hold, brief
):
    if brief == "publisher":
        lasting, create = console.create_subscription(topic, TEXT), robot.create_publisher
        free, count = hold(console, robot), lasting.publisher_count
    else:
        lasting, create = robot.create_publisher(topic, TEXT), console.create_subscription
        free, count = hold(robot, console), lasting.subscription_count
    events = []
    lasting.on_matched(lambda e: events.append((e.change, e.count, e.total)))
    first = create(topic, TEXT)
    eventually(count)
    first.close()
    eventually(lambda: not count())
    free.set()
    eventually(lambda: events == [(1, 1, 1), (-1, 0, 1)], lambda: events)
    assert create(topic, TEXT)
    eventually(lambda: events[2:] == [(1, 1, 2)], lambda: events)


def test_publisher_is_alive_while_it_is_in_the_graph(robot, console, topic, eventually):
    events = []
    subscription = console.create_subscription(topic, TEXT)
    subscription.on_liveliness_change(lambda e: events.append((e.change, e.alive, e.not_alive)))
    publisher = robot.create_publisher(topic, TEXT)
    eventually(lambda: events == [(1, 1, 0)], lambda: events)
    publisher.close()
    eventually(lambda: events[1:] == [(-1, 0, 0)], lambda: events)


def test_deadline_that_passes_without_message_is_reported(
    robot, console, topic, eventually, miss_deadlines
):
    qos = QoS(deadline=Duration.from_seconds(0.2))
    subscription = console.create_subscription(topic, TEXT, qos=qos)
    events = []
    subscription.on_deadline_missed(events.append)
    subscription.on_matched(events.append)
    miss_deadlines(6)
    publisher = robot.create_publisher(topic, TEXT, qos)
    eventually(lambda: len(events) >= 3, lambda: events)
    matched, first, second = events[:3]
    assert isinstance(matched, Matched), "time runs from the moment that a publisher matches"
    assert (first.total, second.total) == (first.change, first.change + second.change)
    publisher.close()
    eventually(lambda: isinstance(events[-1], Matched))
    count = len(events)
    miss_deadlines(8)
    assert len(events) == count, "without publisher, nothing is missed"


def test_subscription_reports_which_publisher_left(robot, console, topic, eventually, caplog):
    subscription = console.create_subscription(topic, TEXT)
    problems = []
    subscription.on_problem_change(problems.append)
    publisher = robot.create_publisher(topic, TEXT)
    eventually(subscription.publisher_count)
    # Over DDS, a publisher is seen before its node's name is.
    eventually(lambda: [end.node.full for end in console.publishers(topic)] == ["/robot"])
    assert subscription.problem == ""
    publisher.close()
    left = re.compile(r"it has had no publisher since \d\d:\d\d:\d\d, when /robot left")
    problem = eventually(lambda: left.fullmatch(subscription.problem), lambda: subscription.problem)
    assert [r for r in caplog.records if r.levelname == "WARNING"] == []
    assert robot.create_publisher(topic, TEXT)
    eventually(lambda: not subscription.problem)
    eventually(lambda: problems[-2:] == [problem.group(), ""], lambda: problems)


def test_own_publisher_that_closed_is_not_reported(robot, topic, eventually):
    subscription = robot.create_subscription(topic, TEXT)
    counts = []
    subscription.on_matched(lambda event: counts.append(event.count))
    publisher = robot.create_publisher(topic, TEXT)
    eventually(lambda: counts == [1], lambda: counts)
    publisher.close()
    eventually(lambda: counts == [1, 0], lambda: counts)
    assert "left" not in subscription.problem


def test_hints_at_topics_that_were_meant(robot, console, topic, eventually):
    name = f"{topic}_lidar".strip("/")
    published = robot.create_publisher(f"{topic}/front/{name}", TEXT)
    subscription = console.create_subscription(f"/{name}", TEXT)
    hint = f"/{name} has no publisher; did you mean {topic}/front/{name}?"
    eventually(lambda: subscription.hint == hint, lambda: subscription.hint)
    assert subscription.problem == ""
    assert console.create_subscription(published.topic).hint == ""
    subscription.close()
    assert subscription.hint == ""


def test_hints_at_messages_that_are_kept_for_others(robot, console, topic, eventually, wire):
    """A volatile subscription receives nothing of a map that was published before."""
    publisher = robot.create_publisher(topic, TEXT, QoS.latched())
    publisher.publish(data="yard")
    eventually(lambda: console.publishers(topic))
    subscription = console.create_subscription(topic, TEXT)
    if wire.is_ros1:  # every subscription receives it
        assert subscription.wait(5).message().data == "yard"
        return
    eventually(lambda: "request transient local" in subscription.hint, lambda: subscription.hint)
    assert f"messages of /{robot.name} are kept" in subscription.hint
    assert subscription.problem == ""
    with pytest.raises(rosglass.TimeoutError, match="request transient local durability"):
        console.wait_for_message(topic, TEXT, timeout=0.01, qos=1)
    assert console.wait_for_message(topic, TEXT, timeout=5).data == "yard"
    # A publisher that keeps nothing makes the strongest profile that matches all a volatile one.
    robot.create_publisher(topic, TEXT)
    eventually(lambda: len(console.publishers(topic)) == 2)
    mixed = console.create_subscription(topic, TEXT, qos=QoS.best_available())
    eventually(lambda: "request transient local" in mixed.hint, lambda: mixed.hint)
    publisher.publish(data="yard, again")
    assert subscription.wait(5).message().data == "yard, again"
    assert subscription.hint == ""


def test_waiting_in_vain_says_why(robot, console, topic, eventually):
    with pytest.raises(
        rosglass.TimeoutError, match=f"{topic}: no message within 0.01 s: {topic} has no pub"
    ):
        console.wait_for_message(topic, timeout=0.01)
    robot.create_publisher(topic, TEXT)
    eventually(lambda: console.publishers(topic))
    with pytest.raises(rosglass.TimeoutError, match="it is published, but nothing came"):
        console.wait_for_message(topic, TEXT, timeout=0.01)


def test_waiting_ends_with_the_node(console, topic):
    later = threading.Timer(0.05, console.close)
    later.start()
    with pytest.raises(rosglass.NodeClosedError):
        console.wait_for_message(topic, TEXT)
    later.join()


def test_manual_liveliness_is_lost_once_for_each_silence(
    robot, topic, wire, eventually, miss_deadlines
):
    lease = rosglass.Duration.from_seconds(0.05)
    profile = QoS(liveliness=Liveliness.MANUAL_BY_TOPIC, lease_duration=lease)
    publisher = robot.create_publisher(topic, TEXT, profile)
    events = []
    publisher.on_liveliness_lost(events.append)
    if wire.is_ros1:
        with pytest.raises(rosglass.UnsupportedError, match=f"{topic}: .* by sending"):
            publisher.assert_liveliness()
        publisher.publish(data="x")
    else:
        publisher.assert_liveliness()
    eventually(lambda: events)
    miss_deadlines(3)
    assert events == [LivelinessLost(1)]
    publisher.publish(data="x")
    eventually(lambda: events == [LivelinessLost(1), LivelinessLost(2)])


def test_two_types_on_a_topic_are_a_problem_that_names_both(robot, console, topic, eventually):
    robot.create_publisher(topic, TWIST)
    subscription = console.create_subscription(topic, TEXT)
    problem = eventually(lambda: subscription.problem)
    assert "geometry_msgs" in problem
    assert "std_msgs" in problem


@pytest.mark.parametrize("create", ["create_publisher", "create_subscription"])
@pytest.mark.parametrize("name", ["a b", ""])
def test_bad_names_are_refused(robot, create, name):
    with pytest.raises(rosglass.InvalidNameError):
        getattr(robot, create)(name, TEXT)


@pytest.mark.parametrize("create", ["create_publisher", "create_subscription"])
def test_types_that_cannot_be_used_are_refused_at_creation(robot, wire, create):
    other = 2 if wire.is_ros1 else 1
    for kind, error, reason in (
        ("nowhere_msgs/msg/Nothing", rosglass.TypeNotFoundError, "nowhere_msgs"),
        ("std_srvs/srv/Trigger", rosglass.TypeNotFoundError, "is not a message type"),
        (7, rosglass.TypeNotFoundError, "7 is not a message type"),
        (rosglass.load(TEXT, ros=other), rosglass.UnsupportedError, f"is ROS {other}'s definition"),
    ):
        with pytest.raises(error, match=reason):
            getattr(robot, create)("/t", kind)


@pytest.mark.parametrize("create", ["create_publisher", "create_subscription"])
@pytest.mark.parametrize("qos", [-1, "sensor_data", 1.5])
def test_invalid_profiles_are_refused(console, topic, create, qos):
    with pytest.raises(rosglass.ArgumentError, match=f"^{topic}: qos: expected"):
        getattr(console, create)(topic, TEXT, qos=qos)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"callback": 3}, "callback: expected .* got 3"),
        ({"raw_callback": 3}, "raw_callback: expected .* got 3"),
        ({"callback": print, "executor": 3}, "executor: expected .* got 3"),
        ({"callback": print, "raw_callback": print}, "raw_callback: expected None"),
        ({"ignore_local": "no"}, "ignore_local: expected True or False"),
    ],
)
def test_odd_options_of_a_subscription_are_refused(console, topic, options, reason):
    with pytest.raises(rosglass.ConversionError, match=f"{topic}: {reason}"):
        console.create_subscription(topic, TEXT, **options)


def test_odd_arguments_of_a_subscription_are_refused(console, topic):
    subscription = console.create_subscription(topic)
    with pytest.raises(rosglass.ConversionError, match=f"{topic}: sample: expected"):
        subscription.lateness(7)
    with pytest.raises(
        rosglass.ConversionError, match=f"{topic}: batching: expected True or False"
    ):
        subscription.set_batching(1)
    with pytest.raises(rosglass.ConversionError, match=f"{topic}: wake: expected"):
        subscription.add_waiter(None)


async def _coroutine(*_):
    """Would never run."""


@pytest.mark.parametrize("callback", [7, _coroutine])
@pytest.mark.parametrize(
    "register",
    [
        lambda node, callback: node.create_subscription("/t", TEXT, callback),
        lambda node, callback: node.create_subscription("/t", TEXT, raw_callback=callback),
        lambda node, callback: node.create_subscription("/t", TEXT).on_matched(callback),
        lambda node, callback: node.create_timer(1.0, callback),
        lambda node, callback: node.on_graph_change(callback),
        lambda node, callback: node.on_status_change(callback),
    ],
    ids=["subscription", "raw", "event", "timer", "graph", "status"],
)
def test_callbacks_that_would_never_run_are_refused(console, register, callback):
    with pytest.raises(rosglass.ConversionError, match="callback: expected"):
        register(console, callback)


def test_reprs_name_the_thing(console, topic):
    assert repr(console.create_publisher(topic, TEXT)) == f"<Publisher {topic} [{TEXT}]>"
    subscription = console.create_subscription(f"{topic}_other")
    assert repr(subscription) == f"<Subscription {topic}_other [type not known yet]>"
    subscription.close()
    assert repr(subscription).endswith(" closed>")


def test_closing_one_subscription_leaves_the_others(robot, console, topic):
    one, two = (console.create_subscription(topic, TEXT, qos=QoS.latched()) for _ in range(2))
    publisher = robot.create_publisher(topic, TEXT, QoS.latched())
    publisher.publish(data="first")
    assert one.wait(30).message().data == two.wait(30).message().data == "first"
    one.close()
    publisher.publish(data="second")
    assert two.wait(30).message().data == "second"


def test_names_are_resolved(connect):
    node = connect("wheel", "/left")
    assert node.create_publisher("speed", TEXT).topic == "/left/speed"
    assert node.create_publisher("~speed" if node.wire == "ros1" else "~/speed", TEXT).topic == (
        "/left/wheel/speed"
    )
    assert node.create_subscription("/speed", TEXT).topic == "/speed"


def test_nothing_comes_after_closing(link, eventually):
    received = []
    publisher, subscription = link(callback=lambda message: received.append(message.data))
    subscription.close()
    subscription.close()
    eventually(lambda: not publisher.subscription_count())
    publisher.publish(data="late")
    assert subscription.closed
    assert subscription.wait(0.05) is None
    assert received == []
    publisher.close()
    with pytest.raises(rosglass.NodeClosedError, match="closed"):
        publisher.publish(data="later")


def test_commands_are_delivered_and_match_every_subscription(robot, console, topic, eventually):
    publisher = console.create_publisher(topic, "geometry_msgs/msg/Twist", QoS.command())
    received = {}
    for depth in (1, 10):
        received[depth] = []
        robot.create_subscription(
            topic,
            "geometry_msgs/msg/Twist",
            lambda m, seen=received[depth]: seen.append(m.linear.x),
            depth,
        )
    robot.create_subscription(topic, "geometry_msgs/msg/Twist", qos=QoS.command())
    eventually(lambda: publisher.subscription_count() >= 1)
    eventually(lambda: publisher.publish(linear={"x": 1.0}) or all(received.values()))
    for _ in at_rate(0.02, 20):
        publisher.publish(linear={"x": 2.0})

    def stop():
        """Publish a stop; on a busy machine, one may be dropped."""
        publisher.publish(linear={"x": 0.0})
        return all(seen[-1] == 0.0 for seen in received.values())

    eventually(stop)

"""Samples come in different ways, depending on their rate and on who waits: none is ever lost."""

from __future__ import annotations

import threading
import time

import pytest
from waiting import eventually

import rosglass

TWIST = "geometry_msgs/msg/Twist"


@pytest.fixture
def stream(connect):
    """Publish numbers in a thread, at a rate that can be changed, until the test ends."""
    stopping = threading.Event()
    publisher = connect("talker").create_publisher("/count", TWIST, rosglass.QoS(1000))
    rate, threads = [0.0], []

    def work():
        number, due = 0, time.monotonic()
        while not stopping.is_set():
            publisher.publish(linear={"x": number})
            number += 1
            due = max(due + 1 / rate[0], time.monotonic() - 0.1)
            stopping.wait(max(0.0, due - time.monotonic()))

    def stream(hz):
        rate[0] = hz
        if not threads:
            threads.append(threading.Thread(target=work, name="talker"))
            threads[0].start()

    yield stream
    stopping.set()
    for thread in threads:
        thread.join()


class Received:
    """Notes numbers as they come."""

    def __init__(self, samples=()):
        self.numbers = [sample.message().linear.x for sample in samples]

    def __call__(self, message):
        self.numbers.append(message.linear.x)

    def assert_each_once_in_order(self):
        assert self.numbers
        first = self.numbers[0]
        assert self.numbers == [first + i for i in range(len(self.numbers))]


def has_thread(word):
    return any(word in thread.name for thread in threading.enumerate())


def test_unread_samples_are_collected_and_delivered_at_once_to_a_waiting_reader(connect, stream):
    node = connect("cockpit")
    subscription = node.create_subscription("/count", TWIST, qos=rosglass.QoS(100_000))
    eventually(subscription.publisher_count)
    stream(300)
    eventually(lambda: has_thread("unread"), what="collecting")
    # More and more is kept, here for half a second.
    eventually(lambda: subscription.statistics().received > 150)
    assert subscription.statistics().frequency == pytest.approx(300, rel=0.5)
    samples, waits = [], []
    end = time.monotonic() + 0.5
    while time.monotonic() < end:
        samples.append(subscription.wait(30))
        waits.append(time.time_ns() - samples[-1].received_ns)
    # Those that waited in the inbox are stamped with their reception, the others came just now.
    assert max(waits) > 0.3e9
    assert sorted(waits[-50:])[25] < 0.1e9
    Received(samples).assert_each_once_in_order()
    assert subscription.statistics().dropped == subscription.statistics().lost == 0
    eventually(lambda: not has_thread("unread"), what="the thread has nothing more to do")


def test_the_fastest_get_a_thread_of_their_own_and_keep_their_order(connect, stream):
    node, received = connect("cockpit"), Received()
    subscription = node.create_subscription("/count", TWIST, received, rosglass.QoS(100_000))
    eventually(subscription.publisher_count)
    stream(6000)
    eventually(lambda: has_thread("/count"), what="a thread for a fast topic")
    eventually(lambda: len(received.numbers) > 1000)
    stream(50)
    eventually(lambda: not has_thread("/count"), what="slow again")
    count = len(received.numbers)
    eventually(lambda: len(received.numbers) > count + 5)
    subscription.close()
    received.assert_each_once_in_order()


def test_topics_that_are_fast_together_are_collected_and_keep_their_order(
    connect, stream, monkeypatch
):
    monkeypatch.setattr("rosglass.wires.zenoh.reader._POLL_RATE_HZ", 50.0)
    monkeypatch.setattr("rosglass.wires.zenoh.reader._POLL_TOTAL_HZ", 100.0)
    node, all_received = connect("cockpit"), [Received(), Received()]
    for received in all_received:
        node.create_subscription("/count", TWIST, received, rosglass.QoS(100_000))
    eventually(lambda: node.publishers("/count"))
    stream(300)
    eventually(lambda: has_thread("fast"), what="one thread for both")
    for received in all_received:
        count = len(received.numbers)
        eventually(lambda: len(received.numbers) > count + 50)  # noqa: B023 - called at once
    stream(10)
    eventually(lambda: not has_thread("fast"), what="slow again")
    for received in all_received:
        received.assert_each_once_in_order()


def test_closing_ends_every_way_of_receiving(connect, stream):
    node, received = connect("cockpit"), Received()
    qos = rosglass.QoS(100_000)
    unread = node.create_subscription("/count", TWIST, qos=qos)
    fast = node.create_subscription("/count", TWIST, received, qos)
    eventually(unread.publisher_count)
    stream(6000)
    eventually(lambda: has_thread("/count") and has_thread("unread"))
    unread.close()
    fast.close()
    count = len(received.numbers)
    eventually(lambda: not has_thread("/count"))
    eventually(lambda: not has_thread("unread"))
    # What is sent later comes to others only.
    later = node.create_subscription("/count", TWIST, qos=qos)
    assert later.wait(30) is not None
    assert len(received.numbers) == count


def test_samples_without_sender_are_received(router, connect, caplog):
    zenoh = pytest.importorskip("zenoh")
    node, received = connect("cockpit"), Received()
    node.create_subscription("/count", TWIST, received)
    twist = rosglass.load(TWIST)
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["{router.listen}"]')
    with zenoh.open(config) as session:
        key = f"0/count/geometry_msgs::msg::dds_::Twist_/{twist.rihs01}"
        number = iter(range(1000))

        def arrived():
            data = twist.encode(linear={"x": next(number)})
            session.put(key, data, attachment=b"nonsense")
            session.put(key, data)
            return len(received.numbers) > 10

        eventually(arrived)
    warnings = [
        record.message for record in caplog.records if "attachments of 8 bytes" in record.message
    ]
    assert len(warnings) == 1
    assert "/count" in warnings[0]

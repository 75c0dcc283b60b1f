"""Reading from one publisher."""

from __future__ import annotations

import threading

import pytest

from rosglass.comm import History, QoS
from rosglass.wires.tcpros import topic_subscription

ALL = QoS(history=History.KEEP_ALL)


@pytest.fixture
def flood(connect, eventually, monkeypatch):
    """Return a publisher, a slow subscription, its link, the callback's gate and what it got."""
    monkeypatch.setattr(topic_subscription, "_BATCH", 1)
    monkeypatch.setattr(topic_subscription, "_MAX_BEHIND", 10)
    robot, cockpit = connect("robot"), connect("cockpit")
    publisher = robot.create_publisher("/flood", "std_msgs/Int32", ALL)
    gate, got = threading.Event(), []

    def take(message):
        gate.wait(60)
        got.append(message.data)

    subscription = cockpit.create_subscription("/flood", "std_msgs/Int32", take, ALL)
    eventually(lambda: subscription.publisher_count() and publisher.subscription_count())
    (link,) = cockpit._topics.subscribed()["/flood"].links()
    yield publisher, subscription, link, gate, got
    gate.set()


def test_reading_makes_way_for_callbacks_that_are_behind(flood, eventually, monkeypatch):
    monkeypatch.setattr(topic_subscription, "_PAUSE_S", 3600.0)
    publisher, _, link, _, _ = flood
    sent = iter(range(10_000))
    eventually(lambda: publisher.publish({"data": next(sent)}) or not link._connection._reading)
    (reader,) = link.subscription.readers
    waiting = reader.feed.waiting
    assert waiting > 10
    publisher.publish({"data": -1})
    for _ in range(3):  # the loop has looked at its sockets meanwhile
        looked = threading.Event()
        link._core.loop.call(looked.set)
        assert looked.wait(30)
    assert reader.feed.waiting == waiting


def test_what_was_left_in_the_socket_comes_when_callbacks_have_caught_up(
    flood, eventually, monkeypatch
):
    pauses = []
    publisher, _, link, gate, got = flood
    pause = link._connection.pause
    monkeypatch.setattr(
        link._connection, "pause", lambda reading: (pauses.append(reading), pause(reading))
    )
    for number in range(500):
        publisher.publish({"data": number})
    eventually(lambda: True in pauses)
    gate.set()
    eventually(lambda: len(got) == 500)
    assert got == list(range(500))
    assert pauses[0] is False

"""Reading from one publisher."""

from __future__ import annotations

import threading

import pytest
from tcpros import publisher_links

from rosglass.comm import IMMEDIATE, History, QoS
from rosglass.wires.tcpros import topic_subscription
from rosglass.wires.tcpros.connection import Connection

ALL = QoS(history=History.KEEP_ALL)


@pytest.fixture
def flood(connect, eventually, monkeypatch):
    """Return the nodes, a publisher, the gate of a slow callback, what it got, and the pauses."""
    monkeypatch.setattr(topic_subscription, "_BATCH", 1)
    monkeypatch.setattr(topic_subscription, "_MAX_BEHIND", 10)
    robot, cockpit = connect("robot"), connect("cockpit")
    publisher = robot.create_publisher("/flood", "std_msgs/Int32", ALL)
    gate, got, pauses = threading.Event(), [], []

    def take(message):
        gate.wait(60)
        got.append(message.data)

    subscription = cockpit.create_subscription("/flood", "std_msgs/Int32", take, ALL)
    eventually(lambda: subscription.publisher_count() and publisher.subscription_count())
    pause = Connection.pause

    def note(self, reading):
        pauses.append(reading)
        pause(self, reading)

    monkeypatch.setattr(Connection, "pause", note)
    yield robot, cockpit, publisher, gate, got, pauses
    gate.set()


def test_reading_makes_way_for_callbacks_that_are_behind(flood, eventually, monkeypatch):
    monkeypatch.setattr(topic_subscription, "_PAUSE_S", 3600.0)
    robot, cockpit, publisher, _, _, pauses = flood
    looked = threading.Semaphore(0)
    cockpit.create_subscription(
        "/look", "std_msgs/Int32", lambda _: looked.release(), executor=IMMEDIATE
    )
    other = robot.create_publisher("/look", "std_msgs/Int32")
    eventually(lambda: other.publish({"data": 0}) or looked.acquire(timeout=0.05))
    pauses.clear()
    sent = iter(range(10_000))
    eventually(lambda: publisher.publish({"data": next(sent)}) or False in pauses)
    (link,) = publisher_links(cockpit, "/flood")
    (reader,) = link.subscription.readers
    waiting = reader.feed.waiting
    assert waiting > 10
    publisher.publish({"data": -1})
    while looked.acquire(timeout=0.05):
        pass
    for _ in range(3):  # meanwhile, other connections are read from
        other.publish({"data": 1})
        assert looked.acquire(timeout=30)
    assert reader.feed.waiting == waiting


def test_what_was_left_in_the_socket_comes_when_callbacks_have_caught_up(flood, eventually):
    _, _, publisher, gate, got, pauses = flood
    for number in range(500):
        publisher.publish({"data": number})
    eventually(lambda: True in pauses[pauses.index(False) :] if False in pauses else False)
    gate.set()
    eventually(lambda: len(got) == 500)
    assert got == list(range(500))

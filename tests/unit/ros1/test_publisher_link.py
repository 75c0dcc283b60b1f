"""Reading from one publisher."""

from __future__ import annotations

import threading
import xmlrpc.client

import pytest
from inside import core_of
from tcpros import node_uri, publisher_links

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
    (negotiation,) = link.subscription.negotiations
    waiting = negotiation.feed.waiting
    assert waiting > 10
    publisher.publish({"data": -1})
    while looked.acquire(timeout=0.05):
        pass
    for _ in range(3):  # other connections are still read from
        other.publish({"data": 1})
        assert looked.acquire(timeout=30)
    assert negotiation.feed.waiting == waiting


def test_data_left_in_the_socket_is_received_once_callbacks_caught_up(flood, eventually):
    _, _, publisher, gate, got, pauses = flood
    for number in range(500):
        publisher.publish({"data": number})
    eventually(lambda: True in pauses[pauses.index(False) :] if False in pauses else False)
    gate.set()
    eventually(lambda: len(got) == 500)
    assert got == list(range(500))


def update_publishers(node, topic, uris):
    """Send a node a topic's publishers, as a master does, and wait until it has handled them."""
    with xmlrpc.client.ServerProxy(node_uri(node)) as api:
        assert api.publisherUpdate("/master", topic, uris)[0] == 1
    taken = threading.Event()
    core_of(node).loop.call(taken.set)
    assert taken.wait(30)


@pytest.fixture
def stop(connect, eventually):
    """Return the nodes, and the publisher and the subscription of a topic between them."""
    robot, cockpit = connect("robot"), connect("cockpit")
    publisher = robot.create_publisher("/stop", "std_msgs/Int32", ALL)
    subscription = cockpit.create_subscription("/stop", "std_msgs/Int32", qos=ALL)
    eventually(lambda: subscription.publisher_count() and publisher.subscription_count())
    return robot, cockpit, publisher, subscription


def test_publisher_that_is_listed_again_at_once_stays_connected(stop):
    robot, cockpit, publisher, subscription = stop
    links = publisher_links(cockpit, "/stop")
    update_publishers(cockpit, "/stop", [])
    publisher.publish({"data": 1})
    update_publishers(cockpit, "/stop", [node_uri(robot)])
    assert subscription.wait(30).message().data == 1
    assert publisher_links(cockpit, "/stop") == links


def test_last_message_of_a_publisher_that_leaves_is_received(stop, eventually, monkeypatch):
    monkeypatch.setattr(topic_subscription, "_LAST_MESSAGES_S", 3600.0)
    _, cockpit, publisher, subscription = stop
    update_publishers(cockpit, "/stop", [])
    publisher.publish({"data": 1})
    publisher.close()
    assert subscription.wait(30).message().data == 1
    eventually(lambda: not publisher_links(cockpit, "/stop"))


def test_connection_to_an_unregistered_publisher_is_closed(stop, eventually, monkeypatch):
    monkeypatch.setattr(topic_subscription, "_LAST_MESSAGES_S", 0.01)
    _, cockpit, publisher, subscription = stop
    update_publishers(cockpit, "/stop", [])
    eventually(lambda: not subscription.publisher_count() and not publisher.subscription_count())
    assert not publisher_links(cockpit, "/stop")


@pytest.mark.parametrize("type", ["std_msgs/Int32", None])
def test_subscription_made_as_the_publisher_connects_gets_the_latched_message_once(
    connect, eventually, monkeypatch, type
):
    robot, cockpit = connect("robot"), connect("cockpit")
    robot.create_publisher("/state", "std_msgs/Int32", QoS.latched()).publish({"data": 1})
    got = []
    on_header = topic_subscription.PublisherLink._on_header

    def subscribe_first(self, header):
        if self.topic == "/state":
            cockpit.create_subscription("/state", type, got.append, executor=IMMEDIATE)
        on_header(self, header)

    monkeypatch.setattr(topic_subscription.PublisherLink, "_on_header", subscribe_first)
    cockpit.create_subscription("/state", type)
    eventually(lambda: got)
    core = core_of(cockpit)
    # Two rounds of the loop: what the subscription is still to be handed has come by then.
    for _ in range(2):
        done = threading.Event()
        core.pool.run(lambda done=done: core.loop.call(done.set))
        assert done.wait(30)
    assert [message.data for message in got] == [1]

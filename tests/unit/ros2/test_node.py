from __future__ import annotations

import re
import threading

import pytest

import rosglass
from rosglass.comm import ConnectionState, EndpointKind
from rosglass.extras import install_command
from rosglass.interfaces import Library
from rosglass.ros2 import Ros2Node

PUBLISHER, SUBSCRIPTION = EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION
STRING, TWIST = "std_msgs/msg/String", "geometry_msgs/msg/Twist"
HELLO = rosglass.load(STRING).encode({"data": "hello"})
OTHER_HASH = "RIHS01_" + "0" * 64


def hash_of(name):
    return rosglass.load(name).rihs01


# -- publishing ----------------------------------------------------------------------------------


@pytest.mark.parametrize("data", [b"", b"abc", b"\x01\x00\x00\x00x"])
def test_bytes_without_an_encapsulation_header_are_not_sent(node, middleware, data):
    publisher = node.create_publisher("/t", STRING)
    with pytest.raises(rosglass.ConversionError, match=STRING):
        publisher.publish_serialized(data)
    assert middleware.writers[0].written == []


def test_counting_matching_subscriptions(node, middleware, eventually, caplog):
    publisher = node.create_publisher("/t", STRING)
    assert publisher.subscription_count() == 0
    key = middleware.appear(SUBSCRIPTION, "/t", STRING, hash_of(STRING))
    middleware.appear(SUBSCRIPTION, "/t", STRING, "", node="humble")
    middleware.appear(SUBSCRIPTION, "/t", STRING, OTHER_HASH, node="other")
    middleware.appear(SUBSCRIPTION, "/t", TWIST, hash_of(TWIST), node="wrong")
    assert publisher.subscription_count() == 2
    matched = eventually(lambda: len(w := middleware.writers[0].matched) == 2 and w)
    assert {endpoint.node.name for endpoint in matched} == {"robot", "humble"}
    assert "/other has another definition" in caplog.text
    assert OTHER_HASH in caplog.text
    middleware.graph.remove(key)
    assert publisher.subscription_count() == 1


# -- receiving -----------------------------------------------------------------------------------


def test_repeated_samples_are_delivered_once(node, middleware):
    subscription = node.create_subscription("/t", STRING)
    for _ in range(2):
        middleware.readers[0].on_sample(HELLO, 10, 5, b"g" * 16, 1, "")
    assert subscription.statistics().received == 1


def test_type_follows_a_robot_that_comes_back_with_another_one(node, middleware, eventually):
    key = middleware.appear(PUBLISHER, "/t", STRING)
    subscription = node.create_subscription("/t")
    eventually(lambda: subscription.type)
    middleware.graph.remove(key)
    middleware.appear(PUBLISHER, "/t", TWIST)
    eventually(lambda: subscription.type.name == TWIST)
    first, second = eventually(lambda: len(r := middleware.readers) == 2 and r)
    eventually(lambda: first.closed)
    assert not second.closed


def test_given_type_stays_and_others_are_reported(node, middleware, eventually):
    subscription = node.create_subscription("/t", STRING)
    middleware.appear(PUBLISHER, "/t", TWIST)
    problem = eventually(lambda: subscription.problem)
    assert problem == f"/robot publishes {TWIST} here, not {STRING}"
    assert subscription.type.name == STRING


def test_unknown_definition_is_a_problem_until_it_is_added(middleware, eventually, tmp_path):
    library = Library()
    node = Ros2Node(middleware, "fake://", "cockpit", library=library)
    middleware.appear(PUBLISHER, "/t", "secret_msgs/msg/Thing")
    subscription = node.create_subscription("/t", callback=id)
    problem = eventually(lambda: "decoded" in subscription.problem and subscription.problem)
    assert "/robot publishes secret_msgs/msg/Thing, which cannot be decoded" in problem
    assert "tried again" in problem
    library.add_text("secret_msgs/msg/Thing", "int32 number\n")
    eventually(lambda: subscription.type)
    eventually(lambda: subscription.problem == "")
    node.close()


def test_another_definition_is_refused_with_both_hashes(node, middleware, eventually):
    fixed = node.create_subscription("/t", rosglass.load(STRING))
    middleware.appear(PUBLISHER, "/t", STRING, OTHER_HASH)
    problem = eventually(lambda: fixed.problem)
    assert OTHER_HASH in problem
    assert hash_of(STRING) in problem
    middleware.readers[0].receive(HELLO, OTHER_HASH)
    assert fixed.take() is None
    middleware.readers[0].receive(HELLO, "")
    assert fixed.take() is not None, "a robot without hashes is believed"


def test_unannounced_definition_is_refused_too(node, middleware, eventually):
    subscription = node.create_subscription("/t", STRING)
    middleware.readers[0].receive(HELLO, OTHER_HASH)
    problem = eventually(lambda: subscription.problem)
    assert OTHER_HASH in problem
    assert subscription.take() is None


@pytest.mark.parametrize("given", [None, "pkg/msg/T"])
def test_robots_version_of_a_type_is_taken_if_it_is_known(middleware, eventually, given):
    library = Library()
    library.add_text("pkg/msg/T", "int32 new\n")
    ours = rosglass.load("pkg/msg/T", library=library)
    other = Library()
    other.add_text("pkg/msg/T", "int32 old\n")
    robots = rosglass.load("pkg/msg/T", library=other)
    real_definition = library.definition

    def definition(name, ros=2, *, hash=""):
        wanted = other if hash == robots.rihs01 else library
        return other.definition(name, ros) if wanted is other else real_definition(name, ros)

    library.definition = definition
    node = Ros2Node(middleware, "fake://", "cockpit", library=library)
    subscription = node.create_subscription("/t", given)
    if given:
        assert subscription.type == ours
    middleware.appear(PUBLISHER, "/t", "pkg/msg/T", robots.rihs01)
    eventually(lambda: subscription.type and subscription.type.fields[0].name == "old")
    eventually(lambda: subscription.problem == "")
    middleware.readers[-1].receive(robots.encode({"old": 5}), robots.rihs01)
    assert subscription.wait(30).message().old == 5
    node.close()


# -- graph and status ----------------------------------------------------------------------------


def test_status_changes_are_notified_in_order_and_once(node, middleware, eventually):
    seen = []
    node.on_status_change(seen.append)
    assert node.status().state is ConnectionState.CONNECTED
    for state in (ConnectionState.CONNECTING, ConnectionState.LOST, ConnectionState.CONNECTED):
        middleware.become(state, state.value)
        middleware.changed()
        eventually(lambda s=state: seen and seen[-1].state is s)
    assert [s.detail for s in seen] == ["connecting", "lost", "connected"]


def test_lost_connection_is_logged(node, middleware, eventually, caplog):
    middleware.become(ConnectionState.LOST, "connection to x lost, trying again every second")
    eventually(lambda: "connection to x lost" in caplog.text)


# -- the end -------------------------------------------------------------------------------------


def test_closing_ends_what_the_wire_made(middleware):
    node = Ros2Node(middleware, "fake://", "cockpit")
    node.create_publisher("/t", STRING)
    node.create_subscription("/t", STRING, id)
    node.close()
    node.close()
    assert middleware.closed == 1
    assert node.nodes() == []
    assert middleware.readers[0].closed
    assert middleware.writers[0].closed


def test_middleware_that_cannot_start_leaves_no_thread(middleware):
    def refuse(graph, changed):
        raise rosglass.ConnectionLostError("no network")

    middleware.open = refuse
    before = threading.active_count()
    with pytest.raises(rosglass.ConnectionLostError):
        Ros2Node(middleware, "fake://", "cockpit")
    assert threading.active_count() <= before


def test_connect_says_what_is_not_installed(monkeypatch):
    monkeypatch.setattr("rosglass.connection.find_spec", lambda name: None)
    with pytest.raises(rosglass.UnsupportedError, match=re.escape(install_command("zenoh"))):
        rosglass.connect("ZENOH://127.0.0.1:7447")


def test_connect_wants_a_library():
    with pytest.raises(rosglass.ConversionError, match=r"library: expected a rosglass\.Library"):
        rosglass.connect("zenoh://127.0.0.1:7447", library=3)

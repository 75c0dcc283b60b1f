"""Publishers made in QML."""

from __future__ import annotations

import gc
import logging
import threading
import time
from typing import Any

import pytest

from rosglass.comm import ConnectionState
from rosglass.comm.qos import Durability, Reliability
from rosglass.qml import install
from rosglass.qt import QtQml, send_deferred_deletes

TWIST = "geometry_msgs/msg/Twist"


@pytest.fixture
def received(running: Any) -> list:
    messages: list = []
    running.robot.create_subscription("/cmd_vel", TWIST, messages.append)
    return messages


def load(bench: Any, more: str = "") -> Any:
    return bench.load(
        """QtObject {
            id: root
            property var pub: Ros2.createPublisher("cmd_vel", "geometry_msgs/Twist", 3)
            property string error: ""
            property var sent
            property int advertised: 0
            property var c: Connections { target: pub; function onAdvertised() { ++advertised } }
            function send(x) {
                try { sent = pub.publish({linear: {x: x}}) } catch (e) { error = String(e) }
            }
            MORE
        }""".replace("MORE", more)
    )


def send(root: Any, value: Any) -> None:
    root.send(value)


def test_partial_messages_get_defaults(running: Any, received: list, wait: Any) -> None:
    root = load(running)
    wait(lambda: root.property("advertised") == 1)
    send(root, 0.5)
    assert root.property("sent") is True
    wait(lambda: received)
    assert received[0].to_dict() == {
        "linear": {"x": 0.5, "y": 0.0, "z": 0.0},
        "angular": {"x": 0.0, "y": 0.0, "z": 0.0},
    }


@pytest.mark.both_qt
def test_invalid_message_throws_and_is_logged_once_by_qt(
    running: Any, received: list, messages: None, wait: Any, caplog: Any
) -> None:
    def logged() -> list[logging.LogRecord]:
        return [record for record in caplog.records if "linear.x" in record.getMessage()]

    root = load(running, "function shout() { pub.publish({linear: {x: 'fast'}}) }")
    wait(lambda: root.property("advertised") == 1)
    send(root, "fast")
    assert "linear.x" in root.property("error")
    assert "'fast'" in root.property("error")
    assert not logged(), "a caller that catches it decides what to do with it"
    root.shout()
    (record,) = logged()
    assert record.pathname.endswith(".qml")
    assert record.lineno == 14
    wait.settled(running.session)
    assert not received


def test_nothing_is_lost_silently_before_and_after(
    running: Any, received: list, wait: Any, caplog: Any
) -> None:
    root = load(running)
    send(root, 1.0)
    assert root.property("sent") is True, "it is held for a moment"
    wait(lambda: received and received[0].linear.x == 1.0)
    assert root.property("advertised") == 1
    running.session.node.set_status(ConnectionState.LOST, "no router")
    wait(lambda: running.session.state == "lost")
    send(root, 1.0)
    assert root.property("sent") is False
    assert "connection is lost: no router" in caplog.text


def test_failed_advertising_is_logged(
    running: Any, received: list, wait: Any, caplog: Any, monkeypatch: Any
) -> None:
    go = threading.Event()
    create = running.session.node.create_publisher
    monkeypatch.setattr(
        running.session.node,
        "create_publisher",
        lambda *given: go.wait(30) and create(*given),
    )
    root = load(running)
    send(root, 1.0)
    message = "nothing was published on cmd_vel: it could not be advertised in time"
    wait(lambda: message in caplog.text)
    send(root, 2.0)
    go.set()
    wait(lambda: received)
    assert [message.linear.x for message in received] == [2.0]


def test_nothing_is_held_for_longer_than_the_robot_may_take(
    running: Any, received: list, wait: Any, caplog: Any
) -> None:
    """A stop that went nowhere must be known to have."""
    running.session.node.set_status(ConnectionState.CONNECTING, "no router yet")
    wait(lambda: running.session.state == "connecting")
    root = load(running)
    send(root, 1.0)
    assert root.property("sent") is True, "it is held for a moment"
    wait(lambda: "not connected in time: no router yet" in caplog.text)
    send(root, 2.0)
    assert root.property("sent") is False
    running.session.node.set_status(ConnectionState.CONNECTED, "")
    wait(lambda: running.session.state == "connected")
    send(root, 3.0)
    assert root.property("sent") is True
    wait(lambda: 3.0 in [message.linear.x for message in received])
    assert 1.0 not in [message.linear.x for message in received]


def test_a_command_is_not_held_for_longer_than_its_timeout(
    running: Any, received: list, wait: Any, caplog: Any, monkeypatch: Any
) -> None:
    go = threading.Event()
    create = running.session.node.create_publisher
    monkeypatch.setattr(
        running.session.node,
        "create_publisher",
        lambda *given: go.wait(30) and create(*given),
    )
    root: Any = running.load("""QtObject {
        property var qos: Ros2.CommandQoS()
        property var pub: Ros2.createPublisher("cmd_vel", "geometry_msgs/msg/Twist", qos)
        function send(x) { return pub.publish({linear: {x: x}}) }
        function timeout() { return pub.qos.sendTimeoutMs }
    }""")
    assert root.timeout() == 300
    begin = time.monotonic()
    assert root.send(1.0) is True
    wait(lambda: "nothing was published on cmd_vel: it could not be advertised" in caplog.text)
    assert time.monotonic() - begin < 1.9, "others are held for 2 s"
    go.set()
    wait(lambda: root.send(2.0) and received)
    assert {message.linear.x for message in received} == {2.0}


def test_destroyed_publisher_sends_held_messages(
    running: Any, received: list, wait: Any, monkeypatch: Any
) -> None:
    go = threading.Event()
    create = running.session.node.create_publisher
    monkeypatch.setattr(
        running.session.node,
        "create_publisher",
        lambda *given: go.wait(30) and create(*given),
    )
    root = running.load(
        """QtObject {
            function once() {
                Ros2.createPublisher("cmd_vel", "geometry_msgs/msg/Twist", 1)
                    .publish({linear: {x: 7}})
            }
            function collect() { gc() }
        }""",
    )
    root.once()
    for _ in range(5):
        root.collect()
        wait.nothing_happens(0.02)  # its worker is held up
    go.set()
    wait(lambda: received)
    assert received[0].linear.x == 7


def test_messages_held_at_shutdown_are_logged(
    running: Any, received: list, wait: Any, caplog: Any, monkeypatch: Any
) -> None:
    go = threading.Event()
    monkeypatch.setattr(running.session.node, "create_publisher", lambda *_: go.wait(30))
    root = load(running)
    send(root, 1.0)
    running.session.shutdown()
    go.set()
    wait(lambda: "nothing was published on cmd_vel: " in caplog.text)
    send(root, 2.0)
    assert root.property("sent") is False
    assert not received


def test_missing_init_is_reported(bench: Any, wait: Any, caplog: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr("rosglass.qml.engine.session._FORGOTTEN", 20)
    root = load(bench)
    wait(lambda: "not connected: the interface has not called Ros2.init" in caplog.text)
    caplog.clear()
    send(root, 1.0)
    assert 'it is not advertised yet; the interface has not called Ros2.init("name")' in caplog.text


def test_init_prevents_the_warning(running: Any, wait: Any, caplog: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr("rosglass.qml.engine.session._FORGOTTEN", 0)
    root = load(running)
    wait(lambda: root.property("advertised") == 1)
    wait.settled(running.session)
    assert "has not called Ros2.init" not in caplog.text


def test_shutdown_withdraws_and_init_advertises_again(
    running: Any, received: list, wait: Any
) -> None:
    root = load(running)
    wait(lambda: root.property("advertised") == 1)
    running.session.shutdown()
    wait(lambda: root.property("advertised") == 2)
    wait(lambda: not running.world.publishers)
    send(root, 1.0)
    assert root.property("sent") is False
    running.session.init("again")
    wait(lambda: root.property("advertised") == 3)
    send(root, 2.0)
    wait(lambda: received)
    assert received[0].linear.x == 2.0


@pytest.mark.both_qt
def test_a_publisher_lives_as_long_as_javascript_holds_it(running: Any, wait: Any) -> None:
    root = load(running, "function drop() { pub = null; gc() }")
    wait(lambda: len(running.world.publishers) == 1)
    gc.collect()
    running.engine.collectGarbage()
    wait.settled(running.session)
    assert len(running.world.publishers) == 1
    root.drop()
    wait(lambda: not running.world.publishers)


@pytest.mark.both_qt
def test_properties(running: Any, wait: Any, received: list) -> None:
    root = running.load(
        """QtObject {
            property var qos: Ros2.QoS().reliable().transient_local().keep_last(2)
            property var pub: Ros2.createPublisher("~/state", "std_msgs/msg/Bool", qos)
            property var facts: [pub.topic, pub.type, pub.queueSize, pub.isAdvertised,
                                 pub.qos.durability]
        }"""
    )
    assert root.property("facts").toVariant()[1:] == [
        "std_msgs/msg/Bool",
        2,
        False,
        "transient_local",
    ]
    wait(lambda: root.property("facts").toVariant()[3])
    assert root.property("facts").toVariant()[0] == "/ui/state"
    publisher = running.world.publishers[-1]
    assert publisher.qos.durability is Durability.TRANSIENT_LOCAL
    assert publisher.qos.reliability is Reliability.RELIABLE
    assert running.run('return Ros2.createPublisher("/x", "std_msgs/msg/Bool").queueSize') == 10


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ('"bad topic", "std_msgs/msg/Bool"', "bad topic"),
        ('"", "std_msgs/msg/Bool"', "non-empty"),
        ('"/x", ""', "type of topic '/x' is empty"),
        ('"/x", "Bool"', "'Bool' is not a type name"),
        ('"std_msgs/msg/Bool", "/x"', "Are name and type swapped?"),
        ('"/x", "std_msgs/msg/Bool", 0', "an integer of 1 to"),
        ('"/x", "std_msgs/msg/Bool", 1.5', "an integer of 1 to"),
        ('"/x", "std_msgs/msg/Bool", "reliable"', "a queue size or Ros2.QoS"),
    ],
)
def test_bad_arguments_throw(running: Any, arguments: str, reason: str) -> None:
    script = "try { Ros2.createPublisher(%s); return 'made' } catch (e) { return String(e) }"
    assert reason in running.run(script % arguments)


def test_unknown_types_are_said_and_looked_for_again(running: Any, wait: Any, caplog: Any) -> None:
    running.world.missing.add("std_msgs/msg/Bool")
    root = running.load(
        """QtObject { property var pub: Ros2.createPublisher("/x", "std_msgs/msg/Bool")
            property string problem: pub.problem }"""
    )
    wait(lambda: "std_msgs/msg/Bool" in root.property("problem"))
    assert any(r.levelno == logging.WARNING for r in caplog.records)
    running.world.missing.clear()
    wait(lambda: root.property("problem") == "")
    assert len(running.world.publishers) == 1


def test_keep_all_never_waits_on_the_gui_thread(running: Any, wait: Any) -> None:
    import threading

    root = running.load(
        """QtObject {
            property var qos: Ros2.QoS().reliable().keep_all()
            property var pub: Ros2.createPublisher("/x", "std_msgs/msg/Bool", qos)
            function send() { return pub.publish({data: true}) }
        }"""
    )
    wait(lambda: running.world.publishers)
    threads: list = []
    running.world.publishers[0].publish_serialized = lambda data: threads.append(
        threading.current_thread()
    )
    wait.settled(running.session)
    root.send()
    wait(lambda: threads)
    assert threads[0] is not threading.main_thread()


def test_unsent_messages_of_keep_all_are_reported(running: Any, wait: Any, caplog: Any) -> None:
    root = running.load(
        """QtObject {
            property var qos: Ros2.QoS().reliable().keep_all()
            property var pub: Ros2.createPublisher("/x", "std_msgs/msg/Bool", qos)
            function ready() { return pub.isAdvertised }
            function send() { return pub.publish({data: true}) }
        }"""
    )
    wait(root.ready)
    running.world.publishers[0].close()
    root.send()
    wait(lambda: "nothing was published on /x: the publisher of /x is closed" in caplog.text)


def test_a_topic_without_subscribers_is_named_with_the_near_name(
    running: Any, received: list, wait: Any, caplog: Any, monkeypatch: Any
) -> None:
    monkeypatch.setattr("rosglass.qml.elements.publisher.NO_PEER_MS", 20)
    caplog.set_level("INFO", "rosglass.qml")
    running.robot.create_publisher("/cmd_vel", TWIST)  # topics() of this graph shows published ones
    code = 'QtObject { property var pub: Ros2.createPublisher("TOPIC", "geometry_msgs/Twist") }'
    for topic in ("/cmd_vel", "/cmd_vell"):
        root = running.load(code.replace("TOPIC", topic))
        wait(lambda root=root: root.property("pub").property("isAdvertised"))
    # The other one would have been logged before.
    wait(lambda: "/cmd_vell: this topic has no subscription" in caplog.text)
    (warning,) = [one for one in caplog.records if "this topic has no subscription" in one.message]
    assert warning.levelno == logging.WARNING
    assert "/cmd_vell: this topic has no subscription; did you mean /cmd_vel?" in warning.message


def test_publishing_at_the_end_of_the_program_is_not_a_mistake(
    running: Any, wait: Any, caplog: Any
) -> None:
    root = load(running)
    wait(lambda: root.property("advertised") == 1)
    running.session.shutdown()
    send(root, 0.5)
    assert root.property("sent") is False
    assert "nothing was published on cmd_vel: the node was shut down" in caplog.text
    assert "has not called Ros2.init" not in caplog.text
    caplog.clear()
    running.session.close()
    send(root, 0.5)
    assert root.property("sent") is False
    assert caplog.text == ""


@pytest.mark.both_qt
def test_messages_waiting_for_their_topic_are_sent_after_the_engine(
    running: Any, wait: Any, tmp_path: Any
) -> None:
    received: list[str] = []
    running.robot.create_subscription(
        "/late", "std_msgs/msg/String", lambda message: received.append(message.data)
    )
    engine = QtQml.QQmlEngine()
    install(engine, running.session)
    from conftest import Bench

    other = Bench(running.session, engine, running.world, tmp_path / "other")
    script = (
        "return Ros2.createPublisher('/late', 'std_msgs/msg/String', 5).publish({data: 'last'})"
    )
    assert other.run(script) is True
    assert received == []
    for item in (*other.roots, engine):
        item.deleteLater()
    send_deferred_deletes()
    wait(lambda: received == ["last"])

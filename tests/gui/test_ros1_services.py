"""The singleton Service of Ros 1.0, on a ROS 1 and on a ROS 2 robot."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

if TYPE_CHECKING:
    from conftest import Bench


@pytest.fixture
def received(live: Bench) -> list[Any]:
    """The values that the robot's lamp received, as the service /lamp."""
    live.module = "Ros 1.0"
    received = []

    def switch(request: Any) -> dict[str, Any]:
        received.append(request.data)
        return {"success": request.data, "message": "done"}

    live.robot.create_service_server("/lamp", "std_srvs/srv/SetBool", switch)
    return received


def test_a_call_returns_the_response(live: Bench, received: list[Any]) -> None:
    answer = live.run('return Service.call("/lamp", "std_srvs/SetBool", {data: true})')
    assert answer == {"success": True, "message": "done"}
    assert received == [True]


def test_an_empty_response_is_true(live: Bench, received: list[Any]) -> None:
    live.robot.create_service_server("/reset", "std_srvs/srv/Empty", lambda request: None)
    assert live.run('return Service.call("/reset", "std_srvs/Empty", {})') is True
    assert live.run('return Service.call("/reset", "std_srvs/Empty")') is True


def test_a_failure_is_false_and_logged(live: Bench, received: list[Any], caplog: Any) -> None:
    def fail(request: Any) -> None:
        raise RuntimeError("no power")

    live.robot.create_service_server("/lift", "std_srvs/srv/Trigger", fail)
    script = 'return Service.call("/lift", "std_srvs/Trigger", {})'
    if live.session.url.startswith("ros1"):
        assert live.run(script) is False
        assert "/lift" in caplog.text


def test_a_wrong_field_throws_its_path(live: Bench, received: list[Any], caplog: Any) -> None:
    script = """
        Service.call("/lamp", "std_srvs/SetBool", {data: true})
        try { Service.call("/lamp", "std_srvs/SetBool", {data: "yes"}) }
        catch (error) { return error.toString() }
        return "nothing"
    """
    assert "data" in live.run(script)
    assert received == [True]
    # Nothing was wrong with the first call, and the second one throws.
    assert not [record for record in caplog.records if record.levelname in ("WARNING", "ERROR")]


def test_an_unknown_type_calls_back_with_false(live: Bench, received: list[Any], wait: Any) -> None:
    root: Any = live.load("""
        QtObject {
            property var answer
            Component.onCompleted: {
                Service.callAsync("/nowhere", "no_msgs/No", {}, function (a) { answer = a })
            }
        }
    """)
    wait(lambda: root.property("answer") is False)


def test_asynchronously(live: Bench, received: list[Any], wait: Any) -> None:
    root: Any = live.load("""
        QtObject {
            property var answer
            Component.onCompleted: {
                Service.callAsync("/lamp", "std_srvs/SetBool", {data: true},
                                  function (a) { answer = a.message })
            }
        }
    """)
    wait(lambda: root.property("answer") == "done")
    assert received == [True]


@pytest.mark.both_qt
def test_the_interface_lives_while_a_call_waits(
    live: Bench, received: list[Any], wait: Any
) -> None:
    """A timer runs, and the page that called is destroyed, while its handler waits."""
    go = threading.Event()

    def slow(request: Any) -> dict[str, Any]:
        assert go.wait(30)
        return {"success": True}

    live.robot.create_service_server("/slow", "std_srvs/srv/Trigger", slow)
    root: Any = live.load(
        """
        QtObject {
            id: root
            property int ticks: 0
            property var answer
            property QtObject page
            property Component pages: Component {
                QtObject {
                    function go() {
                        const answer = Service.call("/slow", "std_srvs/Trigger", {})
                        root.answer = answer.success
                    }
                    Component.onCompleted: Qt.callLater(go)
                }
            }
            property Timer timer: Timer {
                interval: 10; repeat: true; running: true
                onTriggered: {
                    root.ticks += 1
                    if (root.ticks === 30) root.page.destroy()
                }
            }
            Component.onCompleted: page = pages.createObject(root)
        }
    """
    )
    threading.Timer(1.5, go.set).start()
    wait(lambda: root.property("answer") is True)
    assert root.property("ticks") > 30


@pytest.mark.both_qt
def test_calls_that_wait_within_each_other_leave_the_stop_button_alive(
    live: Bench, received: list[Any], wait: Any, caplog: Any
) -> None:
    """A robot that does not answer must not use up the stack, which everything needs."""
    go, heard = threading.Event(), []

    def slow(request: Any) -> dict[str, Any]:
        assert go.wait(60)
        return {"success": True}

    live.robot.create_service_server("/slow", "std_srvs/srv/Trigger", slow)
    observer = live.world.connect(None, "observer")
    observer.create_subscription("/stop", "std_msgs/msg/Bool", lambda m: heard.append(m.data))
    root: Any = live.load("""
        QtObject {
            id: root
            property int depth: 0
            property int deepest: 0
            property int calls: 0
            property var answers: []
            property var stop: Ros.advertise("std_msgs/Bool", "/stop", 10)
            function ready() { return stop.getNumSubscribers() }
            function start() { timer.start() }
            property Timer timer: Timer {
                interval: 1; repeat: true
                onTriggered: {
                    if (++root.calls === 400) {
                        stop()
                        root.stop.publish({data: true})
                        return
                    }
                    root.deepest = Math.max(root.deepest, ++root.depth)
                    root.answers.push(Service.call("/slow", "std_srvs/Trigger"))
                    --root.depth
                }
            }
            function refused() { return answers.filter(a => a === false).length }
            function given() { return answers.filter(a => a && a.success).length }
        }
    """)
    wait(root.ready)
    observing = threading.Thread(target=lambda: (eventually(lambda: heard), go.set()))
    observing.start()
    root.start()
    wait(lambda: root.property("depth") == 0 and root.given())
    observing.join()
    assert heard == [True]
    assert 10 < root.property("deepest") < 50
    assert root.refused() > 300
    assert "not waited for" in caplog.text

"""The control ServiceButton."""

from __future__ import annotations

import threading
from typing import Any

import pytest
from hands import click, press, release

TRIGGER, SET_BOOL = "std_srvs/srv/Trigger", "std_srvs/srv/SetBool"
pytestmark = pytest.mark.both_qt


def test_click_calls_the_service_and_shows_its_answer(controls: Any, wait: Any) -> None:
    got: list[bool] = []

    def switch(request: Any) -> dict[str, Any]:
        got.append(request.data)
        return {"success": True, "message": "lamp is on"}

    controls.robot.create_service_server("/lamp", SET_BOOL, switch)
    button = controls.show('ServiceButton { service: "/lamp"; request: ({data: true}) }')
    wait(lambda: button.property("ready"))
    click(controls, "button")
    wait(lambda: button.property("outcome") == "done")
    assert got == [True]
    assert button.property("status") == "done: lamp is on"


def test_refusal_is_shown_in_the_words_of_the_server(controls: Any, wait: Any) -> None:
    text = "<b>no</b><img src='http://x/y'> " * 100
    controls.robot.create_service_server(
        "/dock", TRIGGER, lambda _: {"success": False, "message": text}
    )
    button = controls.show('ServiceButton { service: "dock"; ns: "/" }')
    wait(lambda: button.property("ready"))
    button.call()
    wait(lambda: button.property("outcome") == "refused")
    shown = controls.find("status").property("text")
    assert shown.startswith("REFUSED: <b>no</b><img")
    assert len(shown) < 400
    assert not button.property("busy")


def test_server_that_appears_later_enables_the_button(controls: Any, wait: Any) -> None:
    button = controls.show('ServiceButton { service: "/late"; text: "Go" }')
    wait(lambda: button.property("status").startswith("NOT AVAILABLE"))
    click(controls, "button")
    assert not button.property("busy")
    server = controls.robot.create_service_server("/late", TRIGGER, lambda _: {"success": True})
    wait(lambda: button.property("ready"))
    click(controls, "button")
    wait(lambda: button.property("outcome") == "done")
    server.close()
    wait(lambda: not button.property("ready"))
    assert button.property("status").startswith("NOT AVAILABLE")


def test_server_that_never_answers_is_given_up(controls: Any, wait: Any) -> None:
    go = threading.Event()
    controls.robot.create_service_server("/slow", TRIGGER, lambda _: go.wait(30) and None)
    button = controls.show('ServiceButton { service: "/slow"; timeout: 300 }')
    wait(lambda: button.property("ready"))
    button.call()
    assert button.property("busy")
    wait(lambda: button.property("outcome") == "failed")
    assert "no answer within 0.3 s" in button.property("status")
    go.set()


def test_server_that_leaves_before_it_answers(controls: Any, wait: Any) -> None:
    go = threading.Event()
    server = controls.robot.create_service_server("/slow", TRIGGER, lambda _: go.wait(30) and None)
    button = controls.show('ServiceButton { service: "/slow" }')
    wait(lambda: button.property("ready"))
    button.call()
    threading.Thread(target=server.close).start()
    wait(lambda: not button.property("ready") and not button.property("busy"))
    assert button.property("status").startswith("FAILED")
    go.set()


def test_service_of_an_unknown_type_is_named(controls: Any, wait: Any) -> None:
    button = controls.show('ServiceButton { service: "/x"; type: "nowhere/srv/Nothing" }')
    wait(lambda: "nowhere/srv/Nothing" in button.property("status"))
    assert not controls.find("button").property("enabled")


def test_request_that_does_not_fit_is_not_sent(controls: Any, wait: Any) -> None:
    controls.robot.create_service_server("/lamp", SET_BOOL, lambda _: {"success": True})
    button = controls.show('ServiceButton { service: "/lamp"; request: ({data: "on"}) }')
    wait(lambda: button.property("ready"))
    button.call()
    assert "data: expected" in button.property("status")
    assert not button.property("busy")


def test_invalid_name_is_named(controls: Any) -> None:
    button = controls.show('ServiceButton { service: "a b" }')
    assert "a b" in button.property("status")


def test_hold_calls_only_after_it_was_held(controls: Any, wait: Any) -> None:
    got: list[int] = []
    controls.robot.create_service_server("/cut", TRIGGER, lambda _: got.append(1))
    button = controls.show('ServiceButton { service: "/cut"; hold: true; holdTime: 0.5 }')
    wait(lambda: button.property("ready"))
    press(controls, "holdButton")
    wait(lambda: 0 < controls.find("holdButton").property("progress") < 1)
    release(controls, "holdButton")
    wait(lambda: controls.find("holdButton").property("progress") == 0)
    assert not button.property("busy")
    assert got == []
    press(controls, "holdButton")
    wait(lambda: got)
    release(controls, "holdButton")
    wait(lambda: button.property("outcome") != "")
    assert got == [1]


def test_two_buttons_call_one_server(live_controls: Any, wait: Any) -> None:
    """Two clients of one service each get their own answer, on each wire."""
    robot = live_controls.robot
    robot.create_service_server(
        "/lamp", SET_BOOL, lambda request: {"success": request.data, "message": f"{request.data}"}
    )
    live_controls.show("""Column {
        ServiceButton { objectName: "one"; service: "/lamp"; request: ({data: true}) }
        ServiceButton { objectName: "two"; service: "/lamp"; request: ({data: false}) }
    }""")
    one, two = live_controls.find("one"), live_controls.find("two")
    wait(lambda: one.property("ready") and two.property("ready"))
    one.call()
    two.call()
    wait(lambda: one.property("outcome") == "done" and two.property("outcome") == "refused")
    assert two.property("status") == "REFUSED: False"


def test_button_may_go_while_it_waits(controls: Any, wait: Any, caplog: Any) -> None:
    go = threading.Event()
    controls.robot.create_service_server(
        "/slow", TRIGGER, lambda _: {"success": go.wait(30), "message": "too late"}
    )
    root = controls.show("""Loader {
        property bool busy: item ? item.busy : false
        property bool ready: item ? item.ready : false
        function call() { item.call() }
        sourceComponent: Component { ServiceButton { service: "/slow" } }
    }""")
    wait(lambda: root.property("ready"))
    root.call()
    assert root.property("busy")
    root.setProperty("active", False)
    go.set()
    wait.settled(controls.engine_session)
    assert "TypeError" not in caplog.text
    assert "ReferenceError" not in caplog.text


def test_status_can_be_shown_elsewhere(controls: Any, wait: Any) -> None:
    button = controls.show('ServiceButton { service: "/lamp"; showStatus: false }')
    wait(lambda: "NOT AVAILABLE" in button.property("status"))
    assert not controls.find("status").isVisible()
    assert button.property("implicitHeight") == controls.find("button").height()

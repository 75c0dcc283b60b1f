"""The controls PublishPanel and CallPanel."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from hands import click, key, press, write

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.both_qt
TWIST, FLOAT = "geometry_msgs/msg/Twist", "std_msgs/msg/Float64"


@pytest.fixture(autouse=True)
def state(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


class Panel:
    """A panel with what the robot receives."""

    def __init__(self, controls: Any, wait: Any) -> None:
        self.controls, self.wait, self.received = controls, wait, []

    def show(self, panel: str, kind: str = FLOAT, topic: str = "/level") -> Any:
        self.controls.robot.create_subscription(topic, kind, self.received.append)
        self.item = self.controls.show(panel, 420, 520)
        self.wait(lambda: self.find("form").property("ready"))
        self.wait(lambda: "type of" not in self.find("kind").property("text"))
        return self.item

    def find(self, name: str) -> Any:
        return self.controls.find(name)

    def repeat(self) -> None:
        """Publish again and again, until some have been received."""
        self.wait(lambda: self.find("repeat").isEnabled())
        push(self.controls, "repeat")
        assert self.item.property("repeating")
        self.wait(lambda: len(self.received) > 3)

    def stopped(self) -> None:
        """Check that nothing is published any more."""
        assert not self.item.property("repeating")
        self.wait.settled(self.controls.bench.session)
        count, sent = len(self.received), self.item.property("sent")
        self.wait.signals(self.ticks(), 3)
        assert (len(self.received), self.item.property("sent")) == (count, sent)

    def ticks(self) -> Any:
        """A signal that fires as often as the panel would publish."""
        timer = self.controls.bench.load("Timer { interval: 20; repeat: true; running: true }")
        return timer.triggered


def push(controls: Any, name: str) -> None:
    """Push a button by the keyboard."""
    controls.find(name).forceActiveFocus()
    key(controls, "Return")


@pytest.fixture
def panel(controls: Any, wait: Any) -> Panel:
    return Panel(controls, wait)


def test_a_message_is_published_once(panel: Panel, controls: Any, wait: Any) -> None:
    panel.show('PublishPanel { topic: "/level"; width: 400; height: 500 }')
    wait(lambda: panel.find("publish").isEnabled())
    write(controls, "field_data", "2.5")
    push(controls, "publish")
    wait(lambda: [one.data for one in panel.received] == [2.5])
    push(controls, "publish")
    assert panel.find("said").property("text") == "sent to 1 subscriber"
    form = panel.find("form").property("messageFields")
    wait(lambda: list(form.property("history")) == ["data: 2.5"])


def test_a_misfit_is_not_published(panel: Panel, controls: Any, wait: Any) -> None:
    panel.show('PublishPanel { topic: "/level"; width: 400; height: 500 }')
    write(controls, "field_data", "much")
    assert not panel.find("publish").isEnabled()
    panel.item.publish()
    assert "expected a number" in panel.find("said").property("text")
    assert panel.received == []


def test_repeating_is_obvious_and_stops_by_its_button(panel: Panel, controls: Any) -> None:
    panel.show('PublishPanel { topic: "/level"; rate: 50; width: 400; height: 500 }')
    panel.repeat()
    assert panel.find("aside").property("text").startswith("PUBLISHING 50 Hz")
    assert panel.find("repeat").property("text") == "STOP"
    push(controls, "repeat")
    panel.stopped()


@pytest.mark.parametrize(
    "change",
    ["hidden", "disabled", "obstacle", "topic", "namespace", "misfit", "window", "moved", "halt"],
)
def test_repeating_stops_when(panel: Panel, controls: Any, change: str) -> None:
    item = panel.show('PublishPanel { topic: "level"; ns: "/"; rate: 50; width: 400; height: 500 }')
    panel.repeat()
    if change == "hidden":
        item.parentItem().setVisible(False)
    elif change == "disabled":
        # As a Cockpit halts what is on it.
        item.parentItem().setEnabled(False)
        item.parentItem().setEnabled(True)
    elif change == "obstacle":
        item.setProperty("obstacle", "emergency stop")
    elif change == "topic":
        item.setProperty("topic", "other")
    elif change == "namespace":
        item.setProperty("ns", "/robot2")
    elif change == "misfit":
        form = panel.find("form").property("messageFields")
        form.setText("data", "much")
        panel.wait(lambda: not item.property("repeating"))
        assert "STOPPED: data: expected" in panel.find("said").property("text")
    elif change == "window":
        controls.window.hide()
    elif change == "moved":
        item.setParentItem(controls.window.contentItem())
    else:
        item.halt()
    panel.wait(lambda: not item.property("repeating"))
    panel.stopped()


def test_repeating_stops_when_the_robot_is_lost(panel: Panel, controls: Any, wait: Any) -> None:
    item = panel.show('PublishPanel { topic: "/level"; rate: 50; width: 400; height: 500 }')
    panel.repeat()
    controls.bench.session.shutdown()
    wait(lambda: not item.property("repeating"))
    assert "NOT SENT" in panel.find("said").property("text")


def test_robot_commands_are_held_and_not_repeated(panel: Panel, controls: Any, wait: Any) -> None:
    item = panel.show(
        'PublishPanel { topic: "/cmd_vel"; width: 400; height: 500 }', TWIST, "/cmd_vel"
    )
    assert item.property("moves")
    wait(lambda: panel.find("holdPublish").isEnabled())
    assert "TwistCommand" in panel.find("moves").property("text")
    assert not panel.find("publish").isVisible()
    assert not panel.find("repeat").isVisible()
    item.start()
    assert not item.property("repeating")
    assert "TwistCommand" in panel.find("said").property("text")
    write(controls, "field_linear.x", "0.5")
    click(controls, "holdPublish")
    wait.settled(controls.bench.session)
    assert panel.received == []
    panel.find("holdPublish").setProperty("delay", 50)
    press(controls, "holdPublish")
    wait(lambda: [one.linear.x for one in panel.received] == [0.5])


def test_topic_is_entered_with_suggestions(panel: Panel, controls: Any, wait: Any) -> None:
    controls.robot.create_subscription("/level", FLOAT, panel.received.append)
    item = controls.show("PublishPanel { width: 400; height: 500 }", 420, 520)
    wait(lambda: item.suggest_("/lev").toVariant())
    assert item.suggest_("/lev").toVariant()[0]["text"] == "/level"
    write(controls, "topic", "/level")
    wait(lambda: controls.find("form").property("ready"))
    wait(lambda: controls.find("publish").isEnabled())
    push(controls, "publish")
    wait(lambda: len(panel.received) == 1)


def test_type_that_is_not_known_is_said(controls: Any, wait: Any) -> None:
    controls.show('PublishPanel { topic: "/nothing"; width: 400; height: 500 }', 420, 520)
    wait(lambda: "not known yet" in controls.find("kind").property("text"))
    assert not controls.find("publish").isEnabled()


# -- CallPanel --


def test_service_is_called_with_the_request_of_the_form(controls: Any, wait: Any) -> None:
    got: list[bool] = []

    def answer(request: Any) -> dict[str, Any]:
        got.append(request.data)
        return {"success": request.data, "message": "the lid is open"}

    controls.robot.create_service_server("/lid", "std_srvs/srv/SetBool", answer)
    panel = controls.show('CallPanel { service: "/lid"; width: 400; height: 500 }', 420, 520)
    wait(lambda: panel.property("ready") and controls.find("form").property("ready"))
    wait(lambda: controls.find("switch_data").isVisible())
    push(controls, "switch_data")
    push(controls, "call")
    wait(lambda: panel.property("outcome") == "done")
    assert got == [True]
    assert controls.find("response").property("text") == "success: true\nmessage: the lid is open"
    push(controls, "switch_data")
    push(controls, "call")
    wait(lambda: panel.property("outcome") == "refused")
    assert controls.find("state").property("text") == "REFUSED: the lid is open"
    panel.setProperty("obstacle", "emergency stop")
    panel.call()
    wait.settled(controls.bench.session)
    assert got == [True, False]


def test_missing_service_is_said(controls: Any, wait: Any) -> None:
    panel = controls.show('CallPanel { service: "/lid"; width: 400; height: 500 }', 420, 520)
    wait(lambda: panel.property("status").startswith("NOT AVAILABLE"))
    assert not controls.find("call").isEnabled()


def test_service_is_entered(controls: Any, wait: Any) -> None:
    controls.robot.create_service_server("/reset", "std_srvs/srv/Trigger", lambda _: {})
    panel = controls.show("CallPanel { width: 400; height: 500 }", 420, 520)
    wait(lambda: panel.suggest_("res").toVariant())
    write(controls, "service", "/reset")
    wait(lambda: panel.property("ready"))
    wait(lambda: controls.find("call").isEnabled())
    push(controls, "call")
    wait(lambda: panel.property("outcome") == "refused")


def test_panels_over_a_real_middleware(live_controls: Any, wait: Any) -> None:
    received: list[Any] = []
    live_controls.robot.create_subscription("/level", FLOAT, received.append)
    live_controls.robot.create_service_server(
        "/lid", "std_srvs/srv/SetBool", lambda request: {"success": request.data}
    )
    live_controls.show(
        """Column { anchors.fill: parent
            PublishPanel { objectName: "one"; topic: "/level"; type: "std_msgs/Float64" }
            CallPanel { objectName: "two"; service: "/lid"; type: "std_srvs/SetBool" }
        }""",
        400,
        900,
    )
    publisher, caller = live_controls.find("one"), live_controls.find("two")
    wait(lambda: live_controls.find("publish").isEnabled() and caller.property("ready"))
    live_controls.find("form", publisher).property("messageFields").setText("data", "1.5")
    wait(lambda: publisher.publish() or received)
    assert received[0].data == 1.5
    live_controls.find("form", caller).property("messageFields").setText("data", "true")
    caller.call()
    wait(lambda: caller.property("outcome") == "done")

"""The control ActionPanel."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import pytest
from counting import Counter
from hands import click, write

import rosglass

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.both_qt


@pytest.fixture(autouse=True)
def state(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Keep goals that were sent in a folder of the test."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


TYPE = "example_interfaces/action/Fibonacci"


@pytest.fixture
def counter(controls: Any) -> Any:
    made = Counter(controls.robot, "local")
    yield made
    made.go.set()
    made.stop.set()


def test_goal_shows_progress_and_result(controls: Any, counter: Any, wait: Any) -> None:
    counter.offer()
    panel = controls.show("""ActionPanel {
        action: "/count"; goal: ({order: 6})
        progressOf: function(feedback) { return feedback.sequence.length / 6 }
        describe: function(message) { return message.sequence.length + " numbers" }
        property var ends: []
        onFinished: function(outcome, result, reason) { ends = ends.concat([outcome]) }
    }""")
    wait(lambda: panel.property("ready"))
    click(controls, "send")
    wait(lambda: panel.property("outcome") == "succeeded")
    assert panel.property("progress") == 1
    assert controls.find("said").property("text") == "6 numbers"
    assert controls.find("state").property("text") == "done"
    assert not panel.property("busy")


def test_goal_is_canceled(controls: Any, counter: Any, wait: Any) -> None:
    counter.offer()
    panel = controls.show('ActionPanel { action: "/count"; goal: ({order: 50}) }')
    wait(lambda: panel.property("ready"))
    click(controls, "send")
    wait(lambda: panel.property("outcome") == "running" and panel.property("feedback"))
    click(controls, "cancel")
    wait(lambda: panel.property("outcome") == "canceled")
    assert controls.find("state").property("text") == "CANCELLED"


def test_goal_without_news_says_so(controls: Any, counter: Any, wait: Any) -> None:
    counter.offer()
    counter.stop.clear()
    panel = controls.show('ActionPanel { action: "/count"; goal: ({order: 50}) }')
    wait(lambda: panel.property("ready"))
    panel.send(None)
    wait(lambda: panel.property("feedback"))
    panel.cancel()
    wait(lambda: "last feedback" in controls.find("state").property("text"))
    assert panel.property("outcome") == "canceling"
    counter.stop.set()
    wait(lambda: panel.property("outcome") == "canceled")
    assert controls.find("state").property("text") == "CANCELLED"


def test_form_has_the_fields_of_the_goal(controls: Any, counter: Any, wait: Any) -> None:
    counter.offer()
    panel = controls.show('ActionPanel { action: "/count" }')
    wait(lambda: panel.property("ready"))
    wait(lambda: controls.find("form").property("ready"))
    write(controls, "field_order", "four")
    said = "order: expected a whole number (int32), got 'four'"
    assert controls.find("state").property("text") == said
    assert controls.find("detail_order").property("text") == said
    assert not panel.property("busy")
    write(controls, "field_order", "2.5")
    wait(lambda: "order: expected" in controls.find("state").property("text"))
    write(controls, "field_order", "4")
    wait(lambda: panel.property("outcome") == "succeeded")


def test_rejected_goal_and_failed_goal_say_so(controls: Any, counter: Any, wait: Any) -> None:
    counter.offer()
    panel = controls.show('ActionPanel { action: "/count"; goal: ({order: -1}) }')
    wait(lambda: panel.property("ready"))
    panel.send(None)
    wait(lambda: panel.property("outcome") == "refused")
    assert controls.find("state").property("text") == "REFUSED"
    panel.send({"order": 13})
    wait(lambda: panel.property("outcome") == "aborted")
    assert controls.find("state").property("text") == "FAILED"


def test_lost_server_leaves_the_outcome_unknown(controls: Any, counter: Any, wait: Any) -> None:
    counter.offer()
    panel = controls.show('ActionPanel { action: "/count"; goal: ({order: 50}) }')
    wait(lambda: panel.property("ready"))
    panel.send(None)
    wait(lambda: panel.property("outcome") == "running")
    closing = threading.Thread(target=counter.server.close)
    closing.start()
    wait(lambda: panel.property("outcome") not in {"running", "sent"})
    closing.join()
    wait(lambda: not panel.property("ready"))
    assert panel.property("outcome") in {"unknown", "aborted", "canceled"}
    assert panel.property("status").startswith("NOT AVAILABLE")


def test_action_of_an_unknown_type_is_named(controls: Any, wait: Any) -> None:
    panel = controls.show('ActionPanel { action: "/count"; type: "nowhere/action/Nothing" }')
    wait(lambda: "nowhere/action/Nothing" in panel.property("status"))


def test_goal_over_a_real_middleware(live_controls: Any, url: str, wait: Any) -> None:
    counter = Counter(live_controls.robot, url)
    counter.offer()
    panel = live_controls.show('ActionPanel { action: "/count" }')
    wait(lambda: panel.property("ready"))
    wait(lambda: live_controls.find("form").property("ready"))
    write(live_controls, "field_order", "5")
    wait(lambda: panel.property("outcome") == "succeeded")
    write(live_controls, "field_order", "13")
    wait(lambda: panel.property("outcome") == "aborted")
    write(live_controls, "field_order", "50")
    wait(lambda: panel.property("outcome") == "running")
    panel.cancel()
    wait(lambda: panel.property("outcome") == "canceled")


@pytest.mark.parametrize("url", ["zenoh"], indirect=True, scope="module")
def test_types_that_only_the_robot_has(
    live_controls: Any, url: str, wait: Any, tmp_path: Path
) -> None:
    """The form of an action, and a service's request, of types that are fetched from the robot."""
    for kind, text in (
        (
            "action/Dig",
            "float64 depth\nstring tool\nbool fast\n---\nfloat64 dug\n---\nfloat64 progress\n",
        ),
        ("srv/Fill", "int32 count\n---\nbool ok\nstring reason\n"),
    ):
        file = tmp_path / "moon_msgs" / f"{kind}.{kind.partition('/')[0]}"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    library = rosglass.Library()
    library.add_path(tmp_path / "moon_msgs")
    got: list[Any] = []

    def dig(goal: Any) -> dict[str, float]:
        got.append((goal.goal.depth, goal.goal.tool, goal.goal.fast))
        goal.publish_feedback({"progress": 0.5})
        return {"dug": goal.goal.depth}

    with rosglass.connect(url, "digger", library=library) as robot:
        robot.create_action_server("/dig", "moon_msgs/action/Dig", dig)
        robot.create_service_server(
            "/fill", "moon_msgs/srv/Fill", lambda _: {"ok": False, "reason": "no sand"}
        )
        live_controls.show("""Column {
            ActionPanel { objectName: "dig"; action: "/dig"; width: 300 }
            ServiceButton { objectName: "fill"; service: "/fill"; request: ({count: 3}) }
        }""")
        panel, button = live_controls.find("dig"), live_controls.find("fill")
        wait(lambda: live_controls.find("form").property("ready") and button.property("ready"))
        write(live_controls, "field_tool", "<b>spade</b>")
        wait(lambda: panel.property("outcome") == "succeeded")
        write(live_controls, "field_depth", "1.5")
        wait(lambda: (1.5, "<b>spade</b>", False) in got)
        wait(lambda: live_controls.find("said").property("text") == "dug 1.5")
        button.call()
        wait(lambda: button.property("status") == "REFUSED: no sand")


def test_goals_have_a_button_each_and_an_obstacle_disables_them(
    controls: Any, counter: Any, wait: Any
) -> None:
    counter.offer()
    panel = controls.show("""ActionPanel {
        action: "/count"
        goals: [{text: "Three", goal: {order: 3}}, {text: "Five", goal: {order: 5}}]
        describe: function(message) { return message.sequence.length + " numbers" }
    }""")
    wait(lambda: controls.find("goal1").isEnabled())
    assert not controls.find("send").isVisible()
    click(controls, "goal1")
    wait(lambda: panel.property("outcome") == "succeeded")
    assert controls.find("state").property("text") == "Five: done"
    assert controls.find("said").property("text") == "5 numbers"
    panel.setProperty("obstacle", "emergency stop")
    assert not controls.find("goal1").isEnabled()
    assert panel.property("status") == "emergency stop"
    panel.send({"order": 3})
    assert controls.find("state").property("text") == "REFUSED"
    assert controls.find("said").property("text") == "emergency stop"
    panel.setProperty("obstacle", "")
    panel.setProperty("hold", True)
    assert controls.find("holdGoal1").isVisible()

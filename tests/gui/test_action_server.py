"""Actions that QML offers, called by a robot over real middleware; both modules."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from conftest import Bench
from rosglass.comm import GoalStatus
from rosglass.errors import GoalRejectedError

if TYPE_CHECKING:
    from rosglass.comm import ClientGoal

EVERY_WIRE = pytest.mark.parametrize("url", ["zenoh", "dds", "ros1"], indirect=True, scope="module")
SUCCEEDED, CANCELED, ABORTED = GoalStatus.SUCCEEDED, GoalStatus.CANCELED, GoalStatus.ABORTED


class Robot:
    """Sends goals to the interface.

    Attributes:
        type: The action's type, of the robot's ROS.
    """

    def __init__(self, node: Any, url: str, wait: Any) -> None:
        self.ros1 = url.startswith("ros1")
        package = "actionlib_tutorials" if self.ros1 else "example_interfaces"
        self.type = f"{package}/action/Fibonacci"
        self.client = node.create_action_client("/count", self.type)
        self.wait = wait
        self.feedback: list[list[int]] = []

    def send(self, order: int) -> ClientGoal:
        self.wait(lambda: self.client.ready)
        goal: ClientGoal = self.client.send_goal(
            {"order": order}, on_feedback=lambda m: self.feedback.append(list(m.sequence))
        )
        return goal

    def end(self, goal: ClientGoal) -> tuple[GoalStatus, list[int]]:
        self.wait(goal.done.done)
        end = goal.done.result()
        return end.status, list(end.result.sequence)


@pytest.fixture
def robot(live: Bench, url: str, wait: Any) -> Robot:
    return Robot(live.robot, url, wait)


def offer(live: Bench, robot: Robot, body: str) -> Any:
    return live.load(f"""
        QtObject {{
            property var handle
            property var seen: []
            property int asked
            property ActionServer server: ActionServer {{
                name: "/count"; actionType: "{robot.type}"
                {body}
            }}
            function run(script) {{ return JSON.stringify(eval(script)) }}
        }}
    """)


def run(root: Any, script: str) -> Any:
    text = root.run(script)
    return None if not text else json.loads(text)


@pytest.mark.parametrize(
    ("execute", "end"),
    [
        ("function (goal) { return {sequence: [goal.order]} }", (SUCCEEDED, [7])),
        (
            (
                "function (goal) { return new Promise(function (ok) { Qt.callLater(ok, "
                "{sequence: [goal.order, 1]}) }) }"
            ),
            (SUCCEEDED, [7, 1]),
        ),
        (
            (
                "function (goal, handle) { handle.publishFeedback({sequence: [1]}); "
                "Qt.callLater(handle.succeed, {sequence: [2]}) }"
            ),
            (SUCCEEDED, [2]),
        ),
        ("function (goal, handle) { Qt.callLater(handle.abort, {sequence: [3]}) }", (ABORTED, [3])),
        ("function (goal, handle) { handle.succeed() }", (SUCCEEDED, [])),
        ("function (goal) { return Promise.resolve() }", (SUCCEEDED, [])),
        ("function (goal) { throw new Error('no power') }", (ABORTED, [])),
        ("function (goal) { return Promise.reject('no power') }", (ABORTED, [])),
        ("function (goal) { return {sequnce: []} }", (ABORTED, [])),
        ("function (goal) { return 5 }", (ABORTED, [])),
    ],
)
def test_ends(live: Bench, robot: Robot, wait: Any, execute: str, end: Any, caplog: Any) -> None:
    root = offer(live, robot, f"execute: {execute}")
    goal = robot.send(7)
    assert robot.end(goal) == end
    if "power" in execute:
        wait(lambda: "no power" in caplog.text)
        if robot.ros1:
            assert "no power" in goal.text  # type: ignore[attr-defined]
    if "publishFeedback" in execute:
        wait(lambda: robot.feedback == [[1]])
    wait(lambda: run(root, "server.activeGoals") == 0)
    assert run(root, "[server.ready, server.enabled, server.problem]") == [True, True, ""]


@pytest.mark.both_qt
def test_a_handle(live: Bench, robot: Robot, wait: Any) -> None:
    root = offer(
        live,
        robot,
        """
        accept: function (goal) { return goal.order < 10 }
        execute: function (goal, h) {
            h.statusChanged.connect(function (status) { seen.push(status) })
            h.cancelRequestedChanged.connect(function () { asked++ })
            handle = h
        }
        cancel: function (h) { return h === handle }
        """,
    )
    refused = robot.send(11)
    wait(refused.done.done)
    assert isinstance(refused.done.exception(), GoalRejectedError)
    goal = robot.send(5)
    wait(lambda: run(root, "Boolean(handle)"))
    assert run(root, "[handle.goal.order, handle.isActive, handle.isCancelRequested]") == [
        5,
        True,
        False,
    ]
    assert run(root, "handle.goalId") == goal.id_text
    assert run(root, "handle.status === ActionGoalStatus.Executing && handle.goalStamp.sec > 0")
    for script, message in (
        ("handle.publishFeedback({sequence: ['x']})", "sequence[0]"),
        ("handle.succeed({sequnce: []})", "sequnce"),
        ("handle.canceled()", "there was no request to cancel"),
    ):
        text = run(root, f"(function () {{ try {{ {script} }} catch (e) {{ return '' + e }} }})()")
        assert message in text, text
    run(root, "handle.publishFeedback({sequence: [1, 2]})")
    wait(lambda: robot.feedback == [[1, 2]])
    live.engine.collectGarbage()
    goal.cancel()
    wait(lambda: root.property("asked") == 1)
    assert run(root, "[handle.isCancelRequested, handle.isActive]") == [True, True]
    run(root, "handle.canceled({sequence: [9]})")
    assert robot.end(goal) == (CANCELED, [9])
    wait(lambda: run(root, "seen[seen.length - 1] === ActionGoalStatus.Canceled"))
    assert run(root, "[handle.isActive, handle.isCancelRequested]") == [False, True]
    text = run(root, "(function () { try { handle.succeed() } catch (e) { return '' + e } })()")
    assert "ended" in text


def test_forgotten_cancel_is_logged(
    live: Bench, robot: Robot, wait: Any, caplog: Any, monkeypatch: Any
) -> None:
    monkeypatch.setattr("rosglass.qml.elements.goal_handle._REMINDER", 50)
    root = offer(live, robot, "execute: function (goal, h) { handle = h }")
    goal = robot.send(5)
    wait(lambda: run(root, "Boolean(handle)"))
    goal.cancel()
    wait(lambda: "end it with canceled()" in caplog.text)
    run(root, "handle.canceled()")
    assert robot.end(goal)[0] is CANCELED


def test_a_refused_cancel(live: Bench, robot: Robot, wait: Any) -> None:
    root = offer(
        live,
        robot,
        """
        execute: function (goal, h) { handle = h }
        cancel: function (h) { asked++; return false }
        """,
    )
    goal = robot.send(5)
    wait(lambda: run(root, "Boolean(handle)"))
    goal.cancel()
    wait(lambda: root.property("asked"))
    wait.settled(live.session)
    assert run(root, "handle.isCancelRequested") is False
    run(root, "handle.succeed({sequence: [1]})")
    assert robot.end(goal) == (SUCCEEDED, [1])


@pytest.mark.both_qt
@pytest.mark.parametrize("accept", ["function () { }", "function () { throw new Error('odd') }"])
def test_a_goal_is_accepted_by_true_alone(
    live: Bench, robot: Robot, wait: Any, accept: str, caplog: Any
) -> None:
    root = offer(live, robot, f"execute: function () {{ asked++ }}\naccept: {accept}")
    goal = robot.send(5)
    wait(goal.done.done)
    assert isinstance(goal.done.exception(), GoalRejectedError)
    assert root.property("asked") == 0
    assert "returned neither true nor false" in caplog.text


def offer_by_signal(live: Bench, robot: Robot, body: str) -> Any:
    """Offer an action in the way of qml6_ros2_plugin."""
    return live.load(f"""
        QtObject {{
            id: root
            property var handle
            property var seen: []
            property var label: handle ? missing.name : ""
            property ActionServer server: ActionServer {{
                name: "/count"; type: "{robot.type}"
                {body}
            }}
            function run(script) {{ return JSON.stringify(eval(script)) }}
            function note(what) {{ seen = seen.concat([what]) }}
        }}
    """)


@EVERY_WIRE
def test_a_server_in_the_way_of_qml6_ros2_plugin(live: Bench, robot: Robot, wait: Any) -> None:
    root = offer_by_signal(
        live,
        robot,
        """
        handleGoal: function (goal, id) {
            note("goal " + goal.order + " " + typeof id)
            return goal.order < 9
        }
        handleCancel: function (h) { note("cancel " + (h === handle)); return true }
        onAdvertisedChanged: note("advertised " + advertised)
        onGoalAccepted: function (h) {
            root.handle = h
            note([h.goal.order, h.isActive, h.isExecuting, h.isCanceling].join())
            h.statusChanged.connect(() => note([h.isActive, h.isExecuting, h.isCanceling].join()))
            h.cancelRequested.connect(() => {
                note("cancelRequested " + h.isCanceling)
                h.canceled({sequence: [3]})
            })
            h.terminated.connect(() => note("terminated"))
            h.publishFeedback({sequence: [0, 1]})
        }
        """,
    )
    wait(lambda: run(root, "server.advertised && server.actionType === server.type"))
    refused = robot.send(9)
    wait(refused.done.done)
    assert isinstance(refused.done.exception(), GoalRejectedError)
    goal = robot.send(4)
    wait(lambda: run(root, "Boolean(handle)"))
    wait(lambda: robot.feedback == [[0, 1]])
    run(root, "handle.succeed({sequence: [1, 2]})")
    assert robot.end(goal) == (SUCCEEDED, [1, 2])
    # Later calls are logged and ignored.
    assert (
        run(root, "handle.succeed({sequence: []}); handle.publishFeedback({}); 'went on'")
        == "went on"
    )
    wait(lambda: "terminated" in run(root, "seen"))
    seen = run(root, "seen")
    assert seen[:4] == ["advertised true", "goal 9 string", "goal 4 string", "4,true,true,false"]
    assert seen[-1] == "terminated"
    run(root, "seen = []; handle = null")
    goal = robot.send(5)
    wait(lambda: run(root, "Boolean(handle)"))
    goal.cancel()
    assert robot.end(goal) == (CANCELED, [3])
    wait(lambda: "terminated" in run(root, "seen"))
    seen = run(root, "seen")
    assert "cancel true" in seen
    assert seen.index("cancel true") < seen.index("cancelRequested true") < seen.index("terminated")
    assert "true,false,true" in seen


@EVERY_WIRE
@pytest.mark.parametrize(
    "cancel", ["", "handleCancel: h => {}", "handleCancel: h => { throw new Error('odd') }"]
)
def test_without_handle_cancel_a_cancel_is_refused(
    live: Bench, robot: Robot, wait: Any, cancel: str
) -> None:
    root = offer_by_signal(live, robot, f"{cancel}\nonGoalAccepted: h => {{ root.handle = h }}")
    goal = robot.send(5)
    wait(lambda: run(root, "Boolean(handle)"))
    answer = goal.cancel()
    if not robot.ros1:  # in ROS 1, requests to cancel are not answered
        wait(answer.done)
        assert not answer.result().accepted
    wait.settled(live.session)
    assert run(root, "[handle.isCanceling, handle.isCancelRequested]") == [False, False]
    run(root, "handle.succeed({sequence: [1]})")
    assert robot.end(goal) == (SUCCEEDED, [1])


@EVERY_WIRE
@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("onGoalAccepted: function (h) { throw new Error('no power') }", "no power"),
        ("onGoalAccepted: function (h) { h.succed({}) }", "TypeError"),
        ("Component.onCompleted: goalAccepted.connect(h => { missing.field })", "ReferenceError"),
        ("", "goalAccepted is not connected"),
        ("onGoalAccepted: function (h) { h.succeed({sequnce: []}) }", "sequnce"),
        ("onGoalAccepted: function (h) { Qt.callLater(h.succeed, {sequnce: []}) }", "sequnce"),
    ],
)
def test_goals_that_no_handler_ends_are_aborted_at_once(
    live: Bench, robot: Robot, wait: Any, caplog: Any, body: str, reason: str
) -> None:
    root = offer_by_signal(live, robot, body)
    goal = robot.send(5)
    assert robot.end(goal) == (ABORTED, [])
    wait(lambda: reason in caplog.text)
    wait(lambda: run(root, "server.activeGoals") == 0)


@pytest.mark.both_qt
def test_an_error_of_a_binding_ends_no_goal(live: Bench, robot: Robot, wait: Any) -> None:
    """It belongs to a label, not to the handler that changed what the label shows."""
    root = offer_by_signal(live, robot, "onGoalAccepted: h => { root.handle = h }")
    goal = robot.send(5)
    wait(lambda: run(root, "Boolean(handle)"))
    wait.settled(live.session)
    assert run(root, "handle.isActive")
    run(root, "handle.succeed()")
    assert robot.end(goal) == (SUCCEEDED, [])


def test_both_ways_in_one_server(live: Bench, robot: Robot, wait: Any) -> None:
    """Goals go to execute if it is set; then a cancel without a handler is granted."""
    root = offer_by_signal(
        live,
        robot,
        """
        handleGoal: (goal, id) => goal.order < 9
        onGoalAccepted: h => note("accepted " + h.goalId.length)
        execute: function (goal, h) { handle = h }
        """,
    )
    refused = robot.send(9)
    wait(refused.done.done)
    assert isinstance(refused.done.exception(), GoalRejectedError)
    goal = robot.send(5)
    wait(lambda: run(root, "Boolean(handle)"))
    assert len(run(root, "seen")) == 1
    goal.cancel()
    wait(lambda: run(root, "handle.isCanceling"))
    run(root, "handle.canceled({sequence: [1]})")
    assert robot.end(goal) == (CANCELED, [1])


def test_withdrawing_ends_the_goals(live: Bench, robot: Robot, wait: Any) -> None:
    root = offer(live, robot, "execute: function (goal, h) { handle = h }")
    goal = robot.send(5)
    wait(lambda: run(root, "Boolean(handle)"))
    run(root, "server.enabled = false")
    assert robot.end(goal)[0] is ABORTED
    wait(lambda: run(root, "[handle.isActive, server.ready]") == [False, False])
    wait(lambda: not robot.client.ready)
    run(root, "handle = null; server.enabled = true")
    goal = robot.send(6)
    wait(lambda: run(root, "Boolean(handle)"))
    live.session.shutdown()
    wait(goal.done.done)
    wait(lambda: run(root, "handle.isActive") is False)
    live.session.init("ui")
    wait(lambda: run(root, "server.ready"))
    goal = robot.send(7)
    wait(lambda: run(root, "handle.goal.order") == 7)
    run(root, "handle.succeed()")
    assert robot.end(goal)[0] is SUCCEEDED


@pytest.mark.both_qt
def test_an_engine_that_goes_away_ends_the_goals(
    live: Bench, robot: Robot, wait: Any, tmp_path: Path, caplog: Any
) -> None:
    from rosglass.qml import install
    from rosglass.qt import QtQml

    engine = QtQml.QQmlEngine()
    install(engine, live.session)
    world = SimpleNamespace(connect=lambda *_: live.robot)
    other = Bench(live.session, engine, world, tmp_path / "other")
    root = offer(
        other,
        robot,
        "execute: function (goal, h) { handle = h; return new Promise(function () {}) }",
    )
    goal = robot.send(5)
    wait(lambda: run(root, "Boolean(handle)"))
    root.deleteLater()
    engine.deleteLater()
    assert robot.end(goal)[0] is ABORTED
    wait.settled(live.session)
    assert "callback failed" not in caplog.text


@pytest.mark.both_qt
def test_servers_of_functions(live: Bench, robot: Robot, wait: Any) -> None:
    root: Any = live.load(f"""
        QtObject {{
            property var server: Ros2.createActionServer("/count", "{robot.type}", {{
                accept: function (goal) {{ return goal.order > 0 }},
                execute: function (goal) {{ return {{sequence: [goal.order]}} }}
            }})
        }}
    """)
    assert robot.end(robot.send(3)) == (SUCCEEDED, [3])
    goal = robot.send(0)
    wait(goal.done.done)
    assert isinstance(goal.done.exception(), GoalRejectedError)
    assert root is not None


def test_ros1_servers(live: Bench, robot: Robot) -> None:
    live.module = "Ros 1.0"
    name = "actionlib_tutorials/FibonacciAction" if robot.ros1 else "example_interfaces/Fibonacci"
    root: Any = live.load(f"""
        QtObject {{
            property var server: Ros.advertiseAction("{name}", "/count",
                function (goal, handle) {{ return {{sequence: [handle.goal.order]}} }})
            property ActionServer other: ActionServer {{
                name: "/other"; actionType: "{name}"
                execute: function (goal) {{ return {{sequence: [goal.order]}} }}
            }}
        }}
    """)
    assert robot.end(robot.send(3)) == (SUCCEEDED, [3])
    robot.client = live.robot.create_action_client("/other", robot.type)
    assert robot.end(robot.send(4)) == (SUCCEEDED, [4])
    assert root is not None


def test_misused_makers_throw(live: Bench) -> None:
    for script, message in (
        ('Ros2.createActionServer("/x", "a/B", 5)', "a function that executes goals"),
        ('Ros2.createActionServer("/x", "a/B", {accept: function () {}})', "with execute"),
        ('Ros2.createActionServer("/x", "a/B", {execute: 5})', "execute is not a function"),
        ('Ros2.createActionServer("/x", "a/B", {excute: 5})', "no function excute"),
        ('Ros2.createActionServer("no good", "a/B", function () {})', "no good"),
    ):
        text = live.run(f"try {{ {script} }} catch (e) {{ return String(e) }}; return ''")
        assert text.startswith("Error:"), script
        assert message in text, text


def test_the_example(live: Bench, robot: Robot, wait: Any) -> None:
    from rosglass.qt import QtCore, QtQml

    if robot.ros1:
        pytest.skip("the example offers an action whose type only ROS 2 has")
    file = Path(__file__).parents[2] / "examples" / "action_server.qml"
    component = QtQml.QQmlComponent(live.engine, QtCore.QUrl.fromLocalFile(str(file)))
    root: Any = component.create()
    assert root is not None, component.errorString()
    robot.client = live.robot.create_action_client("/fetch", robot.type)
    goal = robot.send(2)
    wait(lambda: root.property("job") is not None)
    refused = robot.send(1)
    wait(refused.done.done)
    root.fetched()
    assert goal.status is GoalStatus.EXECUTING
    root.fetched()
    assert robot.end(goal) == (SUCCEEDED, [2])
    wait(lambda: root.property("job") is None)
    root.deleteLater()


def test_the_clients_example(live: Bench, robot: Robot, wait: Any) -> None:
    from rosglass.qt import QtCore, QtQml

    if robot.ros1:
        pytest.skip("the example asks for an action whose type only ROS 2 has")

    def turn(goal: Any) -> Any:
        goal.publish_feedback(remaining=1.0)
        goal.wait_for_cancel(30)
        return {"delta": 1.0}

    live.robot.create_action_server("/turn", "turtlesim/action/RotateAbsolute", turn)
    file = Path(__file__).parents[2] / "examples" / "action_client.qml"
    component = QtQml.QQmlComponent(live.engine, QtCore.QUrl.fromLocalFile(str(file)))
    root: Any = component.create()
    assert root is not None, component.errorString()
    wait(lambda: root.property("client").property("ready"))
    root.turn(90)
    wait(lambda: root.property("outcome") == "57° to go")
    root.property("goal").cancel()
    wait(lambda: root.property("outcome") == "cancelled")
    root.deleteLater()

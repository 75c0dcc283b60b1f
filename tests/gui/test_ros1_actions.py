"""Action clients of ``Ros 1.0`` on real middleware, whatever the robot speaks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from counting import Client, Counter

if TYPE_CHECKING:
    from conftest import Bench


@pytest.fixture
def actionlib(live: Bench, counter: Counter, wait: Any) -> Client:
    live.module = "Ros 1.0"
    name = "actionlib_tutorials/FibonacciAction" if counter.ros1 else "example_interfaces/Fibonacci"
    root = live.load(f"""
        QtObject {{
            property var client: Ros.createActionClient("{name}", "/count")
            property var handle
            property var log: []
            property int connections
            function send(order) {{
                handle = client.sendGoal({{order: order}}, function (h) {{
                    log.push(["state", h === handle, h.commState, h.terminalState.state])
                    if (h.commState === ActionCommStates.DONE)
                        log.push(["done", h.terminalState.text,
                                  h.getResult() ? h.getResult().sequence.length : null])
                }}, function (h, feedback) {{
                    log.push(["feedback", h === handle, feedback.sequence.length])
                }})
            }}
            function run(script) {{ return JSON.stringify(eval(script)) }}
            Component.onCompleted: client.connectedChanged.connect(function () {{ connections++ }})
        }}
    """)
    return Client(root, wait)


GOAL_ACK, PENDING, ACTIVE, RESULT, CANCEL_ACK, RECALLING, PREEMPTING, DONE = range(8)
RECALLED, REJECTED, PREEMPTED, ABORTED, SUCCEEDED, GOAL_LOST, UNKNOWN = range(7)


def test_a_goal(actionlib: Client, counter: Counter, wait: Any) -> None:
    assert actionlib.run("[client.connected, client.sendGoal({order: 3})]") == [False, None]
    counter.offer()
    wait(lambda: actionlib.run("client.connected && client.isServerConnected()"))
    assert actionlib.run("connections") == 1
    actionlib.run("send(5)")
    assert actionlib.until("done")[1] == 5
    states = actionlib.of("state")
    assert states[-1] == [True, DONE, SUCCEEDED]
    assert [state for _, state, _ in states] == sorted(state for _, state, _ in states)
    assert {ACTIVE, RESULT} <= {state for _, state, _ in states}
    assert {end for _, _, end in states[:-1]} == {UNKNOWN}
    assert actionlib.of("feedback")[0] == [True, 3]
    assert actionlib.run("[handle.expired, handle.commState === ActionCommStates.DONE]") == [
        False,
        True,
    ]
    assert actionlib.run("handle.terminalState.state === ActionTerminalStates.SUCCEEDED")
    actionlib.run("handle.resend()")  # is logged


def test_connected_follows_the_server(actionlib: Client, counter: Counter, wait: Any) -> None:
    for changes in (1, 3):
        counter.offer()
        wait(lambda: actionlib.run("client.connected"))
        assert actionlib.run("connections") == changes
        counter.server.close()
        wait(lambda: not actionlib.run("client.connected"))


def test_names_within_a_namespace(live: Bench, counter: Counter, wait: Any) -> None:
    counter.offer()
    live.module = "Ros 1.0"
    root: Any = live.load("""
        QtObject {
            property var client: Ros.createActionClient("/arm", "a/BAction", "count")
            property var other: Ros.createActionClient("/arm", "a/BAction", "/count")
            function names() { return [client.name, other.name, client.actionType].join() }
        }
    """)
    assert root.names() == "/arm/count,/count,a/BAction"


def test_cancelling(actionlib: Client, counter: Counter, wait: Any) -> None:
    counter.offer()
    wait(lambda: actionlib.run("client.connected"))
    actionlib.run("send(50)")
    actionlib.until("feedback")
    counter.stop.clear()
    actionlib.run("handle.cancel()")
    wait(lambda: actionlib.run("handle.commState") == PREEMPTING)
    counter.stop.set()
    actionlib.until("done")
    states = [state for _, state, _ in actionlib.of("state")]
    assert states[-4:] == [CANCEL_ACK, PREEMPTING, RESULT, DONE]
    assert actionlib.of("state")[-1][2] == PREEMPTED
    actionlib.run("log = []; send(50)")
    actionlib.until("feedback")
    wait.nothing_happens(0.02)  # dates have milliseconds
    actionlib.run("client.cancelGoalsAtAndBeforeTime(new Date())")
    assert actionlib.until("done") is not None
    assert actionlib.of("state")[-1] == [True, DONE, PREEMPTED]
    actionlib.run("log = []; send(50)")
    actionlib.until("feedback")
    actionlib.run("client.cancelAllGoals()")
    actionlib.until("done")


def test_goals_that_fail(actionlib: Client, counter: Counter, wait: Any) -> None:
    counter.offer()
    wait(lambda: actionlib.run("client.connected"))
    actionlib.run("send(13)")
    text, _ = actionlib.until("done")
    assert actionlib.of("state")[-1][2] == ABORTED
    assert "unlucky" in text or not counter.ros1
    actionlib.run("log = []; send(0)")
    actionlib.until("done")
    assert actionlib.of("state")[-1][2] == REJECTED


def test_the_interface_shuts_down(
    live: Bench, actionlib: Client, counter: Counter, wait: Any, caplog: Any
) -> None:
    counter.offer()
    wait(lambda: actionlib.run("client.connected"))
    actionlib.run("send(50)")
    actionlib.until("feedback")
    live.session.shutdown()
    assert actionlib.until("done")[1] is None
    assert actionlib.of("state")[-1] == [True, DONE, GOAL_LOST]
    assert actionlib.run("[handle.expired, client.connected]") == [True, False]
    actionlib.run("handle.cancel()")
    assert "no further updates of it will arrive" in caplog.text


def test_misuse_throws(actionlib: Client, counter: Counter, wait: Any) -> None:
    counter.offer()
    wait(lambda: actionlib.run("client.connected"))
    for script, message in (
        ("client.sendGoal({order: 'x'})", "order: expected"),
        ("client.sendGoal({order: 1}, 5)", "transition_cb is not a function"),
        ("client.sendGoal({order: 1}, null, 5)", "feedback_cb is not a function"),
        ("client.cancelGoalsAtAndBeforeTime('noon')", "a time or a Date"),
        ("Ros.createActionClient('a/BAction', 'no good')", "no good"),
        ("Ros.createActionClient('a/BAction', 5)", "write Ros.createActionClient"),
    ):
        text = actionlib.run(
            f"(function () {{ try {{ {script} }} catch (e) {{ return String(e) }} }})()"
        )
        assert text is not None, script
        assert text.startswith("Error:"), text
        assert message in text, text

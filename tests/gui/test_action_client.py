"""Action clients in QML on real middleware; both modules, whatever the robot speaks."""

from __future__ import annotations

import gc
import threading
import weakref
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from conftest import Bench

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path


class Counter:
    """The robot's side: counts up to the order; an order of 50 goes on until it is cancelled.

    Attributes:
        type: The action's type, of the robot's ROS.
        go: Goals wait for it.
        stop: Goals that are cancelled wait for it.
        server: The server; None while none is offered.
    """

    def __init__(self, robot: Any, url: str) -> None:
        package = "actionlib_tutorials" if url.startswith("ros1") else "example_interfaces"
        self.type = f"{package}/action/Fibonacci"
        self.ros1 = url.startswith("ros1")
        self.robot, self.go, self.stop = robot, threading.Event(), threading.Event()
        self.go.set()
        self.stop.set()
        self.server: Any = None

    def offer(self) -> None:
        self.server = self.robot.create_action_server(
            "/count", self.type, self.count, accept=lambda goal: goal.order > 0
        )

    def count(self, goal: Any) -> Any:
        self.go.wait(30)
        sequence = [0, 1]
        while len(sequence) < goal.goal.order:
            if goal.wait_for_cancel(0.01):
                self.stop.wait(30)
                break
            sequence = [*sequence[:40], sequence[-1] + 1]
            goal.publish_feedback(sequence=sequence)
        if goal.goal.order == 13:
            raise ValueError("unlucky")
        return {"sequence": sequence}


@pytest.fixture
def counter(live: Bench, url: str) -> Iterator[Counter]:
    made = Counter(live.robot, url)
    yield made
    made.go.set()
    made.stop.set()
    if made.server is not None:
        made.server.close()


CLIENT = """
    QtObject {
        property var client: Ros2.createActionClient("/count", TYPE)
        property var handle
        property var log: []
        function send(order) {
            handle = client.sendGoalAsync({order: order}, {
                onGoalResponse: function (h) { log.push(["response", h === handle]) },
                onFeedback: function (h, f) {
                    if (h !== handle) throw new Error("another handle")
                    log.push(["feedback", f.sequence.length]) },
                onResult: function (r) {
                    log.push(["result", r.goalId === handle.goalId, r.code,
                              r.result.sequence ? r.result.sequence.length : null, r.reason]) }
            })
            handle.statusChanged.connect(function (s) { log.push(["status", s]) })
        }
        function shown() { return JSON.stringify(log) }
        function state() {
            return JSON.stringify([handle.status, handle.isActive, handle.goalId,
                                   Boolean(handle.result), handle.goalStamp.sec > 0])
        }
        function cancel() { handle.cancel() }
        function ready() { return client.ready }
        function run(script) { return JSON.stringify(eval(script)) }
    }
"""


class Client:
    """A root object with a client, its log as Python has it."""

    def __init__(self, root: Any, wait: Callable[..., None]) -> None:
        self.root, self.wait = root, wait

    @property
    def log(self) -> list[list[Any]]:
        return self.run("log")

    def of(self, kind: str) -> list[list[Any]]:
        return [entry[1:] for entry in self.log if entry[0] == kind]

    def run(self, script: str) -> Any:
        import json

        text = self.root.run(script)
        return None if not text else json.loads(text)

    def until(self, kind: str) -> list[Any]:
        self.wait(lambda: self.of(kind), 30)
        return self.of(kind)[-1]


@pytest.fixture
def client(live: Bench, counter: Counter, wait: Any) -> Client:
    return Client(live.load(CLIENT.replace("TYPE", f'"{counter.type}"')), wait)


def test_a_goal(client: Client, counter: Counter, wait: Any) -> None:
    counter.offer()
    wait(lambda: client.run("client.ready"))
    assert client.run("[client.name, client.actionType === client.type, client.isServerReady()]")
    client.run("send(5)")
    assert client.run("[handle.status, handle.isActive]") == [0, True]
    told = client.until("result")
    assert told[:3] == [True, 4, 5]
    assert client.of("response") == [[True]]
    assert client.of("feedback")[0] == [3]
    codes = [code for (code,) in client.of("status")]
    assert codes[-1] == 4
    assert codes == sorted(codes)
    assert client.run("[handle.status, handle.isActive, handle.result.sequence.length]") == [
        4,
        False,
        5,
    ]
    assert client.run("[handle.feedback.sequence.length, handle.goalStamp.sec > 0]") == [5, True]
    assert client.run("handle.status === ActionGoalStatus.Succeeded")


def test_a_goal_waits_for_the_server(client: Client, counter: Counter, wait: Any) -> None:
    client.run("send(3)")
    wait(300)
    counter.offer()
    assert client.until("result")[:3] == [True, 4, 3]


def test_cancelling(client: Client, counter: Counter, wait: Any) -> None:
    counter.offer()
    wait(lambda: client.run("client.ready"))
    client.run("send(50)")
    client.until("feedback")
    counter.stop.clear()
    client.run("handle.cancel()")
    wait(lambda: client.of("status")[-1] == [3])
    counter.stop.set()
    assert client.until("result")[1] == 5
    assert client.of("status")[-2:] == [[3], [5]]


def test_an_aborted_and_a_rejected_goal(client: Client, counter: Counter, wait: Any) -> None:
    counter.offer()
    wait(lambda: client.run("client.ready"))
    client.run("send(13)")
    told = client.until("result")
    assert told[:2] == [True, 6]
    assert "unlucky" in told[3] or not counter.ros1
    client.run("log = []; send(0)")
    told = client.until("result")
    assert told[1:3] == [6, None]
    assert client.of("response") == [[False]]
    assert client.run("[handle.status, handle.isActive]") == [6, False]


def test_cancelling_all(client: Client, counter: Counter, wait: Any) -> None:
    counter.offer()
    wait(lambda: client.run("client.ready"))
    client.run("send(50)")
    client.until("feedback")
    client.run("client.cancelAllGoals()")
    assert client.until("result")[1] == 5


def test_cancelling_until_a_time(live: Bench, counter: Counter, wait: Any) -> None:
    counter.offer()
    root: Any = live.load(f"""
        QtObject {{
            property var client: Ros2.createActionClient("/count", "{counter.type}")
            property var first
            property var second
            function ready() {{ return client.ready }}
            function send() {{ return client.sendGoalAsync({{order: 50}}) }}
            function one() {{ first = send() }}
            function two() {{ second = send() }}
            function both() {{ return [first.status, second ? second.status : 0].join() }}
            function cancel() {{ client.cancelGoalsBefore(first.goalStamp) }}
        }}
    """)
    wait(root.ready)
    root.one()
    wait(lambda: root.both() == "2,0")
    wait(20)  # the clocks of goals have milliseconds
    root.two()
    wait(lambda: root.both() == "2,2")
    root.cancel()
    wait(lambda: root.both() == "5,2")


def test_promises(live: Bench, counter: Counter, wait: Any) -> None:
    counter.offer()
    root: Any = live.load(f"""
        QtObject {{
            property var client: Ros2.createActionClient("/count", "{counter.type}")
            property string done
            property string failed
            Component.onCompleted: {{
                client.sendGoal({{order: 4}}).then(function (r) {{
                    done = [r.code === ActionGoalStatus.Succeeded, r.goalId.length > 8,
                            r.result.sequence.length].join() }})
                client.sendGoal({{order: 0}}).catch(function (e) {{ failed = e.message }})
            }}
        }}
    """)
    wait(lambda: root.property("done") == "true,true,4")
    wait(lambda: root.property("failed"))
    assert "accept" in root.property("failed") or counter.ros1


def test_misuse_throws(live: Bench, counter: Counter, wait: Any) -> None:
    counter.offer()
    root: Any = live.load(f"""
        QtObject {{
            property var client: Ros2.createActionClient("/count", "{counter.type}")
            function ready() {{ return client.ready }}
            function tried(script) {{
                try {{ eval(script) }} catch (error) {{ return String(error) }}
                return ""
            }}
        }}
    """)
    wait(root.ready)
    for script, told in (
        ("client.sendGoalAsync({order: 'x'})", "Goal: order: expected"),
        ("client.sendGoal({odrer: 1})", "odrer"),
        ("client.sendGoalAsync({order: 1}, {onFeedbak: function () {}})", "no callback onFeedbak"),
        ("client.sendGoalAsync({order: 1}, {onResult: 5})", "onResult is not a function"),
        ("client.sendGoalAsync({order: 1}, 5)", "must be an object"),
        ("client.cancelGoalsBefore('noon')", "a time or a Date"),
        ("client.cancelGoalsBefore(new Date(-5000))", "after 1970"),
        ("Ros2.createActionClient('no good', 'a/B')", "no good"),
    ):
        text = root.tried(script)
        assert text.startswith("Error:"), script
        assert told in text, text
    assert counter.server.goals == ()


def test_no_server(live: Bench, counter: Counter, wait: Any, caplog: Any) -> None:
    root: Any = live.load(f"""
        QtObject {{
            property var client: Ros2.createActionClient("/nowhere", "{counter.type}")
            property string told
            Component.onCompleted: {{
                client.connectionTimeout = 300
                client.sendGoalAsync({{order: 3}}, {{
                    onGoalResponse: function (handle) {{ told += handle }},
                    onResult: function (r) {{ told += [r.code, r.goalId !== null, r.reason] }}
                }})
            }}
        }}
    """)
    wait(lambda: root.property("told"))
    assert root.property("told").startswith("null0,true,")
    assert "/nowhere" in root.property("told")
    assert "no goal could be sent to /nowhere within 0." in caplog.text


def test_a_goal_taken_back_before_there_is_a_server(client: Client, wait: Any) -> None:
    client.run("send(3)")
    client.run("handle.cancel()")
    told = client.until("result")
    assert told[1] == 5
    assert client.of("response") == [[False]]


def test_the_robot_goes_away(client: Client, counter: Counter, wait: Any) -> None:
    """The server ends its goals when it closes; a client waits and is there again."""
    counter.offer()
    wait(lambda: client.run("client.ready"))
    client.run("send(50)")
    client.until("feedback")
    closing = threading.Thread(target=counter.server.close)
    closing.start()
    assert client.until("result")[1] == 6
    wait(lambda: not client.run("client.ready"), 30)
    closing.join(30)
    counter.offer()
    wait(lambda: client.run("client.ready"), 30)
    client.run("log = []; send(3)")
    assert client.until("result")[1] == 4


def test_the_interface_shuts_down_and_starts_again(
    live: Bench, client: Client, counter: Counter, wait: Any
) -> None:
    counter.offer()
    wait(lambda: client.run("client.ready"))
    client.run("send(50)")
    client.until("feedback")
    live.session.shutdown()
    told = client.until("result")
    assert told[1:3] == [0, None]
    assert "shut down" in told[3]
    assert client.run("[handle.isActive, client.ready]") == [False, False]
    live.session.init("ui")
    wait(lambda: client.run("client.ready"), 30)
    client.run("log = []; send(3)")
    assert client.until("result")[1] == 4


def test_the_type_is_the_servers(live: Bench, counter: Counter, wait: Any) -> None:
    root: Any = live.load("""
        QtObject {
            property var client: Ros2.createActionClient("/count", "")
            property int count
            Component.onCompleted: client.sendGoal({order: 6}).then(
                function (r) { count = r.result.sequence.length })
        }
    """)
    wait(100)
    counter.offer()
    wait(lambda: root.property("count") == 6, 30)


def test_a_goal_nobody_will_hear_of_any_more(client: Client, counter: Counter, wait: Any) -> None:
    counter.offer()
    wait(lambda: client.run("client.ready"))
    client.run("send(50)")
    client.until("feedback")
    goal = client.root.property("handle")._goal
    goal.close()  # as when its server is lost
    assert client.until("result")[:3] == [True, 0, None]
    assert client.run("[handle.status, handle.isActive]") == [0, False]
    assert client.of("status")[-1] == [0]


def test_nobody_holds_the_client(live: Bench, counter: Counter, wait: Any) -> None:
    """It stays, and so do its goals, until these have ended."""
    counter.offer()
    counter.go.clear()
    root: Any = live.load(f"""
        QtObject {{
            property int count
            function send() {{
                Ros2.createActionClient("/count", "{counter.type}").sendGoalAsync({{order: 3}}, {{
                    onFeedback: function (handle, f) {{ handle.stamped = true }},
                    onResult: function (r) {{ count += r.result.sequence.length }}
                }})
            }}
        }}
    """)
    root.send()
    wait(lambda: counter.server.goals)
    for _ in range(3):
        live.engine.collectGarbage()
        wait(20)
    counter.go.set()
    wait(lambda: root.property("count") == 3)


def test_the_engine_goes_away_while_a_goal_runs(
    live: Bench, counter: Counter, wait: Any, tmp_path: Path, caplog: Any
) -> None:
    from rosglass.qml import install
    from rosglass.qt import QtQml

    counter.offer()
    engine = QtQml.QQmlEngine()
    install(engine, live.session)
    world = SimpleNamespace(connect=lambda *_: live.robot)
    other = Bench(live.session, engine, world, tmp_path / "other")
    client = Client(other.load(CLIENT.replace("TYPE", f'"{counter.type}"')), wait)
    wait(lambda: client.run("client.ready"))
    client.run("send(50)")
    client.until("feedback")
    engine.deleteLater()
    wait(300)
    assert counter.server.goals
    assert live.session.state == "connected"
    assert "internal error" not in caplog.text
    assert "callback failed" not in caplog.text


# Ros 1.0


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


def test_ros1_a_goal(actionlib: Client, counter: Counter, wait: Any) -> None:
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
    actionlib.run("handle.resend()")  # told in the log


def test_ros1_names_within_a_namespace(live: Bench, counter: Counter, wait: Any) -> None:
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


def test_ros1_cancelling(actionlib: Client, counter: Counter, wait: Any) -> None:
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
    wait(20)  # dates have milliseconds
    actionlib.run("client.cancelGoalsAtAndBeforeTime(new Date())")
    assert actionlib.until("done") is not None
    assert actionlib.of("state")[-1] == [True, DONE, PREEMPTED]
    actionlib.run("log = []; send(50)")
    actionlib.until("feedback")
    actionlib.run("client.cancelAllGoals()")
    actionlib.until("done")


def test_ros1_goals_that_fail(actionlib: Client, counter: Counter, wait: Any) -> None:
    counter.offer()
    wait(lambda: actionlib.run("client.connected"))
    actionlib.run("send(13)")
    text, _ = actionlib.until("done")
    assert actionlib.of("state")[-1][2] == ABORTED
    assert "unlucky" in text or not counter.ros1
    actionlib.run("log = []; send(0)")
    actionlib.until("done")
    assert actionlib.of("state")[-1][2] == REJECTED


def test_ros1_the_interface_shuts_down(
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
    assert "has expired" in caplog.text


def test_ros1_misuse_throws(actionlib: Client, counter: Counter, wait: Any) -> None:
    counter.offer()
    wait(lambda: actionlib.run("client.connected"))
    for script, told in (
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
        assert told in text, text


def test_goals_leave_nothing_behind(
    live: Bench, client: Client, counter: Counter, wait: Any
) -> None:
    counter.offer()
    wait(lambda: client.run("client.ready"))
    goals = []
    for _ in range(3):
        client.run("log = []; send(3)")
        goals.append(weakref.ref(client.root.property("handle")._goal))
        client.until("result")
    client.run("handle = null; log = []; 0")

    def gone() -> bool:
        live.engine.collectGarbage()
        gc.collect()
        # JavaScript may take what is on its stack for a reference to the last one.
        return sum(goal() is not None for goal in goals) <= 1

    wait(gone)

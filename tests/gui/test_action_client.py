"""Action clients in QML on real middleware; both modules, whatever the robot speaks."""

from __future__ import annotations

import gc
import json
import threading
import weakref
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from counting import Client, Counter

from conftest import Bench
from rosglass.comm import ClientGoal

if TYPE_CHECKING:
    from pathlib import Path


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


@pytest.fixture
def client(live: Bench, counter: Counter, wait: Any) -> Client:
    return Client(live.load(CLIENT.replace("TYPE", f'"{counter.type}"')), wait)


def test_a_goal(client: Client, counter: Counter, wait: Any) -> None:
    counter.offer()
    wait(lambda: client.run("client.ready"))
    assert client.run("[client.name, client.actionType === client.type, client.isServerReady()]")
    client.run("send(5)")
    assert client.run("[handle.status, handle.isActive]") == [0, True]
    result = client.until("result")
    assert result[:3] == [True, 4, 5]
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


def test_a_goal_waits_for_the_server(
    live: Bench, client: Client, counter: Counter, wait: Any
) -> None:
    client.run("send(3)")
    wait.settled(live.session)
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
    result = client.until("result")
    assert result[:2] == [True, 6]
    assert "unlucky" in result[3] or not counter.ros1
    client.run("log = []; send(0)")
    result = client.until("result")
    assert result[1:3] == [6, None]
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
    wait.nothing_happens(0.02)  # the clocks of goals have milliseconds
    root.two()
    wait(lambda: root.both() == "2,2")
    root.cancel()
    wait(lambda: root.both() == "5,2")


@pytest.mark.both_qt
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


WATCHED = """
    QtObject {
        property var client: NAME.createActionClient(GIVEN)
        property var handle
        property var failed: []
        function ready() { return client.ready || client.connected }
        function send() {
            handle = client[client.sendGoalAsync ? "sendGoalAsync" : "sendGoal"]({order: 50})
            handle.cancelFailed.connect(function (reason) { failed.push(["goal", reason]) })
        }
        function status() { return handle.status }
        function cancel() { handle.cancel() }
        function watch() {
            client.cancelFailed.connect(function (reason) { failed.push(["client", reason]) })
        }
        function cancelAll() { client.cancelAllGoals() }
        function failures() { return JSON.stringify(failed) }
    }
"""


def watched(live: Bench, counter: Counter, module: str) -> Any:
    """A client of one of the modules, whose failures to cancel are kept."""
    name = module.removesuffix(" 1.0")
    given = ["/count", counter.type]
    if name == "Ros":
        given = [counter.type.replace("/action/", "/") + "Action", "/count"]
        given[0] = given[0] if counter.ros1 else given[0].removesuffix("Action")
    live.module = module
    return live.load(WATCHED.replace("NAME", name).replace("GIVEN", json.dumps(given)[1:-1]))


@pytest.mark.parametrize("module", ["Ros 1.0", "Ros2 1.0"])
def test_failed_cancel_is_reported(
    live: Bench, counter: Counter, wait: Any, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Refused by the server; on ROS 1, where a server cannot refuse, not answered in time."""
    if counter.ros1:  # ten seconds else
        monkeypatch.setattr(ClientGoal.cancel, "__defaults__", (1.0,))
    counter.offer(cancel=lambda _: False)
    root = watched(live, counter, module)
    wait(root.ready)
    root.send()
    wait(lambda: root.status() == 2)
    root.cancel()
    wait(lambda: root.failures() != "[]")
    ((who, reason),) = json.loads(root.failures())
    assert who == "goal"
    assert ("did not acknowledge within" if counter.ros1 else "refuses to cancel") in reason
    assert root.status() in (2, 3)


@pytest.mark.parametrize("module", ["Ros 1.0", "Ros2 1.0"])
def test_cancelling_without_a_node_is_reported(
    live: Bench, counter: Counter, wait: Any, module: str, caplog: Any
) -> None:
    counter.offer()
    root = watched(live, counter, module)
    root.watch()
    wait(root.ready)
    root.send()
    wait(lambda: root.status() == 2)
    live.session.shutdown()
    wait(lambda: root.status() == 0)
    root.cancel()
    wait(lambda: live.session.node is None)
    root.cancelAll()
    failures = json.loads(root.failures())
    assert [who for who, _ in failures] == ["goal", "client"]
    assert "no further updates of it will arrive" in failures[0][1]
    assert failures[0][1] in caplog.text


@pytest.mark.both_qt
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
    for script, message in (
        ("client.sendGoalAsync({order: 'x'})", "Goal: order: expected"),
        ("client.sendGoal({odrer: 1})", "odrer"),
        ("client.sendGoalAsync({order: 1}, {onFeedbak: function () {}})", "no callback onFeedbak"),
        ("client.sendGoalAsync({order: 1}, {onResult: 5})", "onResult is not a function"),
        ("client.sendGoalAsync({order: 1}, 5)", "must be an object"),
        ("client.cancelGoalsBefore('noon')", "a time or a Date"),
        ("client.cancelGoalsBefore(new Date(-5000))", "between 1970"),
        ("Ros2.createActionClient('no good', 'a/B')", "no good"),
        ("Ros2.createActionClient('a/B', '/count')", "Are name and type swapped?"),
        ("Ros2.createServiceClient('a/B', '/count')", "Are name and type swapped?"),
    ):
        text = root.tried(script)
        assert text.startswith("Error:"), script
        assert message in text, text
    assert counter.server.goals == ()


def test_no_server(live: Bench, counter: Counter, wait: Any, caplog: Any) -> None:
    root: Any = live.load(f"""
        QtObject {{
            property var client: Ros2.createActionClient("/nowhere", "{counter.type}")
            property string answers
            Component.onCompleted: {{
                client.connectionTimeout = 300
                client.sendGoalAsync({{order: 3}}, {{
                    onGoalResponse: function (handle) {{ answers += handle }},
                    onResult: function (r) {{ answers += [r.code, r.goalId !== null, r.reason] }}
                }})
            }}
        }}
    """)
    wait(lambda: "," in root.property("answers"))  # the response, then the result
    assert root.property("answers").startswith("null0,true,")
    assert "/nowhere" in root.property("answers")
    assert "no goal could be sent to /nowhere within 0." in caplog.text


def test_a_goal_taken_back_before_there_is_a_server(client: Client, wait: Any) -> None:
    client.run("send(3)")
    client.run("handle.cancel()")
    result = client.until("result")
    assert result[1] == 5
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
    wait(lambda: not client.run("client.ready"))
    closing.join(30)
    counter.offer()
    wait(lambda: client.run("client.ready"))
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
    result = client.until("result")
    assert result[1:3] == [0, None]
    assert "shut down" in result[3]
    assert client.run("[handle.isActive, client.ready]") == [False, False]
    live.session.init("ui")
    wait(lambda: client.run("client.ready"))
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
    wait.settled(live.session)
    counter.offer()
    wait(lambda: root.property("count") == 6)


def goal_of(client: Client) -> Any:
    """Return the goal that a handle in QML stands for."""
    return client.root.property("handle")._goal


def test_goal_of_a_lost_server_ends(client: Client, counter: Counter, wait: Any) -> None:
    counter.offer()
    wait(lambda: client.run("client.ready"))
    client.run("send(50)")
    client.until("feedback")
    goal_of(client).close()  # as when its server is lost
    assert client.until("result")[:3] == [True, 0, None]
    assert client.run("[handle.status, handle.isActive]") == [0, False]
    assert client.of("status")[-1] == [0]


@pytest.mark.both_qt
def test_client_without_references_stays_alive(live: Bench, counter: Counter, wait: Any) -> None:
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
        wait.settled(live.session)
    counter.go.set()
    wait(lambda: root.property("count") == 3)


@pytest.mark.both_qt
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
    wait.settled(live.session)
    assert counter.server.goals
    assert live.session.state == "connected"
    assert "internal error" not in caplog.text
    assert "callback failed" not in caplog.text


@pytest.mark.both_qt
def test_goals_leave_nothing_behind(
    live: Bench, client: Client, counter: Counter, wait: Any
) -> None:
    counter.offer()
    wait(lambda: client.run("client.ready"))
    goals = []
    for _ in range(3):
        client.run("log = []; send(3)")
        goals.append(weakref.ref(goal_of(client)))
        client.until("result")
    client.run("handle = null; log = []; 0")

    def gone() -> bool:
        live.engine.collectGarbage()
        gc.collect()
        # JavaScript may take what is on its stack for a reference to the last one.
        return sum(goal() is not None for goal in goals) <= 1

    wait(gone)

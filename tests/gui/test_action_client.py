"""Action clients in QML on real middleware; both modules, whatever the robot speaks."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from conftest import Bench

ROS2, ROS1 = "example_interfaces/Fibonacci", "actionlib_tutorials/FibonacciAction"


class Counter:
    """The robot's side: counts up to the order; an order of 50 goes on until it is cancelled.

    Attributes:
        type: The action's type, of the robot's ROS.
        go: Goals wait for it.
        server: The server; None while none is offered.
    """

    def __init__(self, robot: Any, url: str) -> None:
        package = "actionlib_tutorials" if url.startswith("ros1") else "example_interfaces"
        self.type = f"{package}/action/Fibonacci"
        self.ros1 = url.startswith("ros1")
        self.robot, self.go = robot, threading.Event()
        self.go.set()
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
    client.run("handle.cancel()")
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

"""Actions over DDS with Fast DDS, both ways; what its node does is here, in plain CDR."""

from __future__ import annotations

import importlib.util
import struct
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from waiting import at_rate, eventually

from rosglass.comm import GoalStatus

PEERS = Path(__file__).parent / "peers"
FIBONACCI = "example_interfaces/action/Fibonacci"
DDS = "example_interfaces::action::dds_::Fibonacci"
CANCEL, STATUS = "action_msgs::srv::dds_::CancelGoal", "action_msgs::msg::dds_::GoalStatusArray_"
EXECUTING, SUCCEEDED, CANCELED = 2, 4, 5

pytestmark = pytest.mark.peers


@pytest.fixture(scope="module")
def fast(dds_domain, fastdds_program):
    spec = importlib.util.spec_from_file_location("fastdds", PEERS / "fastdds.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["fastdds"] = module
    spec.loader.exec_module(module)
    made = module.FastDds(str(fastdds_program), dds_domain)
    yield made
    made.close()


@pytest.fixture
def node(dds_connect):
    return dds_connect("cockpit")


def cdr(layout: str, *values: Any) -> bytes:
    """Encode; offsets count from behind the header, as the alignment does."""
    body = b""
    for code, value in zip(layout.split(), values, strict=True):
        size = struct.calcsize(f"<{code}")
        body += b"" if code.endswith("s") else bytes(-len(body) % size)
        body += struct.pack(f"<{code}", value)
    return b"\0\1\0\0" + body


def numbers(data: bytes, at: int) -> list[int]:
    (count,) = struct.unpack_from("<I", data, 4 + at)
    return list(struct.unpack_from(f"<{count}i", data, 8 + at))


class Server:
    """A Fibonacci server as rclcpp has it: three services and two topics."""

    def __init__(self, fast: Any, name: str) -> None:
        self.fast, self.name = fast, name
        self.waiting: dict[bytes, int] = {}
        self.ended: dict[bytes, bytes] = {}
        self.cancelled: set[bytes] = set()
        self.statuses: dict[bytes, int] = {}
        #: Goals end when this is set: a result may overtake the last feedback, on another topic.
        self.may_end = threading.Event()
        place = f"{name}/_action"
        fast.publish("feedback", f"{place}/feedback", f"{DDS}_FeedbackMessage_")
        fast.publish("status", f"{place}/status", STATUS, "latched")
        fast.serve("goal", f"{place}/send_goal", f"{DDS}_SendGoal", self.accept)
        fast.serve("cancel", f"{place}/cancel_goal", CANCEL, self.cancel)
        fast.serve("result", f"{place}/get_result", f"{DDS}_GetResult", self.give)

    def accept(self, _: int, data: bytes) -> bytes:
        goal = data[4:20]
        (order,) = struct.unpack_from("<i", data, 20)
        threading.Thread(target=self.work, args=(goal, order), daemon=True).start()
        return cdr("? i I", True, 1, 2)

    def work(self, goal: bytes, order: int) -> None:
        self.tell(goal, EXECUTING)
        sequence = [0]
        for _ in at_rate(0.05, order - 1):
            if goal in self.cancelled:
                break
            sequence.append(len(sequence))
            layout = "16s I " + "i " * len(sequence)
            self.fast.send("feedback", cdr(layout, goal, len(sequence), *sequence))
        self.may_end.wait(30)
        status = CANCELED if goal in self.cancelled else SUCCEEDED
        self.tell(goal, status)
        layout = "b I " + "i " * len(sequence)
        self.ended[goal] = cdr(layout, status, len(sequence), *sequence)
        if goal in self.waiting:
            self.fast.reply("result", self.waiting[goal], self.ended[goal])

    def tell(self, goal: bytes, status: int) -> None:
        self.statuses[goal] = status
        values = [v for key, s in self.statuses.items() for v in (key, 1, 2, s)]
        layout = "I " + "16s i I b " * len(self.statuses)
        self.fast.send("status", cdr(layout, len(self.statuses), *values))

    def cancel(self, _: int, data: bytes) -> bytes:
        goal = data[4:20]
        self.cancelled.add(goal)
        return cdr("b I 16s i I", 0, 1, goal, 1, 2)

    def give(self, number: int, data: bytes) -> bytes | None:
        goal = data[4:20]
        self.waiting[goal] = number
        return self.ended.get(goal)


def test_we_send_goals_to_fast_dds(fast, node):
    server = Server(fast, "/fast/count")
    client = node.create_action_client("/fast/count", FIBONACCI)
    assert client.wait_for_server(30), client.problem
    feedback: list[int] = []

    def follow(message: Any) -> None:
        feedback.append(len(message.sequence))
        if feedback[-1] == 5:
            server.may_end.set()

    goal = client.send_goal({"order": 5}, on_feedback=follow)
    status, result = goal.result(30)
    assert status is GoalStatus.SUCCEEDED
    assert list(result.sequence) == [0, 1, 2, 3, 4]
    assert feedback == [2, 3, 4, 5]
    goals = [client.send_goal({"order": order}) for order in (1000, 10, 12)]
    goals[0].cancel()
    ended = [goal.result(30) for goal in goals]
    assert [status for status, _ in ended] == [
        GoalStatus.CANCELED,
        GoalStatus.SUCCEEDED,
        GoalStatus.SUCCEEDED,
    ]
    assert [len(result.sequence) for _, result in ended[1:]] == [10, 12]
    assert len(server.statuses) == 4
    assert client.problem == ""


def test_fast_dds_sends_us_goals(fast, node):
    def count(goal: Any) -> Any:
        sequence = [0]
        while len(sequence) < goal.goal.order and not goal.wait_for_cancel(0.02):
            sequence.append(len(sequence))
            goal.publish_feedback(sequence=sequence)
        return {"sequence": sequence}

    node.create_action_server("/count", FIBONACCI, count, accept=lambda goal: goal.order < 1000)
    feedback: list[bytes] = []
    statuses: list[bytes] = []
    place = "/count/_action"
    fast.subscribe("news", f"{place}/feedback", f"{DDS}_FeedbackMessage_", feedback.append)
    fast.subscribe("states", f"{place}/status", STATUS, statuses.append, "latched")
    fast.client("ask", f"{place}/send_goal", f"{DDS}_SendGoal")
    fast.client("stop", f"{place}/cancel_goal", CANCEL)
    fast.client("get", f"{place}/get_result", f"{DDS}_GetResult")
    fast.wait_matched("news", 0, 1)
    fast.wait_matched("states", 0, 1)
    one, two, three = (bytes([number]) * 16 for number in (1, 2, 3))

    accepted = fast.call(
        "ask", [cdr("16s i", g, o) for g, o in ((one, 5), (two, 5000), (three, 500))]
    )
    assert [bool(data[4]) for data in accepted] == [True, False, True]
    (result,) = fast.call("get", [cdr("16s", one)])
    assert result[4] == SUCCEEDED
    assert numbers(result, 4) == [0, 1, 2, 3, 4]
    (answer,) = fast.call("stop", [cdr("16s i I", three, 0, 0)])
    assert answer[4] == 0
    assert answer[12:28] == three
    (result,) = fast.call("get", [cdr("16s", three)])
    assert result[4] == CANCELED
    # The last may come after the result, as it is on another topic.
    expected = [[0, 1], [0, 1, 2], [0, 1, 2, 3], [0, 1, 2, 3, 4]]
    eventually(lambda: [numbers(d, 16) for d in feedback if d[4:20] == one] == expected)

    def status_entries() -> set[tuple[bytes, int]]:
        last, at, found = statuses[-1], 8, set()
        for _ in range(*struct.unpack_from("<I", last, 4)):
            stamp = at + 16 + -at % 4
            found.add((last[at : at + 16], last[stamp + 8]))
            at = stamp + 9
        return found

    eventually(lambda: status_entries() == {(one, SUCCEEDED), (three, CANCELED)})

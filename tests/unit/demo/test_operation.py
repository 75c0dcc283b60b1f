"""Modes, mission, goals and behaviours of the simulated robot, faster than they happen."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.demo import operation as module
from rosglass.demo.operation import (
    ABORTED,
    ACTIVE,
    BEHAVIOURS,
    MODES,
    PREEMPTED,
    REJECTED,
    SUCCEEDED,
    WAYPOINTS,
    Operation,
)
from rosglass.demo.simulation import RobotState, Simulation
from rosglass.errors import Error

if TYPE_CHECKING:
    from conftest import StubNode

#: Simulated seconds between two looks at the robot.
STEP = 0.1
#: Looks until something is given up.
PATIENCE = 3000


class Rig:
    """A robot whose time advances with each look at it."""

    def __init__(self, node: Any, mode: str = "supervised") -> None:
        self.node = node
        self.simulation = Simulation()
        dock = self.simulation.world.dock
        drive, flippers = self.simulation.command_velocity, self.simulation.command_flippers
        self.operation = Operation(node, self.look, drive, flippers, dock, mode)

    def look(self) -> RobotState:
        self.simulation.advance(STEP)
        return self.simulation.state

    def proceed(self) -> str:
        return self.operation.proceed(self.look())

    def until(self, condition: Any) -> None:
        for _ in range(PATIENCE):
            self.proceed()
            if condition():
                return
        pytest.fail(f"did not happen: {self.simulation.state}")

    def send(self, x: float, y: float, frame: str = "map") -> tuple[int, str]:
        """Send a goal; returns its status and text."""
        self.node.command(
            "/move_base_simple/goal",
            header={"frame_id": frame},
            pose={"position": {"x": x, "y": y}, "orientation": {"w": 1.0}},
        )
        return self.goal_status

    @property
    def goal_status(self) -> tuple[int, str]:
        (status,) = self.node.publishers["/move_base/status"].sent[-1].status_list
        return status.status, status.text

    @property
    def place(self) -> tuple[float, float]:
        return self.simulation.state.x, self.simulation.state.y

    def behave(self, goal: Goal) -> Any:
        """Return the behaviour's result, or why there is none."""
        return self.node.services["/flexbe/execute_behavior"](goal) or goal.reason


class Goal:
    """A goal of the behaviours' action."""

    def __init__(self, name: str, at: Any = None) -> None:
        self.goal = type("Goal", (), {"behavior_name": name})
        self.is_cancel_requested = False
        self.feedback: list[str] = []
        #: Why it was aborted.
        self.reason = ""
        self._at = at

    def abort(self, text: str) -> None:
        self.reason = text

    def publish_feedback(self, feedback: dict[str, str]) -> None:
        self.feedback.append(feedback["current_state"])
        if self._at is not None and len(self.feedback) == 5:
            self._at(self)


@pytest.fixture
def rig(stub_node: type[StubNode], monkeypatch: pytest.MonkeyPatch) -> Rig:
    monkeypatch.setattr(module, "_PERIOD_S", 0.0)
    return Rig(stub_node())


def test_there_are_three_modes(rig: Rig, stub_node: type[StubNode]) -> None:
    with pytest.raises(Error, match=r"no mode 'fast'; there are autonomous, supervised, safe"):
        Rig(stub_node(), "fast")
    for mode in MODES:
        answer = rig.node.ask(f"/mode/{mode}")
        assert answer == {"success": True, "message": mode}
        assert rig.node.publishers["/mode"].sent[-1].data == mode
    assert rig.operation.max_speed < 0.5
    rig.node.ask("/mode/supervised")
    assert rig.operation.max_speed == math.inf


def test_mission_drives_its_round_in_autonomous_mode(rig: Rig) -> None:
    start = rig.place
    assert rig.proceed() == "waiting for mode autonomous"
    rig.node.ask("/mode/autonomous")
    rig.until(lambda: rig.operation.next_waypoint == 2)
    assert math.dist(rig.place, WAYPOINTS[1]) < 0.3
    assert rig.node.ask("/mission/pause", data=True)["message"] == "paused"
    assert rig.proceed() == "paused"
    rig.until(lambda: rig.simulation.state.speed < 0.01)
    assert rig.node.ask("/mission/pause", data=False)["success"]
    assert rig.proceed() == "on patrol"
    rig.node.ask("/mission/restart")
    assert rig.operation.next_waypoint == 0
    assert math.dist(start, rig.place) > 0.5
    path = rig.node.publishers["/mission/path"].sent[-1]
    assert [(p.pose.position.x, p.pose.position.y) for p in path.poses][:-1] == list(WAYPOINTS)


def test_manual_drive_takes_over(rig: Rig) -> None:
    rig.node.ask("/mode/autonomous")
    rig.operation.take_over()
    assert rig.operation.mode == "supervised"
    rig.node.ask("/mode/safe")
    rig.operation.take_over()
    assert rig.operation.mode == "safe"


def test_robot_drives_to_a_goal(rig: Rig) -> None:
    x, y = rig.place
    assert rig.send(x + 1.0, y) == (ACTIVE, "on the way to the goal")
    assert rig.proceed() == "driving to the goal"
    rig.until(lambda: rig.goal_status[0] != ACTIVE)
    assert rig.goal_status == (SUCCEEDED, "the goal is reached")
    assert math.dist(rig.place, (x + 1.0, y)) < 0.3
    assert rig.proceed() == "waiting for mode autonomous"


@pytest.mark.parametrize("mode", ["autonomous", "safe"])
def test_goal_in_another_mode_is_refused_with_the_reason(rig: Rig, mode: str) -> None:
    rig.node.ask(f"/mode/{mode}")
    assert rig.send(1, 1) == (REJECTED, f"no goals in mode {mode}; choose supervised")
    assert rig.operation.goal.position is None


def test_goals_that_are_refused(rig: Rig) -> None:
    assert rig.send(math.nan, 1)[0] == REJECTED
    status, text = rig.send(1, 1, "base_link")
    assert (status, "frame map, not in base_link" in text) == (REJECTED, True)
    rig.simulation.set_emergency_stop(True)
    assert rig.send(1, 1) == (REJECTED, "the emergency stop is latched; release it first")


@pytest.mark.parametrize(
    ("event", "status", "reason"),
    [
        (lambda rig: rig.operation.take_over(), PREEMPTED, "the operator drives"),
        (lambda rig: rig.node.ask("/mode/safe"), PREEMPTED, "the mode is safe now"),
        (lambda rig: rig.node.ask("/mode/autonomous"), PREEMPTED, "the mode is autonomous now"),
        (lambda rig: rig.simulation.set_emergency_stop(True), ABORTED, "emergency stop"),
        (lambda rig: rig.behave(Goal("Flippers up")), PREEMPTED, "'Flippers up' was started"),
    ],
)
def test_goal_ends_with_the_reason(rig: Rig, event: Any, status: int, reason: str) -> None:
    x, y = rig.place
    rig.send(x + 1.0, y)
    event(rig)
    rig.proceed()
    assert rig.goal_status[0] == status
    assert reason in rig.goal_status[1]
    assert rig.operation.goal.position is None


def test_newest_goal_is_used(rig: Rig) -> None:
    x, y = rig.place
    rig.send(x + 1.0, y)
    assert rig.send(x, y)[0] == ACTIVE
    statuses = rig.node.publishers["/move_base/status"].sent
    assert statuses[-2].status_list[0].text == "another goal came"
    assert statuses[-2].status_list[0].goal_id.id != statuses[-1].status_list[0].goal_id.id
    rig.operation.goal.end(SUCCEEDED, "x")
    count = len(statuses)
    rig.operation.goal.end(ABORTED, "nothing is driven to")
    assert len(statuses) == count


@pytest.mark.parametrize("name", BEHAVIOURS)
def test_behaviours(rig: Rig, name: str) -> None:
    before = rig.simulation.state
    goal = Goal(name)
    assert rig.behave(goal)["outcome"].endswith("m driven")
    state = rig.simulation.state
    assert goal.feedback or name == "Flippers flat"
    turned = math.remainder(state.yaw - before.yaw, math.tau)
    if name == "Look around":
        assert turned == pytest.approx(0.0, abs=0.3)
    elif name == "Turn around":
        assert abs(turned) == pytest.approx(math.pi, abs=0.3)
    elif name == "Return to dock":
        assert math.dist(rig.place, rig.simulation.world.dock) < 0.3
    else:
        wanted = 1.2 if name == "Flippers up" else 0.0
        assert state.flippers == pytest.approx([wanted] * 4, abs=0.1)


def test_behaviours_that_are_refused(rig: Rig) -> None:
    result = rig.behave(Goal("Dance"))
    assert result.startswith("there is no behaviour 'Dance'; there are Look around, ")
    rig.node.ask("/mode/safe")
    result = rig.behave(Goal("Turn around"))
    assert result == "no behaviours in mode safe; choose another mode"
    rig.node.ask("/mode/supervised")
    refused: list[str] = []

    def at_once(_: Goal) -> None:
        refused.append(rig.behave(Goal("Look around")))
        refused.append(rig.send(1, 1)[1])

    rig.behave(Goal("Turn around", at_once))
    assert refused == ["busy with 'Turn around'; cancel it first"] * 2


@pytest.mark.parametrize(
    ("event", "reason"),
    [
        (lambda rig: rig.simulation.set_emergency_stop(True), "emergency stop is latched"),
        (lambda rig: rig.node.ask("/mode/safe"), "the mode is safe now"),
        (lambda rig: rig.operation.take_over(), "the operator drives"),
        (lambda rig: rig.operation.close(), "the robot ends"),
    ],
)
def test_behaviour_ends_with_the_reason(rig: Rig, event: Any, reason: str) -> None:
    assert reason in rig.behave(Goal("Look around", lambda _: event(rig)))
    rig.simulation.advance(1.0)
    assert rig.simulation.state.turn == pytest.approx(0.0, abs=0.01)


def test_behaviour_is_cancelled(rig: Rig) -> None:
    goal = Goal("Look around", lambda goal: setattr(goal, "is_cancel_requested", True))
    assert rig.behave(goal) == {"outcome": "cancelled"}
    assert rig.behave(Goal("Flippers up"))["outcome"] == "0.0 m driven"


def test_state_is_published_again_and_again(
    stub_node: type[StubNode], monkeypatch: pytest.MonkeyPatch
) -> None:
    """An operator must see within a second that the robot is silent."""
    monkeypatch.setattr(module, "_REPEAT_PERIOD_S", 0.0)
    monkeypatch.setattr(module, "_PERIOD_S", 0.001)
    rig = Rig(stub_node())
    thread = threading.Thread(target=rig.operation.work)
    thread.start()
    for topic in ("/mode", "/mission/state", "/mission/waypoint", "/move_base/status"):
        rig.node.last(topic)
        rig.node.last(topic)
    rig.operation.close()
    rig.operation.close()
    thread.join(30)
    assert not thread.is_alive()

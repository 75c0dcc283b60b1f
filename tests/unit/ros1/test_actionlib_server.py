"""Goals that an action server keeps, and the goals that a cancel request selects."""

from __future__ import annotations

import itertools

import pytest

from rosglass.comm import Time
from rosglass.ros1.actionlib import ServerState
from rosglass.ros1.actionlib_server import _MAX_ENDED, GoalList

NOW = 100.0


def filled():
    """Return goals a to d, stamped 1 to 4."""
    goals = GoalList(5.0)
    for number, name in enumerate("abcd", 1):
        goals.add(name, Time(number), name, NOW)
    return goals


def states(goals):
    return {entry.id: entry.state for entry in goals}


def test_goals_are_pending_in_order_of_arrival():
    goals = filled()
    assert states(goals) == dict.fromkeys("abcd", ServerState.PENDING)
    assert [entry.status() for entry in goals][1] == {
        "goal_id": {"stamp": {"secs": 0, "nsecs": 2}, "id": "b"},
        "status": 0,
        "text": "",
    }


def test_known_goal_is_not_accepted_twice():
    goals = filled()
    (entry, *_) = goals
    entry.set_state(ServerState.ACTIVE)
    assert goals.add("a", Time(9), "other", NOW) is None
    assert (entry.asked, entry.stamp, entry.state) == ("a", Time(1), ServerState.ACTIVE)


@pytest.mark.parametrize(
    ("goal", "until", "chosen"),
    [
        ("", 0, "abcd"),
        ("c", 0, "c"),
        ("", 2, "ab"),
        ("", 9, "abcd"),
        ("d", 2, "abd"),
        ("a", 1, "a"),
        ("x", 0, ""),
    ],
)
def test_which_goals_a_request_means(goal, until, chosen):
    goals = filled()
    assert [entry.id for entry in goals.select(goal, Time(until), NOW)] == list(chosen)


@pytest.mark.parametrize("state", ServerState)
def test_only_goals_that_wait_or_run_can_be_cancelled(state):
    goals = filled()
    for entry in goals:
        entry.set_state(state)
    chosen = goals.select("", Time(), NOW)
    assert bool(chosen) is (state in (ServerState.PENDING, ServerState.ACTIVE))


def test_cancel_request_before_its_goal_recalls_it():
    goals = GoalList()
    assert goals.select("late", Time(), NOW) == []
    assert states(goals) == {"late": ServerState.RECALLING}
    entry = goals.add("late", Time(7), "asked", NOW + 1)
    assert entry is not None
    assert (entry.state, entry.asked, entry.stamp) == (ServerState.RECALLED, "asked", Time(7))
    assert goals.add("late", Time(7), "asked", NOW + 2) is None


def test_such_a_request_is_forgotten_after_a_while():
    goals = GoalList(5.0)
    goals.select("late", Time(), NOW)
    goals.expire(NOW + 4.9)
    assert states(goals)
    goals.expire(NOW + 5.1)
    assert not states(goals)
    entry = goals.add("late", Time(7), "asked", NOW + 6)
    assert entry is not None
    assert entry.state is ServerState.PENDING


def test_goals_up_to_the_time_of_an_earlier_request_are_recalled():
    goals = GoalList()
    goals.select("", Time(5), NOW)
    goals.select("", Time(3), NOW)
    taken = [goals.add(f"g{stamp}", Time(stamp), "asked", NOW) for stamp in (4, 5, 6)]
    assert [entry.state for entry in taken if entry] == [
        ServerState.RECALLED,
        ServerState.RECALLED,
        ServerState.PENDING,
    ]


def test_cancelling_everything_does_not_touch_later_goals():
    goals = filled()
    assert len(goals.select("", Time(), NOW)) == 4
    entry = goals.add("e", Time(5), "asked", NOW)
    assert entry is not None
    assert entry.state is ServerState.PENDING


def test_goals_stay_for_a_while_after_their_end():
    goals = filled()
    first, second, *_ = goals
    for entry in (first, second):
        entry.set_state(ServerState.SUCCEEDED)
        goals.end(entry, NOW)
    goals.add("b", Time(2), "b", NOW + 3)  # sent again: it stays longer
    goals.expire(NOW + 6)
    assert list(states(goals)) == ["b", "c", "d"]
    goals.expire(NOW + 9)
    assert list(states(goals)) == ["c", "d"]


def test_goals_that_have_ended_are_bounded():
    goals = filled()
    numbers = itertools.count()
    for number in itertools.islice(numbers, _MAX_ENDED + 50):
        goals.select(f"unknown {number}", Time(), NOW + number / 1e6)
    goals.expire(NOW + 1)
    left = list(states(goals))
    assert len(left) == _MAX_ENDED + 4
    assert left[:5] == ["a", "b", "c", "d", "unknown 50"]
